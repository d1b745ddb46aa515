#include <algorithm>

#include "assem/assem.h"
#include "assem/pack_list.h"
#include "base/timer.h"

namespace {

// adds a block or its transpose; in a diagonal block only the lower part is kept. The numbers
// of k have the distance STRIDE
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

// the same for some lanes of a pack: ke [pairs + 1][D*D][PACK] is overwritten. Lanes with the same target, as
// the points of an element, are summed first. In 2D the blocks of two pairs, or of one, are transposed
// together, so that each is one vector
template <int D>
inline void add_packed_pairs(SysMatrix& A, const int* const* map, int lanes, int n, double* ke)
{
  Pack* k = reinterpret_cast<Pack*>(ke);
  if (lanes == PACK && std::all_of(map, map + PACK, [&](const int* m) { return m == map[0]; })) {
    for (int i = 0; i < pair_count(n) * D * D; i += PACK) {
      pack_turn(k + i);
      Pack sum = k[i];
      for (int l = 1; l < PACK; ++l) sum += k[i + l];
      k[i / PACK] = sum;
    }
    add_pairs<D>(A, map[0], n, ke);
    return;
  }
  if (D == 3 || PACK < 4) {
    for (int l = 0; l < lanes; ++l) add_pairs<D, PACK>(A, map[l], n, ke + l);
    return;
  }
  typedef double Block __attribute__((vector_size(32), may_alias));
  typedef double BlockAt __attribute__((vector_size(32), aligned(8), may_alias));
  typedef long Lanes __attribute__((vector_size(32)));
  const Lanes turn[2] = {{0, 1, 2, 3}, {0, 2, 1, 3}};
  const int pairs = pair_count(n), turned = PACK / 4;
  for (int a = 0; a < n; ++a) k[pair_index(a, a) * 4 + 1] = Pack{};
  for (int pair = 0; pair < pairs; pair += turned) {
    pack_turn(k + pair * 4);
    for (int l = 0; l < lanes; ++l)
      for (int q = 0; q < turned && pair + q < pairs; ++q) {
        const int where = map[l][pair + q];
        BlockAt* v      = reinterpret_cast<BlockAt*>(&A.val[static_cast<size_t>(where / 2) * 4]);
        *v += __builtin_shuffle(reinterpret_cast<const Block*>(k + pair * 4 + l)[q], turn[where & 1]);
      }
  }
}

template <int D>
void add_pack(const Mesh& mesh, const State& st, const KernelMode& mode, const ElemBlock& b,
              ElemFormPack form, PackList& w, SysMatrix& A)
{
  if (w.n == 0) return;
  const int nen = shape_info[b.shape].nen;
  alignas(Pack) double u0[MAX_NODES * D * PACK], u1[MAX_NODES * D * PACK],
    ke[(pair_count(MAX_NODES) + 1) * D * D * PACK];
  unsigned bad;
  w.fill();
  if (mode_reads_old(mode, b.law)) elem_ends_pack(st.n.u, mesh, b, w.slot, nen, D, u0);
  elem_ends_pack(st.np1.u, mesh, b, w.slot, nen, D, u1);
  form(b, w.slot, mode, u0, u1, nullptr, ke, bad, nullptr, nullptr);
  add_packed_pairs<D>(A, w.map, w.n, nen, ke);
  w.n = 0;
}

// the elements in packs, or all others
template <int D>
void add_elements(const Model& m, const Elements& el, const KernelMode& mode, bool packs, State& st,
                  Dofs& dofs)
{
  const Mesh& mesh = m.mesh;
  const int* map = dofs.pattern.elem_map.data();
  double re[MAX_NODES * D], ke[pair_count(MAX_NODES) * D * D];
  for (const ElemBlock& b : el.block) {
    const ShapeInfo& info   = shape_info[b.shape];
    const ElemForm form     = elem_form(b);
    const ElemFormPack pack = pack_of(b, mode);
    PackList w;
    for (int slot : b.live) {
      const int e = b.elem[slot];
      if (pack && elem_whole(el, st.np1, e)) {
        if (packs && w.add(slot, map)) add_pack<D>(mesh, st, mode, b, pack, w, dofs.pattern.A);
      } else if (!packs) {
        elem_form_one(m, el, mode, b, slot, form, st.n, st.np1, re, ke);
        add_pairs<D>(dofs.pattern.A, map, info.nen, ke);
      }
      map += pair_count(info.nen);
    }
    add_pack<D>(mesh, st, mode, b, pack, w, dofs.pattern.A);
  }
}

// bulk viscosity of the energy-momentum scheme                                     (6.49)
template <int D>
void add_bulk_mid(const Mesh& mesh, const Elements& el, const KernelMode& mode, const State& st, Dofs& dofs)
{
  const int* map = dofs.pattern.elem_map.data();
  double re[MAX_NODES * D], ke[pair_count(MAX_NODES) * D * D], loss;
  for (const ElemBlock& b : el.block) {
    const int nen = shape_info[b.shape].nen;
    for (int slot : b.live) {
      if (elem_bulk_mid(mesh, el, b, slot, st.n, st.np1, mode.finite, *mode.bulk, re, ke, loss))
        add_pairs<D>(dofs.pattern.A, map, nen, ke);
      map += pair_count(nen);
    }
  }
}

template <int D>
void add_points(const Model& m, const Discretisation& d, const KernelMode& mode, State& st, Dofs& dofs)
{
  const Points& pts = st.points;
  const ActiveGrid& grid = d.grid;
  RealVec work, ke;
  PackList waiting[POINT_PACK_NODES + 1];            // [number of grid nodes]
  alignas(Pack) double kp[(pair_count(POINT_PACK_NODES) + 1) * D * D * PACK];
  const auto flush = [&](PackList& w, int n) {
    if (w.n == 0) return;
    w.fill();
    point_tangent_pack(D, pts, d.point_law, mode, st.n.uc, st.np1.uc, grid, w.slot, kp);
    add_packed_pairs<D>(dofs.pattern.A, w.map, w.n, n, kp);
    w.n = 0;
  };
  // single points: consecutive points with the same nodes are summed first
  const int* sum_map = nullptr;
  int sum_n = 0;
  const auto add_sum = [&]() {
    if (sum_map) add_pairs<D>(dofs.pattern.A, sum_map, sum_n, ke.data());
    sum_map = nullptr;
  };
  const size_t* at = dofs.pattern.point_map_off.data();
  for (int q : dofs.rows.owned_point) {
    const int n    = grid.point.count(q);
    const int* map = &dofs.pattern.point_map[*at++];
    if (d.point_law.in_group(q)) continue;
    if (pts.broken[q] < 0 && n <= POINT_PACK_NODES && !law_is_general(d.point_law.body[pts.body[q]])) {
      PackList& w = waiting[n];
      if (w.n && pts.body[w.slot[0]] != pts.body[q]) flush(w, n);
      if (w.add(q, map)) flush(w, n);
      continue;
    }
    if (map != sum_map || n != sum_n) {
      add_sum();
      sum_map = map;
      sum_n   = n;
      ke.assign(static_cast<size_t>(pair_count(n)) * D * D, 0.0);
    }
    point_tangent(m, pts, d.point_law, mode, st.n, st.np1, grid, q, work, ke.data());
  }
  add_sum();
  for (int n = 0; n <= POINT_PACK_NODES; ++n) flush(waiting[n], n);
  // groups of points that share their change of volume, on the nodes of the group
  at = dofs.pattern.group_map_off.data();
  for (int k : dofs.rows.owned_group) {
    const int n = dofs.rows.group.count(k), *map = &dofs.pattern.group_map[*at++];
    ke.resize(static_cast<size_t>(pair_count(n)) * D * D);
    point_group_tangent(m, pts, d.point_law, mode, st.n, st.np1, grid, k, n, dofs.rows.group.begin(k),
                        dofs.rows.nfe,
                        ke.data());
    add_pairs<D>(dofs.pattern.A, map, n, ke.data());
  }
}

template <int D>
void add_bonds(const Model& m, const ContactPairs& pairs, const State& st, const KernelMode& mode,
               const Jumps& j, Dofs& dofs)
{
  double C[D * D], k[D * D];
  double f[D], t1[D], slipped;
  const size_t* at = dofs.pattern.bond_map_off.data();
  for (int q : dofs.rows.bond_acts) {
    const int* map     = &dofs.pattern.bond_map[*at++];
    const bool contact = st.bonds.side[q] == SIDE_CONTACT;
    if (contact)
      contact_force(m, st.bonds, pairs, q, mode, &j.contact[q * D], &st.n.lambda[q * D],
                    st.np1.lambda_n[q], f, C, t1, &slipped);
    else
      bond_stiffness(st.bonds, D, q, C);
    const double factor = contact ? 1.0 : mode.cD();
    const int n     = dofs.rows.bond.count(q);
    const double* w = &dofs.rows.bond_w[dofs.rows.bond.off[q]];
    for (int a = 0; a < n; ++a)
      for (int b = 0; b <= a; ++b) {
        for (int i = 0; i < D * D; ++i) k[i] = factor * w[a] * w[b] * C[i];
        add_block<D>(dofs.pattern.A, map[pair_index(a, b)], a == b, k);
      }
  }
}

template <int D>
void add_ghosts(const ActiveGrid& grid, Dofs& dofs)
{
  const size_t* at = dofs.pattern.ghost_map_off.data();
  for (int q = 0; q < grid.ghost.size(); ++q) {
    const int n = grid.ghost.count(q), *map = &dofs.pattern.ghost_map[*at++];
    const double* w = &grid.ghost_w[grid.ghost.off[q]];
    for (int a = 0; a < n; ++a)
      for (int b = 0; b <= a; ++b) {
        double* v = &dofs.pattern.A.val[static_cast<size_t>(*map++ / 2) * D * D];
        for (int i = 0; i < D; ++i) v[i * D + i] += grid.ghost_k[q] * w[a] * w[b];
      }
  }
}

// what changes within an increment and from one to the next
template <int D>
void add_local(const Model& m, const Discretisation& d, const KernelMode& mode, const Jumps& j, State& st,
               Dofs& s)
{
  add_elements<D>(m, d.el, mode, false, st, s);
  if (mode.bulk && mode.mid) add_bulk_mid<D>(m.mesh, d.el, mode, st, s);
  add_points<D>(m, d, mode, st, s);
  add_bonds<D>(m, d.pairs, st, mode, j, s);
  add_ghosts<D>(d.grid, s);
}

// Motions of the grid that do not move any corner have neither mass nor stiffness: they would be determined
// by round-off only.
// Fraction of the diagonal of the mass; motions that move a corner have 1e-4. Not of A: with a stiff bond
// this would also constrain soft motions.                                                         (8.16)
// (test: Increment.GridMotionsThatNoCornerSeesStaySmall, patch/a2_spin_coupled.inp)
const double UNSEEN = 1e-10;

void stabilise_unseen(double cM, Dofs& s)
{
  for (int r = s.rows.nfe; r < s.rows.nrow; ++r) {
    const size_t k = static_cast<size_t>(s.pattern.A.off[r + 1] - 1);
    for (int i = 0; i < s.rows.dim; ++i)
      s.pattern.A.val[(k * s.rows.dim + i) * s.rows.dim + i] += UNSEEN * cM * s.mass.M[k];
  }
}

}  // namespace

