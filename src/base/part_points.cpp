#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/box_tree.h"
#include "base/part_points.h"

namespace {

// fraction of the work by which a cut may deviate from the middle, to be straight  (no test)
const double ASIDE = 0.01;

struct Box {
  int side = 0;                // the longest one
  double size = 0.0, work = 0.0;
};

// sides of the box of the items [3]
void find_sides(const RealVec& X, const int* begin, const int* end, double* side)
{
  BoundingBox box;
  for (const int* e = begin; e != end; ++e) box_take(box, &X[3 * static_cast<size_t>(*e)]);
  for (int i = 0; i < 3; ++i) side[i] = std::max(box.hi[i] - box.lo[i], 0.0);
}

Box find_box(const RealVec& X, const RealVec& work, const int* begin, const int* end)
{
  Box box;
  double side[3];
  find_sides(X, begin, end, side);
  for (const int* e = begin; e != end; ++e) box.work += work[*e];
  box.side = static_cast<int>(std::max_element(side, side + 3) - side);
  box.size = side[box.side];
  return box;
}

// end of the first part of the work: the widest gap between neighbours close to it
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
    // a wider gap that is close; equally wide and closer; or, without a close one so far, closer
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

// parts of equal work, by recursive cuts across the longest side
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

// normals of planes tried by part_planes: sides and diagonals of a cube, and directions between them in 2D
const double NORMAL[25][3] = {{1, 0, 0},  {0, 1, 0},  {0, 0, 1},  {1, 1, 0},   {1, -1, 0},
                              {1, 0, 1},  {1, 0, -1}, {0, 1, 1},  {0, 1, -1},  {1, 1, 1},
                              {1, 1, -1}, {1, -1, 1}, {-1, 1, 1}, {1, 2, 0},   {2, 1, 0},
                              {1, -2, 0}, {2, -1, 0}, {1, 0, 2},  {2, 0, 1},   {1, 0, -2},
                              {2, 0, -1}, {0, 1, 2},  {0, 2, 1},  {0, 1, -2},  {0, 2, -1}};

// An item, and its coordinate along a normal
struct Along {
  double x;
  int thing;
  bool operator<(const Along& o) const { return x != o.x ? x < o.x : thing < o.thing; }
};

// A cut of items in two
struct Cut {
  std::vector<Along> order;    // items of the first part, then the others
  size_t left = 0;             // number of items of the first part
  double surplus = 1e300;      // excess work, and items at the cut, as fractions of all
};

// size of the space of each of n items, as if they filled their box
double spacing(const double* side, size_t n)
{
  double volume = 1.0;
  int sides = 0;
  for (int i = 0; i < 3; ++i) {
    if (side[i] == 0.0) continue;
    volume *= side[i];
    ++sides;
  }
  return sides ? std::pow(volume / static_cast<double>(n), 1.0 / sides) : 0.0;
}

// Number of items before the position where the work, summed along the normal, reaches goal; they are first
// in order, followed by the next one
size_t reach_goal(const RealVec& work, double goal, std::vector<Along>& order)
{
  size_t first = 0, last = order.size();
  double before = 0.0;
  while (first < last) {
    const size_t middle = first + (last - first) / 2;
    std::nth_element(order.begin() + first, order.begin() + middle, order.begin() + last);
    double sum = before;
    for (size_t k = first; k < middle; ++k) sum += work[order[k].thing];
    const double own = work[order[middle].thing];
    if (sum + 0.5 * own > goal) {
      last = middle;
    } else {
      first  = middle + 1;
      before = sum + own;
    }
  }
  return first;
}

// cut normal to n, with a fraction of the sum of all kinds of work on the left; items within h/2
// of the plane are at the cut
Cut cut_across(const RealVec& X, const std::vector<RealVec>& work, const RealVec& sum, const double* n,
               double part, double h, const int* begin, const int* end)
{
  Cut cut;
  const double size = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  RealVec all(work.size(), 0.0), left(work.size(), 0.0);
  cut.order.reserve(end - begin);
  for (const int* e = begin; e != end; ++e) {
    const double* x = &X[3 * static_cast<size_t>(*e)];
    cut.order.push_back({(n[0] * x[0] + n[1] * x[1] + n[2] * x[2]) / size, *e});
    for (size_t k = 0; k < work.size(); ++k) all[k] += work[k][*e];
  }
  const double whole = std::accumulate(all.begin(), all.end(), 0.0);
  cut.left = reach_goal(sum, part * whole, cut.order);
  for (size_t i = 0; i < cut.left; ++i)
    for (size_t k = 0; k < work.size(); ++k) left[k] += work[k][cut.order[i].thing];
  double most = 0.0, near = 0.0;
  for (size_t k = 0; k < work.size(); ++k)
    most += std::max(left[k] / part, (all[k] - left[k]) / (1.0 - part));
  const double at = cut.order[std::min(cut.left, cut.order.size() - 1)].x;
  for (const Along& a : cut.order) near += std::abs(a.x - at) <= 0.5 * h;
  cut.surplus = most / std::max(whole, 1e-300) + near / static_cast<double>(end - begin);
  return cut;
}

//   sum   of all kinds of work [n]
void cut_again(const RealVec& X, const std::vector<RealVec>& work, const RealVec& sum, int* begin, int* end,
               int first, int parts, IntVec& part)
{
  if (parts == 1 || end - begin < 2) {
    for (int* e = begin; e != end; ++e) part[*e] = first;
    return;
  }
  const int left = parts / 2;
  double side[3];
  find_sides(X, begin, end, side);
  const double h = spacing(side, end - begin);
  Cut best;
  for (const auto& n : NORMAL) {
    bool flat = false;
    for (int i = 0; i < 3; ++i) flat = flat || (n[i] != 0.0 && side[i] == 0.0);
    if (flat && best.order.size()) continue;
    Cut cut = cut_across(X, work, sum, n, static_cast<double>(left) / parts, h, begin, end);
    if (cut.surplus < best.surplus - 1e-9) best = std::move(cut);
  }
  std::transform(best.order.begin(), best.order.end(), begin, [](const Along& a) { return a.thing; });
  cut_again(X, work, sum, begin, begin + best.left, first, left, part);
  cut_again(X, work, sum, begin + best.left, end, first + left, parts - left, part);
}

}  // namespace

