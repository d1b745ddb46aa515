#include <algorithm>
#include <cmath>

#include "base/halo_numbers.h"
#include "step/step.h"

namespace {

// weights of the last increments for each order of the predictor    (6.44)
const float WEIGHT[][Motion::ORDERS] = {{0, 0, 0}, {1, 0, 0}, {2, -1, 0}, {3, -3, 1}};

// The predictor pays if its error is below this part of that of free flight. The first residual is that of
// the kept tangent while the first correction reduces it to LINEAR_GAIN, or to LINEAR_PART of the forces.
// Else they rest for WAIT increments: time only  (no test)
const double WORTH = 0.3, LINEAR_GAIN = 1e-3, LINEAR_PART = 1e-4;
const int WAIT = 20;
// Round-off of a product in single precision, relative to its terms; the part of the forces that it may be:
// time only  (no test)
const double SINGLE_ERROR = 1e-7, SINGLE_PART = 5e-5;

// acceleration of order k from x, the values of the last increments of one unknown
inline float expected(int k, const float* x)
{
  float sum = 0.0f;
  for (int j = 0; j < k; ++j) sum += WEIGHT[k][j] * x[j];
  return sum;
}

// where the values of the rows of the grid are stored; -1: not there                    [rows of the grid]
IntVec grid_rows(const Motion& h, const Dofs& s)
{
  IntVec at(s.rows.nrow - s.rows.nfe, -1);
  size_t k = 0;
  for (size_t r = 0; r < at.size(); ++r) {
    const long key = s.rows.row_key[s.rows.nfe + r];
    while (k < h.key.size() && h.key[k] > key) ++k;
    if (k < h.key.size() && h.key[k] == key) at[r] = static_cast<int>(k);
  }
  return at;
}

// calls use(dof, values of the last increments) for each free dof; values: zeros where there are none
template <class Use>
void each_free(const Motion& h, const Dofs& s, Use use)
{
  const int dim   = s.rows.dim;
  const IntVec at = grid_rows(h, s);
  for (int r = 0; r < s.rows.nrow; ++r) {
    const bool node = r < s.rows.nfe;
    const int k     = node ? s.rows.node_of_row[r] : at[r - s.rows.nfe];
    for (int i = 0; i < dim; ++i) {
      if (s.bound.fixed[r * dim + i]) continue;
      float x[Motion::ORDERS] = {};
      for (int j = 0; j < h.known && k >= 0; ++j) x[j] = (node ? h.node : h.grid)[j][k * dim + i];
      use(r * dim + i, x);
    }
  }
}

// are the stored values those of the increments before this one, of the same length?
bool follows(const Problem& p, const Attempt& a)
{
  const Motion& h = p.newton.motion;
  return h.step == p.st.log.step && h.increment == p.st.log.inc_total &&
         std::fabs(h.dt - a.dt) <= 1e-9 * a.dt;
}

bool predicts(const Problem& p, const Attempt& a)
{
  return a.cM != 0.0 && p.m.solver.reuse && p.dofs.rows.neq_all() >= SMALL_SYSTEM;
}

// the accelerations of this increment come first, those of earlier ones after them; grid rows of other keys
// have no earlier ones
//   in   node, of_grid   of this increment; used up
void push_accelerations(const Dofs& s, std::vector<float>& node, std::vector<float>& of_grid, Motion& h)
{
  const int dim = s.rows.dim, grid = s.rows.nrow - s.rows.nfe;
  std::vector<float> earlier[Motion::ORDERS];
  const IntVec at = grid > 0 ? grid_rows(h, s) : IntVec();
  for (int j = Motion::ORDERS - 1; j > 0; --j) {
    h.node[j].swap(h.node[j - 1]);
    if (grid == 0) continue;
    earlier[j].assign(of_grid.size(), 0.0f);
    for (int r = 0; r < grid && j <= h.known; ++r)
      for (int i = 0; i < dim && at[r] >= 0; ++i) earlier[j][r * dim + i] = h.grid[j - 1][at[r] * dim + i];
  }
  h.node[0].swap(node);
  for (int j = 1; j < Motion::ORDERS; ++j) h.grid[j].swap(earlier[j]);
  h.grid[0].swap(of_grid);
  h.key.assign(s.rows.row_key.begin() + s.rows.nfe, s.rows.row_key.end());
}

}  // namespace

// ---------------------------------------------------------------------------
// step_predict : du = dt v + dt^2/2 a, a extrapolated from the last increments            (6.44)
// ---------------------------------------------------------------------------
void step_predict(Problem& p, Attempt& a)
{
  const Dofs& s = p.dofs;
  Motion& h     = p.newton.motion;
  a.start.predicted   = 0.0;
  if (!predicts(p, a) || !dof_all(s, follows(p, a))) {
    h.known = h.order = 0;
    return;
  }
  if (h.order == 0 || h.known == 0) return;
  const double half = 0.5 * a.dt * a.dt;
  const int order   = h.order;
  double energy = 0.0;
  each_free(h, s, [&](int i, const float* x) {
    const double du = half * static_cast<double>(expected(order, x));
    a.du[i] += du;
    if (s.rows.counts(i)) energy += s.mass.M_diag[i / s.rows.dim] * du * du;
  });
  // a row that is new on a rank has no earlier values there: all take those of its owner
  if (s.rows.split) halo_numbers(s.rows.halo, s.rows.dim, a.du);
  a.start.predicted = a.cM * dof_total(s, energy);
}

