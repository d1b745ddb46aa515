// Constitutive laws: stress against energy, tangent against stress, closed forms, the step (2.21). Case A17.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "mat/hencky.h"
#include "mat/law.h"
#include "mat/voigt.h"
#include "samples.h"

namespace {

// E 200, nu 0.3; neo-Hooke with the same constants of small strains; yield 1, hardening 5, then 2
Material sample(LawKind kind)
{
  Material m = material_of(kind, 0.3, {1.0, 1.5, 1.9}, {0.0, 0.1, 0.3});
  m.friction = m.dilation = 0.4;
  return m;
}

const Plane planes[3]  = {PLANE_NONE, PLANE_STRAIN, PLANE_STRESS};
const LawKind kinds[4] = {LAW_SVK, LAW_NEO_HOOKE, LAW_J2, LAW_DRUCKER_PRAGER};

// E with component j larger (a) and smaller (b) by step; shear counts twice in energies
void two_sides(const double* E, int j, double step, double* a, double* b)
{
  std::copy(E, E + 6, a);
  std::copy(E, E + 6, b);
  a[j] += j < 3 ? step : 0.5 * step;
  b[j] -= j < 3 ? step : 0.5 * step;
}

}  // namespace

TEST(Law, StressIsTheDerivativeOfTheIncrementalEnergyAndTangentThatOfTheStress)
{
  std::mt19937 gen(3);
  for (LawKind kind : kinds)
    for (Plane plane : planes)
      for (bool finite : {false, true}) {
        const Material m = sample(kind);
        LawPoint p{mat_law(m, plane), finite};
        double E[6];
        random_strain(gen, 0.03, plane, E);
        p.go(E);                                       // a history
        for (int k = 0; k < 6; ++k) E[k] *= 1.3;
        E[3] += 0.01;
        LawOutput out, up, down;
        double h_up[MAX_HISTORY] = {0}, h_down[MAX_HISTORY] = {0};
        ASSERT_TRUE(p.at(E, out));
        const double h = 1e-6;
        for (int j = 0; j < 6; ++j) {
          if (plane != PLANE_NONE && (j == 2 || j > 3)) continue;
          double a[6], b[6];
          for (int i = 0; i < 6; ++i) a[i] = b[i] = E[i];
          const double d = j < 3 ? h : 0.5 * h;        // engineering shear
          a[j] += d;
          b[j] -= d;
          ASSERT_TRUE(p.at(a, up, h_up) && p.at(b, down, h_down));
          const double work = law_flows(kind) ? h_up[HISTORY_DISSIPATED] - h_down[HISTORY_DISSIPATED] : 0.0;
          EXPECT_NEAR((up.psi - down.psi + work) / (2 * h), out.S[j], 1e-6) << kind << plane << finite << j;
          for (int i = 0; i < 6; ++i) {
            if (plane == PLANE_STRESS && (i == 2 || i > 3)) continue;
            EXPECT_NEAR((up.S[i] - down.S[i]) / (2 * h), out.D[i * 6 + j], 3e-5)
                << kind << plane << finite << i << j;
            EXPECT_NEAR(out.D[j * 6 + i], out.D[i * 6 + j], 1e-9);
          }
        }
        if (plane == PLANE_STRESS) {
          EXPECT_EQ(out.S[2], 0.0);
        }
      }
}

TEST(Law, StepOfEnergyMomentumStoresAndDissipatesTheWork)
{
  std::mt19937 gen(5);
  for (LawKind kind : kinds)
    for (Plane plane : planes)
      for (double size : {1e-5, 0.02, 0.2}) {
        const Material m = sample(kind);
        LawPoint p{mat_law(m, plane), true};
        double E0[6], E1[6], S[6], C[36], h1[MAX_HISTORY] = {0};
        random_strain(gen, size, plane, E0);
        p.go(E0);
        random_strain(gen, size, plane, E1);
        LawOutput zero, one;
        double e0[6], e1[6];
        std::copy(E0, E0 + 6, e0);
        std::copy(E1, E1 + 6, e1);
        ASSERT_TRUE(p.at(E0, zero) && p.at(E1, one));
        ASSERT_TRUE(law_step(p.law, energy_momentum(0.0), E0, E1, p.h, h1, S, C));
        for (int i = 0; i < 6; ++i) e1[i] -= e0[i];
        if (plane == PLANE_STRESS) e1[2] = 0.0;
        const double gone = law_flows(kind) ? h1[HISTORY_DISSIPATED] - p.h[HISTORY_DISSIPATED] : 0.0;
        EXPECT_GE(gone, 0.0);
        EXPECT_NEAR(one.psi - zero.psi + gone, six_dot(S, e1), 1e-13 * (one.psi + zero.psi) + 1e-18)
            << kind << plane << size;
        // the symmetric part of the derivative
        const double h = 1e-3 * size;
        double up[6], down[6], N[36];
        for (int j = 0; j < 6; ++j) {
          double a[6], b[6], none[MAX_HISTORY];
          std::copy(E1, E1 + 6, a);
          std::copy(E1, E1 + 6, b);
          a[j] += j < 3 ? h : 0.5 * h;
          b[j] -= j < 3 ? h : 0.5 * h;
          ASSERT_TRUE(law_step(p.law, energy_momentum(0.0), E0, a, p.h, none, up, nullptr));
          ASSERT_TRUE(law_step(p.law, energy_momentum(0.0), E0, b, p.h, none, down, nullptr));
          for (int i = 0; i < 6; ++i) N[i * 6 + j] = (up[i] - down[i]) / (2 * h);
        }
        if (law_flows(kind)) continue;                // the table has kinks
        for (int i = 0; i < 6; ++i)
          for (int j = 0; j < 6; ++j) {
            if (plane != PLANE_NONE && (i == 2 || j == 2 || i > 3 || j > 3)) continue;
            EXPECT_NEAR(0.5 * (N[i * 6 + j] + N[j * 6 + i]), C[i * 6 + j], 0.01) << kind << plane << size;
          }
      }
}

