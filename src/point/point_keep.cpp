#include <algorithm>

#include <Eigen/Core>

#include "point/grid_cell.h"

namespace {

// dS of a node in the plane is one vector register; support: null when it is not asked for
template <int D, bool SUPPORT>
void sums(const Points& pts, ActiveGrid& g, double* support)
{
  using Dir = Eigen::Array<double, D, 1>;
  RealVec S_of_point;
  const int *slot = g.slot.data(), *corner_off = g.corner.off.data(), *corner = pts.conn.item.data();
  const int *conn_off = pts.conn.off.data(), *point_off = g.point.off.data(), *node = g.point.item.data();
  const double *corner_w = g.corner_w.data(), *G = pts.G.data(), *w = pts.w.data();
  double* dS = g.dS.data();
  for (int p = 0, npoint = pts.npoint; p < npoint; ++p) {
    const int n = point_off[p + 1] - point_off[p];
    if (SUPPORT) S_of_point.assign(n, 0.0);
    double* S = S_of_point.data();
    std::fill(dS, dS + n * D, 0.0);
    for (int k = conn_off[p], end = conn_off[p + 1]; k < end; ++k) {
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

// the same points, all of them on the grid, and no support decides more than whether a node is weak
bool same_points(const Points& pts, const Bonds& bonds, const ActiveGrid& g)
{
  return !pts.part.on && g.nnode > 0 && g.nlone == 0 && pts.hangs.empty() &&
         g.places.bond.size() == static_cast<size_t>(bonds.nbond) && g.places.conn == pts.conn.item &&
         g.places.field == pts.field &&
         std::find(pts.field.begin(), pts.field.end(), FIELD_OWN) == pts.field.end() &&
         std::find(pts.released.begin(), pts.released.end(), 1) == pts.released.end();
}

// The weights of x where it is still inside of the cell, and on the same of its lower faces: within rounding
// as same_weights, which looks at the whole grid
template <int D>
bool weights_in_cell(const Grid& grid, const double* x, const CornerCell& c, double* w)
{
  int n = 1;
  w[0]  = 1.0;
  for (int i = 0; i < D; ++i) {
    const double xi = (x[i] - grid.lo[i]) / grid.h[i] - c.cell[i];
    if (c.face[i]) {
      if (std::fabs(xi) >= snap_to_face) return false;
      continue;
    }
    if (!(xi >= snap_to_face && xi <= 1.0 - snap_to_face)) return false;
    for (int k = 0; k < n; ++k) {
      w[n + k] = w[k] * xi;
      w[k] *= 1.0 - xi;
    }
    n *= 2;
  }
  return true;
}

// weights [count] of a place, when its code is still this one
template <int D>
bool same_weights(const Grid& grid, int field, const double* x, long code, double* w, int count)
{
  CellPlace s;
  long key[1 << D];
  double all[1 << D];
  if (!locate<D>(grid, x, s) || place_code<D>(grid, field, s) != code) return false;
  cell_weights<D>(grid, field, s, key, all);
  std::copy(all, all + count, w);
  return true;
}

// corners at x and bonds are in the same cells; makes their weights on touched nodes
template <int D>
bool same_cells(const Grid& grid, const Points& pts, const Bonds& bonds, const RealVec& x,
                const RealVec& xb, const GridPlaces& before, const ListTable& corner, RealVec& corner_w,
                const ListTable& bond, RealVec& bond_w)
{
  for (int c = 0; c < pts.ncorner; ++c)
    if (before.corner[c] >= 0 &&
        !weights_in_cell<D>(grid, &x[static_cast<size_t>(c) * D], before.cell[c], &corner_w[corner.off[c]]) &&
        !same_weights<D>(grid, pts.field[c], &x[static_cast<size_t>(c) * D], before.corner[c],
                         &corner_w[corner.off[c]], corner.count(c)))
      return false;
  for (int b = 0; b < bonds.nbond; ++b) {
    if ((bonds.field[b] >= 0) != (before.bond[b] >= 0)) return false;
    if (bonds.field[b] >= 0 &&
        !same_weights<D>(grid, bonds.field[b], &xb[static_cast<size_t>(b) * D], before.bond[b],
                         &bond_w[bond.off[b]], bond.count(b)))
      return false;
  }
  return true;
}

// centres of points are in the same cells; room: to the next face of a cell, in cells
template <int D>
bool same_centres(const Grid& grid, const Points& pts, const RealVec& x, const GridPlaces& before,
                  double& room)
{
  CellPlace s;
  for (int p = 0; p < pts.npoint; ++p) {
    double mid[D] = {};
    for (int k = pts.conn.off[p]; k < pts.conn.off[p + 1]; ++k)
      for (int i = 0; i < D; ++i) mid[i] += pts.w[k] * x[pts.conn.item[k] * D + i];
    const bool inside = locate<D>(grid, mid, s);
    if ((inside ? cell_key(grid, D, pts.field[pts.conn.begin(p)[0]], s.cell) : -1) != before.point[p])
      return false;
    if (!inside) room = 0.0;
    for (int i = 0; i < D; ++i) room = std::min({room, s.xi[i], 1.0 - s.xi[i]});
  }
  return true;
}

// the longest way of a corner, in cells, summed over the directions: what the weights S_pv of a point and the
// place of its centre change by at most
template <int D>
double longest_way(const Grid& grid, const RealVec& from, const RealVec& to)
{
  double most = 0.0, size[D];
  for (int i = 0; i < D; ++i) size[i] = 1.0 / grid.h[i];
  for (size_t c = 0; c < to.size(); c += D) {
    double way = 0.0;
    for (int i = 0; i < D; ++i) way += std::fabs(to[c + i] - from[c + i]) * size[i];
    most = std::max(most, way);
  }
  return most;
}

// max_p S_pv of every touched node, when some are weak                              (3.10)
void touched_support(const Points& pts, const GridPlaces& now, RealVec& support)
{
  const ListTable &corner = now.raw_corner.list, &point = now.raw_point;
  const double* corner_w  = now.raw_corner.w.data();
  const int* slot = now.raw_slot.data();
  RealVec sum;
  support.assign(now.touched.size(), 0.0);
  for (int p = 0; p < pts.npoint; ++p) {
    const int n = point.count(p), *item = point.begin(p);
    sum.assign(n, 0.0);
    double* S = sum.data();
    for (int k = pts.conn.off[p]; k < pts.conn.off[p + 1]; ++k) {
      const int c     = pts.conn.item[k];
      const double wc = pts.w[k];
      for (int j = corner.off[c]; j < corner.off[c + 1]; ++j) S[*slot++] += wc * corner_w[j];
    }
    for (int a = 0; a < n; ++a) support[item[a]] = std::max(support[item[a]], S[a]);
  }
}

// where grid_compose puts what each raw node gives to those it follows
void find_composed(const GridLists& ext, const GridLists& raw, const ListTable& list, IntVec& place)
{
  place.clear();
  for (int i = 0; i < list.size(); ++i)
    for (int k = raw.list.off[i]; k < raw.list.off[i + 1]; ++k)
      for (int j = ext.list.off[raw.list.item[k]]; j < ext.list.off[raw.list.item[k] + 1]; ++j) {
        int at = list.off[i];
        while (list.item[at] != ext.list.item[j]) ++at;
        place.push_back(at);
      }
}

// grid_compose for lists that stay; place: of find_composed, empty: not known yet
void compose_weights(const GridLists& ext, const GridLists& raw, const ListTable& list, IntVec& place,
                     RealVec& w)
{
  if (place.empty()) find_composed(ext, raw, list, place);
  std::fill(w.begin(), w.end(), 0.0);
  const int *at = place.data(), *node = raw.list.item.data(), *off = ext.list.off.data();
  const double* follows = ext.w.data();
  for (size_t k = 0; k < raw.w.size(); ++k)
    for (int j = off[node[k]], end = off[node[k] + 1]; j < end; ++j) w[*at++] += raw.w[k] * follows[j];
}

template <int D>
bool same_lists(const Model& m, const Points& pts, const Bonds& bonds, const RealVec& uc, const RealVec& xb,
                ActiveGrid& g)
{
  const double rounding = 1e-9;          // of the way and of the room, in cells
  GridPlaces& now = g.places;
  const bool weak = g.of_all.weak > 0;
  RealVec x(pts.Xc.size());
  for (size_t i = 0; i < x.size(); ++i) x[i] = pts.Xc[i] + uc[i];
  if (!same_cells<D>(m.grid, pts, bonds, x, xb, now, weak ? now.raw_corner.list : g.corner,
                     weak ? now.raw_corner.w : g.corner_w, weak ? now.raw_bond.list : g.bond,
                     weak ? now.raw_bond.w : g.bond_w))
    return false;
  if (now.room > 0.0 && longest_way<D>(m.grid, now.seen, x) + rounding < now.room) {
    if (!weak) point_sums(pts, D, g.nnode, g, nullptr);
    return true;
  }
  RealVec support;
  now.room = 1.0;
  if (!same_centres<D>(m.grid, pts, x, now, now.room)) return false;
  if (weak) touched_support(pts, now, support);
  else point_sums(pts, D, g.nnode, g, &support);
  for (size_t r = 0; r < support.size(); ++r) {
    if (grid_is_weak(m.grid, support[r]) == (now.strong[r] != 0)) return false;
    now.room = std::min(now.room, std::fabs(support[r] - m.grid.weak));
  }
  now.seen.swap(x);
  return true;
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
          out.item.push_back(n);
          out_w.push_back(0.0);
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

bool grid_keeps_lists(const Model& m, const Points& pts, const Bonds& bonds, const RealVec& uc,
                      const RealVec& xb, ActiveGrid& g)
{
  if (!same_points(pts, bonds, g)) return false;
  if (!(m.dim == 2 ? same_lists<2>(m, pts, bonds, uc, xb, g) : same_lists<3>(m, pts, bonds, uc, xb, g)))
    return false;
  GridPlaces& now = g.places;
  grid_ghost(m, pts, uc, now.touched, nullptr, g);
  if (g.of_all.weak == 0) return true;
  compose_weights(now.extend, now.raw_corner, g.corner, now.corner_place, g.corner_w);
  compose_weights(now.extend, now.raw_bond, g.bond, now.bond_place, g.bond_w);
  grid_compose(now.extend, g.nnode, g.ghost, g.ghost_w);
  point_sums(pts, m.dim, g.nnode, g, nullptr);
  return true;
}
