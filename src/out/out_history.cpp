#include <algorithm>
#include <cmath>
#include <limits>

#include "base/log.h"
#include "out/out.h"

namespace {

const double no_value = std::numeric_limits<double>::quiet_NaN();
const double infinite     = std::numeric_limits<double>::infinity();

struct Sample {                // values and weights of one column
  RealVec value, weight;
  void add(double v, double w)
  {
    value.push_back(v);
    weight.push_back(w);
  }
};

struct Gathered {              // sums of the sample of a column, over the ranks
  double count = 0, sum = 0, total = 0;          // total: of the weights
  double hi = -infinite, lo = infinite;
};

Gathered gather(const Sample& s)
{
  Gathered g;
  if (s.value.empty()) return g;
  g.count = static_cast<double>(s.value.size());
  g.hi = g.lo = s.value[0];
  for (std::size_t i = 0; i < s.value.size(); ++i) {
    g.sum   += s.weight[i] * s.value[i];
    g.total += s.weight[i];
    g.hi = std::max(g.hi, s.value[i]);
    g.lo = std::min(g.lo, s.value[i]);
  }
  return g;
}

// for all columns together
void gather_ranks(const Model& m, std::vector<Gathered>& of)
{
  RealVec sum, most;
  for (const Gathered& g : of) {
    sum.insert(sum.end(), {g.count, g.sum, g.total});
    most.insert(most.end(), {g.hi, -g.lo});
  }
  out_sum(m, sum.data(), static_cast<long>(sum.size()));
  out_max(m, most.data(), static_cast<long>(most.size()));
  for (std::size_t i = 0; i < of.size(); ++i)
    of[i] = {sum[3 * i], sum[3 * i + 1], sum[3 * i + 2], most[2 * i], -most[2 * i + 1]};
}

double reduced(Reduce reduce, const Gathered& g)
{
  if (g.count == 0.0) return no_value;
  switch (reduce) {
    case REDUCE_SUM:    return g.sum;
    case REDUCE_MAX:    return g.hi;
    case REDUCE_MIN:    return g.lo;
    case REDUCE_ABSMAX: return std::max(std::fabs(g.hi), std::fabs(g.lo));
    default:            return g.sum / g.total;
  }
}

int complain(const HistoryDef& d, const char* why)
{
  log_error("%s line %d, *HISTORY, %s: %s", d.deck_line.file.c_str(), d.deck_line.line, d.name.c_str(), why);
  return 1;
}

void built_in_names(int dim, std::vector<std::string>& names)
{
  names = {"time",   "step", "inc",      "dt",      "iter", "kinetic",
           "strain", "bond", "external", "balance", "px",   "py"};
  if (dim == 3) names.insert(names.end(), {"pz", "lx", "ly"});
  names.insert(names.end(), {"lz", "slip_max", "slip_rms"});
}

void built_in_values(const State& s, int dim, RealVec& row)
{
  const Ledger& l = s.ledger;
  row = {s.n.time, double(s.log.step), double(s.log.inc), s.log.dt, double(s.log.iterations),
         l.kinetic, l.strain, l.bond, l.external, l.balance, l.momentum[0], l.momentum[1]};
  if (dim == 3) row.insert(row.end(), {l.momentum[2], l.angular[0], l.angular[1]});
  row.insert(row.end(), {l.angular[2], l.slip_max, l.slip_rms});
}

void points_of_body(const Model& m, const Points& pts, int body, IntVec& list)
{
  for (int p = 0; p < pts.npoint; ++p)
    if (pts.body[p] == body && point_counts(m, pts, p)) list.push_back(p);
}

// elements of a set, and the points of converted ones
void read_elset(const Elements& el, const Points& pts, const IntVec& set, Probe& probe)
{
  IntVec in(el.block_of.size(), 0);
  for (int e : set) {
    in[e] = 1;
    if (el.block_of[e] >= 0) probe.elem.push_back(e);
  }
  for (int p = 0; p < pts.npoint; ++p)
    if (pts.parent[p] >= 0 && in[pts.parent[p]]) probe.point.push_back(p);
}

// is a node of the set one of an element that became points?
bool any_converted(const Mesh& mesh, const Fracture& fr, const IntVec& set)
{
  std::vector<char> in(fr.converted.empty() ? 0 : mesh.nnode(), 0);
  for (int e : fr.converted)
    for (int k = mesh.conn.off[e]; k < mesh.conn.off[e + 1]; ++k) in[mesh.conn.item[k]] = 1;
  return !in.empty() && std::any_of(set.begin(), set.end(), [&](int n) { return in[n] != 0; });
}

// nodes of a set, without nodes that lost their last element and are not replaced by a corner
void read_nset(const Model& m, const State& s, const IntVec& set, Probe& probe)
{
  IntVec follow;
  if (any_converted(m.mesh, s.frac, set)) frac_follow(m, s.frac, s.points, follow);
  for (int n : set)
    if (m.part.counts(n) && (follow.empty() || follow[n] != FOLLOW_NONE)) probe.node.push_back(n);
}

// nodes, elements and points that a column reads at present; updated after conversions
void find_targets(const Model& m, const Elements& el, const State& s, const HistoryDef& d, Probe& probe)
{
  probe.node.clear();
  probe.elem.clear();
  probe.point.clear();
  probe.at = Located();
  if (d.at_point) probe.at = out_locate(m, el, s.points, d.X.data());
  if (d.nset >= 0) read_nset(m, s, m.nset[d.nset].item, probe);
  if (d.elset >= 0) read_elset(el, s.points, m.elset[d.elset].item, probe);
  if (d.body >= 0) points_of_body(m, s.points, d.body, probe.point);
}

struct Targets {               // are there any, on any rank?
  bool node = false, elem = false, point = false, elem_at = false, point_at = false;
};

Targets targets_of(const Model& m, const Probe& p)
{
  double any[5] = {double(!p.node.empty()), double(!p.elem.empty()), double(!p.point.empty()),
                   double(!p.at.elem.empty()), double(!p.at.point.empty())};
  out_max(m, any, 5);
  return {any[0] > 0.0, any[1] > 0.0, any[2] > 0.0, any[3] > 0.0, any[4] > 0.0};
}

// does a step add an element of the set, on any rank?
bool added_later(const Model& m, int elset)
{
  double any = 0.0;
  for (const Step& s : m.step)
    for (const ModelChange& c : s.change)
      for (int e : elset >= 0 && c.add ? c.elem : IntVec())
        if (std::binary_search(m.elset[elset].item.begin(), m.elset[elset].item.end(), e)) any = 1.0;
  out_max(m, &any, 1);
  return any > 0.0;
}

// finds the items of a column; returns 1, with a message, if there are none
int make_probe(const Model& m, const Elements& el, const State& s, const HistoryDef& d, Probe& probe)
{
  probe.q      = quantity_find(d.what);
  probe.reduce = d.reduce;
  if (!probe.q) return complain(d, "unknown quantity");
  const QuantityWhere where = probe.q->where;
  if (where == OF_GRID) {
    probe.grid_bc = d.grid_bc;
    const bool known = probe.grid_bc >= 0 && probe.grid_bc < static_cast<int>(m.grid_bc.size());
    return known ? 0 : complain(d, "no such *GRID BOUNDARY line");
  }
  if (where == OF_CONTACT) {
    probe.contact = d.contact;
    return d.contact >= 0 ? 0 : complain(d, "no such *CONTACT PAIR");
  }
  if (where == OF_MODEL) return 0;
  find_targets(m, el, s, d, probe);
  const Targets has = targets_of(m, probe);
  if (d.at_point) {
    if (!has.elem_at && !has.point_at)
      return complain(d, "no element and no material point contains this point at t = 0");
    if (where == OF_NODES && !probe.q->corner && !has.elem_at)
      return complain(d, "material points keep no acceleration");
    return 0;
  }
  if (d.body >= 0 && m.body[d.body].fill == FILL_CONVERSION) return 0;        // empty at t = 0
  const bool later = model_changes(m) && added_later(m, d.elset);
  if (!has.node && !has.elem && !has.point && !later) return complain(d, "the target is empty");
  if (where == OF_POINTS ? has.node : has.elem)
    return complain(d, "this quantity does not belong to this kind of target");
  if (has.point && where != OF_POINTS && !probe.q->corner)
    return complain(d, "material points have neither accelerations nor reactions");
  return 0;
}

double node_value(const Model& m, const State& s, const Quantity& q, int n)
{
  return q.where == OF_SUPPORTS ? s.rf[n * m.dim + q.comp] : q.node(m, s.n, n, q.comp);
}

void sample_gauss(const Model& m, const Elements& el, const State& s, const Quantity& q, int e,
                  Sample& sample)
{
  IpFields f;
  const ElemBlock& b = el.block[el.initial_block[e]];
  const bool closed  = std::string(q.word) == "CRACKW" && !elem_cracked(s.n, e);
  for (int g = 0; g < elem_gauss(m, el, e); ++g) {
    if (closed) {
      sample.add(0.0, b.w[b.gauss(el.slot_of[e]) + g]);
      continue;
    }
    elem_ip_fields(m, el, s.n, out_nlgeom(m, s), e, g, f);
    sample.add(q.point(f, q.comp), f.V0);
  }
}

void sample_point(const Model& m, const State& s, const Quantity& q, int p, const double* N, Sample& sample)
{
  if (quantity_is_place(q)) {
    sample.add(point_nodal_at(m, s.points, s.n, q, p, N), s.points.V0[p]);
    return;
  }
  IpFields f;
  point_ip_fields(m, s.points, s.n, p, f);
  sample.add(q.point(f, q.comp), s.points.V0[p]);
}

// the position at t = 0 may lie on a common edge: mean over the elements or points there
void sample_place(const Model& m, const Elements& el, const State& s, const Probe& probe, Sample& sample)
{
  const double* N = probe.at.N.data();
  for (std::size_t i = 0; i < probe.at.elem.size(); ++i) {
    const int e = probe.at.elem[i];
    if (quantity_is_place(*probe.q))
      sample.add(elem_nodal_at(m, s.n, *probe.q, e, N + MAX_NODES * i), 1.0);
    else
      sample_gauss(m, el, s, *probe.q, e, sample);
  }
  for (std::size_t i = 0; i < probe.at.point.size(); ++i)
    sample_point(m, s, *probe.q, probe.at.point[i], N + MAX_NODES * i, sample);
}

// the sample of nodes or points of a column, or a number of the state
bool is_sampled(const Probe& probe)
{
  return probe.q->where != OF_MODEL && probe.q->where != OF_CONTACT && probe.q->where != OF_GRID;
}

double state_value(const Model& m, const Elements& el, const State& s, const Probe& probe)
{
  const Quantity& q = *probe.q;
  const auto fragments = [&] {
    Fragments f;
    return static_cast<double>(frac_connect(m, el, s, f));
  };
  if (q.where == OF_MODEL) return q.model({m, s, probe.reduce == REDUCE_MIN, fragments}, q.comp);
  if (q.where == OF_GRID) return s.grid_rf[probe.grid_bc * m.dim + q.comp];
  const bool begun = probe.contact < static_cast<int>(s.contact.size());
  return q.contact(begun ? s.contact[probe.contact] : ContactLog());
}

Gathered sampled(const Model& m, const Elements& el, const State& s, const Probe& probe)
{
  Sample sample;
  sample_place(m, el, s, probe, sample);
  for (int n : probe.node) sample.add(node_value(m, s, *probe.q, n), 1.0);
  for (int e : probe.elem) sample_gauss(m, el, s, *probe.q, e, sample);
  for (int p : probe.point)
    sample_point(m, s, *probe.q, p, s.points.w(p), sample);
  return gather(sample);
}

}  // namespace

