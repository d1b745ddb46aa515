#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include <Eigen/Core>

#include "assem/assem.h"
#include "assem/pack_list.h"
#include "base/comm.h"
#include "base/halo_numbers.h"
#include "base/timer.h"
#include "shape/face.h"

namespace {

// the components of a value at a corner or a node, in one vector register
template <int D>
using Dirs = Eigen::Array<double, D, 1>;

// f [grid nodes][D] += sum_c N_v(x_c) f_c
template <int D>
void scatter_corners(const ActiveGrid& g, const double* fc, double* f)
{
  const int *off = g.corner.off.data(), *item = g.corner.item.data(), ncorner = g.corner.size();
  const double* w = g.corner_w.data();
  for (int c = 0; c < ncorner; ++c) {
    const Dirs<D> of_corner = Eigen::Map<const Dirs<D>>(fc + static_cast<size_t>(c) * D);
    if ((of_corner == 0.0).all()) continue;          // most loads act on a few corners
    for (int k = off[c], end = off[c + 1]; k < end; ++k)
      Eigen::Map<Dirs<D>>(f + static_cast<long>(item[k]) * D) += w[k] * of_corner;
  }
}

// after_c = before_c + sum_v N_v(x_c) x_v, x [grid nodes][D]
template <int D>
void gather_corners(const ActiveGrid& g, const double* x, const double* before, double* after)
{
  const int *off = g.corner.off.data(), *item = g.corner.item.data(), ncorner = g.corner.size();
  const double* w = g.corner_w.data();
  for (int c = 0; c < ncorner; ++c) {
    Dirs<D> sum = Dirs<D>::Zero();
    for (int k = off[c], end = off[c + 1]; k < end; ++k)
      sum += w[k] * Eigen::Map<const Dirs<D>>(x + static_cast<long>(item[k]) * D);
    const size_t at = static_cast<size_t>(c) * D;
    Eigen::Map<Dirs<D>>(after + at) = Eigen::Map<const Dirs<D>>(before + at) + sum;
  }
}

template <int D>
void move_nodes(const Dofs& dofs, const RealVec& du, State& st)
{
  const double *u0 = st.n.u.data(), *d = du.data();
  double* u = st.np1.u.data();
  for (int r = 0; r < dofs.rows.nfe; ++r) {
    const int k = dofs.rows.node_of_row[r] * D;
    for (int i = 0; i < D; ++i) u[k + i] = u0[k + i] + d[r * D + i];
  }
}

bool has_grounds(const Model& m)
{
  return std::any_of(m.bond.begin(), m.bond.end(), [](const BondDef& d) { return d.kind == BOND_GROUND; });
}

// BAD_VALUE if the motion g of the ground under bond b is not finite
Failure check_ground(const Model& m, const Bonds& bonds, int b, const double* g, double time)
{
  const BondDef& d = m.bond[bonds.def[b]];
  for (int i = 0; i < m.dim; ++i) {
    if (std::isfinite(g[i])) continue;
    return {BAD_VALUE, value_text(m, "BOND", d.deck_line, d.motion[i], d.amplitude,
                                  "the ground of bond " + d.name, &bonds.X[3 * b], time)};
  }
  return STATUS_OK;
}

Failure move_bonds(const Model& m, const Dofs& dofs, const RealVec& du, double t0, double t1, State& st,
                   Jumps& j)
{
  const int dim = m.dim;
  j.contact.resize(static_cast<size_t>(st.bonds.nbond) * dim);
  const double total0 = st.n.time, total1 = st.n.time + (t1 - t0);
  for (int b : dofs.rows.bond_acts) {
    double s[3] = {0, 0, 0}, g0[3], g1[3];
    for (int k = dofs.rows.bond.off[b]; k < dofs.rows.bond.off[b + 1]; ++k)
      for (int i = 0; i < dim; ++i) s[i] += dofs.rows.bond_w[k] * du[dofs.rows.bond.item[k] * dim + i];
    // contact: jump over the increment; the gap follows with the force
    if (st.bonds.side[b] == SIDE_CONTACT) {
      for (int i = 0; i < dim; ++i) j.contact[b * dim + i] = s[i];
      continue;
    }
    if (st.bonds.side[b] == SIDE_GROUND) {
      bond_ground_motion(m, st.bonds, b, t0, total0, g0);
      bond_ground_motion(m, st.bonds, b, t1, total1, g1);
      Failure failure = check_ground(m, st.bonds, b, g0, total0);
      if (failure.ok()) failure = check_ground(m, st.bonds, b, g1, total1);
      if (!failure.ok()) return failure;
      for (int i = 0; i < dim; ++i) s[i] -= g1[i] - g0[i];
    }
    for (int i = 0; i < dim; ++i) st.np1.slip[b * dim + i] = st.n.slip[b * dim + i] + s[i];
  }
  return STATUS_OK;
}

// adds the force re of an element
inline void add_force(const Dofs& dofs, const int* node, int nen, int dim, const double* re, RealVec& fint)
{
  for (int a = 0; a < nen; ++a) {
    double* f = &fint[dofs.rows.row_of_node[node[a]] * dim];
    for (int i = 0; i < dim; ++i) f[i] += re[a * dim + i];
  }
}

typedef double Two __attribute__((vector_size(16), aligned(8), may_alias));

// adds the forces re [N*D] of the first n elements of a pack
template <int D, int N>
inline void add_force_pack(const Mesh& mesh, const Dofs& dofs, const ElemBlock& b, const int* slot, int n,
                           Pack* re, RealVec& fint)
{
  constexpr int whole = N * D / PACK * PACK;
  for (int k = 0; k < whole; k += PACK) pack_turn(re + k);
  const double* r = reinterpret_cast<const double*>(re);
  for (int l = 0; l < n; ++l) {
    const int* node = elem_nodes(mesh, b, slot[l]);
    for (int a = 0; a < N; ++a) {
      double* f = &fint[dofs.rows.row_of_node[node[a]] * D];
      if (D == 2 && PACK > 2 && a * D < whole) {
        const int k = a * D;
        const double* from = r + (k / PACK * PACK + l) * PACK + k % PACK;
        *reinterpret_cast<Two*>(f) += *reinterpret_cast<const Two*>(from);
        continue;
      }
      for (int i = 0, k = a * D; i < D; ++i, ++k)
        f[i] += k < whole ? r[(k / PACK * PACK + l) * PACK + k % PACK] : r[k * PACK + l];
    }
  }
}

// force of elements of a pack in which a crack may begin to open, by their law
template <int N>
Status open_cracks(const Model& m, const Elements& el, const KernelMode& mode, const ElemBlock& b,
                   const PackList& w, unsigned opens, State& st, Pack* re, double* psi)
{
  Status status = STATUS_OK;
  double one[N];
  for (int l = 0; l < w.n; ++l) {
    if (!(opens & 1u << l)) {
      elem_uncracked(el, st.n, st.np1, b.elem[w.slot[l]]);
      continue;
    }
    const Status s = elem_form_one(m, el, mode, b, w.slot[l], nullptr, st.n, st.np1, one, nullptr);
    if (s != STATUS_OK) status = s;
    for (int k = 0; k < N; ++k) re[k][l] = one[k];
    if (psi) psi[l] = elem_energy_one(m, el, b.elem[w.slot[l]], st.np1, 1.0, mode.finite);
  }
  return status;
}

template <int D, int N>
Failure add_pack(const Model& m, const Elements& el, State& st, const Dofs& dofs, const KernelMode& mode,
                 const ElemBlock& b, ElemFormPack form, PackList& w, RealVec& fint, RealVec* energy)
{
  const Mesh& mesh = m.mesh;
  if (w.n == 0) return STATUS_OK;
  const bool bulk = mode.bulk && !mode.mid;
  Pack u0[N * D], u1[N * D], re[N * D];
  double psi[PACK];
  const auto numbers = [](Pack* x) { return reinterpret_cast<double*>(x); };
  unsigned bad, opens;
  w.fill();
  if (bulk || mode_reads_old(mode, b.law)) elem_ends_pack(st.n.u, mesh, b, w.slot, N, D, numbers(u0));
  elem_ends_pack(st.np1.u, mesh, b, w.slot, N, D, numbers(u1));
  const Status status = form(b, w.slot, mode, numbers(u0), numbers(u1), numbers(re), nullptr, bad,
                             energy ? psi : nullptr, b.opens() ? &opens : nullptr);
  const Status cracks =
      b.opens() ? open_cracks<N * D>(m, el, mode, b, w, opens, st, re, energy ? psi : nullptr) : STATUS_OK;
  if (bulk)
    elem_bulk_pack(b)(b, w.slot, w.n, numbers(u0), numbers(u1), mode.finite, st.n.q, st.np1.q, *mode.bulk,
                      numbers(re));
  add_force_pack<D, N>(mesh, dofs, b, w.slot, w.n, re, fint);
  for (int l = 0; l < w.n && energy; ++l) (*energy)[b.elem[w.slot[l]]] = psi[l];
  w.n = 0;
  if (cracks != STATUS_OK) return {BAD_JACOBIAN, AT_ELEMENT, b.elem[w.slot[0]]};
  if (status == STATUS_OK) return STATUS_OK;
  return {BAD_JACOBIAN, AT_ELEMENT, b.elem[w.slot[__builtin_ctz(bad)]]};
}

// bulk viscosity of an intact element that is not in a pack; what a crack with cohesion opens has none, and
// loses that of t(n)
template <int D, int N>
void add_bulk(const Mesh& mesh, const Dofs& dofs, const KernelMode& mode, const ElemBlock& b, int slot,
              bool opens, State& st, RealVec& fint)
{
  const double before = st.n.q[b.elem[slot]];
  if (opens && before == 0.0) {
    st.np1.q[b.elem[slot]] = 0.0;
    return;
  }
  BulkStep& k = *mode.bulk;
  BulkStep none = k;
  none.linear = none.quadratic = 0.0;
  Pack u0[N * D], u1[N * D], re[N * D] = {};
  const auto numbers = [](Pack* x) { return reinterpret_cast<double*>(x); };
  PackList w;
  w.add(slot);
  w.fill();
  elem_ends_pack(st.n.u, mesh, b, w.slot, N, D, numbers(u0));
  elem_ends_pack(st.np1.u, mesh, b, w.slot, N, D, numbers(u1));
  elem_bulk_pack(b)(b, w.slot, 1, numbers(u0), numbers(u1), mode.finite, st.n.q, st.np1.q, opens ? none : k,
                    numbers(re));
  k.loss = opens ? none.loss : k.loss;
  add_force_pack<D, N>(mesh, dofs, b, w.slot, 1, re, fint);
}

template <int D, int N>
void add_block(const Model& m, const Elements& el, const Dofs& dofs, const KernelMode& mode,
               const ElemBlock& b, State& st, RealVec& fint, RealVec* energy, Failure& failure)
{
  const Mesh& mesh        = m.mesh;
  const ElemForm form     = elem_form(b);
  const ElemFormPack pack = pack_of(b, mode);
  double re[N * D];
  PackList w;
  const auto flush = [&] {
    const Failure f = add_pack<D, N>(m, el, st, dofs, mode, b, pack, w, fint, energy);
    if (!f.ok()) failure = f;
  };
  for (int slot : b.live) {
    const int e = b.elem[slot];
    if (!el.rigid.empty() && el.rigid[e]) continue;
    if (pack && elem_whole(el, st.n, e)) {
      if (w.add(slot)) flush();
      continue;
    }
    if (elem_form_one(m, el, mode, b, slot, form, st.n, st.np1, re, nullptr) != STATUS_OK)
      failure = {BAD_JACOBIAN, AT_ELEMENT, e};
    add_force(dofs, elem_nodes(mesh, b, slot), N, D, re, fint);
    if (energy && el.broken(e) < 0) (*energy)[e] = elem_energy_one(m, el, e, st.np1, 1.0, mode.finite);
    if (mode.bulk && !mode.mid && el.broken(e) < 0)
      add_bulk<D, N>(mesh, dofs, mode, b, slot, elem_cracked(st.n, e), st, fint);
  }
  flush();
}

// bulk viscosity of the energy-momentum scheme                                     (6.49)
void add_bulk_mid(const Mesh& mesh, const Elements& el, const Dofs& dofs, const KernelMode& mode,
                  const State& st, RealVec& fint)
{
  double re[MAX_NODES * 3], loss;
  for (const ElemBlock& b : el.block)
    for (int slot : b.live)
      if (elem_bulk_mid(mesh, el, b, slot, st.n, st.np1, mode.finite, *mode.bulk, re, nullptr, loss))
        add_force(dofs, elem_nodes(mesh, b, slot), shape_info[b.shape].nen, dofs.rows.dim, re, fint);
}

Failure add_elements(const Model& m, const Elements& el, const Dofs& dofs, const KernelMode& mode, State& st,
                     RealVec& fint, RealVec* energy)
{
  Failure failure;             // the last one
  if (mode.bulk && mode.mid) add_bulk_mid(m.mesh, el, dofs, mode, st, fint);
  for (const ElemBlock& b : el.block)
    by_shape(b.shape, [&](auto z) { add_block<z.D, z.N>(m, el, dofs, mode, b, st, fint, energy, failure); });
  return failure;
}

// force f of a contact bond that meets a face; stores gap and friction at t(n+1)
void contact_state(const Model& m, const ContactPairs& pairs, const KernelMode& mode, const Jumps& j, int b,
                   State& st, double* f)
{
  const int dim = m.dim;
  double t1[3], slipped;
  st.np1.slip[b * dim] = contact_force(m, st.bonds, pairs, b, mode, &j.contact[b * dim],
                                       &st.n.lambda[b * dim], st.np1.lambda_n[b], f, nullptr, t1, &slipped);
  for (int i = 0; i < dim; ++i) st.np1.lambda[b * dim + i] = t1[i];
}

void add_contact(const Model& m, const ContactPairs& pairs, const Dofs& dofs, const KernelMode& mode,
                 const Jumps& j, int b, State& st, RealVec& fint)
{
  const int dim = m.dim;
  double f[3];
  contact_state(m, pairs, mode, j, b, st, f);
  for (int k = dofs.rows.bond.off[b]; k < dofs.rows.bond.off[b + 1]; ++k)
    for (int i = 0; i < dim; ++i) fint[dofs.rows.bond.item[k] * dim + i] += dofs.rows.bond_w[k] * f[i];
}

// f = lambda + C s, s averaged in time as the stress                               (4.2)
void add_bonds(const Model& m, const ContactPairs& pairs, const Dofs& dofs, const KernelMode& mode,
               const Jumps& jumps, State& st, RealVec& fint)
{
  const int dim = m.dim;
  double C[9], s[3];
  for (int b : dofs.rows.bond_acts) {
    if (st.bonds.side[b] == SIDE_CONTACT) {
      add_contact(m, pairs, dofs, mode, jumps, b, st, fint);
      continue;
    }
    bond_stiffness(st.bonds, dim, b, C);
    for (int i = 0; i < dim; ++i)
      s[i] = mode.s_new * st.np1.slip[b * dim + i] + mode.s_old * st.n.slip[b * dim + i];
    for (int i = 0; i < dim; ++i) {
      double f = st.np1.lambda[b * dim + i];
      for (int j = 0; j < dim; ++j) f += C[i * dim + j] * s[j];
      for (int k = dofs.rows.bond.off[b]; k < dofs.rows.bond.off[b + 1]; ++k)
        fint[dofs.rows.bond.item[k] * dim + i] += dofs.rows.bond_w[k] * f;
    }
  }
}

void add_ghosts(const ActiveGrid& grid, const Dofs& dofs, const Jumps& j, RealVec& fint)
{
  const int dim      = dofs.rows.dim;
  const ListTable& t = grid.ghost;
  for (int q = 0; q < t.size(); ++q)
    for (int k = t.off[q]; k < t.off[q + 1]; ++k)
      for (int i = 0; i < dim; ++i)
        fint[(dofs.rows.nfe + t.item[k]) * dim + i] += grid.ghost_k[q] * grid.ghost_w[k] *
                                                   j.ghost[q * dim + i];
}

// sums over the ranks, and shares a failure with all
Failure sum_force(const Dofs& s, const Failure& failure, RealVec* with, RealVec& fint)
{
  double bad = failure.ok() ? 0.0 : 1.0;
  std::vector<RealVec*> all = {&fint};
  if (with) all.push_back(with);
  halo_sum(s.pattern.A.halo, s.rows.dim, all, &bad, 1);
  return bad == 0.0 ? STATUS_OK : failure_agree(failure);
}

// ---- loads ----------------------------------------------------------------

// position of a kinematic point between t(n) (s = 0) and t(n+1) (s = 1)
struct Follower {
  const Model& m;
  const State& st;
  bool body;
  double s;
  bool follow;
  void reference(int n, double* X) const
  {
    for (int i = 0; i < 3; ++i)
      X[i] = !body ? m.mesh.X[3 * n + i] : i < m.dim ? st.points.Xc[n * m.dim + i] : 0.0;
  }
  void position(int n, double* x) const
  {
    const int dim = m.dim;
    reference(n, x);
    if (!follow) return;
    for (int i = 0; i < dim; ++i)
      x[i] += body ? (1.0 - s) * st.n.uc[n * dim + i] + s * st.np1.uc[n * dim + i]
                   : (1.0 - s) * st.n.u[n * dim + i] + s * st.np1.u[n * dim + i];
  }
};

// the value of a load at X; BAD_VALUE: name() names the node, face or element
template <class Name>
inline Failure value_here(const Model& m, const Step& step, const Load& l, const double* X,
                          const LoadTime& at, Name name, double& value)
{
  value = load_value(m, step, l, X, at.step, at.total);
  if (std::isfinite(value)) return STATUS_OK;
  const double time = l.hold < 0.0 ? at.total : l.hold;
  return {BAD_VALUE, value_text(m, l.keyword.c_str(), l.deck_line, l.value, l.amplitude, name(), X, time)};
}

// the face q, of an element or a point (body), in the user's terms
std::string face_name(const Mesh& mesh, const Points& pts, bool body, const Face& q)
{
  const int label = body ? pts.label[q.elem] : mesh.elem_label[q.elem];
  const char* const owner = body ? " of material point " : " of element ";
  return "face " + std::to_string(q.face + 1) + owner + std::to_string(label);
}

// one face under pressure (present configuration) or traction (dead load, on the area at t = 0)
Failure face_load(const Follower& f, const Face& q, const Step& step, const Load& l, int nen, const int* node,
                  double thickness, const LoadTime& at, RealVec& out)
{
  const Model& m       = f.m;
  const int kind       = face_kind(m.dim, nen);
  const FaceRule& rule = face_rule(kind);
  double X[3 * MAX_FACE_NODES], x[3 * MAX_FACE_NODES], N[MAX_FACE_NODES], n[3];
  for (int k = 0; k < nen; ++k) {
    f.reference(node[k], X + 3 * k);
    f.position(node[k], x + 3 * k);
  }
  for (int g = 0; g < rule.n; ++g) {
    double xg[3] = {0, 0, 0}, force[3];
    face_eval(kind, rule.xi[g], N, nullptr);
    for (int k = 0; k < nen; ++k)
      for (int i = 0; i < 3; ++i) xg[i] += N[k] * X[3 * k + i];
    double value;
    const auto name = [&] { return face_name(m.mesh, f.st.points, f.body, q); };
    const Failure failure = value_here(m, step, l, xg, at, name, value);
    if (!failure.ok()) return failure;
    value *= rule.w[g] * thickness;
    const double dA    = face_area(kind, l.kind == LOAD_PRESSURE ? x : X, rule.xi[g], n);
    for (int i = 0; i < 3; ++i) force[i] = l.kind == LOAD_PRESSURE ? -value * n[i] : value * dA * l.dir[i];
    for (int k = 0; k < nen; ++k)
      for (int i = 0; i < m.dim; ++i) out[node[k] * m.dim + i] += N[k] * force[i];
  }
  return STATUS_OK;
}

// faces of finite elements, or of points of this rank (body)
Failure faces_load(const Model& m, const Discretisation& d, const State& st, const Step& step, const Load& l,
                   bool body, const std::vector<Face>& face, const LoadTime& at, const Dofs& dofs,
                   RealVec& out)
{
  const Follower f{m, st, body, at.s, step.nlgeom};
  for (const Face& q : face) {
    if (body && !dofs.pattern.owns_point(q.elem)) continue;
    const Shape shape = body ? static_cast<Shape>(st.points.shape[q.elem])
                             : elem_table[m.mesh.elem_type[q.elem]].shape;
    const int* conn   = body ? st.points.conn.begin(q.elem) : m.mesh.conn.begin(q.elem);
    const int nen     = shape_info[shape].nfnode[q.face];
    int node[MAX_FACE_NODES];
    for (int k = 0; k < nen; ++k) node[k] = conn[shape_info[shape].face[q.face][k]];
    if (!body && d.el.block_of[q.elem] < 0) continue;     // no longer an element
    const double t = m.dim == 3 ? 1.0 : body ? m.body[st.points.body[q.elem]].thickness
                                             : d.el.block[d.el.block_of[q.elem]].thickness;
    const Failure failure = face_load(f, q, step, l, nen, node, t, at, out);
    if (!failure.ok()) return failure;
  }
  return STATUS_OK;
}

// faces of a body, without the faces of the surfaces of except, and restricted to those of only
std::vector<Face> acting_faces(const Points& pts, const Load& l, const std::vector<Face>& face)
{
  std::set<std::pair<int, int>> except, only;
  for (int s : l.except)
    for (const Face& f : pts.surface[s]) except.insert({f.elem, f.face});
  for (int s : l.only)
    for (const Face& f : pts.surface[s]) only.insert({f.elem, f.face});
  std::vector<Face> out;
  for (const Face& f : face)
    if (!except.count({f.elem, f.face}) && (l.only.empty() || only.count({f.elem, f.face}))) out.push_back(f);
  return out;
}

// faces of finite elements into fn [nnode*dim], faces of bodies into fc [ncorner*dim]
Failure face_loads(const Model& m, const Discretisation& d, const State& st, const Step& step, const Load& l,
                   const LoadTime& at, const Dofs& dofs, RealVec& fn, RealVec& fc)
{
  const Failure failure = faces_load(m, d, st, step, l, false, m.surface[l.surface].face, at, dofs, fn);
  if (!failure.ok()) return failure;
  const std::vector<Face>& face = st.points.surface[l.surface];
  if (l.except.empty() && l.only.empty()) return faces_load(m, d, st, step, l, true, face, at, dofs, fc);
  return faces_load(m, d, st, step, l, true, acting_faces(st.points, l, face), at, dofs, fc);
}

Failure body_loads(const Model& m, const Discretisation& d, const State& st, const Step& step, const Load& l,
                   const LoadTime& at, const Dofs& dofs, RealVec& fn, RealVec& fc)
{
  const int dim  = m.dim;
  for (int e : l.elem) {
    if (d.el.block_of[e] < 0) continue;
    const ElemBlock& b    = d.el.block[d.el.block_of[e]];
    const ShapeInfo& info = shape_info[b.shape];
    for (int g = 0; g < info.ngp; ++g) {
      double X[3], N[MAX_NODES], value;
      const double dV = elem_gauss_position(m, d.el, e, g, X, N);
      const auto name = [&] { return "element " + std::to_string(m.mesh.elem_label[e]); };
      const Failure failure = value_here(m, step, l, X, at, name, value);
      if (!failure.ok()) return failure;
      const double w = dV * value * (l.per_mass ? b.density : 1.0);
      for (int a = 0; a < info.nen; ++a)
        for (int i = 0; i < dim; ++i) fn[m.mesh.conn.begin(e)[a] * dim + i] += w * N[a] * l.dir[i];
    }
  }
  const Points& pts = st.points;
  for (int q = 0; q < pts.npoint; ++q) {
      const bool of_body = std::find(l.body.begin(), l.body.end(), pts.body[q]) != l.body.end();
      if (!dofs.pattern.owns_point(q)) continue;
      if (!of_body &&
          !(pts.parent[q] >= 0 && std::binary_search(l.elem.begin(), l.elem.end(), pts.parent[q])))
        continue;
      double X[3];
      point_centre(pts, dim, q, X);
      double value;
      const auto name = [&] { return "material point " + std::to_string(pts.label[q]); };
      const Failure failure = value_here(m, step, l, X, at, name, value);
      if (!failure.ok()) return failure;
      const double w = value * (l.per_mass ? pts.mass[q] : point_volume(m, pts, q));
      const double* w_c = pts.w(q);
      for (int a = 0; a < pts.conn.count(q); ++a)
        for (int i = 0; i < dim; ++i) fc[pts.conn.begin(q)[a] * dim + i] += w * w_c[a] * l.dir[i];
    }
  return STATUS_OK;
}

// loads at nodes, or at the corners of points that replace them
Failure node_loads(const Model& m, const IntVec& follow, const Step& step, const Load& l, const LoadTime& at,
                   Warned& warned, RealVec& fn, RealVec& fc)
{
  double value;
  for (int n : l.node) {
    if (!m.part.counts(n)) continue;
    const auto name = [&] { return "node " + std::to_string(m.mesh.node_label[n]); };
    const double* X = &m.mesh.X[3 * n];
    const Failure failure = value_here(m, step, l, X, at, name, value);
    if (!failure.ok()) return failure;
    const int c = follow.empty() ? FOLLOW_ELEMENT : follow[n];
    if (c >= 0) fc[c * m.dim + l.dof] += value;
    else fn[n * m.dim + l.dof] += value;
    if (c == FOLLOW_NONE)
      warn_once(warned, m.mesh, l.keyword.c_str(), l.deck_line, n, at.total,
                "its last element is gone and no corner of a point lies there; the load has ended");
  }
  return STATUS_OK;
}

}  // namespace

