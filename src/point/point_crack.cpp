#include <algorithm>
#include <cmath>

#include "base/weibull.h"
#include "mat/law.h"
#include "point/point_body.h"

namespace {

// mean normal at t(n) of the cracks of the points of one initial cell, weighted by their openings; 0: none
void mean_normal(const Points& pts, const MatLaw& law, const Level& l, int p, double* mean)
{
  const size_t history = point_history_size(pts, l);
  std::fill_n(mean, 3, 0.0);
  int q = p;
  do {
    const double *h = history_at(l.hp, history, q), *N = crack_normal(law, h);
    const double opening = crack_opening(law, h);
    const double sign = N[0] * mean[0] + N[1] * mean[1] + N[2] * mean[2] < 0.0 ? -1.0 : 1.0;
    for (int i = 0; i < 3 && opening > 0.0; ++i) mean[i] += sign * opening * N[i];
    q = pts.next[q];
  } while (q != p);
  const double length = std::sqrt(mean[0] * mean[0] + mean[1] * mean[1] + mean[2] * mean[2]);
  for (int i = 0; i < 3 && length > 0.0; ++i) mean[i] /= length;
}

// edges of the box that opens as one: a cell of the grid, or the domain where it is larger      (2.36a)
void find_box(const Model& m, const Points& pts, int p, double* box)
{
  for (int i = 0; i < m.dim; ++i) {
    double lo = HUGE_VAL, hi = -HUGE_VAL;
    for (int a = 0; a < pts.conn.count(p); ++a) {
      const double X = pts.Xc[static_cast<size_t>(pts.conn.begin(p)[a]) * m.dim + i];
      lo = std::min(lo, X);
      hi = std::max(hi, X);
    }
    box[i] = std::max(m.grid.h[i], hi - lo);
  }
}

// index in hp of the factor of strength and toughness of point p: before the last, see law_history
size_t scatter_at(const Points& pts, const RealVec& hp, int p)
{
  return hp.size() / pts.npoint * (static_cast<size_t>(p) + 1) - 2;
}

// a law of the kind of this body
MatLaw kind_of(const Model& m, const Body& body)
{
  MatLaw law;
  law.kind = law_flows(m.material[body.material].law) ? LAW_COHESIVE_FLOW : LAW_COHESIVE;
  return law;
}

}  // namespace

void point_crack(const Model& m, const Points& pts, const Level& l, int p, CrackTangent tangent, MatLaw& law)
{
  const Body& body       = m.body[pts.body[p]];
  const FractureDef& f   = m.fracture[body.fracture];
  const Eigen::Matrix3d F = point_gradient(pts, m.dim, l.uc, p);
  CrackLaw& c = law.crack;
  find_box(m, pts, p, c.box);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c.F[3 * i + j] = F(i, j);
  if (f.weibull > 0.0) c.scatter = l.hp[scatter_at(pts, l.hp, p)];
  c.tangent = tangent;
  law.broken = point_open(m, pts, l, p);
  mean_normal(pts, law, l, p, c.across);
}

void point_scatter(const Model& m, const Points& pts, RealVec& hp)
{
  for (size_t b = 0; b < m.body.size(); ++b) {
    if (m.body[b].fracture < 0 || m.fracture[m.body[b].fracture].weibull == 0.0) continue;
    const FractureDef& f = m.fracture[m.body[b].fracture];
    IntVec point, at;          // the first point of each initial cell, and its number
    for (int p = 0; p < pts.npoint; ++p) {
      bool first = pts.body[p] == static_cast<int>(b);
      for (int q = pts.next[p]; q != p && first; q = pts.next[q]) first = q > p;
      if (!first) continue;
      point.push_back(p);
      at.push_back(pts.point_number(p));
    }
    const RealVec factor = weibull_draw(f.weibull, 1.0, f.seed, at);
    for (size_t k = 0; k < point.size(); ++k) {
      int q = point[k];
      do {
        hp[scatter_at(pts, hp, q)] = factor[k];
        q = pts.next[q];
      } while (q != point[k]);
    }
  }
}

void point_crack_law(const Model& m, const Body& body, MatLaw& law)
{
  if (body.fracture < 0) return;
  const FractureDef& f = m.fracture[body.fracture];
  law.kind      = law_flows(law.kind) ? LAW_COHESIVE_FLOW : LAW_COHESIVE;
  law.c         = f.stiffness;
  law.bar       = false;
  law.crack     = crack_of(f);
  law.crack.dim = m.dim;
}

double point_opening(const Model& m, const Points& pts, const Level& l, size_t n, int p)
{
  const Body& body = m.body[pts.body[p]];
  if (body.fracture < 0 || n == 0) return 0.0;
  return crack_opening(kind_of(m, body), history_at(l.hp, n, p)) /
         crack_open(crack_of(m.fracture[body.fracture]));
}

double point_crack_width(const Model& m, const Points& pts, const Level& l, int p)
{
  const MatLaw law = kind_of(m, m.body[pts.body[p]]);
  return crack_band(law, history_at(l.hp, point_history_size(pts, l), p));
}
