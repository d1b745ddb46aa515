#include <cmath>

#include "deck/card.h"

namespace {

struct GridPlane {             // XMIN ... ZMAX or X=0.05
  int axis = -1;
  int side = 0;                // -1: min, 1: max, 0: at position
  double position = 0.0;
};

bool read_plane(Card& card, const Model& model, GridPlane& p)
{
  const char* const words = model.dim == 3
                                ? "XMIN, XMAX, YMIN, YMAX, ZMIN, ZMAX, X=position, Y=position, Z=position"
                                : "XMIN, XMAX, YMIN, YMAX, X=position, Y=position";
  const Field f = card_field(card, "plane (XMIN, YMAX, X=..., ...)");
  if (!card_good(card)) return false;
  const std::string s = text_squeeze(f.text);
  const char axis = s.empty() ? ' ' : s[0];
  p.axis = axis >= 'X' && axis < 'X' + model.dim ? axis - 'X' : -1;
  if (s.size() == 4 && s.substr(1) == "MIN") p.side = -1;
  else if (s.size() == 4 && s.substr(1) == "MAX") p.side = 1;
  else if (s.size() < 3 || s[1] != '=' || !parse_real(s.substr(2), p.position)) p.axis = -1;
  if (p.axis < 0) card_error(card, f, "plane " + text_show(f.text) + " is not known; allowed: " + words);
  return p.axis >= 0;
}

// sets the position of the plane, which must be a plane of the grid
void set_position(Deck& d, Model& m, std::size_t i, const GridPlane& p, const Field& at)
{
  const Grid& g = m.grid;
  if (!g.given) return deck_error(d, at, "there is no *GRID; write one with the box and the size of a cell");
  const double lo = g.lo[p.axis], h = g.h[p.axis];
  const int n = g.n[p.axis];
  const double k = p.side < 0 ? 0.0
                   : p.side > 0
                       ? n
                       : std::min(std::max(std::round((p.position - lo) / h), 0.0), static_cast<double>(n));
  m.grid_bc[i].position = lo + k * h;
  if (p.side != 0 || std::fabs(p.position - m.grid_bc[i].position) <= 1e-6 * h) return;
  const double below = std::min(std::max(std::floor((p.position - lo) / h), 0.0), n - 1.0);
  deck_error(d, at,
             "no grid plane has this position; the nearest are " + text_number(lo + below * h) + " and " +
                 text_number(lo + (below + 1.0) * h) +
                 ". Between grid planes use *BOND, TYPE=GROUND on a surface of the body");
}

}  // namespace

// ---------------------------------------------------------------------------
// *GRID BOUNDARY[, AMPLITUDE=][, FRICTION=] : plane, first[, last[, value]]
// ---------------------------------------------------------------------------
void kw_grid_boundary(Card& card, Model& model)
{
  const Field name = card_param_field(card, "AMPLITUDE");
  const double friction = card_param_real(card, "FRICTION", 0.0, at_least(0.0));
  while (card_line(card)) {
    GridBc b;
    GridPlane plane;
    if (!read_plane(card, model, plane)) continue;
    b.axis  = plane.axis;
    b.side  = plane.side;
    b.friction = friction;
    b.first = b.last = card_dof(card, model, "first direction");
    if (card_more(card) && card.field[card.next].empty()) ++card.next;
    else if (card_more(card)) b.last = card_dof(card, model, "last direction");
    b.value = card_expr_or_zero(card, "displacement");
    b.deck_line = line_place(card);
    if (card_good(card) && b.last < b.first)
      card_error(card, card.field[2], "the last direction is smaller than the first");
    if (!card_good(card)) continue;
    const std::size_t i = model.grid_bc.size();
    const Field at = card.field[0];
    model.grid_bc.push_back(b);
    card_later(card, STAGE_END, [=](Deck& d, Model& m) {
      set_position(d, m, i, plane, at);
      if (!name.empty()) m.grid_bc[i].amplitude = target_amplitude(d, m, name);
    });
  }
}
