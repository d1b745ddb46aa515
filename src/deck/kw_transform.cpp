#include <cmath>

#include "deck/axes.h"
#include "deck/card.h"

namespace {

// radial, circumferential and axial direction at a node; false: the node lies on the axis
bool cylindrical(const Model& m, int node, const Vec& a, const Vec& e3, double limit,
                 std::array<double, 9>& axis)
{
  const double* X = &m.mesh.X[3 * static_cast<std::size_t>(node)];
  Vec r = {{X[0] - a[0], X[1] - a[1], X[2] - a[2]}};
  const double along = r[0] * e3[0] + r[1] * e3[1] + r[2] * e3[2];
  for (int j = 0; j < 3; ++j) r[j] -= along * e3[j];
  if (!unit(r, limit)) return false;
  set_axes(r, cross(e3, r), e3, axis);
  return true;
}

}  // namespace

// ---------------------------------------------------------------------------
// *TRANSFORM, NSET=[, TYPE=R|C] : a1, a2, a3, b1, b2, b3
// Local directions of *BOUNDARY, *CLOAD and *EQUATION at these nodes. R: direction 1 along a, 3 along a x b;
// C: a and b are points of an axis, directions 1 radial, 2 circumferential, 3 axial
// ---------------------------------------------------------------------------
void kw_transform(Card& card, Model& model)
{
  const bool about_axis = card_param_word(card, "TYPE", "R|C", 0) == 1;
  const Field set  = card_param_field(card, "NSET");
  Vec a, b, e3;
  for (double& x : a) x = card_real(card, "a", any_number());
  for (double& x : b) x = card_real(card, "b", any_number());
  IntVec node;
  if (!card_good(card) || set.empty() || !target_nodes(*card.deck, model, set, node)) return;
  e3 = about_axis ? Vec{{b[0] - a[0], b[1] - a[1], b[2] - a[2]}} : cross(a, b);
  const double size = size_of(a) + size_of(b);
  Vec e1 = a;
  if (!unit(e3, about_axis ? 1e-12 * size : 1e-12 * size * size) || (!about_axis && !unit(e1, 0.0)))
    return card_error(card, card.whole,
                      about_axis ? "a and b coincide; they define the axis"
                                 : "a and b are parallel; they define a plane");
  if (model.dim == 2 && std::fabs(std::fabs(e3[2]) - 1.0) > 1e-12)
    return card_error(card, card.whole,
                      about_axis ? "the axis must be along z in a plane model: x, y, 0, x, y, 1"
                                 : "a and b must lie in the plane: a1, a2, 0, b1, b2, 0");
  for (int n : node) {
    Frame f;
    f.node  = n;
    f.deck_line = card_deck_line(card);
    if (!about_axis) set_axes(e1, cross(e3, e1), e3, f.axis);
    else if (!cylindrical(model, n, a, e3, 1e-9 * size, f.axis))
      return card_error(card, card.whole,
                        text_format("node %d lies on the axis and has no radius", model.mesh.node_label[n]));
    if (!card.deck->frame_of.emplace(n, static_cast<int>(model.frame.size())).second)
      return card_error(card, set,
                        text_format("node %d has a *TRANSFORM already",
                                    model.mesh.node_label[n]));
    model.frame.push_back(f);
  }
}
