#include "out/out.h"
#include "shape/shape.h"

namespace {

void add(Located& found, IntVec& list, int item, Shape shape, const double xi[3])
{
  list.push_back(item);
  double N[MAX_NODES] = {};
  shape_eval(shape, xi, N, nullptr);
  found.N.insert(found.N.end(), N, N + MAX_NODES);
}

void search_elements(const Model& m, const Elements& el, const double x[3], Located& found)
{
  for (int e = 0; e < m.mesh.nelem(); ++e) {
    if (el.block_of[e] < 0) continue;
    const Shape shape = elem_table[m.mesh.elem_type[e]].shape;
    double X[3 * MAX_NODES], xi[3] = {0, 0, 0};
    for (int a = 0; a < m.mesh.conn.count(e); ++a)
      for (int i = 0; i < m.dim; ++i) X[a * m.dim + i] = m.mesh.X[m.mesh.conn.begin(e)[a] * 3 + i];
    if (shape_locate(shape, X, x, xi)) add(found, found.elem, e, shape, xi);
  }
}

void search_points(const Model& m, const Points& pts, const double x[3], Located& found)
{
  for (int p = 0; p < pts.npoint; ++p) {
    if (!point_counts(m, pts, p)) continue;
    const Shape shape = static_cast<Shape>(pts.shape[p]);
    double X[24], xi[3] = {0, 0, 0};
    for (int a = 0; a < pts.conn.count(p); ++a)
      for (int i = 0; i < m.dim; ++i) X[a * m.dim + i] = pts.Xc[pts.conn.begin(p)[a] * m.dim + i];
    if (shape_locate(shape, X, x, xi)) add(found, found.point, p, shape, xi);
  }
}

}  // namespace

// ---------------------------------------------------------------------------
// out_locate : every element, or else every point, whose domain at t = 0 contains x.
// On a common edge there are several, in a divided model on several ranks; the caller takes their mean.
// ---------------------------------------------------------------------------
Located out_locate(const Model& m, const Elements& el, const Points& pts, const double x[3])
{
  Located found;
  search_elements(m, el, x, found);
  double elements = static_cast<double>(found.elem.size());
  out_max(m, &elements, 1);
  if (elements == 0.0) search_points(m, pts, x, found);
  return found;
}
