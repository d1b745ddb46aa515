#include <algorithm>
#include <cmath>

#include "base/comm.h"
#include "base/weibull.h"
#include "mat/law.h"
#include "mat/voigt.h"
#include "point/grid_cell.h"
#include "point/point_body.h"

namespace {

// edges of the box that opens as one: a cell of the grid, or the domain where it is larger      (2.36a)
void find_box(const Model& m, const Points& pts, int p, double* box)
{
  for (int i = 0; i < m.dim; ++i) {
    double lo = HUGE_VAL, hi = -HUGE_VAL;
    for (int a = 0; a < pts.conn.count(p); ++a) {
      const double X = pts.Xc[static_cast<size_t>(pts.conn.begin(p)[a]) * m.dim + i];
      lo = std::min(lo, X);
      hi = std::max(hi, X);
    }
    box[i] = std::max(m.grid.h[i], hi - lo);
  }
}

// index in hp of the factor of strength and toughness of point p: before the last, see law_history
size_t scatter_at(const Points& pts, const RealVec& hp, int p)
{
  return hp.size() / pts.npoint * (static_cast<size_t>(p) + 1) - 2;
}

// a law of the kind of this body
MatLaw kind_of(const Model& m, const Body& body)
{
  MatLaw law;
  law.kind = law_flows(m.material[body.material].law) ? LAW_COHESIVE_FLOW : LAW_COHESIVE;
  return law;
}

// ---- width of the band of a point that reaches into several cells                               (2.36b)

// The width is at most this part of that beyond which the law snaps back: less of a domain in cells that open
// counts as if it were as much  (test: strength/bar_shift.inp)
const double MAX_LIMIT = 0.5;
// A cell opens with those beside it from this part of their strain on  (test: strength/band_points.inp)
const double OPENS_WITH = 0.3;
// A cell that holds less than this part of a domain counts less for it  (test: strength/band_points.inp)
const double SLIVER = 0.1;
// The strain of a cell is the mean over its points by this power of the part of each in the cell
// (test: strength/bar_shift.inp)
const int POWER = 16;
// A point has come into cells whose crack is open by this part of that of zero traction if its strain is
// below this part of theirs  (test: strength/bar_shift.inp)
const double OPENED = 0.5, NEWCOMER = 0.2;

// cells that the domain of a point reaches into, at most  (no test)
const int MAX_CELLS = 64;

// Cells of the grid that the domain of a point reaches into, and the part of it in each
struct DomainCells {
  int n = 0;
  long key[MAX_CELLS];
  double part[MAX_CELLS];
};

// box of the extents of the domain along the axes, reduced to its volume
void domain_box(const Model& m, const Points& pts, const RealVec& uc, int p, double* lo, double* hi)
{
  double volume = 1.0, mid[3] = {0, 0, 0};
  for (int i = 0; i < m.dim; ++i) {
    lo[i] = HUGE_VAL;
    hi[i] = -HUGE_VAL;
    for (int a = 0; a < pts.conn.count(p); ++a) {
      const size_t c = static_cast<size_t>(pts.conn.begin(p)[a]) * m.dim + i;
      lo[i] = std::min(lo[i], pts.Xc[c] + uc[c]);
      hi[i] = std::max(hi[i], pts.Xc[c] + uc[c]);
      mid[i] += pts.w(p)[a] * (pts.Xc[c] + uc[c]);
    }
    volume *= hi[i] - lo[i];
  }
  const Body& body  = m.body[pts.body[p]];
  const double own  = std::fabs(point_gradient(pts, m.dim, uc, p).determinant()) * pts.V0[p] /
                      (m.dim == 2 ? body.thickness : 1.0),
               scale = volume > own ? std::pow(own / volume, 1.0 / m.dim) : 1.0;
  for (int i = 0; i < m.dim && scale < 1.0; ++i) {
    const double half = 0.5 * scale * (hi[i] - lo[i]);
    lo[i] = mid[i] - half;
    hi[i] = mid[i] + half;
  }
}

DomainCells domain_cells(const Model& m, const Points& pts, const RealVec& uc, int p)
{
  const double TOUCHES = 1e-6;         // of a cell: what reaches less far into it, rounding among it, is out
  const Grid& g = m.grid;
  double lo[3], hi[3];
  domain_box(m, pts, uc, p, lo, hi);
  int first[3] = {0, 0, 0}, last[3] = {0, 0, 0}, at[3];
  for (int i = 0; i < m.dim; ++i) {
    lo[i] = (lo[i] - g.lo[i]) / g.h[i];
    hi[i] = (hi[i] - g.lo[i]) / g.h[i];
    first[i] = std::clamp(static_cast<int>(std::floor(lo[i] + TOUCHES)), 0, g.n[i] - 1);
    last[i]  = std::clamp(static_cast<int>(std::ceil(hi[i] - TOUCHES)) - 1, first[i], g.n[i] - 1);
  }
  long cells = 1;
  for (int i = 0; i < m.dim; ++i) cells *= last[i] - first[i] + 1;
  MPFE_CHECK(cells <= MAX_CELLS, "the domain of a point reaches into more than 64 cells of the grid");
  DomainCells d;
  const auto overlap = [&](int i) {
    return std::max(0.0, std::min(hi[i], at[i] + 1.0) - std::max(lo[i], static_cast<double>(at[i]))) /
           (hi[i] - lo[i]);
  };
  for (at[2] = first[2]; at[2] <= last[2]; ++at[2])
    for (at[1] = first[1]; at[1] <= last[1]; ++at[1])
      for (at[0] = first[0]; at[0] <= last[0]; ++at[0]) {
        double part = 1.0;
        for (int i = 0; i < m.dim; ++i) part *= overlap(i);
        d.key[d.n]    = cell_key(g, m.dim, m.body[pts.body[p]].field, at);
        d.part[d.n++] = part;
      }
  return d;
}

// domain_cells of points, computed once each
struct CellsOfPoints {
  const Model& m;
  const Points& pts;
  const RealVec& uc;
  IntVec first;                // [npoint] index of the first cell, -1: not computed
  IntVec number;               // [npoint] of cells
  std::vector<long> key;
  RealVec part;

