#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "deck/kw_mesh.h"

namespace {

const double quarter_pi = 0.78539816339744830962;
// edge of the core: 0 square, 1 circle
const double bulge = 0.5;

enum { ON_ZMIN = 1, ON_ZMAX = 2, ON_R = 4, ON_XSYM = 8, ON_YSYM = 16 };

// A section consists of a core of squares, n on each side of the axis, and nr rings of 8 n (quarter: 2 n)
// elements.
struct Cylinder {
  double x = 0, y = 0, z = 0, radius = 1, height = 1;
  int nr = 1, nz = 1, n = 1;
  bool quarter = false;
  int ring_nodes() const { return quarter ? 2 * n + 1 : 8 * n; }
  int ring_cells() const { return quarter ? 2 * n : 8 * n; }
  int core_side() const { return quarter ? n + 1 : 2 * n + 1; }
  int core_nodes() const { return core_side() * core_side(); }
  int section_nodes() const { return core_nodes() + nr * ring_nodes(); }
};

// core node i, j at position t of the edge of the core, counter-clockwise from the x axis
void core_edge(int n, int t, int& i, int& j)
{
  const int side = (t + n) / (2 * n) % 4, s = (t + n) % (2 * n) - n;
  const int at[4][2] = {{n, s}, {-s, n}, {-n, -s}, {s, -n}};
  i = at[side][0];
  j = at[side][1];
}

// unit vector towards core node i, j: equal angles along the edge, exactly 0 on the axes
void direction(int i, int j, double e[2])
{
  const bool flat = std::abs(i) >= std::abs(j);
  const double angle = quarter_pi * (flat ? j : i) / (flat ? i : j), sign = (flat ? i : j) < 0 ? -1.0 : 1.0;
  e[flat ? 0 : 1] = sign * std::cos(angle);
  e[flat ? 1 : 0] = sign * std::sin(angle);
}

// position of core node i, j: the squares become rounder with their distance q from the axis. The edge is
// chosen such that elements of core and rings have equal length, averaged over axis and diagonal.
void core_position(const Cylinder& c, int i, int j, double x[2])
{
  x[0] = x[1] = 0.0;
  if (i == 0 && j == 0) return;
  const double corner = (1.0 - bulge) * std::sqrt(2.0) + bulge;
  const double edge = 2.0 * c.radius * c.n / ((c.n + c.nr) * (1.0 + corner));
  const double q = std::max(std::abs(i), std::abs(j)) / static_cast<double>(c.n), round = bulge * q;
  double e[2];
  direction(i, j, e);
  x[0] = edge * ((1.0 - round) * i / c.n + round * q * e[0]);
  x[1] = edge * ((1.0 - round) * j / c.n + round * q * e[1]);
}

void add_node(Card& card, Model& model, const Cylinder& c, const double x[2], int k, int side, Part& p)
{
  const double X[3] = {c.x + x[0], c.y + x[1], k == c.nz ? c.z + c.height : c.z + c.height * k / c.nz};
  if (c.quarter && x[0] == 0.0) side |= ON_XSYM;
  if (c.quarter && x[1] == 0.0) side |= ON_YSYM;
  if (k == 0) side |= ON_ZMIN;
  if (k == c.nz) side |= ON_ZMAX;
  part_node(card, model, X, side, p);
}

// nodes of a section: the core by rows, then the rings outwards, counter-clockwise from the x axis
void make_section(Card& card, Model& model, const Cylinder& c, int k, Part& p)
{
  double x[2], e[2];
  const int low = c.quarter ? 0 : -c.n;
  for (int j = low; j <= c.n; ++j)
    for (int i = low; i <= c.n; ++i) {
      core_position(c, i, j, x);
      add_node(card, model, c, x, k, 0, p);
    }
  for (int r = 1; r <= c.nr; ++r)
    for (int t = 0; t < c.ring_nodes(); ++t) {
      int i, j;
      core_edge(c.n, t, i, j);
      core_position(c, i, j, x);
      direction(i, j, e);
      const double part = static_cast<double>(r) / c.nr;
      for (int a = 0; a < 2; ++a)
        x[a] = r == c.nr ? c.radius * e[a] : (1.0 - part) * x[a] + part * c.radius * e[a];
      add_node(card, model, c, x, k, r == c.nr ? ON_R : 0, p);
    }
}

// node of a section at ring r (0: edge of the core), position t
int ring_node(const Cylinder& c, int r, int t)
{
  t %= 8 * c.n;
  if (r > 0) return c.core_nodes() + (r - 1) * c.ring_nodes() + t;
  const int low = c.quarter ? 0 : -c.n;
  int i, j;
  core_edge(c.n, t, i, j);
  return (j - low) * c.core_side() + i - low;
}

void add_cell(Card& card, Model& model, const Cylinder& c, const int quad[4], int k, Part& p)
{
  int corner[8];
  for (int a = 0; a < 4; ++a) {
    corner[a]     = k * c.section_nodes() + quad[a];
    corner[a + 4] = corner[a] + c.section_nodes();
  }
  part_cell(card, model, corner, p);               // never false: the types of *CYLINDER are linear
}

void make_layer(Card& card, Model& model, const Cylinder& c, int k, Part& p)
{
  const int side = c.core_side();
  for (int j = 0; j + 1 < side; ++j)
    for (int i = 0; i + 1 < side; ++i) {
      const int a = j * side + i, quad[4] = {a, a + 1, a + side + 1, a + side};
      add_cell(card, model, c, quad, k, p);
    }
  for (int r = 0; r < c.nr; ++r)
    for (int t = 0; t < c.ring_cells(); ++t) {
      const int quad[4] = {ring_node(c, r, t), ring_node(c, r + 1, t), ring_node(c, r + 1, t + 1),
                           ring_node(c, r, t + 1)};
      add_cell(card, model, c, quad, k, p);
    }
}

bool read_lines(Card& card, Cylinder& c)
{
  c.x = card_real(card, "xc", any_number());
  c.y = card_real(card, "yc", any_number());
  c.z = card_real(card, "z0", any_number());
  c.radius = card_real(card, "radius", above(0.0));
  c.height = card_real(card, "height", above(0.0));
  const bool good = card_good(card);
  if (!card_line(card)) {
    if (good) card_error(card, card.head.at, "the second data line, nr, nz, nsq, is missing");
    return false;
  }
  c.nr = card_int(card, "nr", 1, 10000);
  c.nz = card_int(card, "nz", 1, 50000000);
  c.n  = card_int(card, "nsq", 1, 5000);
  return good && card_good(card);
}

}  // namespace

