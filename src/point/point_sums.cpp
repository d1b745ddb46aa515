#include <algorithm>

#include <Eigen/Core>

#include "base/grow.h"
#include "point/grid_cell.h"

namespace {

// dS of a node in the plane is one vector register; support: null when it is not asked for
template <int D, bool SUPPORT>
void sums(const Points& pts, ActiveGrid& g, double* support)
{
  using Dir = Eigen::Array<double, D, 1>;
  RealVec S_of_point;
  const int *slot = g.slot.data(), *corner_off = g.corner.off.data();
  const int *point_off = g.point.off.data(), *node = g.point.item.data();
  const double* corner_w = g.corner_w.data();
  double* dS = g.dS.data();
  for (int p = 0, npoint = pts.npoint; p < npoint; ++p) {
    const int n = point_off[p + 1] - point_off[p];
    if (n == 0) continue;      // of another rank
    if (SUPPORT) S_of_point.assign(n, 0.0);
    double* S = S_of_point.data();
    std::fill(dS, dS + n * D, 0.0);
    const double *G = pts.G(p), *w = pts.w(p);
    const int* corner = pts.conn.begin(p);
    for (int k = 0, end = pts.conn.count(p); k < end; ++k) {
      const Dir of_corner = Eigen::Map<const Dir>(G + static_cast<size_t>(k) * D);
      for (int j = corner_off[corner[k]], last = corner_off[corner[k] + 1]; j < last; ++j) {
        const double N = corner_w[j];
        const int at   = *slot++;
        if (SUPPORT) S[at] += w[k] * N;
        Eigen::Map<Dir>(dS + at * D) += N * of_corner;
      }
    }
    const int* item = node + point_off[p];
    for (int a = 0; a < n && SUPPORT; ++a) support[item[a]] = std::max(support[item[a]], S[a]);
    dS += n * D;
  }
}

}  // namespace

void grid_compose(const GridLists& ext, int nnode, ListTable& list, RealVec& list_w)
{
  ListTable out;
  RealVec out_w;
  IntVec place(nnode, -1);     // of a node in out, where it was seen last
  out.off.reserve(list.off.size());
  out.item.reserve(list.item.size());
  out_w.reserve(list.item.size());
  for (int i = 0; i < list.size(); ++i) {
    const int first = out.off[i];
    for (int k = list.off[i]; k < list.off[i + 1]; ++k)
      for (int j = ext.list.off[list.item[k]]; j < ext.list.off[list.item[k] + 1]; ++j) {
        const int n = ext.list.item[j];
        if (place[n] < first) {
          place[n] = static_cast<int>(out.item.size());
          append(out.item, n);
          append(out_w, 0.0);
        }
        out_w[place[n]] += list_w[k] * ext.w[j];
      }
    out.off.push_back(static_cast<int>(out.item.size()));
  }
  list.off.swap(out.off);
  list.item.swap(out.item);
  list_w.swap(out_w);
}

void point_sums(const Points& pts, int dim, int nnode, ActiveGrid& g, RealVec* support)
{
  g.dS.resize(g.point.item.size() * dim + PACK);     // rows of packs end behind the last one
  std::fill(g.dS.end() - PACK, g.dS.end(), 0.0);
  if (!support) return dim == 2 ? sums<2, false>(pts, g, nullptr) : sums<3, false>(pts, g, nullptr);
  support->assign(nnode, 0.0);
  if (dim == 2) sums<2, true>(pts, g, support->data());
  else sums<3, true>(pts, g, support->data());
}
