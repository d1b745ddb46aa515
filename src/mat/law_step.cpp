#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "base/log.h"
#include "mat/crack.h"
#include "mat/voigt.h"

namespace {

// for E33 in plane stress; quadratic from a good start: 3 to 6; bisections: up to 60  (no test)
const int MAX_ITERATIONS = 120;
const double ROUND_OF_E33 = 1e-15;    // relative to 1 + E33: bounds closer than this are equal  (no test)
const double JUMP        = 1e-9;     // relative to the stress  (no test)
const double SOFT_SHEET   = 1e-3;     // relative to mu: least stiffness across the sheet  (no test)
// (dE/E)^2: below, the mean stress is exact to round-off (2.14), except with plastic flow  (no test)
const double SAME_STRAIN = 1e-14;
// relative to the largest component: accuracy of an initial stress (2.44)
// (test: Law.InitialStrainGivesTheInitialStress)
const double ROUND_OF_STRESS = 1e-12;

// D of plane stress: without row and column 33; of a D that is not symmetric the symmetric part (2.13) (2.40)
void condense(double* D)
{
  const double pivot = D[14];
  double row[6], col[6];
  for (int j = 0; j < 6; ++j) {
    row[j] = D[12 + j];
    col[j] = D[6 * j + 2];
  }
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) D[i * 6 + j] -= col[i] * row[j] / pivot;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < i; ++j) D[i * 6 + j] = D[j * 6 + i] = 0.5 * (D[i * 6 + j] + D[j * 6 + i]);
}

// E33 of plane stress between two bounds, -inf and inf at first: S33 is below 0 at lo, above at hi
struct Thickness {
  bool finite;
  double lo, hi;

  // from E33 with the Newton step of S33; a step that leaves the bounds is a bisection
  double next(double E33, double S33, double step)
  {
    (S33 > 0.0 ? hi : lo) = E33;
    double x = E33 + step;
    if (finite && x <= -0.5) x = E33 + 0.5 * (-0.5 - E33);
    if (x > lo && x < hi) return x;
    if (std::isfinite(lo) && std::isfinite(hi)) return 0.5 * (lo + hi);
    if (finite && S33 > 0.0) return E33 + 0.5 * (-0.5 - E33);
    return E33 + (S33 > 0.0 ? -1.0 : 1.0) * (1e-4 + std::fabs(E33));
  }
  bool closed() const { return std::isfinite(lo) && hi - lo <= ROUND_OF_E33 * (1.0 + std::fabs(lo)); }
};

// viscous stress eta D (E1 - E0), D of small strains, and its tangent unless C is null   (2.19)
void add_viscosity(const MatLaw& law, double eta, const double* E0, const double* E1, double* S, double* C)
{
  const bool plane_stress = law.plane == PLANE_STRESS;
  const double lam = plane_stress ? law.lam : law.lam3;
  double tr = 0.0;
  for (int i = 0; i < 3; ++i)
    if (!plane_stress || i != 2) tr += E1[i] - E0[i];
  for (int i = 0; i < 6; ++i) {
    if (plane_stress && i == 2) continue;
    S[i] += eta * ((i < 3 ? lam * tr : 0.0) + 2.0 * law.mu * (E1[i] - E0[i]));
    if (!C) continue;
    for (int j = 0; j < 3 && i < 3; ++j)
      if (!plane_stress || j != 2) C[i * 6 + j] += eta * lam;
    C[i * 7] += eta * law.mu * (i < 3 ? 2.0 : 1.0);
  }
}

// the discrete gradient between the states zero and one: S and C                        (2.14), (2.15)
//   loss   dissipated / volume between them
void discrete_gradient(const LawOutput& zero, const LawOutput& one, double loss, const double* E0,
                       const double* E1, bool plane_stress, double* S, double* C)
{
  double d[6], mean[6];
  for (int i = 0; i < 6; ++i) {
    d[i]    = plane_stress && i == 2 ? 0.0 : E1[i] - E0[i];
    S[i]    = 0.5 * (zero.S[i] + one.S[i]);
    mean[i] = 0.5 * (E0[i] + E1[i]);
  }
  for (int i = 0; C && i < 36; ++i) C[i] = 0.5 * one.D[i];
  const double dd = six_dot(d, d);
  if (dd <= SAME_STRAIN * six_dot(mean, mean)) return;
  const double a = (one.psi - zero.psi + loss - six_dot(S, d)) / dd;
  if (C) {
    double Cd[6], g[6];
    six_times(one.D, d, Cd);
    for (int i = 0; i < 6; ++i) g[i] = (one.S[i] - S[i] - 0.5 * Cd[i] - 2.0 * a * d[i]) / dd;
    for (int i = 0; i < 6; ++i) {
      if (plane_stress && i == 2) continue;
      for (int j = 0; j < 6; ++j) C[i * 6 + j] += 0.5 * (d[i] * g[j] + g[i] * d[j]);
      C[i * 7] += a * (i < 3 ? 1.0 : 0.5);
    }
  }
  for (int i = 0; i < 6; ++i) S[i] += a * d[i];
}

