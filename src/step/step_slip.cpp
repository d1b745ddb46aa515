#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "step/step.h"

namespace {

// Max. number of vectors; a solution that needs more leaves a larger residual  (no test)
const int MAX_VECTORS = 60;
// rest of a linearly dependent vector, relative to the right-hand side  (no test)
const double DEPENDENT_BASIS = 1e-14;

void add(RealVec& x, double part, const RealVec& v)
{
  for (std::size_t i = 0; i < x.size(); ++i) x[i] += part * v[i];
}

}  // namespace

// ---------------------------------------------------------------------------
// step_slip : (A + E) x = f by flexible GMRES in the norm of the inverse diagonal; z = M^-1 v may be inexact
// and change from call to call                                                                      (6.23)
// ---------------------------------------------------------------------------
Status step_slip(const SlipSystem& system, const RealVec& f, double eta, RealVec& x, double& left)
{
  const RealVec& weight = system.weight;
  const double size     = std::sqrt(step_product(f, f, weight));
  x.assign(f.size(), 0.0);
  left = 0.0;
  if (size == 0.0) return STATUS_OK;
  std::vector<RealVec> v{f}, z;
  for (double& value : v[0]) value /= size;
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(MAX_VECTORS + 1, MAX_VECTORS);
  Eigen::VectorXd part;
  for (int n = 1; n <= MAX_VECTORS; ++n) {
    z.emplace_back();
    const Status status = system.precondition(v[n - 1], z[n - 1]);
    if (status != STATUS_OK) return status;
    RealVec w;
    system.multiply(z[n - 1], w);
    for (int pass = 0; pass < 2; ++pass)               // twice: orthogonal to round-off
      for (int i = 0; i < n; ++i) {
        const double along = step_product(v[i], w, weight);
        H(i, n - 1) += along;
        add(w, -along, v[i]);
      }
    H(n, n - 1) = std::sqrt(step_product(w, w, weight));
    Eigen::VectorXd b = Eigen::VectorXd::Zero(n + 1);
    b(0) = size;
    part = H.topLeftCorner(n + 1, n).colPivHouseholderQr().solve(b);
    left = (b - H.topLeftCorner(n + 1, n) * part).norm() / size;
    if (left <= eta || H(n, n - 1) <= DEPENDENT_BASIS * size) break;
    for (double& value : w) value /= H(n, n - 1);
    v.push_back(w);
  }
  for (int i = 0; i < part.size(); ++i) add(x, part(i), z[i]);
  return STATUS_OK;
}
