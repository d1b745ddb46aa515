#include <algorithm>

#include "base/comm.h"
#include "frac/frac.h"
#include "mat/law.h"

namespace {

struct OpenedPoint {
  ErosionLog log;
  double area;                 // of the crack                                  length x thickness
};

// part of the increment at which the crack of point p is open
double when_open(double before, double after)
{
  return after > before ? std::clamp((1.0 - before) / (after - before), 0.0, 1.0) : 1.0;
}

OpenedPoint opened(const Model& m, const Points& pts, const Level& l0, const Level& l1, int p)
{
  const size_t n = point_history_size(pts, l1);
  const double before = point_opening(m, pts, l0, n, p), after = point_opening(m, pts, l1, n, p);
  OpenedPoint x;
  x.log.label = pts.label[p];
  x.log.time  = l0.time + when_open(before, after) * (l1.time - l0.time);
  x.log.value = after;
  point_centre(pts, m.dim, p, x.log.X);
  x.area = pts.V0[p] / point_crack_width(m, pts, l1, p);
  return x;
}

}  // namespace

std::vector<ErosionLog> frac_points_open(const Model& m, const Points& pts, const Level& l0, const Level& l1,
                                         Fracture& fr)
{
  std::vector<OpenedPoint> all;
  std::vector<ErosionLog> out;
  if (std::none_of(m.body.begin(), m.body.end(), [](const Body& b) { return b.fracture >= 0; })) return out;
  const size_t n = point_history_size(pts, l1);       // l0 may lack the points of elements just converted
  for (int p = 0; p < pts.npoint; ++p)
    if (m.body[pts.body[p]].fracture >= 0 && point_counts(m, pts, p) && point_open(m, pts, l1, p) &&
        point_opening(m, pts, l0, n, p) < 1.0)
      all.push_back(opened(m, pts, l0, l1, p));
  if (m.part.on) comm_allgatherv(all);
  std::sort(all.begin(), all.end(),
            [](const OpenedPoint& a, const OpenedPoint& b) { return a.log.label < b.log.label; });
  for (const OpenedPoint& x : all) {
    out.push_back(x.log);
    fr.area += x.area;
    for (int i = 0; i < 3; ++i) {
      fr.least[i] = std::min(fr.least[i], x.log.X[i]);
      fr.most[i]  = std::max(fr.most[i], x.log.X[i]);
    }
  }
  fr.neroded += static_cast<int>(out.size());
  return out;
}
