#include <algorithm>
#include <cmath>

#include "base/sort_once.h"
#include "elem/kernel_general.h"
#include "point/point_body.h"

namespace {

// Plastic flow does not resist a change of shape, and the law uses the mean volume of a group only: nothing
// would keep the volume of a single point. Its deviation from the mean is penalised with this fraction of the
// shear modulus  (test: stress/points_flow)
const double VOLUME_PENALTY = 0.1;

// stiffness of theta - thetabar of a point, of a law with plastic flow        (1.14a) force/length^2
double volume_penalty(const MatLaw& law)
{
  return law_flows(law.kind) && law.bar ? VOLUME_PENALTY * law.mu : 0.0;
}

// displacement gradient of point p: sum_c u_c (x) G_c                              (3.5)
template <int D>
void gradient(const Points& pts, const RealVec& uc, int p, double* H)
{
  for (int k = 0; k < D * D; ++k) H[k] = 0.0;
  const double* G = pts.G(p);
  for (int a = 0; a < pts.conn.count(p); ++a) {
    const int c = pts.conn.begin(p)[a];
    for (int i = 0; i < D; ++i) {
      const double u = uc[c * D + i];
      for (int j = 0; j < D; ++j) H[i * D + j] += u * G[a * D + j];
    }
  }
}

// law of point p, from the law of its body: intact, or broken with the degradation factor c
//   in   l   cohesive: t(n)
MatLaw law_now(const Model& m, const Points& pts, const MatLaw& of_body, const Level& l, CrackTangent tangent,
               int p, double c)
{
  if (!pts.eroded(p)) {
    MatLaw law = of_body;
    if (law_opens(law.kind)) point_crack(m, pts, l, p, tangent, law);
    return law;
  }
  return law_broken(of_body, m.fracture[pts.broken[p]], c, &pts.normal[3 * static_cast<size_t>(p)]);
}

// an intact point whose law the packs do not support
bool is_general(const Points& pts, const PointLaws& law, int p)
{
  return !pts.eroded(p) && law_is_general(law.body[pts.body[p]]);
}

// history of point p at both ends of the increment
HistoryStep history_of(const PointLaws& law, const Level& l0, Level& l1, int p)
{
  return {history_at(l0.hp, law.history, p), history_at(l1.hp, law.history, p)};
}

// does the law of point p read the displacements at t(n)?
bool reads_old(const Points& pts, const PointLaws& law, const KernelMode& mode, int p)
{
  return mode_reads_old(mode, law.body[pts.body[p]]);
}

// calls pack(points, n) for n <= PACK intact points of the same body and number of corners, padded to PACK,
// and one(p) for points that are broken or have a general law; points in groups are skipped
template <class UsePack, class UseOne>
void by_packs(const Points& pts, const PointLaws& law, const IntVec& owned, UsePack pack, UseOne one)
{
  int point[PACK], n = 0;
  const auto flush = [&]() {
    if (n == 0) return;
    for (int l = n; l < PACK; ++l) point[l] = point[0];
    pack(point, n);
    n = 0;
  };
  for (int p : owned) {
    if (law.in_group(p)) continue;
    if (pts.eroded(p) || is_general(pts, law, p)) {
      one(p);
      continue;
    }
    if (n && (pts.body[p] != pts.body[point[0]] || pts.conn.count(p) != pts.conn.count(point[0]))) flush();
    point[n++] = p;
    if (n == PACK) flush();
  }
  flush();
}

// gradients G [nen*D] and volumes of PACK points; NEN = 0: nen corners
template <int D, int NEN>
inline void load_points(const Points& pts, const int* point, int nen, Pack* G, Pack& V0)
{
  const double* from[PACK];
  for (int l = 0; l < PACK; ++l) V0[l] = pts.V0[point[l]];
  for (int l = 0; l < PACK; ++l) from[l] = pts.G(point[l]);
  pack_rows(from, (NEN ? NEN : nen) * D, G);
}

// displacements u [nen*D] of their corners
template <int D, int NEN>
inline void load_ends(const Points& pts, const int* point, int nen, const RealVec& uc, Pack* u)
{
  const int n = NEN ? NEN : nen, *corner[PACK];
  for (int l = 0; l < PACK; ++l) corner[l] = pts.conn.begin(point[l]);
  for (int a = 0; a < n; ++a) {
    const double* of[PACK];
    for (int l = 0; l < PACK; ++l) of[l] = &uc[static_cast<size_t>(corner[l][a]) * D];
    for (int i = 0; i < D; ++i) u[a * D + i] = pack_gather(of, i);
  }
}

// adds the forces re [nen*D] of the first n points
template <int D, int NEN>
inline void add_corner_forces(const Points& pts, const int* point, int n, int nen, Pack* re, RealVec& fc)
{
  if (NEN * D % PACK == 0 && NEN) {
    for (int k = 0; k < NEN * D; k += PACK) pack_turn(re + k);
    const double* r = reinterpret_cast<const double*>(re);
    for (int l = 0; l < n; ++l) {
      const int* corner = pts.conn.begin(point[l]);
      for (int a = 0; a < NEN; ++a)
        for (int i = 0, k = a * D; i < D; ++i, ++k)
          fc[corner[a] * D + i] += r[k / PACK * PACK * PACK + l * PACK + k % PACK];
    }
    return;
  }
  for (int l = 0; l < n; ++l)
    for (int a = 0; a < nen; ++a)
      for (int i = 0; i < D; ++i) fc[pts.conn.begin(point[l])[a] * D + i] += re[a * D + i][l];
}

// Fb, S and, unless C is null, C of a point that is broken or of a general law
template <int D>
Status form_one(const Model& m, const Points& pts, const PointLaws& law, const KernelMode& mode,
                const Level& l0, Level& l1, int p, const double* H0, const double* H1, double* Fb, double* S,
                double* C)
{
  const double c      = pts.eroded(p) ? degr_of_step(l0, l1, mode.mid, pts.parent[p]) : 1.0;
  const HistoryStep h = history_of(law, l0, l1, p);
  MatLaw now = law_now(m, pts, law.body[pts.body[p]], l0, mode.crack, p, c);
  if (!law.band.empty()) now.crack.band = law.band[p];
  return ip_general<D>(now, mode, H0, H1, h.n, h.np1, Fb, S, C);
}

// q and slope of bulk_mid times the volume, and the energy dissipated
struct BulkOfPoint {
  double force = 0.0, slope = 0.0, loss = 0.0;
};

// Energy-momentum, cohesive: bulk viscosity of point p, gradients H0, H1 at both ends; false: none, its crack
// opens                                                                                            (6.49)
template <int D>
bool bulk_of_point(const Model& m, const Points& pts, const PointLaws& law, const KernelMode& mode,
                   const Level& l0, Level& l1, int p, const double* H0, const double* H1, double* cof,
                   BulkOfPoint& out)
{
  const MatLaw& of_body = law.body[pts.body[p]];
  if (!mode.bulk || !mode.mid || !law_opens(of_body.kind) || pts.eroded(p)) return false;
  if (crack_opening(of_body, history_of(law, l0, l1, p).n) > 0.0) return false;
  const MatLaw of = law_now(m, pts, of_body, l0, CRACK_TANGENT, p, 1.0);
  const double density = of.material->density, c = std::sqrt((of.lam + 2.0 * of.mu) / density),
               size    = *std::min_element(of.crack.box, of.crack.box + D) + c * mode.bulk->dt;
  const double change =
      bulk_mid<D>(*mode.bulk, density, c, size, size, mode.finite, H0, H1, cof, out.force, out.slope);
  out.force *= pts.V0[p];
  out.slope *= pts.V0[p];
  out.loss = out.force * change;
  return true;
}

// Explicit, cohesive: adds the bulk viscosity of point p, intact or cracking, to the forces re of its
// corners. Its length is the smallest edge of the box that opens; a crack has none, and loses that of t(n)
//                                                                                                  (6.35)
template <int D>
void add_bulk(const Model& m, const Points& pts, const PointLaws& law, const Level& l0, Level& l1, int p,
              const double* H0, const double* H1, BulkStep& k, double* re)
{
  const HistoryStep h = history_of(law, l0, l1, p);
  const double before = h.n[law.viscous];
  const bool opens    = crack_opening(law.body[pts.body[p]], h.n) > 0.0;
  h.np1[law.viscous] = 0.0;
  if (opens && before == 0.0) return;
  const MatLaw of = law_now(m, pts, law.body[pts.body[p]], l0, CRACK_TANGENT, p, 1.0);
  const double* box    = of.crack.box;
  const double density = of.material->density, c = std::sqrt((of.lam + 2.0 * of.mu) / density),
               size    = *std::min_element(box, box + D), J0 = ip_det<D>(H0), J1 = ip_det<D>(H1);
  double q = before;
  if (k.dt > 0.0) {
    double span;
    q = bulk_stress(k, density, c, size, size, (J1 - J0) / (0.5 * (J0 + J1) * k.dt), span);
    if (opens) q = 0.0;
    k.loss += 0.5 * pts.V0[p] * (before + q) * (J1 - J0);
    if (!opens) k.xi = std::max(k.xi, span / size);
  }
  h.np1[law.viscous] = q;
  double cof[D * D];
  ip_cofactor<D>(H1, cof);
  const double* G = pts.G(p);
  for (int a = 0; a < pts.conn.count(p); ++a)
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j) re[a * D + i] += pts.V0[p] * q * cof[i * D + j] * G[a * D + j];
}

