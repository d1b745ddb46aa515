#include "contact/overlap.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/box_tree.h"
#include "base/comm.h"
#include "base/log.h"
#include "point/point.h"
#include "shape/face.h"

namespace {

// ---- parts that interact: bodies first, then sections -----------------------

struct Relations {
  int nbody, n;
  std::vector<char> known;     // [n*n] 1: the parts interact
  char& at(int a, int b) { return known[static_cast<size_t>(a) * n + b]; }
  void join(int a, int b) { at(a, b) = at(b, a) = 1; }
};

// parts with faces of a surface, including the bodies that its elements are converted to
std::vector<int> parts_of(const Model& m, int surface)
{
  std::vector<char> in(m.body.size() + m.section.size(), 0);
  const Surface& s = m.surface[surface];
  if (s.body >= 0) in[s.body] = 1;
  for (const Face& f : s.face) {
    const int section = m.mesh.elem_section[f.elem];
    if (section < 0) continue;
    in[m.body.size() + section] = 1;
    for (const ConversionDef& c : m.conversion)
      if (c.body[section] >= 0) in[c.body[section]] = 1;
  }
  std::vector<int> out;
  for (size_t i = 0; i < in.size(); ++i)
    if (in[i]) out.push_back(static_cast<int>(i));
  return out;
}

// parts with faces of a side of general contact
std::vector<int> parts_of(const Model& m, const Relations& r, const ContactSide& side)
{
  if (side.surface >= 0) return parts_of(m, side.surface);
  if (side.body >= 0) return {side.body};
  std::vector<int> out;
  for (int part = 0; part < r.n; ++part) {
    if (side.elset < 0) out.push_back(part);
    for (int e : side.elset >= 0 ? m.elset[side.elset].item : IntVec()) {
      if (r.nbody + m.mesh.elem_section[e] != part) continue;
      out.push_back(part);
      break;
    }
  }
  return out;
}

// sections whose elements share a node, or are tied (*TIE)
void join_meshes(const Model& m, Relations& r)
{
  std::vector<int> first(m.mesh.nnode(), -1);
  for (int e = 0; e < m.mesh.nelem(); ++e) {
    const int part = m.mesh.elem_section[e] < 0 ? -1 : r.nbody + m.mesh.elem_section[e];
    for (int k = m.mesh.conn.off[e]; part >= 0 && k < m.mesh.conn.off[e + 1]; ++k) {
      int& known = first[m.mesh.conn.item[k]];
      if (known < 0) known = part;
      r.join(known, part);
    }
  }
  for (const Equation& e : m.equation)
    for (const EquationTerm& t : e.term) {
      const int a = first[e.term[0].node], b = first[t.node];
      if (e.of == EQUATION_TIE && a >= 0 && b >= 0) r.join(a, b);
    }
}

// points interact with the same parts as the elements that they replace
void join_converted(const Model& m, Relations& r)
{
  for (int again = 0; again < 2; ++again)
    for (const ConversionDef& c : m.conversion)
      for (size_t s = 0; s < c.body.size(); ++s) {
        if (c.body[s] < 0) continue;
        const int section = r.nbody + static_cast<int>(s);
        r.join(c.body[s], section);
        for (int x = 0; x < r.n; ++x)
          if (r.at(section, x)) r.join(c.body[s], x);
      }
}

Relations relations(const Model& m)
{
  const int nbody = static_cast<int>(m.body.size());
  Relations r{nbody, nbody + static_cast<int>(m.section.size()), {}};
  r.known.assign(static_cast<size_t>(r.n) * r.n, 0);
  for (int a = 0; a < nbody; ++a)
    for (int b = 0; b < nbody; ++b)
      if (m.body[a].field == m.body[b].field) r.join(a, b);
  for (const BondDef& d : m.bond) {
    for (const ContactRule& rule : d.contact.include)
      for (int a : parts_of(m, r, rule.a))
        for (int b : parts_of(m, r, rule.b)) r.join(a, b);
    if (d.surface < 0 || d.kind == BOND_GROUND) continue;
    std::vector<int> other;
    if (d.kind == BOND_CONTACT) other = parts_of(m, d.contact.master);
    for (int b = 0; b < nbody && d.kind == BOND_MESH_GRID; ++b)
      if (m.body[b].field == m.body[d.body].field) other.push_back(b);
    for (int a : parts_of(m, d.surface))
      for (int b : other) r.join(a, b);
  }
  join_meshes(m, r);
  join_converted(m, r);
  return r;
}

// ---- cells of a part: elements, or domains of points, in their present position ----

struct Cell {
  int number;                  // of the element in the mesh of the deck, or of the point among all points
  Shape shape;
  double x[24];                // [nen*dim]
  BoundingBox box;
};

struct Part {
  std::vector<Cell> cell;
  BoundingBox box;
};

void add_cell(Part& part, int number, Shape shape, int nen, int dim, const double* x)
{
  Cell c = {};
  c.number = number;
  c.shape  = shape;
  std::copy(x, x + nen * dim, c.x);
  for (int a = 0; a < nen; ++a) box_take(c.box, x + a * dim, dim);
  box_take(part.box, c.box.lo, c.box.hi, dim);
  part.cell.push_back(c);
}

// the cells of this rank
Part cells_of(const Model& m, const Elements& el, const Points& pts, const RealVec& u, const RealVec& uc,
              int body, int section)
{
  const int dim = m.dim;
  Part part;
  double x[24];
  for (int q = 0; body >= 0 && q < pts.npoint; ++q) {
    if (pts.body[q] != body || !point_counts(m, pts, q)) continue;
    const int nen = pts.conn.count(q);
    for (int a = 0; a < nen; ++a)
      for (int i = 0; i < dim; ++i) {
        const int dof = pts.conn.begin(q)[a] * dim + i;
        x[a * dim + i] = pts.Xc[dof] + uc[dof];
      }
    add_cell(part, pts.point_number(q), static_cast<Shape>(pts.shape[q]), nen, dim, x);
  }
  for (int e = 0; body < 0 && e < m.mesh.nelem(); ++e) {
    if (m.mesh.elem_section[e] != section || el.block_of[e] < 0) continue;
    const Shape shape = shape_info[elem_table[m.mesh.elem_type[e]].shape].linear;    // straight edges suffice
    const int nen = shape_info[shape].nen;
    for (int a = 0; a < nen; ++a)
      for (int i = 0; i < dim; ++i) {
        const int node = m.mesh.conn.begin(e)[a];
        x[a * dim + i] = m.mesh.X[3 * node + i] + u[node * dim + i];
      }
    add_cell(part, m.part.elem_number(e), shape, nen, dim, x);
  }
  return part;
}

// divided model: the cells of all ranks in and close to the box of another part, in the order of one rank
Part gather_close(const Part& own, const Part& other, int dim)
{
  Part all;
  BoundingBox box = other.box;
  double size = 0.0;
  for (int i = 0; i < dim; ++i) size = std::max(size, box.hi[i] - box.lo[i]);
  box_grow(box, 0.01 * size, dim);
  if (!boxes_meet(own.box, box, dim)) return all;
  for (const Cell& c : own.cell)
    if (boxes_meet(c.box, box, dim)) all.cell.push_back(c);
  comm_allgatherv(all.cell);
  std::sort(all.cell.begin(), all.cell.end(),
            [](const Cell& a, const Cell& b) { return a.number < b.number; });
  for (const Cell& c : all.cell) box_take(all.box, c.box.lo, c.box.hi, dim);
  return all;
}

// ---- bins, to find the cell at a position ----------------------------------

struct Bins {
  const Part& part;
  int dim;
  int n[3] = {1, 1, 1};
  double h[3] = {1, 1, 1};
  std::vector<IntVec> list;
};

int bin_of(const Bins& b, double x, int i)
{
  return std::min(std::max(static_cast<int>((x - b.part.box.lo[i]) / b.h[i]), 0), b.n[i] - 1);
}

Bins make_bins(const Part& part, int dim)
{
  Bins b{part, dim, {1, 1, 1}, {1, 1, 1}, {}};
  const double side = std::pow(static_cast<double>(part.cell.size()), 1.0 / dim);
  for (int i = 0; i < dim; ++i) {
    b.n[i] = std::max(1, static_cast<int>(side));
    b.h[i] = std::max((part.box.hi[i] - part.box.lo[i]) / b.n[i], 1e-300);
  }
  b.list.resize(static_cast<size_t>(b.n[0]) * b.n[1] * b.n[2]);
  for (size_t c = 0; c < part.cell.size(); ++c) {
    int lo[3] = {0, 0, 0}, hi[3] = {0, 0, 0};
    for (int i = 0; i < dim; ++i) {
      lo[i] = bin_of(b, part.cell[c].box.lo[i], i);
      hi[i] = bin_of(b, part.cell[c].box.hi[i], i);
    }
    for (int z = lo[2]; z <= hi[2]; ++z)
      for (int y = lo[1]; y <= hi[1]; ++y)
        for (int x = lo[0]; x <= hi[0]; ++x)
          b.list[x + b.n[0] * (y + b.n[1] * z)].push_back(static_cast<int>(c));
  }
  return b;
}

bool lies_in(const Bins& b, const double* x)
{
  int at[3] = {0, 0, 0};
  double xi[3];
  for (int i = 0; i < b.dim; ++i) {
    if (x[i] < b.part.box.lo[i] || x[i] > b.part.box.hi[i]) return false;
    at[i] = bin_of(b, x[i], i);
  }
  for (int c : b.list[at[0] + b.n[0] * (at[1] + b.n[1] * at[2])])
    if (shape_locate(b.part.cell[c].shape, b.part.cell[c].x, x, xi)) return true;
  return false;
}

// ---- volume of the overlap of two parts ------------------------------------

struct Common {
  double size = 0.0;           // volume, in 2D area
  double x[3] = {0, 0, 0};     // a point in it
};

// Gauss points of a that lie in b
Common gauss_inside(const Part& a, const Bins& b, int dim)
{
  Common out;
  for (const Cell& c : a.cell) {
    if (!boxes_meet(c.box, b.part.box, dim)) continue;
    const GaussRule& rule = gauss_rule(c.shape);
    const int nen = shape_info[c.shape].nen;
    for (int g = 0; g < rule.n; ++g) {
      double N[8], dN[24], d[24], x[3] = {0, 0, 0};
      shape_eval(c.shape, rule.xi[g], N, dN);
      for (int k = 0; k < nen; ++k)
        for (int i = 0; i < dim; ++i) x[i] += N[k] * c.x[k * dim + i];
      if (!lies_in(b, x)) continue;
      if (out.size == 0.0) std::copy(x, x + 3, out.x);
      out.size += std::max(0.0, rule.w[g] * shape_jacobian(c.shape, dN, c.x, d));
    }
  }
  return out;
}

// the result of the finer part is more accurate
Common overlap(const Part& a, const Part& b, int dim)
{
  if (a.cell.empty() || b.cell.empty() || !boxes_meet(a.box, b.box, dim)) return Common();
  const Common ab = gauss_inside(a, make_bins(b, dim), dim), ba = gauss_inside(b, make_bins(a, dim), dim);
  return ab.size > ba.size ? ab : ba;
}

struct TouchingFace {          // face of a point that lies on another part
  int point, face;
  double area, x[3];           // area in contact, and a point of it
};

// area of the boundary of a body that lies on b, within a thousandth of the size of its faces
Common touching(const Model& m, const Points& pts, const RealVec& uc, int body, const Part& b)
{
  const int dim = m.dim;
  Common out;
  if (b.cell.empty()) return out;
  const Bins bins = make_bins(b, dim);
  std::vector<TouchingFace> all;
  for (const Face& f : pts.boundary) {
    if (pts.body[f.elem] != body || !point_counts(m, pts, f.elem)) continue;
    const ShapeInfo& info = shape_info[pts.shape[f.elem]];
    const int n = info.nfnode[f.face];
    double X[12] = {0};
    for (int k = 0; k < n; ++k)
      for (int i = 0; i < dim; ++i) {
        const int dof = pts.conn.begin(f.elem)[info.face[f.face][k]] * dim + i;
        X[3 * k + i] = pts.Xc[dof] + uc[dof];
      }
    const FaceRule& rule = face_rule(n);
    TouchingFace t{pts.point_number(f.elem), f.face, 0.0, {0, 0, 0}};
    for (int g = 0; g < rule.n; ++g) {
      double N[4], normal[3], x[3] = {0, 0, 0};
      face_eval(n, rule.xi[g], N, nullptr);
      const double area = face_area(n, X, rule.xi[g], normal), size = dim == 2 ? area : std::sqrt(area);
      for (int i = 0; i < dim; ++i) {
        for (int k = 0; k < n; ++k) x[i] += N[k] * X[3 * k + i];
        x[i] += 1e-3 * size * normal[i] / area;
      }
      if (!lies_in(bins, x)) continue;
      if (t.area == 0.0) std::copy(x, x + 3, t.x);
      t.area += rule.w[g] * area;
    }
    if (t.area > 0.0) all.push_back(t);
  }
  if (m.part.on) comm_allgatherv(all);
  std::sort(all.begin(), all.end(), [](const TouchingFace& s, const TouchingFace& t) {
    return s.point != t.point ? s.point < t.point : s.face < t.face;
  });
  if (!all.empty()) std::copy(all[0].x, all[0].x + 3, out.x);
  for (const TouchingFace& t : all) out.size += t.area;
  return out;
}

// ---- messages --------------------------------------------------------------

std::string name_of(const Model& m, const UncoupledPair& p)
{
  if (p.other >= 0) return "the body " + m.body[p.other].name;
  const int set = m.section[p.section].elset;
  return set >= 0 ? "the elements of " + m.elset[set].name : "the elements";
}

std::string position_of(const Model& m, const Common& c)
{
  char text[120];
  if (m.dim == 2) std::snprintf(text, sizeof text, "(%g, %g)", c.x[0], c.x[1]);
  else std::snprintf(text, sizeof text, "(%g, %g, %g)", c.x[0], c.x[1], c.x[2]);
  return text;
}

const char* remedy(const UncoupledPair& p)
{
  if (p.other >= 0) return "*CONTACT PAIR separates them, a common FIELD joins them";
  return "*CONTACT PAIR separates them, *BOND joins them";
}

Common overlap_now(const Model& m, const Elements& el, const Points& pts, const RealVec& u, const RealVec& uc,
                   const UncoupledPair& p, Part& other)
{
  Part body = cells_of(m, el, pts, u, uc, p.body, -1);
  other = cells_of(m, el, pts, u, uc, p.other, p.section);
  if (m.part.on) {
    box_join(body.box);
    box_join(other.box);
    const Part close = gather_close(body, other, m.dim);
    other = gather_close(other, body, m.dim);
    body  = close;
  }
  return overlap(body, other, m.dim);
}

}  // namespace