void assem_scatter_corners(const ActiveGrid& grid, const Dofs& dofs, const RealVec& fc, RealVec& f)
{
  double* rows = f.data() + dofs.rows.nfe * dofs.rows.dim;
  if (dofs.rows.dim == 2) scatter_corners<2>(grid, fc.data(), rows);
  else scatter_corners<3>(grid, fc.data(), rows);
}

void assem_gather_corners(const ActiveGrid& grid, const Dofs& dofs, const RealVec& x, const RealVec& before,
                          RealVec& after)
{
  const double* rows = x.data() + dofs.rows.nfe * dofs.rows.dim;
  if (dofs.rows.dim == 2) gather_corners<2>(grid, rows, before.data(), after.data());
  else gather_corners<3>(grid, rows, before.data(), after.data());
}

void assem_ghost_jump(const ActiveGrid& grid, const Dofs& dofs, const RealVec& x, RealVec& jump)
{
  const int dim      = dofs.rows.dim;
  const ListTable& t = grid.ghost;
  jump.assign(static_cast<size_t>(t.size()) * dim, 0.0);
  for (int q = 0; q < t.size(); ++q)
    for (int k = t.off[q]; k < t.off[q + 1]; ++k)
      for (int i = 0; i < dim; ++i)
        jump[q * dim + i] += grid.ghost_w[k] * x[(dofs.rows.nfe + t.item[k]) * dim + i];
}

