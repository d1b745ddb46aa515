#include "deck/card.h"

namespace {

// data lines: box / cells
void read_box(Card& card, int dim, Body& b)
{
  card_box(card, dim, "min", "max", b.lo.data(), b.hi.data());
  if (!card.open || !card_line(card)) return;
  double points = 1.0;
  if (!card_cells(card, dim, b.cells.data())) return;
  for (int i = 0; i < dim; ++i) points *= static_cast<double>(b.cells[i]) * b.per_cell;
  if (points > 5e7) card_error(card, card.whole, "more than 5e7 material points; use fewer cells");
}

// reports parameters of plane models
void check_plane(Card& card, int dim)
{
  for (const char* name : {"PLANE", "THICKNESS"})
    if (dim == 3 && card_param(card, name))
      card_error(card, card_param(card, name)->key,
                 std::string(name) + " has no meaning in three dimensions; leave it out");
}

void check_fill(Card& card, const Body& b, const Field& elset)
{
  if (b.fill == FILL_ELSET && elset.empty())
    card_error(card, card.head.at, "FILL=ELSET needs ELSET=name of the elements that become points");
  if (b.fill != FILL_ELSET && !elset.empty()) card_error(card, elset, "ELSET= requires FILL=ELSET");
  if (b.fill == FILL_ELSET && b.reshape > 0.0)
    card_error(card, card_param(card, "RESHAPE")->key, "RESHAPE requires FILL=BLOCK or REGION");
  if (b.fill != FILL_REGION && card_param(card, "WHERE"))
    card_error(card, card_param(card, "WHERE")->key, "WHERE requires FILL=REGION");
  if (b.fill == FILL_REGION && !card_param(card, "WHERE"))
    card_error(card, card.head.at, "FILL=REGION needs WHERE=\"function\", nonzero inside the body");
}

}  // namespace

// ---------------------------------------------------------------------------
// *MATERIAL POINTS, BODY=, MATERIAL=[, FILL=BLOCK|ELSET|REGION] ... : box / cells
// ---------------------------------------------------------------------------
void kw_material_points(Card& card, Model& model)
{
  Body b;
  b.name  = card_param_name(card, "BODY");
  b.deck_line = card_deck_line(card);
  const int fill = card_param_word(card, "FILL", "BLOCK|ELSET|REGION", 0);
  b.fill = static_cast<FillKind>(fill < 0 ? 0 : fill);
  b.per_cell  = card_param_int(card, "POINTS", 2, 1, 100);
  b.plane     = card_param_word(card, "PLANE", "STRAIN|STRESS", 0) == 1 ? PLANE_STRESS : PLANE_STRAIN;
  b.thickness = card_param_real(card, "THICKNESS", 1.0, above(0.0));
  if (model.dim == 3) b.plane = PLANE_NONE;
  check_plane(card, model.dim);
  b.field     = card_param_int(card, "FIELD", 0, 0, 1000);
  b.reshape   = card_param_real(card, "RESHAPE", 0.0, above(1.1));
  card_param_where(card, b.where);
  const Field elset = card_param_field(card, "ELSET"), material = card_param_field(card, "MATERIAL");
  check_fill(card, b, elset);
  if (b.fill != FILL_ELSET) read_box(card, model.dim, b);
  if (!b.name.empty() && model_find_body(model, b.name) >= 0)
    card_error(card, card.head.at, "body " + b.name + " is defined already");
  const std::size_t i = model.body.size();
  model.body.push_back(b);
  card_later(card, STAGE_STEP, [=](Deck& d, Model& m) {
    m.body[i].material = target_material(d, m, material);
    if (b.fill == FILL_ELSET && !elset.empty()) m.body[i].elset = target_elset(d, m, elset);
  });
}
