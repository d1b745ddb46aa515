#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/comm.h"
#include "bond/bond.h"
#include "step/step.h"

namespace {

const char* SOFTENS_TEXT = ". St.Venant-Kirchhoff softens below a stretch of 0.577: use "
                           "*HYPERELASTIC, NEO HOOKE instead of *ELASTIC";

// smallest principal stretch of the last accepted state, of St.Venant-Kirchhoff material; 1: there is none
double smallest_stretch(const Model& m, const Elements& el, const State& st)
{
  double least = 1.0;
  IpFields f;
  auto look = [&]() {
    Eigen::Matrix3d F;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) F(i, j) = f.F[3 * i + j];
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> C(F.transpose() * F, Eigen::EigenvaluesOnly);
    least = std::min(least, std::sqrt(std::max(0.0, C.eigenvalues()(0))));
  };
  for (const ElemBlock& b : el.block) {
    if (b.law.kind != LAW_SVK) continue;
    for (int slot : b.live)
      for (int g = 0; g < shape_info[b.shape].ngp; ++g) {
        elem_ip_fields(m, el, st.n, true, b.elem[slot], g, f);
        look();
      }
  }
  for (int q = 0; q < st.points.npoint; ++q) {
    if (point_material(m, st.points, q).law != LAW_SVK) continue;
    point_ip_fields(m, st.points, st.n, q, f);
    look();
  }
  return least;
}

// support of a static step by its contact pairs: none while they are open. Divided model: collective
std::string contact_text(const Model& m, const State& st, const ContactPairs& pairs)
{
  std::string out;
  if (m.step[st.log.step - 1].proc != PROC_STATIC || st.bonds.nbond_all() == 0) return out;
  // not known if bonds were rebuilt after the last attempt
  const int npair = pairs.master.size();
  const bool known = npair == st.bonds.nbond && st.np1.slip.size() == static_cast<size_t>(npair) * m.dim;
  for (size_t d = 0; d < m.bond.size(); ++d) {
    const BondDef& def = m.bond[d];
    if (def.kind != BOND_CONTACT) continue;
    double closed = 0.0, gap[2] = {1e300, 1e300};    // the smallest at the start of the increment, and now
    for (int b = 0; b < npair && known; ++b) {
      if (st.bonds.def[b] != static_cast<int>(d) || !pairs.master.count(b)) continue;
      const double now = st.np1.slip[b * m.dim];
      gap[0] = std::min(gap[0], pairs.gap[b]);
      gap[1] = std::min(gap[1], now);
      closed += st.bonds.counts(b) && now <= contact_touch(pairs, b);
    }
    if (m.part.on) {
      double large[2] = {-gap[0], -gap[1]};
      comm_sum(&closed, 1);
      comm_max(large, 2);
      for (int i : {0, 1}) gap[i] = -large[i];
    }
    char text[300];
    if (closed > 0.0)
      std::snprintf(text, sizeof text, "; contact %.60s is closed at %.0f contact points and supports the "
                                       "body %s",
                    def.name.c_str(), closed,
                    def.contact.friction > 0.0 ? "while it is in compression"
                                       : "in the normal direction only (no friction)");
    else if (gap[0] > 1e299)
      std::snprintf(text, sizeof text, "; contact %.60s has no face opposite and supports nothing",
                    def.name.c_str());
    else
      std::snprintf(text, sizeof text,
                    "; contact %.60s is open (smallest gap %.3g at the start of the increment, %.3g now) and "
                    "supports nothing: close it (*CONTACT PAIR, ADJUST=), or support the body",
                    def.name.c_str(), gap[0], gap[1]);
    out += text;
  }
  return out;
}