  CellsOfPoints(const Model& of, const Points& points, const RealVec& laid)
    : m(of), pts(points), uc(laid), first(points.npoint, -1), number(points.npoint, 0)
  {
  }
  // the cells of point p: their number; keys and parts begin at first[p]
  int compute(int p)
  {
    if (first[p] >= 0) return number[p];
    const DomainCells d = domain_cells(m, pts, uc, p);
    first[p]  = static_cast<int>(key.size());
    number[p] = d.n;
    key.insert(key.end(), d.key, d.key + d.n);
    part.insert(part.end(), d.part, d.part + d.n);
    return d.n;
  }
};

bool may_crack(const Model& m, const Points& pts, int p) { return m.body[pts.body[p]].fracture >= 0; }

// strain across the widest crack of point p at t(n), 0: it has none                              (2.34)
double crack_strain(const Model& m, const Points& pts, const PointLaws& law, const Level& l, int p)
{
  const double* h = history_at(l.hp, law.history, p);
  const double k  = crack_opening(law.body[pts.body[p]], h);
  if (k == 0.0) return 0.0;
  MatLaw of      = law.body[pts.body[p]];
  const double b = crack_band(of, h);
  const FractureDef& f = m.fracture[m.body[pts.body[p]].fracture];
  if (f.weibull > 0.0) of.crack.scatter = l.hp[scatter_at(pts, l.hp, p)];
  const Eigen::Matrix3d F = point_gradient(pts, m.dim, l.uc, p),
                        E = 0.5 * (F.transpose() * F - Eigen::Matrix3d::Identity());
  double six[6], none[MAX_HISTORY];
  six_components<3>(E.data(), 0.0, six);
  LawOutput out;
  const Eigen::Map<const Eigen::Vector3d> N(crack_normal(of, h));
  const double carries = crack_traction(of.crack, k);
  if (carries > 0.0 && law_update(of, true, six, h, none, false, out)) {
    Eigen::Matrix3d S;
    full_tensor<3>(out.S, S.data());
    return std::clamp(N.dot(S * N) / carries, 0.0, 1.0) * k / b;
  }
  // open: of the strain alone
  const double whole     = of.lam * E.trace() + 2.0 * of.mu * N.dot(E * N);
  return std::clamp(whole / (of.lam + 2.0 * of.mu), 0.0, k / b);
}

// Sums over the points of a cell: weights, those times the strains across the cracks; tensor of the opening,
// sum of volume x strain x N N, of which the largest axis is the mean normal: 11 22 33 12 23 31
struct CellSum {
  long key;
  double weight, strain, opening[6];
};

// sums over the points of all ranks, in ascending order of the cells. Collective
void sum_cells(std::vector<CellSum>& all)
{
  comm_allgatherv(all);
  std::stable_sort(all.begin(), all.end(), [](const CellSum& a, const CellSum& b) { return a.key < b.key; });
  size_t n = 0;
  for (const CellSum& c : all) {
    if (n > 0 && all[n - 1].key == c.key) {
      all[n - 1].weight += c.weight;
      all[n - 1].strain += c.strain;
      for (int i = 0; i < 6; ++i) all[n - 1].opening[i] += c.opening[i];
    } else {
      all[n++] = c;
    }
  }
  all.resize(n);
}

const CellSum* find_cell(const std::vector<CellSum>& all, long key)
{
  const auto it = std::lower_bound(all.begin(), all.end(), key,
                                   [](const CellSum& c, long of) { return c.key < of; });
  return it != all.end() && it->key == key ? &*it : nullptr;
}

// adds x N N, N the normal of the crack of point p
void add_opening(const PointLaws& law, const Points& pts, const Level& l, int p, double x, double* opening)
{
  using V = VoigtIndex<3>;
  const double* N = crack_normal(law.body[pts.body[p]], history_at(l.hp, law.history, p));
  for (int i = 0; i < 6; ++i) opening[i] += x * N[V::row[i]] * N[V::col[i]];
}

// Box of the cells of a list, in cells, and a margin; does the first corner of point p lie in it?
struct CellBox {
  double lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};