Failure assem_move(const Model& m, const Discretisation& d, const Dofs& dofs, const RealVec& du,
                   double t_step0, double t_step1, State& st, Jumps& j)
{
  const ActiveGrid& grid = d.grid;
  if (m.dim == 2) move_nodes<2>(dofs, du, st);
  else move_nodes<3>(dofs, du, st);
  assem_gather_corners(grid, dofs, du, st.n.uc, st.np1.uc);                             // (3.1)
  assem_ghost_jump(grid, dofs, du, j.ghost);
  const Failure failure = move_bonds(m, dofs, du, t_step0, t_step1, st, j);
  return m.part.on && has_grounds(m) ? failure_agree(failure) : failure;
}

void assem_share_bonds(State& st, int dim, Jumps& j)
{
  if (comm_size() == 1 || st.bonds.nbond_all() == 0) return;
  halo_numbers(st.bonds.halo, dim, {&j.contact, &st.np1.slip, &st.np1.lambda});
}

Failure assem_internal(const Model& m, const Discretisation& d, const Dofs& dofs, const KernelMode& mode,
                       Jumps& j, State& st, RealVec& fint, RealVec* with, RealVec* energy)
{
  Timer timer(PHASE_RESIDUAL);
  fint.assign(dofs.rows.neq(), 0.0);
  if (energy) energy->assign(m.mesh.nelem(), 0.0);
  Failure failure = add_elements(m, d.el, dofs, mode, st, fint, energy);
  if (st.points.npoint_all()) {
    RealVec& fc = j.corner;
    fc.assign(st.points.Xc.size(), 0.0);
    int worst = -1;
    const Status s = point_corner_force(m, st.points, d.point_law, mode, st.n, st.np1,
                                        dofs.rows.owned_point, dofs.rows.owned_group, fc, &worst);
    if (s != STATUS_OK) failure = {s, AT_POINT, worst};
    assem_scatter_corners(d.grid, dofs, fc, fint);
  }
  if (st.bonds.nbond) add_bonds(m, d.pairs, dofs, mode, j, st, fint);
  add_ghosts(d.grid, dofs, j, fint);
  return comm_size() > 1 ? sum_force(dofs, failure, with, fint) : failure;
}

