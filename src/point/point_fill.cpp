#include <algorithm>
#include <array>
#include <cmath>

#include "base/comm.h"
#include "base/gather_lists.h"
#include "base/grow.h"
#include "base/log.h"
#include "base/sort_once.h"
#include "model/model_cut.h"
#include "point/filler.h"
#include "shape/shape.h"

namespace {

// the points from first on form a ring that shares its change of volume
void join_points(Points& p, int first)
{
  for (int q = first; q < p.npoint; ++q) p.next[q] = q + 1 < p.npoint ? q + 1 : first;
}

// the support of the last corner created: the node at its position, or the corners at the nodes between
// which it lies  (7.14)
void hang(Filler& f, int e, const CornerKey& key, int total)
{
  Points& p = f.pts;
  const int* node = f.m.mesh.conn.begin(e);
  for (const auto& k : key) {
    const long a = std::find(node, node + f.m.mesh.conn.count(e), k.first) - node;
    append(p.hang.item, key.size() == 1 ? k.first : -1 - f.at_node[a]);
    append(p.hang_w, static_cast<double>(k.second) / total);
  }
  p.hang.off.back() = static_cast<int>(p.hang.item.size());
}

// corner at integer weights iw (their sum is total) on the nodes of element e
int shared_corner(Filler& f, const Body& body, int e, const int* iw, int total)
{
  const int field = body.field;
  const int dim = f.m.dim, nen = f.m.mesh.conn.count(e), *node = f.m.mesh.conn.begin(e);
  CornerKey key;
  double X[3] = {0, 0, 0};
  for (int a = 0; a < nen; ++a) {
    if (!iw[a]) continue;
    key.emplace_back(node[a], iw[a]);
    for (int i = 0; i < dim; ++i) X[i] += f.m.mesh.X[3 * node[a] + i] * iw[a] / total;
  }
  // the same order on all ranks
  const auto number = [&](int n) { return f.m.part.node_number(n); };
  std::sort(key.begin(), key.end(),
            [&](const auto& a, const auto& b) { return number(a.first) < number(b.first); });
  int& first = corner_named(field, key, f.share.corner);
  if (first >= 0 && !f.pts.shareable(first, f.before)) first = -1;
  const bool own = f.parent >= 0 && key.size() > 1;
  if (own) {
    const auto it = f.share.own.find(key);
    if (it != f.share.own.end()) return it->second;
  } else if (first >= 0) {
    return first;
  }
  const int c = fill_corner(f, X, field);
  if (own) f.share.own.emplace(key, c);
  if (first < 0) first = c;
  else f.pts.first_copy[c] = first;
  if (f.plan) return c;
  f.share.made.push_back(c);
  for (const auto& k : key) {
    f.share.node.item.push_back(k.first);
    f.share.weight.push_back(static_cast<double>(k.second) / total);
  }
  if (body.hang) hang(f, e, key, total);
  f.share.node.off.push_back(static_cast<int>(f.share.node.item.size()));
  return c;
}

// m x m lattice of a quadrilateral in its local coordinates
void fill_quad(Filler& f, int body, int e)
{
  const Body& b = f.m.body[body];
  const int m   = b.per_cell;
  auto corner = [&](int i, int j) {
    const int iw[4] = {(m - i) * (m - j), i * (m - j), i * j, (m - i) * j};
    return shared_corner(f, b, e, iw, m * m);
  };
  for (int j = 0; j < m; ++j)
    for (int i = 0; i < m; ++i) {
      const int c[4] = {corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)};
      fill_point(f, body, SHAPE_QUAD4, c);
    }
}

