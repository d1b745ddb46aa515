#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/log.h"
#include "step/step.h"

namespace {

bool all_finite(const RealVec& v)
{
  for (double x : v)
    if (!std::isfinite(x)) return false;
  return true;
}

// says which line of the deck gives the value; always false
bool complain(Problem& p, const Place& place, const char* what, const std::string& text, double time)
{
  char note[512];
  std::snprintf(note, sizeof note, "%.200s line %d: the %s%s%.100s%s is not a finite number at time %.8g: mind the roots, logarithms "
                "and divisions of the function and of its amplitude", place.file.c_str(), place.line, what, text.empty() ? "" : " \"",
                text.c_str(), text.empty() ? "" : "\"", time);
  p.note = note;
  return false;
}

bool loads_finite(Problem& p, const Step& s, double t_step, double t_total)
{
  Step one = s;
  RealVec f;
  for (const Load& l : s.load) {
    one.load.assign(1, l);
    assem_loads(p, one, t_step, t_total, 0.0, f);
    if (!all_finite(f)) return complain(p, l.place, "load", l.value.text, t_total);
  }
  return true;
}

bool supports_finite(Problem& p, const Step& s, double t_step, double t_total)
{
  const Model& m = p.m;
  for (const Prescribed& b : s.prescribed)
    for (int n : b.node)
      if (!std::isfinite(prescribed_value(m, s, b, &m.mesh.X[3 * n], t_step, t_total)))
        return complain(p, b.place, "prescribed displacement", b.value.text, t_total);
  double x[3];
  for (const GridBc& b : m.grid_bc)
    for (int v = 0; v < p.grid.nnode; ++v) {
      grid_unknown_place(m, p.st.points, p.st.n.uc, p.grid, v, x);
      if (std::fabs(x[b.axis] - b.position) > 1e-6 * m.grid.h[b.axis]) continue;
      if (!std::isfinite(support_value(m, b.value, b.amplitude, x, t_step, t_total)))
        return complain(p, b.place, "displacement of the grid", b.value.text, t_total);
    }
  for (int b = 0; b < p.st.bonds.nbond; ++b) {
    if (p.m.bond[p.st.bonds.def[b]].kind != BOND_GROUND) continue;
    bond_ground_motion(m, p.st.bonds, b, t_step, t_total, x);
    for (int i = 0; i < m.dim; ++i)
      if (!std::isfinite(x[i])) {
        const BondDef& d = m.bond[p.st.bonds.def[b]];
        return complain(p, d.place, "motion of the ground", d.motion[i].text, t_total);
      }
  }
  return true;
}

// a place where the load acts; of loads on bodies of points the origin
const double* place_of(const Model& m, const Load& l)
{
  static const double origin[3] = {0, 0, 0};
  if (l.surface >= 0 && m.surface[l.surface].body >= 0) return origin;
  const std::vector<Face>& face = l.surface >= 0 ? m.surface[l.surface].face : l.face;
  const int node = !l.node.empty() ? l.node[0] : !l.elem.empty() ? m.mesh.conn.begin(l.elem[0])[0]
                 : !face.empty() ? m.mesh.conn.begin(face[0].elem)[0] : -1;
  return node >= 0 ? &m.mesh.X[3 * node] : origin;
}

// warns when value(t) is at most half of its largest size wherever the fixed increments ask for it; ask: part of an increment
template <class Value>
void warn_missed(const Step& s, double ask, const Place& place, const char* what, Value value)
{
  const int PARTS = 8;
  const double n  = std::ceil(s.period / s.dt - 1e-9);
  if (n > 20000) return;
  double seen = 0.0, largest = 0.0, when = 0.0;
  for (int k = 0; k < static_cast<int>(n); ++k) {
    seen = std::max(seen, std::fabs(value(std::min(s.period, (k + ask) * s.dt))));
    for (int j = 0; j <= PARTS; ++j) {
      const double t = std::min(s.period, (k + static_cast<double>(j) / PARTS) * s.dt), f = std::fabs(value(t));
      if (!(f > largest)) continue;
      largest = f;
      when    = t;
    }
  }
  if (seen < 0.5 * largest)
    log_warn("%s line %d: the %s reaches %.6g at t = %.6g of the step, between two increments; where they ask for it it is never more "
             "than %.6g: take smaller increments", place.file.c_str(), place.line, what, largest, when, seen);
}

}  // namespace

// ---------------------------------------------------------------------------
// step_missed : warns of loads and supports that fixed increments step over; looks eight times into each increment
// ---------------------------------------------------------------------------
void step_missed(const Problem& p, const Step& s, bool mid)
{
  if (!s.direct) return;
  const Model& m     = p.m;
  const double start = p.st.clock.start;
  for (const Load& l : s.load)
    if (!l.value.is_const() || l.amplitude >= 0)
      warn_missed(s, mid ? 0.5 : 1.0, l.place, "load", [&](double t) { return load_value(m, s, l, place_of(m, l), t, start + t); });
  for (const Prescribed& b : s.prescribed)
    if (!b.node.empty() && (!b.value.is_const() || b.amplitude >= 0))
      warn_missed(s, 1.0, b.place, "prescribed displacement",
                  [&](double t) { return prescribed_value(m, s, b, &m.mesh.X[3 * b.node[0]], t, start + t); });
}

bool step_values_good(Problem& p, const Step& s, double t_step, double t_total)
{
  return loads_finite(p, s, t_step, t_total) && supports_finite(p, s, t_step, t_total);
}

// ---------------------------------------------------------------------------
// step_values : after a failed attempt: were all loads and supports finite?
//
//   status  BAD_VALUE: no; p.note names the line of the deck, the function and the time
// ---------------------------------------------------------------------------
Status step_values(Problem& p, const Attempt& a)
{
  p.st.np1 = p.st.n;           // followers act on places, and those of the failed attempt may be NaN
  for (double back : {a.dt, a.t1 - a.t_load, 1e-3 * a.dt, 0.0}) {
    if (a.mode.mid && back == a.dt) continue;        // energy-momentum never looks at t(n)
    if (!step_values_good(p, a.step, a.t1 - back, a.total1 - back)) return BAD_VALUE;
  }
  return STATUS_OK;
}
