// ---------------------------------------------------------------------------
// law_ortho.cpp : orthotropic elastic material, S = D : E, D in the axes of the model (2.42), (2.43)
// ---------------------------------------------------------------------------
#include "mat/law.h"
#include "mat/voigt.h"

bool law_ortho(const MatLaw& law, bool, const double* E, const double*, double*, bool tangent, LawOutput& out)
{
  const RealVec& D = law.material->elastic;
  six_times(D.data(), E, out.S);
  out.psi = 0.5 * six_dot(out.S, E);
  for (int i = 0; tangent && i < 36; ++i) out.D[i] = D[i];
  return true;
}
