// ---------------------------------------------------------------------------
// law_neo_hooke.cpp : compressible neo-Hookean material (doc/theory.md (2.22), (2.23))
//
//   psi = C10 (J^-2/3 tr C - 3) + (J - 1)^2 / D1,   2 C10 = mu,  2 / D1 = K
// ---------------------------------------------------------------------------
#include <cmath>

#include "mat/law.h"
#include "mat/voigt.h"

bool law_neo_hooke(const MatLaw& law, bool finite, const double* E, const double* h_n, double* h_np1,
                   bool tangent, LawOutput& out)
{
  if (!finite) return law_svk(law, finite, E, h_n, h_np1, tangent, out);
  const double K = bulk_modulus(law);
  // A = C - I = 2 E; invariants of A avoid cancellation at small strains
  double A[6];
  for (int i = 0; i < 6; ++i) A[i] = 2.0 * E[i];
  const double i1 = A[0] + A[1] + A[2];
  const double i2 = A[0] * A[1] + A[1] * A[2] + A[2] * A[0] - A[3] * A[3] - A[4] * A[4] - A[5] * A[5];
  const double i3 = A[0] * (A[1] * A[2] - A[4] * A[4]) - A[3] * (A[3] * A[2] - A[4] * A[5]) +
                    A[5] * (A[3] * A[4] - A[1] * A[5]);
  const double x = i1 + i2 + i3;                       // J^2 - 1
  const double c0 = 1.0 + A[0], c1 = 1.0 + A[1], c2 = 1.0 + A[2];
  if (!(x > -1.0 && c0 > 0.0 && c0 * c1 > A[3] * A[3])) return false;
  const double J = std::sqrt(1.0 + x), v = x / (1.0 + J);        // v = J - 1
  const double y = std::expm1(-std::log1p(x) / 3.0);             // J^-2/3 - 1
  const double iso = 1.0 + y;
  // J^-2/3 tr C - 3, of the order of E^2, without terms of the order of E: u = J^2/3
  const double r = std::expm1(std::log1p(x) / 3.0), u = 1.0 + r;
  out.psi = 0.5 * law.mu * (r * r * (u + 2.0) - i2 - i3) / u + 0.5 * K * v * v;
  const double det = J * J;
  const double B[6] = {(c1 * c2 - A[4] * A[4]) / det,   (c0 * c2 - A[5] * A[5]) / det,
                       (c0 * c1 - A[3] * A[3]) / det,   (A[5] * A[4] - A[3] * c2) / det,
                       (A[3] * A[5] - c0 * A[4]) / det, (A[3] * A[4] - A[5] * c1) / det};   // C^-1
  using V = VoigtIndex<3>;
  // mu J^-2/3 C^-1 dev C, with dev C = dev A
  for (int k = 0; k < 6; ++k) {
    double s = 0.0;
    for (int l = 0; l < 3; ++l)
      s += B[six_at[V::row[k]][l]] * (A[six_at[l][V::col[k]]] - (l == V::col[k] ? i1 / 3.0 : 0.0));
    out.S[k] = law.mu * iso * s + K * v * J * B[k];
  }
  if (!tangent) return true;
  const double I1 = 3.0 + i1, m = 2.0 / 3.0 * law.mu * iso;
  const double both = m * I1 / 3.0 + K * (2.0 * J - 1.0) * J, turn = m * I1 - 2.0 * K * v * J;
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b < 6; ++b) {
      const int i = V::row[a], j = V::col[a], k = V::row[b], l = V::col[b];
      const double sym = 0.5 * (B[six_at[i][k]] * B[six_at[j][l]] + B[six_at[i][l]] * B[six_at[j][k]]);
      const double trace = (i == j ? B[b] : 0.0) + (k == l ? B[a] : 0.0);
      out.D[a * 6 + b] = -m * trace + both * B[a] * B[b] + turn * sym;
    }
  return true;
}
