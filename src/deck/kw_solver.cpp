#include "deck/card.h"

// *SOLVER, TYPE=AUTO|SKYLINE|MUMPS|CG|AMG, REUSE=YES|NO, PRECONDITIONER=AUTO|DIAGONAL|CHOLESKY|FACTORS
void kw_solver(Card& card, Model& model)
{
  const SolverKind kind[5] = {SOLVER_AUTO, SOLVER_MUMPS, SOLVER_SKYLINE, SOLVER_CG, SOLVER_AMG};
  const Preconditioner precond[4] = {PRECOND_AUTO, PRECOND_DIAGONAL, PRECOND_CHOLESKY, PRECOND_FACTORS};
  SolverDef& s   = model.solver;
  const int type = card_param_word(card, "TYPE", "AUTO|MUMPS|SKYLINE|CG|AMG", 0);
  const int word = card_param_word(card, "PRECONDITIONER", "AUTO|DIAGONAL|CHOLESKY|FACTORS", 0);
  s.kind    = kind[type < 0 ? 0 : type];
  s.precond = precond[word < 0 ? 0 : word];
  s.reuse   = card_param_yes(card, "REUSE", false, true);
  if (type >= 0 && s.kind != SOLVER_CG && card_param(card, "PRECONDITIONER"))
    card_error(card, card_param(card, "PRECONDITIONER")->value,
               "PRECONDITIONER requires TYPE=CG: add TYPE=CG, or leave it out");
  if (s.kind == SOLVER_CG && !s.reuse)
    card_error(
        card, card_param(card, "REUSE")->value,
        "REUSE=NO requires a factorisation in each iteration, but TYPE=CG has none: leave out one of them");
  if (s.kind == SOLVER_AMG && !s.reuse)
    card_error(card, card_param(card, "REUSE")->value,
               "REUSE=NO requires a factorisation in each iteration, but TYPE=AMG has none: leave out one of "
               "them");
#ifndef MPFE_PETSC
  if (s.kind == SOLVER_AMG)
    card_error(card, card_param(card, "TYPE")->value,
               "TYPE=AMG needs PETSc, which is missing in this build: use TYPE=AUTO or CG, or "
               "install PETSc (tools/setup) and build again");
#endif
}