// m^2 triangles of a triangle. Weights are scaled by m as in a quadrilateral, so edges are shared with them.
void fill_tri(Filler& f, int body, int e)
{
  const Body& b = f.m.body[body];
  const int m   = b.per_cell;
  auto corner = [&](int i, int j) {
    const int iw[3] = {(m - i - j) * m, i * m, j * m};
    return shared_corner(f, b, e, iw, m * m);
  };
  for (int j = 0; j < m; ++j)
    for (int i = 0; i + j < m; ++i) {
      const int up[3] = {corner(i, j), corner(i + 1, j), corner(i, j + 1)};
      fill_point(f, body, SHAPE_TRI3, up);
      if (i + j + 1 >= m) continue;
      const int down[3] = {corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)};
      fill_point(f, body, SHAPE_TRI3, down);
    }
}

// m x m x m lattice of a brick
void fill_hex(Filler& f, int body, int e)
{
  const Body& b = f.m.body[body];
  const int m   = b.per_cell;
  auto corner = [&](int i, int j, int k) {
    const int x[2] = {m - i, i}, y[2] = {m - j, j}, z[2] = {m - k, k};
    const int iw[8] = {x[0] * y[0] * z[0], x[1] * y[0] * z[0], x[1] * y[1] * z[0], x[0] * y[1] * z[0],
                       x[0] * y[0] * z[1], x[1] * y[0] * z[1], x[1] * y[1] * z[1], x[0] * y[1] * z[1]};
    return shared_corner(f, b, e, iw, m * m * m);
  };
  for (int k = 0; k < m; ++k)
    for (int j = 0; j < m; ++j)
      for (int i = 0; i < m; ++i) {
        const int c[8] = {corner(i, j, k),
                          corner(i + 1, j, k),
                          corner(i + 1, j + 1, k),
                          corner(i, j + 1, k),
                          corner(i, j, k + 1),
                          corner(i + 1, j, k + 1),
                          corner(i + 1, j + 1, k + 1),
                          corner(i, j + 1, k + 1)};
        fill_point(f, body, SHAPE_HEX8, c);
      }
}

// a tetrahedron is one domain (m = 1) or 8 (m = 2: four at the corners, the octahedron in the middle cut into
// four)
void fill_tet(Filler& f, int body, int e)
{
  const Body& b = f.m.body[body];
  if (b.per_cell == 1) {
    int c[4];
    for (int a = 0; a < 4; ++a) {
      int iw[4] = {0, 0, 0, 0};
      iw[a] = 1;
      c[a]  = shared_corner(f, b, e, iw, 1);
    }
    fill_point(f, body, SHAPE_TET4, c);
    return;
  }
  if (b.per_cell > 2) {
    log_error("body %s: a tetrahedron becomes 1 or 8 points: POINTS=1 or 2, not %d", b.name.c_str(),
              b.per_cell);
    ++f.errors;
    return;
  }
  auto mid = [&](int a, int d) {                     // the weights have the sum 8, as in a brick with m = 2
    int iw[4] = {0, 0, 0, 0};
    iw[a] += 4;
    iw[d] += 4;
    return shared_corner(f, b, e, iw, 8);
  };
  const int m01 = mid(0, 1), m02 = mid(0, 2), m03 = mid(0, 3), m12 = mid(1, 2), m13 = mid(1, 3),
            m23 = mid(2, 3);
  const int domain[8][4] = {{mid(0, 0), m01, m02, m03}, {m01, mid(1, 1), m12, m13},
                            {m02, m12, mid(2, 2), m23}, {m03, m13, m23, mid(3, 3)},
                            {m01, m12, m02, m03},       {m01, m13, m12, m03},
                            {m12, m13, m23, m03},       {m02, m12, m23, m03}};
  for (const auto& c : domain) fill_point(f, body, SHAPE_TET4, c);
}