// ---- released points: the one mean gradient of a domain does not see the hourglass modes of its corners;
// they get the stiffness that the Gauss points of an element give them                               (7.33)

struct Hourglass {
  int modes = 0;               // 0: the point is not released, or its shape has no hourglass modes
  double gamma[4][8];          // vectors on the corners, orthogonal to linear displacement fields
  double k = 0.0;              // stiffness                                        force/length
};

template <int D>
Hourglass hourglass(const Points& pts, const MatLaw& law, int p)
{
  static const double h2[1][4] = {{1, -1, 1, -1}},
                      h3[4][8] = {{1, 1, -1, -1, -1, -1, 1, 1}, {1, -1, -1, 1, -1, 1, 1, -1},
                                  {1, -1, 1, -1, 1, -1, 1, -1}, {-1, 1, -1, 1, 1, -1, 1, -1}};
  Hourglass g;
  const int n = pts.conn.count(p);
  if (!pts.released[p] || n != (D == 2 ? 4 : 8)) return g;
  g.modes = D == 2 ? 1 : 4;
  const int* corner = pts.conn.begin(p);
  const double* G   = pts.G(p);
  double GG = 0.0;
  for (int k = 0; k < n * D; ++k) GG += G[k] * G[k];
  for (int m = 0; m < g.modes; ++m) {
    const double* h = D == 2 ? h2[0] : h3[m];
    for (int a = 0; a < n; ++a) g.gamma[m][a] = h[a] / n;
    for (int i = 0; i < D; ++i) {
      double hX = 0.0;
      for (int b = 0; b < n; ++b) hX += h[b] * pts.Xc[corner[b] * D + i] / n;
      for (int a = 0; a < n; ++a) g.gamma[m][a] -= hX * G[a * D + i];
    }
  }
  g.k = (D == 2 ? 2.0 / 3 : 8.0 / 9) * (law.lam3 + 3.0 * law.mu) * pts.V0[p] * GG;
  return g;
}

