#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "base/comm.h"
#include "base/log.h"
#include "step/step.h"

namespace {

// The increment is looked at again after so many, since elements deform
const int LOOKS_AGAIN = 20;
// Lanczos' method: vectors. The largest frequency of a system is then known to 1 or 2 %
const int VECTORS = 24;
// Size of the motion that measures the stiffness, of the mean size of elements and cells
const double MOVE = 1e-7;

// what makes frequencies others at once
long changes(const State& st) { return st.frac.neroded + st.frac.nconverted + st.frac.nreleased; }

// K x by a small motion from t(n); f0: internal force there
Failure stiffness_times(Problem& p, const KernelMode& mode, const RealVec& f0, const RealVec& x, RealVec& y)
{
  const Dofs& s = p.dofs;
  double most = 0.0;
  for (double v : x) most = std::max(most, std::fabs(v));
  most = dof_largest(s, most);
  y.assign(s.neq(), 0.0);
  if (most == 0.0) return STATUS_OK;
  const double scale = MOVE * s.h_mean / most;
  RealVec du(x);
  for (double& v : du) v *= scale;
  Jumps jumps;
  Failure failure = assem_move(p.m, p.d, s, du, 0.0, 0.0, p.st, jumps);
  if (failure.ok()) failure = assem_internal(p.m, p.d, s, mode, jumps, p.st, y);
  for (int i = 0; i < s.neq(); ++i) y[i] = (y[i] - f0[i]) / scale;
  return failure;
}

// a start without symmetry, the same on all ranks
RealVec first_vector(const Dofs& s)
{
  RealVec x(s.neq());
  for (int i = 0; i < s.neq(); ++i) {
    const double k = static_cast<double>(s.row_key[i / s.dim]);
    x[i] = s.fixed[i] ? 0.0 : std::sin(12.9898 * (k + 1.0) + 78.233 * (i % s.dim + 1.0));
  }
  return x;
}

// y = M^-1 f on free dofs
Failure mass_inverse(const Dofs& s, const RealVec& f, bool points, RealVec& y)
{
  y.assign(s.neq(), 0.0);
  if (points || s.hung) return mass_solve(s, ROWS_ALL, 0, f, y) < 0 ? MASS_FAILED : STATUS_OK;
  for (int i = 0; i < s.neq(); ++i) y[i] = s.fixed[i] ? 0.0 : f[i] / s.lumped[i / s.dim];
  return STATUS_OK;
}

// square of the largest frequency of M^-1 K by Lanczos' method                                  (6.32)
Failure measure(Problem& p, const Step& s, double& omega2)
{
  const Dofs& d = p.dofs;
  const bool points = p.d.grid.of_all.nodes > 0;
  KernelMode mode;
  mode.finite = s.nlgeom;
  RealVec f0, q, before(d.neq(), 0.0), f, w, Mq;
  Jumps jumps;
  p.st.np1 = p.st.n;
  Failure failure = dof_constrain(p.m, p.d, p.st, s, p.st.clock.t, p.st.clock.t, p.dofs, p.warned);
  if (failure.ok()) failure = assem_move(p.m, p.d, d, before, 0.0, 0.0, p.st, jumps);
  if (failure.ok()) failure = assem_internal(p.m, p.d, d, mode, jumps, p.st, f0);
  if (!failure.ok()) return failure;
  q = first_vector(d);
  Eigen::MatrixXd T = Eigen::MatrixXd::Zero(VECTORS, VECTORS);
  double beta = 0.0;
  omega2 = 0.0;
  for (int k = 0; k < VECTORS && failure.ok(); ++k) {
    mass_multiply(d, q, Mq);
    const double size = std::sqrt(dof_dot(d, q, Mq));
    if (k > 0) {
      beta = size;
      T(k, k - 1) = T(k - 1, k) = beta;
    }
    if (!(size > 0.0)) break;
    for (double& x : q) x /= size;
    failure = stiffness_times(p, mode, f0, q, f);
    for (int i = 0; i < d.neq(); ++i) f[i] = d.fixed[i] ? 0.0 : f[i];
    if (failure.ok()) failure = mass_inverse(d, f, points, w);
    if (!failure.ok()) return failure;
    T(k, k) = dof_dot(d, q, f);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(T.topLeftCorner(k + 1, k + 1));
    omega2 = std::max(omega2, eigen.eigenvalues()(k));
    for (int i = 0; i < d.neq(); ++i) w[i] -= T(k, k) * q[i] + beta * before[i];
    before.swap(q);
    q.swap(w);
    if (k > 0 && size <= 1e-12 * T(0, 0)) break;
  }
  return failure;
}

void report(const Problem& p, const Step& s, const State& st, double elements, int worst, double taken)
{
  const std::string ruling = worst < 0 ? "" : ", element " + std::to_string(worst);
  log_note("  explicit: stable increment of the elements %.6g%s; of the whole system %.6g; taken %.6g", elements,
           ruling.c_str(), p.stable.system, taken);
  if (s.dt < s.period && s.dt > s.safety * std::min(elements, p.stable.system))
    log_warn("step %d, *DYNAMIC, EXPLICIT: dt = %g of the deck is longer than is stable; the increments have "
             "%g (%g of the stable one)",
             st.log.step, s.dt, taken, s.safety);
}

}  // namespace

Failure step_stable(Problem& p, const Step& s)
{
  State& st = p.st;
  StableIncrement& q = p.stable;
  const bool begins  = q.step != st.log.step;
  const bool changed = begins || q.changed != changes(st);
  if (!changed && st.log.inc_total - q.after < LOOKS_AGAIN) return STATUS_OK;
  int worst;
  double elements = elem_stable(p.m, p.d.el, st.n, s.nlgeom, q.omega2, &worst);
  int label = worst < 0 ? -1 : p.m.mesh.elem_label[worst];
  if (comm_size() > 1) {
    const double own = elements;
    elements = -comm_allreduce_max(-elements);
    label    = comm_allreduce_max(own == elements ? label : -1);
  }
  if (begins) {
    double omega2;
    const Failure failure = measure(p, s, omega2);
    if (!failure.ok()) return failure;
    q.system = omega2 > 0.0 ? 2.0 / std::sqrt(omega2) : 1e300;
  }
  q.step    = st.log.step;
  q.after   = st.log.inc_total;
  q.changed = changes(st);
  q.dt      = std::min(elements, q.system);
  st.clock.dt = std::min(s.dt, s.safety * q.dt);
  if (begins) report(p, s, st, elements, label, st.clock.dt);
  return STATUS_OK;
}
