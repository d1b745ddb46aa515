#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "elem/scalar_element.h"

namespace {

// Largest length of the bulk viscosity over 2 c/omega. Slender elements have several times this length
// along their long edges, where fronts ring; the damping ratio, which shortens all increments, is then at
// most twice this number times b1  (test: strength/spall_mesh.inp), with rows=4
const double LONGEST = 2.5;

// relative: round-off of a bound of the stretch  (no test)
const double MARGIN = 1e-12;

// square of the largest frequency of a scalar field in an element of this kind: stiffness lam + 2 mu along
// each gradient, with the lumped mass of the element                                         (6.30)
double frequency_of_kind(const ElemBlock& b, int kind)
{
  const int nen = shape_info[b.shape].nen;
  double mass[MAX_NODES];
  scalar_masses(b, kind, mass);
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(nen, nen);
  scalar_stiffness(b, kind, [&](int i, int j, double k) { K(i, j) += k / std::sqrt(mass[i] * mass[j]); });
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(K, Eigen::EigenvaluesOnly).eigenvalues()(nen - 1);
}

// stiffening by the mean stretch of the element                                              (6.31)
double stretch_factor(const Model& m, const ElemBlock& b, int slot, const RealVec& u)
{
  const ShapeInfo& info = shape_info[b.shape];
  const int nen = info.nen, dim = info.dim, *node = elem_nodes(m.mesh, b, slot);
  const double* dN = &b.mean[static_cast<size_t>(b.kind[slot]) * (nen * dim + 3)];
  Eigen::Matrix3d F = Eigen::Matrix3d::Identity();
  for (int a = 0; a < nen; ++a)
    for (int i = 0; i < dim; ++i)
      for (int j = 0; j < dim; ++j) F(i, j) += u[node[a] * dim + i] * dN[a * dim + j];
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> C;
  C.computeDirect(F.transpose() * F, Eigen::EigenvaluesOnly);
  const double largest = C.eigenvalues()(2), least = std::max(C.eigenvalues()(0), 1e-6);
  return law_stiffening(b.law.kind, std::max(0.0, largest - 1.0), least);
}

// a bound of stretch_factor without principal stretches: they differ from 1 by at most the norm of C - I
template <int D>
double stretch_bound(const Model& m, const ElemBlock& b, int slot, const RealVec& u)
{
  const int nen = shape_info[b.shape].nen, *node = elem_nodes(m.mesh, b, slot);
  const double* dN = &b.mean[static_cast<size_t>(b.kind[slot]) * (nen * D + 3)];
  double H[D * D] = {0}, norm = 0.0;
  for (int a = 0; a < nen; ++a)
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j) H[i * D + j] += u[node[a] * D + i] * dN[a * D + j];
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) {
      double c = H[i * D + j] + H[j * D + i];
      for (int k = 0; k < D; ++k) c += H[k * D + i] * H[k * D + j];
      norm += c * c;
    }
  norm = std::sqrt(norm);
  return law_stiffening(b.law.kind, norm, 1.0 - norm);
}

// mean gradient, volume, the length 2 c / omega that a wave travels in the stable increment, and that of the
// bulk viscosity: the edge of a square or cube of this volume                                      (6.35)
void add_mean(ElemBlock& b, int kind)
{
  const ShapeInfo& info = shape_info[b.shape];
  const int n = info.nen * info.dim;
  RealVec mean(n + 3, 0.0);
  for (int g = 0; g < info.ngp; ++g) {
    const size_t at = static_cast<size_t>(kind) * info.ngp + g;
    for (int k = 0; k < n; ++k) mean[k] += b.w[at] * b.dNdX[at * n + k];
    mean[n] += b.w[at];
  }
  for (int k = 0; k < n; ++k) mean[k] /= mean[n];
  mean[n + 1] = 2.0 * std::sqrt((b.law.lam + 2.0 * b.law.mu) / b.density / b.omega2[kind]);
  const double cube = mean[n] / (info.dim == 2 ? b.thickness : 1.0) * info.cube_parts;
  mean[n + 2] = std::min(std::pow(cube, 1.0 / info.dim), LONGEST * mean[n + 1]);
  b.mean.insert(b.mean.end(), mean.begin(), mean.end());
}

}  // namespace

double elem_stable(const Model& m, Elements& el, const Level& l, bool nlgeom, int* worst)
{
  double least = 1e300;
  *worst = -1;
  for (ElemBlock& b : el.block) {
    const int kinds = static_cast<int>(b.me.size()) / pair_count(shape_info[b.shape].nen);
    for (int kind = static_cast<int>(b.omega2.size()); kind < kinds; ++kind) {
      b.omega2.push_back(frequency_of_kind(b, kind));
      add_mean(b, kind);
    }
    const auto increment = [&](double w2) {
      const double w = std::sqrt(w2), xi = 0.5 * b.law.beta * w;
      return 2.0 / w * (std::sqrt(1.0 + xi * xi) - xi);
    };
    for (int slot = 0; slot < static_cast<int>(b.elem.size()); ++slot) {
      if (!el.moves(b.elem[slot]) || (!el.rigid.empty() && el.rigid[b.elem[slot]])) continue;
      double w2 = b.omega2[b.kind[slot]];
      if (nlgeom && el.broken(b.elem[slot]) < 0) {
        const double bound =
            m.dim == 2 ? stretch_bound<2>(m, b, slot, l.u) : stretch_bound<3>(m, b, slot, l.u);
        if (increment(w2 * bound * (1.0 + MARGIN)) >= least) continue;
        w2 *= stretch_factor(m, b, slot, l.u);
      }
      const double dt = increment(w2);
      if (dt >= least) continue;
      least  = dt;
      *worst = b.elem[slot];
    }
  }
  return least;
}
