#include <algorithm>
#include <numeric>

#include "base/part_places.h"

namespace {

// part of the work that a cut may leave the middle by, for a straight one
const double ASIDE = 0.01;

struct Box {
  int side = 0;                // the longest one
  double size = 0.0, work = 0.0;
};

Box find_box(const RealVec& X, const RealVec& work, const int* begin, const int* end)
{
  Box box;
  double lo[3] = {1e300, 1e300, 1e300}, hi[3] = {-1e300, -1e300, -1e300};
  for (const int* e = begin; e != end; ++e) {
    box.work += work[*e];
    for (int i = 0; i < 3; ++i) {
      lo[i] = std::min(lo[i], X[3 * static_cast<size_t>(*e) + i]);
      hi[i] = std::max(hi[i], X[3 * static_cast<size_t>(*e) + i]);
    }
  }
  for (int i = 0; i < 3; ++i)
    if (hi[i] - lo[i] > box.size) {
      box.side = i;
      box.size = hi[i] - lo[i];
    }
  return box;
}

// where the first part of the work ends: the widest gap between neighbours that is near
int* find_cut(const RealVec& X, const RealVec& work, const Box& box, double goal, int* begin, int* end)
{
  const double aside = ASIDE * box.work, rounding = 1e-9 * box.size;
  double sum = 0.0, widest = -1.0, off = 0.0;
  int* cut = begin;
  for (int* e = begin; e != end; ++e) {
    const double gap = e == begin ? 0.0 : X[3 * static_cast<size_t>(e[0]) + box.side] -
                                          X[3 * static_cast<size_t>(e[-1]) + box.side];
    const double far = std::abs(sum - goal);
    const bool near  = far <= aside;
    // a wider gap that is near; as wide and nearer; none near so far, and nearer
    if (widest < 0.0 ? (near || e == begin || far < off)
                     : near && (gap > widest + rounding || (gap > widest - rounding && far < off))) {
      cut = e;
      off = far;
      if (near) widest = gap;
    }
    sum += work[*e];
  }
  return cut;
}

// parts of equal work across the longest side, again and again
void bisect(const RealVec& X, const RealVec& work, int* begin, int* end, int first, int parts, IntVec& part)
{
  if (parts == 1 || end - begin < 2) {
    for (int* e = begin; e != end; ++e) part[*e] = first;
    return;
  }
  const Box box = find_box(X, work, begin, end);
  std::sort(begin, end, [&](int a, int b) {
    const double xa = X[3 * static_cast<size_t>(a) + box.side], xb = X[3 * static_cast<size_t>(b) + box.side];
    return xa != xb ? xa < xb : a < b;
  });
  const int left = parts / 2;
  int* middle = find_cut(X, work, box, box.work * left / parts, begin, end);
  bisect(X, work, begin, middle, first, left, part);
  bisect(X, work, middle, end, first + left, parts - left, part);
}

}  // namespace

// ---------------------------------------------------------------------------
// part_places : things at X [n*3] in parts of equal work [n] by planes across the longest side
//
// A plane goes through the widest gap within a hundredth of the work, so that cuts of regular meshes are
// straight.
// ---------------------------------------------------------------------------
IntVec part_places(const RealVec& X, const RealVec& work, int parts)
{
  IntVec order(work.size()), part(work.size(), 0);
  std::iota(order.begin(), order.end(), 0);
  bisect(X, work, order.data(), order.data() + order.size(), 0, parts, part);
  return part;
}