TEST(Law, NeoHookeUniaxialAndSmallStrains)
{
  const Material m = sample(LAW_NEO_HOOKE);
  const MatLaw law = mat_law(m, PLANE_NONE);
  LawPoint p{law, true};
  LawOutput out, svk;
  const double K = law.lam3 + 2.0 / 3.0 * law.mu;
  for (double f : {0.3, 0.8, 1.5, 4.0}) {              // uniaxial strain: J = f
    const double E[6] = {0.5 * (f * f - 1.0), 0, 0, 0, 0, 0};
    ASSERT_TRUE(p.at(E, out));
    const double sig = law.mu * std::pow(f, -5.0 / 3.0) * (f * f - (f * f + 2.0) / 3.0) + K * (f - 1.0);
    EXPECT_NEAR(out.S[0] * f, sig, 1e-12 * std::fabs(sig)) << f;       // sigma_11 = F S F / J
  }
  const double tiny[6] = {1e-9, -2e-9, 3e-10, 1e-9, 5e-10, -1e-9};
  ASSERT_TRUE(p.at(tiny, out));
  law_svk(law, true, tiny, nullptr, nullptr, true, svk);
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(out.S[i], svk.S[i], 1e-7 * std::fabs(svk.S[i]) + 1e-17);
  for (int i = 0; i < 36; ++i) EXPECT_NEAR(out.D[i], svk.D[i], 1e-5);
  EXPECT_NEAR(out.psi, svk.psi, 1e-6 * svk.psi);
  double least[6];                                     // no rounding of the order of E in the energy
  for (int i = 0; i < 6; ++i) least[i] = 1e-5 * tiny[i];
  ASSERT_TRUE(p.at(least, out));
  law_svk(law, true, least, nullptr, nullptr, false, svk);
  EXPECT_NEAR(out.psi, svk.psi, 1e-12 * svk.psi);
}

TEST(Law, PlasticUniaxialStressFollowsTheTableInLogarithmicStrain)
{
  const Material m = sample(LAW_J2);
  LawPoint p{mat_law(m, PLANE_NONE), true};
  // pulled to stretches f, the lateral one found so that S22 = S33 = 0
  for (double f : {1.002, 1.01, 1.1, 1.25, 1.6}) {
    double E[6] = {0.5 * (f * f - 1.0), 0, 0, 0, 0, 0};
    E[1] = E[2] = 0.5 * (1.0 / f - 1.0);
    LawOutput out;
    for (int it = 0; it < 60; ++it) {
      ASSERT_TRUE(p.at(E, out));
      const double step = -out.S[1] / (out.D[7] + out.D[8]);
      E[1] += step;
      E[2] = E[1];
    }
    p.go(E);
    double slope;
    const double J     = f * (1.0 + 2.0 * E[1]);
    const double tau   = out.S[0] * f * f;              // Kirchhoff
    const double a     = p.h[HISTORY_OF_LAW + FLOW_EQUIVALENT];
    EXPECT_NEAR(std::log(f), tau / m.young + a, 1e-12) << f;
    EXPECT_NEAR(tau, f < 1.005 ? m.young * std::log(f) : yield_stress(m, a, &slope), 1e-12) << f;
    EXPECT_NEAR(std::log(J), (1.0 - 2.0 * m.poisson) * tau / m.young, 1e-12);
    EXPECT_NEAR(p.h[HISTORY_DISSIPATED], yield_work(m, a), 1e-12);
  }
  EXPECT_NEAR(yield_work(m, 0.5), 0.125 + 0.34 + 0.38, 1e-14);
}