  CellBox(const Model& m, const std::vector<CellSum>& cells)
  {
    const double MARGIN = 5.0;         // more than the size of a domain
    for (const CellSum& c : cells) {
      int at[3];
      cell_of_key(m.grid, m.dim, c.key, at);
      for (int i = 0; i < m.dim; ++i) {
        lo[i] = std::min(lo[i], at[i] - MARGIN);
        hi[i] = std::max(hi[i], at[i] + 1.0 + MARGIN);
      }
    }
  }
  bool has(const Model& m, const Points& pts, const RealVec& uc, int p) const
  {
    const size_t c = static_cast<size_t>(pts.conn.begin(p)[0]) * m.dim;
    bool inside    = true;
    for (int i = 0; i < m.dim; ++i) {
      const double x = (pts.Xc[c + i] + uc[c + i] - m.grid.lo[i]) / m.grid.h[i];
      inside = inside && x >= lo[i] && x <= hi[i];
    }
    return inside;
  }
};

// mean strain across the cracks in the cells that cracked points reach into. Collective
//   out  strain   across the crack of each point of this rank [npoint]
std::vector<CellSum> cell_strains(const Model& m, const Points& pts, const PointLaws& law, const Level& l,
                                  CellsOfPoints& of, RealVec& strain)
{
  std::vector<CellSum> cracked, all;
  strain.assign(pts.npoint, 0.0);
  for (int p = 0; p < pts.npoint; ++p) {
    if (!may_crack(m, pts, p) || !point_counts(m, pts, p)) continue;
    strain[p] = crack_strain(m, pts, law, l, p);
    if (strain[p] == 0.0) continue;
    const int n = of.compute(p);
    for (int k = 0; k < n; ++k) cracked.push_back({of.key[of.first[p] + k], 0.0, 0.0, {}});
  }
  sum_cells(cracked);
  if (cracked.empty()) return cracked;
  const CellBox box(m, cracked);
  for (int p = 0; p < pts.npoint; ++p) {
    if (!point_counts(m, pts, p) || !box.has(m, pts, of.uc, p)) continue;
    const int n = of.compute(p);
    for (int k = of.first[p]; k < of.first[p] + n; ++k) {
      if (!find_cell(cracked, of.key[k])) continue;
      const double weight = pts.V0[p] * std::pow(of.part[k], POWER);
      all.push_back({of.key[k], weight, weight * strain[p], {}});
      const double opening = pts.V0[p] * of.part[k] * strain[p];
      if (opening > 0.0) add_opening(law, pts, l, p, opening, all.back().opening);
    }
  }
  sum_cells(all);
  return all;
}

// The cells of a point that open
struct OpenCells {
  double part   = 1.0;         // of its domain
  double strain = 0.0;         // largest
  double opening[6] = {};      // sum of their tensors
};

OpenCells open_cells(CellsOfPoints& of, const std::vector<CellSum>& cells, int p)
{
  const int n        = of.compute(p);
  const long* key    = &of.key[of.first[p]];
  const double* part = &of.part[of.first[p]];
  OpenCells open;
  double strain[MAX_CELLS], most = 0.0, sum = 0.0;
  for (int k = 0; k < n; ++k) {
    const CellSum* c = find_cell(cells, key[k]);
    strain[k] = c && c->weight > 0.0 ? c->strain / c->weight : 0.0;
    most      = std::max(most, strain[k] * std::min(1.0, part[k] / SLIVER));
  }
  for (int k = 0; k < n && most > 0.0; ++k) {
    const double share = part[k] * std::min(1.0, strain[k] / (OPENS_WITH * most));
    if (share == 0.0) continue;
    sum += share;
    const double* opening = find_cell(cells, key[k])->opening;
    for (int i = 0; i < 6; ++i) open.opening[i] += share * opening[i];
  }
  if (most > 0.0) open.part = std::min(1.0, sum);
  open.strain = most;
  return open;
}

// the largest axis of a tensor of openings                                                    [3]
Eigen::Vector3d mean_axis(const double* A)
{
  Eigen::Matrix3d full;
  full << A[0], A[3], A[5], A[3], A[1], A[4], A[5], A[4], A[2];
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(full).eigenvectors().col(2);
}