double history_reduce(Reduce reduce, const RealVec& value, const RealVec& weight)
{
  return reduced(reduce, gather({value, weight}));
}

int history_column(const History& h, const std::string& name)
{
  for (std::size_t i = 0; i < h.names.size(); ++i)
    if (h.names[i] == name) return static_cast<int>(i);
  return -1;
}

bool history_at(const History& h, int column, double time, double& value)
{
  if (h.rows.empty()) return false;
  const double last = h.rows.back()[0], first = h.rows.front()[0];
  const double slack = 1e-9 * std::max(std::fabs(last), std::fabs(time));   // sums of dt are not exact
  if (time > last + slack || time < first - slack) return false;
  std::size_t i = 0;
  while (i + 2 < h.rows.size() && h.rows[i + 1][0] < time) ++i;
  const std::size_t j = std::min(i + 1, h.rows.size() - 1);
  const double t0 = h.rows[i][0], t1 = h.rows[j][0];
  double part = t1 > t0 ? (time - t0) / (t1 - t0) : 1.0;
  part  = std::min(1.0, std::max(0.0, part));
  value = part == 0.0 ? h.rows[i][column] : part == 1.0 ? h.rows[j][column]
                      : (1.0 - part) * h.rows[i][column] + part * h.rows[j][column];
  return true;
}

