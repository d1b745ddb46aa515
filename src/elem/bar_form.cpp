#include "elem/bar_form.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace {

template <int D>
constexpr int STRAINS = D == 2 ? 4 : 6;                // 11 22 33 12 (23 31)

// an integration point at one end of the step
template <int D>
struct BarPoint {
  const double* H;
  double theta;                // ln J, without NLGEOM tr H
  double E[6];                 // Ebar
  double a;                    // (Jbar/J)^(2/3)
};

template <int D>
struct BarEnd {
  std::vector<BarPoint<D>> point;      // [ngp]
  double mean;                         // thetabar
};

// Work arrays of the kernel; kept from call to call, so that nothing is allocated
template <int D>
struct Work {
  BarEnd<D> n, np1;                    // n: only when the mode reads it
  std::vector<double> beta, mean;      // [ngp][nn*dim] d theta/du of the step, [nn*dim] its mean
  std::vector<double> G, CG;           // [6][nn*dim] d Ebar/du, C times it
  std::vector<double> S;               // [ngp][6]
  std::vector<double> C;               // [ngp][36]
  std::vector<double> pressure;        // [ngp] S : Cbar / 3
  double volume;
};

template <int D>
bool theta_of(bool finite, const double* H, double& theta)
{
  if (!finite) {
    theta = 0.0;
    for (int i = 0; i < D; ++i) theta += H[i * D + i];
    return true;
  }
  // J - 1, so that small strains lose no digits
  double v = 0.0;
  for (int i = 0; i < D; ++i) v += H[i * D + i];
  if (D == 2) {
    v += H[0] * H[3] - H[1] * H[2];
  } else {
    const double b = H[4], c = H[D * D - 1];
    v += H[0] * b + b * c + c * H[0] - H[1] * H[3] - H[5] * H[7] - H[2] * H[6];
    v += H[0] * (b * c - H[5] * H[7]) - H[1] * (H[3] * c - H[5] * H[6]) + H[2] * (H[3] * H[7] - b * H[6]);
  }
  if (!(v > -1.0)) return false;
  theta = std::log1p(v);
  return true;
}

// Ebar of H with thetabar - theta; returns a = (Jbar/J)^(2/3)
template <int D>
double strain_bar(bool finite, const double* H, double more, double* six)
{
  double E[D * D];
  ip_strain<D>(finite, H, E);
  six_components<D>(E, six);
  if (!finite) {
    for (int i = 0; i < 3; ++i) six[i] += more / 3.0;
    return 1.0;
  }
  const double a1 = std::expm1(2.0 / 3.0 * more);      // a - 1
  for (int i = 0; i < 6; ++i) six[i] += a1 * six[i] + (i < 3 ? 0.5 * a1 : 0.0);
  return 1.0 + a1;
}

// d theta / d H of the step, with d theta = theta1 - theta0 exactly when mid                   (1.17)
template <int D>
void theta_gradient(const KernelMode& mode, const BarPoint<D>& zero, const BarPoint<D>& one, double* g)
{
  if (!mode.finite) {
    for (int k = 0; k < D * D; ++k) g[k] = k % (D + 1) == 0 ? 1.0 : 0.0;
    return;
  }
  if (!mode.mid) {
    ip_cofactor<D>(one.H, g);
    for (int k = 0; k < D * D; ++k) g[k] *= std::exp(-one.theta);
    return;
  }
  // of C and not of F, which conserves angular momentum: det C is cubic in C, Simpson's rule is exact
  double A0[D * D], A1[D * D], Am[D * D], c0[D * D], c1[D * D], cm[D * D];             // C - I
  ip_strain<D>(true, zero.H, A0);
  ip_strain<D>(true, one.H, A1);
  for (int k = 0; k < D * D; ++k) {
    Am[k] = A0[k] + A1[k];
    A0[k] *= 2.0;
    A1[k] *= 2.0;
  }
  ip_cofactor<D>(A0, c0);
  ip_cofactor<D>(Am, cm);
  ip_cofactor<D>(A1, c1);
  // the slope of the logarithm between J0^2 and J1^2
  const double d = 2.0 * (one.theta - zero.theta), r = std::expm1(d);
  const double L = (r == 0.0 ? 1.0 : d / r) * std::exp(-2.0 * zero.theta) / 6.0;
  for (int k = 0; k < D * D; ++k) cm[k] = L * (c0[k] + 4.0 * cm[k] + c1[k]);
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) {
      g[i * D + j] = cm[i * D + j];
      for (int k = 0; k < D; ++k)
        g[i * D + j] += 0.5 * (zero.H[i * D + k] + one.H[i * D + k]) * cm[k * D + j];
    }
}