// a pyramid is one domain (m = 1) or 10 (m = 2: four at the base, one at the apex, one upside down between
// them, and a tetrahedron below each edge of that)
void fill_pyramid(Filler& f, int body, int e)
{
  const Body& b = f.m.body[body];
  if (b.per_cell > 2) {
    log_error("body %s: a pyramid becomes 1 or 10 points: POINTS=1 or 2, not %d", b.name.c_str(),
              b.per_cell);
    ++f.errors;
    return;
  }
  const int total = b.per_cell == 1 ? 1 : 8;         // sum of weights as in a brick
  const auto corner = [&](std::initializer_list<int> nodes) {
    int iw[5] = {};
    for (int a : nodes) iw[a] += total / static_cast<int>(nodes.size());
    return shared_corner(f, b, e, iw, total);
  };
  const int apex = corner({4});
  int base[4], edge[4], up[4];
  for (int a = 0; a < 4; ++a) base[a] = corner({a});
  if (b.per_cell == 1) {
    const int c[5] = {base[0], base[1], base[2], base[3], apex};
    return fill_point(f, body, SHAPE_PYR5, c);
  }
  const int centre = corner({0, 1, 2, 3});
  for (int a = 0; a < 4; ++a) {
    edge[a] = corner({a, (a + 1) % 4});
    up[a]   = corner({a, 4});
  }
  const int pyramid[6][5] = {{base[0], edge[0], centre, edge[3], up[0]},
                             {edge[0], base[1], edge[1], centre, up[1]},
                             {centre, edge[1], base[2], edge[2], up[2]},
                             {edge[3], centre, edge[2], base[3], up[3]},
                             {up[0], up[1], up[2], up[3], apex},
                             {up[0], up[3], up[2], up[1], centre}};
  for (const auto& c : pyramid) fill_point(f, body, SHAPE_PYR5, c);
  for (int a = 0; a < 4; ++a) {
    const int c[4] = {edge[a], centre, up[a], up[(a + 1) % 4]};
    fill_point(f, body, SHAPE_TET4, c);
  }
}

// A wedge is three bricks (m = 1) or six in two layers (m = 2), which meet at the line of centroids of its
// triangles
void fill_wedge(Filler& f, int body, int e)
{
  const Body& b = f.m.body[body];
  const int m   = b.per_cell;
  if (m > 2) {
    log_error("body %s: a wedge becomes 3 or 6 points: POINTS=1 or 2, not %d", b.name.c_str(), m);
    ++f.errors;
    return;
  }
  // on the triangle at height j: the mean of nodes a and d, and of c
  const auto corner = [&](int a, int d, int c, int j) {
    const int part = c >= 0 ? 1 : a == d ? m * m : m == 1 ? 1 : m * m / 2;     // weight as in a brick
    int iw[6] = {}, total = 0;
    for (int n = 0; n < 3; ++n) {
      if (n != a && n != d && n != c) continue;
      iw[n]     = part * (m - j);
      iw[n + 3] = part * j;
      total += part * m;
    }
    return shared_corner(f, b, e, iw, total);
  };
  for (int j = 0; j < m; ++j)
    for (int a = 0; a < 3; ++a) {
      const int next = (a + 1) % 3, last = (a + 2) % 3;
      int c[8];
      for (int k = 0; k < 2; ++k) {
        c[4 * k]     = corner(a, a, -1, j + k);
        c[4 * k + 1] = corner(a, next, -1, j + k);
        c[4 * k + 2] = corner(a, next, last, j + k);
        c[4 * k + 3] = corner(a, last, -1, j + k);
      }
      fill_point(f, body, SHAPE_HEX8, c);
    }
}

// the corners at the nodes of an element, which corners between may interpolate; weights as in the lattice
void corners_at_nodes(Filler& f, const Body& b, int e)
{
  const int total = b.per_cell * b.per_cell * (f.m.dim == 3 ? b.per_cell : 1);
  for (int a = 0; a < f.m.mesh.conn.count(e); ++a) {
    int iw[8] = {};
    iw[a]        = total;
    f.at_node[a] = shared_corner(f, b, e, iw, total);
  }
}

}  // namespace

