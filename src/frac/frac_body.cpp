#include <algorithm>
#include <cmath>

#include "frac/frac_scan.h"
#include "shape/shape.h"

// Body forces in the energy release                                                            (7.5c)

namespace {

bool has_body_forces(const Scan& s)
{
  return std::any_of(s.step.load.begin(), s.step.load.end(), [](const Load& l) { return l.kind == LOAD_BODY; });
}

// body force at the centre of an element [3]                                           force/volume
const double* body_force(const Scan& s, int e)
{
  if (s.body.empty()) s.body.assign(4 * s.fm.size.size(), 0.0);
  double* b = &s.body[4 * static_cast<size_t>(e)];
  if (b[3] > 0.0) return b;
  b[3] = 1.0;
  for (const Load& l : s.step.load) {
    if (l.kind != LOAD_BODY || !std::binary_search(l.elem.begin(), l.elem.end(), e)) continue;
    const double value = load_value(s.m, s.step, l, &s.fm.centre[3 * e], s.l.time - s.start, s.l.time);
    const double per   = l.per_mass ? s.el.block[s.el.initial_block[e]].density : 1.0;
    for (int i = 0; i < s.m.dim; ++i) b[i] += value * per * l.dir[i];
  }
  return b;
}

// J -= int q H^T b dV of an intact element
template <int D>
void take_body_of(const Scan& s, int e, const double* q, const double* body, double* J)
{
  const ElemBlock& b    = s.el.block[s.el.initial_block[e]];
  const ShapeInfo& info = shape_info[b.shape];
  const int nen = info.nen, *node = s.m.mesh.conn.begin(e);
  double u[24], H[D * D], X[3], N[MAX_NODES];
  for (int a = 0; a < nen; ++a)
    for (int i = 0; i < D; ++i) u[a * D + i] = s.l.u[static_cast<size_t>(node[a]) * D + i];
  for (int g = 0; g < info.ngp; ++g) {
    const double dV = elem_gauss_position(s.m, s.el, e, g, X, N);
    double weight   = 0.0;
    for (int a = 0; a < nen; ++a) weight += N[a] * q[a];
    ip_gradient<D, 0>(&b.dNdX[(b.gauss(s.el.slot_of[e]) + g) * nen * D], nen, u, H);
    for (int k = 0; k < D; ++k)
      for (int i = 0; i < D; ++i) J[k] -= dV * weight * H[i * D + k] * body[i];
  }
}

}  // namespace

void take_body(const Scan& s, int e, double radius, double* J)
{
  if (!has_body_forces(s)) return;
  const double* c = &s.fm.centre[3 * e];
  frac_in_ball(s.fm, c, radius + 1.5 * s.fm.local[e], [&](int o, double) {
    if (!s.intact(o)) return;
    const int n = s.m.mesh.conn.count(o), *node = s.m.mesh.conn.begin(o);
    double q[MAX_NODES], sum = 0.0;
    for (int a = 0; a < n; ++a) sum += q[a] = weight_of(s, node[a], c, radius);
    if (sum > 0.0) (s.m.dim == 2 ? take_body_of<2> : take_body_of<3>)(s, o, q, body_force(s, o), J);
  });
}

bool body_at(const Scan& s, int node, double* intact, double* broken)
{
  std::fill_n(intact, 3, 0.0);
  std::fill_n(broken, 3, 0.0);
  if (!has_body_forces(s)) return false;
  for (int k = 0; k < s.fm.of_node.count(node); ++k) {
    const int e = s.fm.of_node.begin(node)[k];
    if (s.el.block_of[e] < 0) continue;              // no longer an element
    const int nen = s.m.mesh.conn.count(e), *conn = s.m.mesh.conn.begin(e);
    const int at  = static_cast<int>(std::find(conn, conn + nen, node) - conn);
    const double* b = body_force(s, e);
    double X[3], N[MAX_NODES], part = 0.0;
    for (int g = 0; g < shape_info[s.el.block[s.el.initial_block[e]].shape].ngp; ++g) {
      const double dV = elem_gauss_position(s.m, s.el, e, g, X, N);
      part += dV * N[at];
    }
    for (int i = 0; i < 3; ++i) (s.intact(e) ? intact : broken)[i] += part * b[i];
  }
  return true;
}