const std::vector<HistoryField> flow_history = {{"plastic deformation", 6, HISTORY_DEFORMATION},
                                                {"equivalent plastic strain", 1, HISTORY_EQUIVALENT}};

// one row for each LawKind
Law table[] = {
    {"elastic", {}, true, law_svk, nullptr},
    {"neo-Hooke", {}, false, law_neo_hooke, nullptr},
    {"J2 plasticity", flow_history, false, law_j2, nullptr},
    {"Drucker-Prager plasticity", {{"plastic deformation", 6, HISTORY_DEFORMATION},
                                   {"equivalent plastic strain", 1, HISTORY_EQUIVALENT},
                                   {"gap", 1, HISTORY_KEPT}}, false, law_drucker_prager, nullptr},
    {"granular", flow_history, false, law_granular, law_granular_step},
    {"cohesive", {{"crack normal", 3, HISTORY_CRACK}, {"crack width", 1, HISTORY_KEPT},
                  {"crack opening", 1, HISTORY_KEPT}, {"second crack", CRACK_SIZE, HISTORY_KEPT},
                  {"third crack", CRACK_SIZE, HISTORY_KEPT}}, false, law_cohesive, nullptr},
    {"cohesive Drucker-Prager", {{"plastic deformation", 6, HISTORY_DEFORMATION},
                                 {"equivalent plastic strain", 1, HISTORY_EQUIVALENT},
                                 {"crack normal", 3, HISTORY_CRACK}, {"crack width", 1, HISTORY_KEPT},
                                 {"crack opening", 1, HISTORY_KEPT},
                                 {"second crack", CRACK_SIZE, HISTORY_KEPT},
                                 {"third crack", CRACK_SIZE, HISTORY_KEPT},
                                 {"flow work", 1, HISTORY_FLOW_WORK}},
     false, law_cohesive_flow, nullptr, true},
    {"energy split", {}, false, law_split, law_split_step, true},
    {"orthotropic", {}, true, law_ortho, nullptr},
    {"other", {}, false, law_svk, nullptr},
};
static_assert(sizeof table / sizeof *table == LAW_KINDS, "a law without a row in the table");

int history_of(const Law& law)
{
  int n = law.history.empty() ? 0 : HISTORY_OF_LAW;
  for (const HistoryField& f : law.history) n += f.size;
  return n;
}

// Law::update with the history of an integration point, at a strain that has its initial part already
bool update(const Law& l, const MatLaw& law, bool finite, const double* E, const double* h_n, double* h_np1,
            bool tangent, LawOutput& out)
{
  out.dissipated = 0.0;
  if (law.initial >= 0) std::copy_n(h_n + law.initial, 6, h_np1 + law.initial);
  if (l.history.empty()) return l.update(law, finite, E, nullptr, nullptr, tangent, out);
  if (!l.update(law, finite, E, h_n + HISTORY_OF_LAW, h_np1 + HISTORY_OF_LAW, tangent, out)) return false;
  h_np1[HISTORY_DISSIPATED] = h_n[HISTORY_DISSIPATED] + out.dissipated;
  return true;
}

// law_update at a strain that has its initial part already
bool update_total(const MatLaw& law, bool finite, double* E, const double* h_n, double* h_np1, bool tangent,
                  LawOutput& out)
{
  const Law& l = law_of(law);
  if (law.plane != PLANE_STRESS) return update(l, law, finite, E, h_n, h_np1, tangent, out);
  // S33(E33) = 0 by Newton's method; a step beyond the bounds is bisected
  E[2] = -law.lam3 / (law.lam3 + 2.0 * law.mu) * (E[0] + E[1]);
  if (l.free_thickness) {
    out.E33 = E[2];
    const bool good = update(l, law, finite, E, h_n, h_np1, tangent, out);
    E[2] = out.E33;
    return good;
  }
  if (finite && E[2] < -0.45) E[2] = -0.45;
  Thickness t{finite, -HUGE_VAL, HUGE_VAL};
  for (int it = 0; it < MAX_ITERATIONS; ++it) {
    if (!update(l, law, finite, E, h_n, h_np1, true, out)) return false;
    const double size = std::fabs(out.S[0]) + std::fabs(out.S[1]) + std::fabs(out.S[3]);
    const bool found  = std::fabs(out.S[2]) <= 1e-15 * law.mu || std::fabs(out.S[2]) <= 1e-14 * size;
    if (t.closed() && std::fabs(out.S[2]) > JUMP * size) return false;
    if (found || t.closed()) {
      out.S[2] = 0.0;
      out.D[14] = std::max(out.D[14], SOFT_SHEET * law.mu);
      if (tangent) condense(out.D);
      return true;
    }
    const double step = out.D[14] > 0.0 ? -out.S[2] / out.D[14] : HUGE_VAL;
    E[2] = t.next(E[2], out.S[2], out.S[2] > 0.0 && step == HUGE_VAL ? -step : step);
  }
  return false;
}