TEST(Law, PlasticSimpleShearInOneStepIsTheReturnOfTheLogarithms)
{
  const Material m = sample(LAW_J2);
  const MatLaw law = mat_law(m, PLANE_NONE);
  LawPoint p{law, true};
  const double g = 0.4;
  const double E[6] = {0, 0.5 * g * g, 0, 0.5 * g, 0, 0};      // F = I + g e1 (x) e2
  LawOutput out;
  double h[MAX_HISTORY];
  ASSERT_TRUE(p.at(E, out, h));
  // principal stretches of simple shear: exp(+-asinh(g/2)); the stress is coaxial with b
  const double e = std::asinh(0.5 * g), q = 2.0 * law.mu * e * std::sqrt(3.0);
  double slope;
  EXPECT_NEAR(q - 3.0 * law.mu * h[HISTORY_OF_LAW + FLOW_EQUIVALENT], yield_stress(m, h[HISTORY_OF_LAW + FLOW_EQUIVALENT], &slope), 1e-12);
  const double tau = (q - 3.0 * law.mu * h[HISTORY_OF_LAW + FLOW_EQUIVALENT]) / std::sqrt(3.0);      // principal stress
  // tau_12 of F S F^T
  const double t12 = (out.S[3] + g * out.S[1]);
  EXPECT_NEAR(t12, tau / std::sqrt(1.0 + 0.25 * g * g), 1e-12);
}

TEST(Law, DruckerPragerWithoutDilationHasTheSymmetricPartOfItsTangent)
{
  std::mt19937 gen(11);
  Material m = sample(LAW_DRUCKER_PRAGER);
  m.dilation = 0.0;
  for (bool finite : {false, true}) {
    LawPoint p{mat_law(m, PLANE_NONE), finite};
    double E[6], h[MAX_HISTORY] = {0}, N[36];
    random_strain(gen, 0.01, PLANE_NONE, E);
    for (int i = 0; i < 3; ++i) E[i] -= 0.005;         // pressed and sheared: on the cone
    E[3] += 0.05;
    LawOutput out, up, down;
    ASSERT_TRUE(p.at(E, out, h));
    ASSERT_GT(h[HISTORY_OF_LAW + FLOW_EQUIVALENT], 0.0);
    ASSERT_GT(out.dissipated, 0.0);
    for (int j = 0; j < 6; ++j) {
      double a[6], b[6];
      two_sides(E, j, 1e-6, a, b);
      ASSERT_TRUE(p.at(a, up) && p.at(b, down));
      for (int i = 0; i < 6; ++i) N[i * 6 + j] = (up.S[i] - down.S[i]) / 2e-6;
    }
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) EXPECT_NEAR(0.5 * (N[i * 6 + j] + N[j * 6 + i]), out.D[i * 6 + j], 1e-4);
  }
}

// plane stress: the symmetric part of the condensed tangent, not the condensed symmetric part
TEST(Law, DruckerPragerSheetHasTheSymmetricPartOfItsTangent)
{
  std::mt19937 gen(12);
  Material m = sample(LAW_DRUCKER_PRAGER);
  for (double dilation : {0.0, 0.1})
    for (bool finite : {false, true}) {
      m.dilation = dilation;
      LawPoint p{mat_law(m, PLANE_STRESS), finite};
      double E[6], h[MAX_HISTORY] = {0}, N[36] = {0};
      random_strain(gen, 0.01, PLANE_STRESS, E);
      E[0] -= 0.01;
      E[3] += 0.05;
      LawOutput out, up, down;
      ASSERT_TRUE(p.at(E, out, h));
      ASSERT_GT(h[HISTORY_OF_LAW + FLOW_EQUIVALENT], 0.0);
      for (int j : {0, 1, 3}) {
        double a[6], b[6];
        two_sides(E, j, 1e-6, a, b);
        ASSERT_TRUE(p.at(a, up) && p.at(b, down));
        for (int i : {0, 1, 3}) N[i * 6 + j] = (up.S[i] - down.S[i]) / 2e-6;
      }
      double skew = 0.0;
      for (int i : {0, 1, 3})
        for (int j : {0, 1, 3}) {
          EXPECT_NEAR(0.5 * (N[i * 6 + j] + N[j * 6 + i]), out.D[i * 6 + j], 1e-4) << dilation << finite << i << j;
          skew = std::max(skew, std::fabs(N[i * 6 + j] - N[j * 6 + i]));
        }
      EXPECT_GT(skew, 1.0);
    }
}

