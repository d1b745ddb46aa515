// Cracks that open against a cohesion: traction over opening, energy, tangent. Case C1.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include <Eigen/Dense>

#include "mat/law.h"
#include "mat/voigt.h"
#include "samples.h"

namespace {

const double square[8] = {0, 0, 0.1, 0, 0.1, 0.1, 0, 0.1};
const double cube[24]  = {0, 0, 0,   0.1, 0, 0,   0.1, 0.1, 0,   0, 0.1, 0,
                          0, 0, 0.1, 0.1, 0, 0.1, 0.1, 0.1, 0.1, 0, 0.1, 0.1};

// E 200, nu 0.3, strength 1, toughness 0.01: E Gc/ft^2 = 2, elements of 0.1
MatLaw cohesive(const Material& m, Plane plane, Softening s)
{
  MatLaw law = mat_law(m, plane);
  law.kind   = LAW_COHESIVE;
  law.c      = 0.0;
  law.crack.softening = s;
  law.crack.strength  = 1.0;
  law.crack.gc        = 0.01;
  law.crack.dim       = plane == PLANE_NONE ? 3 : 2;
  law.crack.nodes     = plane == PLANE_NONE ? 8 : 4;
  law.crack.X     = plane == PLANE_NONE ? cube : square;
  return law;
}

struct Crack : LawPoint {
  Material m = material_of(LAW_SVK, 0.3, {}, {});
  Crack(Plane plane, Softening s)
  {
    law    = cohesive(m, plane, s);
    finite = false;
  }
  double normal_stiffness() const { return law.lam3 + 2.0 * law.mu; }
};

// the same of material that flows by Drucker and Prager, uniaxial compression at y
struct FlowCrack : Crack {
  FlowCrack(Plane plane, Softening s, double y, bool large) : Crack(plane, s)
  {
    m = material_of(LAW_DRUCKER_PRAGER, 0.3, {y, 2.0 * y}, {0.0, 0.1});
    m.friction   = 1.0;
    m.dilation   = 1.0;        // associated: the tangent is symmetric
    law.kind     = LAW_COHESIVE_FLOW;
    law.material = &m;
    finite       = large;
  }
  // EXPONENT FORM, associated, without hardening; dq/dp = 1 at q = y
  void bend()
  {
    m.exponent  = 1.64;
    m.friction  = m.exponent * std::pow(m.yield[0], m.exponent - 1.0);
    m.dilation  = 1e3;
    m.hardening = HARDENING_SHEAR;
    m.yield     = {m.yield[0], m.yield[0]};
  }
};

const Softening softenings[] = {SOFTENING_LINEAR, SOFTENING_BILINEAR, SOFTENING_EXPONENTIAL};
const Plane planes[] = {PLANE_NONE, PLANE_STRAIN, PLANE_STRESS};

// traction at an opening
double traction(Softening s, double w)
{
  const double end = 0.02;     // 2 Gc/ft
  if (s == SOFTENING_LINEAR) return std::max(0.0, 1.0 - w / end);
  if (s == SOFTENING_EXPONENTIAL) return std::exp(-w / 0.01);
  if (w < 0.008) return 1.0 - 2.0 / 3.0 * w / 0.008;
  return std::max(0.0, 1.0 / 3.0 * (1.0 - (w - 0.008) / 0.028));
}

// derivatives of the energy and of the stress by differences, against stress and tangent
void compare(const Crack& b, Plane plane, const double* E, double of_stress, double of_tangent)
{
  LawOutput out, up, down;
  double up_h[MAX_HISTORY] = {0}, down_h[MAX_HISTORY] = {0};
  ASSERT_TRUE(b.at(E, out));
  const double h = 1e-7;
  for (int j = 0; j < 6; ++j) {
    if (plane != PLANE_NONE && (j == 2 || j > 3)) continue;
    double more[6], less[6];
    std::copy(E, E + 6, more);
    std::copy(E, E + 6, less);
    more[j] += j < 3 ? h : 0.5 * h;                    // engineering shear
    less[j] -= j < 3 ? h : 0.5 * h;
    ASSERT_TRUE(b.at(more, up, up_h) && b.at(less, down, down_h));
    const double gone = up_h[HISTORY_DISSIPATED] - down_h[HISTORY_DISSIPATED];
    EXPECT_NEAR((up.psi - down.psi + gone) / (2 * h), out.S[j], of_stress) << plane << j;
    for (int i = 0; i < 6; ++i) {
      if (plane == PLANE_STRESS && (i == 2 || i > 3)) continue;
      EXPECT_NEAR((up.S[i] - down.S[i]) / (2 * h), out.D[i * 6 + j], of_tangent) << plane << i << j;
    }
  }
}

}  // namespace

TEST(Cohesive, TractionIsThatOfTheOpening)
{
  for (Softening s : softenings) {
    Crack b(PLANE_STRAIN, s);
    double E[6] = {0};
    E[0] = 0.999 / b.normal_stiffness();
    b.go(E);
    EXPECT_NEAR(b.out.S[0], 0.999, 1e-12);             // not a crack yet
    EXPECT_EQ(b.out.dissipated, 0.0);
    for (double w : {0.001, 0.004, 0.009, 0.015, 0.019, 0.05}) {
      E[0] = traction(s, w) / b.normal_stiffness() + w / 0.1;
      b.go(E);
      EXPECT_NEAR(b.out.S[0], traction(s, w), 1e-12) << s << " " << w;
      EXPECT_NEAR(crack_opening(b.law, b.h), w, 1e-13);
    }
    EXPECT_NEAR(b.h[HISTORY_DISSIPATED], 0.01 / 0.1, s == SOFTENING_EXPONENTIAL ? 4.1e-3 : 1e-12);
  }
}

