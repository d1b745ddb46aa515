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
const double MAX_LIMIT = 0.9;
// A cell opens with those beside it from this part of their strain on  (test: strength/band_points.inp)
const double OPENS_WITH = 0.3;
// A cell that holds less than this part of a domain counts less for it; a domain with less than this part
// outside lies in the cell as a whole  (test: strength/band_points.inp)
const double SLIVER = 0.1;
// The strain of a cell is the mean over its points by this power of the part of each in the cell
// (test: strength/bar_shift.inp)
const int POWER = 16;
// A point has come into cells whose crack is open by this part of that of zero traction if its strain is
// below this part of theirs  (test: strength/bar_shift.inp)
const double OPENED = 0.5, NEWCOMER = 0.2;

// of a cell, or of a domain: what reaches less far into a cell, rounding among it, is out  (no test)
const double TOUCHES = 1e-6;

// cells that the domain of a point reaches into, at most  (no test)
const int MAX_CELLS = 64;

// Cells of the grid that the domain of a point reaches into, and the part of it in each; its box, in cells
struct DomainCells {
  int n = 0;
  long key[MAX_CELLS];
  double part[MAX_CELLS];
  double lo[3] = {0, 0, 0}, hi[3] = {0, 0, 0};
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
  const Grid& g = m.grid;
  DomainCells d;
  double *lo = d.lo, *hi = d.hi;
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
  RealVec box;                 // [computed][6] lo, hi
  IntVec box_at;               // [npoint] index of the box

  CellsOfPoints(const Model& of, const Points& points, const RealVec& laid)
    : m(of), pts(points), uc(laid), first(points.npoint, -1), number(points.npoint, 0),
      box_at(points.npoint, -1)
  {
  }
  DomainCells cells(int p)
  {
    if (first[p] < 0) return add(p);
    DomainCells d;
    d.n = number[p];
    std::copy_n(&key[first[p]], d.n, d.key);
    std::copy_n(&part[first[p]], d.n, d.part);
    std::copy_n(&box[6 * static_cast<size_t>(box_at[p])], 3, d.lo);
    std::copy_n(&box[6 * static_cast<size_t>(box_at[p]) + 3], 3, d.hi);
    return d;
  }
  DomainCells add(int p)
  {
    const DomainCells d = domain_cells(m, pts, uc, p);
    first[p]  = static_cast<int>(key.size());
    number[p] = d.n;
    box_at[p] = static_cast<int>(box.size() / 6);
    key.insert(key.end(), d.key, d.key + d.n);
    part.insert(part.end(), d.part, d.part + d.n);
    box.insert(box.end(), d.lo, d.lo + 3);
    box.insert(box.end(), d.hi, d.hi + 3);
    return d;
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
  six_components<3>(E.data(), six);
  LawOutput out;
  const Eigen::Map<const Eigen::Vector3d> N(crack_normal(of, h));
  const double carries = crack_traction(of.crack, k);
  if (carries > 0.0 && law_update(of, true, six, h, none, false, out))
    return std::clamp(N.dot(full_tensor(out.S) * N) / carries, 0.0, 1.0) * k / b;
  // open: of the strain alone
  const double whole     = of.lam * E.trace() + 2.0 * of.mu * N.dot(E * N);
  return std::clamp(whole / (of.lam + 2.0 * of.mu), 0.0, k / b);
}

// box of what a cell holds, in cells
struct FilledBox {
  double lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};

  void add(const FilledBox& f)
  {
    for (int i = 0; i < 3; ++i) {
      lo[i] = std::min(lo[i], f.lo[i]);
      hi[i] = std::max(hi[i], f.hi[i]);
    }
  }
};

// Sums over the points of a cell: weights, those times the strains across the cracks; tensor of the opening,
// sum of volume x strain x N N, of which the largest axis is the mean normal: 11 22 33 12 23 31
struct CellSum {
  long key;
  double weight = 0.0, strain = 0.0, opening[6] = {};
  FilledBox fill, opens;        // what all points fill of it; those that open, or lie in it as a whole
  bool crossed[3][2] = {};     // does another point lie across this face, axis and side?
  double most = 0.0;           // largest part of a domain in it
  long main   = -1;            // cell with the largest part of this domain; see join_slivers

  void add(const CellSum& c)
  {
    weight += c.weight;
    strain += c.strain;
    for (int i = 0; i < 6; ++i) opening[i] += c.opening[i];
    fill.add(c.fill);
    opens.add(c.opens);
    for (int i = 0; i < 3; ++i)
      for (int side = 0; side < 2; ++side) crossed[i][side] = crossed[i][side] || c.crossed[i][side];
    if (c.most > most || (c.most == most && c.main < main)) {
      most = c.most;
      main = c.main;
    }
  }
};

// sums over the points of all ranks, in ascending order of the cells. Collective
void sum_cells(std::vector<CellSum>& all)
{
  comm_allgatherv(all);
  std::stable_sort(all.begin(), all.end(), [](const CellSum& a, const CellSum& b) { return a.key < b.key; });
  size_t n = 0;
  for (const CellSum& c : all) {
    if (n > 0 && all[n - 1].key == c.key) all[n - 1].add(c);
    else all[n++] = c;
  }
  all.resize(n);
}

