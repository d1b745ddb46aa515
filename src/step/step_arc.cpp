// ---------------------------------------------------------------------------
// step_arc.cpp : *STATIC, RIKS: load control by crack opening                           doc/theory.md (6.39)
//
// After the peak load of a cohesive crack neither load nor displacement need increase. The extension of the
// opening elements does. Its sum is prescribed, and the load time, from 0 to the period, is an unknown.
// ---------------------------------------------------------------------------
#include <algorithm>
#include <cmath>

#include "mat/law.h"
#include "step/step.h"

namespace {

// Elements whose utilisation differs from the largest by less than this, relative to it, open together
// (test: strength/snap_back)
const double SHARE_TOL = 1e-6;
// Opening of an element in an increment of dt of the deck, relative to the full opening  (test: C2)
const double OPENING_STEP = 0.2;
// Excess of an uncracked element over its extension at the strength, relative to it: with more, elements
// beside it would open as well  (test: C2)
const double STRENGTH_EXCESS = 0.002;
// The step ends at this load, relative to the largest  (no test)
const double END_LOAD = 0.02;
// Tolerance of the displacement of the set at the end, relative to it: error of Newton's method  (no test)
const double SET_TOL = 1e-6;

double along(const double* N, const double* x, int dim)
{
  double sum = 0.0;
  for (int i = 0; i < dim; ++i) sum += N[i] * x[i];
  return sum;
}

// the largest utilisation of the integration points; q: data of that point
double largest_share(const Problem& p, const ElemBlock& b, int e, ArcElement& q)
{
  const Elements& el = p.d.el;
  const MatLaw law   = elem_law(p.m, el, b, el.slot_of[e], 1.0);
  const bool nlgeom  = p.m.step[p.st.log.step - 1].nlgeom;
  double largest = 0.0, N[3], k;
  IpFields at;
  for (int g = 0; g < shape_info[b.shape].ngp; ++g) {
    elem_ip_fields(p.m, el, p.st.n, nlgeom, e, g, at);
    const double* h = history_at(p.st.n.he, el.history, el.gauss_of[e] + g);
    const double share = crack_share(law, at.sig, h, N, &k);
    if (share <= largest) continue;
    largest = share;
    q.e  = e;
    std::copy_n(N, 3, q.N.begin());
    q.width = crack_width(law.crack, N);
    const double strain = crack_strength(law.crack) / b.law.material->young;
    q.cracked = k > 0.0;
    q.max_extension    = q.cracked ? OPENING_STEP * crack_open(law.crack)
                          : (std::max(0.0, 1.0 - share) + STRENGTH_EXCESS) * strain * q.width;
  }
  return largest;
}

// elements that open first, or are opening, at t(n)
void find_openings(const Problem& p, Arc& arc)
{
  const Elements& el = p.d.el;
  std::vector<std::pair<double, ArcElement>> all;
  double largest = 0.0;
  for (const ElemBlock& b : el.block) {
    if (!b.opens()) continue;
    for (int e : b.elem) {
      if (el.broken(e) >= 0 || el.block_of[e] < 0) continue;
      ArcElement q;
      const double share = largest_share(p, b, e, q);
      if (share <= 0.0) continue;
      all.push_back({share, q});
      largest = std::max(largest, share);
    }
  }
  largest = dof_largest(p.dofs, largest);
  arc.any = largest > 0.0;
  for (const auto& [share, q] : all)
    if (share >= (1.0 - SHARE_TOL) * largest) arc.element.push_back(q);
  const auto cracked = [](const ArcElement& q) { return q.cracked; };
  arc.cracked = !dof_all(p.dofs, std::none_of(arc.element.begin(), arc.element.end(), cracked));
}

// extension of an element along N, by a least-squares fit of its nodal displacements x
double extension(const Problem& p, const ArcElement& q, const RealVec& x)
{
  const Mesh& mesh = p.m.mesh;
  const int dim = p.m.dim, nen = mesh.conn.count(q.e), *node = mesh.conn.begin(q.e);
  double mean = 0.0, square = 0.0, product = 0.0;
  for (int a = 0; a < nen; ++a) mean += along(q.N.data(), &mesh.X[3 * node[a]], dim) / nen;
  for (int a = 0; a < nen; ++a) {
    const double arm = along(q.N.data(), &mesh.X[3 * node[a]], dim) - mean;
    const int r      = p.dofs.rows.row_of_node[node[a]];
    square += arm * arm;
    if (r >= 0) product += arm * along(q.N.data(), &x[r * dim], dim);
  }
  return q.width * product / square;
}

// mean over the nodes n of the set, rows r, of value(n, r)
template <class Value>
double mean_of_set(const Problem& p, const Step& s, Value value)
{
  double sum[2] = {};
  for (int n : p.m.nset[s.arc.nset].item) {
    const int r = p.dofs.rows.row_of_node[n];
    if (r < 0 || !p.dofs.rows.counts(r * p.m.dim)) continue;
    sum[0] += value(n, r);
    sum[1] += 1.0;
  }
  dof_total(p.dofs, sum, 2);
  return sum[1] > 0.0 ? sum[0] / sum[1] : 0.0;
}

// mean displacement of the set in its direction; mean of a correction x
double set_displacement(const Problem& p, const Step& s, const Level& l)
{
  return mean_of_set(p, s, [&](int n, int) { return l.u[n * p.m.dim + s.arc.direction]; });
}
double set_correction(const Problem& p, const Step& s, const RealVec& x)
{
  return mean_of_set(p, s, [&](int, int r) { return x[r * p.m.dim + s.arc.direction]; });
}

double extensions(const Problem& p, const Arc& arc, const RealVec& x)
{
  double sum = 0.0;
  for (const ArcElement& q : arc.element) sum += extension(p, q, x);
  return dof_total(p.dofs, sum);
}

// advance of the load time in the first correction: the largest opening is a part of the full opening, and
// the loads change by dt at most. Forwards: cracks open further, or without a crack the loads increase
double first_advance(const Problem& p, const Attempt& a, const RealVec& unit)
{
  const Arc& arc    = a.arc;
  const double left = a.step.period - arc.from;
  if (!arc.any) return std::min(a.dt, left);
  const double sum = extensions(p, arc, unit), part = std::min(1.0, a.dt / a.step.dt);
  double largest = 0.0;                                 // relative to the largest allowed, per load time
  for (const ArcElement& q : arc.element)
    largest = std::max(largest, std::fabs(extension(p, q, unit)) / q.max_extension);
  largest = dof_largest(p.dofs, largest);
  const double by = std::min(a.dt, largest > 0.0 ? part / largest : a.dt);
  return sum < 0.0 && arc.cracked ? -by : std::min(by, left);
}

// the prescribed quantity of a correction
double prescribed_part(const Problem& p, const Attempt& a, const RealVec& x)
{
  return a.arc.last ? set_correction(p, a.step, x) : extensions(p, a.arc, x);
}

// does the first correction reach the displacement of the set? the increment ends there
bool ends_at_set(const Problem& p, Attempt& a, double advance, const RealVec& unit)
{
  const Step& s = a.step;
  if (s.arc.nset < 0) return false;
  const double left = s.arc.end - set_displacement(p, s, p.st.n);
  const double by   = advance * set_correction(p, s, unit);
  if (by * s.arc.end <= 0.0 || std::fabs(by) < std::fabs(left)) return false;
  a.arc.length = left;
  return true;
}

}  // namespace