TEST(Cohesive, ClosesToTheOriginAndPressesInFull)
{
  Crack b(PLANE_STRAIN, SOFTENING_LINEAR);
  const double M = b.normal_stiffness();
  double E[6] = {0};
  E[0] = 0.5 / M + 0.01 / 0.1;                         // half way
  b.go(E);
  EXPECT_NEAR(b.out.S[0], 0.5, 1e-12);
  const double gone = b.h[HISTORY_DISSIPATED];
  EXPECT_NEAR(gone, (0.0075 - 0.0025) / 0.1, 1e-12);   // work less what is stored
  E[0] = 0.25 / M + 0.005 / 0.1;
  b.go(E);
  EXPECT_NEAR(b.out.S[0], 0.25, 1e-12);
  E[0] = -0.3 / M;
  b.go(E);
  EXPECT_NEAR(b.out.S[0], -0.3, 1e-12);
  const double nu = b.m.poisson;
  E[1] = 0.9 * (1.0 - nu * nu) / b.m.young;            // the other axis has its strength
  E[0] = -nu / (1.0 - nu) * E[1];
  b.go(E);
  EXPECT_NEAR(b.out.S[1], 0.9, 1e-12);
  E[1] = 0.0;
  E[0] = 0.5 / M + 0.01 / 0.1;
  b.go(E);
  EXPECT_NEAR(b.out.S[0], 0.5, 1e-12);
  EXPECT_EQ(b.h[HISTORY_DISSIPATED], gone);
}

TEST(Cohesive, WidthIsThatAlongTheNormal)
{
  for (double degrees : {0.0, 26.565, 45.0, 70.0}) {
    Crack b(PLANE_STRAIN, SOFTENING_LINEAR);
    const double a = degrees * std::acos(-1.0) / 180.0, c = std::cos(a), s = std::sin(a);
    const double width = 0.1 * (c + s);
    double E[6]  = {c * c, s * s, 0, c * s, 0, 0};
    for (double& x : E) x *= 0.3;
    b.go(E);
    EXPECT_NEAR(b.h[HISTORY_DISSIPATED], 0.01 / width, 1e-12) << degrees;
  }
  Crack b(PLANE_NONE, SOFTENING_LINEAR);
  const double n = 1.0 / std::sqrt(3.0);
  double E[6] = {n * n, n * n, n * n, n * n, n * n, n * n};
  b.go(E);
  EXPECT_NEAR(b.h[HISTORY_DISSIPATED], 0.01 / (0.3 * n), 1e-9);
}

// a material point: the width follows the cells that open, at the same strain; the energy-momentum scheme stays
// exact. Theory (2.36b)
TEST(Cohesive, WidthOfAPointFollowsItsCells)
{
  for (bool flows : {false, true}) {
    FlowCrack b(PLANE_STRAIN, SOFTENING_LINEAR, 1e3, false);
    if (!flows) b.law.kind = LAW_COHESIVE;
    CrackLaw& crack = b.law.crack;
    crack.X = nullptr;
    crack.box[0] = crack.box[1] = 0.1;
    KernelMode mode;
    mode.finite = false;
    mode.mid    = true;
    mode.s_new = mode.s_old = 0.5;
    const auto stored = [&](const double* E) {
      LawOutput o;
      crack.band = 0.0;
      EXPECT_TRUE(b.at(E, o));
      return o.psi;
    };
    double E0[6] = {0};
    for (int i = 1; i <= 40; ++i) {
      const double band = i < 3 ? 0.0 : i < 6 ? 0.15 : i < 12 ? 0.3 : 0.4;
      double E1[6] = {i == 20 ? -0.01 : 0.003 * i}, h1[MAX_HISTORY] = {0}, S[6];
      const double psi0 = stored(E0), dissipated = b.h[HISTORY_DISSIPATED];
      crack.band = band;
      ASSERT_TRUE(law_step(b.law, mode, E0, E1, b.h, h1, S, nullptr));
      std::copy(h1, h1 + MAX_HISTORY, b.h);
      EXPECT_NEAR(S[0] * (E1[0] - E0[0]), stored(E1) - psi0 + b.h[HISTORY_DISSIPATED] - dissipated, 1e-14) << i;
      const double k = crack_opening(b.law, b.h), width = crack_band(b.law, b.h);
      if (i > 3 && i != 20 && k < crack_open(crack)) {
        EXPECT_NEAR(width, band, 1e-15) << i;
        EXPECT_NEAR(k / width + crack_traction(crack, k) / b.normal_stiffness(), E1[0], 1e-9) << i;
      }
      std::copy(E1, E1 + 6, E0);
    }
    EXPECT_GE(crack_opening(b.law, b.h), crack_open(crack));
  }
}

