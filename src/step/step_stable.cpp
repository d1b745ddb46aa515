#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "base/comm.h"
#include "base/halo_numbers.h"
#include "base/log.h"
#include "bond/bond.h"
#include "elem/elem_share.h"
#include "step/step.h"

namespace {

// Increments after which the stable increment is computed again, since elements deform  (no test)
const int CHECK_EVERY = 20;
// Increments after which it is measured again when there are bonds, since the grid moves; with a grid that
// was reset meanwhile, CHECK_EVERY  (test: patch/explicit_bond_reset.inp)
const int MEASURE_EVERY = 200;
// Increments of a stage, in which the increment only decreases. An increment that follows the motion drives
// it: contact that opens and closes with an oscillation of four increments makes it grow by 1 % in each.
// The particles of the sphere then burst at 170 us  (test: decks/sphere.inp)
const int STAGE = 20;
// Lanczos' method: number of vectors. The largest frequency of a system is then accurate to 1 or 2 %
// (no test)
const int VECTORS = 24;
// Displacement to measure the stiffness, relative to the mean size of elements and cells  (no test)
const double PERTURBATION = 1e-7;

// to three digits, independent of the ranks and the order of sums
double rounded(double x)
{
  const double unit = std::pow(10.0, std::floor(std::log10(x)) - 2.0);
  return unit * std::floor(x / unit);
}

// events that raise frequencies at once: converted and released points
long changes(const State& st) { return st.frac.nconverted + st.frac.nreleased; }

// K x by a small motion from t(n); f0: internal force there
Failure stiffness_times(Problem& p, const KernelMode& mode, const RealVec& f0, const RealVec& x, RealVec& y)
{
  const Dofs& s = p.dofs;
  double largest = 0.0;
  for (double v : x) largest = std::max(largest, std::fabs(v));
  largest = dof_largest(s, largest);
  y.assign(s.rows.neq(), 0.0);
  if (largest == 0.0) return STATUS_OK;
  const double scale = PERTURBATION * s.rows.h_mean / largest;
  RealVec du(x);
  for (double& v : du) v *= scale;
  Jumps jumps;
  Failure failure = assem_move(p.m, p.d, s, du, 0.0, 0.0, p.st, jumps);
  if (failure.ok()) failure = assem_internal(p.m, p.d, s, mode, jumps, p.st, y);
  for (int i = 0; i < s.rows.neq(); ++i) y[i] = (y[i] - f0[i]) / scale;
  return failure;
}

// a start vector without symmetry, the same on all ranks
RealVec first_vector(const MeshPart& part, const Dofs& s)
{
  RealVec x(s.rows.neq());
  for (int i = 0; i < s.rows.neq(); ++i) {
    const int r    = i / s.rows.dim;
    const double k = r < s.rows.nfe ? part.deck_number(s.rows.node_of_row[r])
        : static_cast<double>(s.rows.row_key[r]);
    x[i] = s.bound.fixed[i] ? 0.0 : std::sin(12.9898 * (k + 1.0) + 78.233 * (i % s.rows.dim + 1.0));
  }
  return x;
}

// y = M^-1 f on free dofs
Failure mass_inverse(const Dofs& s, const RealVec& f, bool points, RealVec& y)
{
  y.assign(s.rows.neq(), 0.0);
  if (points || s.rows.hung) return mass_solve(s, ROWS_ALL, 0, f, y) < 0 ? MASS_FAILED : STATUS_OK;
  for (int i = 0; i < s.rows.neq(); ++i) y[i] = s.bound.fixed[i] ? 0.0 : f[i] / s.mass.lumped[i / s.rows.dim];
  return STATUS_OK;
}

// square of the largest frequency of M^-1 K by Lanczos' method; MASS_FAILED: by the vectors so far. The
// masses of debris may be singular to round-off; there a difference of forces is round-off too        (6.32)
Failure lanczos(Problem& p, const Step& s, double& omega2)
{
  const Dofs& d = p.dofs;
  const bool points = p.d.grid.of_all.nodes > 0;
  KernelMode mode;
  mode.finite = s.nlgeom;
  RealVec f0, q, before(d.rows.neq(), 0.0), f, w, Mq;
  Jumps jumps;
  p.st.np1 = p.st.n;
  Failure failure = dof_constrain(p.m, p.d, p.st, s, p.st.clock.t, p.st.clock.t, p.dofs, p.warned);
  if (failure.ok()) failure = assem_move(p.m, p.d, d, before, 0.0, 0.0, p.st, jumps);
  if (failure.ok()) failure = assem_internal(p.m, p.d, d, mode, jumps, p.st, f0);
  if (!failure.ok()) return failure;
  q = first_vector(p.m.part, d);
  Eigen::MatrixXd T = Eigen::MatrixXd::Zero(VECTORS, VECTORS);
  double beta = 0.0;
  omega2 = 0.0;
  for (int k = 0; k < VECTORS && failure.ok(); ++k) {
    mass_multiply(d, q, Mq);
    const double size = std::sqrt(dof_dot(d, q, Mq));
    if (k > 0) {
      beta = size;
      T(k, k - 1) = T(k - 1, k) = beta;
    }
    if (!(size > 0.0)) break;
    for (double& x : q) x /= size;
    failure = stiffness_times(p, mode, f0, q, f);
    for (int i = 0; i < d.rows.neq(); ++i) f[i] = d.bound.fixed[i] ? 0.0 : f[i];
    if (failure.ok()) failure = mass_inverse(d, f, points, w);
    if (!failure.ok()) return failure;
    T(k, k) = dof_dot(d, q, f);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(T.topLeftCorner(k + 1, k + 1));
    omega2 = std::max(omega2, eigen.eigenvalues()(k));
    for (int i = 0; i < d.rows.neq(); ++i) w[i] -= T(k, k) * q[i] + beta * before[i];
    before.swap(q);
    q.swap(w);
  }
  return failure;
}

// lanczos without contact, whose part is (6.32): faces that touch would count twice, and their default
// penalties would pass for a part of the system, to which penalties adapt
Failure measure(Problem& p, const Step& s, double& omega2)
{
  const IntVec& side = p.st.bonds.side;
  IntVec& acts       = p.dofs.rows.bond_acts;
  const IntVec all   = acts;
  acts.erase(std::remove_if(acts.begin(), acts.end(), [&](int k) { return side[k] == SIDE_CONTACT; }),
             acts.end());
  const Failure failure = lanczos(p, s, omega2);
  p.dofs.rows.bond_acts = all;
  return failure;
}

// the stiffness of contact point k at its gap, which increases with the depth                   (4.21)
double contact_slope(const Bonds& b, int k, double gap)
{
  const double beyond = b.beyond(k, gap);
  return std::max(b.cn[k], b.ct[k]) + 3.0 * b.growth(k) * beyond * beyond;
}

// calls use(item, weight) for the nodes n and the corners nnode + c of contact point k and its face
template <class Use>
void each_item(const Problem& p, int k, Use use)
{
  const Bonds& b           = p.st.bonds;
  const ContactPairs& pair = p.d.pairs;
  for (int j = b.a.off[k]; j < b.a.off[k + 1]; ++j) use(b.a.item[j], std::fabs(b.a_w[j]));
  for (int j = pair.master.off[k]; j < pair.master.off[k + 1]; ++j)
    use(pair.master.item[j], std::fabs(pair.master_w[j]));
}

// mass of nodes and corners under contact forces, summed over ranks; of a consistent mass its smallest
// eigenvalue counts                                                                            (6.34)
//   out  mass [nnode + ncorner]
void contact_masses(const Problem& p, RealVec& mass)
{
  const Dofs& s       = p.dofs;
  const Points& pts   = p.st.points;
  const CornerMass& m = s.mass.corner_mass;
  const int nnode     = p.m.mesh.nnode();
  RealVec corner(m.own), coupled(m.diag.size(), 0.0);
  for (size_t c = 0; c < m.diag.size(); ++c)
    for (int k = m.off[c]; k < m.off[c + 1]; ++k)
      if (m.val[k] != 0.0) coupled[c] = coupled[m.col[k]] = 1.0;
  corner.resize(pts.ncorner, 0.0);
  coupled.resize(pts.ncorner, 0.0);
  if (step_corners_shared(pts)) halo_sum(pts.part.halo, 1, {&corner, &coupled});
  mass.assign(nnode, 0.0);
  for (int n = 0; n < nnode; ++n)
    if (s.rows.row_of_node[n] >= 0) mass[n] = s.mass.lumped[s.rows.row_of_node[n]];
  if (comm_size() > 1) halo_numbers(p.m.part.halo, 1, mass);   // nodes of faces of other ranks have no rows
  for (size_t c = 0; c < corner.size(); ++c)
    mass.push_back(corner[c] * (coupled[c] > 0.0 ? 1.0 / (1 << s.rows.dim) : 1.0));
}

// sums the contact stiffness at nodes and corners over ranks
void sum_contact_stiffness(const Problem& p, RealVec& stiff)
{
  const int nnode = p.m.mesh.nnode();
  const Points& pts = p.st.points;
  if (comm_size() == 1) return;
  RealVec node(stiff.begin(), stiff.begin() + nnode), corner(stiff.begin() + nnode, stiff.end());
  halo_sum(p.m.part.halo, 1, node);
  if (step_corners_shared(pts)) halo_sum(pts.part.halo, 1, corner);
  std::copy(node.begin(), node.end(), stiff.begin());
  std::copy(corner.begin(), corner.end(), stiff.begin() + nnode);
}

// Row sums of the matrix of contact stiffness over mass, with the scales x of nodes and corners (empty: 1):
// whatever x > 0, the largest is an upper bound of the square of the contact frequency            (6.32)
//   in   slope  stiffness of acting contact points, 0: open
//   out  push [nnode + ncorner];  returns the largest. Collective.
double contact_rows(const Problem& p, const RealVec& slope, const RealVec& mass, const RealVec& x,
                    RealVec& push)
{
  const Dofs& s  = p.dofs;
  double largest = 0.0;
  push.assign(mass.size(), 0.0);
  for (size_t i = 0; i < slope.size(); ++i) {
    if (slope[i] == 0.0) continue;
    const int k = s.rows.bond_acts[i];
    double sum  = 0.0;
    each_item(p, k, [&](int item, double w) { sum += w * (x.empty() ? 1.0 : x[item]); });
    each_item(p, k, [&](int item, double w) { push[item] += slope[i] * sum * w; });
  }
  sum_contact_stiffness(p, push);
  for (size_t k = 0; k < push.size(); ++k) {
    const double m = mass[k] * (x.empty() ? 1.0 : x[k]);
    push[k] = m > 0.0 ? push[k] / m : 0.0;
    largest = std::max(largest, push[k]);
  }
  return comm_allreduce_max(largest);
}

// Max. square of the contact frequency with default penalties, relative to that of the elements; the
// increment decreases by sqrt(1 + CONTACT_PART)  (test: contact/g2_explicit.inp)
const double CONTACT_PART = 0.5;
// Contact points that are about to push: gap relative to the face, and increments until the gap is zero
// (test: contact/edge_explicit.inp)
const double CLOSE = 0.1, SOON = 10.0;
// Steps of the power method for the scales of nodes  (test: contact/edge_explicit.inp)
const int SCALINGS = 2;
// Where a penalty may be more than FEW_SHARE times what all points that are near would share, few push, as at
// an edge or a corner: the limit grows with this ratio, up to EDGE_MOST times
// (test: contact/edge_explicit.inp)
const double FEW_SHARE = 1.5, EDGE_GROWTH = 1.5, EDGE_MOST = 3.0;

// may the program choose the penalty of contact point k: a default penalty, and no energy stored?
bool is_adjustable(const Problem& p, int k)
{
  const Bonds& b     = p.st.bonds;
  const BondDef& def = p.m.bond[b.def[k]];
  return def.alpha == 0.0 && p.d.pairs.deep[k] > 0.0 &&
         (p.st.n.slip[k * p.m.dim] >= 0.0 || p.st.n.time == 0.0);
}

// default penalty of contact point k times its area; of a contact pair that limited before
double default_stiffness(const Problem& p, int k)
{
  const Bonds& b     = p.st.bonds;
  const bool general = !b.contact.skin.empty() && b.contact.skin_of[k] >= 0;
  return general ? p.d.pairs.penalty[k] * b.area[k] : b.cn[k];
}

// the largest of its normal and tangential stiffness, with the default penalty
double default_slope(const Problem& p, int k)
{
  const Bonds& b = p.st.bonds;
  return b.cn[k] > 0.0 ? default_stiffness(p, k) * std::max(1.0, b.ct[k] / b.cn[k]) : 0.0;
}

// default penalty normal and tangential, times part
void set_stiffness(Problem& p, int k, double part)
{
  Bonds& b = p.st.bonds;
  if (!b.contact.skin.empty() && b.contact.skin_of[k] >= 0) {
    b.cn[k] = default_stiffness(p, k);
    b.ct[k] = p.d.pairs.stick[k] > 0.0 ? p.d.pairs.stick[k] * b.area[k] : b.cn[k];
  }
  b.cn[k] *= part;
  b.ct[k] *= part;
}

// largest row sum of the nodes and corners of contact point k
double largest_row(const Problem& p, int k, const RealVec& push)
{
  double largest = 0.0;
  each_item(p, k, [&](int item, double) { largest = std::max(largest, push[item]); });
  return largest;
}

// scales of nodes and corners in contact: steps of the power method, which lower the largest row sum
RealVec contact_scales(const Problem& p, const RealVec& slope, const RealVec& mass, RealVec& push)
{
  RealVec x;
  for (int step = 0; step < SCALINGS; ++step) {
    contact_rows(p, slope, mass, x, push);
    for (size_t r = 0; r < push.size() && step > 0; ++r) push[r] *= x[r];
    x = push;
  }
  return x;
}

// does contact point k belong to a released point, or meet one?
bool is_of_debris(const Problem& p, int k)
{
  const ContactState& c = p.st.bonds.contact;
  if (c.skin.empty() || c.skin_of[k] < 0) return false;
  const int met = p.d.pairs.face[k];
  return c.skin[c.skin_of[k]].points == 2 || met < 0 || c.skin[met].points == 2;
}

// is contact point k near its face and approaches it? Debris: its few nodes push all together
bool is_about_to_push(const Problem& p, int k)
{
  const Bonds& b        = p.st.bonds;
  const ContactPairs& c = p.d.pairs;
  const int dim = p.m.dim, nnode = p.m.mesh.nnode();
  if (c.gap[k] > CLOSE * c.size[k] || is_of_debris(p, k)) return false;
  double rate = 0.0;
  const auto add = [&](int item, double w) {
    const double* v = item < nnode ? &p.st.n.v[item * dim] : &p.st.n.vc[(item - nnode) * dim];
    for (int i = 0; i < dim; ++i) rate += w * v[i] * c.normal[k * dim + i];
  };
  for (int j = b.a.off[k]; j < b.a.off[k + 1]; ++j) add(b.a.item[j], b.a_w[j]);
  for (int j = c.master.off[k]; j < c.master.off[k + 1]; ++j) add(c.master.item[j], -c.master_w[j]);
  return c.gap[k] + SOON * p.st.clock.dt * rate <= 0.0;
}

// limit of the row sums at a contact point that may have this part of its default penalty, or the part low
// where all near points share
double limit_at(double limit, double part, double low)
{
  return limit * std::clamp(1.0 + EDGE_GROWTH * (part / low - FEW_SHARE), 1.0, EDGE_MOST);
}

// part of the default penalties of contact point k that its nodes and corners have room for
//   in   pushed, free   row sums of points that push, and of those about to push with default penalties
double room_at(const Problem& p, int k, double limit, const RealVec& pushed, const RealVec& free)
{
  double part = 1.0;
  each_item(p, k, [&](int item, double) {
    if (free[item] > 0.0) part = std::min(part, (limit - pushed[item]) / free[item]);
  });
  return part;
}

// Penalties as far as the increment allows. All points that are near share what it allows; those about to
// push share what the pushing ones leave. Returns the largest square of the contact frequency. Collective.
//   in   full  stiffness with default penalties;  push  its row sums;  low: parts of default penalties
double limit_penalties(Problem& p, double limit, const RealVec& mass, RealVec& full, RealVec& push)
{
  const IntVec& acts = p.dofs.rows.bond_acts;
  const Bonds& b = p.st.bonds;
  RealVec low(acts.size(), 0.0), now(acts.size(), 0.0), next(acts.size(), 0.0), pushed, free;
  for (size_t i = 0; i < acts.size(); ++i) {
    const int k = acts[i];
    if (full[i] == 0.0) continue;
    if (is_adjustable(p, k)) {
      low[i]  = std::min(1.0, limit / largest_row(p, k, push));
      full[i] = next[i] = is_about_to_push(p, k) ? full[i] : 0.0;
    } else {
      now[i] = contact_slope(b, k, p.st.n.slip[k * p.m.dim]);
    }
  }
  const RealVec x = contact_scales(p, full, mass, push);
  contact_rows(p, full, mass, x, push);
  contact_rows(p, now, mass, x, pushed);
  contact_rows(p, next, mass, x, free);
  for (size_t i = 0; i < acts.size(); ++i) {
    const int k = acts[i];
    if (low[i] == 0.0) continue;
    double part = low[i];
    if (next[i] > 0.0) {
      const double most = limit_at(limit, limit / largest_row(p, k, push), low[i]);
      part   = std::max(low[i], room_at(p, k, most, pushed, free));
      now[i] = part * next[i];
    }
    set_stiffness(p, k, part);
  }
  return std::max(limit, contact_rows(p, now, mass, x, push));
}

// contribution of contact to the square of the largest frequency, with limited default penalties. Collective.
double contact_part(Problem& p, double omega2)
{
  RealVec &push = p.stable.push, &mass = p.stable.mass;
  const IntVec& acts = p.dofs.rows.bond_acts;
  const Bonds& b     = p.st.bonds;
  if (b.nbond_all() == 0) return 0.0;
  RealVec full(acts.size(), 0.0);
  int any = 0;
  for (size_t i = 0; i < acts.size(); ++i) {
    const int k = acts[i];
    if (b.side[k] != SIDE_CONTACT) continue;
    any = 1;
    if (is_adjustable(p, k)) set_stiffness(p, k, 1.0);
    full[i] = std::max(contact_slope(b, k, p.st.n.slip[k * p.m.dim]), default_slope(p, k));
  }
  if (comm_allreduce_max(any) == 0) return 0.0;
  contact_masses(p, mass);
  const double limit = CONTACT_PART * omega2, largest = contact_rows(p, full, mass, RealVec(), push);
  return largest <= limit ? largest : limit_penalties(p, limit, mass, full, push);
}

// stable increment without a bound: rigid bodies that nothing can touch  (test: patch/rigid_free.inp)
const double UNBOUNDED = 1e150;

void report(const Step& s, const State& st, int label, double taken)
{
  const StepClock& c = st.clock;
  if (std::min(c.stable, c.system) >= UNBOUNDED)
    return log_note("  explicit: rigid bodies do not bound the increment; taken %.6g of the deck", s.dt);
  const std::string ruling = label < 0 ? "" : ", element " + std::to_string(label);
  log_note("  explicit: stable increment of the elements %.6g%s; of the whole system %.6g; taken %.6g",
           c.stable, ruling.c_str(), c.system, taken);
  if (s.dt < s.period && s.dt > taken * (1.0 + 1e-9))
    log_warn("step %d, *DYNAMIC, EXPLICIT: dt = %g of the deck is longer than the stable increment; the "
             "increments are %g, %g of the largest stable one",
             st.log.step, s.dt, taken, s.safety);
}

// mean size of the elements around element e, within the ball of the criterion
double size_around(const FracMesh& fm, int e)
{
  double sum = 0.0, count = 0.0;
  frac_in_ball(fm, &fm.centre[3 * e], FRAC_RADIUS_BALL * fm.local[e], [&](int o, double) {
    if (fm.size[o] == 0.0) return;
    sum += fm.size[o];
    count += 1.0;
  });
  return count > 0.0 ? sum / count : fm.local[e];
}

// wave transit time of the smallest size_around of the elements that can break, of all elements if none can;
// converted ones count, so that it stays in a restart. Collective.
double crossing_time(const Problem& p)
{
  double least[2] = {1e300, 1e300};                     // of elements that can break, of all
  const FracMesh& fm = p.d.fm;
  for (const ElemBlock& b : p.d.el.block) {
    const double c = std::sqrt((b.law.lam3 + 2.0 * b.law.mu) / b.density);
    for (int e : fm.on ? b.elem : IntVec()) {
      if (!p.m.part.works(e) || p.st.frac.phase[e] == AS_NOTHING) continue;
      double& x = least[fm.def[e] >= 0 ? 0 : 1];
      x = std::min(x, size_around(fm, e) / c);
    }
  }
  for (double& x : least) x = -x;
  comm_max(least, 2);
  return least[0] > -1e300 ? -least[0] : -least[1];
}

// converted elements whose points move as the element did: StableIncrement::whole. Collective.   (6.47)
void find_whole(Problem& p)
{
  StableIncrement& q = p.stable;
  const State& st    = p.st;
  if (q.whole_of == changes(st)) return;
  q.whole_of = changes(st);
  p.d.el.as_points.clear();
  q.whole = st.frac.nreleased == 0;
  if (st.frac.nconverted == 0) return;
  bool all;
  p.d.el.as_points = point_as_elements(st.points, p.m.mesh.nelem(), all);
  q.whole = comm_allreduce_max(static_cast<int>(!all)) == 0 && q.whole;
}

// data of the elements at rest: interval of fracture tests; masses are shared while no element has gone.
// Collective.
void begin_elements(Problem& p, const Step& s)
{
  int worst;
  p.stable.crossing = crossing_time(p);
  p.stable.shares   = false;
  if (!p.stable.whole) return;
  elem_stable(p.m, p.d.el, p.st.n, s.nlgeom, &worst);            // frequencies with the own masses
  elem_share(p.m, p.d.el);
  p.stable.shares = true;
}

// the largest stable increment of points that do not move as their element did. Collective.
double stable_of_points(const Problem& p)
{
  int worst;
  const std::vector<char>& as = p.d.el.as_points;
  IntVec list;
  for (int q : p.dofs.rows.owned_point) {
    const int e = p.st.points.parent[q];
    if (e < 0 || as.empty() || !as[e]) list.push_back(q);
  }
  const double own = point_stable(p.st.points, p.m.dim, p.d.point_law, p.st.n, list, &worst);
  return -comm_allreduce_max(-own);
}

// the largest stable increment of elements; label of the limiting one. Rigid bodies alone have none; where
// bonds need a scale of their penalties, or the deck has no increment, that of their material is taken.
// Collective.
double stable_of_elements(Problem& p, const Step& s, int& label)
{
  int worst;
  double own   = elem_stable(p.m, p.d.el, p.st.n, s.nlgeom, &worst);
  double least = -comm_allreduce_max(-own);
  const bool scale = !p.m.bond.empty() || s.dt >= s.period;
  if (least >= 1e300 && !p.m.rigid.empty() && scale) {
    std::vector<char> rigid;
    rigid.swap(p.d.el.rigid);
    own   = elem_stable(p.m, p.d.el, p.st.n, s.nlgeom, &worst);
    least = -comm_allreduce_max(-own);
    rigid.swap(p.d.el.rigid);
  }
  label = worst < 0 ? -1 : p.m.mesh.elem_label[worst];
  label = comm_allreduce_max(own == least ? label : -1);
  return least;
}

// are there bonds besides contact? Collective.
bool tied(const Problem& p)
{
  const auto kind = [](const BondDef& b) { return b.kind != BOND_CONTACT; };
  if (std::none_of(p.m.bond.begin(), p.m.bond.end(), kind)) return false;
  const IntVec& side = p.st.bonds.side;
  const bool any = std::any_of(side.begin(), side.end(), [](int s) { return s != SIDE_CONTACT; });
  return comm_allreduce_max(static_cast<int>(any)) > 0;
}

// energy at the start of the run of surfaces that overlap: with the penalties of explicit steps
void open_contact_energy(State& st, int dim)
{
  Ledger& g = st.ledger;
  const double energy = bond_energy(st.bonds, dim, st.n, &g.slip_max, &g.slip_rms);
  g.total0 += energy - g.bond;
  g.scale = g.total0;
  g.bond  = energy;
}

// the increment of this stage; the next stage starts with the smallest stable one of this stage
double of_stage(long inc, double taken, StepClock& c)
{
  if (c.stage == 0.0 || inc % STAGE == 0) {
    c.stage  = c.stage == 0.0 ? taken : c.stage_least;
    c.stage_least = taken;
  }
  c.stage_least = std::min(c.stage_least, taken);
  c.stage  = std::min(c.stage, taken);
  return c.stage;
}

}  // namespace

