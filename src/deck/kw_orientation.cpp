#include <cmath>

#include "deck/axes.h"
#include "deck/card.h"

namespace {

// rotates the directions about one of them by an angle in degrees
void rotate(int about, double angle, std::array<double, 9>& axis)
{
  const int p = (about + 1) % 3, q = (about + 2) % 3;
  const double c = std::cos(card_radians(angle)), s = std::sin(card_radians(angle));
  for (int j = 0; j < 3; ++j) {
    const double u = axis[3 * p + j], v = axis[3 * q + j];
    axis[3 * p + j] = c * u + s * v;
    axis[3 * q + j] = c * v - s * u;
  }
}

}  // namespace

// ---------------------------------------------------------------------------
// *ORIENTATION, NAME=[, SYSTEM=RECTANGULAR] : a1, a2, a3, b1, b2, b3; axis, angle
// Direction 1 of the material along a, 2 in the plane of a and b; then rotated about one of the three
// ---------------------------------------------------------------------------
void kw_orientation(Card& card, Model&)
{
  const std::string name = card_param_name(card, "NAME");
  card_param_word(card, "SYSTEM", "RECTANGULAR", 0);
  Vec a, b;
  for (double& x : a) x = card_real(card, "a", any_number());
  for (double& x : b) x = card_real(card, "b", any_number());
  if (!card_good(card)) return;
  Vec e3 = cross(a, b);
  const double limit = 1e-12 * size_of(a);
  if (!unit(a, 0.0) || !unit(e3, limit * size_of(b)))
    return card_error(card, card.whole, "a and b must be directions that are not 0 and not parallel");
  std::array<double, 9> axis;
  set_axes(a, cross(e3, a), e3, axis);
  if (card_line(card)) {
    const int about = card_int(card, "axis", 1, 3) - 1;
    rotate(about, card_real_or(card, "angle", 0.0, any_number()), axis);
  }
  card_end(card);
  if (name.empty()) return;
  if (!card.deck->orientation.emplace(name, axis).second)
    card_error(card, card.head.at, "orientation " + name + " is defined already");
}