// is the inverted element on the master surface of a node-to-surface pair? Master nodes between slave nodes
// are not searched. Divided model: collective
std::string unseen_master(const Model& m, const Bonds& bonds, const ContactPairs& pairs, const Failure& f)
{
  const int none = static_cast<int>(m.bond.size());
  if (f.status != BAD_JACOBIAN || f.at == AT_POINT) return "";
  IntVec node;                 // node numbers of the element
  for (int k = 0; f.index >= 0 && k < m.mesh.conn.count(f.index); ++k)
    node.push_back(m.part.node_number(m.mesh.conn.begin(f.index)[k]));
  if (m.part.on) comm_allgatherv(node);
  const auto is_node = [&](int item) {
    return item < m.mesh.nnode() &&
           std::find(node.begin(), node.end(), m.part.node_number(item)) != node.end();
  };
  int def = none;
  for (int b = 0; b < bonds.nbond && b < pairs.master.size(); ++b) {
    const BondDef& d = m.bond[bonds.def[b]];
    if (d.contact.by_face || d.intermediate != 0) continue;
    if (!std::any_of(pairs.master.begin(b), pairs.master.begin(b + 1), is_node)) continue;
    def = std::min(def, bonds.def[b]);
  }
  if (m.part.on) def = -comm_allreduce_max(-def);
  if (def == none) return "";
  return ". It belongs to the master surface of contact " + m.bond[def].name.substr(0, 60) +
         ", where master nodes between slave nodes may penetrate undetected: use TYPE=SURFACE TO "
         "SURFACE, INTERMEDIATE=1, or a second pair with the roles exchanged";
}

// node and direction of the row of the first zero pivot
std::string pivot_text(const Model& m, const ActiveGrid& grid, const Dofs& s, int row, int direction)
{
  char text[120];
  double x[3];
  if (row < s.rows.nfe) {
    std::snprintf(text, sizeof text, "direction %d of node %d", direction,
                  m.mesh.node_label[s.rows.node_of_row[row]]);
  } else if (grid.key[row - s.rows.nfe] >= key_own) {
    std::snprintf(text, sizeof text, "direction %d of a corner of a released point",
                  direction);
  } else {
    grid_node_position(m.grid, s.rows.dim, grid.key[row - s.rows.nfe], x);
    std::snprintf(text, sizeof text, "direction %d of the grid node at %s", direction,
                  position_text(x, s.rows.dim).c_str());
  }
  return text;
}

// length of the longest domain of a body, in cells
double longest_domain(const Model& m, const State& st)
{
  double longest = 0.0;
  const Points& pts = st.points;
  for (int q = 0; q < pts.npoint; ++q)
    for (int i = 0; i < m.dim && pts.parent[q] < 0; ++i) {
      double lo = 1e300, hi = -1e300;
      for (int k = pts.conn.off[q]; k < pts.conn.off[q + 1]; ++k) {
        const int c    = pts.conn.item[k] * m.dim + i;
        const double x = pts.Xc[c] + st.n.uc[c];
        lo = std::min(lo, x);
        hi = std::max(hi, x);
      }
      longest = std::max(longest, (hi - lo) / m.grid.h[i]);
    }
  return longest;
}

// cause of a zero pivot of the grid: between corners farther apart than a cell it moves without stiffness
std::string grid_pivot_text(const Problem& p)
{
  const double longest = longest_domain(p.m, p.st);
  if (longest <= 1.0) return "";
  char text[300];
  std::snprintf(text, sizeof text,
                ". Domains of points have been stretched to %.3g cells: the grid follows their corners, and "
                "moves freely between corners that are more than a cell apart. Take more points a cell "
                "(*MATERIAL POINTS, POINTS=) or larger cells",
                longest);
  return text;
}

// message of the solver, free motion, and the dof of the first zero pivot. The pivot vanishes at any dof that
// takes part in the free motion; a rotation appears in a direction that is supported elsewhere.
std::string solver_text(const Problem& p, const std::string& whole, const std::string& contact)
{
  const Dofs& s = p.dofs;
  const int equation = p.newton.solver.zero_equation;
  std::string words = p.newton.solver.message.empty() ? "the linear solver failed" : p.newton.solver.message;
  if (equation < 0 || equation >= s.rows.neq()) return words;
  const int row = equation / s.rows.dim;
  words += ". It appears in " + pivot_text(p.m, p.d.grid, s, row, equation % s.rows.dim + 1);
  if (row < s.rows.nfe && !p.st.points.npoint_all() && !p.st.bonds.nbond_all() && !s.bound.tie.any) {
    const std::string motion =
        p.m.part.on ? whole : step_free_motion(p.m, p.d.el, s, s.rows.node_of_row[row]);
    if (!motion.empty()) return words + ": the supports do not constrain " + motion + " of its part";
    return words + ": the supports constrain all rigid-body motions of its part, so a piece is connected "
                   "by a hinge or by broken elements alone, or stiffnesses differ by too many orders of "
                   "magnitude (a very thin element)";
  }
  const std::string stretched = row >= s.rows.nfe ? grid_pivot_text(p) : "";
  if (!stretched.empty()) return words + stretched;
  return words + ", which takes part in the motion" + contact +
         "; if it is supported, stiffnesses differ by too many orders of magnitude (a penalty, a very thin "
         "element)";
}

