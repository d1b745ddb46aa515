#include <cmath>

#include <Eigen/Eigenvalues>

#include "base/comm.h"
#include "base/log.h"
#include "base/timer.h"
#include "step/step.h"

namespace {

const double limit = 1.0 / 3.0;      // of the square of the stretch: dS/dF changes its sign

// What is compressed beyond the limit
struct Compressed {
  int elements = 0, points = 0;
  double least = 1.0;          // smallest eigenvalue of C
  int worst = -1;
  bool is_point = false;
  double X[3] = {0, 0, 0};
};

// smallest eigenvalue of C = F^T F, 1 where its rows tell that it is not below the limit (Gershgorin)
double smallest(const double* F)
{
  double C[3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) C[i][j] = F[i] * F[j] + F[3 + i] * F[3 + j] + F[6 + i] * F[6 + j];
  double bound = 1.0;
  for (int i = 0; i < 3; ++i)
    bound = std::min(bound, C[i][i] - std::fabs(C[i][(i + 1) % 3]) - std::fabs(C[i][(i + 2) % 3]));
  if (bound >= limit) return 1.0;
  const Eigen::Map<const Eigen::Matrix3d> A(&C[0][0]);
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(A, Eigen::EigenvaluesOnly).eigenvalues()(0);
}

bool note(Compressed& c, const IpFields& f, int item, bool is_point)
{
  const double least = smallest(f.F);
  if (least >= limit) return false;
  if (least < c.least) {
    c.least    = least;
    c.worst    = item;
    c.is_point = is_point;
    for (int i = 0; i < 3; ++i) c.X[i] = f.X[i];
  }
  return true;
}

// intact elements and points; what has broken may close as far as it likes
Compressed compressed(const Model& m, const Elements& el, const State& st)
{
  Compressed c;
  IpFields f;
  const bool breaks = !st.frac.broken.empty();
  for (const ElemBlock& b : el.block)
    for (int slot : b.live) {
      const int e = b.elem[slot];
      if ((breaks && st.frac.broken[e] >= 0) || b.law.kind != LAW_SVK) continue;
      bool beyond = false;
      for (int g = 0; g < shape_info[b.shape].ngp; ++g) {
        elem_ip_fields(m, el, st.n, true, e, g, f);
        beyond = note(c, f, e, false) || beyond;
      }
      c.elements += beyond;
    }
  for (int q = 0; q < st.points.npoint; ++q) {
    if (st.points.broken[q] >= 0 || point_material(m, st.points, q).law != LAW_SVK) continue;
    point_ip_fields(m, st.points, st.n, q, f);
    c.points += note(c, f, q, true);
  }
  return c;
}

void sum_ranks(Compressed& c)
{
  double count[2] = {static_cast<double>(c.elements), static_cast<double>(c.points)};
  comm_sum(count, 2);
  c.elements = static_cast<int>(count[0]);
  c.points   = static_cast<int>(count[1]);
  c.least    = -comm_allreduce_max(-c.least);
}

}  // namespace

void step_limit(const Model& m, const Elements& el, const State& st, const Step& s, Warned& warned)
{
  if (!s.nlgeom || (comm_rank() > 0 && !m.part.on)) return;
  Timer timer(PHASE_COMMIT);
  Compressed c = compressed(m, el, st);
  const double least = c.least;
  if (m.part.on) sum_ranks(c);
  const int count = c.elements + c.points;
  if (count == 0 || !warned.insert("stretch " + std::to_string(std::ilogb(count))).second) return;
  if (least > c.least) return;           // another rank has the worst one
  const int label = c.is_point ? st.points.label[c.worst] : m.mesh.elem_label[c.worst];
  log_warn("time %.8g: %d elements and %d material points are compressed below a stretch of 0.577, where "
           "St.Venant-Kirchhoff softens and its results are unreliable; the worst is %s %d at %s with %.3f",
           st.n.time, c.elements, c.points, c.is_point ? "material point" : "element", label,
           position_text(c.X, m.dim).c_str(), std::sqrt(std::max(0.0, c.least)));
}
