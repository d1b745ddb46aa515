// F-bar: force against energy, tangent against force, the step of energy-momentum. Case A17.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "elem/bar_form.h"
#include "samples.h"
#include "shape/shape.h"

namespace {

// a distorted quadrilateral or brick
struct Element {
  Material material;
  MatLaw law;
  BarGroup g;
  RealVec dNdX, w, h;
  // hold: of groups of material points that flow
  Element(int dim, LawKind kind, double hold = 0.0) : material(material_of(kind, 0.45, {1.0, 6.0}, {0.0, 1.0}))
  {
    law = mat_law(material, dim == 2 ? PLANE_STRAIN : PLANE_NONE);
    const Shape shape = dim == 2 ? SHAPE_QUAD4 : SHAPE_HEX8;
    const GaussRule& rule = gauss_rule(shape);
    const double quad[8]  = {0, 0, 1.2, 0.1, 1.1, 0.9, -0.1, 1.0};
    double X[24], N[8], dN[24], x[24];
    for (int a = 0; a < (dim == 2 ? 4 : 8); ++a)
      for (int i = 0; i < dim; ++i) X[a * dim + i] = i < 2 ? quad[2 * (a % 4) + i] : (a < 4 ? 0.0 : 1.0 + 0.1 * a);
    for (int q = 0; q < rule.n; ++q) {
      shape_eval(shape, rule.xi[q], N, dN);
      const double det = shape_jacobian(shape, dN, X, x);
      dNdX.insert(dNdX.end(), x, x + shape_info[shape].nen * dim);
      w.push_back(det * rule.w[q]);
    }
    h.assign(MAX_HISTORY * w.size(), 0.0);
    g = {dim, rule.n, shape_info[shape].nen, dNdX.data(), w.data(), &law, hold};
  }
  int nd() const { return g.nn * g.dim; }
  RealVec gradients(const RealVec& u) const
  {
    const int dd = g.dim * g.dim;
    RealVec H(w.size() * dd);
    for (int q = 0; q < g.ngp; ++q) {
      const double* dN = &dNdX[static_cast<size_t>(q) * nd()];
      if (g.dim == 2) ip_gradient<2, 0>(dN, g.nn, u.data(), &H[q * dd]);
      else ip_gradient<3, 0>(dN, g.nn, u.data(), &H[q * dd]);
    }
    return H;
  }
  Status form(const KernelMode& mode, const RealVec& u0, const RealVec& u1, RealVec& re, RealVec* ke,
              RealVec* h1 = nullptr)
  {
    RealVec none(h.size(), 0.0);
    re.resize(nd());
    if (ke) ke->resize(static_cast<size_t>(pair_count(g.nn)) * g.dim * g.dim);
    std::vector<HistoryStep> step;
    for (size_t q = 0; q < w.size(); ++q)
      step.push_back({&h[MAX_HISTORY * q], (h1 ? h1->data() : none.data()) + MAX_HISTORY * q});
    return bar_form(g, mode, gradients(u0).data(), gradients(u1).data(), step.data(), re.data(),
                    ke ? ke->data() : nullptr);
  }
  // stored and dissipated energy at u, from a history
  double energy(bool finite, const RealVec& u, const RealVec& from)
  {
    RealVec E(6 * w.size());
    double sum = 0.0, h1[MAX_HISTORY] = {0};
    RealVec scale(w.size());
    EXPECT_TRUE(bar_strains(g, finite, gradients(u).data(), E.data(), scale.data()));
    for (size_t q = 0; q < w.size(); ++q) {
      LawOutput out;
      EXPECT_TRUE(law_update(law, finite, &E[6 * q], &from[MAX_HISTORY * q], h1, false, out));
      sum += w[q] * (out.psi + (law.kind == LAW_J2 ? h1[HISTORY_DISSIPATED] : 0.0));
      sum += w[q] * 4.5 * g.volume_penalty * std::pow(std::log(scale[q]), 2);        // thetabar - theta = 3 ln scale
    }
    return sum;
  }
};

RealVec random_vector(std::mt19937& gen, int n, double size)
{
  std::uniform_real_distribution<double> any(-size, size);
  RealVec v(n);
  for (double& x : v) x = any(gen);
  return v;
}

double entry(const RealVec& ke, int dim, int i, int j)
{
  const int a = i / dim, b = j / dim;
  return a >= b ? ke[pair_index(a, b) * dim * dim + (i % dim) * dim + j % dim]
                : ke[pair_index(b, a) * dim * dim + (j % dim) * dim + i % dim];
}

}  // namespace

