// ---------------------------------------------------------------------------
// law_ortho.cpp : orthotropic elastic material, S = D : E, D in the directions of the model (2.42), (2.43)
// ---------------------------------------------------------------------------
#include "mat/law.h"

bool law_ortho(const MatLaw& law, bool, const double* E, const double*, double*, bool tangent, LawOutput& out)
{
  const RealVec& D = law.material->elastic;
  out.psi = 0.0;
  for (int i = 0; i < 6; ++i) {
    out.S[i] = 0.0;
    for (int j = 0; j < 6; ++j) out.S[i] += D[6 * i + j] * E[j] * (j < 3 ? 1.0 : 2.0);
    out.psi += 0.5 * out.S[i] * E[i] * (i < 3 ? 1.0 : 2.0);
  }
  for (int i = 0; tangent && i < 36; ++i) out.D[i] = D[i];
  return true;
}