// explicit steps: work by the mean of the stresses at both ends, while the width grows in each increment; energy to
// the second order, of the first with the stress of the width before. Theory 2.5
TEST(Cohesive, WorkAtBothEndsOfAnExplicitIncrement)
{
  for (bool flows : {false, true})
    for (CrackTangent tangent : {CRACK_TANGENT, CRACK_MEAN}) {
      double error[2];
      for (int k : {0, 1}) {
        const int n = 100 << k;
        FlowCrack b(PLANE_STRAIN, SOFTENING_LINEAR, 1e3, false);
        if (!flows) b.law.kind = LAW_COHESIVE;
        CrackLaw& crack = b.law.crack;
        crack.X       = nullptr;
        crack.box[0]  = crack.box[1] = 0.1;
        crack.tangent = tangent;
        double work = 0.0, before = 0.0;
        for (int i = 1; i <= n; ++i) {
          const double E[6] = {0.02 * i / n};
          crack.band = 0.1 * (1.0 + 0.5 * i / n);
          b.go(E);
          work += 0.5 * (before + b.out.S[0]) * 0.02 / n;
          before = b.out.S[0];
        }
        ASSERT_NEAR(0.15, crack_band(b.law, b.h), 1e-12);
        LawOutput end;
        const double E[6] = {0.02};
        crack.band = 0.0;
        ASSERT_TRUE(b.at(E, end));
        error[k] = std::fabs(work - end.psi - b.h[HISTORY_DISSIPATED]);
      }
      if (tangent == CRACK_MEAN) EXPECT_GT(error[0] / error[1], 3.0) << error[0] << " " << error[1];
      else EXPECT_LT(error[0] / error[1], 2.5) << error[0] << " " << error[1];
    }
}

// a material point: the width of its box along the normal in space
TEST(Cohesive, WidthOfAPointIsThatOfItsBox)
{
  const double pi = std::acos(-1.0);
  for (double turned : {0.0, 90.0, 30.0}) {
    for (double degrees : {0.0, 26.565, 70.0}) {
      Crack b(PLANE_STRAIN, SOFTENING_LINEAR);
      const double a = degrees * pi / 180.0, c = std::cos(a), s = std::sin(a), r = turned * pi / 180.0,
                   angle = a + r;
      CrackLaw& law = b.law.crack;
      law.X = nullptr;
      law.box[0] = 0.1;
      law.box[1] = 0.2;
      law.F[0] = law.F[4] = std::cos(r);
      law.F[1] = -std::sin(r);
      law.F[3] = std::sin(r);
      double E[6]  = {c * c, s * s, 0, c * s, 0, 0};
      for (double& x : E) x *= 0.3;
      b.go(E);
      const double width = 0.1 * std::fabs(std::cos(angle)) + 0.2 * std::fabs(std::sin(angle));
      EXPECT_NEAR(b.h[HISTORY_DISSIPATED], 0.01 / width, 1e-12) << degrees << " " << turned;
      EXPECT_NEAR(crack_band(b.law, b.h), width, 1e-12);
    }
  }
}

// largest opening of the i-th crack in a history
double opened(const Crack& b, const double* h, int i)
{
  return h[law_field(law_of(b.law), HISTORY_CRACK) + 5 * i + 4];
}

// has a crack begun? Its width depends on the strain then, except in a disc
bool begins(const Crack& b, const double* h1)
{
  for (int i = 0; i < 3; ++i)
    if (opened(b, b.h, i) == 0.0 && opened(b, h1, i) > 0.0) return true;
  return false;
}

// takes a random strain and tries another one; false: the first did not crack
bool two_strains(std::mt19937& gen, int trial, Plane plane, Crack& b, double* E, double* h1, int& opened)
{
  random_strain(gen, 0.03, plane, E);
  b.go(E);
  if (crack_opening(b.law, b.h) == 0.0) return false;
  random_strain(gen, trial % 2 ? 0.05 : 0.02, plane, E);
  EXPECT_TRUE(b.at(E, b.out, h1));
  if (crack_opening(b.law, h1) > crack_opening(b.law, b.h)) ++opened;
  return true;
}

TEST(Cohesive, StressAndTangentAreDerivatives)
{
  std::mt19937 gen(7);
  int grown = 0;
  for (Softening s : softenings)
    for (Plane plane : planes)
      for (int trial = 0; trial < 40; ++trial) {
        Crack b(plane, s);
        double E[6], h1[MAX_HISTORY] = {0};
        if (!two_strains(gen, trial, plane, b, E, h1, grown) || begins(b, h1)) continue;
        compare(b, plane, E, 2e-5, 2e-3);
      }
  EXPECT_GT(grown, 50);
}

// a disc is as wide along any normal: what begins to open
TEST(Cohesive, BeginsToOpenWithItsTangent)
{
  std::mt19937 gen(9);
  RealVec disc;
  for (int k = 0; k < 8192; ++k) {
    const double a = 2.0 * std::acos(-1.0) * k / 8192;
    disc.push_back(0.05 * std::cos(a));
    disc.push_back(0.05 * std::sin(a));
  }
  int opened = 0;
  for (Plane plane : {PLANE_STRAIN, PLANE_STRESS})
    for (int trial = 0; trial < 10; ++trial) {
      Crack b(plane, SOFTENING_LINEAR);
      b.law.crack.nodes = 8192;
      b.law.crack.X = disc.data();
      double E[6], h1[MAX_HISTORY] = {0};
      random_strain(gen, 0.03, plane, E);
      ASSERT_TRUE(b.at(E, b.out, h1));
      if (crack_opening(b.law, h1) == 0.0) continue;
      ++opened;
      compare(b, plane, E, 1e-2, 0.1);
    }
  EXPECT_GT(opened, 5);
}

