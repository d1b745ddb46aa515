#include "deck/card.h"

// *SOLVER, TYPE=AUTO|MUMPS|SKYLINE
void kw_solver(Card& card, Model& model)
{
  const SolverKind kind[3] = {SOLVER_AUTO, SOLVER_MUMPS, SOLVER_SKYLINE};
  const int word = card_param_word(card, "TYPE", "AUTO|MUMPS|SKYLINE", 0);
  model.solver.kind = kind[word < 0 ? 0 : word];
}
