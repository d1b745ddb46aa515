#include <algorithm>
#include <cmath>

#include "base/comm.h"
#include "base/grow.h"
#include "base/log.h"
#include "base/part_points.h"
#include "model/lumped.h"
#include "point/filler.h"
#include "shape/shape.h"

int fill_corner(Filler& f, const double* X, int field)
{
  if (f.plan) {
    append(f.plan->X, X, X + f.m.dim);
    append(f.plan->number, -1);
    return static_cast<int>(f.plan->number.size()) - 1;
  }
  append(f.pts.Xc, X, X + f.m.dim);
  append(f.pts.field, field);
  append(f.pts.first_copy, f.pts.ncorner);
  append(f.pts.hang.off, f.pts.hang.off.back());
  return f.pts.ncorner++;
}

void point_domain(const Points& pts, int dim, const int* corner, int n, double* X)
{
  const int digits = 48;       // binary digits of a coordinate; corners of equal domains differ in the last 5
  for (int i = 0; i < dim; ++i) {
    double largest = 0.0;
    for (int c = 0; c < n; ++c) largest = std::max(largest, std::fabs(pts.Xc[corner[c] * dim + i]));
    int exponent;
    std::frexp(largest, &exponent);
    for (int c = 0; c < n; ++c) {
      const double from_first = pts.Xc[corner[c] * dim + i] - pts.Xc[corner[0] * dim + i];
      const double steps      = std::nearbyint(std::ldexp(from_first, digits - exponent));
      X[c * dim + i] = std::ldexp(steps, exponent - digits);
    }
  }
}

void fill_point(Filler& f, int body, Shape shape, const int* corner)
{
  if (f.plan) {
    Domain d;
    d.shape = shape;
    std::copy_n(corner, shape_info[shape].nen, d.corner);
    append(f.plan->domain[body], d);
    return;
  }
  const Body& b = f.m.body[body];
  const int dim = f.m.dim, nen = shape_info[shape].nen;
  Points& p = f.pts;
  double X[24], number[domain_numbers(8, 3)];
  point_domain(p, dim, corner, nen, X);
  double *w = number, *G = w + nen, *mc = G + nen * dim;
  const double V = cpdi_weights(shape, X, w, G);
  if (!(V > 0.0)) {
    log_error(
        "body %s: a material point near (%g, %g) has a domain of volume %g: the element it fills is turned "
        "inside out or degenerate",
        b.name.c_str(), p.Xc[corner[0] * dim], p.Xc[corner[0] * dim + 1], V);
    ++f.errors;
    return;
  }
  append(p.shape, int(shape));
  append(p.conn.item, corner, corner + nen);
  append(p.conn.off, static_cast<int>(p.conn.item.size()));
  append(p.sampled, 0);
  append(p.V0, V * (dim == 2 ? b.thickness : 1.0));
  append(p.mass, p.V0.back() * f.m.material[b.material].density);
  shape_mass(shape, X, p.mass.back() / V, mc);
  if (points_lumped(f.m, f.parent)) lump_mass(nen, mc);
  append(p.kind, domain_kind(nen, dim, number, p.kinds));
  append(p.body, body);
  append(p.label, ++p.npoint);
  append(p.parent, f.parent);
  append(p.next, p.npoint - 1);
  append(p.broken, -1);
  append(p.released, 0);
  append(p.normal, 3, 0.0);
}

bool fill_accepts(const Expr& where, const double* X, int dim, const char* kind, const std::string& name,
                  const DeckLine& deck_line, int& faults)
{
  if (where.is_const()) return true;
  const double value = expr_eval(where, X, 0.0);
  if (!std::isfinite(value) && faults++ == 0)
    log_error("%s %s (%s line %d): WHERE is not a finite number at %s", kind, name.c_str(),
              deck_line.file.c_str(), deck_line.line, position_text(X, dim).c_str());
  return value != 0.0;
}