void assem_tangent(TangentPart part, const Model& m, const Discretisation& d, const KernelMode& mode,
                   double cM, double cC, const Jumps& j, State& st, Dofs& s)
{
  Timer timer(PHASE_TANGENT);
  ++s.pattern.tangent;
  RealVec& A = s.pattern.A.val;
  if (part == TANGENT_LOCAL) {
    std::copy(s.pattern.whole.begin(), s.pattern.whole.end(), A.begin());
  } else {
    std::fill(A.begin(), A.end(), 0.0);
    if (s.rows.dim == 2) add_elements<2>(m, d.el, mode, true, st, s);
    else add_elements<3>(m, d.el, mode, true, st, s);
    for (size_t k = 0; k < s.mass.C.size() && cC != 0.0; ++k) A[k] += cC * s.mass.C[k];
    for (size_t k = 0; k < s.mass.M.size() && cM != 0.0; ++k)
      for (int i = 0; i < s.rows.dim; ++i) A[(k * s.rows.dim + i) * s.rows.dim + i] += cM * s.mass.M[k];
    if (cM != 0.0) stabilise_unseen(cM, s);
  }
  if (part == TANGENT_KEPT) s.pattern.whole = A;
  if (part == TANGENT_ALL) RealVec().swap(s.pattern.whole);
  if (s.rows.dim == 2) add_local<2>(m, d, mode, j, st, s);
  else add_local<3>(m, d, mode, j, st, s);
}

