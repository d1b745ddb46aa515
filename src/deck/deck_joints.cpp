// Initial cracks whose elements touch one another only by a node

#include <algorithm>
#include <map>

#include "deck/deck_state.h"

namespace {

// State of an element at the start
enum CrackState { CRACK_NONE, CRACK_BROKEN, CRACK_REMOVED };

// Elements at a node that are connected across faces at this node
struct NodeFan {
  IntVec elem;
  double volume = 0.0;
  bool may_break = true;
};

// A node at which a crack touches itself, or a surface, and intact material joins both sides
struct CrackJoint {
  int node = -1;
  IntVec elem;                 // all elements of the node
  std::vector<NodeFan> fan;
  const BrokenDef* crack = nullptr;        // null: of removed elements
};

bool share_face(const Mesh& mesh, int dim, int a, int b)
{
  int n = 0;
  for (int i = 0; i < mesh.conn.count(a); ++i)
    for (int j = 0; j < mesh.conn.count(b); ++j) n += mesh.conn.begin(a)[i] == mesh.conn.begin(b)[j];
  return n >= dim;
}

// of the box around an element: to compare neighbours
double box_volume(const Mesh& mesh, int dim, int e)
{
  BoundingBox b;
  deck_box_element(b, mesh, e);
  double v = 1.0;
  for (int i = 0; i < dim; ++i) v *= b.hi[i] - b.lo[i];
  return v;
}

std::vector<NodeFan> intact_fans(const Model& m, const IntVec& at, const IntVec& state,
                                 const IntVec& breakable)
{
  std::vector<NodeFan> out;
  IntVec seen;
  const auto is_new = [&](int e) {
    return state[e] == CRACK_NONE && m.mesh.elem_section[e] >= 0 &&
           std::find(seen.begin(), seen.end(), e) == seen.end();
  };
  for (int first : at) {
    if (!is_new(first)) continue;
    NodeFan fan;
    fan.elem.push_back(first);
    seen.push_back(first);
    for (std::size_t k = 0; k < fan.elem.size(); ++k) {
      const int e = fan.elem[k];
      fan.volume += box_volume(m.mesh, m.dim, e);
      fan.may_break = fan.may_break && breakable[e];
      for (int o : at)
        if (is_new(o) && share_face(m.mesh, m.dim, e, o)) {
          fan.elem.push_back(o);
          seen.push_back(o);
        }
    }
    out.push_back(fan);
  }
  return out;
}

// the nodes of elements that are cracked at the start where intact material joins both sides
std::vector<CrackJoint> find_joints(const Model& m, const IntVec& state, const IntVec& breakable)
{
  std::map<int, std::vector<int>> at;                // elements of the nodes of cracked elements
  for (int e = 0; e < m.mesh.nelem(); ++e)
    for (int a = 0; a < m.mesh.conn.count(e) && state[e] != CRACK_NONE; ++a) at[m.mesh.conn.begin(e)[a]];
  for (int e = 0; e < m.mesh.nelem(); ++e)
    for (int a = 0; a < m.mesh.conn.count(e); ++a) {
      const auto found = at.find(m.mesh.conn.begin(e)[a]);
      if (found != at.end()) found->second.push_back(e);
    }
  std::map<int, const BrokenDef*> crack_of;
  for (const BrokenDef& b : m.broken)
    for (int e : b.elem)
      if (!b.remove) crack_of[e] = &b;
  std::vector<CrackJoint> out;
  for (const auto& [node, elem] : at) {
    CrackJoint j;
    j.node = node;
    j.elem = elem;
    j.fan  = intact_fans(m, elem, state, breakable);
    bool breaks = false;
    for (int e : elem) {
      breaks = breaks || (state[e] == CRACK_NONE && breakable[e]);
      if (state[e] == CRACK_BROKEN && !j.crack) j.crack = crack_of[e];
    }
    if (j.fan.size() > 1 && breaks) out.push_back(j);
  }
  return out;
}

// relative difference of equal volumes (no test)
const double EQUAL_FANS = 1e-6;

// distance of the centre of a fan from its node, along the normal of the crack
double fan_side(const Model& m, const CrackJoint& j, const NodeFan& f)
{
  double side = 0.0;
  for (int e : f.elem)
    for (int a = 0; a < m.mesh.conn.count(e); ++a)
      for (int i = 0; i < 3; ++i)
        side += j.crack->normal[i] * (m.mesh.X[3 * static_cast<std::size_t>(m.mesh.conn.begin(e)[a]) + i] -
                                      m.mesh.X[3 * static_cast<std::size_t>(j.node) + i]) /
                (m.mesh.conn.count(e) * static_cast<double>(f.elem.size()));
  return side;
}

// elements that open a joint: those of the smallest fan in which all may break, of equal ones that on the
// side of the normal: a crack that is a line of corners becomes a staircase
IntVec joint_opens(const Model& m, const CrackJoint& j)
{
  const NodeFan* best = nullptr;
  for (const NodeFan& f : j.fan) {
    if (!f.may_break) continue;
    const double more = best ? f.volume - best->volume : -1.0, same = EQUAL_FANS * f.volume;
    if (more < -same || (more <= same && fan_side(m, j, f) > fan_side(m, j, *best))) best = &f;
  }
  return best ? best->elem : IntVec();
}

void warn_joint(Deck& d, const Model& m, const CrackJoint& j, const BrokenDef& b, std::size_t n)
{
  warn(d, b.remove ? "MODEL CHANGE" : "INITIAL CONDITIONS", b.deck_line, "",
       text_format("these elements touch one another, or a surface, by a node only at %d nodes, the first of "
                   "them node %d, which holds both sides of the crack together: give the elements beside "
                   "it too, so that they touch by faces", static_cast<int>(n), m.mesh.node_label[j.node]));
}

}  // namespace

