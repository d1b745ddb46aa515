#include <algorithm>

#include <Eigen/Core>

#include "base/gather_lists.h"
#include "base/grow.h"
#include "base/hash.h"
#include "point/point.h"

void point_add_mass(const Points& pts, int first, RealVec& mass)
{
  for (int p = first; p < pts.npoint; ++p) {
    const double* m = pts.mc(p);
    const int *corner = pts.conn.begin(p), nen = pts.conn.count(p);
    for (int a = 0; a < nen; ++a)
      for (int b = 0; b <= a; ++b, ++m) {
        mass[corner[a]] += *m;
        if (a != b) mass[corner[b]] += *m;
      }
  }
}

namespace {

// the domains of list around each corner, as indices into Points::conn.item; of: the domain of such an item
ListTable domains_around(const Points& pts, const IntVec& list, IntVec& of)
{
  of.resize(pts.conn.item.size());
  return gather_lists(pts.ncorner, [&](auto use) {
    for (int p : list)
      for (int k = pts.conn.off[p]; k < pts.conn.off[p + 1]; ++k) {
        use(pts.conn.item[k], k);
        of[k] = p;
      }
  });
}

// check sum of the domains of list, not 0
std::uint64_t sum_of_domains(const Points& pts, const IntVec& list, bool lumps)
{
  std::uint64_t sum = hash_mix(hash_start, static_cast<std::uint64_t>(2 * pts.ncorner + lumps));
  const auto add    = [&](int k) { sum = hash_mix(sum, static_cast<unsigned>(k)); };
  for (int p : list) {
    add(p);
    add(pts.parent[p]);
    std::for_each(pts.conn.begin(p), pts.conn.begin(p + 1), add);
  }
  for (int c = 0; c < pts.ncorner && lumps; ++c) add(pts.carrier(c));
  return sum ? sum : 1;
}

// moves the masses of corners that follow others to these                                       (6.47)
void lump_followers(const Points& pts, CornerMass& m)
{
  m.own     = m.diag;
  m.carried = m.diag;
  for (int c = 0; c < pts.ncorner; ++c) {
    if (pts.carrier(c) != HANG_CORNERS) continue;
    m.diag[c] = m.carried[c] = 0.0;
    for (int k = pts.hang.off[c]; k < pts.hang.off[c + 1]; ++k)
      m.carried[-1 - pts.hang.item[k]] += pts.hang_w[k] * m.own[c];
  }
  for (int c = 0; c < pts.ncorner; ++c) m.diag[c] = pts.carrier(c) == HANG_NODE ? 0.0 : m.carried[c];
}

// the components of a corner value, in one vector register
template <int D>
using Dirs = Eigen::Array<double, D, 1>;

template <int D>
void momentum(const CornerMass& m, const double* v, double* q)
{
  const int ncorner = static_cast<int>(m.diag.size()), *off = m.off.data(), *col = m.col.data();
  const double *diag = m.diag.data(), *val = m.val.data();
  for (int c = 0; c < ncorner; ++c) {
    const Dirs<D> own = Eigen::Map<const Dirs<D>>(v + static_cast<size_t>(c) * D);
    Dirs<D> sum       = diag[c] * own;
    for (int k = off[c], end = off[c + 1]; k < end; ++k) {
      const size_t other = static_cast<size_t>(col[k]) * D;
      sum += val[k] * Eigen::Map<const Dirs<D>>(v + other);
      Eigen::Map<Dirs<D>>(q + other) += val[k] * own;
    }
    Eigen::Map<Dirs<D>>(q + static_cast<size_t>(c) * D) = sum;
  }
}

}  // namespace

void point_corner_mass(const Points& pts, const IntVec& list, bool lumps, CornerMass& m)
{
  const std::uint64_t made_of = sum_of_domains(pts, list, lumps);
  if (m.made_of == made_of) return;
  m.made_of = made_of;
  m.off.assign(1, 0);
  m.col.clear();
  m.val.clear();
  IntVec of;
  const ListTable around = domains_around(pts, list, of);
  m.diag.assign(pts.ncorner, 0.0);
  IntVec last(pts.ncorner, -1);                      // [corner] index of its last entry in col
  for (int c = 0; c < pts.ncorner; ++c) {
    for (int k = around.off[c]; k < around.off[c + 1]; ++k) {
      const int p = of[around.item[k]], a = around.item[k] - pts.conn.off[p], *corner = pts.conn.begin(p);
      for (int b = 0; b < pts.conn.count(p); ++b) {
        const int d       = corner[b];
        const double mass = pts.mc(p)[a >= b ? pair_index(a, b) : pair_index(b, a)];
        if (d == c) m.diag[c] += mass;
        if (d >= c) continue;
        if (last[d] < m.off[c]) {
          last[d] = static_cast<int>(m.col.size());
          room_for(m.col, 1, 8);
          room_for(m.val, 1, 8);
          m.col.push_back(d);
          m.val.push_back(0.0);
        }
        m.val[last[d]] += mass;
      }
    }
    m.off.push_back(static_cast<int>(m.col.size()));
  }
  m.own.clear();
  m.carried.clear();
  if (lumps) lump_followers(pts, m);
}

std::vector<char> point_as_elements(const Points& pts, int nelem, bool& all)
{
  all = true;
  std::vector<char> as(nelem, 0);
  const auto follows = [&](int c) {
    if (c >= pts.hang.size() || pts.hang.count(c) == 0 || pts.field[c] == FIELD_OWN) return false;
    return pts.hang.count(c) == 1 || pts.carrier(c) == HANG_CORNERS;
  };
  for (int e = 0; e < nelem && !pts.of_elem.empty(); ++e) {
    if (!pts.converted(e)) continue;
    as[e] = 1;
    for (int p = pts.of_elem[e]; p < pts.npoint && pts.parent[p] == e; ++p)
      as[e] = as[e] && !pts.released[p] && std::all_of(pts.conn.begin(p), pts.conn.begin(p + 1), follows);
    all = all && as[e];
  }
  return as;
}

RealVec point_corner_momentum(const CornerMass& m, int dim, const RealVec& vc)
{
  RealVec q(vc.size());
  if (dim == 2) momentum<2>(m, vc.data(), q.data());
  else momentum<3>(m, vc.data(), q.data());
  return q;
}

void point_centre(const Points& pts, int dim, int p, double X[3])
{
  std::fill(X, X + 3, 0.0);
  const double* w = pts.w(p);
  for (int a = 0; a < pts.conn.count(p); ++a)
    for (int i = 0; i < dim; ++i) X[i] += w[a] * pts.Xc[pts.conn.begin(p)[a] * dim + i];
}

RealVec point_velocities(const Points& pts, int dim, const RealVec& vc)
{
  RealVec vp(static_cast<size_t>(pts.npoint) * dim, 0.0);
  for (int p = 0; p < pts.npoint; ++p) {
    const double* w = pts.w(p);
    for (int a = 0; a < pts.conn.count(p); ++a)
      for (int i = 0; i < dim; ++i) vp[p * dim + i] += w[a] * vc[pts.conn.begin(p)[a] * dim + i];
  }
  return vp;
}