// a line across a square of 0.1, from the middle of its left face at 30 degrees: the jump of its upper nodes
TEST(Cohesive, LineOpensAndSlidesAgainstOneTraction)
{
  const double angle = std::acos(-1.0) / 6.0, N[3] = {-std::sin(angle), std::cos(angle), 0.0};
  const double G[3] = {0.0, 1.0 / 0.1, 0.0}, p = std::cos(angle);
  for (Softening s : softenings) {
    Crack b(PLANE_STRAIN, s);
    crack_line(b.law, G, N, b.h);
    double E[6] = {0};
    E[1] = 0.999 * p / b.normal_stiffness();
    b.go(E);
    EXPECT_NEAR(b.out.S[1], 0.999 * p, 1e-12);         // not a crack yet
    for (double w : {0.001, 0.004, 0.009, 0.015, 0.05}) {
      const double t = p * traction(s, w), across = 0.8, along = 0.6;
      E[1] = across * (t / b.normal_stiffness() + w / 0.1);
      E[3] = 0.5 * along * (t / b.law.mu + w / 0.1);
      b.go(E);
      EXPECT_NEAR(b.out.S[1], across * t, 1e-12) << s << " " << w;
      EXPECT_NEAR(b.out.S[3], along * t, 1e-12) << s << " " << w;
      EXPECT_NEAR(crack_opening(b.law, b.h), w, 1e-13);
    }
    EXPECT_NEAR(b.h[HISTORY_DISSIPATED], p * 0.01 / 0.1, s == SOFTENING_EXPONENTIAL ? 4.1e-3 : 1e-12);
    E[1] = -0.3 / b.normal_stiffness();                // pressed
    b.go(E);
    EXPECT_NEAR(b.out.S[1], -0.3, 1e-12);
  }
  Crack shut(PLANE_STRAIN, SOFTENING_LINEAR);
  crack_shut(shut.law, shut.h);
  double E[6] = {0};
  E[0] = 5.0 / shut.normal_stiffness();
  shut.go(E);
  EXPECT_NEAR(shut.out.S[0], 5.0, 1e-12);
  crack_free(shut.law, shut.h);
  shut.go(E);
  EXPECT_LT(shut.out.S[0], 1.0);
}

TEST(Cohesive, StressAndTangentOfALineAreDerivatives)
{
  std::mt19937 gen(8);
  int opened = 0, closed = 0;
  for (Softening s : softenings)
    for (Plane plane : {PLANE_STRAIN, PLANE_STRESS})
      for (int trial = 0; trial < 60; ++trial) {
        Crack b(plane, s);
        const double angle = 0.1 * trial, N[3] = {std::cos(angle), std::sin(angle), 0.0};
        const double G[3] = {10.0 * std::cos(angle + 0.3), 10.0 * std::sin(angle + 0.3), 0.0};
        crack_line(b.law, G, N, b.h);
        double E[6], h1[MAX_HISTORY] = {0};
        if (!two_strains(gen, trial, plane, b, E, h1, opened)) continue;
        const double* n = crack_normal(b.law, h1);
        closed += n[0] * n[0] * b.out.S[0] + n[1] * n[1] * b.out.S[1] + 2.0 * n[0] * n[1] * b.out.S[3] < 0.0;
        compare(b, plane, E, 2e-5, 2e-3);
      }
  EXPECT_GT(opened, 50);
  EXPECT_GT(closed, 20);
}

namespace {

// strains of plane strain at two openings along x and y, and their tractions                     [6]
void strains_of(const Crack& b, const double* w, const double* S, double width, double* E)
{
  const double nu = b.m.poisson, young = b.m.young;
  std::fill_n(E, 6, 0.0);
  for (int i = 0; i < 2; ++i)
    E[i] = (1.0 - nu * nu) / young * (S[i] - nu / (1.0 - nu) * S[1 - i]) + w[i] / width;
}

// a strain turned about z by an angle                                                          [6]
void turned(double angle, const double* E, double* out)
{
  Eigen::Matrix3d m, full;
  full << E[0], E[3], E[5], E[3], E[1], E[4], E[5], E[4], E[2];
  m = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ());
  full = m * full * m.transpose();
  six_components<3>(full.data(), out);
}