void overlap_pairs(const Model& m, OverlapWatch& w)
{
  w = OverlapWatch();
  if (m.part.on) {
    w.pair = m.part.uncoupled;
    return;
  }
  Relations r = relations(m);
  for (int a = 0; a < r.nbody; ++a) {
    for (int b = a + 1; b < r.nbody; ++b)
      if (!r.at(a, b)) w.pair.push_back({a, b, -1, false});
    for (int s = r.nbody; s < r.n; ++s)
      if (!r.at(a, s)) w.pair.push_back({a, -1, s - r.nbody, false});
  }
}

void overlap_start(const Model& m, const Elements& el, const Points& pts, const RealVec& u, const RealVec& uc,
                   OverlapWatch& w)
{
  for (UncoupledPair& p : w.pair) {
    Part other;
    const Common both = overlap_now(m, el, pts, u, uc, p, other);
    const Common touch = both.size > 0.0 ? Common() : touching(m, pts, uc, p.body, other);
    if (both.size == 0.0 && touch.size == 0.0) continue;
    p.reported = true;
    const bool inside = both.size > 0.0;
    const char* measure = m.dim == 3 ? (inside ? "volume" : "area") : inside ? "area" : "length";
    log_warn("the body %s and %s %s initially (%s %.4g, near %s), but no bond or contact pair is defined "
             "between them: they do not interact. %s",
             m.body[p.body].name.c_str(), name_of(m, p).c_str(), inside ? "overlap" : "touch", measure,
             std::max(both.size, touch.size), position_of(m, inside ? both : touch).c_str(), remedy(p));
  }
}

void overlap_look(const Model& m, const Elements& el, const State& st, OverlapWatch& w)
{
  if (--w.rest >= 0) return;
  w.rest = 4;                  // a body takes many increments to cross a cell
  for (UncoupledPair& p : w.pair) {
    if (p.reported) continue;
    Part other;
    const Common both = overlap_now(m, el, st.points, st.n.u, st.n.uc, p, other);
    if (both.size == 0.0) continue;
    p.reported = true;
    log_warn("time %.6g: the body %s penetrates %s (%s %.4g, near %s), but no bond or contact pair is "
             "defined "
             "between them. %s",
             st.n.time, m.body[p.body].name.c_str(), name_of(m, p).c_str(), m.dim == 2 ? "area" : "volume",
             both.size, position_of(m, both).c_str(), remedy(p));
  }
}
