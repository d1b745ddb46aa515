#include <cmath>
#include <cstdio>

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
      grid_node_place(m.grid, m.dim, p.grid.key[v], x);
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

}  // namespace

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
