#include <algorithm>
#include <cmath>

#include "base/log.h"
#include "step/step.h"

namespace {

// a point where the load acts; for loads on bodies of points the origin
const double* load_position(const Model& m, const Load& l)
{
  static const double origin[3] = {0, 0, 0};
  if (l.surface >= 0 && m.surface[l.surface].body >= 0) return origin;
  const int node = !l.node.empty() ? l.node[0] : !l.elem.empty() ? m.mesh.conn.begin(l.elem[0])[0]
                 : l.surface >= 0 ? m.mesh.conn.begin(m.surface[l.surface].face[0].elem)[0] : -1;
  return node >= 0 ? &m.mesh.X[3 * node] : origin;
}

// divided model: is no part of the load on this rank?
bool not_here(const Model& m, const Load& l)
{
  return m.part.on && l.node.empty() && l.elem.empty() &&
         (l.surface < 0 || m.surface[l.surface].face.empty());
}

// warns when value(t) at the fixed increments stays below half of its maximum; part: position in them
template <class Value>
void warn_one(const Step& s, double part, const DeckLine& deck_line, const char* what, Value value)
{
  const int PARTS = 8;
  const double n  = std::ceil(s.period / s.dt - 1e-9);
  if (n > 20000) return;
  double seen = 0.0, largest = 0.0, when = 0.0;
  for (int k = 0; k < static_cast<int>(n); ++k) {
    seen = std::max(seen, std::fabs(value(std::min(s.period, (k + part) * s.dt))));
    for (int j = 0; j <= PARTS; ++j) {
      const double t = std::min(s.period, (k + static_cast<double>(j) / PARTS) * s.dt),
                   f = std::fabs(value(t));
      if (!(f > largest)) continue;
      largest = f;
      when    = t;
    }
  }
  if (seen < 0.5 * largest)
    log_warn("%s line %d: the %s reaches %.6g at t = %.6g of the step, between two increments; the largest "
             "sampled value is %.6g: use smaller increments",
             deck_line.file.c_str(), deck_line.line, what, largest, when, seen);
}

}  // namespace

// ---------------------------------------------------------------------------
// step_warn_missed : warns of peaks of loads and supports between fixed increments; samples each increment
// eight times
// ---------------------------------------------------------------------------
void step_warn_missed(const Model& m, const Step& s, double start, bool mid)
{
  if (!s.direct) return;
  for (const Load& l : s.load)
    if (l.ramp != RAMP_OUT && !not_here(m, l) && (!l.value.is_const() || l.amplitude >= 0))
      warn_one(s, mid ? 0.5 : 1.0, l.deck_line, "load",
                  [&](double t) { return load_value(m, s, l, load_position(m, l), t, start + t); });
  for (const Prescribed& b : s.prescribed)
    if (!b.node.empty() && (!b.value.is_const() || b.amplitude >= 0))
      warn_one(s, 1.0, b.deck_line, b.velocity ? "prescribed velocity" : "prescribed displacement",
                  [&](double t) { return prescribed_value(m, b, &m.mesh.X[3 * b.node[0]], t, start + t); });
}
