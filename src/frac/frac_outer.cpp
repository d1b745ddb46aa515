#include <algorithm>
#include <climits>
#include <cmath>
#include <unordered_map>

#include "base/sort_once.h"
#include "frac/frac.h"
#include "frac/free_face.h"
#include "shape/shape.h"

namespace {

// safety factor of the range of the halo: sizes are computed with straight edges  (no test)
const double CURVED_FACTOR = 1.02;

// A mesh before its elements are set up
struct Sizes {
  RealVec centre;              // [nelem*3]
  RealVec size;                // [nelem] as FracMesh::size
  RealVec around;              // [nelem] largest size of elements at its nodes: bound of FracMesh::local
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
    const double cube = content(mesh, dim, e) * shape_info[elem_table[mesh.elem_type[e]].shape].cube_parts;
    s.size[e] = dim == 2 ? std::sqrt(cube) : std::cbrt(cube);
    for (int a = 0; a < n; ++a) at_node[node[a]] = std::max(at_node[node[a]], s.size[e]);
  }
  for (int e = 0; e < nelem; ++e)
    for (int k = mesh.conn.off[e]; k < mesh.conn.off[e + 1]; ++k)
      s.around[e] = std::max(s.around[e], at_node[mesh.conn.item[k]]);
  return s;
}

// Distances from the centre of an element, in sizes, to the centres that frac_test reads; all: also near the
// end of a notch. Equal for FORCE.
struct Reach { double most, all; };

Reach reach_of(const Model& m, const FractureDef& f)
{
  bool force = f.estimate == ESTIMATE_FORCE, ball = f.estimate == ESTIMATE_BALL;
  for (const Step& s : m.step) {
    force = force || (f.estimate == ESTIMATE_AUTO && s.proc == PROC_STATIC);
    ball  = ball || (f.estimate == ESTIMATE_AUTO && s.proc == PROC_DYNAMIC);
  }
  const auto radius    = [&](double by) { return f.epsilon > 0.0 ? f.epsilon : by; };
  const double spacing = f.spacing >= 0.0 ? f.spacing : FRAC_SPACING;
  Reach r = {1.0 + std::max({radius(FRAC_RADIUS_BALL), spacing, 1.1}), 0.0};
  if (force) r.most = std::max(r.most, 1.5 + std::max(radius(FRAC_RADIUS_FORCE), spacing));
  const bool sharp = m.dim == 2 && m.section.size() > 1;
  if (force && m.dim == 2)
    r.most = std::max(r.most, sharp ? radius(FRAC_RADIUS_FORCE) + FRAC_SHARP : FRAC_KINK);
  if (force && m.dim == 3) r.most = std::max(r.most, m.section.size() > 1 ? FRAC_SHARP : FRAC_KINK);
  if (ball && sharp) r.most = std::max(r.most, radius(FRAC_RADIUS_BALL) + FRAC_SHARP);
  r.all = ball ? std::max(r.most, 1.5 + (m.dim == 2 ? 2.0 : 1.0) * FRAC_NOTCH) : r.most;
  return r;
}

// Elements that can break, in cells as wide as the largest reach
struct Cell {
  IntVec elem;
  int rank = -1;               // of all its elements, -1: several
};

struct Cells {
  double width = 0.0;
  std::unordered_map<long, Cell> cell;
  long key(const double* x, int di, int dj, int dk) const
  {
    const auto at = [&](int i, int d) { return static_cast<long>(std::floor(x[i] / width)) + d; };
    return (at(0, di) * 2097143 + at(1, dj)) * 2097143 + at(2, dk);
  }
};

Cells find_cells(const Sizes& s, const IntVec& rank, const RealVec& reach)
{
  Cells c;
  c.width = *std::max_element(reach.begin(), reach.end());
  for (size_t e = 0; e < reach.size(); ++e) {
    if (reach[e] == 0.0) continue;
    Cell& cell = c.cell[c.key(&s.centre[3 * e], 0, 0, 0)];
    cell.rank  = cell.elem.empty() || cell.rank == rank[e] ? rank[e] : -1;
    cell.elem.push_back(static_cast<int>(e));
  }
  return c;
}

