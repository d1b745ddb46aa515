#include <cmath>
#include <limits>

#include "out/out.h"

namespace {

struct Word {
  const char* word;
  QuantityKind kind;
  int comp;
};

const Word words[] = {
    {"U1", Q_U, 0},          {"U2", Q_U, 1},          {"U3", Q_U, 2},           {"V1", Q_V, 0},
    {"V2", Q_V, 1},          {"V3", Q_V, 2},          {"A1", Q_A, 0},           {"A2", Q_A, 1},
    {"A3", Q_A, 2},          {"X1", Q_X, 0},          {"X2", Q_X, 1},           {"X3", Q_X, 2},
    {"RF1", Q_RF, 0},        {"RF2", Q_RF, 1},        {"RF3", Q_RF, 2},         {"GRF1", Q_GRF, 0},
    {"GRF2", Q_GRF, 1},      {"GRF3", Q_GRF, 2},      {"CFORCE", Q_CONTACT, 0}, {"CGAP", Q_CONTACT, 1},
    {"CAREA", Q_CONTACT, 2}, {"CWORK", Q_CONTACT, 3}, {"CPRESS", Q_CONTACT, 4}, {"NERODED", Q_FRAC, 0},
    {"CRACKA", Q_FRAC, 1},   {"NPOINTS", Q_FRAC, 2},  {"NBONDS", Q_FRAC, 3},    {"EFRAC", Q_FRAC, 4},
    {"ECONV", Q_FRAC, 5},    {"TIP1", Q_FRAC, 6},     {"TIP2", Q_FRAC, 7},      {"TIP3", Q_FRAC, 8},
    {"NFRAG", Q_FRAC, 9},    {"NLOOSE", Q_FRAC, 10},  {"EGHOST", Q_FRAC, 11},   {"NRELEASE", Q_FRAC, 12},
    {"EVISC", Q_FRAC, 13},
    {"S11", Q_S, 0},        {"S22", Q_S, 1},         {"S33", Q_S, 2},          {"S12", Q_S, 3},
    {"S23", Q_S, 4},         {"S31", Q_S, 5},         {"S13", Q_S, 5},          {"E11", Q_E, 0},
    {"E22", Q_E, 1},         {"E33", Q_E, 2},         {"E12", Q_E, 3},          {"E23", Q_E, 4},
    {"E31", Q_E, 5},         {"E13", Q_E, 5},         {"SMISES", Q_MISES, 0},   {"ENER", Q_ENER, 0},
    {"PEEQ", Q_PEEQ, 0},     {"EPLAST", Q_FRAC, 14},
    {"EOVERLAP", Q_FRAC, 15}, {"EFREED", Q_FRAC, 16},   {"ESUDDEN", Q_FRAC, 17},   {"ESTOP", Q_FRAC, 18}};

}  // namespace

Quantity quantity_find(const std::string& word)
{
  Quantity q;
  for (const Word& w : words)
    if (word == w.word) {
      q.kind = w.kind;
      q.comp = w.comp;
    }
  return q;
}

bool quantity_is_place(const Quantity& q)
{
  return q.kind == Q_U || q.kind == Q_V || q.kind == Q_A || q.kind == Q_X;
}

bool quantity_is_nodal(const Quantity& q)
{
  return quantity_is_place(q) || q.kind == Q_RF || q.kind == Q_GRF;
}

double mises_stress(const double s[6])
{
  const double d1 = s[0] - s[1], d2 = s[1] - s[2], d3 = s[2] - s[0];
  return std::sqrt(0.5 * (d1 * d1 + d2 * d2 + d3 * d3) + 3.0 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
}

double quantity_ip(const Quantity& q, const IpFields& f)
{
  switch (q.kind) {
    case Q_S:     return f.sig[q.comp];
    case Q_E:     return f.E[q.comp];
    case Q_MISES: return mises_stress(f.sig);
    case Q_ENER:  return f.psi;
    case Q_PEEQ:  return f.plastic;
    default:      return std::numeric_limits<double>::quiet_NaN();
  }
}

// ---------------------------------------------------------------------------
// elem_nodal_at : displacement, velocity, acceleration or place inside an element
//
//   in   N      shape functions at the place   [nen]
// ---------------------------------------------------------------------------
double elem_nodal_at(const Model& m, const Level& level, const Quantity& q, int e, const double* N)
{
  const RealVec& field = q.kind == Q_V ? level.v : q.kind == Q_A ? level.a : level.u;
  double value = 0.0;
  for (int a = 0; a < m.mesh.conn.count(e); ++a) {
    const int n = m.mesh.conn.begin(e)[a];
    value += N[a] * field[n * m.dim + q.comp];
    if (q.kind == Q_X) value += N[a] * m.mesh.X[n * 3 + q.comp];
  }
  return value;
}

// ---------------------------------------------------------------------------
// point_nodal_at : the same inside the domain of a material point
//
//   in   N      weights of its corners         [corners of the point]
// ---------------------------------------------------------------------------
double point_nodal_at(const Model& m, const Points& pts, const Level& level, const Quantity& q, int p,
                      const double* N)
{
  if (q.kind == Q_A) return std::numeric_limits<double>::quiet_NaN();
  double value = 0.0;
  for (int a = 0; a < pts.conn.count(p); ++a) {
    const int i = pts.conn.begin(p)[a] * m.dim + q.comp;
    value += N[a] * (q.kind == Q_V ? level.vc[i] : q.kind == Q_X ? pts.Xc[i] + level.uc[i] : level.uc[i]);
  }
  return value;
}

int elem_gauss(const Model& m, const Elements& el, int e)
{
  if (el.block_of[e] < 0) return 0;
  return shape_info[elem_table[m.mesh.elem_type[e]].shape].ngp;
}

bool out_interval(double interval, double time, double& next)
{
  if (interval <= 0.0 || time < next - 1e-6 * interval) return false;
  next = interval * (std::floor(time / interval + 1e-6) + 1.0);
  return true;
}

bool out_nlgeom(const Model& m, const State& s)
{
  if (m.step.empty()) return false;
  const int step = s.log.step > 0 ? s.log.step - 1 : 0;
  return m.step[step].nlgeom;
}
