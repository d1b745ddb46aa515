#include "model/quantity.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/comm.h"

namespace {

double node_u(const Model& m, const Level& l, int n, int c) { return l.u[n * m.dim + c]; }
double node_v(const Model& m, const Level& l, int n, int c) { return l.v[n * m.dim + c]; }
double node_a(const Model& m, const Level& l, int n, int c) { return l.a[n * m.dim + c]; }
double node_x(const Model& m, const Level& l, int n, int c)
{
  return m.mesh.X[3 * n + c] + l.u[n * m.dim + c];
}

double corner_u(const Points&, const Level& l, int dim, int k, int c) { return l.uc[k * dim + c]; }
double corner_v(const Points&, const Level& l, int dim, int k, int c) { return l.vc[k * dim + c]; }
double corner_x(const Points& pts, const Level& l, int dim, int k, int c)
{
  return pts.Xc[k * dim + c] + l.uc[k * dim + c];
}

double stress(const IpFields& f, int c) { return f.sig[c]; }
double strain(const IpFields& f, int c) { return f.E[c]; }

// *STATIC, RIKS: load relative to the end of the step; else step time over its period
double load_factor(const ModelNow& now, int)
{
  if (now.s.log.step < 1) return 0.0;
  const Step& s = now.m.step[now.s.log.step - 1];
  return (s.arc.on ? now.s.clock.load : now.s.clock.t) / s.period;
}

// position of the crack tip in one direction: the last, or first, centre of elements broken by the criterion
double crack_tip(const ModelNow& now, int axis)
{
  const Model& m    = now.m;
  const double none = -1e300, sign = now.first ? -1.0 : 1.0;
  double most = none;
  for (size_t e = 0; e < now.s.frac.time.size(); ++e) {
    if (!(now.s.frac.time[e] > 0.0)) continue;
    const int n = m.mesh.conn.count(static_cast<int>(e));
    double x = 0.0;
    for (int a = 0; a < n; ++a) x += m.mesh.X[3 * m.mesh.conn.begin(static_cast<int>(e))[a] + axis] / n;
    most = std::max(most, sign * x);
  }
  if (m.part.on) comm_max(&most, 1);
  const Fracture& f = now.s.frac;
  if (f.most[axis] >= f.least[axis]) most = std::max(most, now.first ? -f.least[axis] : f.most[axis]);
  return most == none ? std::numeric_limits<double>::quiet_NaN() : sign * most;
}

// ---- lines of the table

using NodeValue   = double (*)(const Model&, const Level&, int, int);
using CornerValue = double (*)(const Points&, const Level&, int, int, int);

// last letter of the word: direction
int direction(const char* word) { return word[std::char_traits<char>::length(word) - 1] - '1'; }

Quantity nodal(QuantityWhere where, const char* word, NodeValue node = nullptr, CornerValue corner = nullptr)
{
  const int c = direction(word);
  return {word, where, c, c == 2 ? 3 : 2, node, corner, nullptr, nullptr, nullptr};
}
Quantity contact(const char* word, double (*value)(const ContactLog&))
{
  return {word, OF_CONTACT, 0, 2, nullptr, nullptr, value, nullptr, nullptr};
}
Quantity model(const char* word, double (*value)(const ModelNow&, int), int c = 0)
{
  return {word, OF_MODEL, c, c == 2 ? 3 : 2, nullptr, nullptr, nullptr, value, nullptr};
}
Quantity point(const char* word, double (*value)(const IpFields&, int), int c = 0)
{
  return {word, OF_POINTS, c, c > 3 ? 3 : 2, nullptr, nullptr, nullptr, nullptr, value};
}

using Now = const ModelNow&;

const Quantity quantity_table[] = {
    // nodes, elements and points
    nodal(OF_MOTION, "U1", node_u, corner_u),
    nodal(OF_MOTION, "U2", node_u, corner_u),
    nodal(OF_MOTION, "U3", node_u, corner_u),
    nodal(OF_MOTION, "V1", node_v, corner_v),
    nodal(OF_MOTION, "V2", node_v, corner_v),
    nodal(OF_MOTION, "V3", node_v, corner_v),
    // nodes
    nodal(OF_NODES, "A1", node_a),
    nodal(OF_NODES, "A2", node_a),
    nodal(OF_NODES, "A3", node_a),
    nodal(OF_NODES, "X1", node_x, corner_x),
    nodal(OF_NODES, "X2", node_x, corner_x),
    nodal(OF_NODES, "X3", node_x, corner_x),
    nodal(OF_SUPPORTS, "RF1"),
    nodal(OF_SUPPORTS, "RF2"),
    nodal(OF_SUPPORTS, "RF3"),
    nodal(OF_GRID, "GRF1"),
    nodal(OF_GRID, "GRF2"),
    nodal(OF_GRID, "GRF3"),
    // contact pairs
    contact("CFORCE", [](const ContactLog& c) { return c.force; }),
    contact("CGAP", [](const ContactLog& c) { return c.gap; }),
    contact("CAREA", [](const ContactLog& c) { return c.area; }),
    contact("CWORK", [](const ContactLog& c) { return c.work; }),
    contact("CPRESS", [](const ContactLog& c) { return c.peak; }),
    // the whole model
    model("NERODED", [](Now now, int) { return double(now.s.frac.neroded); }),
    model("NRELEASE", [](Now now, int) { return double(now.s.frac.nreleasing); }),
    model("CRACKA", [](Now now, int) { return now.s.frac.area; }),
    model("NPOINTS", [](Now now, int) { return double(now.s.points.npoint_all()); }),
    model("NBONDS", [](Now now, int) { return double(now.s.bonds.nbond_all()); }),
    model("LPF", load_factor),
    model("EFRAC", [](Now now, int) { return now.s.ledger.fracture + now.s.ledger.cohesive; }),
    model("ECONV", [](Now now, int) { return now.s.ledger.conversion; }),
    model("EGHOST", [](Now now, int) { return now.s.ledger.ghost; }),
    model("EVISC", [](Now now, int) { return now.s.ledger.viscous; }),
    model("EPLAST", [](Now now, int) { return now.s.ledger.plastic; }),
    model("EOVERLAP", [](Now now, int) { return now.s.ledger.overlap; }),
    model("EFREED", [](Now now, int) { return now.s.ledger.released; }),
    model("ESUDDEN", [](Now now, int) { return now.s.ledger.sudden; }),
    model("EREMOVED", [](Now now, int) { return now.s.ledger.removed; }),
    model("ESTOP", [](Now now, int) { return now.s.ledger.stopped; }),
    model("NFRAG", [](Now now, int) { return now.fragments(); }),
    model("NLOOSE", [](Now now, int) { return double(now.s.frac.nreleased); }),
    model("TIP1", crack_tip, 0),
    model("TIP2", crack_tip, 1),
    model("TIP3", crack_tip, 2),
    // integration points
    point("S11", stress, 0),
    point("S22", stress, 1),
    point("S33", stress, 2),
    point("S12", stress, 3),
    point("S23", stress, 4),
    point("S31", stress, 5),
    point("S13", stress, 5),
    point("E11", strain, 0),
    point("E22", strain, 1),
    point("E33", strain, 2),
    point("E12", strain, 3),
    point("E23", strain, 4),
    point("E31", strain, 5),
    point("E13", strain, 5),
    point("SMISES", [](const IpFields& f, int) { return mises_stress(f.sig); }),
    point("ENER", [](const IpFields& f, int) { return f.psi; }),
    point("PEEQ", [](const IpFields& f, int) { return f.plastic; }),
    point("CRACKW", [](const IpFields& f, int) { return f.opening; }),
};

}  // namespace

double mises_stress(const double s[6])
{
  const double d1 = s[0] - s[1], d2 = s[1] - s[2], d3 = s[2] - s[0];
  return std::sqrt(0.5 * (d1 * d1 + d2 * d2 + d3 * d3) + 3.0 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
}

const Quantity* quantity_find(const std::string& word)
{
  for (const Quantity& q : quantity_table)
    if (word == q.word) return &q;
  return nullptr;
}

std::string quantity_words(int dim, const std::vector<QuantityWhere>& where)
{
  std::string words;
  for (const Quantity& q : quantity_table)
    if (q.dim <= dim && std::find(where.begin(), where.end(), q.where) != where.end())
      words += (words.empty() ? "" : "|") + std::string(q.word);
  return words;
}
