#include <cmath>
#include <limits>

#include "out/out.h"

// ---------------------------------------------------------------------------
// elem_nodal_at : displacement, velocity, acceleration or position inside an element
//
//   in   N      shape functions there          [nen]
// ---------------------------------------------------------------------------
double elem_nodal_at(const Model& m, const Level& level, const Quantity& q, int e, const double* N)
{
  double value = 0.0;
  for (int a = 0; a < m.mesh.conn.count(e); ++a)
    value += N[a] * q.node(m, level, m.mesh.conn.begin(e)[a], q.comp);
  return value;
}

// ---------------------------------------------------------------------------
// point_nodal_at : the same inside the domain of a material point
//
//   in   N      weights of its corners         [corners of the point]
// ---------------------------------------------------------------------------
double point_nodal_at(const Model& m, const Points& pts, const Level& level, const Quantity& q, int p,
                      const double* N)
{
  if (!q.corner) return std::numeric_limits<double>::quiet_NaN();
  double value = 0.0;
  for (int a = 0; a < pts.conn.count(p); ++a)
    value += N[a] * q.corner(pts, level, m.dim, pts.conn.begin(p)[a], q.comp);
  return value;
}

int elem_gauss(const Model& m, const Elements& el, int e)
{
  if (el.block_of[e] < 0) return 0;
  return shape_info[elem_table[m.mesh.elem_type[e]].shape].ngp;
}

bool out_interval(double interval, double time, double& next)
{
  if (interval <= 0.0 || time < next - 1e-6 * interval) return false;
  next = interval * (std::floor(time / interval + 1e-6) + 1.0);
  return true;
}

bool out_nlgeom(const Model& m, const State& s)
{
  if (m.step.empty()) return false;
  const int step = s.log.step > 0 ? s.log.step - 1 : 0;
  return m.step[step].nlgeom;
}
