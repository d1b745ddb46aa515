#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <Eigen/Eigenvalues>

#include "base/comm.h"
#include "base/forest.h"
#include "step/step.h"

namespace {

using Mat6 = Eigen::Matrix<double, 6, 6>;
using Vec6 = Eigen::Matrix<double, 6, 1>;

// elements that share a face form a part
void join_faces(const Mesh& mesh, const Elements& el, Forest& parts)
{
  std::map<std::array<int, 4>, int> owner;
  for (const ElemBlock& b : el.block) {
    const ShapeInfo& info = shape_info[b.shape];
    for (int slot : b.live)
      for (int f = 0; f < info.nface; ++f) {
        std::array<int, 4> key = {-1, -1, -1, -1};
        const int* node = mesh.conn.begin(b.elem[slot]);
        for (int a = 0; a < face_corners(info, f); ++a) key[a] = node[info.face[f][a]];
        std::sort(key.begin(), key.end());
        const auto known = owner.emplace(key, b.elem[slot]);
        if (!known.second) parts.join(b.elem[slot], known.first->second);
      }
  }
}

// the same for elements that share a node; a hinge may connect them
void join_nodes(const Mesh& mesh, const Elements& el, Forest& parts)
{
  IntVec owner(mesh.nnode(), -1);
  for (const ElemBlock& b : el.block)
    for (int slot : b.live)
      for (int a = 0; a < mesh.conn.count(b.elem[slot]); ++a) {
        int& first = owner[mesh.conn.begin(b.elem[slot])[a]];
        if (first < 0) first = b.elem[slot];
        else parts.join(b.elem[slot], first);
      }
}

// supports of a part as Gram matrix of its six rigid motions: sum of r r^T over fixed dofs, r: displacement
// of the dof in each motion
struct Part {
  Mat6 gram = Mat6::Zero();
  double X0[3] = {0, 0, 0}, far = 0.0;
  bool begun = false;
};

void add_node(const Mesh& mesh, const Dofs& dofs, int node, Part& part)
{
  const int dim   = dofs.rows.dim;
  const double* X = &mesh.X[3 * node];
  if (!part.begun) std::copy(X, X + 3, part.X0);
  part.begun = true;
  const double d[3] = {X[0] - part.X0[0], X[1] - part.X0[1], X[2] - part.X0[2]};
  part.far = std::max({part.far, std::fabs(d[0]), std::fabs(d[1]), std::fabs(d[2])});
  for (int i = 0; i < dim; ++i) {
    if (dofs.bound.fixed[dofs.rows.row_of_node[node] * dim + i] != DOF_FIXED) continue;
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    Vec6 r = Vec6::Zero();     // translation i; rotations about j and k move along i
    r[i]     = 1.0;
    r[3 + j] = d[k];
    r[3 + k] = -d[j];
    part.gram += r * r.transpose();
  }
}

// eigenvectors of the motions, rotations times the size of the part; 2D: without out-of-plane motions
Eigen::SelfAdjointEigenSolver<Mat6> motions(const Part& part, int dim)
{
  Vec6 scale;
  scale << 1.0, 1.0, 1.0, 1.0 / part.far, 1.0 / part.far, 1.0 / part.far;
  Mat6 g = scale.asDiagonal() * part.gram * scale.asDiagonal();
  if (dim == 2)
    for (int k : {2, 3, 4}) g(k, k) = 1.0 + g.trace();
  return Eigen::SelfAdjointEigenSolver<Mat6>(g);
}

bool is_free(const Eigen::SelfAdjointEigenSolver<Mat6>& e, int k)
{
  return e.eigenvalues()[k] <= 1e-6 * std::max(1e-300, e.eigenvalues()[5]);
}

// divided model of connected elements: supports of all ranks
Part whole_part(const Model& m, const Elements& el, const Dofs& dofs)
{
  Part part;
  part.begun = true;
  RealVec X0(3, 0.0);
  if (!m.mesh.X.empty()) std::copy_n(m.mesh.X.begin(), 3, X0.begin());         // a rank may have points only
  comm_bcast(X0.data(), 3);
  std::copy(X0.begin(), X0.end(), part.X0);
  for (const ElemBlock& b : el.block)
    for (int slot : b.live)
      for (int a = 0; a < m.mesh.conn.count(b.elem[slot]); ++a)
        add_node(m.mesh, dofs, m.mesh.conn.begin(b.elem[slot])[a], part);
  comm_sum(part.gram.data(), 36);
  part.far = comm_allreduce_max(part.far);
  return part;
}

bool holds(const Part& part) { return !is_free(motions(part, 3), 0); }

}  // namespace

bool step_supports_fix(const Model& m, const Elements& el, const Dofs& dofs)
{
  const Mesh& mesh = m.mesh;
  if (dofs.rows.dim != 3) return false;
  if (m.part.on) return m.part.joined && holds(whole_part(m, el, dofs));
  Forest parts(mesh.nelem());
  join_faces(mesh, el, parts);
  std::map<int, Part> part;
  for (const ElemBlock& b : el.block)
    for (int slot : b.live) {
      Part& own = part[parts.root(b.elem[slot])];
      for (int a = 0; a < mesh.conn.count(b.elem[slot]); ++a)
        add_node(mesh, dofs, mesh.conn.begin(b.elem[slot])[a], own);
    }
  return std::all_of(part.begin(), part.end(), [](const auto& x) { return holds(x.second); });
}

namespace {

// the part of elements connected by nodes that contains this node
Part part_of(const Mesh& mesh, const Elements& el, const Dofs& dofs, int node)
{
  Forest parts(mesh.nelem());
  join_nodes(mesh, el, parts);
  int own = -1;                // the part of the node
  for (const ElemBlock& b : el.block)
    for (int slot : b.live)
      for (int a = 0; a < mesh.conn.count(b.elem[slot]); ++a)
        if (mesh.conn.begin(b.elem[slot])[a] == node) own = parts.root(b.elem[slot]);
  Part part;
  if (own < 0) return part;
  for (const ElemBlock& b : el.block)
    for (int slot : b.live)
      for (int a = 0; a < mesh.conn.count(b.elem[slot]) && parts.root(b.elem[slot]) == own; ++a)
        add_node(mesh, dofs, mesh.conn.begin(b.elem[slot])[a], part);
  return part;
}

}  // namespace

std::string step_free_motion(const Model& m, const Elements& el, const Dofs& dofs, int node)
{
  if (m.part.on && !m.part.joined) return "";
  const int dim   = dofs.rows.dim;
  const Part part = m.part.on ? whole_part(m, el, dofs) : part_of(m.mesh, el, dofs, node);
  if (!part.begun) return "";
  const auto e = motions(part, dim);
  int number = 0;
  while (number < 6 && is_free(e, number)) ++number;
  if (number == 0) return "";
  const auto free = e.eigenvectors().leftCols(number);
  std::string text;
  for (int i = 0; i < dim; ++i)                      // translations in the span of the free motions
    if (free.row(i).squaredNorm() > 1.0 - 1e-6)
      text += (text.empty() ? "a translation in direction " : " and ") + std::to_string(i + 1);
  const Eigen::Matrix3d turning = free.bottomRows(3) * free.bottomRows(3).transpose();
  const int turns = static_cast<int>(
      (Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(turning, Eigen::EigenvaluesOnly).eigenvalues().array() >
       1e-6)
          .count());
  if (turns == 0) return text.empty() ? "a translation oblique to the axes" : text;
  return text + (text.empty() ? "" : " and ") +
         (turns == 1 ? "a rotation" : std::to_string(turns) + " rotations");
}
