#include <algorithm>

#include "shape/shape.h"

namespace {

const double tolerance = 1e-6;    // of the natural coordinates: a point on the boundary is inside

// margin_part: of the size; the edges of a quadratic shape may extend beyond its nodes
bool in_box(const double* X, int nen, int dim, double margin_part, const double x[3])
{
  for (int i = 0; i < dim; ++i) {
    double lo = X[i], hi = X[i];
    for (int a = 1; a < nen; ++a) {
      lo = std::min(lo, X[a * dim + i]);
      hi = std::max(hi, X[a * dim + i]);
    }
    const double margin = margin_part * (hi - lo);
    if (x[i] < lo - margin || x[i] > hi + margin) return false;
  }
  return true;
}

}  // namespace

bool shape_locate(Shape shape, const double* X, const double x[3], double xi[3])
{
  const ShapeInfo& info = shape_info[shape];
  if (!in_box(X, info.nen, info.dim, shape_quadratic(shape) ? 0.5 : tolerance, x)) return false;
  return shape_inverse(shape, X, x, xi) && shape_inside(shape, xi, tolerance);
}
