#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

#include "frac/frac_scan.h"
#include "shape/shape.h"

// Supported faces of the body within the ball                                                  (7.5d)

namespace {

// relative eigenvalue of the normals at a node above which they span a direction  (no test)
const double SPANS = 0.05;

// supported directions of nodes [nnode*dim]
const std::vector<char>& fixed_dofs(const Scan& s)
{
  if (!s.fixed.empty()) return s.fixed;
  const int dim = s.m.dim;
  s.fixed.assign(static_cast<size_t>(s.m.mesh.nnode()) * dim + 1, 0);
  mark_prescribed(s, s.fixed);
  for (const Frame& f : s.m.frame)                     // *TRANSFORM: the axes nearest to its directions
    for (int i = 0; f.twin >= 0 && i < dim; ++i) {
      int axis = 0;
      for (int j = 1; j < dim; ++j)
        if (std::fabs(f.axis[3 * i + j]) > std::fabs(f.axis[3 * i + axis])) axis = j;
      if (!s.fixed[static_cast<size_t>(f.twin) * dim + i]) continue;
      s.fixed[static_cast<size_t>(f.node) * dim + axis] = 1;
    }
  return s.fixed;
}

// is it an outer face of an element whose nodes are all fixed normal to it?
bool supported_face(const Scan& s, int e, int f)
{
  if (s.fm.across[6 * e + f] >= 0) return false;
  const std::vector<char>& fixed = fixed_dofs(s);
  const ShapeInfo& info = shape_info[elem_table[s.m.mesh.elem_type[e]].shape];
  const int* conn = s.m.mesh.conn.begin(e);
  double mid[3], area[3];
  face_of(s.m.mesh, e, f, mid, area);
  int normal = 0;                                    // nearest axis
  for (int i = 1; i < s.m.dim; ++i)
    if (std::fabs(area[i]) > std::fabs(area[normal])) normal = i;
  for (int a = 0; a < info.nfnode[f]; ++a)
    if (!fixed[static_cast<size_t>(conn[info.face[f][a]]) * s.m.dim + normal]) return false;
  return true;
}

}  // namespace

void mark_prescribed(const Scan& s, std::vector<char>& dofs)
{
  const int dim = s.m.dim;
  for (const Prescribed& b : s.step.prescribed)
    for (int n : b.node)
      for (int i = b.first; i <= b.last && i < dim; ++i) dofs[static_cast<size_t>(n) * dim + i] = 1;
}

bool take_supported(const Scan& s, int node, double* F)
{
  const std::vector<char>& fixed = fixed_dofs(s);
  const int dim = s.m.dim;
  const auto at = fixed.begin() + static_cast<long>(node) * dim;
  if (std::none_of(at, at + dim, [](char x) { return x != 0; })) return false;
  Eigen::Matrix3d normals = Eigen::Matrix3d::Zero();
  for (int k = 0; k < s.fm.of_node.count(node); ++k) {
    const int o = s.fm.of_node.begin(node)[k];
    if (s.cracked(o)) return false;
    if (s.el.initial_block[o] < 0) continue;
    const ShapeInfo& info = shape_info[elem_table[s.m.mesh.elem_type[o]].shape];
    const int* conn = s.m.mesh.conn.begin(o);
    for (int f = 0; f < info.nface; ++f) {
      const int *face = info.face[f], *end = face + info.nfnode[f];
      if (std::none_of(face, end, [&](int a) { return conn[a] == node; })) continue;
      if (!supported_face(s, o, f)) continue;
      double mid[3];
      Eigen::Vector3d n;
      face_of(s.m.mesh, o, f, mid, n.data());
      normals += n * n.transpose() / n.squaredNorm();
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(normals);
  const double most = axes.eigenvalues()[2];
  if (most == 0.0) return false;
  Eigen::Map<Eigen::Vector3d> force(F);
  for (int k = 0; k < 3; ++k)
    if (axes.eigenvalues()[k] > SPANS * most) {
      const Eigen::Vector3d n = axes.eigenvectors().col(k);
      force -= force.dot(n) * n;
    }
  return true;
}
