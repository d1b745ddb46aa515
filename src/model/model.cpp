#include "model/model.h"

#include <gsl/gsl_spline.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <new>

namespace {

template <class Named>
int find_name(const std::vector<Named>& list, const std::string& name)
{
  for (std::size_t i = 0; i < list.size(); ++i)
    if (list[i].name == name) return static_cast<int>(i);
  return -1;
}

// interpolation inside the table by GSL. Steffen and Akima are local and the influence of a far point on
// a natural cubic spline falls by 3.7 from point to point: 64 points around t give all of them to rounding.
double spline(const Amplitude& a, const gsl_interp_type* type, std::size_t i, double t)
{
  const std::size_t first = i > 31 ? i - 31 : 0;
  const std::size_t last  = std::min(a.t.size(), i + 33);
  gsl_interp* g = gsl_interp_alloc(type, last - first);
  if (!g) throw std::bad_alloc();
  double y = std::numeric_limits<double>::quiet_NaN();         // reported by the user of the value
  if (gsl_interp_init(g, &a.t[first], &a.y[first], last - first) == 0)
    y = gsl_interp_eval(g, &a.t[first], &a.y[first], t, nullptr);
  gsl_interp_free(g);
  return y;
}

double value_at(const Model& m, const Expr& value, double factor, int amplitude, const double x[3],
                double t_step, double t_total)
{
  const double v = factor * expr_eval(value, x, t_total);
  return amplitude >= 0 ? v * amplitude_eval(m.amplitude[amplitude], t_step, t_total) : v;
}

}  // namespace

int model_find_nset(const Model& m, const std::string& name) { return find_name(m.nset, name); }
int model_find_elset(const Model& m, const std::string& name) { return find_name(m.elset, name); }
int model_find_surface(const Model& m, const std::string& name) { return find_name(m.surface, name); }
int model_find_material(const Model& m, const std::string& name) { return find_name(m.material, name); }
int model_find_amplitude(const Model& m, const std::string& name) { return find_name(m.amplitude, name); }
int model_find_body(const Model& m, const std::string& name) { return find_name(m.body, name); }

std::vector<Member> model_members(const Model& m, const FractureDef& d)
{
  std::vector<Member> all = d.member;
  for (size_t k = 0; !m.part.on && d.elset >= 0 && k < m.elset[d.elset].item.size(); ++k)
    all.push_back({m.elset[d.elset].item[k], static_cast<int>(k)});
  return all;
}

bool model_changes(const Model& m)
{
  for (const Step& s : m.step)
    if (!s.change.empty()) return true;
  return false;
}

int model_general_contact(const Model& m)
{
  for (size_t i = 0; i < m.bond.size(); ++i)
    if (m.bond[i].contact.general) return static_cast<int>(i);
  return -1;
}

bool model_has_pairs(const Model& m)
{
  return std::any_of(m.bond.begin(), m.bond.end(), [](const BondDef& d) { return d.pair(); });
}

// ---------------------------------------------------------------------------
// amplitude_eval : y(t), constant before the first and after the last point
//
//   in   t_step    time since the start of the step
//        t_total   time since the start of the run (TIME=TOTAL TIME)
// ---------------------------------------------------------------------------
double amplitude_eval(const Amplitude& a, double t_step, double t_total)
{
  const double t = a.total_time ? t_total : t_step;
  const double origin[3] = {0.0, 0.0, 0.0};
  if (a.kind == AMP_EXPRESSION) return expr_eval(a.expr, origin, t);
  if (a.t.empty()) return 1.0;
  if (t <= a.t.front()) return a.y.front();
  if (t >= a.t.back()) return a.y.back();

  const std::size_t i = static_cast<std::size_t>(std::upper_bound(a.t.begin(), a.t.end(), t) - a.t.begin()) -
                        1;
  const std::size_t n = a.t.size();
  if (a.kind == AMP_STEFFEN && n >= 3) return spline(a, gsl_interp_steffen, i, t);
  if (a.kind == AMP_AKIMA && n >= 5) return spline(a, gsl_interp_akima, i, t);
  if (a.kind == AMP_CUBIC && n >= 3) return spline(a, gsl_interp_cspline, i, t);

  double s = (t - a.t[i]) / (a.t[i + 1] - a.t[i]);
  if (a.kind == AMP_SMOOTH_STEP) s = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
  return a.y[i] + s * (a.y[i + 1] - a.y[i]);
}

std::string position_text(const double* X, int dim)
{
  char text[100];
  if (dim == 2) std::snprintf(text, sizeof text, "(%g, %g)", X[0], X[1]);
  else std::snprintf(text, sizeof text, "(%g, %g, %g)", X[0], X[1], X[2]);
  return text;
}

