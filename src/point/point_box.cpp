#include <algorithm>
#include <cmath>

#include "base/comm.h"
#include "base/grow.h"
#include "base/log.h"
#include "base/part_places.h"
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
  append(f.pts.twin, f.pts.ncorner);
  append(f.pts.hang.off, f.pts.hang.off.back());
  return f.pts.ncorner++;
}

void point_domain(const Points& pts, int dim, const int* corner, int n, double* X)
{
  const int digits = 48;       // of a place; corners of equal domains differ in the last 5
  for (int i = 0; i < dim; ++i) {
    double most = 0.0;
    for (int c = 0; c < n; ++c) most = std::max(most, std::fabs(pts.Xc[corner[c] * dim + i]));
    int exponent;
    std::frexp(most, &exponent);
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
                  const Place& place, int& faults)
{
  if (where.is_const()) return true;
  const double value = expr_eval(where, X, 0.0);
  if (!std::isfinite(value) && faults++ == 0)
    log_error("%s %s (%s line %d): WHERE is not a finite number at %s", kind, name.c_str(),
              place.file.c_str(), place.line, position_text(X, dim).c_str());
  return value != 0.0;
}

namespace {

// box of cells x per_cell domains in each direction; with where: only domains whose centre it accepts
struct Box {
  const Body& b;
  int dim, per_cell;
  int n[3] = {1, 1, 0};        // domains; n[2] = 0 in the plane
  double d[3] = {0, 0, 0};     // their size
  size_t domains() const { return static_cast<size_t>(n[0]) * n[1] * std::max(1, n[2]); }
  size_t cells() const { return static_cast<size_t>(n[0] / per_cell) * (n[1] / per_cell) *
                                std::max(1, n[2] / per_cell); }
  size_t corners() const { return static_cast<size_t>(n[0] + 1) * (n[1] + 1) * (n[2] + 1); }
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

// the corners of a domain, among those of the box; returns how many
int corners_of(const Box& box, const int* at, size_t* corner)
{
  static const int step[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                 {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  const int nen = box.dim == 3 ? 8 : 4;
  for (int a = 0; a < nen; ++a)
    corner[a] = (static_cast<size_t>(at[2] + step[a][2]) * (box.n[1] + 1) + at[1] + step[a][1]) *
                    (box.n[0] + 1) + at[0] + step[a][0];
  return nen;
}

void corner_place(const Box& box, size_t corner, double* X)
{
  const size_t row = box.n[0] + 1, layer = row * (box.n[1] + 1);
  const int at[3]  = {static_cast<int>(corner % row), static_cast<int>(corner % layer / row),
                      static_cast<int>(corner / layer)};
  // the far face exactly at hi, so that bodies meet meshes without rounding gaps
  for (int i = 0; i < box.dim; ++i) X[i] = at[i] == box.n[i] ? box.b.hi[i] : box.b.lo[i] + at[i] * box.d[i];
}

// [domains] WHERE accepts the centre
std::vector<char> filled_domains(const Box& box, Filler& f)
{
  std::vector<char> filled(box.domains(), 1);
  int faults = 0;
  if (box.b.fill != FILL_REGION) return filled;
  each_domain(box, [&](size_t domain, size_t, const int* at) {
    double X[3];
    centre_of(box, at, X);
    filled[domain] = fill_accepts(box.b.where, X, box.dim, "body", box.b.name, box.b.place, faults);
  });
  f.errors += faults > 0;
  return filled;
}

// corners of the box that domains have: their numbers in the order in which these come, from first on; -1:
// none has it
IntVec number_corners(const Box& box, const std::vector<char>& filled, int& next)
{
  IntVec number(box.corners(), -1);
  each_domain(box, [&](size_t domain, size_t, const int* at) {
    size_t corner[8];
    const int nen = corners_of(box, at, corner);
    for (int a = 0; a < nen && filled[domain]; ++a)
      if (number[corner[a]] < 0) number[corner[a]] = next++;
  });
  return number;
}

// adds the corners of domains that are here, ascending by number; index of each corner of the box, -1: it is
// not here
IntVec add_corners(Filler& f, const Box& box, const IntVec& number, const std::vector<char>& here)
{
  std::vector<std::pair<int, size_t>> list;            // number, place in the box
  std::vector<char> known(box.corners(), 0);
  each_domain(box, [&](size_t domain, size_t, const int* at) {
    size_t corner[8];
    const int nen = corners_of(box, at, corner);
    for (int a = 0; a < nen && here[domain]; ++a) {
      if (!known[corner[a]]) list.emplace_back(number[corner[a]], corner[a]);
      known[corner[a]] = 1;
    }
  });
  std::sort(list.begin(), list.end());
  IntVec index(box.corners(), -1);
  for (const auto& [of_all, place] : list) {
    double X[3] = {0, 0, 0};
    corner_place(box, place, X);
    index[place] = fill_corner(f, X, box.b.field);
    if (f.pts.part.on) f.pts.part.corner.push_back(of_all);
  }
  return index;
}

struct Centre { double count = 0.0, x[3] = {0, 0, 0}; };

void add_place(Centre& c, double count, const double* X)
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

// The rank of each part of the cells, which lie at X [n*3]: one after the other, the part and the rank whose
// finite elements (of_elem: their ranks) are nearest, so that bonds seldom go from rank to rank
IntVec near_elements(const Mesh& mesh, const IntVec& of_elem, const RealVec& X, const RealVec& work,
                     const IntVec& part)
{
  const int ranks = comm_size();
  std::vector<Centre> to(ranks), from(ranks);
  for (int e = 0; e < mesh.nelem(); ++e) {
    double x[3];
    centre_of(mesh, e, x);
    if (mesh.elem_section[e] >= 0) add_place(to[of_elem[e]], 1.0, x);
  }
  for (size_t c = 0; c < part.size(); ++c) add_place(from[part[c]], work[c], &X[3 * c]);
  IntVec rank(ranks, -1);
  std::vector<char> taken(ranks, 0);
  for (int k = 0; k < ranks; ++k) {
    int best = -1, of = -1;
    double least = 1e300;
    for (int p = 0; p < ranks; ++p)
      for (int r = 0; r < ranks && rank[p] < 0; ++r) {
        double apart = 0.0;
        for (int i = 0; i < 3 && to[r].count > 0.0; ++i) apart += std::pow(from[p].x[i] - to[r].x[i], 2);
        if (taken[r] || apart >= least) continue;
        least = apart;
        best  = r;
        of    = p;
      }
    rank[of]    = best;
    taken[best] = 1;
  }
  return rank;
}

// a domain of another rank that is not here: does it share a corner with those of this one?
void add_near(const IntVec& number, const IntVec& index, Shape shape, const size_t* corner, int nen,
              PointPart& part)
{
  if (std::all_of(corner, corner + nen, [&](size_t c) { return index[c] < 0; })) return;
  for (int a = 0; a < nen; ++a) {
    part.near.item.push_back(index[corner[a]] >= 0 ? index[corner[a]] : -1 - number[corner[a]]);
    if (index[corner[a]] < 0) part.foreign.push_back(number[corner[a]]);
  }
  part.near.off.push_back(static_cast<int>(part.near.item.size()));
  part.near_shape.push_back(shape);
}

// into the ring of the points of its cell; last: the last one made there, -1: none yet
void join_ring(Points& p, int point, int& last)
{
  if (last >= 0) std::swap(p.next[point], p.next[last]);
  last = point;
}

// A domain: a point when it is here, else known when it is near
//   in   of_all   its number among the points of all ranks
//        rank     who works on it
//        corner   [nen] places of its corners in number (of all ranks) and index (here, -1: it is not here)
//        last     of join_ring, for its cell
void take_domain(Filler& f, int body, Shape shape, int of_all, bool here, int rank, const size_t* corner,
                 const IntVec& number, const IntVec& index, int& last)
{
  Points& p = f.pts;
  const int before = p.npoint, nen = shape_info[shape].nen;
  if (!here) return add_near(number, index, shape, corner, nen, p.part);
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

}  // namespace

void fill_box(Filler& f, int body, const IntVec& rank)
{
  const Box box = make_box(f.m, body);
  const std::vector<char> filled = filled_domains(box, f);
  const int me = comm_rank();
  const auto rank_of = [&](size_t cell) { return rank.empty() ? me : rank[cell]; };
  std::vector<char> here = filled;
  int next = f.pts.part.npoint;          // number of the next domain
  each_domain(box, [&](size_t domain, size_t cell, const int*) {
    if (filled[domain]) here[domain] = f.has(next++, rank_of(cell));
  });
  const IntVec number = number_corners(box, filled, f.pts.part.ncorner);
  const IntVec index  = add_corners(f, box, number, here);
  IntVec last(box.cells(), -1);          // last point made in a cell, -1: none yet
  each_domain(box, [&](size_t domain, size_t cell, const int* at) {
    if (!filled[domain]) return;
    size_t corner[8];
    corners_of(box, at, corner);
    const Shape shape = box.dim == 3 ? SHAPE_HEX8 : SHAPE_QUAD4;
    take_domain(f, body, shape, f.pts.part.npoint++, here[domain], rank_of(cell), corner, number, index,
                last[cell]);
  });
}

void fill_box_counts(Filler& f, int body)
{
  const Box box = make_box(f.m, body);
  const std::vector<char> filled = filled_domains(box, f);
  f.pts.part.npoint += static_cast<int>(std::count(filled.begin(), filled.end(), 1));
  number_corners(box, filled, f.pts.part.ncorner);
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

// cells of a fill with points in them: their number at each, -1: there are none; places and counts go on
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

// points and sum of their places in the cells of a box; about as many in an element
void count_cells(const Model& m, int body, RealVec& count, RealVec& sum)
{
  const Body& b = m.body[body];
  if (b.fill == FILL_ELSET) {
    const double points = std::pow(b.per_cell, m.dim);
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
  RealVec X, work;             // [n*3], [n] mean place and number of the points
  IntVec part;                 // [n]
};

CellParts divide_cells(const Model& m)
{
  CellParts c;
  for (size_t b = 0; b < m.body.size(); ++b) {
    RealVec count, sum;
    if (m.body[b].fill != FILL_CONVERSION) count_cells(m, static_cast<int>(b), count, sum);
    c.number.push_back(number_cells(count, sum, c.X, c.work));
  }
  c.part = part_places(c.X, c.work, comm_size());
  return c;
}

}  // namespace

bool point_fill_divides(const Model& m, int least)
{
  const CellParts c = divide_cells(m);
  IntVec count(comm_size(), 0);
  for (int p : c.part) ++count[p];
  return static_cast<int>(c.part.size()) >= least * comm_size() &&
         *std::min_element(count.begin(), count.end()) > 0;
}

void point_fill_ranks(IntVec& of_elem, Model& m)
{
  const CellParts c = divide_cells(m);
  const IntVec to   = near_elements(m.mesh, of_elem, c.X, c.work, c.part);
  for (size_t b = 0; b < m.body.size(); ++b) {
    IntVec rank;
    for (int cell : c.number[b]) rank.push_back(cell < 0 ? -1 : to[c.part[cell]]);
    if (m.body[b].fill != FILL_ELSET) m.body[b].rank = std::move(rank);
    else for (size_t k = 0; k < rank.size(); ++k) of_elem[m.elset[m.body[b].elset].item[k]] = rank[k];
  }
}