// numbers of an integration point without the initial strain
int history_of_laws(const Model& m)
{
  int n = 0;
  for (const Material& mat : m.material)
    if (mat.used) n = std::max(n, history_of(law_of(mat_law(mat, PLANE_NONE))));
  for (const FractureDef& f : m.fracture) {
    n = std::max(n, history_of(law_of(law_broken(MatLaw(), f, 0.0, MatLaw().N))));
    if (f.criterion != CRITERION_COHESIVE) continue;
    n = std::max(n, history_of(table[LAW_COHESIVE]));
    for (const Material& mat : m.material)
      if (mat.breaks && law_flows(mat.law)) n = std::max(n, history_of(table[LAW_COHESIVE_FLOW]));
  }
  return n;
}

}  // namespace

const Law& law_of(const MatLaw& law) { return table[law.kind]; }
Law& law_other() { return table[LAW_OTHER]; }

int law_field(const Law& law, HistoryUse use)
{
  int at = HISTORY_OF_LAW;
  for (const HistoryField& f : law.history) {
    if (f.use == use) return at;
    at += f.size;
  }
  return -1;
}

int law_history(const Model& m)
{
  int n = history_of_laws(m);
  for (const Material& mat : m.material)
    if (mat.initial >= 0) n = std::max(n, mat.initial + 6);
  // points that can crack: factor of WEIBULL, and pressure of the bulk viscosity
  n += std::any_of(m.fracture.begin(), m.fracture.end(),
                   [](const FractureDef& f) { return f.body >= 0 && f.weibull > 0.0; });
  n += std::any_of(m.fracture.begin(), m.fracture.end(), [](const FractureDef& f) { return f.body >= 0; });
  MPFE_CHECK(n <= MAX_HISTORY, "MAX_HISTORY (mat/law.h) is less than a law keeps");
  return n;
}

void law_place_initial(Model& m)
{
  const int at = std::max(history_of_laws(m), static_cast<int>(HISTORY_OF_LAW));
  for (Material& mat : m.material)
    if (mat.prestressed) mat.initial = at;
}

// ---------------------------------------------------------------------------
// law_initial : S(E) = S by Newton's method from E = 0; a linear law takes one correction
// ---------------------------------------------------------------------------
bool law_initial(const MatLaw& law, bool finite, const double* S, const double* h, double* E)
{
  using Mat6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
  const bool plane_stress = law.plane == PLANE_STRESS;
  MatLaw bare  = law;
  bare.initial = -1;
  std::fill_n(E, 6, 0.0);
  double size = 0.0, scratch[MAX_HISTORY] = {0};
  for (int k = 0; k < 6; ++k) size = std::max(size, std::fabs(S[k]));
  if (size == 0.0) return true;
  for (int it = 0; it < MAX_ITERATIONS; ++it) {
    LawOutput out;
    if (!law_update(bare, finite, E, h, scratch, true, out) || !(out.dissipated <= 0.0)) return false;
    Eigen::Matrix<double, 6, 1> rest;
    for (int k = 0; k < 6; ++k) rest[k] = plane_stress && k == 2 ? 0.0 : S[k] - out.S[k];
    if (!(rest.lpNorm<Eigen::Infinity>() > ROUND_OF_STRESS * size)) break;
    if (it + 1 == MAX_ITERATIONS) return false;
    Mat6 D = Eigen::Map<const Mat6>(out.D);
    if (plane_stress) {
      D.row(2).setZero();
      D.col(2).setZero();
      D(2, 2) = 1.0;
    }
    const Eigen::Matrix<double, 6, 1> more = D.partialPivLu().solve(rest);
    for (int k = 0; k < 6; ++k) E[k] += more[k] * (k < 3 ? 1.0 : 0.5);
  }
  return std::all_of(E, E + 6, [](double x) { return std::isfinite(x); });
}

bool law_update(const MatLaw& law, bool finite, double* E, const double* h_n, double* h_np1, bool tangent,
                LawOutput& out)
{
  law_total(law, h_n, 1.0, E);
  const bool good = update_total(law, finite, E, h_n, h_np1, tangent, out);
  law_total(law, h_n, -1.0, E);
  return good;
}

