#include <algorithm>

#include "assem/assem.h"
#include "assem/pack_list.h"
#include "base/comm.h"
#include "base/timer.h"

namespace {

// adds a block or its transpose; in a diagonal block only the lower part is kept. The numbers of k lie STRIDE
// apart
template <int D, int STRIDE = 1>
inline void add_block(SysMatrix& A, int where, bool diagonal, const double* k)
{
  double* v = &A.val[static_cast<size_t>(where / 2) * D * D];
  if (diagonal) {
    for (int i = 0; i < D; ++i)
      for (int j = 0; j <= i; ++j) v[i * D + j] += k[(i * D + j) * STRIDE];
  } else if (where & 1) {
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j) v[j * D + i] += k[(i * D + j) * STRIDE];
  } else {
    for (int i = 0; i < D * D; ++i) v[i] += k[i * STRIDE];
  }
}

template <int D, int STRIDE = 1>
inline void add_pairs(SysMatrix& A, const int* map, int n, const double* ke)
{
  int pair = 0;
  for (int a = 0; a < n; ++a)
    for (int b = 0; b <= a; ++b, ++pair)
      add_block<D, STRIDE>(A, map[pair], a == b, ke + pair * D * D * STRIDE);
}

template <int D>
void add_pack(Problem& p, const KernelMode& mode, const ElemBlock& b, ElemFormPack form, PackList& w)
{
  if (w.n == 0) return;
  const int nen = shape_info[b.shape].nen;
  alignas(Pack) double u0[8 * D * PACK], u1[8 * D * PACK], ke[36 * D * D * PACK];
  unsigned bad;
  w.fill();
  if (mode_reads_old(mode, b.law)) elem_ends_pack(p.st.n.u, p.m.mesh, b, w.slot, nen, D, u0);
  elem_ends_pack(p.st.np1.u, p.m.mesh, b, w.slot, nen, D, u1);
  form(b, w.slot, mode, u0, u1, nullptr, ke, bad);
  for (int l = 0; l < w.n; ++l) add_pairs<D, PACK>(p.dofs.A, w.map[l], nen, ke + l);
  w.n = 0;
}

template <int D>
void add_elements(Problem& p, const KernelMode& mode)
{
  const Mesh& mesh = p.m.mesh;
  const int* map = p.dofs.elem_map.data();
  double u0[8 * D], u1[8 * D], re[8 * D], ke[36 * D * D];
  for (const ElemBlock& b : p.el.block) {
    const ShapeInfo& info   = shape_info[b.shape];
    const ElemForm form     = elem_form(b);
    const ElemFormPack pack = elem_form_pack(b);
    PackList w;
    for (int slot : elem_mine(b)) {
      const int e = b.elem[slot], *node = mesh.conn.begin(e);
      const bool intact = p.el.broken(e) < 0;
      if (intact && pack) {
        if (w.add(slot, map)) add_pack<D>(p, mode, b, pack, w);
      } else {
        elem_ends(p.st, node, info.nen, D, u0, u1);
        if (intact) form(b, slot, mode, u0, u1, re, ke);
        else
          elem_form_broken(b, slot,
                           elem_broken_law(p.m, p.el, e, degr_of_step(p.st.n, p.st.np1, mode.mid, e)), mode,
                           u0, u1, re, ke);
        add_pairs<D>(p.dofs.A, map, info.nen, ke);
      }
      map += pair_count(info.nen);
    }
    add_pack<D>(p, mode, b, pack, w);
  }
}

template <int D>
void add_points(Problem& p, const KernelMode& mode)
{
  const Points& pts = p.st.points;
  RealVec work, ke;
  PackList waiting[POINT_PACK_NODES + 1];            // by number of grid nodes
  alignas(Pack) double kp[pair_count(POINT_PACK_NODES) * D * D * PACK];
  const auto flush = [&](PackList& w, int n) {
    if (w.n == 0) return;
    w.fill();
    point_tangent_pack(D, pts, p.point_law, mode, p.st.n.uc, p.st.np1.uc, p.grid, w.slot, kp);
    for (int l = 0; l < w.n; ++l) add_pairs<D, PACK>(p.dofs.A, w.map[l], n, kp + l);
    w.n = 0;
  };
  const size_t* at = p.dofs.point_map_off.data();
  for (int q : p.dofs.my_point) {
    const int n    = p.grid.point.count(q);
    const int* map = &p.dofs.point_map[*at++];
    if (pts.broken[q] < 0 && n <= POINT_PACK_NODES) {
      PackList& w = waiting[n];
      if (w.n && pts.body[w.slot[0]] != pts.body[q]) flush(w, n);
      if (w.add(q, map)) flush(w, n);
      continue;
    }
    ke.resize(static_cast<size_t>(pair_count(n)) * D * D);
    point_tangent(p.m, pts, p.point_law, mode, p.st.n, p.st.np1, p.grid, q, work, ke.data());
    add_pairs<D>(p.dofs.A, map, n, ke.data());
  }
  for (int n = 0; n <= POINT_PACK_NODES; ++n) flush(waiting[n], n);
}