namespace {

// box of cells x per_cell domains in each direction; with WHERE: only domains whose centre it accepts
struct Box {
  const Body& b;
  int dim, per_cell;
  int n[3] = {1, 1, 0};        // domains; n[2] = 0 in the plane
  double d[3] = {0, 0, 0};     // their size
  size_t domains() const { return static_cast<size_t>(n[0]) * n[1] * std::max(1, n[2]); }
  size_t cells() const { return static_cast<size_t>(n[0] / per_cell) * (n[1] / per_cell) *
                                std::max(1, n[2] / per_cell); }
  int corners_of_domain() const { return dim == 3 ? 8 : 4; }
};

Box make_box(const Model& m, int body)
{
  const Body& b = m.body[body];
  Box box{b, m.dim, b.per_cell};
  for (int i = 0; i < m.dim; ++i) {
    const double length = b.hi[i] - b.lo[i];
    const int cells = b.cells[i] > 0 ? b.cells[i]
                                     : std::max(1, static_cast<int>(std::lround(length / m.grid.h[i])));
    box.n[i] = cells * b.per_cell;
    box.d[i] = length / box.n[i];
  }
  return box;
}

// calls use(domain, cell, at) for all domains
template <class Use>
void each_domain(const Box& box, Use use)
{
  const int m = box.per_cell;
  int at[3];
  size_t domain = 0;
  for (at[2] = 0; at[2] < std::max(1, box.n[2]); ++at[2])
    for (at[1] = 0; at[1] < box.n[1]; ++at[1])
      for (at[0] = 0; at[0] < box.n[0]; ++at[0], ++domain)
        use(domain,
            (static_cast<size_t>(at[2] / m) * (box.n[1] / m) + at[1] / m) * (box.n[0] / m) + at[0] / m, at);
}

void centre_of(const Box& box, const int* at, double* X)
{
  for (int i = 0; i < 3; ++i) X[i] = i < box.dim ? box.b.lo[i] + (at[i] + 0.5) * box.d[i] : 0.0;
}

// c: grid indices of corner a of the domain at indices at
void corner_of(const int* at, int a, int* c)
{
  static const int step[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                 {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  for (int i = 0; i < 3; ++i) c[i] = at[i] + step[a][i];
}

void corner_position(const Box& box, const int* at, double* X)
{
  // the far face exactly at hi: bodies then meet meshes without gaps from round-off
  for (int i = 0; i < box.dim; ++i) X[i] = at[i] == box.n[i] ? box.b.hi[i] : box.b.lo[i] + at[i] * box.d[i];
}

// [domains] WHERE accepts the centre; empty: all are filled
std::vector<bool> filled_domains(const Box& box, Filler& f)
{
  if (box.b.fill != FILL_REGION) return {};
  std::vector<bool> filled(box.domains());
  int faults = 0;
  each_domain(box, [&](size_t domain, size_t, const int* at) {
    double X[3];
    centre_of(box, at, X);
    filled[domain] = fill_accepts(box.b.where, X, box.dim, "body", box.b.name, box.b.deck_line, faults);
  });
  f.errors += faults > 0;
  return filled;
}

// Part of a box: n domains from lo on
struct Part {
  int lo[3] = {0, 0, 0}, n[3] = {0, 0, 0};
  int layers = 1;              // layers of corners minus layers of domains; 0: 2D
  bool has(const int* at) const
  {
    for (int i = 0; i < 3; ++i)
      if (at[i] < lo[i] || at[i] >= lo[i] + n[i]) return false;
    return true;
  }
  bool has_corner(const int* at) const
  {
    for (int i = 0; i < 3; ++i)
      if (at[i] < lo[i] || at[i] > lo[i] + n[i]) return false;
    return n[0] > 0;
  }
  size_t domains() const { return static_cast<size_t>(n[0]) * n[1] * n[2]; }
  size_t corners() const { return n[0] ? static_cast<size_t>(n[0] + 1) * (n[1] + 1) * (n[2] + layers) : 0; }
  size_t domain(const int* at) const
  {
    return (static_cast<size_t>(at[2] - lo[2]) * n[1] + at[1] - lo[1]) * n[0] + at[0] - lo[0];
  }
  size_t corner(const int* at) const
  {
    return (static_cast<size_t>(at[2] - lo[2]) * (n[1] + 1) + at[1] - lo[1]) * (n[0] + 1) + at[0] - lo[0];
  }
};

// calls use(domain, cell, at) for all domains of a box that hold a point
template <class Use>
void each_filled(const Box& box, const std::vector<bool>& filled, Use use)
{
  each_domain(box, [&](size_t domain, size_t cell, const int* at) {
    if (filled.empty() || filled[domain]) use(domain, cell, at);
  });
}

// the domains of this rank, and those around them; has(cell) is called once per filled domain, in order
template <class Has>
Part part_of_box(const Box& box, const std::vector<bool>& filled, Has has)
{
  int lo[3] = {box.n[0], box.n[1], std::max(1, box.n[2])}, hi[3] = {-1, -1, -1};
  each_filled(box, filled, [&](size_t, size_t cell, const int* at) {
    if (!has(cell)) return;
    for (int i = 0; i < 3; ++i) {
      lo[i] = std::min(lo[i], at[i]);
      hi[i] = std::max(hi[i], at[i]);
    }
  });
  Part part;
  part.layers = box.dim == 3;
  for (int i = 0; i < 3 && hi[0] >= 0; ++i) {
    part.lo[i] = std::max(0, lo[i] - 1);
    part.n[i]  = std::min(hi[i] + 2, std::max(1, box.n[i])) - part.lo[i];
  }
  return part;
}

// does a filled domain before the one at indices at have its corner c?
bool made_before(const Box& box, const std::vector<bool>& filled, const int* at, const int* c)
{
  const int n[3]   = {box.n[0], box.n[1], std::max(1, box.n[2])};
  const auto order = [&](const int* d) { return (static_cast<size_t>(d[2]) * n[1] + d[1]) * n[0] + d[0]; };
  for (int k = 0; k < (box.dim == 3 ? 8 : 4); ++k) {
    const int d[3] = {c[0] - k % 2, c[1] - k / 2 % 2, c[2] - k / 4};
    bool inside = true;
    for (int i = 0; i < 3; ++i) inside = inside && d[i] >= 0 && d[i] < n[i];
    if (inside && order(d) < order(at) && (filled.empty() || filled[order(d)])) return true;
  }
  return false;
}

// Numbers the corners of filled domains in the order of the domains, from next on. Returns the numbers of the
// corners of a part, -1: no domain has it
IntVec number_corners(const Box& box, const std::vector<bool>& filled, const Part& part, int& next)
{
  IntVec number(part.corners(), -1);
  each_filled(box, filled, [&](size_t, size_t, const int* at) {
    for (int a = 0; a < box.corners_of_domain(); ++a) {
      int c[3];
      corner_of(at, a, c);
      if (!part.has_corner(c)) next += !made_before(box, filled, at, c);
      else if (number[part.corner(c)] < 0) number[part.corner(c)] = next++;
    }
  });
  return number;
}

// adds the corners of the domains of this rank, ascending by number; returns the index of each corner of the
// part, -1: not on this rank
IntVec add_corners(Filler& f, const Box& box, const Part& part, const IntVec& number,
                   const std::vector<char>& here)
{
  struct Corner { int number, at[3]; };
  std::vector<Corner> list;
  IntVec index(part.corners(), -1);
  each_domain(box, [&](size_t, size_t, const int* at) {
    if (!part.has(at) || !here[part.domain(at)]) return;
    for (int a = 0; a < box.corners_of_domain(); ++a) {
      Corner c;
      corner_of(at, a, c.at);
      int& i = index[part.corner(c.at)];
      if (i < 0) {
        c.number = number[part.corner(c.at)];
        list.push_back(c);
      }
      i = 0;
    }
  });
  std::sort(list.begin(), list.end(), [](const Corner& a, const Corner& b) { return a.number < b.number; });
  for (const Corner& c : list) {
    double X[3] = {0, 0, 0};
    corner_position(box, c.at, X);
    index[part.corner(c.at)] = fill_corner(f, X, box.b.field);
    if (f.pts.part.on) f.pts.part.corner.push_back(c.number);
  }
  return index;
}

struct Centre { double count = 0.0, x[3] = {0, 0, 0}; };

void add_position(Centre& c, double count, const double* X)
{
  c.count += count;
  for (int i = 0; i < 3; ++i) c.x[i] += count * (X[i] - c.x[i]) / c.count;
}

// centre of an element: the mean of its nodes
void centre_of(const Mesh& mesh, int e, double X[3])
{
  const int n = mesh.conn.count(e);
  std::fill(X, X + 3, 0.0);
  for (int a = 0; a < n; ++a)
    for (int i = 0; i < 3; ++i) X[i] += mesh.X[3 * mesh.conn.begin(e)[a] + i] / n;
}

// The rank of each part of the cells, which lie at X [n*3]: repeatedly the closest pair of a part and the
// finite elements of a rank (of_elem: their ranks), to have few bonds between ranks
IntVec ranks_of_parts(const Mesh& mesh, const IntVec& of_elem, const RealVec& X, const RealVec& work,
                     const IntVec& part)
{
  const int ranks = comm_size();
  std::vector<Centre> to(ranks), from(ranks);
  for (int e = 0; e < mesh.nelem(); ++e) {
    double x[3];
    centre_of(mesh, e, x);
    if (mesh.elem_section[e] >= 0) add_position(to[of_elem[e]], 1.0, x);
  }
  for (size_t c = 0; c < part.size(); ++c) add_position(from[part[c]], work[c], &X[3 * c]);
  IntVec rank(ranks, -1);
  std::vector<char> taken(ranks, 0);
  for (int k = 0; k < ranks; ++k) {
    int best = -1, of = -1;
    double least = 1e300;
    for (int p = 0; p < ranks; ++p)
      for (int r = 0; r < ranks && rank[p] < 0; ++r) {
        double distance = 0.0;                       // squared
        for (int i = 0; i < 3 && to[r].count > 0.0; ++i) distance += std::pow(from[p].x[i] - to[r].x[i], 2);
        if (to[r].count == 0.0) distance = 1e299;    // ranks without elements take the remaining parts
        if (taken[r] || distance >= least) continue;
        least = distance;
        best  = r;
        of    = p;
      }
    rank[of]    = best;
    taken[best] = 1;
  }
  return rank;
}

// stores the corners of a domain of another rank if it shares a corner with the domains of this one
void add_adjacent(const IntVec& number, const IntVec& index, Shape shape, const size_t* corner, int nen,
              PointPart& part)
{
  if (std::all_of(corner, corner + nen, [&](size_t c) { return index[c] < 0; })) return;
  for (int a = 0; a < nen; ++a) {
    part.outer_conn.item.push_back(index[corner[a]] >= 0 ? index[corner[a]] : -1 - number[corner[a]]);
    if (index[corner[a]] < 0) part.outer_corner.push_back(number[corner[a]]);
  }
  part.outer_conn.off.push_back(static_cast<int>(part.outer_conn.item.size()));
  part.outer_shape.push_back(shape);
}

// Rank of a cell, fast for queries nearly in order; not divided: this rank
class RankOfCell {
public:
  explicit RankOfCell(const CellRanks& ranks) : ranks_(ranks) {}
  int operator()(size_t cell)
  {
    const IntVec& first = ranks_.first;
    const auto starts   = [&](size_t k) { return static_cast<size_t>(first[k]); };
    if (first.empty()) return comm_rank();
    const bool inside = starts(at_) <= cell && (at_ + 1 == first.size() || cell < starts(at_ + 1));
    if (!inside)
      at_ = std::upper_bound(first.begin(), first.end(), static_cast<int>(cell)) - first.begin() - 1;
    return ranks_.rank[at_];
  }

private:
  const CellRanks& ranks_;
  size_t at_ = 0;              // the run of cells of the last query
};

// adds a point to the ring of the points of its cell; last: the last one created there, -1: none yet
void join_ring(Points& p, int point, int& last)
{
  if (last >= 0) std::swap(p.next[point], p.next[last]);
  last = point;
}

// Creates the point of a domain if this rank stores it (here), else stores its corners if it is adjacent
//   in   of_all   its number among the points of all ranks
//        rank     its owner
//        corner   [nen] its corners, in number (of all ranks) and index (on this rank, -1: none)
//        last     of join_ring, for its cell
void take_domain(Filler& f, int body, Shape shape, int of_all, bool here, int rank, const size_t* corner,
                 const IntVec& number, const IntVec& index, int& last)
{
  Points& p = f.pts;
  const int before = p.npoint, nen = shape_info[shape].nen;
  if (!here) return add_adjacent(number, index, shape, corner, nen, p.part);
  int c[8];
  for (int a = 0; a < nen; ++a) c[a] = index[corner[a]];
  fill_point(f, body, shape, c);
  if (p.npoint == before) return;
  if (p.part.on) {
    p.part.point.push_back(of_all);
    p.part.rank.push_back(rank);
    p.label.back() = of_all + 1;
  }
  if (rank == comm_rank()) join_ring(p, before, last);
}

// gives a domain corners of its own: copies of those that a domain before has taken          RESHAPE
//   inout taken   [corner] 1: a domain has it
void own_corners(Filler& f, int n, const size_t* corner, const IntVec& index, std::vector<char>& taken,
                 IntVec& own)
{
  for (int a = 0; a < n; ++a) {
    const int c = index[corner[a]], dim = f.m.dim;
    own[corner[a]] = c;
    if (!taken[corner[a]]++) continue;
    const RealVec X(&f.pts.Xc[c * dim], &f.pts.Xc[c * dim] + dim);
    own[corner[a]] = fill_corner(f, X.data(), f.pts.field[c]);
    f.pts.first_copy[own[corner[a]]] = c;
  }
}

}  // namespace

void fill_box(Filler& f, int body, const CellRanks& ranks)
{
  const Box box = make_box(f.m, body);
  const std::vector<bool> filled = filled_domains(box, f);
  const Shape shape = box.dim == 3 ? SHAPE_HEX8 : SHAPE_QUAD4;
  const int first = f.pts.part.npoint;
  RankOfCell rank_of(ranks);
  int next = first;                      // number of the next domain
  const Part part = part_of_box(box, filled, [&](size_t cell) { return f.has(next++, rank_of(cell)); });
  std::vector<char> here(part.domains(), 0);
  next = first;
  each_filled(box, filled, [&](size_t, size_t cell, const int* at) {
    if (part.has(at)) here[part.domain(at)] = f.has(next, rank_of(cell));
    ++next;
  });
  const IntVec number = number_corners(box, filled, part, f.pts.part.ncorner);
  const IntVec index  = add_corners(f, box, part, number, here);
  const bool reshape = box.b.reshape > 0.0;
  IntVec own = index;                    // corners of the domain with RESHAPE
  std::vector<char> taken(reshape ? index.size() : 0, 0);
  IntVec last(part.domains(), -1);       // of the first domain of a cell in the part: join_ring
  each_filled(box, filled, [&](size_t, size_t cell, const int* at) {
    const int of_all = f.pts.part.npoint++;
    if (!part.has(at)) return;
    size_t corner[8];
    for (int a = 0; a < box.corners_of_domain(); ++a) {
      int c[3];
      corner_of(at, a, c);
      corner[a] = part.corner(c);
    }
    int in_cell[3];                      // the first domain of the cell that the part has
    for (int i = 0; i < 3; ++i) in_cell[i] = std::max(part.lo[i], at[i] - at[i] % box.per_cell);
    if (reshape) own_corners(f, box.corners_of_domain(), corner, index, taken, own);
    take_domain(f, body, shape, of_all, here[part.domain(at)], rank_of(cell), corner, number, own,
                last[part.domain(in_cell)]);
  });
}

void fill_box_counts(Filler& f, int body)
{
  const Box box = make_box(f.m, body);
  const std::vector<bool> filled = filled_domains(box, f);
  each_filled(box, filled, [&](size_t, size_t, const int*) { ++f.pts.part.npoint; });
  number_corners(box, filled, Part(), f.pts.part.ncorner);
}

void fill_planned(Filler& f, int body, FillPlan& plan)
{
  PointPart& part = f.pts.part;
  const auto before = [&](int c, int number) { return plan.number[c] < number; };
  auto c = std::lower_bound(plan.used.begin(), plan.used.end(), part.ncorner, before);
  part.ncorner += plan.ncorner[body];
  for (; c != plan.used.end() && plan.number[*c] < part.ncorner; ++c) {
    plan.index[*c] = fill_corner(f, &plan.X[static_cast<size_t>(*c) * f.m.dim], f.m.body[body].field);
    part.corner.push_back(plan.number[*c]);
  }
  int elem = -1, last = -1;              // last point made in this element, -1: none yet
  for (const Domain& d : plan.domain[body]) {
    if (d.elem != elem) last = -1;
    elem = d.elem;
    size_t corner[8];
    std::copy_n(d.corner, 8, corner);
    take_domain(f, body, static_cast<Shape>(d.shape), d.point, f.has(d.point, d.rank), d.rank, corner,
                plan.number, plan.index, last);
  }
  part.npoint += plan.npoint[body];
}

namespace {

// numbers the cells of a fill with points in them, -1: without points; appends to positions X and counts work
IntVec number_cells(const RealVec& count, const RealVec& sum, RealVec& X, RealVec& work)
{
  IntVec out;
  for (size_t c = 0; c < count.size(); ++c) {
    out.push_back(count[c] > 0.0 ? static_cast<int>(work.size()) : -1);
    if (count[c] == 0.0) continue;
    for (int i = 0; i < 3; ++i) X.push_back(sum[3 * c + i] / count[c]);
    work.push_back(count[c]);
  }
  return out;
}

// number of points of an element of such a body, assumed the same for all shapes
int points_of_element(const Body& b, int dim)
{
  return b.per_cell * b.per_cell * (dim == 3 ? b.per_cell : 1);
}

// number of the points and sum of their positions, in the cells of a box or in elements
void count_cells(const Model& m, int body, RealVec& count, RealVec& sum)
{
  const Body& b = m.body[body];
  if (b.fill == FILL_ELSET) {
    const double points = points_of_element(b, m.dim);
    for (int e : m.elset[b.elset].item) {
      count.push_back(points);
      double x[3];
      centre_of(m.mesh, e, x);
      for (int i = 0; i < 3; ++i) sum.push_back(points * x[i]);
    }
    return;
  }
  const Box box     = make_box(m, body);
  const bool region = b.fill == FILL_REGION && !b.where.is_const();
  count.assign(box.cells(), 0.0);
  sum.assign(3 * box.cells(), 0.0);
  each_domain(box, [&](size_t, size_t cell, const int* at) {
    double x[3];
    centre_of(box, at, x);
    if (region && expr_eval(b.where, x, 0.0) == 0.0) return;
    for (int i = 0; i < 3; ++i) sum[3 * cell + i] += x[i];
    count[cell] += 1.0;
  });
}

// Cells with points of all bodies, in parts of equal work
struct CellParts {
  std::vector<IntVec> number;  // [body][cells of its fill] among those with points, -1: it has none
  RealVec X, work;             // [n*3], [n] mean position and number of the points
  IntVec part;                 // [n]
};

CellParts cells_with_points(const Model& m)
{
  CellParts c;
  for (size_t b = 0; b < m.body.size(); ++b) {
    RealVec count, sum;
    if (m.body[b].fill != FILL_CONVERSION) count_cells(m, static_cast<int>(b), count, sum);
    c.number.push_back(number_cells(count, sum, c.X, c.work));
  }
  return c;
}

}  // namespace

long point_fill_cells(const Model& m) { return static_cast<long>(cells_with_points(m).work.size()); }

void point_fill_ranks(IntVec& of_elem, Model& m)
{
  CellParts c = cells_with_points(m);
  c.part = part_points(c.X, c.work, comm_size());
  const IntVec to   = ranks_of_parts(m.mesh, of_elem, c.X, c.work, c.part);
  for (size_t b = 0; b < m.body.size(); ++b) {
    CellRanks runs;
    for (size_t k = 0; k < c.number[b].size(); ++k) {
      const int cell = c.number[b][k], rank = cell < 0 ? -1 : to[c.part[cell]];
      if (m.body[b].fill == FILL_ELSET) of_elem[m.elset[m.body[b].elset].item[k]] = rank;
      else if (runs.empty() || runs.rank.back() != rank) {
        runs.first.push_back(static_cast<int>(k));
        runs.rank.push_back(rank);
      }
    }
    m.body[b].rank = std::move(runs);
  }
}

IntVec point_fill_homes(const Model& m, const IntVec& of_elem, const IntVec& number)
{
  IntVec out;
  Points none;
  CornerShare share;
  Filler f{m, none, share};
  int next = 0;                          // number of the next point
  log_mute(true);
  const auto take = [&](int points, int rank) {
    next += points;
    while (out.size() < number.size() && number[out.size()] < next) out.push_back(rank);
  };
  for (size_t b = 0; b < m.body.size() && out.size() < number.size(); ++b) {
    const Body& body = m.body[b];
    if (body.fill == FILL_CONVERSION) continue;
    if (body.fill == FILL_ELSET) {
      for (int e : m.elset[body.elset].item) take(points_of_element(body, m.dim), of_elem[e]);
      continue;
    }
    const Box box = make_box(m, static_cast<int>(b));
    RankOfCell rank_of(body.rank);
    each_filled(box, filled_domains(box, f),
                [&](size_t, size_t cell, const int*) { take(1, rank_of(cell)); });
  }
  log_mute(false);
  MPFE_CHECK(out.size() == number.size(), "a point from the start is in no body");
  return out;
}
