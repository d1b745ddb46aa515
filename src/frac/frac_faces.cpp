#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Eigenvalues>

#include "frac/frac_scan.h"
#include "shape/shape.h"

// What surrounds a tip: its own crack and others in the ball, and forces on their faces

namespace {

// radius of the ball of J, in element sizes, below which other tips do not reduce it
// (test: fracture/crack_short.inp)
const double LEAST_RADIUS = 1.5;
// relative eigenvalue below which the faces at a node have no extent  (no test)
const double FLAT = 0.05;

// the cracked elements in the ball that are connected to e, by nodes; all: the cracked ones of the ball
void own_crack(const Scan& s, int e, const IntVec& all, std::vector<char>& own)
{
  IntVec todo;
  own.assign(all.size(), 0);
  const auto add = [&](int o) {
    const auto at = std::lower_bound(all.begin(), all.end(), o);
    if (at == all.end() || *at != o || own[at - all.begin()]) return;
    own[at - all.begin()] = 1;
    todo.push_back(o);
  };
  beside(s, e, [&](int o) {
    if (s.cracked(o)) add(o);
    return false;
  });
  for (size_t next = 0; next < todo.size(); ++next)
    for (int k = s.m.mesh.conn.off[todo[next]]; k < s.m.mesh.conn.off[todo[next] + 1]; ++k) {
      const int node = s.m.mesh.conn.item[k];
      for (int q = s.fm.of_node.off[node]; q < s.fm.of_node.off[node + 1]; ++q) add(s.fm.of_node.item[q]);
    }
}

// does a crack end at the surface of the body at this element?
bool at_border(const Scan& s, int o)
{
  for (int f = 0; f < shape_info[elem_table[s.m.mesh.elem_type[o]].shape].nface; ++f)
    if (s.fm.across[6 * o + f] < 0) return true;
  return false;
}

// least and largest distance of the nodes of an element from x
void node_distances(const Mesh& mesh, int o, const double* x, double& least, double& most)
{
  for (int k = mesh.conn.off[o]; k < mesh.conn.off[o + 1]; ++k) {
    const double* X = &mesh.X[3 * static_cast<size_t>(mesh.conn.item[k])];
    const double r  = std::hypot(X[0] - x[0], X[1] - x[1], X[2] - x[2]);
    least = std::min(least, r);
    most  = std::max(most, r);
  }
}

}  // namespace

double tip_radius(const Scan& s, int e, double radius)
{
  const double* c = &s.fm.centre[3 * e];
  const double h  = s.fm.local[e];
  IntVec all;
  frac_in_ball(s.fm, c, radius + h, [&](int o, double) {
    if (s.cracked(o)) all.push_back(o);
  });
  std::sort(all.begin(), all.end());
  std::vector<char> own;
  own_crack(s, e, all, own);
  double other = radius, far = 0.0;
  bool ends = true;                                  // with its other end in the ball
  for (size_t k = 0; k < all.size(); ++k) {
    double least = 1e300, most = 0.0;
    node_distances(s.m.mesh, all[k], c, least, most);
    if (!own[k]) other = std::min(other, least);
    if (own[k]) ends = ends && !at_border(s, all[k]);
    if (own[k]) far = std::max(far, most);
  }
  if (ends && far > 0.0) other = std::min(other, far);
  return std::max(other, std::min(radius, LEAST_RADIUS * h));
}

