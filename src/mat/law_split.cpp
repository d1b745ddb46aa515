// ---------------------------------------------------------------------------
// law_split : broken material without history, psi = c psi+ + psi-                     (2.5) - (2.18)
//
// In 2D the tensors of the kernel are 2 x 2. An inadmissible strain gives NaN, and the step is rejected
// ---------------------------------------------------------------------------
#include <algorithm>

#include "mat/law.h"
#include "mat/split_step.h"

namespace {

const int in_plane[3] = {0, 1, 3};

void plane_to_six(const double* S, const double* C, double* S6, double* C6)
{
  six_components<2>(S, S6);
  if (!C) return;
  std::fill_n(C6, 36, 0.0);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) C6[in_plane[i] * 6 + in_plane[j]] = C[i * 3 + j];
}

void plane_of_six(const double* E6, double* E)
{
  E[0] = E6[0];
  E[1] = E[2] = E6[3];
  E[3] = E6[1];
}

}  // namespace

bool law_split(const MatLaw& law, bool finite, const double* E, const double*, double*, bool tangent,
               LawOutput& out)
{
  if (law.plane == PLANE_STRESS) {
    double flat[4], S[4], C[9];
    plane_of_six(E, flat);
    split_eroded(law, 2, law.split, finite, law.c, flat, law.N, &out.psi, S, tangent ? C : nullptr);
    plane_to_six(S, tangent ? C : nullptr, out.S, out.D);
    return true;
  }
  SplitOut o;
  split_full(law, law.split, finite, E, law.N, o, tangent);
  out.psi = law.c * o.psi_plus + o.psi_minus;
  for (int k = 0; k < 6; ++k) out.S[k] = law.c * o.Sp[k] + o.Sm[k];
  for (int k = 0; k < 36 && tangent; ++k) out.D[k] = law.c * o.Cp[k] + o.Cm[k];
  return true;
}

bool law_split_step(const MatLaw& law, const KernelMode& mode, const double* E0, const double* E1,
                    const double*, double*, double* S, double* C)
{
  double start[9], end[9], stress[9], tangent[9];
  if (law.plane == PLANE_NONE || (law.plane == PLANE_STRAIN && law.initial >= 0)) {    // E33 of the start
    MatLaw space = law;
    space.plane  = PLANE_NONE;
    full_tensor<3>(E0, start);
    full_tensor<3>(E1, end);
    split_stress<3>(space, mode, start, end, stress, C);
    six_components<3>(stress, S);
    return true;
  }
  plane_of_six(E0, start);
  plane_of_six(E1, end);
  split_stress<2>(law, mode, start, end, stress, C ? tangent : nullptr);
  plane_to_six(stress, C ? tangent : nullptr, S, C);
  return true;
}