template <int D>
void add_bonds(Problem& p, const KernelMode& mode)
{
  double C[D * D], k[D * D];
  double f[D], t1[D], slipped;
  const size_t* at = p.dofs.bond_map_off.data();
  for (int q : p.dofs.my_bond) {
    const int* map     = &p.dofs.bond_map[*at++];
    const bool contact = p.st.bonds.field[q] == SIDE_CONTACT;
    if (contact && !p.pairs.master.count(q)) continue;
    if (contact)
      contact_force(p.m, p.st.bonds, p.pairs, q, mode, &p.contact_s[q * D], &p.st.n.lambda[q * D],
                    p.st.np1.lambda_n[q], f, C, t1, &slipped);
    else
      bond_stiffness(p.st.bonds, D, q, C);
    const double factor = contact ? 1.0 : mode.cD();
    const int n     = p.dofs.bond.count(q);
    const double* w = &p.dofs.bond_w[p.dofs.bond.off[q]];
    for (int a = 0; a < n; ++a)
      for (int b = 0; b <= a; ++b) {
        for (int i = 0; i < D * D; ++i) k[i] = factor * w[a] * w[b] * C[i];
        add_block<D>(p.dofs.A, map[pair_place(a, b)], a == b, k);
      }
  }
}

template <int D>
void add_ghosts(Problem& p)
{
  const size_t* at = p.dofs.ghost_map_off.data();
  for (int q : p.dofs.my_ghost) {
    const int n = p.grid.ghost.count(q), *map = &p.dofs.ghost_map[*at++];
    const double* w = &p.grid.ghost_w[p.grid.ghost.off[q]];
    for (int a = 0; a < n; ++a)
      for (int b = 0; b <= a; ++b) {
        double* v = &p.dofs.A.val[static_cast<size_t>(*map++ / 2) * D * D];
        for (int i = 0; i < D; ++i) v[i * D + i] += p.grid.ghost_k[q] * w[a] * w[b];
      }
  }
}

}  // namespace

void assem_tangent(Problem& p, const KernelMode& mode, double cM)
{
  Timer timer(PHASE_TANGENT);
  Dofs& s = p.dofs;
  ++s.tangent;
  std::fill(s.A.val.begin(), s.A.val.end(), 0.0);
  if (s.dim == 2) {
    add_elements<2>(p, mode);
    add_points<2>(p, mode);
    add_bonds<2>(p, mode);
    add_ghosts<2>(p);
  } else {
    add_elements<3>(p, mode);
    add_points<3>(p, mode);
    add_bonds<3>(p, mode);
    add_ghosts<3>(p);
  }
  if (cM == 0.0) return;
  for (size_t k = 0; k < s.M.size(); ++k)
    for (int i = 0; i < s.dim; ++i) s.A.val[(k * s.dim + i) * s.dim + i] += cM * s.M[k];
}

void assem_constrain(Dofs& s, const RealVec& diagonal, const RealVec& x, RealVec& f)
{
  const int dim = s.dim;
  double diag = 0.0;
  for (double d : diagonal) diag += d;
  diag /= s.neq();
  std::vector<char> held(s.nrow, 0);
  for (int i = 0; i < s.neq(); ++i) held[i / dim] |= s.fixed[i] != 0;
  RealVec Ax(f.size(), 0.0);           // of this rank, negative
  for (int r = 0; r < s.nrow; ++r)
    for (int k = s.A.off[r]; k < s.A.off[r + 1]; ++k) {
      const int c = s.A.col[k];
      if (!held[r] && !held[c]) continue;
      double* v = &s.A.val[static_cast<size_t>(k) * dim * dim];
      for (int i = 0; i < dim; ++i)
        for (int j = 0; j < (r == c ? i : dim); ++j) {
          const int row = r * dim + i, col = c * dim + j;
          if (!s.fixed[row] && !s.fixed[col]) continue;
          if (s.fixed[col] && !s.fixed[row]) Ax[row] -= v[i * dim + j] * x[col];
          if (s.fixed[row] && !s.fixed[col]) Ax[col] -= v[i * dim + j] * x[row];
          v[i * dim + j] = 0.0;
        }
      if (r != c) continue;
      const bool here = s.owner.empty() || s.owner[r] == comm_rank();
      for (int i = 0; i < dim; ++i)
        if (s.fixed[r * dim + i])
          v[i * dim + i] = !here ? 0.0 : diagonal[r * dim + i] > 0.0 ? diagonal[r * dim + i] : diag;
    }
  if (std::any_of(x.begin(), x.end(), [](double v) { return v != 0.0; })) sys_sum(s.A, Ax);
  for (int i = 0; i < s.neq(); ++i) f[i] = s.fixed[i] ? 0.0 : f[i] + Ax[i];
}