TEST(Bar, ForceIsTheDerivativeOfTheEnergyAndTangentThatOfTheForce)
{
  std::mt19937 gen(11);
  for (int dim : {2, 3})
    for (LawKind kind : {LAW_SVK, LAW_NEO_HOOKE, LAW_J2})
      for (int variant = 0; variant < 3; ++variant) {          // only what moves far is held
        const bool finite = variant > 0;
        Element e(dim, kind, variant == 2 ? 0.3 : 0.0);
        KernelMode mode;
        mode.finite = finite;
        RealVec u = random_vector(gen, e.nd(), 0.1), re, up, down, ke, h1(e.h);
        ASSERT_EQ(e.form(mode, u, u, re, nullptr, &h1), STATUS_OK);
        e.h = h1;
        for (double& x : u) x *= 1.4;
        ASSERT_EQ(e.form(mode, u, u, re, &ke), STATUS_OK);
        const double h = 1e-6;
        for (int j = 0; j < e.nd(); ++j) {
          RealVec a = u, b = u;
          a[j] += h;
          b[j] -= h;
          EXPECT_NEAR((e.energy(finite, a, e.h) - e.energy(finite, b, e.h)) / (2 * h), re[j], 1e-6)
              << dim << kind << finite;
          ASSERT_EQ(e.form(mode, a, a, up, nullptr), STATUS_OK);
          ASSERT_EQ(e.form(mode, b, b, down, nullptr), STATUS_OK);
          for (int i = 0; i < e.nd(); ++i)
            EXPECT_NEAR((up[i] - down[i]) / (2 * h), entry(ke, dim, i, j), 1e-4) << dim << kind << finite;
        }
      }
}

TEST(Bar, EnergyMomentumStepStoresAndDissipatesTheWork)
{
  std::mt19937 gen(12);
  for (int dim : {2, 3})
    for (LawKind kind : {LAW_SVK, LAW_NEO_HOOKE, LAW_J2}) {
      Element e(dim, kind, kind == LAW_NEO_HOOKE ? 0.0 : 0.3);
      const RealVec u0 = random_vector(gen, e.nd(), 0.15), u1 = random_vector(gen, e.nd(), 0.15);
      RealVec re, h1(e.h), start(e.h);
      KernelMode statics;
      ASSERT_EQ(e.form(statics, u0, u0, re, nullptr, &start), STATUS_OK);
      e.h = start;
      ASSERT_EQ(e.form(energy_momentum(0.0), u0, u1, re, nullptr, &h1), STATUS_OK);
      double work = 0.0, sum[3] = {0, 0, 0};
      for (int k = 0; k < e.nd(); ++k) {
        work += re[k] * (u1[k] - u0[k]);
        sum[k % dim] += re[k];
      }
      const double gained = e.energy(true, u1, e.h) - e.energy(true, u0, e.h);
      EXPECT_NEAR(work, gained, 1e-12 * (std::fabs(gained) + 1.0)) << dim << kind;
      for (double s : sum) EXPECT_NEAR(s, 0.0, 1e-12);
    }
}

TEST(Bar, AllPointsOfAGroupHaveOneVolume)
{
  std::mt19937 gen(13);
  for (int dim : {2, 3}) {
    Element e(dim, LAW_NEO_HOOKE);
    const RealVec u = random_vector(gen, e.nd(), 0.1);
    RealVec E(6 * e.w.size()), scale(e.w.size());
    ASSERT_TRUE(bar_strains(e.g, true, e.gradients(u).data(), E.data(), scale.data()));
    double first = 0.0;
    for (size_t q = 0; q < e.w.size(); ++q) {
      const double* c = &E[6 * q];
      const double C[6] = {1 + 2 * c[0], 1 + 2 * c[1], 1 + 2 * c[2], 2 * c[3], 2 * c[4], 2 * c[5]};
      const double det = C[0] * (C[1] * C[2] - C[4] * C[4]) - C[3] * (C[3] * C[2] - C[4] * C[5]) +
                         C[5] * (C[3] * C[4] - C[1] * C[5]);
      if (q == 0) first = det;
      EXPECT_NEAR(det, first, 1e-13);
    }
  }
}
