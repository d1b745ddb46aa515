#include "step/step.h"

namespace {

template <class T>
double bytes(const std::vector<T>& v) { return static_cast<double>(v.capacity() * sizeof(T)); }

double bytes(const ListTable& t) { return bytes(t.off) + bytes(t.item); }

double bytes(const Level& l)
{
  return bytes(l.u) + bytes(l.v) + bytes(l.a) + bytes(l.uc) + bytes(l.vc) + bytes(l.he) +
         bytes(l.hp) + bytes(l.slip) + bytes(l.lambda) + bytes(l.lambda_n);
}

}  // namespace

void step_memory(const Problem& p, std::vector<MemoryUse>& out)
{
  const Dofs& s = p.dofs;
  const Mesh& mesh = p.m.mesh;
  double elements = bytes(p.d.el.block_of) + bytes(p.d.el.slot_of) + bytes(p.d.el.initial_block);
  for (const ElemBlock& b : p.d.el.block)
    elements += bytes(b.elem) + bytes(b.live) + bytes(b.kind) + bytes(b.dNdX) + bytes(b.w) + bytes(b.eas) +
                bytes(b.me);
  const Points& q = p.st.points;
  out.clear();
  out.push_back({"matrix", bytes(s.pattern.A.val) + bytes(s.pattern.A.col) + bytes(s.pattern.A.off)});
  if (!s.pattern.whole.empty()) out.push_back({"part of the matrix that is kept", bytes(s.pattern.whole)});
  const Motion& h = p.newton.motion;
  double motion   = bytes(h.du) + bytes(h.fint);
  for (int k = 0; k < Motion::ORDERS; ++k) motion += bytes(h.node[k]) + bytes(h.grid[k]);
  for (const RealVec& v : p.newton.spare) motion += bytes(v);
  if (motion > 0.0) out.push_back({"predictor, vectors of Newton", motion});
  out.push_back({"mass", bytes(s.mass.M)});
  if (!s.mass.C.empty()) out.push_back({"damping", bytes(s.mass.C)});
  out.push_back({"positions in the matrix", bytes(s.pattern.elem_map) + bytes(s.pattern.point_map) +
      bytes(s.pattern.bond_map) +
                                             bytes(s.pattern.ghost_map) + bytes(s.pattern.point_map_off) +
                                             bytes(s.pattern.bond_map_off)});
  solve_memory(p.newton.solver, out);
  out.push_back({"elements", elements});
  out.push_back({"mesh", bytes(mesh.X) + bytes(mesh.conn) + bytes(mesh.node_label) + bytes(mesh.elem_label) +
                             bytes(mesh.elem_type) + bytes(mesh.elem_section)});
  out.push_back({"points and grid", bytes(q.Xc) + bytes(q.kinds.number) + bytes(q.kind) + bytes(q.conn) +
                                        bytes(p.d.grid.point) + bytes(p.d.grid.dS) + bytes(p.d.grid.corner) +
                                        bytes(p.d.grid.corner_w) + bytes(p.d.grid.slot) +
                                        bytes(s.mass.corner_mass.col) + bytes(s.mass.corner_mass.val)});
  out.push_back({"state", bytes(p.st.n) + bytes(p.st.np1)});
}