// a, and b with its square and its strains turned by an angle: shear while x unloads at this rate and y opens
void same_turned(Crack& a, Crack& b, double angle, int steps, double unloads)
{
  double X[8];
  for (int k = 0; k < 4; ++k) {
    X[2 * k]     = std::cos(angle) * square[2 * k] - std::sin(angle) * square[2 * k + 1];
    X[2 * k + 1] = std::sin(angle) * square[2 * k] + std::cos(angle) * square[2 * k + 1];
  }
  b.law.crack.X = X;
  for (int i = 1; i <= steps; ++i) {
    double E[6] = {0.001 * i, 0.001 * i, 0, 0, 0, 0}, of[6], S[6];
    if (i > 10) {
      E[0] = 0.01 - unloads * (i - 10);
      E[1] = 0.01 + 0.004 * (i - 10);
      E[3] = 0.0005 * (i - 10);
    }
    a.go(E);
    turned(angle, E, of);
    b.go(of);
    turned(angle, a.out.S, S);
    for (int k = 0; k < 4; ++k) EXPECT_NEAR(b.out.S[k], S[k], 1e-7) << angle << " " << i << k;
    EXPECT_NEAR(a.h[HISTORY_DISSIPATED], b.h[HISTORY_DISSIPATED], 1e-8);
  }
  EXPECT_GT(opened(a, a.h, 1), 0.0);
}

}  // namespace

// opened along x, then along y: the stress along the first crack is at most the strength. Theory (2.36e)
TEST(CohesiveAxes, StrengthIsTheLimitBesideACrack)
{
  for (Softening s : softenings) {
    Crack b(PLANE_STRAIN, s);
    double E[6], w[2] = {0.012, 0.0}, S[2] = {traction(s, w[0]), 0.0};
    strains_of(b, w, S, 0.1, E);
    b.go(E);
    EXPECT_NEAR(b.out.S[0], S[0], 1e-12);
    S[1] = 0.999;
    strains_of(b, w, S, 0.1, E);
    b.go(E);
    EXPECT_NEAR(b.out.S[1], 0.999, 1e-12);
    EXPECT_EQ(opened(b, b.h, 1), 0.0);                      // not yet
    for (double second : {0.001, 0.004, 0.009, 0.0119, 0.015, 0.05}) {
      w[1] = second;
      S[1] = traction(s, second);
      strains_of(b, w, S, 0.1, E);
      b.go(E);
      for (int i = 0; i < 2; ++i) {
        EXPECT_NEAR(b.out.S[i], S[i], 1e-11) << s << " " << second << i;
        EXPECT_NEAR(opened(b, b.h, i), w[i], 1e-12) << s << " " << second << i;
      }
    }
    if (s != SOFTENING_LINEAR) continue;
    EXPECT_NEAR(b.h[HISTORY_DISSIPATED], (0.01 + 0.5 * 0.012) / 0.1, 1e-12);
  }
}

// a crack along x, half shut, and a new one along y whose strain passes that along x: neither stress jumps, each axis
// has its own history
TEST(CohesiveAxes, StrainsCrossWithoutAJump)
{
  Crack b(PLANE_STRAIN, SOFTENING_LINEAR);
  double E[6], w[2] = {0.012, 0.0}, S[2] = {0.4, 0.0};
  strains_of(b, w, S, 0.1, E);
  b.go(E);
  w[0] = 0.004;
  S[0] = 0.4 / 3.0;                                    // on the way to the origin
  for (int i = 1; i <= 100; ++i) {
    w[1] = 0.00015 * i;
    S[1] = 1.0 - w[1] / 0.02;
    strains_of(b, w, S, 0.1, E);
    b.go(E);
    EXPECT_NEAR(b.out.S[0], S[0], 1e-12) << i;
    EXPECT_NEAR(b.out.S[1], S[1], 1e-12) << i;
  }
  EXPECT_NEAR(opened(b, b.h, 0), 0.012, 1e-13);
  EXPECT_NEAR(opened(b, b.h, 1), 0.015, 1e-13);
}

// random paths of several openings: the work is stored or dissipated, what is dissipated never falls, no stress of
// an axis that has opened is beyond the strength, derivatives of energy and stress
TEST(CohesiveAxes, RandomPathsAreAPotential)
{
  std::mt19937 gen(21);
  KernelMode mode;
  mode.finite = false;
  mode.mid    = true;
  mode.s_new = mode.s_old = 0.5;
  int two = 0, three = 0, grows = 0;
  for (Softening s : softenings)
    for (Plane plane : planes)
      for (int trial = 0; trial < 30; ++trial) {
        Crack b(plane, s);
        double E0[6] = {0}, psi0 = 0.0;
        const bool follows = trial % 3 == 0 && plane != PLANE_STRESS;    // widths follow the mean normal
        if (follows) b.law.crack.across[0] = 1.0;
        for (int step = 0; step < 8; ++step) {
          double E1[6], S[6], h1[MAX_HISTORY] = {0};
          random_strain(gen, 0.06, plane, E1);
          for (int i = 0; i < (plane == PLANE_NONE ? 3 : 2); ++i) E1[i] += 0.05;
          ASSERT_TRUE(law_step(b.law, mode, E0, E1, b.h, h1, S, nullptr));
          const double gone = h1[HISTORY_DISSIPATED] - b.h[HISTORY_DISSIPATED];
          if (!follows) {
            EXPECT_GE(gone, -1e-13);
          }
          if (opened(b, b.h, 1) > 0.0 && !begins(b, h1) && !follows) {
            grows += opened(b, h1, 1) > opened(b, b.h, 1);
            compare(b, plane, E1, 1e-4, 1e-2);
          }
          ASSERT_TRUE(b.at(E1, b.out, h1));
          double work = 0.0;
          for (int k = 0; k < 6; ++k) work += (k < 3 ? 1.0 : 2.0) * S[k] * (E1[k] - E0[k]);
          EXPECT_NEAR(work, b.out.psi - psi0 + gone, 1e-12 * (1.0 + std::fabs(work))) << plane << follows << " " << step;
          std::copy(h1, h1 + MAX_HISTORY, b.h);
          two += opened(b, b.h, 1) > 0.0;
          three += opened(b, b.h, 2) > 0.0;
          psi0 = b.out.psi;
          std::copy(E1, E1 + 6, E0);
          double full[9];
          full_tensor<3>(b.out.S, full);
          const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> of(Eigen::Map<Eigen::Matrix3d>{full});
          EXPECT_LT(of.eigenvalues()[2], 1.0 + 1e-9);
        }
      }
  EXPECT_GT(two, 500);
  EXPECT_GT(three, 100);
  EXPECT_GT(grows, 300);
}