template <class Cells>
auto find_cell(Cells& all, long key) -> decltype(&all[0])
{
  const auto it = std::lower_bound(all.begin(), all.end(), key,
                                   [](const CellSum& c, long of) { return c.key < of; });
  return it != all.end() && it->key == key ? &*it : nullptr;
}

// does cell c, not full, lie at a face of another one, and fill it as far across as that one does?
bool flush(const Grid& g, int dim, const CellSum& c, const CellSum& to)
{
  const double TOL = 0.05;             // of a cell
  int at[3], beside[3], apart = 0;
  cell_of_key(g, dim, c.key, at);
  cell_of_key(g, dim, to.key, beside);
  bool full = true, same = true;
  for (int i = 0; i < dim; ++i) {
    full = full && c.fill.hi[i] - c.fill.lo[i] > 1.0 - TOUCHES;
    apart += std::abs(at[i] - beside[i]);
    if (at[i] == beside[i])
      same = same && std::fabs(c.fill.lo[i] - to.fill.lo[i]) < TOL &&
             std::fabs(c.fill.hi[i] - to.fill.hi[i]) < TOL;
  }
  return !full && apart == 1 && same;
}

// A cell with less than half of each domain in it opens with the cell beside it that holds the largest part:
// its nodes follow those of that cell (3.11), or the domain averages over both. Then main is the key of that
// cell, else the key of the cell itself
void join_slivers(const Grid& g, int dim, std::vector<CellSum>& all)
{
  std::vector<const CellSum*> sliver;
  for (CellSum& c : all) {
    const CellSum* main = c.most > 0.5 - TOUCHES ? nullptr : find_cell(all, c.main);
    if (main && main->most > 0.5 - TOUCHES && flush(g, dim, c, *main)) sliver.push_back(&c);
    else c.main = c.key;
  }
  for (const CellSum* c : sliver) {
    CellSum* to     = find_cell(all, c->main);
    const long main = to->main;
    to->add(*c);
    to->main = main;
  }
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

// A point across a face of a cell opens with it later, and counts for what opens of the cell, if the cell on
// the other side is full: in a cell that ends at a surface it alone carries the load, and stays whole
void open_faces(const Model& m, std::vector<CellSum>& all)
{
  for (CellSum& c : all) {
    int at[3];
    const int field = cell_of_key(m.grid, m.dim, c.key, at);
    for (int i = 0; i < m.dim; ++i)
      for (int side = 0; side < 2; ++side) {
        const int there = at[i] + 2 * side - 1;
        if (!c.crossed[i][side] || there < 0 || there >= m.grid.n[i]) continue;
        int beyond[3] = {at[0], at[1], at[2]};
        beyond[i] = there;
        const CellSum* other = find_cell(all, cell_key(m.grid, m.dim, field, beyond));
        if (!other || other->fill.hi[i] - other->fill.lo[i] < 1.0 - TOUCHES) continue;
        c.opens.lo[i] = std::min(c.opens.lo[i], at[i] + static_cast<double>(side));
        c.opens.hi[i] = std::max(c.opens.hi[i], at[i] + static_cast<double>(side));
      }
  }
}

// the cell and those at its faces
void list_cells(const Grid& g, int dim, long key, std::vector<CellSum>& list)
{
  int at[3];
  const int field = cell_of_key(g, dim, key, at);
  const auto add  = [&](long k) {
    list.emplace_back();
    list.back().key = k;
  };
  add(key);
  for (int i = 0; i < dim; ++i)
    for (int step : {-1, 1}) {
      int beside[3] = {at[0], at[1], at[2]};
      beside[i] += step;
      if (beside[i] >= 0 && beside[i] < g.n[i]) add(cell_key(g, dim, field, beside));
    }
}

// what point p fills of a cell; its part k of d
FilledBox filled(const Grid& g, int dim, const DomainCells& d, int k)
{
  FilledBox f;
  int at[3];
  cell_of_key(g, dim, d.key[k], at);
  for (int i = 0; i < dim; ++i) {
    f.lo[i] = std::max(d.lo[i], static_cast<double>(at[i]));
    f.hi[i] = std::min(d.hi[i], at[i] + 1.0);
  }
  return f;
}

// faces of cell c that the domain lies across
void note_crossed(const Grid& g, int dim, const DomainCells& d, CellSum& c)
{
  int at[3];
  cell_of_key(g, dim, c.key, at);
  for (int i = 0; i < dim; ++i) {
    c.crossed[i][0] = d.lo[i] < at[i] - TOUCHES;
    c.crossed[i][1] = d.hi[i] > at[i] + 1.0 + TOUCHES;
  }
}

// mean strain across the cracks in the cells that cracked points reach into. Collective
//   out  strain   across the crack of each point of this rank [npoint]
std::vector<CellSum> cell_strains(const Model& m, const Points& pts, const PointLaws& law, const Level& l,
                                  CellsOfPoints& of, RealVec& strain)
{
  std::vector<CellSum> cracked, all;
  std::vector<long> reached;
  strain.assign(pts.npoint, 0.0);
  for (int p = 0; p < pts.npoint; ++p) {
    if (!may_crack(m, pts, p) || !point_counts(m, pts, p)) continue;
    strain[p] = crack_strain(m, pts, law, l, p);
    if (strain[p] == 0.0) continue;
    const DomainCells d = of.cells(p);
    for (int k = 0; k < d.n; ++k) reached.push_back(d.key[k]);
  }
  std::sort(reached.begin(), reached.end());
  reached.erase(std::unique(reached.begin(), reached.end()), reached.end());
  for (long key : reached) list_cells(m.grid, m.dim, key, cracked);
  sum_cells(cracked);
  if (cracked.empty()) return cracked;
  const CellBox box(m, cracked);
  for (int p = 0; p < pts.npoint; ++p) {
    if (!point_counts(m, pts, p) || !box.has(m, pts, of.uc, p)) continue;
    const DomainCells d = of.cells(p);
    const long main     = d.key[std::max_element(d.part, d.part + d.n) - d.part];
    for (int k = 0; k < d.n; ++k) {
      if (!find_cell(cracked, d.key[k])) continue;
      CellSum c;
      c.key    = d.key[k];
      c.weight = pts.V0[p] * std::pow(d.part[k], POWER);
      c.strain = c.weight * strain[p];
      c.fill   = filled(m.grid, m.dim, d, k);
      c.most   = d.part[k];
      c.main   = main;
      if (strain[p] > 0.0) add_opening(law, pts, l, p, pts.V0[p] * d.part[k] * strain[p], c.opening);
      if (strain[p] > 0.0 || d.part[k] > 1.0 - SLIVER) c.opens = c.fill;
      else note_crossed(m.grid, m.dim, d, c);
      all.push_back(c);
    }
  }
  sum_cells(all);
  join_slivers(m.grid, m.dim, all);
  open_faces(m, all);
  return all;
}

// The cells of a point that open
struct OpenCells {
  int n = 0;
  const CellSum* cell[MAX_CELLS];
  double share[MAX_CELLS];     // of its domain
  double part   = 1.0;         // sum of them
  double strain = 0.0;         // largest
  double opening[6] = {};      // sum of their tensors
};

OpenCells open_cells(CellsOfPoints& of, const std::vector<CellSum>& cells, int p)
{
  const DomainCells d = of.cells(p);
  OpenCells open;
  for (int k = 0; k < d.n; ++k) {
    const CellSum* c = find_cell(cells, d.key[k]);
    if (c && c->main != c->key) c = find_cell(cells, c->main);
    if (!c) continue;
    int q = 0;
    while (q < open.n && open.cell[q] != c) ++q;
    if (q == open.n) {
      open.cell[open.n]    = c;
      open.share[open.n++] = 0.0;
    }
    open.share[q] += d.part[k];
  }
  double strain[MAX_CELLS], sum = 0.0;
  for (int k = 0; k < open.n; ++k) {
    strain[k]   = open.cell[k]->weight > 0.0 ? open.cell[k]->strain / open.cell[k]->weight : 0.0;
    open.strain = std::max(open.strain, strain[k] * std::min(1.0, open.share[k] / SLIVER));
  }
  if (open.strain == 0.0) return open;
  for (int k = 0; k < open.n; ++k) {
    open.share[k] *= std::min(1.0, strain[k] / (OPENS_WITH * open.strain));
    sum += open.share[k];
    for (int i = 0; i < 6; ++i) open.opening[i] += open.share[k] * open.cell[k]->opening[i];
  }
  open.part = std::min(1.0, sum);
  return open;
}

// the largest axis of a tensor of openings                                                    [3]
Eigen::Vector3d mean_axis(const double* A)
{
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(full_tensor(A)).eigenvectors().col(2);
}

// Width of what opens of the cells along the mean normal of their cracks: the mean over the cells by their
// shares. box: edges of a whole cell, or of the domain where it is larger                       (2.36b)
double open_width(int dim, const OpenCells& open, CrackLaw c)
{
  const Eigen::Vector3d axis = mean_axis(open.opening);
  double box[3], width = 0.0, sum = 0.0;
  std::copy_n(c.box, 3, box);
  for (int k = 0; k < open.n; ++k) {
    if (open.share[k] == 0.0) continue;
    for (int i = 0; i < dim; ++i) c.box[i] = box[i] * (open.cell[k]->opens.hi[i] - open.cell[k]->opens.lo[i]);
    width += open.share[k] * crack_width(c, axis.data());
    sum += open.share[k];
  }
  return width / sum;
}

// width of the band of point p with this strain across its crack, 0: no crack, or closed;
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
  const double box  = open_width(m.dim, open, now.crack), w = box * open.strain,
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