// the bond, or the material point and its corner, that lies outside the grid
std::string outside_text(const Model& m, const State& st, const Failure& f)
{
  const Points& pts = st.points;
  const int dim = m.dim;
  if (f.at == AT_BOND) {
    RealVec xb;
    const int b = f.index;
    bond_places(m, pts, st.bonds, st.n.u, st.n.uc, xb);
    return "bond " + m.bond[st.bonds.def[b]].name.substr(0, 60) + " (now at " +
           position_text(&xb[b * dim], dim) + ", at t = 0 at " + position_text(&st.bonds.X[3 * b], dim) +
           ")";
  }
  const int index = static_cast<int>(std::find(pts.conn.item.begin(), pts.conn.item.end(), f.index) -
                                     pts.conn.item.begin());
  const int q = static_cast<int>(std::upper_bound(pts.conn.off.begin(), pts.conn.off.end(), index) -
                                 pts.conn.off.begin()) -
                1;
  double x[3] = {0, 0, 0};
  for (int i = 0; i < dim; ++i) x[i] = pts.Xc[f.index * dim + i] + st.n.uc[f.index * dim + i];
  std::string text = "the corner " + position_text(x, dim) + " of material point " +
                     std::to_string(pts.label[q]) + " of body " + m.body[pts.body[q]].name.substr(0, 60);
  if (pts.parent[q] >= 0) text += " (element " + std::to_string(m.mesh.elem_label[pts.parent[q]]) + ")";
  return text;
}

// advice where broken elements became one point each and still move with the grid; empty: there are none
std::string single_points(const Model& m, const Fracture& fr)
{
  const bool single = std::any_of(m.conversion.begin(), m.conversion.end(),
                                  [](const ConversionDef& c) { return c.per_elem == 1; });
  if (!single || fr.nconverted <= fr.nreleased) return "";
  return "; broken material of one point an element does not resist all motions of its cells: *CONVERSION, "
         "POINTS=2";
}

// the plane of *GRID BOUNDARY that a corner crossed, and by how much; empty: the grid is open there
std::string passed_plane(const Model& m, const State& st, const Failure& f)
{
  if (f.at == AT_BOND) return "";
  for (const GridBc& b : m.grid_bc) {
    const int i     = b.axis;
    const double lo = m.grid.lo[i], hi = lo + m.grid.n[i] * m.grid.h[i];
    const double x  = st.points.Xc[f.index * m.dim + i] + st.n.uc[f.index * m.dim + i];
    const double past = std::max(lo - x, x - hi), plane = x < lo ? lo : hi;
    const bool supported = b.first <= i && b.last >= i && std::fabs(b.position - plane) < 1e-6 * m.grid.h[i];
    if (past <= 0.0 || !supported) continue;
    char text[500];
    std::snprintf(text, sizeof text,
                  " passed the plane %c = %g, which *GRID BOUNDARY fixes, by %.3g cells: the nodes of the "
                  "plane are fixed, but others moved by more than a cell in an increment, or had next to no "
                  "material. Use smaller increments, *GRID, KEEP=0, more points (*MATERIAL POINTS, POINTS=), "
                  "or a fixed body with *CONTACT instead of the plane",
                  "xyz"[i], plane, past / m.grid.h[i]);
    return text + single_points(m, st.frac);
  }
  return "";
}