// amount of a mode [D]
template <int D>
void hourglass_amount(const Points& pts, const Hourglass& g, int m, const RealVec& uc, int p, double* q)
{
  for (int i = 0; i < D; ++i) q[i] = 0.0;
  for (int a = 0; a < pts.conn.count(p); ++a)
    for (int i = 0; i < D; ++i) q[i] += g.gamma[m][a] * uc[pts.conn.begin(p)[a] * D + i];
}

template <int D>
void hourglass_force(const Points& pts, const MatLaw& law, const KernelMode& mode, const Level& l0,
                     const Level& l1, int p, RealVec& fc)
{
  const Hourglass g = hourglass<D>(pts, law, p);
  for (int m = 0; m < g.modes; ++m) {
    double q0[D], q1[D];
    hourglass_amount<D>(pts, g, m, l0.uc, p, q0);
    hourglass_amount<D>(pts, g, m, l1.uc, p, q1);
    for (int a = 0; a < pts.conn.count(p); ++a)
      for (int i = 0; i < D; ++i)
        fc[pts.conn.begin(p)[a] * D + i] += g.k * g.gamma[m][a] * (mode.s_new * q1[i] + mode.s_old * q0[i]);
  }
}

template <int D>
double hourglass_energy(const Points& pts, const MatLaw& law, const Level& l, int p)
{
  const Hourglass g = hourglass<D>(pts, law, p);
  double sum = 0.0, q[D];
  for (int m = 0; m < g.modes; ++m) {
    hourglass_amount<D>(pts, g, m, l.uc, p, q);
    for (int i = 0; i < D; ++i) sum += 0.5 * g.k * q[i] * q[i];
  }
  return sum;
}

// the tangent for the grid unknowns of the corners: each unknown of a released point belongs to one corner
template <int D>
void hourglass_tangent(const Points& pts, const MatLaw& law, const KernelMode& mode, const ActiveGrid& grid,
                       int p, double* ke)
{
  const Hourglass g = hourglass<D>(pts, law, p);
  if (g.modes == 0) return;
  const int n = grid.point.count(p), *node = grid.point.begin(p);
  int corner_at[8];
  for (int a = 0; a < n; ++a)
    for (int b = 0; b < n; ++b)
      if (grid.corner.begin(pts.conn.begin(p)[b])[0] == node[a]) corner_at[a] = b;
  for (int m = 0; m < g.modes; ++m)
    for (int a = 0; a < n; ++a)
      for (int b = 0; b <= a; ++b)
        for (int i = 0; i < D; ++i)
          ke[pair_index(a, b) * D * D + i * (D + 1)] +=
              mode.s_new * g.k * g.gamma[m][corner_at[a]] * g.gamma[m][corner_at[b]];
}