void fill_element(Filler& f, int body, int e)
{
  const int first = f.pts.npoint;
  switch (elem_table[f.m.mesh.elem_type[e]].shape) {
    case SHAPE_TRI3: fill_tri(f, body, e); break;
    case SHAPE_QUAD4: fill_quad(f, body, e); break;
    case SHAPE_TET4: fill_tet(f, body, e); break;
    case SHAPE_WEDGE6: fill_wedge(f, body, e); break;
    case SHAPE_HEX8: fill_hex(f, body, e); break;
    case SHAPE_PYR5: fill_pyramid(f, body, e); break;
    case SHAPE_TRI6: case SHAPE_QUAD8: case SHAPE_QUAD8R: case SHAPE_TET10: case SHAPE_WEDGE15:
    case SHAPE_HEX20: case SHAPE_HEX20R: case SHAPES:
      log_error("body %s: element %d is a %s, which cannot become material points; use linear elements",
                f.m.body[body].name.c_str(), f.m.mesh.elem_label[e],
                elem_table[f.m.mesh.elem_type[e]].name);
      ++f.errors;
  }
  join_points(f.pts, first);
}

namespace {

// this rank owns all points of the body
void fill_elset(Filler& f, int body)
{
  for (int e : f.m.elset[f.m.body[body].elset].item) {
    if (f.errors) break;
    fill_element(f, body, e);
  }
}

using FaceKey = std::array<int, 4>;      // corners of a face, ascending, by their first names

bool same_face(const FaceKey& a, const FaceKey& b)     // avoids a call of memcmp
{
  return a[0] == b[0] && a[1] == b[1] && a[2] == b[2] && a[3] == b[3];
}

// keys of all faces of points, then of the adjacent points of other ranks, point by point
std::vector<FaceKey> face_keys(const Points& p)
{
  std::vector<FaceKey> out;
  std::size_t faces = 0;
  for (const IntVec* shape : {&p.shape, &p.part.outer_shape})
    for (int s : *shape) faces += static_cast<std::size_t>(shape_info[s].nface);
  out.reserve(faces);
  const auto add = [&](const ShapeInfo& info, const int* corner) {
    for (int s = 0; s < info.nface; ++s) {
      FaceKey key{{-1, -1, -1, -1}};
      for (int k = 0; k < info.nfnode[s]; ++k) {
        const int c = corner[info.face[s][k]];
        key[k] = c >= 0 ? p.first_copy[c] : p.ncorner - 1 - c;
      }
      std::sort(key.begin(), key.end());
      out.push_back(key);
    }
  };
  for (int q = 0; q < p.npoint; ++q) add(shape_info[p.shape[q]], p.conn.begin(q));
  for (int q = 0; q < p.part.outer_conn.size(); ++q)
    add(shape_info[p.part.outer_shape[q]], p.part.outer_conn.begin(q));
  return out;
}

// faces with one owner
void find_boundary(Points& p)
{
  const std::vector<FaceKey> key = face_keys(p);
  const int corners  = p.ncorner + static_cast<int>(p.part.outer_corner.size());
  const ListTable at = gather_lists(corners, [&](auto use) {       // faces by their last corner
    for (size_t f = 0; f < key.size(); ++f) use(key[f][3], static_cast<int>(f));
  });
  p.boundary.clear();
  const FaceKey* own = key.data();
  for (int q = 0; q < p.npoint; ++q)
    for (int s = 0; s < shape_info[p.shape[q]].nface; ++s, ++own) {
      int owners = 0;
      for (int k = at.off[(*own)[3]]; k < at.off[(*own)[3] + 1] && owners < 2; ++k)
        owners += same_face(key[at.item[k]], *own);
      if (owners == 1) p.boundary.push_back({q, s});
    }
}

// faces of a surface on a body: its expression accepts all corners. Returns the number of corners where its
// value is not finite.
int find_surface(const Model& m, const Surface& s, const Points& p, std::vector<Face>& out)
{
  int faults = 0;
  for (const Face& f : p.boundary) {
    if (p.body[f.elem] != s.body) continue;
    const ShapeInfo& info = shape_info[p.shape[f.elem]];
    bool inside = true;
    for (int k = 0; k < info.nfnode[f.face] && inside; ++k) {
      const int c   = p.conn.begin(f.elem)[info.face[f.face][k]];
      double X[3] = {0, 0, 0};
      for (int i = 0; i < m.dim; ++i) X[i] = p.Xc[c * m.dim + i];
      inside = fill_accepts(s.where, X, m.dim, "surface", s.name, s.deck_line, faults);
    }
    if (inside) out.push_back(f);
  }
  return faults;
}

}  // namespace