// The cells around the cell of consecutive elements
struct Around {
  long key = LONG_MIN;
  std::vector<const Cell*> cell;
};

void look_around(const Cells& c, const double* x, Around& a)
{
  const long key = c.key(x, 0, 0, 0);
  if (key == a.key) return;
  a.key = key;
  a.cell.clear();
  for (int i = -1; i <= 1; ++i)
    for (int j = -1; j <= 1; ++j)
      for (int k = -1; k <= 1; ++k) {
        const auto found = c.cell.find(c.key(x, i, j, k));
        if (found != c.cell.end()) a.cell.push_back(&found->second);
      }
}

// square of a distance
double between(const double* x, const double* y)
{
  const double d[3] = {x[0] - y[0], x[1] - y[1], x[2] - y[2]};
  return d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
}

// adds element o to the lists of the other ranks with an element that reaches it
void add_near(const Cells& c, const Sizes& s, const IntVec& rank, const RealVec& reach, int o, Around& around,
              std::vector<IntVec>& list)
{
  const double* x = &s.centre[3 * static_cast<size_t>(o)];
  look_around(c, x, around);
  for (const Cell* cell : around.cell) {
    if (cell->rank == rank[o]) continue;
    for (int e : cell->elem) {
      IntVec& of = list[rank[e]];
      if (rank[e] == rank[o] || (!of.empty() && of.back() == o)) continue;
      if (between(x, &s.centre[3 * static_cast<size_t>(e)]) < reach[e] * reach[e]) of.push_back(o);
    }
  }
}

// TRACK: all ranks move all tips, through elements of all ranks
void add_tracked(const Model& m, const IntVec& rank, std::vector<IntVec>& list)
{
  for (const FractureDef& f : m.fracture)
    for (int r = 0; r < static_cast<int>(list.size()) && f.track; ++r)
      for (int e : m.elset[f.elset].item)
        if (rank[e] != r) list[r].push_back(e);
  for (IntVec& of : list) sort_once(of);
}

// elements of other ranks at a node of the elements listed so far
void add_neighbours(const Mesh& mesh, const ListTable& of_node, const IntVec& rank,
                    std::vector<IntVec>& list)
{
  const auto each = [&](int e, auto use) {
    for (int k = mesh.conn.off[e]; k < mesh.conn.off[e + 1]; ++k)
      for (int q = of_node.off[mesh.conn.item[k]]; q < of_node.off[mesh.conn.item[k] + 1]; ++q)
        use(of_node.item[q]);
  };
  std::vector<IntVec> own(list.size());
  for (int e = 0; e < mesh.nelem(); ++e) own[rank[e]].push_back(e);
  IntVec seen(mesh.nelem(), -1);         // last rank that got it
  for (int r = 0; r < static_cast<int>(list.size()); ++r) {
    const IntVec near = list[r];
    for (int e : near) seen[e] = r;
    const auto add = [&](int o) {
      if (rank[o] == r || seen[o] == r) return;
      seen[o] = r;
      list[r].push_back(o);
    };
    for (int e : near) each(e, add);
    for (int e : own[r]) each(e, add);
  }
}

// Elements of BALL near a possible end of a notch, and elements of FORCE
std::vector<char> find_notched(const Model& m, const ListTable& of_node, const Sizes& s, const IntVec& rank,
                               const RealVec& most, const RealVec& all)
{
  const IntVec hollow = hollow_elements(m.mesh, of_node, model_removed(m));
  std::vector<char> notched(all.size(), 0);
  for (size_t e = 0; e < all.size(); ++e) notched[e] = most[e] == all[e];
  const Cells cells = find_cells(s, rank, all);
  Around around;
  for (int o : hollow) {
    const double* x = &s.centre[3 * static_cast<size_t>(o)];
    look_around(cells, x, around);
    for (const Cell* cell : around.cell)
      for (int e : cell->elem) notched[e] |= between(x, &s.centre[3 * e]) < all[e] * all[e];
  }
  return notched;
}