// Input of bar_form for a group of points, on any nodes
template <int D>
struct Group {
  RealVec H0, H1, dNdX, V0;
  std::vector<HistoryStep> history;
  Group(const Points& pts, const PointLaws& law, const KernelMode& mode, const Level& l0, Level& l1, int k)
  {
    const int n    = law.group.count(k);
    const bool old = reads_old(pts, law, mode, law.group.begin(k)[0]);
    H0.resize(static_cast<size_t>(n) * D * D);
    H1.resize(H0.size());
    for (int i = 0; i < n; ++i) {
      const int p = law.group.begin(k)[i];
      if (old) gradient<D>(pts, l0.uc, p, &H0[i * D * D]);
      gradient<D>(pts, l1.uc, p, &H1[i * D * D]);
      V0.push_back(pts.V0[p]);
      history.push_back(history_of(law, l0, l1, p));
    }
  }
  // node [n]: nodes of all points of the group, ascending; each(i, use) calls use(node, gradient [D]) for the
  // nodes of the i-th point
  template <class Each>
  void set_nodes(int n, const int* node, Each each)
  {
    dNdX.assign(V0.size() * n * D, 0.0);
    for (size_t i = 0; i < V0.size(); ++i)
      each(static_cast<int>(i), [&](int of, const double* g) {
        const size_t a = std::lower_bound(node, node + n, of) - node;
        for (int j = 0; j < D; ++j) dNdX[(i * n + a) * D + j] += g[j];
      });
  }
  Status form(const MatLaw& law, const KernelMode& mode, int n, double* re, double* ke)
  {
    const BarGroup g{D, static_cast<int>(V0.size()), n, dNdX.data(), V0.data(), &law, volume_penalty(law)};
    return bar_form(g, mode, H0.data(), H1.data(), history.data(), re, ke);
  }
};

// force of the group k on its corners
template <int D>
Status group_force(const Points& pts, const PointLaws& law, const KernelMode& mode, const Level& l0,
                   Level& l1, int k, RealVec& fc)
{
  Group<D> group(pts, law, mode, l0, l1, k);
  const int* point = law.group.begin(k);
  IntVec corner;
  for (int i = 0; i < law.group.count(k); ++i) {
    const int* of = pts.conn.begin(point[i]);
    corner.insert(corner.end(), of, of + pts.conn.count(point[i]));
  }
  sort_once(corner);
  const int n = static_cast<int>(corner.size());
  group.set_nodes(n, corner.data(), [&](int i, auto use) {
    const double* G = pts.G(point[i]);
    for (int a = 0; a < pts.conn.count(point[i]); ++a) use(pts.conn.begin(point[i])[a], G + a * D);
  });
  RealVec re(static_cast<size_t>(n) * D);
  const Status status = group.form(law.body[pts.body[point[0]]], mode, n, re.data(), nullptr);
  for (int a = 0; a < n && status == STATUS_OK; ++a)
    for (int i = 0; i < D; ++i) fc[corner[a] * D + i] += re[a * D + i];
  return status;
}

// force of a pack, n of its points, on the corners; returns the lanes with det F <= 0
template <int D, int NEN>
unsigned pack_force(const Points& pts, const MatLaw& law, const KernelMode& mode, const RealVec& uc0,
                    const RealVec& uc1, const int* point, int n, RealVec& fc)
{
  const int nen = pts.conn.count(point[0]);
  Pack G[8 * D], V0, u[8 * D], H0[D * D] = {}, H1[D * D], Fb[D * D], S[D * D], re[8 * D] = {};
  load_points<D, NEN>(pts, point, nen, G, V0);
  load_ends<D, NEN>(pts, point, nen, uc1, u);
  ip_gradient<D, NEN>(G, nen, u, H1);
  if (mode_reads_old(mode, law)) {
    load_ends<D, NEN>(pts, point, nen, uc0, u);
    ip_gradient<D, NEN>(G, nen, u, H0);
  }
  const Pack det = ip_stress<D>(law, mode, H0, H1, Fb, S);
  ip_force<D, NEN>(G, nen, V0, Fb, S, re);
  add_corner_forces<D, NEN>(pts, point, n, nen, re, fc);
  unsigned bad = 0;
  for (int l = 0; l < n; ++l) bad |= static_cast<unsigned>(!(det[l] > 0.0)) << l;
  return bad;
}

