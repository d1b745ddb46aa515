#include "model/state_number.h"

#include <algorithm>
#include <numeric>

namespace {

// node, elem, corner: maps of indices; before, now: number of nodes, after which corners are counted
template <class Node, class Elem, class Corner>
void renumber(int before, int now, Node node, Elem elem, Corner corner, State& st)
{
  Points& p = st.points;
  for (int& e : p.parent)
    if (e >= 0) e = elem(e);
  for (int& n : p.hang.item)
    if (n >= 0) n = node(n);
  Bonds& b = st.bonds;
  for (int& k : b.a.item) k = k < before ? node(k) : now + corner(k - before);
  for (SkinFace& f : b.contact.skin)
    if (!f.points) f.elem = elem(f.elem);
  for (IntVec* list : {&st.frac.releasing, &st.frac.converted})
    for (int& e : *list) e = elem(e);
  for (int& e : st.frac.tip_elem)
    if (e >= 0) e = elem(e);
}

}  // namespace

int Points::corner_here(int number) const
{
  if (part.corner.empty()) return number;
  const IntVec& list = part.corner;
  if (!part.window) {
    const auto here = std::lower_bound(list.begin(), list.end(), number);
    return here != list.end() && *here == number ? static_cast<int>(here - list.begin()) : -1;
  }
  const auto here = std::lower_bound(part.numbered.begin(), part.numbered.end(), number,
                                     [&](int c, int value) { return list[c] < value; });
  return here != part.numbered.end() && list[*here] == number ? *here : -1;
}

int Points::point_here(int number) const
{
  const auto here = std::lower_bound(part.point.begin(), part.point.end(), number);
  return here != part.point.end() && *here == number ? static_cast<int>(here - part.point.begin()) : -1;
}

IntVec deck_order(const MeshPart& part)
{
  IntVec node(part.deck.size());
  std::iota(node.begin(), node.end(), 0);
  std::sort(node.begin(), node.end(), [&](int a, int b) { return part.deck[a] < part.deck[b]; });
  return node;
}

void state_to_deck(const MeshPart& part, State& st)
{
  if (!part.on) return;
  renumber(
      static_cast<int>(part.node.size()), part.nnode, [&](int n) { return part.deck[n]; },
      [&](int e) { return part.elem[e]; },
      [&](int c) { return st.points.corner_number(c); }, st);
}

void state_from_deck(const MeshPart& part, State& st)
{
  if (!part.on) return;
  IntVec releasing;            // an invalid number is kept, for state_fault
  for (int number : st.frac.releasing)
    if (part.elem_here(number) >= 0 || number < 0 || number >= part.nelem) releasing.push_back(number);
  st.frac.releasing.swap(releasing);
  const int nnode   = static_cast<int>(part.node.size());
  const IntVec node = deck_order(part);
  const auto here   = [&](int number) {
    const auto at = std::lower_bound(node.begin(), node.end(), number,
                                     [&](int n, int value) { return part.deck[n] < value; });
    return at != node.end() && part.deck[*at] == number ? *at : -1;
  };
  renumber(
      part.nnode, nnode, here,
      [&](int e) { return part.elem_here(e); },
      [&](int c) {                           // invalid corner numbers are not found
        const int corner = st.points.corner_here(c);
        return corner < 0 ? st.points.ncorner : corner;
      },
      st);
}