TEST(Law, DruckerPragerTakesItsTableFromEachTest)
{
  for (Hardening test : {HARDENING_COMPRESSION, HARDENING_TENSION, HARDENING_SHEAR})
    for (double b : {1.0, 1.64}) {
      Material m  = sample(LAW_DRUCKER_PRAGER);
      m.hardening = test;
      m.exponent  = b;
      m.dilation  = 0.2;
      LawPoint p{mat_law(m, PLANE_NONE), false};
      const double sign = test == HARDENING_TENSION ? 1.0 : -1.0;
      double E[6] = {0}, slope;
      LawOutput out;
      for (int k = 1; k <= 20; ++k) {
        // sigma = E (total - plastic): one axial strain, the lateral one so that nothing presses; or shear without
        // pressure
        if (test == HARDENING_SHEAR) E[3] = 0.005 * k;
        else E[0] = sign * 0.01 * k;
        for (int it = 0; it < 400; ++it) {
          ASSERT_TRUE(p.at(E, out));
          if (test == HARDENING_SHEAR)
            for (int i = 0; i < 3; ++i) E[i] -= out.S[i] / m.young * (1.0 - 2.0 * m.poisson);
          else
            for (int i = 1; i < 3; ++i) E[i] -= out.S[i] / m.young;
        }
        p.go(E);
      }
      const double a = p.h[HISTORY_OF_LAW + FLOW_EQUIVALENT];
      ASSERT_TRUE(p.at(E, out));
      if (test == HARDENING_SHEAR) {
        EXPECT_NEAR(out.S[3], yield_stress(m, a, &slope), 1e-9);
        EXPECT_NEAR(a, 2.0 * (E[3] - out.S[3] / (2.0 * p.law.mu)) / std::sqrt(3.0), 1e-9);
      } else {
        EXPECT_NEAR(out.S[0], sign * yield_stress(m, a, &slope), 1e-9);
        EXPECT_NEAR(a, sign * (E[0] - out.S[0] / m.young), 1e-9);
      }
    }
}

namespace {

// EXPONENT FORM through 1 in pure shear (sqrt(3) in q)
Material curved(double b, double dilation, const RealVec& yield, const RealVec& plastic_strain)
{
  Material m  = material_of(LAW_DRUCKER_PRAGER, 0.3, yield, plastic_strain);
  m.friction  = 0.8 * b * std::pow(std::sqrt(3.0), b - 1.0);       // dq/dp = 0.8 at p = 0
  m.exponent  = b;
  m.dilation  = dilation;
  m.hardening = HARDENING_SHEAR;
  return m;
}

// a strain whose pressure is about 200 c, sheared
void pressed_strain(std::mt19937& gen, double c, Plane plane, double* E)
{
  random_strain(gen, 0.01, plane, E);
  for (int i = 0; i < (plane == PLANE_NONE ? 3 : 2); ++i) E[i] -= c;
  E[3] += 0.03;
}

// derivatives by differences of energy, dissipation and stress at E
struct Differences {
  double work[6], N[36];
  void of(const LawPoint& p, const double* E, double h)
  {
    LawOutput up, down;
    double up_h[MAX_HISTORY] = {0}, down_h[MAX_HISTORY] = {0};
    for (int j = 0; j < 6; ++j) {
      double a[6], b[6];
      two_sides(E, j, h, a, b);
      ASSERT_TRUE(p.at(a, up, up_h) && p.at(b, down, down_h));
      work[j] = (up.psi - down.psi + up_h[HISTORY_DISSIPATED] - down_h[HISTORY_DISSIPATED]) / (2.0 * h);
      for (int i = 0; i < 6; ++i) N[i * 6 + j] = (up.S[i] - down.S[i]) / (2.0 * h);
    }
  }
};

bool in_plane(Plane plane, int i) { return plane == PLANE_NONE || (i != 2 && i < 4); }

}  // namespace

// EXPONENT FORM with the dilation of associated flow: stored and dissipated energy are a potential, and the
// tangent is exact
TEST(Law, DruckerPragerCurveStressAndTangentAreDerivatives)
{
  std::mt19937 gen(31);
  int flowed = 0;
  for (double b : {1.3, 1.64, 2.0, 4.0})
    for (Plane plane : planes)
      for (bool finite : {false, true})
        for (double press : {0.0, 0.005, 0.02}) {
          const Material m = curved(b, 1e3, {1.0}, {0.0});         // no limit but that of the curve
          LawPoint p{mat_law(m, plane), finite};
          double E[6], h[MAX_HISTORY] = {0};
          pressed_strain(gen, press, plane, E);
          p.go(E);                                     // a history
          for (int k = 0; k < 6; ++k) E[k] *= 1.3;
          E[3] += 0.01;
          LawOutput out;
          ASSERT_TRUE(p.at(E, out, h));
          ASSERT_GT(h[HISTORY_DISSIPATED], p.h[HISTORY_DISSIPATED]);
          ++flowed;
          Differences d;
          d.of(p, E, 1e-6);
          for (int j = 0; j < 6; ++j) {
            if (!in_plane(plane, j)) continue;
            EXPECT_NEAR(d.work[j], out.S[j], 1e-6) << b << plane << finite << j;
            for (int i = 0; i < 6; ++i) {
              if (!in_plane(plane, i)) continue;
              EXPECT_NEAR(d.N[i * 6 + j], out.D[i * 6 + j], 1e-4) << b << plane << finite << press << i << j;
            }
          }
        }
  EXPECT_EQ(flowed, 4 * 3 * 2 * 3);
}

