// amplitudes, values of loads and supports over a step

#include <gtest/gtest.h>

#include <cmath>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "base/grow.h"
#include "model/model.h"
#include "model/scheme.h"

namespace {

Amplitude table(AmplitudeKind kind, int n)
{
  Amplitude a;
  a.kind = kind;
  for (int i = 0; i < n; ++i) {
    a.t.push_back(0.1 * i);
    a.y.push_back(std::sin(0.1 * i));
  }
  return a;
}

TEST(Expr, same_number_or_same_text_with_the_same_parameters)
{
  std::string error;
  int position;
  Expr a, b, c, d;
  ASSERT_TRUE(expr_compile("k*x", {{"k", 2.0}, {"other", 1.0}}, a, error, position));
  ASSERT_TRUE(expr_compile("k*x", {{"k", 2.0}, {"other", 5.0}}, b, error, position));
  ASSERT_TRUE(expr_compile("k*x", {{"k", 3.0}, {"other", 1.0}}, c, error, position));
  ASSERT_TRUE(expr_compile("x*k", {{"k", 2.0}}, d, error, position));
  EXPECT_TRUE(expr_same(a, b));
  EXPECT_FALSE(expr_same(a, c));                     // the parameter has got another value between the lines
  EXPECT_FALSE(expr_same(a, d));
  EXPECT_TRUE(expr_same(expr_number(2.0), expr_number(2.0)));
  EXPECT_FALSE(expr_same(expr_number(2.0), expr_number(3.0)));
  EXPECT_FALSE(expr_same(expr_number(0.0), a));
}

TEST(Amplitude, tabular_is_linear_and_constant_outside)
{
  Amplitude a;
  a.t = {1.0, 2.0, 4.0};
  a.y = {10.0, 20.0, 0.0};
  EXPECT_DOUBLE_EQ(amplitude_eval(a, 0.0, 9.0), 10.0);
  EXPECT_DOUBLE_EQ(amplitude_eval(a, 1.5, 9.0), 15.0);
  EXPECT_DOUBLE_EQ(amplitude_eval(a, 3.0, 9.0), 10.0);
  EXPECT_DOUBLE_EQ(amplitude_eval(a, 7.0, 9.0), 0.0);
}

TEST(Amplitude, total_time_reads_the_other_clock)
{
  Amplitude a;
  a.t = {0.0, 10.0};
  a.y = {0.0, 10.0};
  a.total_time = true;
  EXPECT_DOUBLE_EQ(amplitude_eval(a, 1.0, 4.0), 4.0);
}

TEST(Amplitude, smooth_step_has_the_quintic_of_abaqus)
{
  Amplitude a;
  a.kind = AMP_SMOOTH_STEP;
  a.t = {0.0, 2.0};
  a.y = {1.0, 3.0};
  EXPECT_DOUBLE_EQ(amplitude_eval(a, 1.0, 0.0), 2.0);
  const double s = 0.25;
  EXPECT_DOUBLE_EQ(amplitude_eval(a, 0.5, 0.0), 1.0 + 2.0 * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s));
}

TEST(Amplitude, splines_pass_through_points_and_follow_a_sine)
{
  for (AmplitudeKind kind : {AMP_STEFFEN, AMP_AKIMA, AMP_CUBIC}) {
    const Amplitude a = table(kind, 200);
    for (int i = 0; i < 200; ++i) EXPECT_NEAR(amplitude_eval(a, a.t[i], 0.0), a.y[i], 1e-14);
    for (double t = 1.03; t < 18.0; t += 0.37) EXPECT_NEAR(amplitude_eval(a, t, 0.0), std::sin(t), 2e-3);
  }
}

TEST(Amplitude, the_window_of_a_cubic_spline_is_as_good_as_the_whole_table)
{
  const Amplitude a = table(AMP_CUBIC, 400);
  Amplitude middle = a;                     // 100 points around t = 20
  middle.t.assign(a.t.begin() + 150, a.t.begin() + 250);
  middle.y.assign(a.y.begin() + 150, a.y.begin() + 250);
  for (double t = 19.0; t < 21.0; t += 0.0613)
    EXPECT_NEAR(amplitude_eval(a, t, 0.0), amplitude_eval(middle, t, 0.0), 1e-15);
}

TEST(Amplitude, steffen_keeps_a_plateau_flat)
{
  Amplitude a;
  a.kind = AMP_STEFFEN;
  a.t = {0.0, 1.0, 2.0, 3.0, 4.0};
  a.y = {0.0, 0.0, 1.0, 1.0, 1.0};
  for (double t = 0.0; t <= 4.0; t += 0.01) {
    EXPECT_GE(amplitude_eval(a, t, 0.0), 0.0);
    EXPECT_LE(amplitude_eval(a, t, 0.0), 1.0);
  }
  EXPECT_DOUBLE_EQ(amplitude_eval(a, 2.5, 0.0), 1.0);
}