// bounding box of bonds and points, now and at the end of the step with the present velocities
void needed_box(const Model& m, const State& st, double* lo, double* hi)
{
  const int dim = m.dim;
  const double rest = std::max(0.0, m.step[st.log.step - 1].period - st.log.t_step);
  for (int i = 0; i < dim; ++i) {
    lo[i] = m.grid.lo[i];
    hi[i] = m.grid.lo[i] + m.grid.n[i] * m.grid.h[i];
  }
  auto include = [&](const double* x) {
    for (int i = 0; i < dim; ++i) {
      lo[i] = std::min(lo[i], x[i]);
      hi[i] = std::max(hi[i], x[i]);
    }
  };
  RealVec u = st.n.u, uc = st.n.uc, xb;
  for (int end = 0; end < 2; ++end) {
    bond_places(m, st.points, st.bonds, u, uc, xb);
    for (int b = 0; b < st.bonds.nbond; ++b)
      if (st.bonds.field[b] >= 0) include(&xb[b * dim]);
    for (int c = 0; c < st.points.ncorner; ++c) {
      double x[3];
      for (int i = 0; i < dim; ++i) x[i] = st.points.Xc[c * dim + i] + uc[c * dim + i];
      include(x);
    }
    for (size_t k = 0; k < u.size(); ++k) u[k] += rest * st.n.v[k];
    for (size_t k = 0; k < uc.size(); ++k) uc[k] += rest * st.n.vc[k];
  }
}

// advice for the too deep contact point b: fast penetration in this increment, or slow
std::string deep_advice(const Problem& p, int b)
{
  const BondDef& d  = p.m.bond[p.st.bonds.def[b]];
  const double now  = p.st.np1.slip[b * p.m.dim], before = p.d.pairs.gap[b];
  const char* const keyword = d.contact.general ? "*CONTACT" : "*CONTACT PAIR";
  char text[256];
  if (before - now > -0.5 * now) return "it penetrated within this increment: use smaller increments";
  if (d.penalty > 0.0)
    std::snprintf(text, sizeof text,
                  "the penalty is too soft, which smaller increments do not change: raise it (%s, PENALTY=, "
                  "or its *SURFACE BEHAVIOR), now %g, or omit it: the default penalty increases with the "
                  "depth",
                  keyword, d.penalty);
  else
    std::snprintf(text, sizeof text,
                  "the penalty is too soft, which smaller increments do not change: raise it (%s, ALPHA=), "
                  "now %g",
                  keyword, d.alpha > 0.0 ? d.alpha : contact_alpha);
  return text;
}

std::string outside_grid(const Problem& p, const Failure& f)
{
  const Model& m = p.m;
  const std::string passed = passed_plane(m, p.st, f);
  if (!passed.empty()) return outside_text(m, p.st, f) + passed;
  double top[3] = {0, 0, 0}, lo[3], hi[3];
  for (int i = 0; i < m.dim; ++i) top[i] = m.grid.lo[i] + m.grid.n[i] * m.grid.h[i];
  needed_box(m, p.st, lo, hi);
  return outside_text(m, p.st, f) + " left the grid, which extends from " +
         position_text(m.grid.lo.data(), m.dim) + " to " + position_text(top, m.dim) +
         ": enlarge *GRID; with the present velocities the step needs it from " + position_text(lo, m.dim) +
         " to " + position_text(hi, m.dim);
}

std::string too_deep(const Problem& p, int b)
{
  const double* X = &p.st.bonds.X[3 * b];
  char text[512];
  std::snprintf(text, sizeof text,
                "contact %s: the contact point initially at (%g, %g, %g) penetrates its master face by %g, "
                "too deep for the size of the face: ",
                p.m.bond[p.st.bonds.def[b]].name.c_str(), X[0], X[1], X[2], -p.st.np1.slip[b * p.m.dim]);
  return text + deep_advice(p, b);
}

std::string inside_out(const Problem& p, const Failure& f, bool nlgeom)
{
  const Model& m = p.m;
  const bool is_point = f.at == AT_POINT;
  const Material& material = is_point ? point_material(m, p.st.points, f.index)
                                      : m.material[model_material(m, f.index)];
  const bool opens = law_flows(material.law) &&
                     std::any_of(m.fracture.begin(), m.fracture.end(), [](const FractureDef& d) {
                       return d.criterion == CRITERION_COHESIVE;
                     });
  char text[512];
  std::snprintf(text, sizeof text,
                "%s %d turned inside out (det F <= 0)%s%s: check the load, or use smaller increments",
                is_point ? "material point" : "element",
                is_point ? p.st.points.label[f.index] : m.mesh.elem_label[f.index],
                opens ? ", or no openings of its cracks are in equilibrium" : "",
                nlgeom && material.law == LAW_SVK ? SOFTENS_TEXT : "");
  return text;
}