// a path of two openings, at first of equal strain along all axes, in an element that is turned with it
TEST(CohesiveAxes, TurnedPathsAreTheSame)
{
  for (Plane plane : {PLANE_STRAIN, PLANE_STRESS})
    for (double angle : {0.1, 0.5, 1.0, 2.0}) {
      Crack a(plane, SOFTENING_LINEAR), b(plane, SOFTENING_LINEAR);
      same_turned(a, b, angle, 40, 0.0003);         // one axis unloads, the other takes over
    }
}

namespace {

// largest principal stress in space, in 2D in the plane; of Kirchhoff where strains are large: S C has its
// eigenvalues
double largest_stress(const Crack& b, Plane plane, const double* E)
{
  double S[9], C[9];
  full_tensor<3>(b.out.S, S);
  full_tensor<3>(E, C);
  Eigen::Matrix3d SC = Eigen::Map<Eigen::Matrix3d>(S);
  if (b.finite) SC *= (Eigen::Matrix3d::Identity() + 2.0 * Eigen::Map<Eigen::Matrix3d>(C)).eval();
  if (plane == PLANE_NONE) return SC.eigenvalues().real().maxCoeff();
  return SC.topLeftCorner<2, 2>().eigenvalues().real().maxCoeff();
}

}  // namespace

// what does not flow is the elastic law
TEST(CohesiveFlow, WithoutFlowIsCohesive)
{
  std::mt19937 gen(11);
  int alone = 0, several = 0;
  for (Softening s : softenings)
    for (Plane plane : planes)
      for (int trial = 0; trial < 20; ++trial) {
        Crack a(plane, s);
        FlowCrack b(plane, s, 1e4, false);
        for (double size : {0.004, 0.02, 0.05}) {
          double E[6];
          random_strain(gen, size, plane, E);
          a.go(E);
          b.go(E);
          ++(opened(a, a.h, 1) > 0.0 ? several : alone);
          EXPECT_NEAR(a.out.psi, b.out.psi, 1e-10);
          EXPECT_NEAR(a.h[HISTORY_DISSIPATED], b.h[HISTORY_DISSIPATED], 1e-10);
          for (int i = 0; i < 6; ++i) EXPECT_NEAR(a.out.S[i], b.out.S[i], 1e-9) << plane << i;
          for (int i = 0; i < 36; ++i) {
            if (plane != PLANE_NONE && (i / 6 > 3 || i % 6 > 3)) continue;
            EXPECT_NEAR(a.out.D[i], b.out.D[i], 1e-6) << plane << i;
          }
        }
      }
  EXPECT_GT(alone, 250);
  EXPECT_GT(several, 100);
}

// and what does not open is the cone alone
TEST(CohesiveFlow, WithoutCrackIsTheCone)
{
  std::mt19937 gen(12);
  for (bool large : {false, true})
    for (Plane plane : planes)
      for (int trial = 0; trial < 40; ++trial) {
        FlowCrack a(plane, SOFTENING_LINEAR, 3.0, large), b(plane, SOFTENING_LINEAR, 3.0, large);
        if (trial % 2) a.bend(), b.bend();
        a.law.kind = LAW_DRUCKER_PRAGER;
        b.law.crack.strength = 1e3;
        for (double size : {0.01, 0.03}) {
          double E[6];
          random_strain(gen, size, plane, E);
          a.go(E);
          b.go(E);
          EXPECT_NEAR(a.h[HISTORY_DISSIPATED], b.h[HISTORY_DISSIPATED], 1e-12);
          for (int i = 0; i < 6; ++i) EXPECT_NEAR(a.out.S[i], b.out.S[i], 1e-9) << plane << i;
          if (a.out.S[0] == a.out.S[1] && a.out.S[3] == 0.0) continue;         // apex: a stand-in for the tangent
          for (int i = 0; i < 36; ++i) EXPECT_NEAR(a.out.D[i], b.out.D[i], 1e-6) << plane << i;
        }
      }
}