void assem_constrain(Dofs& s, const RealVec& diagonal, const RealVec& x, RealVec& f)
{
  if (dof_all_free(s)) return;
  const int dim = s.rows.dim;
  double diag = 0.0;
  if (!s.rows.split)
    for (double d : diagonal) diag += d;
  else diag = dof_sum(s, [&](size_t i) { return diagonal[i]; });
  diag /= s.rows.neq_all();
  std::vector<char> fixed(s.rows.nrow, 0);
  for (int i = 0; i < s.rows.neq(); ++i) fixed[i / dim] |= s.bound.fixed[i] != 0;
  RealVec Ax(f.size(), 0.0);           // of this rank, negative
  const bool any = std::find(fixed.begin(), fixed.end(), 1) != fixed.end();
  for (int r = 0; r < s.rows.nrow && any; ++r)
    for (int k = s.pattern.A.off[r]; k < s.pattern.A.off[r + 1]; ++k) {
      const int c = s.pattern.A.col[k];
      if (!fixed[r] && !fixed[c]) continue;
      double* v = &s.pattern.A.val[static_cast<size_t>(k) * dim * dim];
      for (int i = 0; i < dim; ++i)
        for (int j = 0; j < (r == c ? i : dim); ++j) {
          const int row = r * dim + i, col = c * dim + j;
          if (!s.bound.fixed[row] && !s.bound.fixed[col]) continue;
          if (s.bound.fixed[col] && !s.bound.fixed[row]) Ax[row] -= v[i * dim + j] * x[col];
          if (s.bound.fixed[row] && !s.bound.fixed[col]) Ax[col] -= v[i * dim + j] * x[row];
          v[i * dim + j] = 0.0;
        }
      if (r != c) continue;
      const bool here = s.rows.owns(r);
      for (int i = 0; i < dim; ++i)
        if (s.bound.fixed[r * dim + i])
          v[i * dim + i] = !here ? 0.0 : diagonal[r * dim + i] > 0.0 ? diagonal[r * dim + i] : diag;
    }
  const bool moves = std::any_of(x.begin(), x.end(), [](double v) { return v != 0.0; });
  if (!dof_all(s, !moves)) sys_sum(s.pattern.A, Ax);
  for (int i = 0; i < s.rows.neq(); ++i) f[i] = s.bound.fixed[i] ? 0.0 : f[i] + Ax[i];
}