// any dilation, hardening: the symmetric part of the tangent; the end lies on the curve
TEST(Law, DruckerPragerCurveHasTheSymmetricPartOfItsTangent)
{
  std::mt19937 gen(32);
  for (Hardening test : {HARDENING_COMPRESSION, HARDENING_TENSION, HARDENING_SHEAR})
    for (double dilation : {0.0, 0.2, 2.5})
      for (double press : {0.0, 0.02}) {
        Material m  = curved(1.64, dilation, {3.0, 6.0}, {0.0, 10.0});
        m.hardening = test;
        LawPoint p{mat_law(m, PLANE_NONE), false};
        double E[6], h[MAX_HISTORY] = {0}, slope, steep;
        pressed_strain(gen, press, PLANE_NONE, E);
        E[3] += 0.05;
        LawOutput out;
        ASSERT_TRUE(p.at(E, out, h));
        const double a = h[HISTORY_OF_LAW + FLOW_EQUIVALENT];
        ASSERT_GT(a, 0.0);
        const double pressure = -(out.S[0] + out.S[1] + out.S[2]) / 3.0;
        double s[6];
        for (int i = 0; i < 6; ++i) s[i] = out.S[i] + (i < 3 ? pressure : 0.0);
        const double q = std::sqrt(1.5 * six_dot(s, s));
        EXPECT_NEAR(std::pow(q, 1.64), m.friction * pressure + cone_cohesion(m, yield_stress(m, a, &slope), &steep),
                    1e-11);
        Differences d;
        d.of(p, E, 1e-6);
        for (int i = 0; i < 6; ++i)
          for (int j = 0; j < 6; ++j)
            EXPECT_NEAR(0.5 * (d.N[i * 6 + j] + d.N[j * 6 + i]), out.D[i * 6 + j], 1e-4)
                << test << dilation << press << i << j;
      }
}

// b = 1 is the straight line, which b = 1 + 1e-9 approaches in the routines of the curve. The dissipation is
// compared without hardening: beyond the apex of the start of an increment the strength of the line is below 0
TEST(Law, DruckerPragerCurveEndsInTheStraightLine)
{
  std::mt19937 gen(33);
  for (double dilation : {0.0, 0.3})
    for (bool finite : {false, true})
      for (int trial = 0; trial < 40; ++trial) {
        const bool hardens = trial % 2;
        Material m = curved(1.0, dilation, {1.0, 1.5, 1.9}, {0.0, 0.1, 0.3}), near = m;
        if (!hardens) m.yield = near.yield = {1.0, 1.0, 1.0};
        near.exponent = 1.0 + 1e-9;
        LawPoint p{mat_law(m, PLANE_NONE), finite}, c{mat_law(near, PLANE_NONE), finite};
        for (double size : {0.01, 0.05, 0.1}) {
          double E[6];
          random_strain(gen, size, PLANE_NONE, E);
          p.go(E);
          c.go(E);
          EXPECT_NEAR(p.out.psi, c.out.psi, 1e-7);
          for (int i = 0; i < 6; ++i) EXPECT_NEAR(p.out.S[i], c.out.S[i], 1e-6);
          for (int i = 0; i < 36; ++i) EXPECT_NEAR(p.out.D[i], c.out.D[i], 1e-3);
          if (!hardens) {
            EXPECT_NEAR(p.h[HISTORY_DISSIPATED], c.h[HISTORY_DISSIPATED], 1e-7);
          }
        }
      }
}

