#include <algorithm>

#include <Eigen/Core>

#include "base/grow.h"
#include "point/grid_cell.h"

namespace {

// in 2D dS of a node is one vector register
template <int D>
void sums(const Points& pts, ActiveGrid& g)
{
  using Dir = Eigen::Array<double, D, 1>;
  const int *slot = g.slot.data(), *corner_off = g.corner.off.data(), *point_off = g.point.off.data();
  const double* corner_w = g.corner_w.data();
  double* dS = g.dS.data();
  for (int p = 0, npoint = pts.npoint; p < npoint; ++p) {
    const int n = point_off[p + 1] - point_off[p];
    if (n == 0) continue;      // of another rank
    std::fill(dS, dS + n * D, 0.0);
    const double* G   = pts.G(p);
    const int* corner = pts.conn.begin(p);
    for (int k = 0, end = pts.conn.count(p); k < end; ++k) {
      const Dir of_corner = Eigen::Map<const Dir>(G + static_cast<size_t>(k) * D);
      for (int j = corner_off[corner[k]], last = corner_off[corner[k] + 1]; j < last; ++j)
        Eigen::Map<Dir>(dS + *slot++ * D) += corner_w[j] * of_corner;
    }
    dS += n * D;
  }
}

}  // namespace

void grid_compose(const GridLists& ext, int nnode, ListTable& list, RealVec& list_w)
{
  ListTable out;
  RealVec out_w;
  IntVec last(nnode, -1);      // [node] index of its last item in out
  const auto each = [&](auto use) {      // use(node, its index in out, weight)
    int items = 0;
    for (int i = 0; i < list.size(); ++i) {
      const int first = items;
      for (int k = list.off[i]; k < list.off[i + 1]; ++k)
        for (int j = ext.list.off[list.item[k]]; j < ext.list.off[list.item[k] + 1]; ++j) {
          const int n = ext.list.item[j];
          if (last[n] < first) last[n] = items++;
          use(n, last[n], list_w[k] * ext.w[j]);
        }
      out.off[i + 1] = items;
    }
  };
  out.off.assign(list.off.size(), 0);
  each([](int, int, double) {});
  fit_size(out.item, out.off.back());
  fit_size(out_w, out.item.size());
  std::fill(out_w.begin(), out_w.end(), 0.0);
  std::fill(last.begin(), last.end(), -1);
  each([&](int n, int at, double w) {
    out.item[at] = n;
    out_w[at] += w;
  });
  list.off.swap(out.off);
  list.item.swap(out.item);
  list_w.swap(out_w);
}

void point_sums(const Points& pts, int dim, ActiveGrid& g)
{
  fit_size(g.dS, g.point.item.size() * dim + PACK);  // rows of packs extend beyond the last item
  std::fill(g.dS.end() - PACK, g.dS.end(), 0.0);
  if (dim == 2) sums<2>(pts, g);
  else sums<3>(pts, g);
}

RealVec point_support(const Points& pts, int nnode, const ActiveGrid& g)
{
  RealVec support(nnode, 0.0), S;
  const int* slot = g.slot.data();
  for (int p = 0; p < pts.npoint; ++p) {
    const int n = g.point.count(p), *node = g.point.begin(p), *corner = pts.conn.begin(p);
    if (n == 0) continue;      // of another rank
    S.assign(n, 0.0);
    for (int k = 0, end = pts.conn.count(p); k < end; ++k)
      for (int j = g.corner.off[corner[k]]; j < g.corner.off[corner[k] + 1]; ++j)
        S[*slot++] += pts.w(p)[k] * g.corner_w[j];
    for (int a = 0; a < n; ++a) support[node[a]] = std::max(support[node[a]], S[a]);
  }
  return support;
}