template <int D>
Status corner_force(const Model& m, const Points& pts, const PointLaws& law, const KernelMode& mode,
                    const Level& l0, Level& l1, const IntVec& owned, const IntVec& groups, RealVec& fc,
                    int* worst)
{
  constexpr int block = D == 2 ? 4 : 8;              // corners of a quadrilateral or brick
  Status status = STATUS_OK;
  by_packs(pts, law, owned, [&](const int* point, int n) {
    const MatLaw& of_body = law.body[pts.body[point[0]]];
    const unsigned bad    = pts.conn.count(point[0]) == block
                                ? pack_force<D, block>(pts, of_body, mode, l0.uc, l1.uc, point, n, fc)
                                : pack_force<D, 0>(pts, of_body, mode, l0.uc, l1.uc, point, n, fc);
    for (int l = 0; l < n && bad; ++l) {
      if (!(bad >> l & 1)) continue;
      *worst = point[l];
      status = BAD_JACOBIAN;
    }
  }, [&](int p) {
    double H0[D * D] = {0}, H1[D * D], Fb[D * D], S[D * D], re[8 * D] = {0};
    const bool viscous = mode.bulk && !mode.mid && law_opens(law.body[pts.body[p]].kind) && !pts.eroded(p);
    gradient<D>(pts, l1.uc, p, H1);
    if (viscous || reads_old(pts, law, mode, p)) gradient<D>(pts, l0.uc, p, H0);
    if (form_one<D>(m, pts, law, mode, l0, l1, p, H0, H1, Fb, S, nullptr) != STATUS_OK) {
      *worst = p;
      status = BAD_JACOBIAN;
      return;
    }
    ip_force<D, 0>(pts.G(p), pts.conn.count(p), pts.V0[p], Fb, S, re);
    if (viscous) add_bulk<D>(m, pts, law, l0, l1, p, H0, H1, *mode.bulk, re);
    else if (law_opens(law.body[pts.body[p]].kind)) history_of(law, l0, l1, p).np1[law.viscous] = 0.0;
    double cof[D * D], rows[8 * D];
    BulkOfPoint q;
    if (bulk_of_point<D>(m, pts, law, mode, l0, l1, p, H0, H1, cof, q)) {
      bulk_rows<D>(cof, pts.G(p), pts.conn.count(p), rows);
      for (int i = 0; i < pts.conn.count(p) * D; ++i) re[i] += q.force * rows[i];
    }
    for (int a = 0; a < pts.conn.count(p); ++a)
      for (int i = 0; i < D; ++i) fc[pts.conn.begin(p)[a] * D + i] += re[a * D + i];
  });
  for (int p : owned)
    if (pts.released[p]) hourglass_force<D>(pts, law.body[pts.body[p]], mode, l0, l1, p, fc);
  for (int k : groups)
    if (group_force<D>(pts, law, mode, l0, l1, k, fc) != STATUS_OK) {
      *worst = law.group.begin(k)[0];
      status = BAD_JACOBIAN;
    }
  return status;
}

template <int D>
void tangent_pack(const Points& pts, const PointLaws& law, const KernelMode& mode,
                  const RealVec& uc0, const RealVec& uc1, const ActiveGrid& g, const int* point, double* ke)
{
  constexpr int block = D == 2 ? 4 : 8;
  const int n = g.point.count(point[0]);
  const MatLaw& of_body = law.body[pts.body[point[0]]];
  const bool old        = reads_old(pts, law, mode, point[0]);
  bool alike = true;
  for (int l = 0; l < PACK; ++l) alike = alike && pts.conn.count(point[l]) == block;
  Pack dS[POINT_PACK_NODES * D + PACK], f[POINT_PACK_NODES * D], V0, H0[D * D] = {}, H1[D * D], Fb[D * D],
      S[D * D];
  if (alike) {
    Pack G[8 * D], u[8 * D];
    load_points<D, block>(pts, point, block, G, V0);
    load_ends<D, block>(pts, point, block, uc1, u);
    ip_gradient<D, block>(G, block, u, H1);
    if (old) load_ends<D, block>(pts, point, block, uc0, u);
    if (old) ip_gradient<D, block>(G, block, u, H0);
  } else {
    for (int l = 0; l < PACK; ++l) V0[l] = pts.V0[point[l]];
    for (int l = 0; l < PACK; ++l) {
      double H[D * D];
      gradient<D>(pts, uc1, point[l], H);
      for (int k = 0; k < D * D; ++k) H1[k][l] = H[k];
      if (old) gradient<D>(pts, uc0, point[l], H);
      for (int k = 0; k < D * D && old; ++k) H0[k][l] = H[k];
    }
  }
  for (int k = 0; k < n * D; k += PACK) {
    for (int l = 0; l < PACK; ++l) {
      const double* from = &g.dS[static_cast<size_t>(g.point.off[point[l]]) * D];
      dS[k + l] = *reinterpret_cast<const PackRow*>(from + k);
    }
    pack_turn(dS + k);
  }
  ip_stress<D>(of_body, mode, H0, H1, Fb, S);
  ip_tangent<D, 0, true>(dS, n, V0, of_body, mode, Fb, S, f, reinterpret_cast<Pack*>(ke));
}

template <int D, int NEN>
Pack pack_energy(const Points& pts, const MatLaw& law, const RealVec& uc, const int* point)
{
  const int nen = pts.conn.count(point[0]);
  Pack G[8 * D], V0, u[8 * D], H[D * D], E[D * D], S[D * D], psi = {};
  load_points<D, NEN>(pts, point, nen, G, V0);
  load_ends<D, NEN>(pts, point, nen, uc, u);
  ip_gradient<D, NEN>(G, nen, u, H);
  ip_strain<D>(true, H, E);
  ip_law<D>(law, E, S);
  for (int k = 0; k < D * D; ++k) psi += 0.5 * S[k] * E[k];
  return psi * V0;
}