namespace {

bool follows(const Step& step, const Load& l) { return step.nlgeom && l.kind == LOAD_PRESSURE; }

// dof_of_nodes into memory that is there
void loads_of_nodes(const Dofs& dofs, const RealVec& fn, RealVec& fext)
{
  const int dim = dofs.rows.dim;
  fext.resize(dofs.rows.neq());
  double* f = fext.data();
  for (int r = 0; r < dofs.rows.nfe; ++r)
    for (int i = 0; i < dim; ++i) f[r * dim + i] = fn[dofs.rows.node_of_row[r] * dim + i];
  std::fill(fext.begin() + dofs.rows.nfe * dim, fext.end(), 0.0);
}

// Divided model: loads at nodes fn, at corners of owned points fc, and at corners that replace nodes of this
// rank, far, which are added by the owner of the corner. A failure of any rank is shared by all
Failure sum_loads(const Points& pts, const Discretisation& d, const Dofs& dofs, const Failure& failure,
                  const RealVec& fn, const RealVec& fc, RealVec& far, RealVec& fext)
{
  const bool any = std::any_of(far.begin(), far.end(), [](double f) { return f != 0.0; });
  double number[2] = {any ? 1.0 : 0.0, failure.ok() ? 0.0 : 1.0};
  loads_of_nodes(dofs, fn, fext);
  assem_scatter_corners(d.grid, dofs, fc, fext);
  if (sys_shared(dofs.pattern.A)) halo_sum(dofs.pattern.A.halo, dofs.rows.dim, fext, number, 2);
  if (number[1] > 0.0) return failure_agree(failure);
  if (number[0] == 0.0) return STATUS_OK;
  if (pts.part.window) halo_sum(pts.part.halo, dofs.rows.dim, far);
  else comm_sum(far);
  for (size_t k = 0; k < far.size(); ++k)
    if (d.owned.owner[k / dofs.rows.dim] != comm_rank()) far[k] = 0.0;
  RealVec f(dofs.rows.neq(), 0.0);
  assem_scatter_corners(d.grid, dofs, far, f);
  sys_sum(dofs.pattern.A, f);
  for (int i = 0; i < dofs.rows.neq(); ++i) fext[i] += f[i];
  return STATUS_OK;
}

}  // namespace