Failure step_stable(Problem& p, const Step& s)
{
  State& st    = p.st;
  StepClock& c = st.clock;
  const bool begins = c.system == 0.0;
  int label = -1;
  find_whole(p);
  if (p.stable.crossing == 0.0) begin_elements(p, s);
  // masses shared with elements that now move otherwise; a restart compares in the same increment
  const bool lost  = !p.stable.whole && c.broke != changes(st);
  const bool looks = begins || lost || st.log.inc % CHECK_EVERY == 0;
  if (p.stable.shares && !p.stable.whole) {
    elem_share_end(p.d.el);
    p.stable.shares = false;
  }
  if (looks) c.stable = stable_of_elements(p, s, label);
  if ((looks || c.broke != changes(st)) && st.points.npoint_all() > 0) {
    const double points = stable_of_points(p);
    if (points < c.stable) label = -1;
    c.stable = std::min(c.stable, points);
  }
  c.broke = changes(st);
  const bool reset = st.laid.inc > c.measured && st.log.inc_total - c.measured >= CHECK_EVERY;
  if (begins || ((reset || st.log.inc % MEASURE_EVERY == 0) && tied(p))) {
    double omega2 = 0.0;
    c.measured = st.log.inc_total;
    const Failure failure = measure(p, s, omega2);
    const bool partly = failure.status == MASS_FAILED && (!begins || omega2 > 0.0);
    if (!failure.ok() && !partly) return failure;
    const double system = omega2 > 0.0 ? rounded(2.0 / std::sqrt(omega2)) : 1e300;
    c.system = partly && !begins ? std::min(system, c.system) : system;
  }
  const double free   = std::min({c.stable, c.system, UNBOUNDED}), omega2 = 4.0 / (free * free);
  const double touch  = contact_part(p, omega2);
  if (st.n.time == 0.0) open_contact_energy(st, p.m.dim);
  const double xi     = s.bulk() ? std::max(s.bulk_linear, c.xi) : 0.0;
  const double damped = std::sqrt(1.0 + xi * xi) - xi;                                           // (6.36)
  const double taken  = of_stage(st.log.inc, s.safety * 2.0 / std::sqrt(omega2 + touch) * damped, c);
  c.dt = std::min(s.dt, taken);
  if (begins && st.log.inc > 0) report(s, st, label, taken);
  return STATUS_OK;
}
