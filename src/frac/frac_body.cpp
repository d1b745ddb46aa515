#include <algorithm>
#include <cmath>

#include "frac/frac_scan.h"
#include "shape/shape.h"

// Body forces in the energy release                                                            (7.5c)

namespace {

const double* body_force(const Scan& s, int e) { return &s.body[3 * static_cast<size_t>(e)]; }

template <int D>
void take_body_of(const Scan& s, int e, const double* q, double* J)
{
  const double* body    = body_force(s, e);
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

// at the centres; those of halo elements from their owners
void find_body(Scan& s)
{
  const auto of_body = [](const Load& l) { return l.kind == LOAD_BODY; };
  if (std::none_of(s.step.load.begin(), s.step.load.end(), of_body)) return;
  const size_t nelem = s.fm.size.size();
  s.body.assign(3 * nelem, 0.0);
  for (const Load& l : s.step.load) {
    if (l.kind != LOAD_BODY) continue;
    for (int e : l.elem) {
      if (s.el.initial_block[e] < 0) continue;
      const double value = load_value(s.m, s.step, l, &s.fm.centre[3 * e], s.l.time - s.start, s.l.time);
      const double per   = l.per_mass ? s.el.block[s.el.initial_block[e]].density : 1.0;
      for (int i = 0; i < s.m.dim; ++i) s.body[3 * static_cast<size_t>(e) + i] += value * per * l.dir[i];
    }
  }
  for (int i = 0; s.m.part.on && i < s.m.dim; ++i) {
    RealVec one(nelem);
    for (size_t e = 0; e < nelem; ++e) one[e] = s.body[3 * e + i];
    frac_share(s.m.part, one);
    for (size_t e = 0; e < nelem; ++e) s.body[3 * e + i] = one[e];
  }
}

void take_body(const Scan& s, int e, const double* q, double* J)
{
  if (s.body.empty()) return;
  (s.m.dim == 2 ? take_body_of<2> : take_body_of<3>)(s, e, q, J);
}

bool body_at(const Scan& s, int node, double* intact, double* broken)
{
  std::fill_n(intact, 3, 0.0);
  std::fill_n(broken, 3, 0.0);
  if (s.body.empty()) return false;
  for (int k = 0; k < s.fm.of_node.count(node); ++k) {
    const int e = s.fm.of_node.begin(node)[k];
    if (s.fr.phase[e] != AS_ELEMENT || s.el.initial_block[e] < 0) continue;
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
