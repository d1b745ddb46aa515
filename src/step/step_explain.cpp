#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "step/step.h"

namespace {

// smallest principal stretch of the last accepted state
double smallest_stretch(const Problem& p)
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
  for (const ElemBlock& b : p.el.block)
    for (int slot : b.live)
      for (int g = 0; g < shape_info[b.shape].ngp; ++g) {
        elem_ip_fields(p.m, p.el, p.st.n.u, true, b.elem[slot], g, f);
        look();
      }
  for (int q = 0; q < p.st.points.npoint; ++q) {
    point_ip_fields(p.m, p.st.points, p.st.n.uc, q, f);
    look();
  }
  return least;
}

// what the solver says, and the unknown of the first zero pivot in the user's words
std::string solver_text(const Problem& p)
{
  const System& s = p.sys;
  const int equation = p.solver.zero_equation;
  std::string words = p.solver.message.empty() ? "the linear solver failed" : p.solver.message;
  if (equation < 0 || equation >= s.neq()) return words;
  char text[160];
  const int row = equation / s.dim, direction = equation % s.dim + 1;
  double x[3];
  if (row < s.nfe) {
    std::snprintf(text, sizeof text, ". That is direction %d of node %d", direction, p.m.mesh.node_label[s.node_of_row[row]]);
  } else {
    grid_node_place(p.m.grid, s.dim, p.grid.key[row - s.nfe], x);
    std::snprintf(text, sizeof text, ". That is direction %d of the grid node at (%g, %g)", direction, x[0], x[1]);
  }
  return words + text + "; when it is supported, stiffnesses lie too far apart (a penalty, a very thin element)";
}

// the bond, or the material point and its corner, that lies outside the grid
std::string wanderer(const Problem& p)
{
  char text[200];
  const Points& pts = p.st.points;
  const int dim = p.m.dim;
  if (p.worst < 0) {
    const int b = -1 - p.worst;
    std::snprintf(text, sizeof text, "bond %.60s (at t = 0 in (%g, %g))", p.m.bond[p.st.bonds.def[b]].name.c_str(),
                  p.st.bonds.X[3 * b], p.st.bonds.X[3 * b + 1]);
    return text;
  }
  const int place = static_cast<int>(std::find(pts.conn.item.begin(), pts.conn.item.end(), p.worst) - pts.conn.item.begin());
  const int q = static_cast<int>(std::upper_bound(pts.conn.off.begin(), pts.conn.off.end(), place) - pts.conn.off.begin()) - 1;
  const double *X = &pts.Xc[p.worst * dim], *u = &p.st.n.uc[p.worst * dim];
  std::snprintf(text, sizeof text, "the corner (%g, %g) of material point %d of body %.60s", X[0] + u[0], X[1] + u[1],
                pts.label[q], p.m.body[pts.body[q]].name.c_str());
  return text;
}

}  // namespace

std::string step_explain(const Problem& p, Status status)
{
  char text[512];
  const Model& m = p.m;
  if (!p.note.empty()) return p.note;
  if (status == SOLVER_SINGULAR || status == SOLVER_FAILED) return solver_text(p);
  if (status == OUTSIDE_GRID) {
    std::snprintf(text, sizeof text, "%.200s left the grid: enlarge *GRID, which reaches from (%g, %g) to (%g, %g)",
                  wanderer(p).c_str(), m.grid.lo[0], m.grid.lo[1], m.grid.lo[0] + m.grid.n[0] * m.grid.h[0],
                  m.grid.lo[1] + m.grid.n[1] * m.grid.h[1]);
    return text;
  }
  if (status == BAD_NUMBER)
    return "forces or displacements have grown beyond all numbers (NaN or infinity): look for a value of the deck that is out "
           "of proportion (units, sizes, stiffness, density, penalty, dt)";
  if (status == CONTACT_DEPTH) {
    const double* X = &p.st.bonds.X[3 * p.worst];
    std::snprintf(text, sizeof text, "contact %s: the point that was at (%g, %g, %g) enters its master face by %g, too deep "
                  "for the size of the face: smaller increments, or a stiffer penalty (*CONTACT PAIR, ALPHA=)",
                  m.bond[p.st.bonds.def[p.worst]].name.c_str(), X[0], X[1], X[2], -p.st.np1.slip[p.worst * m.dim]);
    return text;
  }
  if (status == BAD_JACOBIAN && p.worst >= 0) {
    std::snprintf(text, sizeof text, "%s %d turned inside out (det F <= 0). St.Venant-Kirchhoff softens below a stretch of "
                  "0.577: check the load, or take smaller increments", p.worst_is_point ? "material point" : "element",
                  p.worst_is_point ? p.st.points.label[p.worst] : m.mesh.elem_label[p.worst]);
    return text;
  }
  const double stretch = smallest_stretch(p);
  if (stretch < 0.65) {
    std::snprintf(text, sizeof text, "no equilibrium found (residual %.3e against %.3e); the smallest stretch is %.3f: St.Venant-"
                  "Kirchhoff softens below 0.577 and carries no more load", p.st.log.residual, p.st.log.scale, stretch);
    return text;
  }
  std::snprintf(text, sizeof text, "residual %.3e against a force scale of %.3e after %d iterations: smaller increments, more "
                "iterations (*NEWTON, MAX ITER=), or a load beyond what the structure can carry",
                p.st.log.residual, p.st.log.scale, p.st.log.iterations);
  return text;
}
