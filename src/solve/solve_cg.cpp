#include <algorithm>
#include <cmath>

#include "base/comm.h"
#include "base/vec.h"
#include "solve/solve_data.h"

namespace {

const double INDEPENDENT = 1e-8;   // part of the energy of a solution that others do not have
const double CLEAR = 5.0;      // factor between the guess by the length of r and sqrt(r M^-1 r)

// y += a x
void add(double a, const RealVec& x, RealVec& y)
{
  const double* from = x.data();
  double* to         = y.data();
  for (size_t i = 0; i < x.size(); ++i) to[i] += a * from[i];
}

// p = z + a p
void turn(double a, const RealVec& z, RealVec& p)
{
  const double* from = z.data();
  double* to         = p.data();
  for (size_t i = 0; i < z.size(); ++i) to[i] = from[i] + a * to[i];
}

// all ranks leave the loop together; they agree on the time now and then only
bool late(const Clock& clock, double limit, int iteration)
{
  if (comm_size() == 1) return clock.seconds() > limit;
  return iteration % 8 == 7 && comm_share(clock.seconds() > limit);
}

}  // namespace

// ---------------------------------------------------------------------------
// cg_begin : earlier solutions are made orthogonal in A, the newest first; x = sum (v b)/(v A v) v             (8.8)
// ---------------------------------------------------------------------------
double cg_begin(const SysMatrix& A, const RealVec& b, const std::vector<RealVec>& past, RealVec& x)
{
  double energy = 0.0;
  x.assign(b.size(), 0.0);
  std::vector<RealVec> basis, image;   // orthogonal in A, and A times them
  for (size_t k = past.size(); k-- > 0;) {
    if (past[k].size() != b.size()) continue;
    RealVec v = past[k], q;
    sys_multiply(A, v, q);
    const double whole = dot(v, q);
    for (size_t i = 0; i < basis.size(); ++i) {
      const double part = dot(image[i], v);
      add(-part, basis[i], v);
      add(-part, image[i], q);
    }
    const double vAv = dot(v, q);
    if (!(vAv > INDEPENDENT * whole)) continue;
    const double scale = 1.0 / std::sqrt(vAv);
    for (double& value : v) value *= scale;
    for (double& value : q) value *= scale;
    const double along = dot(v, b);
    energy += along * along;
    add(along, v, x);
    basis.push_back(std::move(v));
    image.push_back(std::move(q));
  }
  return energy;
}

// ---------------------------------------------------------------------------
// cg_solve : conjugate gradients for A x = b, with a symmetric positive definite preconditioner M = P   (8.2)
//
//   in   precondition   z = M^-1 r; false: it failed
//        goal           of sqrt(r M^-1 r), which is near sqrt(energy) of the error, and of the norm of r: stiff bonds have
//                       large residuals of little energy, soft parts the reverse
//   out  x              the last iterate, also when the end was not reached
//
// good = false: a limit was met, or a direction of no or negative curvature
// ---------------------------------------------------------------------------
CgDone cg_solve(const SysMatrix& A, const Precondition& precondition, const RealVec& b, const CgGoal& goal, CgWork& w, RealVec& x)
{
  const Clock clock;
  CgDone done;
  const size_t n = b.size();
  const double residual = std::max(goal.eta * norm(b), goal.residual);
  w.r = b;
  w.z.resize(n);
  w.p.assign(n, 0.0);
  if (goal.begun > 0.0) {
    sys_multiply(A, x, w.q);
    add(-1.0, w.q, w.r);
  } else {
    x.assign(n, 0.0);
  }
  double length = norm(w.r), rho = 0.0, before = 1.0;
  for (;; ++done.iterations) {
    if (!precondition(w.r, w.z)) return done;
    rho = dot(w.r, w.z);
    if (!std::isfinite(rho) || rho < 0.0) return done;
    done.end = std::sqrt(rho);
    if (done.iterations == 0) {
      done.first = done.end;
      done.start = std::sqrt(rho + goal.begun);
    }
    const double energy = std::max(goal.eta * done.start, goal.energy);
    if (done.end <= energy && length <= residual) {
      done.good = true;
      return done;
    }
    if (done.iterations >= goal.most || late(clock, goal.seconds, done.iterations)) return done;
    turn(done.iterations ? rho / before : 0.0, w.z, w.p);
    sys_multiply(A, w.p, w.q);
    const double curvature = dot(w.p, w.q);
    if (!(curvature > 0.0)) return done;
    const double alpha = rho / curvature;
    add(alpha, w.p, x);
    add(-alpha, w.q, w.r);
    before = rho;
    // M^-1 r would only tell that this is the end: the length of r says so when it is clear
    const double shorter = norm(w.r), guess = done.end * shorter / length;
    length = shorter;
    if (length > residual || CLEAR * guess > energy) continue;
    ++done.iterations;
    done.end  = guess;
    done.good = true;
    return done;
  }
}
