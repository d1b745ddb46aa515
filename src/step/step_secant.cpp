#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "base/comm.h"
#include "base/sum.h"
#include "step/step.h"

namespace {

// secants that are stored  (test: Newton.SecantsFindTheSkewPartOfTheTangent)
const std::size_t MAX_SECANTS = 6;
// threshold of linearly dependent secants, relative to the largest  (no test)
const double DEPENDENT = 1e-10;

}  // namespace

double step_product(const RealVec& a, const RealVec& b, const RealVec& diag)
{
  double sum = sum_terms(a.size(), [&](std::size_t i) { return a[i] * b[i] * std::max(diag[i], 0.0); });
  comm_sum(&sum, 1);
  return sum;
}

// ---------------------------------------------------------------------------
// step_secant : Anderson's method in the energy norm of the diagonal                  (6.22)
// ---------------------------------------------------------------------------
void step_secant(Secants& h, const RealVec& du, const RealVec& diag, RealVec& dx)
{
  const RealVec newton = dx;
  if (!h.last_du.empty()) {
    h.du.push_back(du);
    h.dx.push_back(dx);
    for (std::size_t i = 0; i < du.size(); ++i) {
      h.du.back()[i] -= h.last_du[i];
      h.dx.back()[i] -= h.last_dx[i];
    }
    if (h.du.size() > MAX_SECANTS) {
      h.du.erase(h.du.begin());
      h.dx.erase(h.dx.begin());
    }
    const int n = static_cast<int>(h.du.size());
    Eigen::MatrixXd A(n, n);
    Eigen::VectorXd b(n), size(n);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j <= i; ++j) A(i, j) = A(j, i) = step_product(h.dx[i], h.dx[j], diag);
      b(i)    = step_product(h.dx[i], dx, diag);
      size(i) = A(i, i) > 0.0 ? 1.0 / std::sqrt(A(i, i)) : 0.0;
    }
    A = size.asDiagonal() * A * size.asDiagonal();
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver(n, n);
    solver.setThreshold(DEPENDENT);
    solver.compute(A);
    const Eigen::VectorXd w = size.asDiagonal() * solver.solve(size.asDiagonal() * b);
    for (int k = 0; k < n; ++k)
      for (std::size_t i = 0; i < dx.size(); ++i) dx[i] -= w(k) * (h.du[k][i] + h.dx[k][i]);
  }
  h.last_du = du;
  h.last_dx = newton;
}
