#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

#include <Eigen/Eigenvalues>

#include "step/step.h"

namespace {

using Mat6 = Eigen::Matrix<double, 6, 6>;
using Vec6 = Eigen::Matrix<double, 6, 1>;

int root_of(IntVec& up, int e)
{
  while (up[e] != e) e = up[e] = up[up[e]];
  return e;
}

// up [nelem]: elements that share a face are in one part
void join_faces(const Problem& p, IntVec& up)
{
  const Mesh& mesh = p.m.mesh;
  std::map<std::array<int, 4>, int> owner;
  for (const ElemBlock& b : p.el.block) {
    const ShapeInfo& info = shape_info[b.shape];
    for (int slot : b.live)
      for (int f = 0; f < info.nface; ++f) {
        std::array<int, 4> key = {-1, -1, -1, -1};
        for (int a = 0; a < info.nfnode[f]; ++a) key[a] = mesh.conn.begin(b.elem[slot])[info.face[f][a]];
        std::sort(key.begin(), key.end());
        const auto known = owner.emplace(key, b.elem[slot]);
        if (!known.second) up[root_of(up, b.elem[slot])] = root_of(up, known.first->second);
      }
  }
}

// what the supports of a part make of its six rigid motions: sum of r r^T over fixed dofs, r = their displacement
struct Part {
  Mat6 gram = Mat6::Zero();
  double X0[3] = {0, 0, 0}, far = 0.0;
  bool begun = false;
};

void add_node(const Problem& p, int node, Part& part)
{
  const double* X = &p.m.mesh.X[3 * node];
  if (!part.begun) std::copy(X, X + 3, part.X0);
  part.begun = true;
  const double d[3] = {X[0] - part.X0[0], X[1] - part.X0[1], X[2] - part.X0[2]};
  part.far = std::max({part.far, std::fabs(d[0]), std::fabs(d[1]), std::fabs(d[2])});
  for (int i = 0; i < 3; ++i) {
    if (p.sys.fixed[p.sys.row_of_node[node] * 3 + i] != DOF_FIXED) continue;
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    Vec6 r = Vec6::Zero();     // translation i; rotations about j and k move along i
    r[i]     = 1.0;
    r[3 + j] = d[k];
    r[3 + k] = -d[j];
    part.gram += r * r.transpose();
  }
}

bool holds(const Part& part)
{
  Vec6 scale;
  scale << 1.0, 1.0, 1.0, 1.0 / part.far, 1.0 / part.far, 1.0 / part.far;
  const Mat6 g = scale.asDiagonal() * part.gram * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen(g, Eigen::EigenvaluesOnly);
  return eigen.eigenvalues()[0] > 1e-6 * eigen.eigenvalues()[5];
}

}  // namespace

bool step_held(const Problem& p)
{
  if (p.m.dim != 3 || p.st.points.npoint || p.st.bonds.nbond || p.fm.on) return false;
  const Mesh& mesh = p.m.mesh;
  IntVec up(mesh.nelem());
  std::iota(up.begin(), up.end(), 0);
  join_faces(p, up);
  std::map<int, Part> part;
  for (const ElemBlock& b : p.el.block)
    for (int slot : b.live) {
      Part& own = part[root_of(up, b.elem[slot])];
      for (int a = 0; a < mesh.conn.count(b.elem[slot]); ++a) add_node(p, mesh.conn.begin(b.elem[slot])[a], own);
    }
  return std::all_of(part.begin(), part.end(), [](const auto& x) { return holds(x.second); });
}
