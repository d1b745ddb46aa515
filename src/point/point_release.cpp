#include "point/point.h"

namespace {

// [corner] 1: belongs to a point of a parent element of the given points, or is a copy of such a corner
IntVec corners_of_parents(const Points& pts, const IntVec& which)
{
  IntVec name(pts.ncorner, 0), mark;
  for (int p : which)
    for (int q = pts.of_elem[pts.parent[p]]; q < pts.npoint && pts.parent[q] == pts.parent[p]; ++q)
      for (int k = pts.conn.off[q]; k < pts.conn.off[q + 1]; ++k) name[pts.first_copy[pts.conn.item[k]]] = 1;
  for (int c = 0; c < pts.ncorner; ++c) mark.push_back(name[pts.first_copy[c]]);
  return mark;
}

}  // namespace

void point_release(const IntVec& which, int dim, Points& pts, ListTable& left)
{
  const IntVec taken = corners_of_parents(pts, which);
  pts.unshared_since.resize(pts.ncorner, 0);
  for (int c = 0; c < pts.ncorner; ++c)
    if (taken[c] && pts.unshared_since[c] == 0) pts.unshared_since[c] = pts.npoint_all();
  for (int p : which) {
    for (int k = pts.conn.off[p]; k < pts.conn.off[p + 1]; ++k) {
      for (int i = 0; i < dim; ++i) pts.Xc.push_back(pts.Xc[pts.conn.item[k] * dim + i]);
      pts.field.push_back(FIELD_OWN);
      pts.first_copy.push_back(pts.ncorner);
      pts.hang.off.push_back(pts.hang.off.back());
      left.item.push_back(pts.conn.item[k]);
      pts.conn.item[k] = pts.ncorner++;
    }
    left.off.push_back(static_cast<int>(left.item.size()));
    pts.released[p] = 1;
  }
}

bool point_any_released(const Points& pts, int e)
{
  for (int p = pts.of_elem[e]; p < pts.npoint && pts.parent[p] == e; ++p)
    if (pts.released[p]) return true;
  return false;
}