// 2/3 a between both ends: the slope of a = exp(2/3 x)
double scale_slope(const KernelMode& mode, double x0, double x1)
{
  if (!mode.mid) return 2.0 / 3.0 * std::exp(2.0 / 3.0 * x1);
  const double d = (x1 - x0) / 3.0;
  return 2.0 / 3.0 * std::exp((x0 + x1) / 3.0) * (std::fabs(d) < 1e-6 ? 1.0 + d * d / 6.0 : std::sinh(d) / d);
}

// one end of the step, from its displacement gradients; false: det F <= 0
template <int D>
bool strains(const BarGroup& g, bool finite, const double* H, BarEnd<D>& end)
{
  double volume = 0.0;
  end.mean = 0.0;
  end.point.resize(g.ngp);
  for (int q = 0; q < g.ngp; ++q) {
    BarPoint<D>& b = end.point[q];
    b.H = H + q * D * D;
    if (!theta_of<D>(finite, b.H, b.theta)) return false;
    end.mean += g.w[q] * b.theta;
    volume += g.w[q];
  }
  end.mean /= volume;
  for (BarPoint<D>& b : end.point) b.a = strain_bar<D>(finite, b.H, end.mean - b.theta, b.E);
  return true;
}

// C = F^T F at one end of the step [6], tensor components; 33 of a plane problem is 1
template <int D>
void right_cauchy(const double* H, double* six)
{
  double E[D * D];
  ip_strain<D>(true, H, E);
  six_components<D>(E, six);
  for (int i = 0; i < 6; ++i) six[i] = 2.0 * six[i] + (i < 3 ? 1.0 : 0.0);
}

// F of the step: at t(n+1), in the middle; without NLGEOM I
template <int D>
void deformation(const KernelMode& mode, const BarPoint<D>& zero, const BarPoint<D>& one, double* F)
{
  for (int k = 0; k < D * D; ++k)
    F[k] = !mode.finite ? 0.0 : mode.mid ? 0.5 * (zero.H[k] + one.H[k]) : one.H[k];
  for (int i = 0; i < D; ++i) F[i * D + i] += 1.0;
}

// a of the step
template <int D>
double scale_of(const KernelMode& mode, const BarPoint<D>& zero, const BarPoint<D>& one)
{
  return mode.mid ? 0.5 * (zero.a + one.a) : one.a;
}

// v = dEbar / d(thetabar - theta) of the step at point q, components of a tensor               [6]
template <int D>
void volume_strain(const KernelMode& mode, const Work<D>& w, int q, double* v)
{
  for (int i = 0; i < 6; ++i) v[i] = i < 3 ? 1.0 / 3.0 : 0.0;
  if (!mode.finite) return;
  const BarPoint<D>&zero = w.n.point[q], &one = w.np1.point[q];
  double C0[6], C1[6];
  right_cauchy<D>(one.H, C1);
  if (mode.mid) right_cauchy<D>(zero.H, C0);
  const double slope = scale_slope(mode, mode.mid ? w.n.mean - zero.theta : 0.0, w.np1.mean - one.theta);
  for (int i = 0; i < 6; ++i) v[i] = 0.5 * slope * (mode.mid ? 0.5 * (C0[i] + C1[i]) : C1[i]);
}

// d theta/du of the step: beta of each point, and its mean
template <int D>
void volume_gradients(const BarGroup& g, const KernelMode& mode, Work<D>& w)
{
  const int nd = g.nn * D;
  w.volume     = 0.0;
  w.beta.resize(static_cast<size_t>(g.ngp) * nd);
  w.mean.assign(nd, 0.0);
  for (int q = 0; q < g.ngp; ++q) {
    double grad[D * D];
    theta_gradient<D>(mode, w.n.point[q], w.np1.point[q], grad);
    const double* dN = g.dNdX + static_cast<size_t>(q) * nd;
    double* beta     = &w.beta[static_cast<size_t>(q) * nd];
    for (int a = 0; a < g.nn; ++a)
      for (int i = 0; i < D; ++i) {
        double sum = 0.0;
        for (int j = 0; j < D; ++j) sum += grad[i * D + j] * dN[a * D + j];
        beta[a * D + i] = sum;
        w.mean[a * D + i] += g.w[q] * sum;
      }
    w.volume += g.w[q];
  }
  for (double& m : w.mean) m /= w.volume;
}

