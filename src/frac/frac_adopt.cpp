#include <algorithm>

#include "base/comm.h"
#include "frac/frac.h"
#include "model/model_cut.h"
#include "model/state_io.h"
#include "model/state_number.h"
#include "model/state_window.h"

namespace {

// rows of elements around those that become points, which all ranks get at once. One is needed; more of them,
// and pieces grow less often
const int ROWS = 4;

// nodes of the keys of shared corners
template <class Node>
void renumber(Node node, CornerShare& s)
{
  const auto with = [&](CornerKey key) {
    for (auto& k : key) k.first = node(static_cast<int>(k.first));
    return key;
  };
  CornerShare out;
  for (const auto& [name, corner] : s.corner)
    out.corner.emplace(std::make_pair(name.first, with(name.second)), corner);
  for (const auto& [key, corner] : s.own) out.own.emplace(with(key), corner);
  s.corner.swap(out.corner);
  s.own.swap(out.own);
  for (int& n : s.node.item) n = node(n);
}

// where the Gauss points of the elements of before are now; those of others get their history when their
// elements become points
ArchiveMove move_gauss(const Mesh& mesh, const IntVec& elem)
{
  const auto gauss = [&](int e) {
    return mesh.elem_section[e] < 0 ? 0 : shape_info[elem_table[mesh.elem_type[e]].shape].ngp;
  };
  IntVec first(1, 0);
  for (int e = 0; e < mesh.nelem(); ++e) first.push_back(first.back() + gauss(e));
  ArchiveMove move;
  for (int e : elem)
    for (int g = 0; g < gauss(e); ++g) move.place.push_back(first[e] + g);
  move.count = first.back();
  return move;
}

}  // namespace

bool frac_zone(const Model& m, const IntVec& elem, IntVec& give)
{
  const MeshPart& part = m.part;
  const Mesh& mesh     = m.mesh;
  RealVec mark(mesh.nnode(), 0.0);
  const auto mark_nodes = [&](const IntVec& list) {
    for (int e : list)
      for (int i = mesh.conn.off[e]; i < mesh.conn.off[e + 1]; ++i) mark[mesh.conn.item[i]] = 1.0;
  };
  mark_nodes(elem);
  IntVec zone;
  for (int row = 0; row < ROWS; ++row) {
    halo_sum(part.halo, 1, mark);
    zone.clear();
    for (int e = 0; e < mesh.nelem(); ++e)
      if (part.works(e) && std::any_of(mesh.conn.begin(e), mesh.conn.begin(e) + mesh.conn.count(e),
                                       [&](int n) { return mark[n] > 0.0; }))
        zone.push_back(e);
    const bool known = std::all_of(zone.begin(), zone.end(), [&](int e) { return part.given[e]; });
    if (row == 0 && !comm_allreduce_max(static_cast<int>(!known))) return false;
    mark_nodes(zone);
  }
  give.clear();
  for (int e : zone)
    if (!part.given[e]) give.push_back(e);
  return true;
}

IntVec frac_gone(const Fracture& fr)
{
  IntVec gone;
  for (int phase : fr.phase) gone.push_back(phase != AS_ELEMENT);
  return gone;
}

ModelGrowth frac_grow(const IntVec& give, const std::vector<State*>& state, const std::vector<Level*>& level,
                      Model& m)
{
  const ModelGrowth g = model_grow(give, frac_gone(state[0]->frac), m);
  std::vector<ArchiveMove> move(ARCHIVE_KINDS);
  move[PER_NODE] = {g.node, m.part.node.size(), &m.part.halo};
  move[PER_ELEM] = {g.elem, m.part.elem.size(), &m.part.around};
  move[PER_GAUSS] = move_gauss(m.mesh, g.elem);
  Archive f;
  f.move = move.data();
  for (State* st : state) io(f, *st);
  for (Level* l : level) io(f, *l);
  return g;
}

