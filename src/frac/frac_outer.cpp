#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "frac/frac.h"
#include "shape/shape.h"

namespace {

const double SLACK = 1.02;     // sizes here are those of straight edges

// A mesh before its elements are set up
struct Sizes {
  RealVec centre;              // [nelem*3]
  RealVec size;                // [nelem] as FracMesh::size
  RealVec around;              // [nelem] largest of those that share a node: FracMesh::local is no more
};

// area in the plane, volume in space, from the corners: sum of x . n dA over the faces
double content(const Mesh& mesh, int dim, int e)
{
  const ShapeInfo& info = shape_info[elem_table[mesh.elem_type[e]].shape];
  const int* node = mesh.conn.begin(e);
  double sum = 0.0;
  for (int f = 0; f < info.nface; ++f) {
    const double* x = &mesh.X[3 * static_cast<size_t>(node[info.face[f][0]])];
    if (dim == 2) {
      const double* y = &mesh.X[3 * static_cast<size_t>(node[info.face[f][1]])];
      sum += 0.5 * (x[0] * y[1] - x[1] * y[0]);
    }
    for (int a = 2; dim == 3 && a < face_corners(info, f); ++a) {
      const double* y = &mesh.X[3 * static_cast<size_t>(node[info.face[f][a - 1]])];
      const double* z = &mesh.X[3 * static_cast<size_t>(node[info.face[f][a]])];
      sum += (x[0] * (y[1] * z[2] - y[2] * z[1]) + x[1] * (y[2] * z[0] - y[0] * z[2]) +
              x[2] * (y[0] * z[1] - y[1] * z[0])) / 6.0;
    }
  }
  return std::fabs(sum);
}

Sizes find_sizes(const Mesh& mesh, int dim)
{
  Sizes s;
  const int nelem = mesh.nelem();
  RealVec at_node(mesh.nnode(), 0.0);
  s.centre.assign(3 * static_cast<size_t>(nelem), 0.0);
  s.size.assign(nelem, 0.0);
  s.around = s.size;
  for (int e = 0; e < nelem; ++e) {
    const int n = mesh.conn.count(e), *node = mesh.conn.begin(e);
    for (int a = 0; a < n; ++a)
      for (int i = 0; i < 3; ++i) s.centre[3 * e + i] += mesh.X[3 * static_cast<size_t>(node[a]) + i] / n;
    if (mesh.elem_section[e] < 0) continue;
    const double cube = content(mesh, dim, e) * parts_of_cube(elem_table[mesh.elem_type[e]].shape);
    s.size[e] = dim == 2 ? std::sqrt(cube) : std::cbrt(cube);
    for (int a = 0; a < n; ++a) at_node[node[a]] = std::max(at_node[node[a]], s.size[e]);
  }
  for (int e = 0; e < nelem; ++e)
    for (int k = mesh.conn.off[e]; k < mesh.conn.off[e + 1]; ++k)
      s.around[e] = std::max(s.around[e], at_node[mesh.conn.item[k]]);
  return s;
}

// distance from the centre of an element, in sizes, to the centres that frac_test looks at
double reach_of(const Model& m, const FractureDef& f)
{
  bool force = f.estimate == ESTIMATE_FORCE, ball = f.estimate == ESTIMATE_BALL;
  for (const Step& s : m.step) {
    force = force || (f.estimate == ESTIMATE_AUTO && s.proc == PROC_STATIC);
    ball  = ball || (f.estimate == ESTIMATE_AUTO && s.proc == PROC_DYNAMIC);
  }
  const double radius = f.epsilon > 0.0 ? f.epsilon : force ? FRAC_RADIUS_FORCE : FRAC_RADIUS_BALL;
  return 1.5 + std::max({radius, ball ? FRAC_NOTCH : 0.0, f.spacing >= 0.0 ? f.spacing : FRAC_SPACING});
}

// Elements of this rank that can break, in cells as wide as the largest reach
struct Cells {
  double width = 0.0;
  std::unordered_map<long, IntVec> elem;
  long cell(const double* x, int di, int dj, int dk) const
  {
    const auto at = [&](int i, int d) { return static_cast<long>(std::floor(x[i] / width)) + d; };
    return (at(0, di) * 2097143 + at(1, dj)) * 2097143 + at(2, dk);
  }
};

bool is_near(const Cells& c, const Sizes& s, const RealVec& reach, const double* x)
{
  for (int i = -1; i <= 1; ++i)
    for (int j = -1; j <= 1; ++j)
      for (int k = -1; k <= 1; ++k) {
        const auto found = c.elem.find(c.cell(x, i, j, k));
        if (found == c.elem.end()) continue;
        for (int e : found->second) {
          const double* y = &s.centre[3 * static_cast<size_t>(e)];
          if (std::hypot(x[0] - y[0], x[1] - y[1], x[2] - y[2]) < reach[e]) return true;
        }
      }
  return false;
}

}  // namespace

IntVec frac_outer(const Model& m, const IntVec& rank, int r)
{
  IntVec list;
  if (m.fracture.empty()) return list;
  const Mesh& mesh = m.mesh;
  const int nelem = mesh.nelem();
  const Sizes s = find_sizes(mesh, m.dim);
  RealVec reach(nelem, 0.0);
  Cells cells;
  for (const FractureDef& f : m.fracture)
    for (int e : m.elset[f.elset].item) {
      if (rank[e] != r) continue;
      reach[e]    = SLACK * reach_of(m, f) * s.around[e];
      cells.width = std::max(cells.width, reach[e]);
    }
  if (cells.width == 0.0) return list;
  for (int e = 0; e < nelem; ++e)
    if (reach[e] > 0.0) cells.elem[cells.cell(&s.centre[3 * static_cast<size_t>(e)], 0, 0, 0)].push_back(e);
  std::vector<char> here(nelem, 0), at_node(mesh.nnode(), 0);
  for (int e = 0; e < nelem; ++e) {
    here[e] = rank[e] == r || is_near(cells, s, reach, &s.centre[3 * static_cast<size_t>(e)]);
    for (int k = mesh.conn.off[e]; here[e] && k < mesh.conn.off[e + 1]; ++k) at_node[mesh.conn.item[k]] = 1;
  }
  for (int e = 0; e < nelem; ++e) {
    for (int k = mesh.conn.off[e]; k < mesh.conn.off[e + 1]; ++k)
      here[e] = here[e] || at_node[mesh.conn.item[k]];
    if (here[e] && rank[e] != r) list.push_back(e);
  }
  return list;
}