// pivots: what the solver has fixed
std::string not_converged(const Problem& p, Status status, bool nlgeom, const std::string& pivots)
{
  const StepLog& log = p.st.log;
  char text[512];
  // without NLGEOM the law is Hooke's, which does not soften
  const double stretch = nlgeom ? smallest_stretch(p.m, p.d.el, p.st) : 1.0;
  if (stretch < 0.65) {
    std::snprintf(
        text, sizeof text,
        "no equilibrium found (residual %.3e against %.3e); the smallest stretch is %.3f: St.Venant-"
        "Kirchhoff softens below 0.577 and carries no more load: use *HYPERELASTIC, NEO HOOKE "
        "instead of *ELASTIC",
        log.residual, log.scale, stretch);
    return text;
  }
  if (log.iterations == 0) return std::string(out_status_text(status)) + ", before the first iteration";
  const Step& now    = p.m.step[log.step - 1];
  const bool pressed = now.proc == PROC_STATIC && assem_has_followers(now);
  std::snprintf(text, sizeof text,
                "residual %.3e, force scale %.3e after %d iterations: use smaller increments or more "
                "iterations (*NEWTON, MAX ITER=); the load may exceed what the structure can carry%s",
                log.residual, log.scale, log.iterations,
                pressed ? ". Pressure follows its faces, which the matrix leaves out: where it exceeds the "
                          "shear modulus several times prescribe displacements instead"
                        : "");
  return text + single_points(p.m, p.st.frac) + pivots;
}

// whole: divided model: free motion; contact: support by pairs; master: of an inverted element
std::string explain_here(const Problem& p, const Failure& f, const std::string& whole,
                         const std::string& contact, const std::string& master)
{
  if (!f.note.empty()) return f.note;
  const Status status = f.status;
  const bool nlgeom   = p.m.step[p.st.log.step - 1].nlgeom;
  if (status == SOLVER_SINGULAR || status == SOLVER_FAILED) return solver_text(p, whole, contact);
  if (status == MASS_FAILED)
    return "the system of the mass matrix (velocities of the grid at the start of the increment, or "
           "accelerations of the nodes) was solved neither by conjugate gradients nor by a factorisation, "
           "which smaller increments do not change: check densities, velocities and sizes of elements that "
           "are out of proportion";
  if (status == OUTSIDE_GRID) return outside_grid(p, f);
  if (status == BAD_NUMBER)
    return "forces or displacements are no longer finite (NaN or infinity): check the deck for a value out "
           "of proportion (units, sizes, stiffness, density, penalty, dt)";
  if (status == DIVISION_FAILED) return out_status_text(status);
  if (status == CONTACT_DEPTH && f.index >= 0) return too_deep(p, f.index);
  if (status == BAD_JACOBIAN && f.index >= 0) return inside_out(p, f, nlgeom) + master;
  const Solver& solver = p.newton.solver;
  const bool fixed     = solver.null_pivot_row >= 0 && solver.zero_equation >= 0;
  return not_converged(p, status, nlgeom, fixed ? "; " + solver_text(p, whole, contact) : "");
}

// has this rank the location of the failure?
bool has_location(const Problem& p, const Failure& f)
{
  const int equation = p.newton.solver.zero_equation;        // larger: of another rank
  if (f.status == SOLVER_SINGULAR || f.status == SOLVER_FAILED)
    return equation >= 0 && equation < p.dofs.rows.neq();
  return f.index >= 0;
}

}  // namespace

// several ranks: the text of the first rank with the location
std::string step_explain(const Problem& p, const Failure& f)
{
  const bool divided = p.m.part.on;
  const std::string whole   = divided ? step_free_motion(p.m, p.d.el, p.dofs, -1) : "",
                    contact = contact_text(p.m, p.st, p.d.pairs),
                    master  = unseen_master(p.m, p.st.bonds, p.d.pairs, f),
                    text    = explain_here(p, f, whole, contact, master);
  if (!p.dofs.rows.split) return text;
  const int ranks = comm_size(),
            first = ranks - comm_allreduce_max(has_location(p, f) ? ranks - comm_rank() : 0);
  return comm_exchange(std::vector<std::string>(ranks, text))[first == ranks ? 0 : first];
}