// S and, when tangent is set, C of all points; false: as law_step
template <int D>
bool stresses(const BarGroup& g, const KernelMode& mode, bool old, const HistoryStep* h, bool tangent,
              Work<D>& w)
{
  const double none[6] = {0};
  w.S.resize(6 * static_cast<size_t>(g.ngp));
  w.C.resize(36 * static_cast<size_t>(g.ngp));
  for (int q = 0; q < g.ngp; ++q)
    if (!law_step(*g.law, mode, old ? w.n.point[q].E : none, w.np1.point[q].E, h[q].n, h[q].np1,
                  &w.S[6 * static_cast<size_t>(q)], tangent ? &w.C[36 * static_cast<size_t>(q)] : nullptr))
      return false;
  return true;
}

// pressure of the volume penalty at point q: penalty times the step mean of theta - thetabar (1.14a)
template <int D>
double penalty_pressure(const BarGroup& g, const KernelMode& mode, const Work<D>& w, int q)
{
  if (g.volume_penalty == 0.0) return 0.0;
  const double one = w.np1.point[q].theta - w.np1.mean;
  return g.volume_penalty * (mode.mid ? 0.5 * (one + w.n.point[q].theta - w.n.mean) : one);
}

// G = dEbar/du of point q, and its force, which is added to re                               (1.16)
template <int D>
void add_force(const BarGroup& g, const KernelMode& mode, int q, Work<D>& w, double* re)
{
  using V = VoigtIndex<3>;
  const int nd = g.nn * D;
  const double *dN = g.dNdX + static_cast<size_t>(q) * nd, *beta = &w.beta[static_cast<size_t>(q) * nd],
               *S = &w.S[6 * static_cast<size_t>(q)];
  const double am = scale_of(mode, w.n.point[q], w.np1.point[q]);
  double Fb[D * D], v[6];
  deformation<D>(mode, w.n.point[q], w.np1.point[q], Fb);
  volume_strain<D>(mode, w, q, v);
  const double penalty = penalty_pressure<D>(g, mode, w, q);
  double p = 0.0;
  for (int i = 0; i < 6; ++i) p += (i < 3 ? 1.0 : 2.0) * S[i] * v[i];
  w.pressure[q] = p;
  for (int i = 3; i < 6; ++i) v[i] *= 2.0;             // engineering shear
  for (int a = 0; a < g.nn; ++a)
    for (int k = 0; k < D; ++k) {
      const int col   = a * D + k;
      const double* n = dN + a * D;
      const double d  = w.mean[col] - beta[col];
      double f = 0.0;
      for (int i = 0; i < STRAINS<D>; ++i) {
        const int r = V::row[i], c = V::col[i];
        double B = 0.0;
        if (r < D && c < D) B = r == c ? Fb[k * D + r] * n[r] : Fb[k * D + r] * n[c] + Fb[k * D + c] * n[r];
        const double G = am * B + v[i] * d;
        w.G[i * nd + col] = G;
        f += G * S[i];
      }
      re[col] += g.w[q] * (f - penalty * d);
    }
}

// ke += w G^T C G of point q, with G in w
template <int D>
void add_stress_tangent(const BarGroup& g, int q, Work<D>& w, double* ke)
{
  const int nd    = g.nn * D;
  const double* C = &w.C[36 * static_cast<size_t>(q)];
  for (int i = 0; i < STRAINS<D>; ++i)
    for (int col = 0; col < nd; ++col) {
      double sum = 0.0;
      for (int j = 0; j < STRAINS<D>; ++j) sum += C[i * 6 + j] * w.G[j * nd + col];
      w.CG[i * nd + col] = g.w[q] * sum;
    }
  for (int a = 0; a < g.nn; ++a)
    for (int c = 0; c <= a; ++c) {
      double* k = ke + pair_index(a, c) * D * D;
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) {
          double sum = 0.0;
          for (int r = 0; r < STRAINS<D>; ++r) sum += w.G[r * nd + a * D + i] * w.CG[r * nd + c * D + j];
          k[i * D + j] += sum;
        }
    }
}

