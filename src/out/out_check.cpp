#include <cmath>
#include <limits>

#include "out/out.h"
#include "shape/shape.h"

namespace {

const double not_a_number = std::numeric_limits<double>::quiet_NaN();

struct Norm {                  // sums of V0 (q - exact)^2, V0 exact^2 and V0
  double error = 0, exact = 0, volume = 0;
  void add(double value, double target, double V0)
  {
    error  += V0 * (value - target) * (value - target);
    exact  += V0 * target * target;
    volume += V0;
  }
};

void norm_of_ranks(const Model& m, Norm& n)
{
  double sum[3] = {n.error, n.exact, n.volume};
  out_sum(m, sum, 3);
  n.error  = sum[0];
  n.exact  = sum[1];
  n.volume = sum[2];
}

std::string check_name(const Check& c)
{
  if (!c.name.empty()) return c.name;
  const char* const at[] = {"time", "end", "max", "min", "absmax"};
  char text[40];
  std::snprintf(text, sizeof text, "%g", c.time);
  const std::string where = c.at == AT_TIME ? text : at[c.at];
  return c.kind == CHECK_FIELD ? (c.centre ? "L2centre(" : "L2(") + c.what + ")@" + where
                               : c.column + "@" + where;
}

void fail(CheckResult& r, const std::string& message)
{
  r.done = true;
  r.pass = false;
  r.value = r.difference = not_a_number;
  r.message = message;
}

void judge(CheckResult& r, double value)
{
  r.done       = true;
  r.value      = value;
  r.difference = value - r.target;
  r.pass       = std::fabs(r.difference) <= r.tolerance;    // false for NaN
  if (!std::isfinite(value)) r.message = "not a number";
}

// stress and strain of an element where they are most accurate: mean of the Gauss points,
// at their mean position
void add_centre(const Model& m, const Elements& el, const State& s, const Check& c, const Quantity& q, int e,
                Norm& norm)
{
  IpFields f;
  double V = 0.0, value = 0.0, X[3] = {0, 0, 0};
  for (int g = 0; g < elem_gauss(m, el, e); ++g) {
    elem_ip_fields(m, el, s.n, out_nlgeom(m, s), e, g, f);
    V += f.V0;
    value += f.V0 * q.point(f, q.comp);
    for (int i = 0; i < 3; ++i) X[i] += f.V0 * f.X[i];
  }
  for (double& x : X) x /= V;
  norm.add(value / V, expr_eval(c.exact, X, s.n.time), V);
}

void add_elements(const Model& m, const Elements& el, const State& s, const Check& c, const Quantity& q,
                  Norm& norm)
{
  IpFields f;
  double N[MAX_NODES];
  for (int e = 0; e < m.mesh.nelem(); ++e) {
    const Shape shape = elem_table[m.mesh.elem_type[e]].shape;
    if (c.centre && !quantity_is_place(q)) {
      if (elem_gauss(m, el, e)) add_centre(m, el, s, c, q, e, norm);
      continue;
    }
    for (int g = 0; g < elem_gauss(m, el, e); ++g) {
      elem_ip_fields(m, el, s.n, out_nlgeom(m, s), e, g, f);
      shape_eval(shape, gauss_rule(shape).xi[g], N, nullptr);
      const double value = quantity_is_place(q) ? elem_nodal_at(m, s.n, q, e, N) : q.point(f, q.comp);
      norm.add(value, expr_eval(c.exact, f.X, s.n.time), f.V0);
    }
  }
}

void add_points(const Model& m, const State& s, const Check& c, const Quantity& q, Norm& norm)
{
  const Points& pts = s.points;
  IpFields f;
  for (int p = 0; p < pts.npoint; ++p) {
    if (!point_counts(m, pts, p)) continue;
    double X[3], value;
    point_centre(pts, m.dim, p, X);
    if (quantity_is_place(q)) {
      value = point_nodal_at(m, pts, s.n, q, p, pts.w(p));
    } else {
      point_ip_fields(m, pts, s.n, p, f);
      value = q.point(f, q.comp);
    }
    norm.add(value, expr_eval(c.exact, X, s.n.time), pts.V0[p]);
  }
}

// one value of the history over the whole run
double extreme(const History& h, int column, CheckAt at)
{
  double value = h.rows[0][column];
  if (at == AT_ABSMAX) value = std::fabs(value);
  for (const RealVec& row : h.rows) {
    const double v = at == AT_ABSMAX ? std::fabs(row[column]) : row[column];
    if (std::isnan(v)) return v;
    if (at == AT_MIN ? v < value : v > value) value = v;
  }
  return value;
}

void print_result(std::FILE* file, const CheckResult& r)
{
  std::string name = r.name;
  for (char& letter : name)
    if (letter == ' ') letter = '_';
  std::fprintf(file, "%-4s  %-24s %18.10e %18.10e %12.4e %12.4e  %s", r.pass ? "PASS" : "FAIL", name.c_str(),
               r.value, r.target, r.difference, r.tolerance, r.source.c_str());
  if (!r.message.empty()) std::fprintf(file, "  # %s", r.message.c_str());
  std::fputc('\n', file);
}

void print_table(std::FILE* file, const std::vector<CheckResult>& result)
{
  std::fprintf(file, "%-4s  %-24s %18s %18s %12s %12s  %s\n", "#", "check", "value", "target", "difference",
               "tolerance", "source");
  for (const CheckResult& r : result) print_result(file, r);
}

}  // namespace