namespace {

// forces of removed elements and of their loads fall to zero over the step: at nodes fn         (6.43)
void add_left_by_removed(const Model& m, const State& st, const Step& step, double t, RealVec& fn)
{
  if (st.left_by_removed.empty()) return;
  const double part = std::max(0.0, 1.0 - t / step.period);
  for (int n = 0; n < m.mesh.nnode(); ++n)
    for (int i = 0; i < m.dim && m.part.counts(n); ++i)
      fn[n * m.dim + i] += part * st.left_by_removed[n * m.dim + i];
}

}  // namespace

bool assem_has_followers(const Step& step)
{
  return std::any_of(step.load.begin(), step.load.end(), [&](const Load& l) { return follows(step, l); });
}

Failure assem_loads(const Model& m, const Discretisation& d, const Dofs& dofs, const State& st,
                    const Step& step, const LoadTime& at, Warned& warned, RealVec& fext)
{
  if (step.load.empty() && st.left_by_removed.empty()) {
    fext.assign(dofs.rows.neq(), 0.0);
    return STATUS_OK;
  }
  RealVec fn(static_cast<size_t>(m.mesh.nnode()) * m.dim, 0.0), fc(st.points.Xc.size(), 0.0);
  RealVec far(m.part.on ? fc.size() : 0, 0.0);
  Failure failure;
  for (const Load& l : step.load) {
    if (l.kind == LOAD_NODE)
      failure = node_loads(m, d.follow, step, l, at, warned, fn, m.part.on ? far : fc);
    else if (l.kind == LOAD_BODY) failure = body_loads(m, d, st, step, l, at, dofs, fn, fc);
    else failure = face_loads(m, d, st, step, l, at, dofs, fn, fc);
    if (!failure.ok()) break;
  }
  add_left_by_removed(m, st, step, at.step, fn);
  if (m.part.on) return sum_loads(st.points, d, dofs, failure, fn, fc, far, fext);
  if (!failure.ok()) return failure;
  loads_of_nodes(dofs, fn, fext);
  assem_scatter_corners(d.grid, dofs, fc, fext);
  return STATUS_OK;
}