// ---------------------------------------------------------------------------
// part_points : items at X [n*3] in parts of equal work [n] by planes across the longest side
//
// A plane is put into the widest gap within a hundredth of the work, so that cuts of regular meshes are
// straight.
// ---------------------------------------------------------------------------
IntVec part_points(const RealVec& X, const RealVec& work, int parts)
{
  IntVec order(work.size()), part(work.size(), 0);
  std::iota(order.begin(), order.end(), 0);
  bisect(X, work, order.data(), order.data() + order.size(), 0, parts, part);
  return part;
}

RealVec part_sums(const std::vector<RealVec>& weight)
{
  RealVec sums(weight[0].size(), 0.0);
  for (const RealVec& kind : weight)
    for (size_t r = 0; r < sums.size(); ++r) sums[r] += kind[r];
  return sums;
}

// ---------------------------------------------------------------------------
// part_planes : as part_points with kinds of work [kinds][n]
//
// Each cut takes the normal, among 25, with the smallest sum of excess work of each kind and
// of items at the cut.
// ---------------------------------------------------------------------------
IntVec part_planes(const RealVec& X, const std::vector<RealVec>& work, int parts)
{
  const size_t n = work[0].size();
  IntVec order(n), part(n, 0);
  std::iota(order.begin(), order.end(), 0);
  cut_again(X, work, part_sums(work), order.data(), order.data() + n, 0, parts, part);
  return part;
}