// width of the band of point p with this strain across its crack, 0: no crack, no traction, or closed;
// came: counts points that have come into cells whose crack is open
double band_of(const Model& m, const Points& pts, const PointLaws& law, const Level& l, CellsOfPoints& of,
               const std::vector<CellSum>& cells, int p, double strain, double& came)
{
  const double k = crack_opening(law.body[pts.body[p]], history_at(l.hp, law.history, p));
  if (k == 0.0) return 0.0;
  MatLaw now = law.body[pts.body[p]];
  point_crack(m, pts, l, p, CRACK_TANGENT, now);
  if (k >= crack_open(now.crack)) return 0.0;
  const OpenCells open = open_cells(of, cells, p);
  if (open.strain == 0.0 || strain == 0.0) return 0.0;
  const double box  = crack_width(now.crack, mean_axis(open.opening).data()), w = box * open.strain,
               most = std::max(box, MAX_LIMIT * crack_max_width(now));
  const bool comes = w > OPENED * crack_open(now.crack) && strain < NEWCOMER * open.part * open.strain;
  came += comes;
  return std::min(most, comes ? w / strain : box / open.part);
}

}  // namespace

int point_bands(const Model& m, const Points& pts, const Level& l, const RealVec& laid, PointLaws& law)
{
  law.band.clear();
  if (std::none_of(m.body.begin(), m.body.end(), [](const Body& b) { return b.fracture >= 0; })) return 0;
  RealVec strain;
  CellsOfPoints of(m, pts, laid);
  const std::vector<CellSum> cells = cell_strains(m, pts, law, l, of, strain);
  if (cells.empty()) return 0;
  double came = 0.0;
  law.band.assign(pts.npoint, 0.0);
  for (int p = 0; p < pts.npoint; ++p)
    if (may_crack(m, pts, p) && point_counts(m, pts, p))
      law.band[p] = band_of(m, pts, law, l, of, cells, p, strain[p], came);
  comm_sum(&came, 1);
  return static_cast<int>(came);
}

void point_crack(const Model& m, const Points& pts, const Level& l, int p, CrackTangent tangent, MatLaw& law)
{
  const Body& body       = m.body[pts.body[p]];
  const FractureDef& f   = m.fracture[body.fracture];
  const Eigen::Matrix3d F = point_gradient(pts, m.dim, l.uc, p);
  CrackLaw& c = law.crack;
  find_box(m, pts, p, c.box);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c.F[3 * i + j] = F(i, j);
  if (f.weibull > 0.0) c.scatter = l.hp[scatter_at(pts, l.hp, p)];
  c.tangent = tangent;
  law.broken = point_open(m, pts, l, p);
}

void point_scatter(const Model& m, const Points& pts, RealVec& hp)
{
  for (size_t b = 0; b < m.body.size(); ++b) {
    if (m.body[b].fracture < 0 || m.fracture[m.body[b].fracture].weibull == 0.0) continue;
    const FractureDef& f = m.fracture[m.body[b].fracture];
    IntVec point, at;          // the first point of each initial cell, and its number
    for (int p = 0; p < pts.npoint; ++p) {
      bool first = pts.body[p] == static_cast<int>(b);
      for (int q = pts.next[p]; q != p && first; q = pts.next[q]) first = q > p;
      if (!first) continue;
      point.push_back(p);
      at.push_back(pts.point_number(p));
    }
    const RealVec factor = weibull_draw(f.weibull, 1.0, f.seed, at);
    for (size_t k = 0; k < point.size(); ++k) {
      int q = point[k];
      do {
        hp[scatter_at(pts, hp, q)] = factor[k];
        q = pts.next[q];
      } while (q != point[k]);
    }
  }
}

void point_crack_law(const Model& m, const Body& body, MatLaw& law)
{
  if (body.fracture < 0) return;
  const FractureDef& f = m.fracture[body.fracture];
  law.kind      = law_flows(law.kind) ? LAW_COHESIVE_FLOW : LAW_COHESIVE;
  law.c         = f.stiffness;
  law.bar       = false;
  law.crack     = crack_of(f);
  law.crack.dim = m.dim;
}

double point_opening(const Model& m, const Points& pts, const Level& l, size_t n, int p)
{
  const Body& body = m.body[pts.body[p]];
  if (body.fracture < 0 || n == 0) return 0.0;
  return crack_opening(kind_of(m, body), history_at(l.hp, n, p)) /
         crack_open(crack_of(m.fracture[body.fracture]));
}

double point_crack_width(const Model& m, const Points& pts, const Level& l, int p)
{
  const MatLaw law = kind_of(m, m.body[pts.body[p]]);
  return crack_band(law, history_at(l.hp, point_history_size(pts, l), p));
}