bool law_step(const MatLaw& law, const KernelMode& mode, const double* E0, const double* E1,
              const double* h_n, double* h_np1, double* S, double* C)
{
  const Law& l    = law_of(law);
  const auto step = l.step ? l.step : law_step_any;
  if (law.initial < 0) return step(law, mode, E0, E1, h_n, h_np1, S, C);
  double start[6], end[6];
  std::copy_n(E0, 6, start);
  std::copy_n(E1, 6, end);
  law_total(law, h_n, 1.0, start);
  law_total(law, h_n, 1.0, end);
  std::copy_n(h_n + law.initial, 6, h_np1 + law.initial);
  return step(law, mode, start, end, h_n, h_np1, S, C);
}

namespace {

// does a crack along a line begin between the histories? Its traction falls by a jump                (2.36c)
bool line_begins(const MatLaw& law, const double* h_n, const double* h_np1)
{
  if (law.kind != LAW_COHESIVE) return false;
  const int at = law_field(law_of(law), HISTORY_CRACK);
  return h_n[at + CRACK_WIDTH] < 0.0 && h_n[at + CRACK_OPENING] == 0.0 && h_np1[at + CRACK_OPENING] > 0.0;
}

// S and C where a line begins: the mean of whole and cracked material. What the jump releases is dissipated:
// a discrete gradient would make an impulse of it                                                   (2.36c)
void begin_gradient(const LawOutput& zero, const LawOutput& one, const double* E0, const double* E1,
                    bool plane_stress, const double* h_n, double* h_np1, double* S, double* C)
{
  double d[6];
  for (int i = 0; i < 6; ++i) {
    d[i] = plane_stress && i == 2 ? 0.0 : E1[i] - E0[i];
    S[i] = 0.5 * (zero.S[i] + one.S[i]);
  }
  for (int i = 0; C && i < 36; ++i) C[i] = 0.5 * one.D[i];
  h_np1[HISTORY_DISSIPATED] = h_n[HISTORY_DISSIPATED] + zero.psi + six_dot(S, d) - one.psi;
}

}  // namespace

bool law_step_any(const MatLaw& law, const KernelMode& mode, const double* E0, const double* E1,
                  const double* h_n, double* h_np1, double* S, double* C)
{
  LawOutput one, zero;
  double end[6], start[6], scratch[MAX_HISTORY];
  std::copy(E1, E1 + 6, end);
  if (!update_total(law, mode.finite, end, h_n, h_np1, C != nullptr, one)) return false;
  if (mode.mid) {
    std::copy(E0, E0 + 6, start);
    MatLaw before = law;                               // with the width of this increment
    std::fill_n(before.crack.across, 3, 0.0);
    before.crack.band = 0.0;
    const bool begins = line_begins(law, h_n, h_np1);
    if (begins) before.crack.strength = HUGE_VAL;      // whole at t(n)
    if (!update_total(before, mode.finite, start, h_n, scratch, false, zero)) return false;
    // dissipation as the difference of the history, which the ledger reads
    const bool keeps  = !law_of(law).history.empty();
    const double loss = keeps ? h_np1[HISTORY_DISSIPATED] - h_n[HISTORY_DISSIPATED] : 0.0;
    if (begins) begin_gradient(zero, one, E0, E1, law.plane == PLANE_STRESS, h_n, h_np1, S, C);
    else discrete_gradient(zero, one, loss, E0, E1, law.plane == PLANE_STRESS, S, C);
    const double more = mode.s_new - 0.5;              // numerical damping
    for (int i = 0; i < 6; ++i) S[i] += more * (one.S[i] - zero.S[i]);
    for (int i = 0; C && i < 36; ++i) C[i] += more * one.D[i];
  } else {
    std::copy(one.S, one.S + 6, S);
    if (C) std::copy(one.D, one.D + 36, C);
  }
  const double eta = law.beta * mode.rate;
  if (eta != 0.0) add_viscosity(law, eta, E0, E1, S, C);
  return true;
}

double law_viscous_work(const MatLaw& law, const double* dE)
{
  const double zero[6] = {0};
  double S[6] = {0};
  add_viscosity(law, 1.0, zero, dE, S, nullptr);
  return six_dot(S, dE);
}

bool law_svk(const MatLaw& law, bool, const double* E, const double*, double*, bool tangent, LawOutput& out)
{
  const double p = law.lam3 * (E[0] + E[1] + E[2]);
  for (int i = 0; i < 6; ++i) out.S[i] = (i < 3 ? p : 0.0) + 2.0 * law.mu * E[i];
  out.psi = 0.5 * six_dot(out.S, E);
  if (!tangent) return true;
  for (int i = 0; i < 36; ++i) out.D[i] = 0.0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out.D[i * 6 + j] = law.lam3;
    out.D[i * 7] += 2.0 * law.mu;
    out.D[(i + 3) * 7] = law.mu;
  }
  return true;
}