// elements near elements that may be converted
std::vector<char> near_points(const Model& m)
{
  const Mesh& mesh = m.mesh;
  std::vector<char> near(mesh.nelem(), 0), node(mesh.nnode(), 0);
  for (const ConversionDef& c : m.conversion)
    for (int e : m.elset[c.elset].item) near[e] = 1;
  for (int row = 0; row < FRAC_ROWS; ++row) {
    for (int e = 0; e < mesh.nelem(); ++e)
      for (int k = mesh.conn.off[e]; k < mesh.conn.off[e + 1] && near[e]; ++k) node[mesh.conn.item[k]] = 1;
    for (int e = 0; e < mesh.nelem(); ++e)
      for (int k = mesh.conn.off[e]; k < mesh.conn.off[e + 1] && !near[e]; ++k)
        near[e] = node[mesh.conn.item[k]];
  }
  return near;
}

}  // namespace

std::vector<IntVec> frac_around(const Model& m, const IntVec& rank, int ranks, int rows)
{
  const Mesh& mesh = m.mesh;
  std::vector<IntVec> list(ranks);
  const std::vector<char> near = near_points(m);
  std::vector<IntVec> of_node(mesh.nnode());         // ranks with an element at the node
  const auto take = [&](int n, int r) {
    if (std::find(of_node[n].begin(), of_node[n].end(), r) == of_node[n].end()) of_node[n].push_back(r);
  };
  for (int e = 0; e < mesh.nelem(); ++e)
    for (int k = mesh.conn.off[e]; k < mesh.conn.off[e + 1] && near[e]; ++k) take(mesh.conn.item[k], rank[e]);
  for (int row = 0; row < rows; ++row) {
    std::vector<std::pair<int, int>> found;          // element, rank
    for (int e = 0; e < mesh.nelem(); ++e)
      for (int k = mesh.conn.off[e]; k < mesh.conn.off[e + 1] && near[e]; ++k)
        for (int r : of_node[mesh.conn.item[k]])
          if (r != rank[e]) found.emplace_back(e, r);
    for (const auto& [e, r] : found) {
      list[r].push_back(e);
      for (int k = mesh.conn.off[e]; k < mesh.conn.off[e + 1]; ++k) take(mesh.conn.item[k], r);
    }
  }
  for (IntVec& elem : list) sort_once(elem);
  return list;
}

std::vector<IntVec> frac_outer(const Model& m, const IntVec& rank, int ranks, std::vector<char>& notch)
{
  std::vector<IntVec> list(ranks);
  const Sizes s = find_sizes(m.mesh, m.dim);
  RealVec reach(m.mesh.nelem(), 0.0), all(reach);
  for (const FractureDef& f : m.fracture) {
    if (f.elset < 0) continue;
    const Reach r = reach_of(m, f);
    for (int e : m.elset[f.elset].item) {
      reach[e] = CURVED_FACTOR * r.most * s.around[e];
      all[e]   = CURVED_FACTOR * r.all * s.around[e];
    }
  }
  notch.clear();
  const auto tracks = [](const FractureDef& f) { return f.track; };
  const bool any    = std::any_of(all.begin(), all.end(), [](double x) { return x > 0.0; });
  if (!any && std::none_of(m.fracture.begin(), m.fracture.end(), tracks)) return list;
  const ListTable of_node = frac_of_node(m.mesh);
  // with FORCE only, both reaches are equal
  if (reach != all) notch = find_notched(m, of_node, s, rank, reach, all);
  for (size_t e = 0; e < notch.size(); ++e)
    if (notch[e]) reach[e] = all[e];
  const Cells cells = find_cells(s, rank, reach);
  Around around;
  for (int o = 0; o < m.mesh.nelem(); ++o) add_near(cells, s, rank, reach, o, around, list);
  add_tracked(m, rank, list);
  add_neighbours(m.mesh, of_node, rank, list);
  for (IntVec& of : list) std::sort(of.begin(), of.end());
  return list;
}