// ---------------------------------------------------------------------------
// step_keep_motion : stores the accelerations, and chooses the order that would have been the best
// ---------------------------------------------------------------------------
void step_keep_motion(Problem& p, Attempt& a)
{
  const Dofs& s = p.dofs;
  Motion& h     = p.newton.motion;
  if (!predicts(p, a)) return;
  if (!dof_all(s, follows(p, a))) h.known = 0;
  h.step      = p.st.log.step;
  h.increment = p.st.log.inc_total + 1;
  h.dt        = a.dt;
  h.pattern   = s.pattern.number;
  h.made      = p.d.grid.made;
  if (!s.rows.split) {         // (6.45)
    h.du.swap(a.du);
    h.fint.swap(a.fint);
  }
  const RealVec& du = s.rows.split ? a.du : h.du;
  if (h.wait > 0) {
    --h.wait;
    h.known = h.order = 0;
    return;
  }
  const int dim = s.rows.dim, grid = s.rows.nrow - s.rows.nfe;
  std::vector<float> node(p.st.n.u.size(), 0.0f), of_grid(static_cast<size_t>(grid) * dim, 0.0f);
  double error[Motion::ORDERS + 1] = {};
  const double factor = 2.0 / (a.dt * a.dt);
  const int known     = h.known;
  each_free(h, s, [&](int i, const float* x) {
    const int r     = i / dim;
    const float now = static_cast<float>(factor * (du[i] - a.dt * a.vgrid[i]));
    if (r < s.rows.nfe) node[s.rows.node_of_row[r] * dim + i % dim] = now;
    else of_grid[i - s.rows.nfe * dim] = now;
    if (!s.rows.counts(i)) return;
    const double m = s.mass.M_diag[r];
    for (int k = 0; k <= known; ++k) {
      const double e = static_cast<double>(now - expected(k, x));
      error[k] += m * e * e;
    }
  });
  dof_total(s, error, known + 1);
  h.order = known < Motion::ORDERS ? 0 : static_cast<int>(std::min_element(error, error + known + 1) - error);
  if (known == Motion::ORDERS && error[h.order] > WORTH * WORTH * error[0]) {
    h.wait  = WAIT;
    h.known = h.order = 0;
    return;
  }
  push_accelerations(s, node, of_grid, h);
  h.known = std::min(known + 1, Motion::ORDERS);
}

// ---------------------------------------------------------------------------
// step_linear_force : fint = fint of the last increment + K (s_old du_last + s_new du)   (6.45)
// ---------------------------------------------------------------------------
bool step_linear_force(Problem& p, Attempt& a)
{
  const Dofs& s = p.dofs;
  Motion& h     = p.newton.motion;
  const ReusedTangent& z = p.newton.tangent;
  const Bonds& bonds     = p.st.bonds;
  if (a.start.left || !predicts(p, a) || s.rows.split || s.bound.tie.any) return false;
  if (step_damps(p) || !p.d.pairs.gap.empty()) return false;
  if (!follows(p, a) || h.pattern != s.pattern.number || h.made != p.d.grid.made) return false;
  if (!z.keeps || z.wait > 0 || z.broken != p.st.frac.neroded || z.made != p.d.grid.made ||
      !step_same_system(z, s, a))
    return false;
  if (std::any_of(bonds.side.begin(), bonds.side.end(), [](int side) { return side == SIDE_CONTACT; }))
    return false;
  if (h.linear_wait > 0) {
    --h.linear_wait;
    return false;
  }
  const size_t n = s.rows.neq();
  RealVec y, My;
  const Borrowed borrowed(p.newton.spare, {&y, &My});
  y.resize(n);
  const double s_old = a.mode.s_old, s_new = a.mode.s_new;
  for (size_t i = 0; i < n; ++i) y[i] = s_old * h.du[i] + s_new * a.du[i];
  for (int i : s.bound.constrained)
    if (y[i] != 0.0) return false;               // columns of supports are not in A
  mass_part(s, y, My);
  if (SINGLE_ERROR * a.cM * norm(My) > SINGLE_PART * p.st.log.scale) return false;
  if (!solve_multiply(p.newton.solver, s.pattern.A, s.pattern.tangent, y, a.fint)) return false;
  double* f          = a.fint.data();
  const double *last = h.fint.data(), *inertia = My.data(), factor = 1.0 / s_new, cM = a.cM;
  for (size_t i = 0; i < n; ++i) f[i] = last[i] + factor * (f[i] - cM * inertia[i]);
  return true;
}

void step_judge_linear(Problem& p, double gain, double part)
{
  if (gain > LINEAR_GAIN && part > LINEAR_PART) p.newton.motion.linear_wait = WAIT;
}