namespace {

// replaces the numbers of corners of other ranks by indices into outer_corner
void number_foreign(PointPart& part)
{
  IntVec& all = part.outer_corner;
  sort_once(all);
  for (int& c : part.outer_conn.item)
    if (c < 0) c = -1 - static_cast<int>(std::lower_bound(all.begin(), all.end(), -1 - c) - all.begin());
}

// adds the numbers of points of other ranks with a face on side A of bonds or contact pairs and a corner of
// that face on this rank; this rank owns all points of pts. Collective
void add_bonded_points(const Model& m, const Points& pts, IntVec& known)
{
  const ListTable at = gather_lists(pts.ncorner, [&](auto use) {
    for (const BondDef& d : m.bond) {
      if (d.surface < 0 || m.surface[d.surface].body < 0) continue;
      for (const Face& f : pts.surface[d.surface]) {
        const ShapeInfo& info = shape_info[pts.shape[f.elem]];
        for (int k = 0; k < info.nfnode[f.face]; ++k)
          use(pts.conn.begin(f.elem)[info.face[f.face][k]], pts.part.point[f.elem]);
      }
    }
  });
  Halo halo;
  halo_form(std::vector<long>(pts.part.corner.begin(), pts.part.corner.end()), halo);
  std::vector<IntVec> send(comm_size());
  for (int r = 0; r < comm_size(); ++r)
    for (int c : halo.common[r]) send[r].insert(send[r].end(), at.begin(c), at.begin(c + 1));
  for (const IntVec& list : comm_exchange(send)) known.insert(known.end(), list.begin(), list.end());
  sort_once(known);
}

// the points of all bodies, or (plan) the owned and halo points of this rank (known: numbers of the latter);
// returns the number of errors
int fill_bodies(const Model& m, FillPlan* plan, const IntVec& known, Points& pts)
{
  pts = Points();
  pts.part.on = plan;
  CornerShare share;
  Filler f{m, pts, share};
  f.known = &known;
  const CellRanks whole;
  if (plan) fill_plan_begin(f, *plan);
  for (size_t b = 0; b < m.body.size(); ++b) {
    const int before = pts.npoint + pts.part.npoint;
    if (m.body[b].fill == FILL_CONVERSION) continue;
    const int body = static_cast<int>(b);
    if (m.body[b].fill != FILL_ELSET) fill_box(f, body, plan ? m.body[b].rank : whole);
    else if (plan) fill_planned(f, body, *plan);
    else fill_elset(f, body);
    if (pts.npoint + pts.part.npoint == before) {
      log_error("body %s (%s line %d) holds no material point: check its box, its WHERE and its element set",
                m.body[b].name.c_str(), m.body[b].deck_line.file.c_str(), m.body[b].deck_line.line);
      ++f.errors;
    }
  }
  if (pts.part.on) number_foreign(pts.part);
  else pts.part = PointPart();
  pts.part.window = m.part.window;
  return f.errors;
}

}  // namespace

