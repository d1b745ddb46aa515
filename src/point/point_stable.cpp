#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "point/point_body.h"

namespace {

// square of the largest frequency of a domain with its own corner masses: with one gradient it is V (lam +
// 2 mu) times the largest eigenvalue of sum G_c (m^-1)_cd G_d                                       (6.34)
double frequency_of_domain(const Points& pts, int dim, int p, double stiffness)
{
  const int n = pts.conn.count(p);
  const double *mc = pts.mc(p), *G = pts.G(p);
  Eigen::MatrixXd M(n, n), B(n, dim);
  for (int a = 0; a < n; ++a) {
    for (int b = 0; b <= a; ++b) M(a, b) = M(b, a) = mc[a * (a + 1) / 2 + b];
    for (int i = 0; i < dim; ++i) B(a, i) = G[a * dim + i];
  }
  const Eigen::MatrixXd A = pts.V0[p] * stiffness * B.transpose() * M.ldlt().solve(B);
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(0.5 * (A + A.transpose()), Eigen::EigenvaluesOnly)
      .eigenvalues()(dim - 1);
}

// as stretch_factor of elements                                                                      (6.31)
double stretch_factor(const Points& pts, int dim, int p, LawKind law, const RealVec& uc)
{
  const Eigen::Matrix3d F = point_gradient(pts, dim, uc, p);
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> C;
  C.computeDirect(F.transpose() * F, Eigen::EigenvaluesOnly);
  const double largest = C.eigenvalues()(2), least = std::max(C.eigenvalues()(0), 1e-6);
  return law_stiffening(law, std::max(0.0, largest - 1.0), least);
}

}  // namespace

double point_stable(const Points& pts, int dim, const PointLaws& laws, const Level& l, const IntVec& owned,
                    int* worst)
{
  double least = 1e300;
  *worst = -1;
  std::vector<std::unordered_map<int, double>> known(laws.body.size());        // kind of a body: omega^2
  for (int p : owned) {
    const MatLaw& law = laws.body[pts.body[p]];
    const auto found  = known[pts.body[p]].emplace(pts.kind[p], 0.0);
    double& w2 = found.first->second;
    if (found.second) w2 = frequency_of_domain(pts, dim, p, law.lam + 2.0 * law.mu);
    const double w  = std::sqrt(w2 * (pts.eroded(p) ? 1.0 : stretch_factor(pts, dim, p, law.kind, l.uc)));
    const double xi = 0.5 * law.beta * w, dt = 2.0 / w * (std::sqrt(1.0 + xi * xi) - xi);
    if (dt >= least) continue;
    least  = dt;
    *worst = p;
  }
  return least;
}
