// What stays from step to step (OP=MOD, OP=NEW), and from which value a static step ramps.

#include <cmath>
#include <limits>
#include <map>

#include "deck/deck_state.h"

namespace {

const double nowhere = std::numeric_limits<double>::quiet_NaN();

// A value of the step before that goes on: a table in step time has ended, and a number does not ramp again
void freeze(const Deck& d, const Model& m, const Step& before, Expr& value, double& start, int& amplitude)
{
  if (amplitude >= 0 && !m.amplitude[amplitude].total_time) {
    const double factor = amplitude_eval(m.amplitude[amplitude], before.period, d.time_end);
    amplitude = -1;
    if (value.is_const()) {
      value = expr_number(value.value * factor);
    } else {
      std::string error;
      int position = 0;
      Expr scaled;
      if (expr_compile("(" + value.text + ")*(" + text_format("%.17g", factor) + ")", d.param, scaled, error, position)) value = scaled;
    }
  }
  if (value.is_const() && amplitude < 0) start = value.value;
}

Carried note_of(const std::string& card, const std::string& key, const Field& at)
{
  Carried n;
  n.card = card;
  n.key = key;
  n.spot = Spot{at.file, at.line};
  return n;
}

// marks what the new one replaces; twice in one step is worth a warning
void replace(Deck& d, std::vector<Carried>& note, std::unordered_map<std::string, std::vector<int>>& index,
             const std::string& key, const Field& at)
{
  const auto found = index.find(key);
  if (found == index.end()) return;
  for (int i : found->second) {
    if (note[i].dead) continue;
    note[i].dead = true;
    if (!note[i].old) deck_warn(d, at, "replaces what " + spot_text(d, note[i].spot) + " says for the same place and direction in this step");
  }
  found->second.clear();
}

template <class Acting>
void drop_dead(std::vector<Acting>& list, std::vector<Carried>& note)
{
  std::size_t k = 0;
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (note[i].dead) continue;
    if (k != i) {
      list[k] = std::move(list[i]);
      note[k] = std::move(note[i]);
    }
    ++k;
  }
  list.resize(k);
  note.resize(k);
}

void make_old(std::vector<Carried>& note, std::unordered_map<std::string, std::vector<int>>& index)
{
  index.clear();
  for (std::size_t i = 0; i < note.size(); ++i) {
    note[i].old = true;
    index[note[i].key].push_back(static_cast<int>(i));
  }
}

// value at the end of a step; false when it differs from place to place
bool end_value(const Deck& d, const Model& m, const Step& s, const Load& l, double& value)
{
  const double z = m.dim == 3 ? 1.0 : 0.0;
  const double place[3][3] = {{0.0, 0.0, 0.0}, {0.61803, 0.41421, 0.73205 * z}, {-1.73205, 2.23607, -0.64575 * z}};
  double v[3];
  for (int i = 0; i < 3; ++i) v[i] = load_value(m, s, l, place[i], s.period, d.time_end);
  value = v[0];
  return v[0] == v[1] && v[0] == v[2];
}

void remember(Deck& d, const Model& m, const Step& before)
{
  d.load_before.clear();
  for (std::size_t i = 0; i < before.load.size(); ++i) {
    double v = 0.0;
    const bool uniform = end_value(d, m, before, before.load[i], v);
    d.load_before[d.load_note[i].key] = uniform ? v : nowhere;
  }
  d.prescribed_before.assign(3 * m.mesh.node_label.size(), nowhere);
  for (const Prescribed& b : before.prescribed)
    for (int n : b.node)
      for (int i = b.first; i <= b.last; ++i) {
        const std::size_t k = 3 * static_cast<std::size_t>(n);
        d.prescribed_before[k + i] = prescribed_value(m, before, b, &m.mesh.X[k], before.period, d.time_end);
      }
}

}  // namespace

// ---------------------------------------------------------------------------
// carry_begin : the new (last) step starts with the loads and supports of the step before;
// the first one with the *BOUNDARY lines of the model
// ---------------------------------------------------------------------------
void carry_begin(Deck& d, Model& m)
{
  const std::size_t k = m.step.size() - 1;
  Step& s = m.step[k];
  d.prescribed_before.clear();
  d.load_before.clear();
  if (k == 0) {
    s.prescribed = d.base;
    d.prescribed_note = d.base_note;
    d.load_note.clear();
  } else {
    const Step& before = m.step[k - 1];
    remember(d, m, before);
    s.load = before.load;
    s.prescribed = before.prescribed;
    for (Load& l : s.load) freeze(d, m, before, l.value, l.start, l.amplitude);
    for (Prescribed& b : s.prescribed) freeze(d, m, before, b.value, b.start, b.amplitude);
  }
  make_old(d.load_note, d.load_key);
  make_old(d.prescribed_note, d.prescribed_key);
}

void carry_new(Deck& d, const std::string& card)
{
  for (Carried& n : card == "BOUNDARY" ? d.prescribed_note : d.load_note)
    if (n.old && n.card == card) n.dead = true;
}

// ---------------------------------------------------------------------------
// carry_load : a load of the open step; replaces the one of the same key and ramps from its last value
// ---------------------------------------------------------------------------
void carry_load(Deck& d, Model& m, const std::string& card, const std::string& key, Load load, const Field& at)
{
  const std::string full = card + " " + key;
  replace(d, d.load_note, d.load_key, full, at);
  const auto before = d.load_before.find(full);
  if (before != d.load_before.end()) load.start = before->second;
  if (std::isnan(load.start)) {
    load.start = load.value.value;
    deck_warn(d, at, "the load of the step before differs from place to place: the new value acts at once, without a ramp");
  }
  d.load_key[full].push_back(static_cast<int>(d.load_note.size()));
  d.load_note.push_back(note_of(card, full, at));
  m.step.back().load.push_back(std::move(load));
}

// ---------------------------------------------------------------------------
// carry_prescribed : one dof of a node set. Nodes that stood at different values at the end of the step
// before get entries of their own, so that each ramps from where it was.
// ---------------------------------------------------------------------------
void carry_prescribed(Deck& d, Model& m, const std::string& key, const Prescribed& b, const Field& at)
{
  std::vector<Carried>& note = d.in_step ? d.prescribed_note : d.base_note;
  std::vector<Prescribed>& list = d.in_step ? m.step.back().prescribed : d.base;
  const std::string full = "BOUNDARY " + key;
  replace(d, note, d.prescribed_key, full, at);
  std::map<double, IntVec> group;
  for (int n : b.node) {
    const std::size_t k = 3 * static_cast<std::size_t>(n) + b.first;
    const double v = k < d.prescribed_before.size() ? d.prescribed_before[k] : 0.0;
    group[std::isfinite(v) ? v : 0.0].push_back(n);
  }
  for (auto& g : group) {
    Prescribed part = b;
    part.start = g.first;
    part.node.swap(g.second);
    d.prescribed_key[full].push_back(static_cast<int>(note.size()));
    note.push_back(note_of("BOUNDARY", full, at));
    list.push_back(std::move(part));
  }
}

void carry_end(Deck& d, Model& m)
{
  Step& s = m.step.back();
  drop_dead(s.load, d.load_note);
  drop_dead(s.prescribed, d.prescribed_note);
  d.time_end += s.period;
}
