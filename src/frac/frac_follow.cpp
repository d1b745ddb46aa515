#include <algorithm>
#include <cmath>

#include "frac/frac.h"

namespace {

// nodes of converted elements that have no element left
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

// the corner of point q at node n of its element at t = 0, -1: none
//   in   start   the points of the element at t = 0, of which q is the k-th
int corner_at(const Model& m, const Points& pts, int q, const Points& start, int k, int n, double tol)
{
  for (int a = 0; a < start.conn.count(k); ++a) {
    const int c = start.conn.begin(k)[a];
    double apart = 0.0;
    for (int i = 0; i < m.dim; ++i)
      apart = std::max(apart, std::fabs(start.Xc[c * m.dim + i] - m.mesh.X[3 * n + i]));
    if (apart <= tol) return pts.conn.begin(q)[a];
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
    CornerShare share;
    Points start;              // released points have other shapes                              (7.34)
    const int first  = pts.of_elem[e];
    const bool apart = point_any_released(pts, e);
    if (apart) point_convert(m, pts.body[first], e, 0, share, start);
    for (int k = m.mesh.conn.off[e]; k < m.mesh.conn.off[e + 1]; ++k) {
      const int n = m.mesh.conn.item[k];
      if (!lost[n] || (corner[n] >= 0 && pts.field[corner[n]] != FIELD_OWN)) continue;   // released ones last
      for (int q = first; q < pts.npoint && pts.parent[q] == e; ++q) {
        const int c = corner_at(m, pts, q, apart ? start : pts, apart ? q - first : q, n, tol);
        if (c >= 0 && (corner[n] < 0 || pts.field[c] != FIELD_OWN)) corner[n] = c;
      }
    }
  }
}