// flow first, then a crack, then both: derivatives of energy and stress
TEST(CohesiveFlow, StressAndTangentAreDerivatives)
{
  std::mt19937 gen(13);
  int both = 0, both_curved = 0;
  for (bool large : {false, true})
    for (Plane plane : planes)
      for (int trial = 0; trial < 480; ++trial) {
        FlowCrack b(plane, SOFTENING_LINEAR, 3.0, large);
        if (trial >= 240) b.bend();
        double E[6], h1[MAX_HISTORY] = {0};
        random_strain(gen, 0.02, plane, E);
        E[0] -= 0.03;
        b.go(E);
        random_strain(gen, 0.02, plane, E);
        E[0] += 0.04;
        b.go(E);
        if (crack_opening(b.law, b.h) < 0.3 * crack_open(b.law.crack)) continue;
        random_strain(gen, trial % 2 ? 0.05 : 0.03, plane, E);
        ASSERT_TRUE(b.at(E, b.out, h1));
        const int flow = law_field(law_of(b.law), HISTORY_EQUIVALENT);
        if (h1[flow] == b.h[flow] || begins(b, h1)) continue;
        ++(trial < 240 ? both : both_curved);
        compare(b, plane, E, 5e-5, 1e-2);
      }
  EXPECT_GT(both, 30);
  EXPECT_GT(both_curved, 30);
}

// plane stress of what flows and cracks in any order, in steps from strain to strain, with and without
// dilation: there is always an answer; derivatives of energy and stress where neither has a kink
TEST(CohesiveFlow, PlaneStressIsFound)
{
  std::mt19937 gen(17);
  const int STEPS = 10;
  int missed = 0, cracked = 0, negative = 0;
  for (bool large : {false, true})
    for (Softening s : softenings)
      for (double y : {3.0, 5.0, 30.0})
        for (int trial = 0; trial < 300; ++trial) {
          FlowCrack b(PLANE_STRESS, s, y, large);
          if (trial >= 200) b.bend();
          b.m.dilation = trial % 2 ? b.m.dilation : 0.0;
          double from[6] = {0}, to[6] = {0}, E[6], h1[MAX_HISTORY];
          bool found = true;
          for (int n = 0; n < 8 * STEPS && found; ++n) {
            if (n % STEPS == 0) {
              std::copy(to, to + 6, from);
              random_strain(gen, n / STEPS % 2 ? 0.1 : 0.02, PLANE_STRESS, to);
            }
            for (int i = 0; i < 6; ++i) E[i] = from[i] + (to[i] - from[i]) * (n % STEPS + 1) / STEPS;
            found = b.at(E, b.out, h1);
            negative += b.out.dissipated < -1e-12;
            std::copy(h1, h1 + (found ? MAX_HISTORY : 0), b.h);
          }
          missed += !found;
          cracked += crack_opening(b.law, b.h) > 0.0;
          if (trial % 200 >= 10 || trial % 2 == 0 || !found) continue;
          random_strain(gen, 0.05, PLANE_STRESS, E);
          ASSERT_TRUE(b.at(E, b.out, h1));
          if (begins(b, h1)) continue;
          compare(b, PLANE_STRESS, E, 1e-6, 1e-4);
        }
  EXPECT_EQ(missed, 0);
  EXPECT_EQ(negative, 0);
  EXPECT_GT(cracked, 4500);
}

// stored and dissipated energy of long paths in space, stretches of 0.5 to 2, are the work of the stress, of
// second order where dilation = friction; the axis of the crack is that of the largest strain also where the
// cone returns to its apex
TEST(CohesiveFlow, LongPathsConserveEnergy)
{
  using Mat3 = Eigen::Matrix3d;
  std::mt19937 gen(3);
  std::uniform_real_distribution<double> any(-0.6, 0.6);
  const int STEPS = 200;
  for (double dilation : {0.0, 1.0, 1e3}) {            // the last: the curve
    double work = 0.0, kept = 0.0;
    for (int trial = 0; trial < 40; ++trial) {
      FlowCrack b(PLANE_NONE, SOFTENING_LINEAR, 3.0, true);
      b.m.yield            = {3.0, 3.0};
      if (dilation > 1.0) b.bend();
      b.m.dilation         = dilation;
      b.law.crack.strength = 0.1;
      b.law.crack.gc       = 1e-3;
      Mat3 from = Mat3::Zero(), to = Mat3::Zero();     // logarithmic strains
      double E0[6] = {0}, S0[6] = {0};
      for (int n = 0; n < 6 * STEPS; ++n) {
        if (n % STEPS == 0) {
          from = to;
          for (int i = 0; i < 9; ++i) to(i) = any(gen);
          to = (0.5 * (to + to.transpose())).eval();
        }
        const Mat3 e = from + (to - from) * (n % STEPS + 1) / STEPS;
        const Eigen::SelfAdjointEigenSolver<Mat3> axes(e);
        const Eigen::Vector3d C = (2.0 * axes.eigenvalues().array()).exp();
        const Mat3 G = 0.5 * (axes.eigenvectors() * C.asDiagonal() * axes.eigenvectors().transpose() -
                              Mat3::Identity());
        const double E[6] = {G(0, 0), G(1, 1), G(2, 2), G(0, 1), G(1, 2), G(2, 0)};
        b.go(E);
        for (int i = 0; i < 6; ++i)
          work += 0.5 * (b.out.S[i] + S0[i]) * (E[i] - E0[i]) * (i < 3 ? 1.0 : 2.0);
        std::copy(E, E + 6, E0);
        std::copy(b.out.S, b.out.S + 6, S0);
      }
      kept += b.out.psi + b.h[HISTORY_DISSIPATED];
    }
    EXPECT_NEAR(kept, work, (dilation > 0.0 ? 1e-4 : 4e-3) * work) << dilation;
  }
}

