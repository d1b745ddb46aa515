#include <algorithm>
#include <cmath>
#include <map>

#include "base/comm.h"
#include "base/forest.h"
#include "base/log.h"
#include "model/model_cut.h"
#include "step/step.h"

namespace {

// Nodes connected by intact elements, with supports and loads
struct Piece {
  bool fixed[3] = {false, false, false};      // supported, by a support, a bond or contact
  double load[3] = {0, 0, 0};
  double rest[3] = {0, 0, 0};  // carried by the STIFFNESS of broken elements
};

double size(const double* v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

// nodes of an intact element form a piece; a node of broken elements only is a piece of its own
IntVec find_pieces(const Mesh& mesh, const MeshPart& part, const Elements& el, const Fracture& fr)
{
  Forest pieces(mesh.nnode());
  for (const ElemBlock& b : el.block)
    for (int slot : b.live) {
      const int e = b.elem[slot], *node = mesh.conn.begin(e);
      if (fr.broken[e] >= 0) continue;
      for (int a = 1; a < mesh.conn.count(e); ++a) pieces.join(node[a], node[0]);
    }
  for (int n = 0; n < mesh.nnode(); ++n) pieces.up[n] = pieces.root(n);
  if (part.on) model_join_ranks(part, PointPart(), Halo(), pieces.up);
  return pieces.up;
}

void find_supports(const Bonds& b, const Dofs& dofs, const IntVec& root, std::map<int, Piece>& piece)
{
  const int dim = dofs.rows.dim;
  for (int r = 0; r < dofs.rows.nfe; ++r)
    for (int i = 0; i < dim; ++i)
      if (dofs.bound.fixed[r * dim + i]) piece[root[dofs.rows.node_of_row[r]]].fixed[i] = true;
  const int nnode = static_cast<int>(root.size());
  for (int item : b.a.item)
    for (int i = 0; i < dim && item < nnode; ++i) piece[root[item]].fixed[i] = true;
}

// force of broken elements less their force without STIFFNESS
void add_rest(const Model& m, const Elements& el, const State& st, const Step& s, const IntVec& root,
              std::map<int, Piece>& piece)
{
  const int dim = m.dim;
  KernelMode mode;
  mode.finite = s.nlgeom;
  mode.is_static = true;
  double u[3 * MAX_NODES], with[3 * MAX_NODES], without[3 * MAX_NODES];
  for (const ElemBlock& b : el.block)
    for (int slot : b.live) {
      const int e = b.elem[slot], nen = shape_info[b.shape].nen, *node = m.mesh.conn.begin(e);
      if (st.frac.broken[e] < 0) continue;
      for (int k = 0; k < nen * dim; ++k) u[k] = st.n.u[node[k / dim] * dim + k % dim];
      const MatLaw law  = elem_law(m, el, b, slot, st.n.degr[e]);
      const MatLaw bare = elem_law(m, el, b, slot, 0.0);
      double scratch[MAX_GAUSS * MAX_HISTORY];
      HistoryStep h[MAX_GAUSS];
      for (int g = 0; g < shape_info[b.shape].ngp; ++g)
        h[g] = {history_at(st.n.he, el.history, el.gauss_of[e] + g), scratch + g * MAX_HISTORY};
      elem_form_general(b, slot, law, mode, u, u, h, with, nullptr);
      elem_form_general(b, slot, bare, mode, u, u, h, without, nullptr);
      for (int k = 0; k < nen * dim; ++k) piece[root[node[k / dim]]].rest[k % dim] += with[k] - without[k];
    }
}

bool breaks(const Fracture& fr, const MeshPart& part)
{
  const bool here = std::any_of(fr.broken.begin(), fr.broken.end(), [](int def) { return def >= 0; });
  return part.on ? comm_allreduce_max(static_cast<int>(here)) > 0 : here;
}

// divided model: the pieces of all ranks
void gather_pieces(std::map<int, Piece>& piece)
{
  struct Named { int name; Piece piece; };
  std::vector<Named> all;
  for (const auto& x : piece) all.push_back({x.first, x.second});
  comm_allgatherv(all);
  piece.clear();
  for (const Named& x : all) {
    Piece& to = piece[x.name];
    for (int i = 0; i < 3; ++i) {
      to.fixed[i] = to.fixed[i] || x.piece.fixed[i];
      to.load[i] += x.piece.load[i];
      to.rest[i] += x.piece.rest[i];
    }
  }
}

// part of the toughness of all open broken elements that their residual stiffness stores, above which to warn
// (test: fracture/dcb_rotations)
const double BRIDGED = 0.01;

}  // namespace

void step_warn_bridged(const Model& m, const Discretisation& d, const State& st, const Step& s,
                       Warned& warned)
{
  double sum[2] = {0.0, 0.0};                        // energy stored by c psi+, energy of the crack
  for (const ElemBlock& b : d.el.block)
    for (int slot : b.live) {
      const int e = b.elem[slot];
      if (st.frac.broken[e] < 0 || !m.part.works(e)) continue;
      const FractureDef& f = m.fracture[st.frac.broken[e]];
      if (f.criterion == CRITERION_COHESIVE || st.n.degr[e] > f.stiffness) continue;
      sum[0] += elem_energy_one(m, d.el, e, st.n, f.stiffness, s.nlgeom) -
                elem_energy_one(m, d.el, e, st.n, 0.0, s.nlgeom);
      sum[1] += d.fm.gc[e] * (m.dim == 2 ? d.fm.size[e] * d.fm.thickness[e] : d.fm.size[e] * d.fm.size[e]);
    }
  comm_sum(sum, 2);
  if (sum[0] <= BRIDGED * sum[1] || !warned.insert("bridged " + std::to_string(st.log.step)).second) return;
  log_warn("step %d, time %.8g: the residual stiffness of open cracks (STIFFNESS of *EIGENFRACTURE) stores "
           "%.2g %% of the energy that broke their elements: it holds the crack together, and loads are too "
           "large; take a smaller STIFFNESS, for instance 1e-10, or *CONVERSION",
           st.log.step, st.n.time, 100.0 * sum[0] / sum[1]);
}

void step_warn_loose(const Model& m, const Discretisation& d, const Dofs& dofs, const State& st,
                     const Step& s, Warned& warned)
{
  if (s.proc != PROC_STATIC || st.points.npoint_all() || !breaks(st.frac, m.part))
    return;
  const bool numbered = dofs.bound.fixed.size() == static_cast<size_t>(dofs.rows.neq());
  if (comm_allreduce_max(!numbered)) return;
  RealVec f;
  const LoadTime now{st.n.time - st.clock.start, st.n.time, 1.0};
  if (!assem_loads(m, d, dofs, st, s, now, warned, f).ok()) return;
  const IntVec root = find_pieces(m.mesh, m.part, d.el, st.frac);
  std::map<int, Piece> piece;
  find_supports(st.bonds, dofs, root, piece);
  for (int r = 0; r < dofs.rows.nfe; ++r)
    for (int i = 0; i < m.dim && dofs.rows.counts(r * m.dim); ++i)
      piece[root[dofs.rows.node_of_row[r]]].load[i] += f[r * m.dim + i];
  add_rest(m, d.el, st, s, root, piece);
  if (m.part.on) gather_pieces(piece);
  double all = 0.0, rest = 0.0;
  for (const auto& x : piece) {
    const Piece& q = x.second;
    double load[3], borne = 0.0;
    for (int i = 0; i < 3; ++i) {
      load[i] = q.fixed[i] ? 0.0 : q.load[i];
      borne += load[i] * q.rest[i];
    }
    all += size(q.load);
    if (size(load) > 0.0) rest += borne / size(load);
  }
  if (rest <= 0.01 * all || !warned.insert("remainder " + std::to_string(st.log.step)).second) return;
  log_warn("step %d, time %.8g: %.0f %% of the loads act on pieces without an intact connection to a "
           "support; the residual stiffness of broken elements (STIFFNESS) alone carries them, and the "
           "displacements are meaningless: end the step earlier, or prescribe displacements",
           st.log.step, st.n.time, 100.0 * rest / all);
}