Failure step_arc_begin(Problem& p, Attempt& a)
{
  Arc& arc = a.arc;
  arc      = Arc();
  arc.on   = true;
  arc.from = arc.at = a.t0;
  arc.support = p.dofs.bound.target;
  for (double& x : arc.support) x /= a.dt;
  RealVec none;
  Failure failure = assem_loads(p.m, p.d, p.dofs, p.st, a.step, {0.0, a.total0, 1.0}, p.warned, none);
  if (failure.ok())
    failure = assem_loads(p.m, p.d, p.dofs, p.st, a.step, {a.step.period, a.total0, 1.0}, p.warned, arc.load);
  if (!failure.ok()) return failure;
  for (size_t i = 0; i < arc.load.size(); ++i) arc.load[i] = (arc.load[i] - none[i]) / a.step.period;
  a.fext = a.fext0;
  std::fill(p.dofs.bound.target.begin(), p.dofs.bound.target.end(), 0.0);
  find_openings(p, arc);
  return STATUS_OK;
}

void step_arc_force(const Dofs& s, const Arc& arc, RealVec& g)
{
  RealVec Ax;
  sys_multiply(s.pattern.A, arc.support, Ax);
  if (s.rows.split) sys_sum(s.pattern.A, Ax);
  g = arc.load;
  tie_force(s, g);
  for (int i = 0; i < s.rows.neq(); ++i) g[i] = s.bound.fixed[i] ? 0.0 : g[i] - Ax[i];
}

double step_arc_advance(const Problem& p, Attempt& a, int it, const RealVec& dx, const RealVec& unit)
{
  Arc& arc = a.arc;
  if (it == 1) {
    const double advance = first_advance(p, a, unit), sum = arc.any ? extensions(p, arc, unit) : 0.0;
    arc.length = advance * sum;
    if (!(arc.length > 0.0) || arc.from + advance == a.step.period) arc.element.clear();
    arc.any  = !dof_all(p.dofs, arc.element.empty());
    arc.last = ends_at_set(p, a, advance, unit);
    if (!arc.last) return advance;
  }
  if (!arc.any && !arc.last) return 0.0;
  const double per = prescribed_part(p, a, unit);
  return per == 0.0 ? 0.0 : (arc.length - prescribed_part(p, a, a.du) - prescribed_part(p, a, dx)) / per;
}

void step_arc_load(Problem& p, Attempt& a, double advance)
{
  a.arc.at += advance;
  const double by = a.arc.at - a.arc.from;
  for (int i = 0; i < p.dofs.rows.neq(); ++i) {
    a.fext[i] = a.fext0[i] + by * a.arc.load[i];
    p.dofs.bound.target[i] = by * a.arc.support[i];
  }
}

void step_arc_end(Problem& p, const Attempt& a)
{
  StepClock& c  = p.st.clock;
  const Step& s = a.step;
  c.load      = a.arc.at;
  c.load_most = std::max(c.load_most, c.load);
  const double u = s.arc.nset >= 0 ? set_displacement(p, s, p.st.np1) : 0.0;
  const bool far = s.arc.nset >= 0 && u * s.arc.end >= (1.0 - SET_TOL) * s.arc.end * s.arc.end;
  const bool whole = s.over(c.load), fallen = c.load <= END_LOAD * c.load_most;
  const bool many  = p.st.log.inc >= s.max_inc;
  c.ended = far || whole || fallen || many;
  if (fallen)
    log_note("  the step ends: the loads have fallen to %.3g of their full value, from %.3g at the peak",
             c.load / s.period, c.load_most / s.period);
  else if (far && !whole) log_note("  the step ends: the set has moved by %.6g", u);
  else if (many && !whole) log_note("  the step ends: INC=%d increments, with %.3g of the loads", s.max_inc,
                                   c.load / s.period);
}