// the geometric tangent of point q                                                           (1.18)
template <int D>
void add_geometric_tangent(const BarGroup& g, const KernelMode& mode, double mean_pressure, int q, Work<D>& w,
                           double* ke)
{
  const int nd     = g.nn * D;
  const double *dN = g.dNdX + static_cast<size_t>(q) * nd, *beta = &w.beta[static_cast<size_t>(q) * nd];
  double S[D * D], Fb[D * D];
  full_tensor<D>(&w.S[6 * static_cast<size_t>(q)], S);
  deformation<D>(mode, w.n.point[q], w.np1.point[q], Fb);
  const double am = scale_of(mode, w.n.point[q], w.np1.point[q]), cg = mode.cG();
  const double p     = w.pressure[q];
  const double kappa = cg * g.w[q] * (mean_pressure - p + penalty_pressure<D>(g, mode, w, q));
  const double both  = cg * g.w[q] * (2.0 / 3.0 * p + g.volume_penalty);
  double* qa = w.G.data();                             // [nn*dim] w cg 2/3 a Fb S dN_a
  double* sn = w.CG.data();                            // [nn*dim] w cg a S dN_a
  for (int a = 0; a < g.nn; ++a) {
    for (int i = 0; i < D; ++i) {
      double sum = 0.0;
      for (int j = 0; j < D; ++j) sum += S[i * D + j] * dN[a * D + j];
      sn[a * D + i] = g.w[q] * cg * am * sum;
    }
    for (int i = 0; i < D; ++i) {
      double sum = 0.0;
      for (int j = 0; j < D; ++j) sum += Fb[i * D + j] * sn[a * D + j];
      qa[a * D + i] = 2.0 / 3.0 * sum;
    }
  }
  for (int a = 0; a < g.nn; ++a)
    for (int c = 0; c <= a; ++c) {
      double* k  = ke + pair_index(a, c) * D * D;
      double geo = 0.0;
      for (int j = 0; j < D; ++j) geo += sn[a * D + j] * dN[c * D + j];
      for (int i = 0; i < D; ++i) {
        const double da = w.mean[a * D + i] - beta[a * D + i];
        for (int j = 0; j < D; ++j) {
          const double dc = w.mean[c * D + j] - beta[c * D + j];
          k[i * D + j] += qa[a * D + i] * dc + da * qa[c * D + j] + both * da * dc -
                          kappa * beta[a * D + j] * beta[c * D + i];
        }
        k[i * D + i] += geo;
      }
    }
}

template <int D>
Status form(const BarGroup& g, const KernelMode& mode, const double* H0, const double* H1,
            const HistoryStep* h, double* re, double* ke)
{
  static thread_local Work<D> w;
  const int nd   = g.nn * D;
  const bool old = mode_reads_old(mode, *g.law);
  std::fill_n(re, nd, 0.0);
  if (ke) std::fill_n(ke, pair_count(g.nn) * D * D, 0.0);

  // 1. strains and the derivatives of the volumes
  w.n.point.resize(g.ngp);
  if (!strains<D>(g, mode.finite, H1, w.np1) || (old && !strains<D>(g, mode.finite, H0, w.n)))
    return BAD_JACOBIAN;
  volume_gradients<D>(g, mode, w);

  // 2. stresses
  if (!stresses<D>(g, mode, old, h, ke, w)) return BAD_JACOBIAN;

  // 3. force, and the material tangent
  double mean_pressure = 0.0;
  w.G.resize(static_cast<size_t>(6) * nd);
  w.CG.resize(static_cast<size_t>(6) * nd);
  w.pressure.resize(g.ngp);
  for (int q = 0; q < g.ngp; ++q) {
    add_force<D>(g, mode, q, w, re);
    if (ke) add_stress_tangent<D>(g, q, w, ke);
    mean_pressure += g.w[q] * w.pressure[q] / w.volume;
  }
  if (!ke || !mode.finite) return STATUS_OK;

  // 4. geometric tangent
  for (int q = 0; q < g.ngp; ++q) add_geometric_tangent<D>(g, mode, mean_pressure, q, w, ke);
  return STATUS_OK;
}

template <int D>
bool all_strains(const BarGroup& g, bool finite, const double* H, double* E, double* scale)
{
  BarEnd<D> end;
  if (!strains<D>(g, finite, H, end)) return false;
  for (int q = 0; q < g.ngp; ++q) {
    std::copy_n(end.point[q].E, 6, E + 6 * q);
    if (scale) scale[q] = std::sqrt(end.point[q].a);
  }
  return true;
}

}  // namespace

bool bar_strains(const BarGroup& g, bool finite, const double* H, double* E, double* scale)
{
  return g.dim == 2 ? all_strains<2>(g, finite, H, E, scale) : all_strains<3>(g, finite, H, E, scale);
}

Status bar_form(const BarGroup& g, const KernelMode& mode, const double* H0, const double* H1,
                const HistoryStep* h, double* re, double* ke)
{
  return g.dim == 2 ? form<2>(g, mode, H0, H1, h, re, ke) : form<3>(g, mode, H0, H1, h, re, ke);
}