IntVec frac_releasing(const Model& m, const Fracture& fr)
{
  struct Broken { double time; int number; };
  std::vector<Broken> all;
  for (int e : fr.releasing)
    if (m.part.works(e)) all.push_back({fr.time[e], m.part.elem_number(e)});
  comm_allgatherv(all);
  std::sort(all.begin(), all.end(), [](const Broken& a, const Broken& b) {
    return a.time != b.time ? a.time < b.time : a.number < b.number;
  });
  IntVec list;
  for (const Broken& b : all) list.push_back(b.number);
  return list;
}

ModelGrowth frac_adopt(const IntVec& give, const std::vector<State*>& state,
                       const std::vector<Level*>& level, const std::vector<CornerShare*>& share, Model& m)
{
  for (State* st : state) {
    IntVec releasing = frac_releasing(m, st->frac);  // also those that this rank gets
    state_to_deck(m.part, *st);
    st->frac.releasing.swap(releasing);
  }
  for (CornerShare* s : share) renumber([&](int n) { return m.part.node[n]; }, *s);
  const ModelGrowth g = frac_grow(give, state, level, m);
  for (State* st : state) state_from_deck(m.part, *st);
  for (CornerShare* s : share) renumber([&](int n) { return m.part.node_here(n); }, *s);
  return g;
}

void frac_renew(const Model& m, const ModelGrowth& g, Fracture& fr, Elements& el, FracMesh& fm)
{
  int worst = -1;
  const RealVec notch = fm.notch;
  MPFE_CHECK(elem_setup(m, el, &worst) == STATUS_OK, "an element that was good is not");
  frac_mesh(m, el, fm);
  if (!notch.empty()) fm.notch.assign(m.part.elem.size(), 0.0);
  for (size_t e = 0; e < notch.size(); ++e) fm.notch[g.elem[e]] = notch[e];
  el.frac = &fr;
  elem_refresh(el);
}

namespace {

bool reload_window(const Points& begin, State& st, Model& m, const FracMesh& fm)
{
  st.points.part = PointPart();          // points and corners of all ranks
  state_from_deck(m.part, st);
  bool good = st.frac.phase.size() == m.part.elem.size() || st.frac.empty();
  if (m.part.points || state_in_parts(m, st)) good = good && frac_take(m, fm, begin, st);
  else st.points.part = begin.part;
  if (comm_allreduce_max(static_cast<int>(!good))) return false;
  point_surfaces(m, st.points);
  if (!st.frac.empty()) model_owners(frac_gone(st.frac), m);
  if (st.frac.nconverted > 0) point_find_common(m.part, point_ranks(m.part, st.points), st.points);
  bond_share(m, st.points, st.bonds);
  st.np1 = st.n;
  return true;
}

}  // namespace

bool frac_reload(const Points& begin, State& st, Model& m, Elements& el, FracMesh& fm)
{
  if (!m.part.on) return true;
  if (m.part.window) return reload_window(begin, st, m, fm);
  IntVec points, give;
  for (int e = 0; e < static_cast<int>(st.frac.phase.size()); ++e)
    if (st.frac.phase[e] == AS_POINTS && m.part.works(e)) points.push_back(e);
  const bool any = !m.conversion.empty() && st.frac.phase.size() == m.part.elem.size();
  if (comm_allreduce_max(static_cast<int>(!any)) == 0 && frac_zone(m, points, give)) {
    const ModelGrowth g = frac_grow(give, {&st}, {}, m);
    st.np1 = st.n;
    frac_renew(m, g, st.frac, el, fm);
  }
  state_from_deck(m.part, st);
  if (any) model_owners(frac_gone(st.frac), m);
  return true;
}

void frac_gather(const Model& m, const Fracture& fr, IntVec& elem, size_t first)
{
  struct Due { double time; int number; };
  std::vector<Due> all;
  for (size_t k = first; k < elem.size(); ++k) all.push_back({fr.time[elem[k]], m.part.elem_number(elem[k])});
  if (m.part.on) comm_allgatherv(all);
  std::sort(all.begin(), all.end(), [](const Due& a, const Due& b) {
    return a.time != b.time ? a.time < b.time : a.number < b.number;
  });
  elem.resize(first);
  for (const Due& d : all) elem.push_back(d.number);
}