// ---------------------------------------------------------------------------
// deck_joints : elements of initial cracks that touch only by a node do not open: adds elements beside it to
// the crack
// ---------------------------------------------------------------------------
void deck_joints(Deck& d, Model& m)
{
  if (m.fracture.empty() || m.broken.empty()) return;
  IntVec state(m.mesh.nelem(), CRACK_NONE), breakable(m.mesh.nelem(), 0), added;
  for (const FractureDef& f : m.fracture)
    if (f.elset >= 0 && f.criterion == CRITERION_GRIFFITH)
      for (int e : m.elset[f.elset].item) breakable[e] = 1;
  for (const BrokenDef& b : m.broken)
    for (int e : b.elem) state[e] = b.remove ? CRACK_REMOVED : std::max<int>(state[e], CRACK_BROKEN);
  std::vector<CrackJoint> left;
  std::vector<BrokenDef> more;
  for (bool again = true; again;) {
    again = false;
    left.clear();
    for (CrackJoint& j : find_joints(m, state, breakable)) {
      if (!more.empty()) j.fan = intact_fans(m, j.elem, state, breakable);       // others have opened
      if (j.fan.size() < 2) continue;
      const IntVec opens = j.crack ? joint_opens(m, j) : IntVec();
      if (opens.empty()) left.push_back(j);
      BrokenDef b;
      if (j.crack) b = *j.crack;
      b.elem.clear();
      for (int e : opens)
        if (state[e] == CRACK_NONE) b.elem.push_back(e);
      for (int e : b.elem) state[e] = CRACK_BROKEN;
      added.insert(added.end(), b.elem.begin(), b.elem.end());
      if (!b.elem.empty()) more.push_back(b);
    }
    again = !more.empty();
    m.broken.insert(m.broken.end(), more.begin(), more.end());
    more.clear();
  }
  const auto of = [&](bool remove) {
    return *std::find_if(m.broken.begin(), m.broken.end(),
                         [&](const BrokenDef& b) { return b.remove == remove; });
  };
  if (!added.empty())
    warn(d, "INITIAL CONDITIONS", of(false).deck_line, "",
         text_format("elements of the crack touch one another, or a surface, by a node only, which would "
                     "hold both sides together: %d elements beside such nodes are broken from the start as "
                     "well, the first of them element %d",
                     static_cast<int>(added.size()), m.mesh.elem_label[added[0]]));
  if (!left.empty()) warn_joint(d, m, left[0], of(!left[0].crack), left.size());
}