template <int D>
double energy(const Model& m, const Points& pts, const Level& l, const IntVec& owned)
{
  constexpr int block = D == 2 ? 4 : 8;
  const PointLaws law = point_laws(m);
  double sum = 0.0;
  by_packs(pts, law, owned, [&](const int* point, int n) {
    const MatLaw& of_body = law.body[pts.body[point[0]]];
    const Pack psi = pts.conn.count(point[0]) == block ? pack_energy<D, block>(pts, of_body, l.uc, point)
                                                       : pack_energy<D, 0>(pts, of_body, l.uc, point);
    for (int k = 0; k < n; ++k) sum += psi[k];
  }, [&](int p) {
    sum += point_energy_one(m, pts, l, p, !pts.eroded(p) ? 1.0 : l.degr[pts.parent[p]]);
  });
  for (int p : owned)
    if (pts.released[p]) sum += hourglass_energy<D>(pts, law.body[pts.body[p]], l, p);
  return sum;
}

template <int D>
void tangent(const Model& m, const Points& pts, const PointLaws& law, const KernelMode& mode,
             const Level& l0, Level& l1, const ActiveGrid& g, int p, RealVec& work, double* ke)
{
  double H0[D * D] = {0}, H1[D * D], Fb[D * D], S[D * D];
  const MatLaw& of_body = law.body[pts.body[p]];
  gradient<D>(pts, l1.uc, p, H1);
  if (reads_old(pts, law, mode, p)) gradient<D>(pts, l0.uc, p, H0);
  const int first = g.point.off[p], n = g.point.count(p);
  const double* dS = &g.dS[static_cast<size_t>(first) * D];
  if (!pts.eroded(p) && !is_general(pts, law, p)) {
    work.resize(static_cast<size_t>(n) * D);
    ip_stress<D>(of_body, mode, H0, H1, Fb, S);
    ip_tangent<D, 0>(dS, n, pts.V0[p], of_body, mode, Fb, S, work.data(), ke);
    hourglass_tangent<D>(pts, of_body, mode, g, p, ke);
    return;
  }
  constexpr int nv = VoigtIndex<D>::nv;
  double C[nv * nv];
  if (form_one<D>(m, pts, law, mode, l0, l1, p, H0, H1, Fb, S, C) != STATUS_OK) return;
  ip_tangent_general<D, 0>(dS, n, pts.V0[p], C, mode.cG(), Fb, S, ke);
  double cof[D * D];
  BulkOfPoint q;
  if (bulk_of_point<D>(m, pts, law, mode, l0, l1, p, H0, H1, cof, q)) {
    work.resize(static_cast<size_t>(n) * D);
    bulk_rows<D>(cof, dS, n, work.data());
    bulk_tangent<D>(q.slope, work.data(), n, ke);
  }
  hourglass_tangent<D>(pts, of_body, mode, g, p, ke);
}

template <int D>
void group_tangent(const Points& pts, const PointLaws& law, const KernelMode& mode, const Level& l0,
                   Level& l1, const ActiveGrid& g, int k, int n, const int* row, int first, double* ke)
{
  Group<D> group(pts, law, mode, l0, l1, k);
  const int* point = law.group.begin(k);
  group.set_nodes(n, row, [&](int i, auto use) {
    for (int a = g.point.off[point[i]]; a < g.point.off[point[i] + 1]; ++a)
      use(first + g.point.item[a], &g.dS[static_cast<size_t>(a) * D]);
  });
  RealVec re(static_cast<size_t>(n) * D);
  group.form(law.body[pts.body[point[0]]], mode, n, re.data(), ke);
}

}  // namespace

Status point_corner_force(const Model& m, const Points& pts, const PointLaws& law, const KernelMode& mode,
                          const Level& l0, Level& l1, const IntVec& owned, const IntVec& groups, RealVec& fc,
                          int* worst)
{
  return m.dim == 2 ? corner_force<2>(m, pts, law, mode, l0, l1, owned, groups, fc, worst)
                    : corner_force<3>(m, pts, law, mode, l0, l1, owned, groups, fc, worst);
}

void point_tangent(const Model& m, const Points& pts, const PointLaws& law, const KernelMode& mode,
                   const Level& l0, Level& l1, const ActiveGrid& g, int p, RealVec& work, double* ke)
{
  if (m.dim == 2)
    tangent<2>(m, pts, law, mode, l0, l1, g, p, work, ke);
  else
    tangent<3>(m, pts, law, mode, l0, l1, g, p, work, ke);
}

void point_group_tangent(const Model& m, const Points& pts, const PointLaws& law, const KernelMode& mode,
                         const Level& l0, Level& l1, const ActiveGrid& g, int k, int n, const int* row,
                         int first, double* ke)
{
  if (m.dim == 2) group_tangent<2>(pts, law, mode, l0, l1, g, k, n, row, first, ke);
  else group_tangent<3>(pts, law, mode, l0, l1, g, k, n, row, first, ke);
}

void point_tangent_pack(int dim, const Points& pts, const PointLaws& law, const KernelMode& mode,
                        const RealVec& uc0, const RealVec& uc1, const ActiveGrid& g, const int* point,
                        double* ke)
{
  if (dim == 2) tangent_pack<2>(pts, law, mode, uc0, uc1, g, point, ke);
  else tangent_pack<3>(pts, law, mode, uc0, uc1, g, point, ke);
}