int point_fill(const Model& m, Points& pts)
{
  FillPlan plan;
  IntVec known;                // numbers of the halo points
  int errors = m.part.points ? fill_plan(m, plan) : 0;
  if (errors) return errors;
  errors = fill_bodies(m, m.part.points ? &plan : nullptr, known, pts);
  errors += point_surfaces(m, pts);
  if (!pts.part.on) return errors;
  errors = comm_allreduce_max(errors);
  if (errors) return errors;
  fill_plan_halo(m.part.near_point, m.dim, plan);
  for (const OriginalPoint& p : m.part.near_point) known.push_back(p.point);
  add_bonded_points(m, pts, known);
  if (comm_allreduce_max(static_cast<int>(!known.empty()))) {
    fill_bodies(m, &plan, known, pts);
    point_surfaces(m, pts);
  }
  std::vector<char> own(pts.ncorner, 0);
  for (int q = 0; q < pts.npoint; ++q)
    for (int k = pts.conn.off[q]; k < pts.conn.off[q + 1] && pts.part.rank[q] == comm_rank(); ++k)
      own[pts.conn.item[k]] = 1;
  share_corners(own, pts.part);
  if (!m.part.window) return errors;
  pts.part.start = pts.part.halo;
  point_find_common(m.part, pts.part.rank, pts);
  return errors;
}

void point_fill_whole(const Model& m, Points& pts)
{
  log_mute(true);
  fill_bodies(m, nullptr, {}, pts);
  point_surfaces(m, pts);
  log_mute(false);
}

bool point_corner_in_element(const Model& m, const Points& pts, int e, int c, double* N)
{
  const Shape shape     = elem_table[m.mesh.elem_type[e]].shape;
  const ShapeInfo& info = shape_info[shape];
  double X[24], xi[3];
  for (int a = 0; a < info.nen; ++a)
    for (int i = 0; i < info.dim; ++i) X[a * info.dim + i] = m.mesh.X[3 * m.mesh.conn.begin(e)[a] + i];
  if (!shape_inverse(shape, X, &pts.Xc[c * info.dim], xi)) return false;
  shape_eval(shape, xi, N, nullptr);
  return true;
}

namespace {

// does the corner c of a point lie on face f of its parent element e? Judged by the nodes that it
// interpolates, or by its position
bool on_element_face(const Model& m, const Points& pts, int e, int f, int c)
{
  const ShapeInfo& info = shape_info[elem_table[m.mesh.elem_type[e]].shape];
  const int* node       = m.mesh.conn.begin(e);
  const auto of_face    = [&](int n) {
    for (int k = 0; k < info.nfnode[f]; ++k)
      if (node[info.face[f][k]] == n) return true;
    return false;
  };
  if (const int n = pts.hang.count(c)) {
    const int* on = pts.hang.begin(c);
    return std::all_of(on, on + n,
                       [&](int k) { return of_face(n == 1 ? k : pts.hang.begin(-1 - k)[0]); });
  }
  double N[8];
  if (!point_corner_in_element(m, pts, e, c, N)) return false;
  double off_face = 0.0;       // weight of the nodes that are not on the face
  for (int a = 0; a < info.nen; ++a)
    if (!of_face(node[a])) off_face += std::fabs(N[a]);
  return off_face < 1e-9;
}

// the faces of points that continue a surface of elements: on its faces whose element was converted, in the
// order of the points, which bonds keep in a restart file
void follow_surface(const Model& m, const Surface& s, const Points& pts, std::vector<Face>& out)
{
  for (const Face& f : s.face) {
    if (!pts.converted(f.elem)) continue;
    for (int p = pts.of_elem[f.elem]; p < pts.npoint && pts.parent[p] == f.elem; ++p) {
      const ShapeInfo& info = shape_info[pts.shape[p]];
      for (int g = 0; g < info.nface; ++g) {
        bool inside = true;
        for (int k = 0; k < info.nfnode[g] && inside; ++k)
          inside = on_element_face(m, pts, f.elem, f.face, pts.conn.begin(p)[info.face[g][k]]);
        if (inside) out.push_back({p, g});
      }
    }
  }
  std::sort(out.begin(), out.end(), [](const Face& a, const Face& b) {
    return a.elem != b.elem ? a.elem < b.elem : a.face < b.face;
  });
}

// [surface] 1: loads, bonds, contact or an absorbing boundary act on it
IntVec acting_surfaces(const Model& m)
{
  IntVec acts = model_bonded_surfaces(m);
  for (const Step& s : m.step)
    for (const Load& l : s.load)
      if (l.surface >= 0) acts[l.surface] = 1;
  for (const ViscousBoundary& v : m.viscous) acts[v.surface] = 1;
  return acts;
}

}  // namespace

