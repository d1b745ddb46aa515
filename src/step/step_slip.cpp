#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "step/step.h"

namespace {

// Vectors. Test: A8 (contact/friction_punch.inp)
const int MOST = 30;
const double DEPENDENT = 1e-14;        // nothing new is left of a vector

void add(RealVec& x, double part, const RealVec& v)
{
  for (std::size_t i = 0; i < x.size(); ++i) x[i] += part * v[i];
}

}  // namespace

// ---------------------------------------------------------------------------
// step_slip : x + A^-1 E x = A^-1 f by generalised minimal residuals, in the norm of the diagonal     (6.23)
// ---------------------------------------------------------------------------
Status step_slip(const RealVec& diag, double eta, const std::function<Status(const RealVec&, RealVec&)>& back,
                 RealVec& x)
{
  const double size = std::sqrt(step_product(x, x, diag));
  if (size == 0.0) return STATUS_OK;
  std::vector<RealVec> v{x};
  for (double& value : v[0]) value /= size;
  std::fill(x.begin(), x.end(), 0.0);
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(MOST + 1, MOST);
  Eigen::VectorXd weight;
  for (int n = 1; n <= MOST; ++n) {
    RealVec w;
    const Status status = back(v[n - 1], w);           // A^-1 E v
    if (status != STATUS_OK) return status;
    add(w, 1.0, v[n - 1]);
    for (int pass = 0; pass < 2; ++pass)               // twice: orthogonal to rounding
      for (int i = 0; i < n; ++i) {
        const double part = step_product(v[i], w, diag);
        H(i, n - 1) += part;
        add(w, -part, v[i]);
      }
    H(n, n - 1) = std::sqrt(step_product(w, w, diag));
    Eigen::VectorXd b = Eigen::VectorXd::Zero(n + 1);
    b(0)   = size;
    weight = H.topLeftCorner(n + 1, n).colPivHouseholderQr().solve(b);
    const double left = (b - H.topLeftCorner(n + 1, n) * weight).norm();
    if (left <= eta * size || H(n, n - 1) <= DEPENDENT) break;
    for (double& value : w) value /= H(n, n - 1);
    v.push_back(w);
  }
  for (int i = 0; i < weight.size(); ++i) add(x, weight(i), v[i]);
  return STATUS_OK;
}
