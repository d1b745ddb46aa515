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
    for (int e : b.elem)
      for (int g = 0; g < shape_info[b.shape].ngp; ++g) {
        elem_ip_fields(p.m, p.el, p.st.n.u, true, e, g, f);
        look();
      }
  for (int q = 0; q < p.st.points.npoint; ++q) {
    point_ip_fields(p.m, p.st.points, p.st.n.uc, q, f);
    look();
  }
  return least;
}

}  // namespace

std::string step_explain(const Problem& p, Status status)
{
  char text[512];
  const Model& m = p.m;
  if (status == SOLVER_SINGULAR || status == SOLVER_FAILED)
    return p.solver.message.empty() ? "the linear solver failed" : p.solver.message;
  if (status == OUTSIDE_GRID) {
    std::snprintf(text, sizeof text, "a corner of a material point (or a bond) left the grid: enlarge *GRID, which reaches "
                  "from (%g, %g) to (%g, %g)", m.grid.lo[0], m.grid.lo[1], m.grid.lo[0] + m.grid.n[0] * m.grid.h[0],
                  m.grid.lo[1] + m.grid.n[1] * m.grid.h[1]);
    return text;
  }
  if (status == CONTACT_DEPTH) {
    const double* X = &p.st.bonds.X[3 * p.worst];
    std::snprintf(text, sizeof text, "contact %s: the point that was at (%g, %g, %g) enters its master face by %g, more than a "
                  "quarter of the face: smaller increments, or a stiffer penalty (*CONTACT PAIR, ALPHA=)",
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
