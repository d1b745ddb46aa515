#include "deck/card.h"
#include "deck/deck_state.h"

void kw_parameter(Card&, Model&);

namespace {

// a keyword that creates elements has TYPE=C3D...
bool head_is_solid(const Head& head)
{
  if (head.word != "ELEMENT" && head.word != "BLOCK" && head.word != "CYLINDER") return false;
  for (const HeadParam& p : head.param)
    if (p.name == "TYPE" && text_upper(p.value.text).compare(0, 3, "C3D") == 0) return true;
  return false;
}

// *GRID: the first data line is a box of six numbers
bool grid_is_solid(Deck& scout)
{
  std::vector<Field> field;
  Field whole;
  bool keyword = false, comma = false;
  if (!deck_peek(scout, keyword) || keyword) return false;
  deck_fields(scout, true, field, whole, comma);
  return field.size() == 6;
}

}  // namespace

// ---------------------------------------------------------------------------
// deck_dimension : 3 when the deck has elements C3D... or a *GRID with a box of six numbers, else 2.
// Scans the keyword lines before the cards are read, with the parameters that names of *INCLUDE need; errors
// are left to the readers.
// ---------------------------------------------------------------------------
int deck_dimension(const Deck& d, const std::string& path)
{
  Deck scout;
  Model none;
  scout.params = d.params;
  bool keyword = false;
  if (!deck_open(scout, path, nullptr)) return 2;
  while (deck_peek(scout, keyword)) {
    if (!keyword) {
      ++scout.reading.back().line;
      continue;
    }
    Card card;
    card.deck = &scout;
    deck_head(scout, card.head);
    const Head& head = card.head;
    if (head.word == "PARAMETER") kw_parameter(card, none);
    if (head_is_solid(head) || (head.word == "GRID" && grid_is_solid(scout))) return 3;
  }
  return 2;
}

// ---------------------------------------------------------------------------
// deck_same_dimension : checks that elements and grid of a deck have one dimension
//
//   in   at, name   the word that implies the dimension dim, and its name in messages
//   out  false: earlier elements or grid have another dimension; reported
// ---------------------------------------------------------------------------
bool deck_same_dimension(Deck& d, const Field& at, const std::string& name, int dim)
{
  if (d.dimension.first == 0) {
    d.dimension.first = dim;
    d.dimension.name  = name;
    d.dimension.spot  = Spot{at.file, at.line};
  }
  if (d.dimension.first == dim) return true;
  const char* const word[2] = {"two", "three"};
  deck_error(d, at,
             name + " has " + word[dim - 2] + " dimensions, but " + d.dimension.name + " of " +
                 spot_text(d, d.dimension.spot) + " has " + word[d.dimension.first - 2] +
                 "; all elements and the grid of a deck must have the same dimension");
  return false;
}