// equal strains along both axes, then shear, a second crack and flow, in an element that is turned with it
TEST(CohesiveFlow, TurnedPathsAreTheSame)
{
  for (Plane plane : {PLANE_STRAIN, PLANE_STRESS})
    for (double angle : {0.1, 0.5, 1.0, 2.0}) {
      FlowCrack a(plane, SOFTENING_LINEAR, 3.0, false), b(plane, SOFTENING_LINEAR, 3.0, false);
      same_turned(a, b, angle, 60, 0.002);         // one axis is pressed, the other opens
      EXPECT_GT(a.h[law_field(law_of(a.law), HISTORY_EQUIVALENT)], 0.0);
    }
}

// cracks along several axes of material that flows, in steps from strain to strain, one or ten, with and without
// dilation, straight and curved: there is always an answer, no stress is beyond the strength, no step gains energy
TEST(CohesiveFlow, SeveralAxesAreFound)
{
  std::mt19937 gen(23);
  int missed = 0, negative = 0, beyond = 0, two = 0, three = 0, flows = 0;
  for (bool large : {false, true})
    for (Plane plane : planes)
      for (Softening s : softenings)
        for (double y : {1.5, 3.0, 10.0, 30.0})
          for (int trial = 0; trial < 150; ++trial) {
            FlowCrack b(plane, s, y, large);
            if (trial % 3 == 2) b.bend();
            b.m.dilation = trial % 2 ? b.m.dilation : 0.0;
            const int steps = trial < 75 ? 1 : 10, flow = law_field(law_of(b.law), HISTORY_EQUIVALENT);
            double from[6] = {0}, to[6] = {0}, E[6], h1[MAX_HISTORY];
            for (int n = 0; n < 8 * steps; ++n) {
              if (n % steps == 0) {
                std::copy(to, to + 6, from);
                random_strain(gen, n / steps % 2 ? 0.1 : 0.03, plane, to);
                for (int i = 0; i < (plane == PLANE_NONE ? 3 : 2); ++i) to[i] += 0.03;
              }
              for (int i = 0; i < 6; ++i) E[i] = from[i] + (to[i] - from[i]) * (n % steps + 1) / steps;
              if (!b.at(E, b.out, h1)) {
                ++missed;
                break;
              }
              negative += b.out.dissipated < -1e-12;
              beyond += largest_stress(b, plane, E) > 1.0 + 1e-6;
              flows += h1[flow] > b.h[flow];
              std::copy(h1, h1 + MAX_HISTORY, b.h);
              two += opened(b, b.h, 1) > 0.0;
              three += opened(b, b.h, 2) > 0.0;
            }
          }
  EXPECT_EQ(missed, 0);
  EXPECT_EQ(negative, 0);
  EXPECT_EQ(beyond, 0);
  EXPECT_GT(two, 400000);
  EXPECT_GT(three, 80000);
  EXPECT_GT(flows, 80000);
}

// random paths of several openings and flow: the work is stored or dissipated, derivatives of energy and stress
TEST(CohesiveFlow, SeveralAxesAreAPotential)
{
  std::mt19937 gen(29);
  KernelMode mode;
  mode.mid   = true;
  mode.s_new = mode.s_old = 0.5;
  int several = 0, both = 0;
  for (bool large : {false, true})
    for (Softening s : softenings)
      for (Plane plane : planes)
        for (int trial = 0; trial < 60; ++trial) {
          FlowCrack b(plane, s, trial % 3 ? 3.0 : 10.0, large);
          if (trial % 2) b.bend();
          const int flow = law_field(law_of(b.law), HISTORY_EQUIVALENT);
          mode.finite    = large;
          double E0[6] = {0}, psi0 = 0.0;
          for (int step = 0; step < 8; ++step) {
            double E1[6], S[6], h1[MAX_HISTORY] = {0};
            random_strain(gen, 0.06, plane, E1);
            for (int i = 0; i < (plane == PLANE_NONE ? 3 : 2); ++i) E1[i] += 0.04;
            ASSERT_TRUE(law_step(b.law, mode, E0, E1, b.h, h1, S, nullptr));
            const double gone = h1[HISTORY_DISSIPATED] - b.h[HISTORY_DISSIPATED];
            EXPECT_GE(gone, -1e-12);
            if (opened(b, b.h, 1) > 0.0 && !begins(b, h1)) {
              ++several;
              both += h1[flow] > b.h[flow];
              compare(b, plane, E1, 1e-4, 1e-2);
            }
            ASSERT_TRUE(b.at(E1, b.out, h1));
            double work = 0.0;
            for (int k = 0; k < 6; ++k) work += (k < 3 ? 1.0 : 2.0) * S[k] * (E1[k] - E0[k]);
            EXPECT_NEAR(work, b.out.psi - psi0 + gone, 1e-12 * (1.0 + std::fabs(work))) << plane << " " << step;
            std::copy(h1, h1 + MAX_HISTORY, b.h);
            psi0 = b.out.psi;
            std::copy(E1, E1 + 6, E0);
          }
        }
  EXPECT_GT(several, 4000);
  EXPECT_GT(both, 500);
}
