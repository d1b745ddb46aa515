#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "base/log.h"
#include "dof/dof.h"

namespace {

void fix(Dofs& s, int dof, double increment, double rate, int grid_bc)
{
  s.bound.fixed[dof]   = DOF_FIXED;
  s.bound.target[dof]  = increment;
  s.bound.rate[dof]    = rate;
  s.bound.grid_bc[dof] = grid_bc;
  s.bound.constrained.push_back(dof);
}

// dependent dofs; nodes without elements are fixed, unless an equation includes them
void constrain_ties(const RealVec& u, Dofs& s)
{
  Ties& t       = s.bound.tie;
  const int dim = s.rows.dim;
  const auto of = [&](int dof) { return u[s.rows.node_of_row[dof / dim] * dim + dof % dim]; };
  for (size_t k = 0; k < t.dof.size(); ++k) {
    s.bound.fixed[t.dof[k]] = DOF_TIED;
    s.bound.constrained.push_back(t.dof[k]);
    t.gap[k] = -of(t.dof[k]);
    for (int q = t.master.off[k]; q < t.master.off[k + 1]; ++q) t.gap[k] += t.coef[q] * of(t.master.item[q]);
  }
  std::vector<char> acts(s.rows.nfe * dim, 0);
  for (int m : t.master.item) acts[m] = 1;
  for (int r = 0; r < s.rows.nfe; ++r)
    for (int dof = r * dim; dof < (r + 1) * dim && s.bound.bare[r]; ++dof)
      if (s.bound.fixed[dof] == DOF_FREE && !acts[dof]) fix(s, dof, 0.0, 0.0, -1);
}

// A support transferred to the corner of a point
struct SupportedCorner {
  const Prescribed* b;
  int node, corner, dir;
  double increment, rate, rate0;
};

// calls use(dof, weight) for the dofs of the grid that a corner follows
template <class Use>
void each_dof(const ActiveGrid& grid, const Dofs& s, const SupportedCorner& h, Use use)
{
  const ListTable& list = grid.corner;
  for (int k = list.off[h.corner]; k < list.off[h.corner + 1]; ++k) {
    const double N = grid.corner_w[k];
    if (std::fabs(N) > 1e-9) use((s.rows.nfe + list.item[k]) * s.rows.dim + h.dir, N);
  }
}

// Contribution of such a corner to a dof of the grid
struct SupportPart {
  long key;                    // row_key of the row
  int node, dir;               // number of the node in the mesh of the deck
  double N, increment, rate, rate0;
};

// contributions of all corners; divided model: each from the owner of its corner
std::vector<SupportPart> support_parts(const Model& m, const Points& pts, const Discretisation& d,
                                       const std::vector<SupportedCorner>& corners, const Dofs& s)
{
  std::vector<SupportPart> part;
  for (const SupportedCorner& h : corners) {
    if (pts.field[h.corner] == FIELD_OWN || (d.owned.on && d.owned.owner[h.corner] != comm_rank())) continue;
    each_dof(d.grid, s, h, [&](int dof, double N) {
      part.push_back({s.rows.row_key[dof / s.rows.dim], m.part.node_number(h.node), h.dir, N, h.increment,
          h.rate,
                      h.rate0});
    });
  }
  if (d.owned.on) comm_allgatherv(part);
  return part;
}

// rows of this rank with the keys of parts: key and row, ascending
std::vector<std::pair<long, int>> rows_of_parts(const Dofs& s, const std::vector<SupportPart>& part)
{
  std::vector<long> key;
  for (const SupportPart& h : part) key.push_back(h.key);
  std::sort(key.begin(), key.end());
  std::vector<std::pair<long, int>> row;
  for (int r = 0; r < s.rows.nrow; ++r)
    if (std::binary_search(key.begin(), key.end(), s.rows.row_key[r])) row.emplace_back(s.rows.row_key[r], r);
  std::sort(row.begin(), row.end());
  return row;
}

// Prescribes the grid nodes that the corners follow; a node of several corners gets their mean, weighted by
// |N_v|  (7.18)
void support_corners(const Model& m, const Points& pts, const Discretisation& d,
                     const std::vector<SupportedCorner>& corners, double time, Dofs& s, Warned& warned)
{
  struct Sum { double weight = 0.0, increment = 0.0, rate = 0.0, rate0 = 0.0; };
  std::map<int, Sum> sum;
  const auto elsewhere = [&](int c) { return d.owned.on && d.owned.owner[c] != comm_rank(); };
  for (const SupportedCorner& h : corners)
    if (pts.field[h.corner] == FIELD_OWN && !elsewhere(h.corner))
      warn_once(warned, m.mesh, "BOUNDARY", h.b->deck_line, h.node, time,
                "its material point was released from its neighbours; the support has ended there");
  const bool any = !corners.empty();
  if (d.owned.on ? comm_allreduce_max(static_cast<int>(any)) == 0 : !any) return;
  const std::vector<SupportPart> part          = support_parts(m, pts, d, corners, s);
  const std::vector<std::pair<long, int>> row = rows_of_parts(s, part);
  for (const SupportPart& h : part) {
    const auto here = std::lower_bound(row.begin(), row.end(), std::pair<long, int>(h.key, 0));
    const int node  = m.part.on ? m.part.node_here(h.node) : h.node;
    const int dof   = here == row.end() || here->first != h.key ? -1 : here->second * s.rows.dim + h.dir;
    const double w  = std::fabs(h.N);
    s.bound.corner_support.push_back({dof, node < 0 ? -1 : node * s.rows.dim + h.dir, w});
    if (dof < 0) continue;
    Sum& x = sum[dof];
    x.weight += w;
    x.increment += w * h.increment;
    x.rate += w * h.rate;
    x.rate0 += w * h.rate0;
  }
  for (const auto& x : sum) {
    const Sum& q = x.second;
    fix(s, x.first, q.increment / q.weight, q.rate / q.weight, -1);
    s.bound.rate0[x.first] = q.rate0 / q.weight;
  }
  for (CornerSupport& h : s.bound.corner_support)
    if (h.dof >= 0) h.part /= sum[h.dof].weight;
  for (const SupportedCorner& h : corners) {
    if (pts.field[h.corner] == FIELD_OWN || elsewhere(h.corner)) continue;
    double moved = 0.0;
    each_dof(d.grid, s, h, [&](int dof, double N) { moved += N * s.bound.target[dof]; });
    if (std::fabs(moved - h.increment) > 0.01 * s.rows.h_mean)
      warn_once(
          warned, m.mesh, "BOUNDARY", h.b->deck_line, h.node, time,
          "supports with different values meet at a node of the grid; the corners there move by a mean");
  }
}

Failure bad_node(const Model& m, const Prescribed& b, int n, double time)
{
  const std::string node = "node " + std::to_string(m.mesh.node_label[n]);
  return {BAD_VALUE,
          value_text(m, "BOUNDARY", b.deck_line, b.value, b.amplitude, node, &m.mesh.X[3 * n], time)};
}

Failure bad_grid_node(const Model& m, const GridBc& b, const double* x, double time)
{
  return {BAD_VALUE,
          value_text(m, "GRID BOUNDARY", b.deck_line, b.value, b.amplitude, "the grid node", x, time)};
}

}  // namespace