namespace {

// law of the intact points of a body
MatLaw law_of_body(const Model& m, const Body& body)
{
  MatLaw law = mat_law(m.material[body.material], m.dim == 2 ? body.plane : PLANE_NONE);
  point_crack_law(m, body, law);
  return law;
}

}  // namespace

PointLaws point_laws(const Model& m)
{
  PointLaws law;
  for (const Body& b : m.body) law.body.push_back(law_of_body(m, b));
  law.history = law_history(m);
  law.viscous = law.history - 1;
  return law;
}

void point_groups(const Points& pts, PointLaws& law)
{
  law.group = ListTable();
  law.group_of.clear();
  if (std::none_of(law.body.begin(), law.body.end(), [](const MatLaw& l) { return l.bar; })) return;
  const auto shares = [&](int p) {
    return law.body[pts.body[p]].bar && pts.broken[p] < 0 && !pts.released[p];
  };
  law.group_of.assign(pts.npoint, -1);
  for (int p = 0; p < pts.npoint; ++p) {
    if (law.group_of[p] >= 0 || !shares(p)) continue;
    int q = p;
    do {
      if (shares(q)) {
        law.group_of[q] = law.group.size();
        law.group.item.push_back(q);
      }
      q = pts.next[q];
    } while (q != p);
    law.group.off.push_back(static_cast<int>(law.group.item.size()));
  }
}

namespace {

// position, displacement gradient and volume of a point; uc [ncorner*dim]
void point_motion(const Points& pts, int dim, const RealVec& uc, int p, IpFields& out)
{
  out    = IpFields();
  out.V0 = pts.V0[p];
  const double *w = pts.w(p), *G = pts.G(p);
  for (int a = 0; a < pts.conn.count(p); ++a) {
    const int c = pts.conn.begin(p)[a];
    for (int i = 0; i < dim; ++i) {
      const double X = pts.Xc[c * dim + i], u = uc[c * dim + i];
      out.X[i] += w[a] * X;
      out.x[i] += w[a] * (X + u);
      for (int j = 0; j < dim; ++j) out.F[3 * i + j] += u * G[a * dim + j];
    }
  }
}

// strain [6] for the law of a point, and the scale of its F                             (1.14)
template <int D>
void general_strain(const Points& pts, const MatLaw& law, const RealVec& uc, int p, double* E, double* scale)
{
  double own[D * D];
  gradient<D>(pts, uc, p, own);
  if (!law.bar) {
    double plane[D * D];
    ip_strain<D>(true, own, plane);
    six_components<D>(plane, E);
    *scale = 1.0;
    return;
  }
  RealVec H(own, own + D * D), V0{pts.V0[p]};
  for (int q = pts.next[p]; q != p; q = pts.next[q]) {
    if (pts.broken[q] >= 0 || pts.released[q]) continue;
    H.resize(H.size() + D * D);
    gradient<D>(pts, uc, q, &H[H.size() - D * D]);
    V0.push_back(pts.V0[q]);
  }
  RealVec all(6 * V0.size()), scales(V0.size(), 1.0);
  const BarGroup g{D, static_cast<int>(V0.size()), 0, nullptr, V0.data(), &law};
  if (!bar_strains(g, true, H.data(), all.data(), scales.data())) all.assign(all.size(), std::nan(""));
  std::copy_n(all.data(), 6, E);
  *scale = scales[0];
}

template <int D>
double viscous_loss(const Points& pts, const PointLaws& law, const Level& l0, const Level& l1,
                    const IntVec& owned)
{
  double sum = 0.0, dE[6], E0[6], scale;
  for (int p : owned) {
    const MatLaw& of_body = law.body[pts.body[p]];
    if (of_body.beta == 0.0 || pts.eroded(p)) continue;
    general_strain<D>(pts, of_body, l0.uc, p, E0, &scale);
    general_strain<D>(pts, of_body, l1.uc, p, dE, &scale);
    for (int k = 0; k < 6; ++k) dE[k] -= E0[k];
    sum += of_body.beta * pts.V0[p] * law_viscous_work(of_body, dE);
  }
  return sum;
}

// law of a point at the end of an increment, with its strain [6] and the scale of F
//   in   c   degradation factor of a broken point
MatLaw law_at_end(const Model& m, const Points& pts, const MatLaw& law, const Level& l, int p, double c,
                  double* E, double* scale)
{
  const MatLaw now = law_now(m, pts, law, l, CRACK_TANGENT, p, c);      // with the width of l
  if (m.dim == 2) general_strain<2>(pts, now, l.uc, p, E, scale);
  else general_strain<3>(pts, now, l.uc, p, E, scale);
  return now;
}

// energy of the penalty that ties the changes of volume of a point and its group              (1.14)
double deviation_energy(const MatLaw& law, double scale)
{
  const double deviation = scale == 1.0 ? 0.0 : 3.0 * std::log(scale);       // thetabar - theta
  return 0.5 * volume_penalty(law) * deviation * deviation;
}

// c: degradation factor of a broken point
void point_fields(const Model& m, const Points& pts, const Level& l, int p, double c, IpFields& out)
{
  const MatLaw law = law_of_body(m, m.body[pts.body[p]]);
  point_motion(pts, m.dim, l.uc, p, out);
  if (!pts.eroded(p) && !law_is_general(law)) {
    ip_fields_from(law, m.dim, true, out);
    return;
  }
  double E[6], scale;
  const MatLaw now = law_at_end(m, pts, law, l, p, c, E, &scale);
  ip_general_from(now, true, E, scale, history_at(l.hp, point_history_size(pts, l), p), out);
  out.psi += deviation_energy(now, scale);
  if (law_opens(law.kind) && !pts.eroded(p))
    out.opening = crack_opening(law, history_at(l.hp, point_history_size(pts, l), p));
}

}  // namespace

