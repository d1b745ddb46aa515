// Loads and supports of earlier steps: kept (OP=MOD), removed (OP=NEW), replaced or ramped down.
// *CLOAD and *BOUNDARY are replaced by node and direction, loads on faces by element face, volume loads by
// target and direction. Loads of one step add up; of prescribed displacements the last line is used.

#include <algorithm>
#include <iterator>
#include <map>
#include <unordered_map>

#include "deck/deck_state.h"

namespace {

enum Replace { KEEP, AT_ONCE, BY_RAMP };      // action on a load of the previous step

// Loads replaced by the lines of a step
struct Replaced {
  std::unordered_map<long, Replace> dof;      // node*3 + direction
  std::unordered_map<long, Replace> face;     // (element*6 + face)*2 + kind
  std::map<int, Replace> surface[2];          // [kind] surfaces of bodies of points
  std::map<std::string, Replace> volume;      // Load::key
};

int kind_of(const Load& l) { return l.kind == LOAD_TRACTION ? 1 : 0; }
long face_key(const Load& l, const Face& f) { return (f.elem * 6L + f.face) * 2 + kind_of(l); }
bool on_body(const Model& m, const Load& l) { return l.surface >= 0 && m.surface[l.surface].body >= 0; }

bool ramps(const Step& s, const Expr& value, int amplitude)
{
  return s.proc == PROC_STATIC && amplitude < 0 && value.is_const();
}

bool ramps(const Step& s, const Load& l)
{
  return l.of_position ? s.proc == PROC_STATIC && l.amplitude < 0 : ramps(s, l.value, l.amplitude);
}

template <class Key, class Table>
void mark(Table& table, const Key& key, Replace r)
{
  Replace& now = table[key];
  now = std::max(now, r);
}

template <class Key, class Table>
Replace find(const Table& table, const Key& key)
{
  const auto at = table.find(key);
  return at == table.end() ? KEEP : at->second;
}

Replaced replaced_by(const Model& m, const Step& s)
{
  Replaced out;
  for (const Load& l : s.load) {
    const Replace r = ramps(s, l) ? BY_RAMP : AT_ONCE;
    if (l.kind == LOAD_BODY) mark(out.volume, l.key, r);
    else if (on_body(m, l)) mark(out.surface[kind_of(l)], l.surface, r);
    for (int n : l.node) mark(out.dof, n * 3L + l.dof, r);
    for (const Face& f : l.face) mark(out.face, face_key(l, f), r);
  }
  return out;
}

// An amplitude in step time ends with its step: its last value becomes a factor
void end_amplitude(const Model& m, double period, double time, double& factor, int& amplitude, bool any)
{
  if (amplitude < 0 || (m.amplitude[amplitude].total_time && !any)) return;
  factor *= amplitude_eval(m.amplitude[amplitude], period, time);
  amplitude = -1;
}

// keeps the items with action(item) == KEEP; moves items with BY_RAMP to fading
template <class Item, class Action>
void split_items(std::vector<Item>& item, std::vector<Item>& fading, Action action)
{
  std::size_t k = 0;
  for (const Item& x : item) {
    const Replace r = action(x);
    if (r == KEEP) item[k++] = x;
    else if (r == BY_RAMP) fading.push_back(x);
  }
  item.resize(k);
}

// a load on a surface of a body is replaced where another loaded surface of the body overlaps it
void split_surfaces(const Model& m, const Load& l, const Replaced& r, Load& kept, std::vector<Load>& out)
{
  for (const auto& other : r.surface[kind_of(l)]) {
    if (other.first == l.surface || m.surface[other.first].body != m.surface[l.surface].body) continue;
    kept.except.push_back(other.first);
    if (other.second != BY_RAMP) continue;
    out.push_back(l);
    out.back().only.push_back(other.first);
  }
}

// splits a load of the previous step into a kept part and a part that is ramped down
//   in   removed   OP=NEW: all of it is removed, by a ramp unless it is replaced at once
void inherit_load(const Model& m, const Load& l, const Replaced& r, bool removed, bool is_static,
             std::vector<Load>& kept, std::vector<Load>& fading)
{
  const auto action = [&](Replace x) { return x == KEEP && removed ? BY_RAMP : x; };
  Load stay = l, leave = l;
  stay.ramp = RAMP_NONE;
  std::vector<Load> leaving;
  if (l.kind == LOAD_BODY || on_body(m, l)) {
    const Replace now = l.kind == LOAD_BODY ? find(r.volume, l.key) : find(r.surface[kind_of(l)], l.surface);
    const Replace x   = action(now);
    if (x == KEEP && on_body(m, l)) split_surfaces(m, l, r, stay, leaving);
    if (x == KEEP) kept.push_back(stay);
    if (x == BY_RAMP) leaving.push_back(leave);
  } else {
    leave.node.clear();
    leave.face.clear();
    split_items(stay.node, leave.node, [&](int n) { return action(find(r.dof, n * 3L + l.dof)); });
    split_items(stay.face, leave.face, [&](const Face& f) { return action(find(r.face, face_key(l, f))); });
    if (stay.node.size() + stay.face.size() > 0) kept.push_back(stay);
    if (leave.node.size() + leave.face.size() > 0) leaving.push_back(leave);
  }
  if (!is_static) return;
  for (Load& g : leaving) {
    g.ramp = RAMP_OUT;
    fading.push_back(g);
  }
}

// two ascending lists have a common item
bool intersect(const IntVec& a, const IntVec& b)
{
  IntVec both;
  std::set_intersection(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(both));
  return !both.empty();
}

// warns of a volume load that adds to one of an earlier step on the same elements or bodies
void warn_repeated(Deck& d, const Step& s, const std::vector<Load>& kept)
{
  for (const Load& l : s.load)
    for (const Load& old : kept) {
      if (l.kind != LOAD_BODY || old.kind != LOAD_BODY || l.per_mass != old.per_mass) continue;
      if (!l.per_mass && l.dir != old.dir) continue;
      if (!intersect(l.body, old.body) && !intersect(l.elem, old.elem)) continue;
      warn(d, l.keyword, l.deck_line, "", "adds to the load of " + old.deck_line.file +
           text_format(" line %d: a volume load is replaced only ", old.deck_line.line) +
           "by one with the same target and direction; OP=NEW removes all");
      break;
    }
}

// warns of loads with the same target and direction in one step
void warn_added(Deck& d, const Step& s)
{
  std::map<std::string, const Load*> loads;
  for (const Load& l : s.load) {
    const auto first = loads.emplace(l.key, &l);
    if (first.second) continue;
    d.word = l.keyword;
    const DeckLine& at = first.first->second->deck_line;
    deck_warn(d, deck_field(d, l.deck_line, ""),
              "adds to the load of " + at.file + text_format(" line %d", at.line) +
                  " with the same target and direction in this step");
  }
}

// replaces the list of element faces by a surface, which follows elements that become points
void give_surface(Model& m, Load& l)
{
  if (l.face.empty()) return;
  const auto one  = [](const Face& a, const Face& b) { return a.elem == b.elem && a.face == b.face; };
  const auto same = [&](const Surface& s) {
    return s.body < 0 && s.face.size() == l.face.size() &&
           std::equal(s.face.begin(), s.face.end(), l.face.begin(), one);
  };
  if (l.surface < 0 || !same(m.surface[l.surface])) {
    const auto at = std::find_if(m.surface.begin(), m.surface.end(), same);
    l.surface = static_cast<int>(at - m.surface.begin());
    if (at == m.surface.end()) {
      Surface s;
      s.face  = l.face;
      s.deck_line = l.deck_line;
      m.surface.push_back(s);
    }
  }
  l.face.clear();
}

void inherit_loads(Deck& d, Model& m)
{
  std::vector<Load> acting;
  double time = 0.0, period = 0.0;
  for (Step& s : m.step)
    for (Load& l : s.load)
      if (l.surface >= 0) l.face = m.surface[l.surface].face;
  for (std::size_t k = 0; k < m.step.size(); ++k) {
    Step& s = m.step[k];
    const bool is_static = s.proc == PROC_STATIC;
    const Replaced r = replaced_by(m, s);
    std::vector<Load> kept, fading;
    for (Load& l : acting) {
      if (l.ramp == RAMP_OUT) continue;
      end_amplitude(m, period, time, l.factor, l.amplitude, false);
      const bool removed = l.kind == LOAD_NODE ? d.removes[k].cload : d.removes[k].dload;
      inherit_load(m, l, r, removed, is_static, kept, fading);
    }
    for (Load& l : fading) {
      end_amplitude(m, period, time, l.factor, l.amplitude, true);
      l.hold = time;
    }
    warn_added(d, s);
    warn_repeated(d, s, kept);
    for (Load& l : s.load) l.ramp = ramps(s, l) ? RAMP_IN : RAMP_NONE;
    kept.insert(kept.end(), fading.begin(), fading.end());
    kept.insert(kept.end(), s.load.begin(), s.load.end());
    acting = kept;
    s.load.swap(kept);
    period = s.period;
    time += s.period;
  }
  for (Step& s : m.step)
    for (Load& l : s.load) give_surface(m, l);
}

// of several lines for a node and direction the last one is used; two values in one step give a warning
void drop_replaced(Deck& d, const Model& m, std::vector<Prescribed>& list, std::size_t first_new)
{
  std::vector<int> last(3 * m.mesh.node_label.size(), -1);
  for (std::size_t k = list.size(); k-- > 0;) {
    Prescribed& b = list[k];
    IntVec node;
    int other = -1, at = -1;
    for (int n : b.node) {
      int& l = last[3 * static_cast<std::size_t>(n) + b.first];
      if (l < 0) {
        l = static_cast<int>(k);
        node.push_back(n);
      } else if (other < 0 && k >= first_new && l != static_cast<int>(k) && !deck_same_value(b, list[l])) {
        other = l;
        at    = n;
      }
    }
    b.node.swap(node);
    if (other < 0) continue;
    warn(d, "BOUNDARY", list[other].deck_line, "",
        text_format("replaces the value of line %d for node %d, direction %d in this step; the last value "
               "is used",
               b.deck_line.line, m.mesh.node_label[at], b.first + 1));
  }
  const auto empty = [](const Prescribed& b) { return b.node.empty(); };
  list.erase(std::remove_if(list.begin(), list.end(), empty), list.end());
}

void inherit_supports(Deck& d, Model& m)
{
  std::vector<Prescribed> acting;
  double time = 0.0, period = 0.0;
  for (std::size_t k = 0; k < m.step.size(); ++k) {
    Step& s = m.step[k];
    if (k == 0) {
      acting = d.base;
      drop_replaced(d, m, acting, 0);
    }
    for (Prescribed& b : acting) {
      b.ramp = k == 0 && !b.velocity && ramps(s, b.value, b.amplitude);
      if (k > 0) end_amplitude(m, period, time, b.factor, b.amplitude, false);
    }
    if (d.removes[k].boundary) acting.clear();
    const std::size_t before = acting.size();
    for (Prescribed& b : s.prescribed) b.ramp = !b.velocity && ramps(s, b.value, b.amplitude);
    acting.insert(acting.end(), s.prescribed.begin(), s.prescribed.end());
    drop_replaced(d, m, acting, before);
    s.prescribed = acting;
    period = s.period;
    time += s.period;
  }
}

}  // namespace

bool deck_same_value(const Prescribed& a, const Prescribed& b)
{
  return expr_same(a.value, b.value) && a.amplitude == b.amplitude && a.velocity == b.velocity;
}

bool deck_same_value(const InitialValue& a, const InitialValue& b)
{
  return expr_same(a.value, b.value) && a.displacement == b.displacement;
}

void deck_load(Deck& d, Model& m, const char* keyword, const std::string& key, const Field& at, Load load)
{
  load.keyword = keyword;
  load.key     = std::string(keyword) + " " + key;
  for (double n : load.dir) load.key += " " + text_number(n);
  load.deck_line = deck_line_of(d, at);
  m.step.back().load.push_back(std::move(load));
}

// ---------------------------------------------------------------------------
// deck_inherit : adds loads and supports of earlier steps to each step
// ---------------------------------------------------------------------------
void deck_inherit(Deck& d, Model& m)
{
  d.removes.resize(m.step.size());
  inherit_loads(d, m);
  inherit_supports(d, m);
}