void warn_once(Warned& warned, const Mesh& mesh, const char* keyword, const DeckLine& deck_line, int node,
               double time, const char* what)
{
  if (!warned.insert(deck_line.file + std::to_string(deck_line.line) + what).second) return;
  log_warn("%s line %d, *%s: node %d, time %.8g: %s", deck_line.file.c_str(), deck_line.line, keyword,
           mesh.node_label[node], time, what);
}

namespace {

void release(Dofs& s, int dof)
{
  s.bound.fixed[dof]   = DOF_FREE;
  s.bound.target[dof]  = 0.0;
  s.bound.rate[dof]    = 0.0;
  s.bound.rate0[dof]   = 0.0;
  s.bound.grid_bc[dof] = -1;
}

// all dofs are free
void release_all(Dofs& s)
{
  if (s.rows.renumbered || s.bound.fixed.size() != static_cast<size_t>(s.rows.neq())) {
    s.bound.fixed.assign(s.rows.neq(), DOF_FREE);
    s.bound.target.assign(s.rows.neq(), 0.0);
    s.bound.rate.assign(s.rows.neq(), 0.0);
    s.bound.rate0.assign(s.rows.neq(), 0.0);
    s.bound.grid_bc.assign(s.rows.neq(), -1);
  } else {
    for (int dof : s.bound.constrained) release(s, dof);
  }
  s.bound.constrained.clear();
  s.rows.renumbered = false;
}

// The increment in which dofs are prescribed
struct Span {
  double t_step0, t_step1, total0;
  bool moves;                  // velocities are needed
  double dt() const { return t_step1 - t_step0; }
  double back() const { return 1e-3 * dt(); }        // time step of finite differences for rates
  double total1() const { return total0 + dt(); }
};

// *BOUNDARY on this rank; corners: supports transferred to corners
Failure constrain_nodes(const Model& m, const Discretisation& d, const State& st, const Step& step,
                        const Span& t, Dofs& s, std::vector<SupportedCorner>& corners, Warned& warned)
{
  const int dim = m.dim;
  const double t_step0 = t.t_step0, t_step1 = t.t_step1, total0 = t.total0, total1 = t.total1();
  const double dt = t.dt(), back = t.back();
  const bool moves = t.moves;
  // a ramp is linear from the position of the node to the value at the end of the step               (6.16)
  const double part0 = std::min(1.0, t_step0 / step.period), part1 = std::min(1.0, t_step1 / step.period);
  const double ramped = part1 < 1.0 ? (part1 - part0) / (1.0 - part0) : 1.0;
  for (const Prescribed& b : step.prescribed)
    for (int n : b.node) {
      const int r = s.rows.row_of_node[n], c = d.follow.empty() ? FOLLOW_ELEMENT : d.follow[n];
      if (c == FOLLOW_NONE)
        warn_once(warned, m.mesh, "BOUNDARY", b.deck_line, n, total1,
                  "its last element is gone and no corner of a point lies there; the support has ended");
      if (r < 0 && c < 0) continue;
      const double* X    = &m.mesh.X[3 * n];
      const double value = prescribed_value(m, b, X, t_step1, total1);
      const double way   = b.velocity ? prescribed_travel(m, b, X, t_step0, t_step1, total0) : 0.0;
      if (!std::isfinite(value) || !std::isfinite(way)) return bad_node(m, b, n, total1);
      double rate = b.velocity ? value : 0.0;
      if (moves && dt > 0.0 && !b.velocity) {
        rate = (value - prescribed_value(m, b, &m.mesh.X[3 * n], t_step1 - back, total1 - back)) / back;
        if (!std::isfinite(rate)) return bad_node(m, b, n, total1 - back);
      }
      if (r < 0) {
        double rate0 = b.velocity ? prescribed_value(m, b, X, t_step0, total0) : 0.0;
        if (moves && dt > 0.0 && !b.velocity) {
          const double v0 = prescribed_value(m, b, &m.mesh.X[3 * n], t_step0, total0);
          rate0 = (prescribed_value(m, b, &m.mesh.X[3 * n], t_step0 + back, total0 + back) - v0) / back;
          if (!std::isfinite(rate0)) return bad_node(m, b, n, total0);
        }
        for (int i = b.first; i <= b.last && i < dim; ++i) {
          const double increment = b.velocity ? way : value - st.n.uc[c * dim + i];
          corners.push_back({&b, n, c, i, b.ramp ? ramped * increment : increment, rate, rate0});
        }
        continue;
      }
      for (int i = b.first; i <= b.last && i < dim; ++i) {
        const double increment = b.velocity ? way : value - st.n.u[n * dim + i];
        fix(s, r * dim + i, b.ramp ? ramped * increment : increment, rate, -1);
      }
    }
  return STATUS_OK;
}

// *GRID BOUNDARY on this rank
Failure constrain_grid(const Model& m, const Discretisation& d, const State& st, const Span& t, Dofs& s)
{
  const double t_step0 = t.t_step0, total0 = t.total0, total1 = t.total1(), dt = t.dt(), back = t.back();
  const bool moves = t.moves;
  for (size_t k = 0; k < m.grid_bc.size(); ++k) {
    const GridBc& b = m.grid_bc[k];
    for (int v = 0; v < d.grid.nnode; ++v) {
      double x[3];
      grid_unknown_position(m, st.points, st.n.uc, d.grid, v, x);
      if (std::fabs(x[b.axis] - b.position) > 1e-6 * m.grid.h[b.axis]) continue;
      auto at = [&](double later) {
        return support_value(m, b.value, b.amplitude, x, t_step0 + later, total0 + later);
      };
      const double begin = at(0.0), end = at(dt);
      if (!std::isfinite(begin)) return bad_grid_node(m, b, x, total0);
      if (!std::isfinite(end)) return bad_grid_node(m, b, x, total1);
      const double moved = end - begin;
      const double rate  = moves && dt > 0.0 ? (end - at(dt - back)) / back : 0.0;
      const double rate0 = moves && dt > 0.0 ? (at(back) - begin) / back : 0.0;
      if (!std::isfinite(rate)) return bad_grid_node(m, b, x, total1 - back);
      if (!std::isfinite(rate0)) return bad_grid_node(m, b, x, total0 + back);
      for (int i = b.first; i <= b.last && i < m.dim; ++i) {
        const int dof = (s.rows.nfe + v) * m.dim + i;
        fix(s, dof, moved, rate, static_cast<int>(k));
        s.bound.rate0[dof] = rate0;
      }
    }
  }
  return STATUS_OK;
}

// shares a failure with all ranks if a value can be not finite on a single rank
template <class Values>
Failure agreed(const Model& m, const Values& values, const Failure& failure)
{
  const bool varies = std::any_of(values.begin(), values.end(),
                                  [](const auto& b) { return !b.value.is_const() || b.amplitude >= 0; });
  return m.part.on && varies ? failure_agree(failure) : failure;
}

}  // namespace

Failure dof_constrain(const Model& m, const Discretisation& d, const State& st, const Step& step,
                      double t_step0, double t_step1, Dofs& s, Warned& warned)
{
  const Span t{t_step0, t_step1, st.n.time, step.proc == PROC_DYNAMIC};
  s.bound.free = step.prescribed.empty() && m.grid_bc.empty() && m.equation.empty() && !m.part.tied;
  release_all(s);
  s.bound.corner_support.clear();
  std::vector<SupportedCorner> corners;
  Failure failure = agreed(m, step.prescribed, constrain_nodes(m, d, st, step, t, s, corners, warned));
  if (!failure.ok()) return failure;
  if (!m.conversion.empty() && !step.prescribed.empty() && st.points.npoint_all() > 0)
    support_corners(m, st.points, d, corners, t.total1(), s, warned);
  failure = agreed(m, m.grid_bc, constrain_grid(m, d, st, t, s));
  if (failure.ok() && !m.equation.empty()) constrain_ties(st.n.u, s);
  return failure;
}