namespace {

// a node of the faces of intact elements in a ball, with the edges there of these faces
struct FaceNode {
  int node = -1;
  bool crack = false;          // at cracked elements: faces at the surface of the body do not count
  bool grown = true;           // at broken elements only
  double q = 0.0;
  Eigen::Matrix3d dX = Eigen::Matrix3d::Zero();      // sum of dX dX^T
  Eigen::Matrix3d du = Eigen::Matrix3d::Zero();      // sum of du dX^T
  Eigen::Vector3d dq = Eigen::Vector3d::Zero();      // sum of dq dX
};

void add_edge(const Scan& s, int to, double q, FaceNode& n)
{
  const size_t a = n.node, b = to;
  const int dim = s.m.dim;
  Eigen::Vector3d dX, du = Eigen::Vector3d::Zero();
  for (int i = 0; i < 3; ++i) dX[i] = s.m.mesh.X[3 * b + i] - s.m.mesh.X[3 * a + i];
  for (int i = 0; i < dim; ++i) du[i] = s.l.u[b * dim + i] - s.l.u[a * dim + i];
  n.dX += dX * dX.transpose();
  n.du += du * dX.transpose();
  n.dq += (q - n.q) * dX;
}

// inverse of dX in the directions of the faces
Eigen::Matrix3d face_inverse(const FaceNode& n)
{
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(n.dX);
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero();
  for (int k = 0; k < 3; ++k) {
    if (axes.eigenvalues()[k] <= FLAT * axes.eigenvalues()[2]) continue;
    const Eigen::Vector3d v = axes.eigenvectors().col(k);
    inverse += v * v.transpose() / axes.eigenvalues()[k];
  }
  return inverse;
}

// nodes of the faces of intact elements that have no intact element behind them
std::vector<FaceNode> face_nodes(const Scan& s, int e, double radius)
{
  std::vector<FaceNode> out;
  const double* c = &s.fm.centre[3 * e];
  frac_in_ball(s.fm, c, radius + 1.5 * s.fm.local[e], [&](int o, double) {
    if (!s.intact(o)) return;
    const ShapeInfo& info = shape_info[elem_table[s.m.mesh.elem_type[o]].shape];
    for (int f = 0; f < info.nface; ++f) {
      const int behind = s.fm.across[6 * o + f];
      if (behind >= 0 && !s.cracked(behind)) continue;
      const int n = info.nfnode[f], *conn = s.m.mesh.conn.begin(o);
      for (int a = 0; a < n; ++a) {
        const int node = conn[info.face[f][a]];
        auto at = std::find_if(out.begin(), out.end(), [&](const FaceNode& x) { return x.node == node; });
        if (at == out.end()) {
          out.emplace_back();
          at = out.end() - 1;
          at->node = node;
          at->q    = weight_of(s, node, c, radius);
        }
        if (at->crack && behind < 0) continue;
        if (behind >= 0 && !at->crack) {
          const double q = at->q;
          *at       = FaceNode();
          at->node  = node;
          at->q     = q;
          at->crack = true;
        }
        at->grown = at->grown && behind >= 0 && s.broken(behind);
        for (int next : {conn[info.face[f][(a + 1) % n]], conn[info.face[f][(a + n - 1) % n]]})
          add_edge(s, next, weight_of(s, next, c, radius), *at);
      }
    }
  });
  return out;
}

// directions of nodes with forces or supports of their own, which stay where they are   [nnode*dim]
const std::vector<char>& given_dofs(const Scan& s)
{
  if (!s.given.empty()) return s.given;
  const int dim = s.m.dim;
  s.given.assign(static_cast<size_t>(s.m.mesh.nnode()) * dim + 1, 0);
  for (const Load& l : s.step.load)
    if (l.kind == LOAD_NODE)
      for (int n : l.node) s.given[static_cast<size_t>(n) * dim + l.dof] = 1;
  mark_prescribed(s, s.given);
  for (const Frame& f : s.m.frame) {
    if (f.twin < 0) continue;
    const char* own = &s.given[static_cast<size_t>(f.twin) * dim];
    if (std::any_of(own, own + dim, [](char x) { return x != 0; }))
      std::fill_n(s.given.begin() + static_cast<long>(f.node) * dim, dim, 1);
  }
  return s.given;
}

}  // namespace

// A traction moves with the tip where it acts up to the tip: it works with the area that q stretches,
// relative to the displacement u0 of the element. Forces and supports at nodes, and tractions on a notch from
// which a crack has grown, stay where they are.                                                     (7.5a)
// (test: fracture/crack_pressed.inp)
void take_loads(const Scan& s, int e, double radius, double* J)
{
  const int dim = s.m.dim, nen = s.m.mesh.conn.count(e), *conn = s.m.mesh.conn.begin(e);
  const std::vector<char>& given = given_dofs(s);
  const bool grown = beside(s, e, [&](int o) { return s.broken(o); });
  double u0[3] = {0, 0, 0};
  for (int a = 0; a < nen; ++a)
    for (int i = 0; i < dim; ++i) u0[i] += s.l.u[static_cast<size_t>(conn[a]) * dim + i] / nen;
  for (const FaceNode& n : face_nodes(s, e, radius)) {
    // body forces stay, those of intact elements by (7.5c)
    double f[3], intact[3], broken[3], part[3] = {0, 0, 0};
    std::copy_n(force_at(s, n.node), dim, f);
    const Eigen::Matrix3d inverse = face_inverse(n), H = n.du * inverse;
    const Eigen::Vector3d stretch = inverse * n.dq;
    if (body_at(s, n.node, intact, broken))
      for (int i = 0; i < dim; ++i) {
        f[i] -= intact[i] + broken[i];
        for (int k = 0; k < dim; ++k) part[k] -= n.q * H(i, k) * broken[i];
      }
    for (int i = 0; i < dim; ++i) {
      const size_t at = static_cast<size_t>(n.node) * dim + i;
      const bool stays    = given[at] || (grown && !n.grown);
      const double u      = s.l.u[at] - u0[i];
      for (int k = 0; k < dim; ++k) part[k] += f[i] * (stays ? -n.q * H(i, k) : u * stretch[k]);
    }
    take_supported(s, n.node, part);
    for (int k = 0; k < dim; ++k) J[k] += part[k];
  }
}