// random paths, tension and the apex among them: flow never gains energy, no step of energy-momentum either,
// whose work is stored or dissipated
TEST(Law, DruckerPragerCurveDissipates)
{
  std::mt19937 gen(34);
  int flowed = 0, at_apex = 0;
  for (double b : {1.1, 1.64, 3.0})
    for (double dilation : {0.0, 0.3, 2.5})
      for (bool finite : {false, true})
        for (bool gap : {false, true})
          for (Plane plane : planes)
            for (int trial = 0; trial < 20; ++trial) {
              Material m  = curved(b, dilation, {1.0, 2.0, 2.5}, {0.0, 0.05, 0.3});
              m.hardening = static_cast<Hardening>(trial % 3);
              m.friction  = 1.5;                       // cohesion in compression too
              m.gap       = gap;
              LawPoint p{mat_law(m, plane), finite};
              double E0[6] = {0};
              LawOutput zero, one;
              for (int n = 0; n < 6; ++n) {
                double E[6], S[6], h1[MAX_HISTORY] = {0};
                random_strain(gen, n % 2 ? 0.1 : 0.02, plane, E);
                for (int i = 0; i < 3; ++i) E[i] += plane == PLANE_NONE ? (n % 3 - 1) * 0.03 : 0.0;
                KernelMode mode = energy_momentum(0.0);
                mode.finite     = finite;
                ASSERT_TRUE(p.at(E0, zero) && p.at(E, one));
                ASSERT_TRUE(law_step(p.law, mode, E0, E, p.h, h1, S, nullptr));
                double dE[6];
                for (int i = 0; i < 6; ++i) dE[i] = plane == PLANE_STRESS && i == 2 ? 0.0 : E[i] - E0[i];
                const double gone = h1[HISTORY_DISSIPATED] - p.h[HISTORY_DISSIPATED];
                EXPECT_NEAR(one.psi - zero.psi + gone, six_dot(S, dE), 1e-12) << b << dilation << plane;
                EXPECT_GE(h1[HISTORY_DISSIPATED], -1e-12) << b << dilation << plane;
                if (!gap) {                            // a gap that closes gives back what its opening took
                  EXPECT_GE(gone, -1e-12) << b << dilation << plane;
                }
                flowed += h1[HISTORY_OF_LAW + FLOW_EQUIVALENT] > p.h[HISTORY_OF_LAW + FLOW_EQUIVALENT];
                at_apex += h1[HISTORY_OF_LAW + FLOW_EQUIVALENT + 1] > 0.0;
                std::copy(h1, h1 + MAX_HISTORY, p.h);
                std::copy(E, E + 6, E0);
              }
            }
  EXPECT_GT(flowed, 5000);
  EXPECT_GT(at_apex, 300);
}

TEST(Law, TurningTheBodyTurnsNothing)
{
  // a strain path and the same path with the reference axes turned: same energies
  std::mt19937 gen(9);
  const Material m = sample(LAW_J2);
  LawPoint p{mat_law(m, PLANE_NONE), true}, t{mat_law(m, PLANE_NONE), true};
  for (int step = 0; step < 5; ++step) {
    double E[6];
    random_strain(gen, 0.1, PLANE_NONE, E);
    const double c = std::cos(0.7), s = std::sin(0.7);
    // axes 1, 2 turned about 3
    const double T[6] = {c * c * E[0] + s * s * E[1] + 2 * c * s * E[3],
                         s * s * E[0] + c * c * E[1] - 2 * c * s * E[3],
                         E[2],
                         c * s * (E[1] - E[0]) + (c * c - s * s) * E[3],
                         c * E[4] - s * E[5],
                         c * E[5] + s * E[4]};
    LawOutput a, b;
    ASSERT_TRUE(p.at(E, a) && t.at(T, b));
    EXPECT_NEAR(a.psi, b.psi, 1e-12 * a.psi + 1e-16);
    p.go(E);
    t.go(T);
    EXPECT_NEAR(p.h[HISTORY_OF_LAW + FLOW_EQUIVALENT], t.h[HISTORY_OF_LAW + FLOW_EQUIVALENT], 1e-12);
  }
}

namespace {

MatLaw granular(const Material& m, Plane plane, double c, double friction)
{
  FractureDef f;
  f.residual = SPLIT_GRANULAR;
  f.friction = friction;
  return law_broken(mat_law(m, plane), f, c, MatLaw().N);
}

}  // namespace

