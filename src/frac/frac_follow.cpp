#include <algorithm>
#include <cmath>

#include "frac/frac.h"

namespace {

// nodes of elements that have become points, without those that still have an element
IntVec lost_nodes(const Model& m, const Fracture& fr)
{
  IntVec lost(m.mesh.nnode(), 0);
  for (int e : fr.converted)
    for (int k = m.mesh.conn.off[e]; k < m.mesh.conn.off[e + 1]; ++k) lost[m.mesh.conn.item[k]] = 1;
  for (int e = 0; e < m.mesh.nelem(); ++e) {
    if (fr.phase[e] != AS_ELEMENT) continue;
    for (int k = m.mesh.conn.off[e]; k < m.mesh.conn.off[e + 1]; ++k) lost[m.mesh.conn.item[k]] = 0;
  }
  return lost;
}

double shortest_edge(const Model& m, const Points& pts, int q)
{
  double least = 1e300;
  for (int k = pts.conn.off[q]; k < pts.conn.off[q + 1]; ++k)
    for (int j = pts.conn.off[q]; j < k; ++j) {
      double square = 0.0;
      for (int i = 0; i < m.dim; ++i) {
        const double d = pts.Xc[pts.conn.item[k] * m.dim + i] - pts.Xc[pts.conn.item[j] * m.dim + i];
        square += d * d;
      }
      least = std::min(least, square);
    }
  return std::sqrt(least);
}

// the corner of a point that lies at node n of its element at t = 0, -1: none; released points have shapes of
// their own (7.34), of half the size at least: their corner next to the node
int corner_at(const Model& m, const Points& pts, int q, int n, double tol)
{
  if (pts.field[pts.conn.item[pts.conn.off[q]]] == FIELD_OWN) tol = 0.45 * shortest_edge(m, pts, q);
  for (int k = pts.conn.off[q]; k < pts.conn.off[q + 1]; ++k) {
    const int c = pts.conn.item[k];
    double apart = 0.0;
    for (int i = 0; i < m.dim; ++i)
      apart = std::max(apart, std::fabs(pts.Xc[c * m.dim + i] - m.mesh.X[3 * n + i]));
    if (apart <= tol) return c;
  }
  return -1;
}

// a millionth of the size of an element: smaller than the distance of its corners
double tolerance(const Mesh& mesh, int e)
{
  double size = 0.0;
  const int* node = mesh.conn.begin(e);
  for (int a = 1; a < mesh.conn.count(e); ++a)
    for (int i = 0; i < 3; ++i)
      size = std::max(size, std::fabs(mesh.X[3 * node[a] + i] - mesh.X[3 * node[0] + i]));
  return 1e-6 * size;
}

}  // namespace

void frac_follow(const Model& m, const Fracture& fr, const Points& pts, IntVec& corner)
{
  corner.clear();
  if (fr.converted.empty()) return;
  const IntVec lost = lost_nodes(m, fr);
  corner.assign(m.mesh.nnode(), FOLLOW_ELEMENT);
  for (int n = 0; n < m.mesh.nnode(); ++n)
    if (lost[n]) corner[n] = FOLLOW_NONE;
  for (int e : fr.converted) {
    const double tol = tolerance(m.mesh, e);
    for (int k = m.mesh.conn.off[e]; k < m.mesh.conn.off[e + 1]; ++k) {
      const int n = m.mesh.conn.item[k];
      if (!lost[n] || (corner[n] >= 0 && pts.field[corner[n]] != FIELD_OWN)) continue;   // released ones last
      for (int q = pts.of_elem[e]; q < pts.npoint && pts.parent[q] == e; ++q) {
        const int c = corner_at(m, pts, q, n, tol);
        if (c >= 0 && (corner[n] < 0 || pts.field[c] != FIELD_OWN)) corner[n] = c;
      }
    }
  }
}