// out_check_due : a FIELD check with a time is evaluated in the first increment that reaches this time
bool out_check_due(const Check& c, const CheckResult& r, double time)
{
  return c.kind == CHECK_FIELD && c.at == AT_TIME && !r.done && time >= c.time - 1e-9 * std::fabs(c.time);
}

// ---------------------------------------------------------------------------
// out_check_field : L2 error of a field over the volume at t = 0, all Gauss points and material points
//
//   sqrt(sum V0 (q - exact)^2) / sqrt(sum V0 exact^2), or / (SCALE sqrt(sum V0))
//
//   returns NaN and a message if there is nothing to compare with
// ---------------------------------------------------------------------------
double out_check_field(const Model& m, const Elements& el, const State& s, const Check& c,
                       std::string& message)
{
  const Quantity* const found = quantity_find(c.what);
  if (!found || (!quantity_is_place(*found) && found->where != OF_POINTS)) {
    message = "no field of this name";
    return not_a_number;
  }
  const Quantity& q = *found;
  Norm norm;
  add_elements(m, el, s, c, q, norm);
  add_points(m, s, c, q, norm);
  norm_of_ranks(m, norm);
  const double scale = c.scale > 0.0 ? c.scale * std::sqrt(norm.volume) : std::sqrt(norm.exact);
  if (norm.volume <= 0.0) message = "reads nothing: no element and no material point";
  else if (!std::isfinite(norm.exact)) message = "the exact field is not a number somewhere";
  else if (!(scale > 0.0)) message = "the exact field is zero everywhere: give SCALE";
  else if (std::isnan(norm.error) && quantity_is_place(q) && !q.corner)
    message = "material points keep no acceleration";
  return message.empty() ? std::sqrt(norm.error) / scale : not_a_number;
}

// ---------------------------------------------------------------------------
// out_check_history : one value of a column against its target
//
//   in   finished  the run reached its end; otherwise only checks at a time reached can pass
// ---------------------------------------------------------------------------
void out_check_history(const History& h, const Check& c, bool finished, CheckResult& r)
{
  const int column = history_column(h, c.column);
  if (column < 0) return fail(r, "reads nothing: no column " + c.column);
  if (h.rows.empty()) return fail(r, "reads nothing: the history is empty");
  if (c.at == AT_TIME) {
    double value = 0.0;
    if (!history_at(h, column, c.time, value)) return fail(r, "time never reached");
    return judge(r, value);
  }
  if (!finished) return fail(r, "the run did not reach its end");
  judge(r, c.at == AT_END ? h.rows.back()[column] : extreme(h, column, c.at));
}

void out_check_begin(const Model& m, Output& out)
{
  for (const Check& c : m.output.check) {
    CheckResult r;
    r.name      = check_name(c);
    r.source    = c.source;
    r.target    = c.kind == CHECK_FIELD ? 0.0 : c.target;
    r.tolerance = c.tolerance;
    out.result.push_back(r);
  }
}

void out_check_increment(const Model& m, const Elements& el, const State& s, Output& out)
{
  for (std::size_t i = 0; i < m.output.check.size(); ++i) {
    const Check& c = m.output.check[i];
    if (!out_check_due(c, out.result[i], s.n.time)) continue;
    std::string message;
    judge(out.result[i], out_check_field(m, el, s, c, message));
    if (message.empty() && std::fabs(s.n.time - c.time) > 1e-6 * std::fabs(c.time)) {
      char text[60];
      std::snprintf(text, sizeof text, "made at time %.9g", s.n.time);
      message = text;
    }
    if (!message.empty()) out.result[i].message = message;
  }
}

// ---------------------------------------------------------------------------
// out_check_end : checks at the end; writes the table to JOB.chk, the listing and stdout. Returns the number
// of failed checks, equal on all ranks
// ---------------------------------------------------------------------------
int out_check_end(const Model& m, const Elements& el, const State& s, bool finished, Output& out)
{
  int failed = 0;
  for (std::size_t i = 0; i < m.output.check.size(); ++i) {
    const Check& c = m.output.check[i];
    CheckResult& r = out.result[i];
    if (c.kind == CHECK_HISTORY) {
      out_check_history(out.history, c, finished, r);
    } else if (c.at == AT_TIME) {
      if (!r.done) fail(r, "time never reached");
    } else if (!finished) {
      fail(r, "the run did not reach its end");
    } else {
      std::string message;
      judge(r, out_check_field(m, el, s, c, message));
      if (!message.empty()) r.message = message;
    }
    if (!r.pass) ++failed;
  }
  print_table(out.chk, out.result);
  out_file_close(out.chk, out.base + ".chk");
  if (m.output.check.empty()) return 0;
  std::fprintf(out.lst, "\nCHECKS\n");
  print_table(out.lst, out.result);
  if (comm_rank() == 0) print_table(stdout, out.result);
  std::fflush(stdout);
  return failed;
}