// ---------------------------------------------------------------------------
// *CYLINDER, TYPE=, ELSET=name[, QUARTER][, MERGE] : xc, yc, z0, radius, height / nr, nz, nsq
// A solid cylinder along z; QUARTER: the part x >= xc, y >= yc
// ---------------------------------------------------------------------------
void kw_cylinder(Card& card, Model& model)
{
  Part p;
  Cylinder c;
  c.quarter = card_flag(card, "QUARTER");
  std::vector<std::string> sides = {"ZMIN", "ZMAX", "R"};
  if (c.quarter) sides.insert(sides.end(), {"XSYM", "YSYM"});
  const bool named = part_open(card, model, sides, p);
  const bool fits = p.type < 0 || p.type == ELEM_C3D8 || p.type == ELEM_C3D6;
  if (!fits)
    card_error(card, card_param(card, "TYPE")->value,
               std::string("*CYLINDER makes C3D8 and C3D6, not ") + elem_table[p.type].name);
  if (!read_lines(card, c) || !named || !fits) return;
  const double core = c.core_side() - 1.0;
  const double cells = (core * core + static_cast<double>(c.nr) * c.ring_cells()) * c.nz;
  const double nodes = (c.core_nodes() + static_cast<double>(c.nr) * c.ring_nodes()) * (c.nz + 1.0);
  if (!part_room(card, model, nodes, cells, std::hypot(2.0 * c.radius, c.height), p)) return;
  for (int k = 0; k <= c.nz; ++k) make_section(card, model, c, k, p);
  for (int k = 0; k < c.nz; ++k) make_layer(card, model, c, k, p);
  part_close(card, model, p);
}