// ---------------------------------------------------------------------------
// history_setup : columns and their items;  history_open : the file and its header line
// ---------------------------------------------------------------------------
int history_setup(const Model& m, const Elements& el, const State& s, Output& out)
{
  int errors = 0;
  built_in_names(m.dim, out.history.names);
  for (const HistoryDef& d : m.output.history) {
    Probe probe;
    errors += make_probe(m, el, s, d, probe);
    out.probe.push_back(probe);
    out.history.names.push_back(d.name);
  }
  return errors;
}

void history_open(Output& out)
{
  out.his = out_file_first(out.base + ".his");
  std::fputs("# ", out.his);
  for (std::size_t i = 0; i < out.history.names.size(); ++i)
    std::fprintf(out.his, i == 0 ? "%17s" : " %19s", out.history.names[i].c_str());
  std::fputc('\n', out.his);
}

// explicit steps produce rows for the file only
bool history_shown(const Model& m, const History& h, int row)
{
  const int step = static_cast<int>(h.rows[row][1]);
  return (step > 0 && m.step[step - 1].explicit_steps()) || row % m.output.history_at.every() == 0;
}

void history_write(const Output& out, int row)
{
  const RealVec& value = out.history.rows[row];
  for (std::size_t i = 0; i < value.size(); ++i) {
    const bool count = i == 1 || i == 2 || i == 4;      // step, inc, iter
    std::fprintf(out.his, count ? "%s%19.0f" : "%s%19.11e", i ? " " : "", value[i]);
  }
  std::fputc('\n', out.his);
  out_file_flush(out.his, out.base + ".his");
}

// ---------------------------------------------------------------------------
// history_row : evaluates every column at t(n); every n-th row and the last one are written to the file
// ---------------------------------------------------------------------------
void history_row(const Model& m, const Elements& el, const State& s, Output& out)
{
  RealVec row;
  if (out.converted != s.frac.nconverted) {
    for (std::size_t i = 0; i < out.probe.size(); ++i)
      find_targets(m, el, s, m.output.history[i], out.probe[i]);
    out.converted = s.frac.nconverted;
  }
  built_in_values(s, m.dim, row);
  std::vector<Gathered> sample;
  for (const Probe& probe : out.probe)
    sample.push_back(is_sampled(probe) ? sampled(m, el, s, probe) : Gathered());
  gather_ranks(m, sample);
  for (std::size_t i = 0; i < sample.size(); ++i)
    row.push_back(is_sampled(out.probe[i]) ? reduced(out.probe[i].reduce, sample[i])
                                           : state_value(m, el, s, out.probe[i]));
  out.history.rows.push_back(row);
  const int last = static_cast<int>(out.history.rows.size()) - 1;
  if (!history_shown(m, out.history, last)) return;
  history_write(out, last);
  out.row_written = last;
}
