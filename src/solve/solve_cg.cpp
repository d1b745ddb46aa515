#include <algorithm>
#include <cmath>

#include "base/comm.h"
#include "solve/solve_data.h"

namespace {

// least fraction of the energy of a solution that is not in the span of the others
// (test: Krylov.BeginsWithEarlierSolutions)
const double INDEPENDENT = 1e-8;
// relative to r r: below, a difference of squares has lost too many digits  (no test)
const double CANCELS = 1e-8;
// safety factor on the estimate of sqrt(r M^-1 r) by the length of r: time only  (no test)
const double CLEAR = 5.0;

// q = A p, several ranks: the contribution of this one; returns its contribution to p q
double part_of_product(const CgSystem& s, const RealVec& p, RealVec& q)
{
  sys_multiply(s.A, p, q);
  return dot(p, q);
}

// q = A p; returns p q
double multiply(const CgSystem& s, const RealVec& p, RealVec& q)
{
  double pq = part_of_product(s, p, q);
  if (s.own) halo_sum(s.A.halo, s.A.dim, q, &pq, 1);
  return pq;
}

// The products that an iteration needs
struct Products {
  double pq, rq, rr, qq;
};

// adds p q, r q, r r where once, and q q to sum [4]
void add_products(const RealVec& p, const RealVec& r, const RealVec& q, const RealVec& once, double* sum)
{
  const int LANES = 8;         // for vector registers
  double part[4][LANES] = {};
  const size_t n = p.size(), whole = n / LANES * LANES;
  const auto add = [&](size_t k, int l) {
    part[0][l] += p[k] * q[k];
    part[1][l] += r[k] * q[k];
    part[2][l] += once[k] * r[k] * r[k];
    part[3][l] += q[k] * q[k];
  };
  for (size_t k = 0; k < whole; k += LANES)
    for (int l = 0; l < LANES; ++l) add(k + l, l);
  for (size_t k = whole; k < n; ++k) add(k, 0);
  for (int i = 0; i < 4; ++i)
    for (double x : part[i]) sum[i] += x;
}

// Two ranks: q = A p, with all products in one message. Both add the products of the border in the same order
Products multiply_both(const CgSystem& s, const RealVec& p, const RealVec& r, RealVec& q)
{
  const OwnBlock& own = *s.own;
  const int D         = s.A.dim;
  sys_multiply(s.A, p, q);
  double part[4] = {};
  add_products(p, r, q, own.once, part);
  const auto border_square = [&] {
    double sum = 0.0;
    for (int I : s.A.halo.common[1 - comm_rank()])
      for (int i = 0; i < D; ++i) sum += q[I * D + i] * q[I * D + i];
    return sum;
  };
  part[3] -= border_square();
  halo_sum(s.A.halo, D, q, part, 4);
  return {part[0], part[1], part[2], part[3] + border_square()};
}

// sum over the ranks
double whole(const CgSystem& s, double part)
{
  if (s.own) comm_sum(&part, 1);
  return part;
}

// a b, summed over the ranks
double product(const CgSystem& s, const RealVec& a, const RealVec& b)
{
  return s.own ? whole(s, own_dot(*s.own, a, b)) : dot(a, b);
}

double norm(const CgSystem& s, const RealVec& a) { return std::sqrt(product(s, a, a)); }

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

// norm of r after the step, from products with the previous r; computed directly where these nearly cancel
double next_length(const CgSystem& s, const Products& sum, double alpha, const RealVec& r)
{
  const double square = sum.rr - 2.0 * alpha * sum.rq + alpha * alpha * sum.qq;
  return square > CANCELS * sum.rr ? std::sqrt(square) : norm(s, r);
}

}  // namespace

// ---------------------------------------------------------------------------
// cg_begin : A-orthogonalises earlier solutions, the newest first; x = sum (v b)/(v A v) v          (8.8)
// ---------------------------------------------------------------------------
double cg_begin(const CgSystem& s, const RealVec& b, const std::vector<RealVec>& past, RealVec& x)
{
  double energy = 0.0;
  x.assign(b.size(), 0.0);
  std::vector<RealVec> basis, image;   // orthogonal in A, and A times them
  for (size_t k = past.size(); k-- > 0;) {
    if (past[k].size() != b.size()) continue;        // several ranks: never
    RealVec v = past[k], q;
    const double all = whole(s, part_of_product(s, v, q));
    for (size_t i = 0; i < basis.size(); ++i) {
      const double part = whole(s, dot(image[i], v));
      add(-part, basis[i], v);
      add(-part, image[i], q);
    }
    const double vAv = whole(s, dot(v, q));
    if (!(vAv > INDEPENDENT * all)) continue;
    const double scale = 1.0 / std::sqrt(vAv);
    for (double& value : v) value *= scale;
    for (double& value : q) value *= scale;
    const double along = product(s, v, b);
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
//   in   s              A and the preconditioner; several ranks: on the rows of this one
//        goal           for sqrt(r M^-1 r), which is close to sqrt(energy) of the error, and for the norm of
//                       r: stiff bonds have large residuals of little energy, soft parts the reverse
//   out  x              the last iterate, also without convergence
//
// good = false: a limit was reached, or a direction of no or negative curvature found
// ---------------------------------------------------------------------------
CgDone cg_solve(const CgSystem& s, const RealVec& b, const CgGoal& goal, CgWork& w, RealVec& x)
{
  CgDone done;
  const size_t n  = b.size();
  const bool both = s.own && comm_size() == 2;
  double length = norm(s, b), rho = 0.0, before = 1.0;
  const double residual = std::max(goal.eta * length, goal.residual);
  w.r = b;
  w.z.resize(n);
  w.p.assign(n, 0.0);
  if (goal.initial_energy > 0.0) {
    multiply(s, x, w.q);
    add(-1.0, w.q, w.r);
    length = norm(s, w.r);
  } else {
    x.assign(n, 0.0);
  }
  for (;; ++done.iterations) {
    if (!s.precondition(w.r, w.z, rho)) return done;
    if (!std::isfinite(rho) || rho < 0.0) return done;
    done.end = std::sqrt(rho);
    if (done.iterations == 0) {
      done.first = done.end;
      done.start = std::sqrt(rho + goal.initial_energy);
    }
    const double energy = std::max(goal.eta * done.start, goal.energy);
    if (done.end <= energy && length <= residual) {
      done.good = true;
      return done;
    }
    if (done.iterations >= goal.max_iterations) return done;
    turn(done.iterations ? rho / before : 0.0, w.z, w.p);
    Products sum;
    if (both) sum = multiply_both(s, w.p, w.r, w.q);
    else sum.pq = multiply(s, w.p, w.q);
    done.indefinite = done.indefinite || sum.pq <= 0.0;
    if (!((goal.any_sign ? std::fabs(sum.pq) : sum.pq) > 0.0)) return done;
    const double alpha = rho / sum.pq;
    add(alpha, w.p, x);
    add(-alpha, w.q, w.r);
    before = rho;
    // saves the last M^-1 r where the norm of r shows convergence clearly
    const double reduced = both ? next_length(s, sum, alpha, w.r) : norm(s, w.r);
    const double guess   = done.end * reduced / length;
    length = reduced;
    if (length > residual || CLEAR * guess > energy) continue;
    ++done.iterations;
    done.end  = guess;
    done.good = true;
    return done;
  }
}
