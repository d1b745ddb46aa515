#include <cmath>

#include <Eigen/Eigenvalues>

#include "base/comm.h"
#include "base/log.h"
#include "base/timer.h"
#include "elem/kernel.h"
#include "step/step.h"

namespace {

// A domain is lost when its volume over that of the law (1.14), or the inverse, reaches this
// (test: stress/points_flow), in which it must not
const double VOLUME_LOST = 2.0;

// Linear geometry: largest displacement gradient that needs no warning; results are off by about as much
// (test: stress/s7_messages)
const double LARGE_GRADIENT = 0.2;

const double limit = 1.0 / 3.0;      // of the squared stretch: dS/dF changes its sign

// Elements and points compressed beyond the limit
struct Compressed {
  int elements = 0, points = 0;
  double least = 1.0;          // smallest eigenvalue of C
  int worst = -1;
  bool is_point = false;
  double X[3] = {0, 0, 0};
};

// smallest eigenvalue of C = F^T F
double smallest(const double* F)
{
  double C[3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) C[i][j] = F[i] * F[j] + F[3 + i] * F[3 + j] + F[6 + i] * F[6 + j];
  const Eigen::Map<const Eigen::Matrix3d> A(&C[0][0]);
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(A, Eigen::EigenvaluesOnly).eigenvalues()(0);
}

// Is the smallest eigenvalue of C above the limit by Gershgorin's bound? From gradients dNdX [nen*D] and
// nodal displacements u at an integration point; NEN = 0: nen nodes
template <int D, int NEN>
bool clear(const double* dNdX, int nen, const int* node, const RealVec& u)
{
  double ul[MAX_NODES * D], F[D * D];
  for (int a = 0; a < (NEN ? NEN : nen); ++a)
    for (int i = 0; i < D; ++i) ul[a * D + i] = u[static_cast<size_t>(node[a]) * D + i];
  ip_gradient<D, NEN>(dNdX, nen, ul, F);
  for (int i = 0; i < D; ++i) F[i * D + i] += 1.0;
  bool good = true;
  for (int i = 0; i < D; ++i) {
    double bound = 0.0;
    for (int j = 0; j < D; ++j) {
      double C = 0.0;
      for (int k = 0; k < D; ++k) C += F[k * D + i] * F[k * D + j];
      bound += i == j ? C : -std::fabs(C);
    }
    good = good && bound >= limit;
  }
  return good;
}

bool clear(int dim, const double* dNdX, int nen, const int* node, const RealVec& u)
{
  if (dim == 2) return nen == 4 ? clear<2, 4>(dNdX, nen, node, u) : clear<2, 0>(dNdX, nen, node, u);
  return nen == 8 ? clear<3, 8>(dNdX, nen, node, u) : clear<3, 0>(dNdX, nen, node, u);
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

// intact elements and points; broken ones may be compressed without limit
Compressed compressed(const Model& m, const Elements& el, const State& st)
{
  Compressed c;
  IpFields f;
  const bool breaks = !st.frac.broken.empty();
  const int dim     = m.dim;
  for (const ElemBlock& b : el.block)
    for (int slot : b.live) {
      const int e = b.elem[slot];
      if ((breaks && st.frac.broken[e] >= 0) || b.law.kind != LAW_SVK) continue;
      bool beyond   = false;
      const int nen = shape_info[b.shape].nen;
      for (int g = 0; g < shape_info[b.shape].ngp; ++g) {
        const double* dNdX = &b.dNdX[(b.gauss(slot) + g) * nen * dim];
        if (clear(dim, dNdX, nen, elem_nodes(m.mesh, b, slot), st.n.u)) continue;
        elem_ip_fields(m, el, st.n, true, e, g, f);
        beyond = note(c, f, e, false) || beyond;
      }
      c.elements += beyond;
    }
  for (int q = 0; q < st.points.npoint; ++q) {
    if (!point_counts(m, st.points, q)) continue;
    if (st.points.broken[q] >= 0 || point_material(m, st.points, q).law != LAW_SVK) continue;
    const double* G = st.points.G(q);
    if (clear(dim, G, st.points.conn.count(q), st.points.conn.begin(q), st.n.uc)) continue;
    point_ip_fields(m, st.points, st.n, q, f);
    c.points += note(c, f, q, true);
  }
  return c;
}

double det(const double* F)
{
  return Eigen::Map<const Eigen::Matrix3d>(F).determinant();
}

// the point whose domain volume differs most from the volume of its law
struct LostVolume {
  double part = 1.0;           // ratio of the larger to the smaller volume
  double J = 1.0, law = 1.0;
  int point = -1;
};

LostVolume lost_volume(const Model& m, const PointLaws& laws, const State& st)
{
  LostVolume worst;
  IpFields f;
  for (int q = 0; q < st.points.npoint; ++q) {
    if (!laws.in_group(q) || !point_counts(m, st.points, q)) continue;
    point_ip_fields(m, st.points, st.n, q, f);
    const double J = det(f.F), law = det(f.Fbar), part = std::max(J / law, law / J);
    if (part > worst.part) worst = {part, J, law, q};
  }
  return worst;
}

// warns once of the point whose domain lost the volume of its material
void warn_lost_volume(const Model& m, const PointLaws& laws, const State& st, Warned& warned)
{
  if (warned.count("volume") || (laws.group.size() == 0 && !m.part.on)) return;
  const LostVolume w = lost_volume(m, laws, st);
  const double largest = m.part.on ? comm_allreduce_max(w.part) : w.part;
  if (largest < VOLUME_LOST || !warned.insert("volume").second || w.part < largest) return;
  log_warn("time %.8g: the domain of material point %d of body %s has %.3g times its volume at t = 0, its "
           "law sees %.3g: the shape of the domain is lost, and what follows there is unreliable. Use "
           "more points or a coarser grid (*MATERIAL POINTS, POINTS=), smaller increments, or hardening "
           "(*PLASTIC)",
           st.n.time, st.points.label[w.point], m.body[st.points.body[w.point]].name.c_str(), w.J, w.law);
}

void sum_ranks(Compressed& c)
{
  double count[2] = {static_cast<double>(c.elements), static_cast<double>(c.points)};
  comm_sum(count, 2);
  c.elements = static_cast<int>(count[0]);
  c.points   = static_cast<int>(count[1]);
  c.least    = -comm_allreduce_max(-c.least);
}

// largest entry of the displacement gradient in elements that cannot break, and its element
double largest_gradient(const Model& m, const Elements& el, const State& st, int& worst)
{
  double largest = 0.0;
  IpFields f;
  IntVec breaks(m.mesh.nelem(), 0);
  for (const FractureDef& d : m.fracture)
    for (int e : d.elset >= 0 ? m.elset[d.elset].item : IntVec()) breaks[e] = 1;
  for (const ElemBlock& b : el.block)
    for (int slot : b.live) {
      const int e = b.elem[slot];
      if (breaks[e]) continue;
      for (int g = 0; g < shape_info[b.shape].ngp; ++g) {
        elem_ip_fields(m, el, st.n, true, e, g, f);
        double most = 0.0;
        for (int i = 0; i < 9; ++i) most = std::max(most, std::fabs(f.F[i] - (i % 4 == 0 ? 1.0 : 0.0)));
        if (most <= largest) continue;
        largest = most;
        worst   = e;
      }
    }
  return largest;
}

// warns at the end of a step without NLGEOM where displacements are not small
void warn_large(const Model& m, const Elements& el, const State& st, const Step& s, Warned& warned)
{
  if (!clock_over(s, st.clock)) return;
  int worst = -1;
  const double here = largest_gradient(m, el, st, worst), all = m.part.on ? comm_allreduce_max(here) : here;
  if (all <= LARGE_GRADIENT || !warned.insert("linear").second || here < all) return;
  log_warn("time %.8g: the displacement gradient is %.3g in element %d, but this step has no NLGEOM: its "
           "results are right for gradients much smaller than 1. *STEP, NLGEOM, or check units, loads and "
           "stiffness",
           st.n.time, here, m.mesh.elem_label[worst]);
}

}  // namespace

void step_warn_compressed(const Model& m, const Elements& el, const PointLaws& laws, const State& st,
                          const Step& s, Warned& warned)
{
  Timer timer(PHASE_COMMIT);
  if (!s.nlgeom) return warn_large(m, el, st, s, warned);
  warn_lost_volume(m, laws, st, warned);
  Compressed c = compressed(m, el, st);
  const double least = c.least;
  if (m.part.on) sum_ranks(c);
  const int count = c.elements + c.points;
  if (count == 0 || !warned.insert("stretch " + std::to_string(std::ilogb(count))).second) return;
  if (least > c.least) return;           // the worst one is on another rank
  const int label = c.is_point ? st.points.label[c.worst] : m.mesh.elem_label[c.worst];
  log_warn("time %.8g: %d elements and %d material points are compressed below a stretch of 0.577, where "
           "St.Venant-Kirchhoff softens and its results are unreliable (*HYPERELASTIC, NEO HOOKE does "
           "not soften); the worst is %s %d at %s with %.3f",
           st.n.time, c.elements, c.points, c.is_point ? "material point" : "element", label,
           position_text(c.X, m.dim).c_str(), std::sqrt(std::max(0.0, c.least)));
}
