#include "frac/free_face.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/forest.h"
#include "base/gather_lists.h"
#include "base/sort_once.h"
#include "shape/shape.h"

namespace {

// the adjacent element at a face, -1: none
int adjacent(const Mesh& mesh, const ListTable& of_node, int e, int f)
{
  const ShapeInfo& info = shape_info[elem_table[mesh.elem_type[e]].shape];
  const int *node = mesh.conn.begin(e), first = node[info.face[f][0]];
  for (int k = of_node.off[first]; k < of_node.off[first + 1]; ++k) {
    const int o = of_node.item[k], *of = mesh.conn.begin(o);
    bool all = o != e;
    for (int a = 1; a < info.nfnode[f] && all; ++a)
      all = std::find(of, of + mesh.conn.count(o), node[info.face[f][a]]) != of + mesh.conn.count(o);
    if (all) return o;
  }
  return -1;
}

std::vector<FreeFace> all_free_faces(const Mesh& mesh, const ListTable& of_node, const IntVec& removed)
{
  std::vector<FreeFace> out;
  for (int e = 0; e < mesh.nelem(); ++e) {
    if (removed[e] || mesh.elem_section[e] < 0) continue;
    for (int f = 0; f < shape_info[elem_table[mesh.elem_type[e]].shape].nface; ++f) {
      const int o = adjacent(mesh, of_node, e, f);
      if (o < 0 || removed[o]) out.push_back(free_face(mesh, e, f, o >= 0));
    }
  }
  return out;
}

// numbers the parts of faces connected by nodes
void join_faces(const std::vector<FreeFace>& face, IntVec& part)
{
  std::vector<std::pair<int, int>> at;               // node, face
  for (size_t i = 0; i < face.size(); ++i)
    for (int a = 0; a < face[i].n; ++a) at.emplace_back(face[i].node[a], static_cast<int>(i));
  std::sort(at.begin(), at.end());
  Forest parts(static_cast<int>(face.size()));
  for (size_t k = 1; k < at.size(); ++k)
    if (at[k].first == at[k - 1].first) parts.join(at[k].second, at[k - 1].second);
  part.clear();
  for (size_t i = 0; i < face.size(); ++i) part.push_back(parts.root(static_cast<int>(i)));
}

// parts that extend out of the ball: with a node (3D: an edge) of a single face of the ball
std::vector<char> open_parts(const std::vector<FreeFace>& face, const IntVec& part)
{
  std::vector<std::array<int, 3>> end;               // nodes, part
  for (size_t i = 0; i < face.size(); ++i)
    for (int a = 0; a < face[i].n; ++a) {
      const int n = face[i].node[a], o = face[i].n == 2 ? n : face[i].node[(a + 1) % face[i].n];
      end.push_back({std::min(n, o), std::max(n, o), part[i]});
    }
  std::sort(end.begin(), end.end());
  std::vector<char> open(face.size(), 0);
  for (size_t i = 0, next; i < end.size(); i = next) {
    for (next = i; next < end.size() && end[next] == end[i];) ++next;
    if ((next - i) % 2 == 1) open[end[i][2]] = 1;
  }
  return open;
}

}  // namespace

void face_of(const Mesh& mesh, int e, int f, double* mid, double* area)
{
  const ShapeInfo& info = shape_info[elem_table[mesh.elem_type[e]].shape];
  const int n = info.nfnode[f], *conn = mesh.conn.begin(e);
  const double* X[4];
  for (int a = 0; a < n; ++a) X[a] = &mesh.X[3 * conn[info.face[f][a]]];
  for (int i = 0; i < 3; ++i) {
    mid[i] = 0.0;
    for (int a = 0; a < n; ++a) mid[i] += X[a][i] / n;
  }
  if (n == 2) {
    area[0] = X[1][1] - X[0][1];
    area[1] = X[0][0] - X[1][0];
    area[2] = 0.0;
    return;
  }
  double p[3], r[3];
  for (int i = 0; i < 3; ++i) {
    p[i] = X[2][i] - X[0][i];
    r[i] = n == 4 ? X[3][i] - X[1][i] : X[2][i] - X[1][i];
  }
  for (int i = 0; i < 3; ++i)
    area[i] = 0.5 * (p[(i + 1) % 3] * r[(i + 2) % 3] - p[(i + 2) % 3] * r[(i + 1) % 3]);
}

FreeFace free_face(const Mesh& mesh, int e, int f, bool removed)
{
  const ShapeInfo& info = shape_info[elem_table[mesh.elem_type[e]].shape];
  FreeFace g;
  g.elem    = e;
  g.n       = info.nfnode[f];
  g.removed = removed;
  for (int a = 0; a < g.n; ++a) g.node[a] = mesh.conn.begin(e)[info.face[f][a]];
  face_of(mesh, e, f, g.mid, g.area);
  g.size = std::hypot(g.area[0], g.area[1], g.area[2]);
  return g;
}

bool facing(const FreeFace& a, const FreeFace& b, double h, bool opposed)
{
  double cosine = 0.0, dot = 0.0, before_a = 0.0, before_b = 0.0;
  for (int k = 0; k < 3; ++k) dot += a.area[k] * b.area[k];
  if (opposed && dot > -0.49 * a.size * b.size) return false;      // most pairs
  for (int k = 0; k < 3; ++k) cosine += a.area[k] * b.area[k] / (a.size * b.size);
  if (opposed && cosine > -0.5) return false;
  for (int k = 0; k < 3; ++k) {
    before_a += (b.mid[k] - a.mid[k]) * a.area[k] / a.size;
    before_b += (a.mid[k] - b.mid[k]) * b.area[k] / b.size;
  }
  const double least = (cosine > -0.5 ? 1e-6 : -1e-6) * h;       // the faces of a slit may coincide
  return before_a >= least && before_b >= least;
}

bool notch_among(const std::vector<FreeFace>& face, double h)
{
  IntVec part;
  join_faces(face, part);
  const std::vector<char> open = open_parts(face, part);
  for (size_t i = 0; i < face.size(); ++i)
    for (size_t j = 0; j < i; ++j)
      if (part[i] == part[j] && open[part[i]] && facing(face[i], face[j], h, true)) return true;
  return false;
}

IntVec hollow_elements(const Mesh& mesh, const ListTable& of_node, const IntVec& removed)
{
  const std::vector<FreeFace> face = all_free_faces(mesh, of_node, removed);
  const ListTable at = gather_lists(mesh.nnode(), [&](auto use) {
    for (size_t i = 0; i < face.size(); ++i)
      for (int a = 0; a < face[i].n; ++a) use(face[i].node[a], static_cast<int>(i));
  });
  IntVec out;
  for (int n = 0; n < mesh.nnode(); ++n)
    for (int i = at.off[n]; i < at.off[n + 1]; ++i)
      for (int j = at.off[n]; j < i; ++j) {
        const FreeFace &a = face[at.item[i]], &b = face[at.item[j]];
        if (!facing(a, b, a.n == 2 ? a.size : std::sqrt(a.size), false)) continue;
        out.push_back(a.elem);
        out.push_back(b.elem);
      }
  sort_once(out);
  return out;
}