void point_ip_fields(const Model& m, const Points& pts, const Level& l, int p, IpFields& out)
{
  point_fields(m, pts, l, p, !pts.eroded(p) ? 1.0 : l.degr[pts.parent[p]], out);
}

// of a broken point or a general law the energy alone
double point_energy_one(const Model& m, const Points& pts, const Level& l, int p, double c)
{
  const MatLaw law = law_of_body(m, m.body[pts.body[p]]);
  if (!pts.eroded(p) && !law_is_general(law)) {
    IpFields f;
    point_fields(m, pts, l, p, c, f);
    return f.psi * f.V0;
  }
  double E[6], scale, none[MAX_HISTORY];
  LawOutput out;
  const MatLaw now = law_at_end(m, pts, law, l, p, c, E, &scale);
  if (!law_update(now, true, E, history_at(l.hp, point_history_size(pts, l), p), none, false, out))
    return std::nan("");
  return (out.psi + deviation_energy(now, scale)) * pts.V0[p];
}

double point_energy(const Model& m, const Points& pts, const Level& l, const IntVec& owned)
{
  return m.dim == 2 ? energy<2>(m, pts, l, owned) : energy<3>(m, pts, l, owned);
}

namespace {

template <int D>
double bulk_loss(const Model& m, const Points& pts, const PointLaws& law, const KernelMode& mode,
                 const Level& l0, Level& l1, const IntVec& owned)
{
  double sum = 0.0, H0[D * D], H1[D * D], cof[D * D];
  BulkOfPoint q;
  for (int p : owned) {
    if (!law_opens(law.body[pts.body[p]].kind)) continue;
    gradient<D>(pts, l0.uc, p, H0);
    gradient<D>(pts, l1.uc, p, H1);
    if (bulk_of_point<D>(m, pts, law, mode, l0, l1, p, H0, H1, cof, q)) sum += q.loss;
  }
  return sum;
}

}  // namespace

double point_bulk_loss(const Model& m, const Points& pts, const PointLaws& law, const KernelMode& mode,
                       const Level& l0, Level& l1, const IntVec& owned)
{
  return m.dim == 2 ? bulk_loss<2>(m, pts, law, mode, l0, l1, owned)
                    : bulk_loss<3>(m, pts, law, mode, l0, l1, owned);
}

double point_viscous_loss(const Points& pts, int dim, const PointLaws& law, const Level& l0, const Level& l1,
                          const IntVec& owned)
{
  return dim == 2 ? viscous_loss<2>(pts, law, l0, l1, owned) : viscous_loss<3>(pts, law, l0, l1, owned);
}

MatLaw broken_law(const Model& m, const Points& pts, int p)
{
  const MatLaw intact = mat_law(point_material(m, pts, p), m.body[pts.body[p]].plane);
  return law_broken(intact, m.fracture[pts.broken[p]], 0.0, &pts.normal[3 * static_cast<size_t>(p)]);
}

void point_dissipated(const Model& m, const Points& pts, const Level& l, const IntVec& owned, double& plastic,
                      double& cohesive)
{
  const size_t history = point_history_size(pts, l);
  if (history == 0) return;
  for (int p : owned) {
    const bool broken = pts.eroded(p) && m.fracture[pts.broken[p]].criterion == CRITERION_COHESIVE,
               opened = broken || m.body[pts.body[p]].fracture >= 0;
    const double* h = history_at(l.hp, history, p);
    double flowed   = 0.0;
    if (opened && law_flows(point_material(m, pts, p).law)) {
      const MatLaw law = broken ? broken_law(m, pts, p) : law_of_body(m, m.body[pts.body[p]]);
      flowed = h[law_field(law_of(law), HISTORY_FLOW_WORK)];
    }
    (opened ? cohesive : plastic) += pts.V0[p] * (h[HISTORY_DISSIPATED] - flowed);
    plastic += pts.V0[p] * flowed;
  }
}