TEST(Law, GranularMaterialShearsAtTheFrictionOfItsPressureAndCarriesNoTension)
{
  const Material m  = sample(LAW_SVK);
  const double tan  = 0.7;
  const MatLaw law  = granular(m, PLANE_NONE, 0.0, tan);
  for (bool finite : {false, true}) {
    LawPoint p{law, finite};
    const double v = -0.01, g = 0.2;                   // volume, shear of a layer
    const double f = finite ? 1.0 + v : 1.0;
    const double E[6] = {0, finite ? 0.5 * (g * g + f * f - 1.0) : v, 0, 0.5 * g, 0, 0};  // F: x + g y, f y
    LawOutput out;
    double h[MAX_HISTORY];
    ASSERT_TRUE(p.at(E, out, h));
    // sigma = F S F^T / J: pressure, and the largest shear stress
    const double F[2][2] = {{1, g}, {0, f}}, S[2][2] = {{out.S[0], out.S[3]}, {out.S[3], out.S[1]}};
    double sig[3] = {0, 0, 0};
    for (int a = 0; a < 2; ++a)
      for (int b = 0; b < 2; ++b) {
        sig[0] += F[0][a] * S[a][b] * F[0][b];
        sig[1] += F[1][a] * S[a][b] * F[1][b];
        sig[2] += F[0][a] * S[a][b] * F[1][b];
      }
    const double J = finite ? f : 1.0;
    if (!finite) sig[0] = out.S[0], sig[1] = out.S[1], sig[2] = out.S[3];
    const double s33 = out.S[2] / J;
    const double pressure = -(sig[0] / J + sig[1] / J + s33) / 3.0;
    const double K = law.lam3 + 2.0 / 3.0 * law.mu;
    EXPECT_NEAR(pressure, -K * v, 1e-12);
    const double d[3] = {sig[0] / J + pressure, sig[1] / J + pressure, s33 + pressure};
    const double shear = std::sqrt(0.5 * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) + sig[2] * sig[2] / J / J);
    EXPECT_NEAR(shear, tan * pressure, 1e-12);         // sqrt(J2)
    EXPECT_GT(h[HISTORY_DISSIPATED], 0.0);
    const double open[6] = {0.01, 0.0, 0.0, 0.02, 0, 0};
    ASSERT_TRUE(p.at(open, out));
    for (double s : out.S) EXPECT_NEAR(s, 0.0, 1e-15);
    EXPECT_EQ(out.psi, 0.0);
  }
}

TEST(Law, GranularTangentIsTheSymmetricPartAndStepsStoreAndDissipateTheWork)
{
  std::mt19937 gen(21);
  const Material m = sample(LAW_SVK);
  for (bool finite : {false, true})
    for (double c : {0.0, 0.3}) {
      LawPoint p{granular(m, PLANE_NONE, c, 0.7), finite};
      double E[6], S[6], h1[MAX_HISTORY] = {0};
      random_strain(gen, 0.01, PLANE_NONE, E);
      for (int i = 0; i < 3; ++i) E[i] -= 0.01;
      p.go(E);
      double E1[6];
      for (int i = 0; i < 6; ++i) E1[i] = 1.2 * E[i];
      E1[3] += 0.01;
      LawOutput zero, one, up, down;
      ASSERT_TRUE(p.at(E, zero) && p.at(E1, one));
      double N[36];
      const double h = 1e-7;
      for (int j = 0; j < 6; ++j) {
        double a[6], b[6];
        for (int i = 0; i < 6; ++i) a[i] = b[i] = E1[i];
        a[j] += j < 3 ? h : 0.5 * h;
        b[j] -= j < 3 ? h : 0.5 * h;
        ASSERT_TRUE(p.at(a, up) && p.at(b, down));
        for (int i = 0; i < 6; ++i) N[i * 6 + j] = (up.S[i] - down.S[i]) / (2 * h);
      }
      // D has the symmetric part in principal axes; its largest entries are some 100
      for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j)
          EXPECT_NEAR(0.5 * (N[i * 6 + j] + N[j * 6 + i]), one.D[i * 6 + j], 1e-3) << finite << c << i << j;
      if (!finite) continue;
      ASSERT_TRUE(law_step(p.law, energy_momentum(0.0), E, E1, p.h, h1, S, nullptr));
      const double gone = h1[HISTORY_DISSIPATED] - p.h[HISTORY_DISSIPATED];
      EXPECT_GE(gone, 0.0);
      for (int i = 0; i < 6; ++i) E1[i] -= E[i];
      EXPECT_NEAR(one.psi - zero.psi + gone, six_dot(S, E1), 1e-13);
    }
}

