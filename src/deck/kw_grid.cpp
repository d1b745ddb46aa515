#include <cmath>

#include "deck/card.h"

// ---------------------------------------------------------------------------
// *GRID[, WEAK=][, KEEP=] : xmin, ymin[, zmin], xmax, ymax[, zmax] / hx[, hy[, hz]]
// ---------------------------------------------------------------------------
void kw_grid(Card& card, Model& model)
{
  Grid& g = model.grid;
  if (g.given)
    card_error(card, card.head.at,
               "the grid is defined already, in " + g.deck_line.file +
                   text_format(" line %d", g.deck_line.line));
  g.given = true;
  g.deck_line = card_deck_line(card);
  g.weak  = card_param_real(card, "WEAK", 0.05, from_to(0.0, 0.5));
  g.keep  = card_param_real(card, "KEEP", 0.1, from_to(0.0, 0.5));
  double hi[3];
  const bool opened = card_line(card), mixed = opened && card.field.size() == 6 &&
                      !deck_same_dimension(*card.deck, card.whole, "the *GRID with a box of six numbers", 3);
  const bool box = !mixed && card_box(card, model.dim, "min", "max", g.lo.data(), hi);
  if (mixed) card.next = card.field.size();
  if (box && !card_line(card))
    return card_error(card, card.head.at, "the second data line, hx[, hy], the size of a cell, is missing");
  if (!box) {
    card_line(card);
    card.next = card.field.size();
    g.h = {{1.0, 1.0, model.dim == 3 ? 1.0 : 0.0}};
    g.n = {{1, 1, model.dim == 3 ? 1 : 0}};
    return;
  }
  g.h[0] = card_real(card, "hx", above(0.0));
  g.h[1] = card_real_or(card, "hy", g.h[0], above(0.0));
  if (model.dim == 3) g.h[2] = card_real_or(card, "hz", g.h[0], above(0.0));
  double cells = 1.0;
  for (int i = 0; i < model.dim; ++i) {
    const double n = std::max(1.0, std::ceil((hi[i] - g.lo[i]) / g.h[i] - 1e-9));
    cells *= n;
    g.n[i] = n <= 1e8 ? static_cast<int>(n) : 1;
    if (!(n <= 1e8))
      card_error(card, card.field[0],
                 "more than 1e8 cells in one direction; the size of a cell is too small");
  }
  if (card_good(card) && cells > 1e15)
    card_error(card, card.field[0], "more than 1e15 cells; the size of a cell is too small");
}