int point_surfaces(const Model& m, Points& pts)
{
  const IntVec acts = pts.of_elem.empty() ? IntVec() : acting_surfaces(m);
  int errors = 0;
  find_boundary(pts);
  pts.surface.assign(m.surface.size(), {});
  for (size_t s = 0; s < m.surface.size(); ++s) {
    if (m.surface[s].body < 0) {
      if (!acts.empty() && acts[s]) follow_surface(m, m.surface[s], pts, pts.surface[s]);
      continue;
    }
    errors += find_surface(m, m.surface[s], pts, pts.surface[s]) > 0;
    int found = !pts.surface[s].empty();
    if (pts.part.on) found = comm_allreduce_max(found);
    if (found || m.body[m.surface[s].body].fill == FILL_CONVERSION) continue;
    log_error(
        "surface %s (%s line %d) holds no face of body %s: its WHERE is met by no boundary face at t = 0",
        m.surface[s].name.c_str(), m.surface[s].deck_line.file.c_str(), m.surface[s].deck_line.line,
        m.body[m.surface[s].body].name.c_str());
    ++errors;
  }
  return errors;
}

void point_convert(const Model& m, int body, int e, int before, CornerShare& share, Points& pts)
{
  Filler f{m, pts, share, e, before};
  share.own.clear();
  share.made.clear();
  share.node = ListTable();
  share.weight.clear();
  if (pts.of_elem.empty()) pts.of_elem.assign(m.mesh.nelem(), -1);
  pts.of_elem[e] = pts.npoint;
  if (m.body[body].hang) corners_at_nodes(f, m.body[body], e);
  fill_element(f, body, e);
}

namespace {

// G and V (area in 2D) of a domain with corners X from the Gauss point of its part of the element, which has
// this number of m x m (x m)  (7.19)
double gauss_weights(Shape shape, const double* X, int number, int m, double* G)
{
  const int dim = shape_info[shape].dim;
  const double outwards = 1.0 / std::sqrt(1.0 - 1.0 / (m * m)) - 1.0;
  double xi[3], N[8], dN[24];
  for (int d = 0; d < dim; ++d, number /= m) xi[d] = outwards * (2 * (number % m) + 1 - m);
  shape_eval(shape, xi, N, dN);
  return shape_jacobian(shape, dN, X, G) * (dim == 3 ? 8.0 : 4.0);
}

}  // namespace

void point_sample(const Model& m, int e, bool at_gauss, Points& pts)
{
  const int first = pts.of_elem[e], dim = m.dim;
  const Body& b     = m.body[pts.body[first]];
  const Shape shape = static_cast<Shape>(pts.shape[first]);
  const int nen     = shape_info[shape].nen;
  const bool lattice = shape == elem_table[m.mesh.elem_type[e]].shape &&
                       (shape == SHAPE_QUAD4 || shape == SHAPE_HEX8);
  if (pts.sampled[first] == at_gauss || !lattice || b.per_cell == 1) return;
  for (int p = first; p < pts.npoint && pts.parent[p] == e; ++p) {
    double X[24], w[8], G[24];
    point_domain(pts, dim, pts.conn.begin(p), nen, X);
    const double V = at_gauss ? gauss_weights(shape, X, p - first, b.per_cell, G)
                              : cpdi_weights(shape, X, w, G);
    // a distorted element can be inverted this far out
    if (!(V > 0.0)) return point_sample(m, e, false, pts);
    pts.kind[p]    = domain_gradients(pts.kind[p], nen, G, pts.kinds);
    pts.V0[p]      = V * (dim == 2 ? b.thickness : 1.0);
    pts.sampled[p] = at_gauss;
  }
}