// the strain at which a law has a given stress; with it in the history the law has this stress at rest, its
// step stores the work, and rotations change nothing                                            (2.44)
TEST(Law, InitialStrainGivesTheInitialStress)
{
  std::mt19937 gen(8);
  for (LawKind kind : kinds)
    for (Plane plane : planes)
      for (bool finite : {false, true}) {
        Material m = sample(kind);
        const double S[6] = {0.3, -0.2, plane == PLANE_STRESS ? 0.0 : 0.1, 0.15,
                             plane == PLANE_NONE ? 0.1 : 0.0, plane == PLANE_NONE ? -0.05 : 0.0};
        m.initial = MAX_HISTORY - 6;
        const MatLaw law = mat_law(m, plane);
        double h[MAX_HISTORY] = {0}, h1[MAX_HISTORY] = {0}, E0[6] = {0}, E1[6], E[6], out[6];
        ASSERT_TRUE(law_initial(law, finite, S, h, h + law.initial));
        LawOutput at, end;
        std::copy_n(E0, 6, E);
        ASSERT_TRUE(law_update(law, finite, E, h, h1, true, at));
        for (int k = 0; k < 6; ++k) {
          EXPECT_NEAR(S[k], at.S[k], 1e-11) << kind << plane << finite << k;
          EXPECT_NEAR(0.0, E[k], 1e-14);
          EXPECT_EQ(h[law.initial + k], h1[law.initial + k]);
        }
        random_strain(gen, 1e-3, plane, E1);
        KernelMode mode;
        mode.finite = finite;
        mode.mid    = true;
        mode.s_new = mode.s_old = 0.5;
        ASSERT_TRUE(law_step(law, mode, E0, E1, h, h1, out, nullptr));
        std::copy_n(E1, 6, E);
        double scratch[MAX_HISTORY] = {0};
        ASSERT_TRUE(law_update(law, finite, E, h, scratch, false, end));
        const double gone = law_of(law).history.empty() ? 0.0 : h1[HISTORY_DISSIPATED];
        double d[6];
        for (int k = 0; k < 6; ++k) d[k] = plane == PLANE_STRESS && k == 2 ? 0.0 : E1[k];
        EXPECT_NEAR(end.psi + gone - at.psi, six_dot(out, d), 1e-13);
      }
  Material weak = sample(LAW_J2);                       // yields at 1
  const double much[6] = {5.0, 0, 0, 0, 0, 0}, none[MAX_HISTORY] = {0};
  double E[6];
  EXPECT_FALSE(law_initial(mat_law(weak, PLANE_NONE), true, much, none, E));
}

// APEX=GAP: pulled beyond the apex from all sides and pressed: pressure begins at the first volume; stress,
// history and energy as without the way through the gap. Derivatives of energy and stress where a gap closes
TEST(Law, DruckerPragerGapCloses)
{
  Material m = sample(LAW_DRUCKER_PRAGER);
  m.gap      = true;
  int closed = 0;
  std::mt19937 gen(5);
  for (bool finite : {false, true}) {
    LawPoint p{mat_law(m, PLANE_NONE), finite}, straight{mat_law(m, PLANE_NONE), finite};
    double open[6] = {0.1, 0.1, 0.1, 0.0, 0.0, 0.0}, more[6] = {0.2, 0.2, 0.2, 0.0, 0.0, 0.0},
           pressed[6] = {-0.005, -0.005, -0.005, 0.0, 0.0, 0.0};
    p.go(open);
    const double tension = p.out.S[0];
    ASSERT_GT(tension, 0.0);
    ASSERT_GT(p.h[HISTORY_OF_LAW + FLOW_EQUIVALENT + 1], 0.0);
    p.go(more);
    p.go(open);
    p.go(pressed);
    straight.go(pressed);
    EXPECT_LT(p.out.S[0], 0.0);
    for (int i = 0; i < 6; ++i) EXPECT_NEAR(p.out.S[i], straight.out.S[i], 1e-9) << finite << i;
    EXPECT_NEAR(p.h[HISTORY_DISSIPATED], 0.0, 1e-12);
    EXPECT_EQ(p.h[HISTORY_OF_LAW + FLOW_EQUIVALENT + 1], 0.0);
    m.gap = false;                                     // without: the volume stays
    LawPoint keeps{mat_law(m, PLANE_NONE), finite};
    keeps.go(open);
    keeps.go(pressed);
    EXPECT_LT(keeps.out.S[0], 5.0 * p.out.S[0]);
    m.gap = true;
    m.dilation = m.friction;
    for (int trial = 0; trial < 20; ++trial) {
      LawPoint q{mat_law(m, PLANE_NONE), finite};
      double E[6], h[MAX_HISTORY] = {0}, up_h[MAX_HISTORY] = {0}, down_h[MAX_HISTORY] = {0};
      q.go(open);
      random_strain(gen, 0.02, PLANE_NONE, E);
      LawOutput out, up, down;
      ASSERT_TRUE(q.at(E, out, h));
      if (h[HISTORY_OF_LAW + FLOW_EQUIVALENT + 1] > 0.0) continue;
      ++closed;
      for (int j = 0; j < 6; ++j) {
        double a[6], b[6];
        two_sides(E, j, 1e-7, a, b);
        ASSERT_TRUE(q.at(a, up, up_h) && q.at(b, down, down_h));
        const double lost = up_h[HISTORY_DISSIPATED] - down_h[HISTORY_DISSIPATED];
        EXPECT_NEAR((up.psi - down.psi + lost) / 2e-7, out.S[j], 1e-5);
        for (int i = 0; i < 6; ++i) EXPECT_NEAR((up.S[i] - down.S[i]) / 2e-7, out.D[i * 6 + j], 1e-3);
      }
    }
  }
  EXPECT_GT(closed, 10);
}