std::string value_text(const Model& m, const char* keyword, const DeckLine& deck_line, const Expr& value,
                       int amplitude, const std::string& where, const double* X, double time)
{
  char when[40];
  std::snprintf(when, sizeof when, "%.8g", time);
  std::string text = deck_line.file + " line " + std::to_string(deck_line.line) + ", *" + keyword +
                     ": the value" + (value.is_const() ? "" : " \"" + value.text.substr(0, 200) + "\"");
  if (amplitude >= 0) {
    const Amplitude& a = m.amplitude[amplitude];
    text += " times amplitude " + a.name;
    if (a.kind == AMP_EXPRESSION) text += " \"" + a.expr.text.substr(0, 200) + "\"";
  }
  return text + " is not a finite number at " + where + " " + position_text(X, m.dim) + ", time " + when +
         ": check roots, logarithms and divisions";
}

double load_value(const Model& m, const Step& s, const Load& l, const double x[3], double t_step,
                  double t_total)
{
  const double v = value_at(m, l.value, l.factor, l.amplitude, x, t_step, l.hold < 0.0 ? t_total : l.hold);
  if (l.ramp == RAMP_NONE) return v;
  const double part = std::min(1.0, t_step / s.period);
  return l.ramp == RAMP_IN ? v * part : v * (1.0 - part);
}

double prescribed_value(const Model& m, const Prescribed& b, const double x[3], double t_step, double t_total)
{
  return value_at(m, b.value, b.factor, b.amplitude, x, t_step, t_total);
}

double prescribed_travel(const Model& m, const Prescribed& b, const double x[3], double t0, double t1,
                      double total0)
{
  const double s = std::sqrt(0.6), at[3] = {-s, 0.0, s}, weight[3] = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
  RealVec cut = {t0};          // the velocity is smooth between two points of a table
  if (b.amplitude >= 0) {
    const Amplitude& a = m.amplitude[b.amplitude];
    const double shift = a.total_time ? total0 - t0 : 0.0;
    for (double t : a.t)
      if (t - shift > t0 && t - shift < t1) cut.push_back(t - shift);
  }
  cut.push_back(t1);
  double way = 0.0;
  for (std::size_t k = 0; k + 1 < cut.size(); ++k) {
    const double half = 0.5 * (cut[k + 1] - cut[k]), middle = cut[k] + half;
    for (int g = 0; g < 3; ++g) {
      const double t = middle + at[g] * half;
      way += 2.0 * half * weight[g] * prescribed_value(m, b, x, t, total0 + t - t0);
    }
  }
  return way;
}

double support_value(const Model& m, const Expr& value, int amplitude, const double x[3], double t_step,
                     double t_total)
{
  const double v = expr_eval(value, x, t_total);
  if (amplitude >= 0) return v * amplitude_eval(m.amplitude[amplitude], t_step, t_total);
  if (!value.is_const() || v == 0.0) return v;
  const Step& first = m.step.front();
  if (first.proc == PROC_STATIC) return v * std::min(1.0, t_total / first.period);
  return t_total > 0.0 ? v : 0.0;
}

void frame_turn(const Frame& f, int dim, bool back, const double* v, double* out)
{
  for (int i = 0; i < dim; ++i) {
    double sum = 0.0;
    for (int j = 0; j < dim; ++j) sum += (back ? f.axis[3 * j + i] : f.axis[3 * i + j]) * v[j];
    out[i] = sum;
  }
}

bool model_viscous(const Model& m)
{
  return std::any_of(m.material.begin(), m.material.end(),
                     [](const Material& a) { return a.used && a.beta > 0.0; });
}

double cone_cohesion(const Material& m, double y, double* steep)
{
  const double q = m.hardening == HARDENING_SHEAR ? std::sqrt(3.0) : 1.0;      // over the stress of the test
  const double p = m.hardening == HARDENING_SHEAR     ? 0.0
                   : m.hardening == HARDENING_TENSION ? -1.0 / 3.0
                                                      : 1.0 / 3.0;
  const double power = cone_power(m, q * y);
  *steep = m.exponent * power / y - p * m.friction;
  return power - p * m.friction * y;
}

// q^b + friction q/3 = d: convex, from above
double cone_tension(const Material& m, double y)
{
  double steep;
  const double d = cone_cohesion(m, y, &steep);
  double q = std::pow(d, 1.0 / m.exponent);
  for (int it = 0; it < 100; ++it) {
    const double power = cone_power(m, q), more = power + m.friction * q / 3.0 - d;
    const double next = q - more / (m.exponent * power / q + m.friction / 3.0);
    if (!(next < q)) break;
    q = next;
  }
  return q;
}
