#include "deck/card.h"

// *SOLVER, TYPE=AUTO|SKYLINE|MUMPS|CG, REUSE=YES|NO, PRECONDITIONER=AUTO|DIAGONAL|CHOLESKY|FACTORS
void kw_solver(Card& card, Model& model)
{
  const SolverKind kind[4] = {SOLVER_AUTO, SOLVER_MUMPS, SOLVER_SKYLINE, SOLVER_CG};
  const Preconditioner precond[4] = {PRECOND_AUTO, PRECOND_DIAGONAL, PRECOND_CHOLESKY, PRECOND_FACTORS};
  SolverDef& s   = model.solver;
  const int type = card_param_word(card, "TYPE", "AUTO|MUMPS|SKYLINE|CG", 0);
  const int word = card_param_word(card, "PRECONDITIONER", "AUTO|DIAGONAL|CHOLESKY|FACTORS", 0);
  s.kind    = kind[type < 0 ? 0 : type];
  s.precond = precond[word < 0 ? 0 : word];
  s.reuse   = card_param_yes(card, "REUSE", false, true);
  if (type >= 0 && s.kind != SOLVER_CG && card_param(card, "PRECONDITIONER"))
    card_error(card, card_param(card, "PRECONDITIONER")->value,
               "only TYPE=CG takes a PRECONDITIONER: add TYPE=CG, or leave it out");
  if (s.kind == SOLVER_CG && !s.reuse)
    card_error(
        card, card_param(card, "REUSE")->value,
        "REUSE=NO asks for a factorisation in each iteration, and TYPE=CG makes none: leave one of them out");
}