TEST(Amplitude, expression_of_t)
{
  Amplitude a;
  a.kind = AMP_EXPRESSION;
  std::string error;
  int position = 0;
  ASSERT_TRUE(expr_compile("3*t^2", ParamMap(), a.expr, error, position));
  EXPECT_DOUBLE_EQ(amplitude_eval(a, 2.0, 5.0), 12.0);
}

TEST(Load, ramps_in_and_out)
{
  Model m;
  Step s;
  s.period = 2.0;
  Load l;
  l.ramp  = RAMP_IN;
  l.value = expr_number(30.0);
  const double x[3] = {0.0, 0.0, 0.0};
  EXPECT_DOUBLE_EQ(load_value(m, s, l, x, 0.0, 5.0), 0.0);
  EXPECT_DOUBLE_EQ(load_value(m, s, l, x, 1.0, 6.0), 15.0);
  EXPECT_DOUBLE_EQ(load_value(m, s, l, x, 2.0, 7.0), 30.0);
  l.ramp = RAMP_OUT;
  l.factor = 0.5;
  EXPECT_DOUBLE_EQ(load_value(m, s, l, x, 0.5, 5.5), 11.25);
  l.ramp = RAMP_NONE;
  EXPECT_DOUBLE_EQ(load_value(m, s, l, x, 0.5, 5.5), 15.0);
}

TEST(Load, amplitude_and_expression_do_not_ramp)
{
  Model m;
  m.amplitude.resize(1);
  m.amplitude[0].t = {0.0, 1.0};
  m.amplitude[0].y = {0.0, 1.0};
  Step s;
  Load l;
  l.value = expr_number(8.0);
  l.amplitude = 0;
  const double x[3] = {2.0, 0.0, 0.0};
  EXPECT_DOUBLE_EQ(load_value(m, s, l, x, 0.25, 0.25), 2.0);

  Prescribed b;
  std::string error;
  int position = 0;
  ASSERT_TRUE(expr_compile("x*t", ParamMap(), b.value, error, position));
  EXPECT_DOUBLE_EQ(prescribed_value(m, b, x, 0.25, 3.0), 6.0);
}

TEST(Model, finders)
{
  Model m;
  m.material.resize(2);
  m.material[1].name = "STEEL";
  EXPECT_EQ(model_find_material(m, "STEEL"), 1);
  EXPECT_EQ(model_find_material(m, "GLASS"), -1);
  EXPECT_EQ(model_find_body(m, "STEEL"), -1);
}

// ---- time schemes on an oscillator of mass 1 and stiffness k

struct Motion {
  double u = 1.0, v = 0.0, a = 0.0;
};

void advance(const Step& s, double dt, double k, Motion& m)
{
  const Scheme& scheme = scheme_of(s);
  // of du in the force; linear: the discrete gradient is the middle
  const double part    = scheme.midpoint ? 0.5 : 1.0;
  const double du      = (scheme.known(s, dt, m.v, m.a, k * m.u) - k * m.u) / (scheme.mass(s, dt) + part * k);
  Motion next;
  next.u = m.u + du;
  scheme.node(s, dt, du, m.v, m.a, next.v, next.a);
  EXPECT_NEAR(scheme.grid(s, dt, du, m.v, m.a), next.v - m.v,
              1e-12 * (std::fabs(next.v) + std::fabs(m.v)) + 1e-14);
  m = next;
}

double energy(const Motion& m, double k) { return 0.5 * m.v * m.v + 0.5 * k * m.u * m.u; }

Step hht(double alpha)
{
  Step s;
  s.scheme = SCHEME_HHT;
  s.alpha  = alpha;
  s.beta   = 0.25 * (1.0 - alpha) * (1.0 - alpha);
  s.gamma  = 0.5 - alpha;
  return s;
}

TEST(Scheme, NewmarkAndEnergyMomentumKeepTheEnergyOfAnOscillator)
{
  for (TimeScheme scheme : {SCHEME_NEWMARK, SCHEME_ENERGY_MOMENTUM}) {
    Step s;
    s.scheme = scheme;
    Motion m;
    m.a = -9.0;
    for (int i = 0; i < 100; ++i) advance(s, 0.3, 9.0, m);
    EXPECT_NEAR(energy(m, 9.0), 4.5, 1e-11);
    EXPECT_FALSE(scheme_of(s).dissipates(s));
  }
}

// damping c: second order of all schemes, and energy-momentum loses c du^2/dt in an increment
TEST(Scheme, DampedOscillatorIsOfSecondOrder)
{
  const double k = 1.0, c = 0.2, w = std::sqrt(k - 0.25 * c * c), end = 5.0;
  const double exact = std::exp(-0.5 * c * end) * (std::cos(w * end) + 0.5 * c / w * std::sin(w * end));
  Step newmark, middle;
  newmark.scheme = SCHEME_NEWMARK;
  middle.scheme  = SCHEME_ENERGY_MOMENTUM;
  for (const Step& s : {newmark, middle, hht(-0.1)}) {
    const Scheme& scheme = scheme_of(s);
    double error[2];
    for (int n : {0, 1}) {
      const int count = n == 0 ? 100 : 200;
      const double dt = end / count, part = scheme.midpoint ? 0.5 : 1.0;
      Motion m;
      m.a = -k;
      for (int i = 0; i < count; ++i) {
        const double cC = scheme.damping(s, dt), known = scheme.damping_known(s, dt, m.v, m.a);
        const double du = (scheme.known(s, dt, m.v, m.a, k * m.u) - k * m.u - c * known) /
                          (scheme.mass(s, dt) + part * k + c * cC);
        Motion next;
        next.u = m.u + du;
        scheme.node(s, dt, du, m.v, m.a, next.v, next.a);
        if (scheme.midpoint) {
          EXPECT_NEAR(energy(m, k) - energy(next, k), c * du * du / dt, 1e-14);
        }
        m = next;
      }
      error[n] = std::fabs(m.u - exact);
    }
    EXPECT_NEAR(std::log2(error[0] / error[1]), 2.0, 0.05) << scheme.name;
  }
}

// of Hilber, Hughes and Taylor (1977): (1 + alpha)/(1 - alpha)
TEST(Scheme, SpectralRadiusOfHhtAtLargeIncrements)
{
  for (double alpha : {-0.05, -0.1, -0.3}) {
    const Step s = hht(alpha);
    Motion m;
    m.a = -1e12;
    for (int i = 0; i < 400; ++i) advance(s, 1.0, 1e12, m);
    double before = 0.0, after = 0.0;                 // of two increments, since the sign changes
    for (int i = 0; i < 50; ++i) {
      before = std::log(std::fabs(m.u));
      advance(s, 1.0, 1e12, m);
      advance(s, 1.0, 1e12, m);
      after = std::log(std::fabs(m.u));
      m.u *= 1e3;
      m.v *= 1e3;
      m.a *= 1e3;
    }
    EXPECT_NEAR(std::exp(0.5 * (after - before)), (1.0 + alpha) / (1.0 - alpha), 0.01);
    EXPECT_TRUE(scheme_of(s).dissipates(s));
  }
}

TEST(Scheme, HhtIsOfSecondOrderAndWithoutAlphaNewmark)
{
  double error[2], none = 0.0;
  for (int n : {0, 1}) {
    const Step s = hht(-0.1);
    Motion m;
    m.a = -1.0;
    const int count = n == 0 ? 100 : 200;
    for (int i = 0; i < count; ++i) advance(s, 5.0 / count, 1.0, m);
    error[n] = std::fabs(m.u - std::cos(5.0));
  }
  EXPECT_NEAR(std::log2(error[0] / error[1]), 2.0, 0.05);
  Step newmark;
  Motion a, b;
  a.a = b.a = -1.0;
  for (int i = 0; i < 20; ++i) {
    advance(hht(0.0), 0.3, 1.0, a);
    advance(newmark, 0.3, 1.0, b);
    none = std::max(none, std::fabs(a.u - b.u));
  }
  EXPECT_LT(none, 1e-14);
}

// large arrays that stay do not make the heap larger when they fit into none of its holes; all others do
TEST(Heap, LargeArraysHavePagesOfTheirOwn)
{
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer has a heap of its own, without mallinfo";
#elif defined(__GLIBC__)
  mallopt(M_MMAP_MAX, 65536);            // SuperLU, which comes with PETSc, has switched it off
  const auto apart = [] { return mallinfo2().hblks; };
  const std::size_t n = 3000000, small = 7000;       // 24 MB, 56 kB
  const auto before = apart();
  std::vector<std::vector<double>> x(20), other(20);
  for (auto& v : x) reserve_apart(v, n); // holes come first
  const auto filled = apart();
  EXPECT_GT(filled, before + 10);
  for (auto& v : other) v.reserve(n);
  EXPECT_EQ(apart(), filled);
  for (auto& v : other) std::vector<double>().swap(v);
  std::vector<std::vector<double>> many(2000);
  for (auto& v : many) reserve_apart(v, small);
  EXPECT_EQ(apart(), filled);
  std::vector<double>().swap(x.back());
  EXPECT_EQ(apart(), filled - 1);
#endif
}

}  // namespace
