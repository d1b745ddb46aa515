#include "model/model_cut.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "base/forest.h"
#include "base/gather_lists.h"
#include "base/picked.h"

namespace {

// [surface] 1: with halo elements, for bonds, contact or conversion
IntVec outer_surfaces(const Model& m)
{
  return m.conversion.empty() ? model_bonded_surfaces(m) : IntVec(m.surface.size(), 1);
}

// [elset] 1: its elements are material points of the deck, with halo elements
IntVec outer_elsets(const Model& m)
{
  IntVec outer(m.elset.size(), 0);
  for (const Body& b : m.body)
    if (b.fill == FILL_ELSET) outer[b.elset] = 1;
  return outer;
}

// calls use(side) for the sides of the rules of general contact
template <class Bond, class Use>
void each_side(Bond& d, Use use)
{
  for (auto* list : {&d.contact.include, &d.contact.exclude, &d.contact.property})
    for (auto& rule : *list) {
      use(rule.a);
      use(rule.b);
    }
}

// Sorts the items of a list by rank, in their order. The list is empty afterwards.
//   ranks_of(item)   first and last rank of the item
template <class T, class RanksOf>
OfRanks<T> divide(std::vector<T>& list, int ranks, RanksOf ranks_of)
{
  OfRanks<T> out;
  out.off.assign(ranks + 1, 0);
  for (const T& x : list)
    for (auto [r, last] = ranks_of(x); r != last; ++r) ++out.off[*r + 1];
  std::partial_sum(out.off.begin(), out.off.end(), out.off.begin());
  out.item.resize(out.off.back());
  IntVec next(out.off);
  for (const T& x : list)
    for (auto [r, last] = ranks_of(x); r != last; ++r) out.item[next[*r]++] = x;
  std::vector<T>().swap(list);
  return out;
}

// groups of nodes connected by equations, directly or indirectly
ListTable tied_nodes(const std::vector<Equation>& equation, int nnode)
{
  ListTable out;
  if (equation.empty()) return out;
  Forest groups(nnode);
  std::map<int, std::set<int>> group;
  const auto each = [&](auto use) {
    for (const Equation& e : equation)
      for (const EquationTerm& t : e.term) use(t.node, e.term[0].node);
  };
  each([&](int n, int first) { groups.join(n, first); });
  each([&](int n, int) { group[groups.root(n)].insert(n); });
  for (const auto& g : group) {
    out.item.insert(out.item.end(), g.second.begin(), g.second.end());
    out.off.push_back(static_cast<int>(out.item.size()));
  }
  return out;
}

// groups of tied nodes of each rank: those with a node of its elements; all: every group, since pieces grow.
// Groups without elements belong to the first rank.
OfRanks<int> groups_of(const Mesh& mesh, const OfRanks<int>& elem, const ListTable& tied, bool all)
{
  OfRanks<int> out;
  out.off.assign(elem.off.size(), 0);
  if (tied.size() == 0) return out;
  IntVec seen(mesh.nnode(), -1);
  for (int n : mesh.conn.item) seen[n] = -2;
  const auto has = [&](int g, int mark) {
    return std::any_of(tied.begin(g), tied.begin(g + 1), [&](int n) { return seen[n] == mark; });
  };
  std::vector<char> in_mesh(tied.size());
  for (int g = 0; g < tied.size(); ++g) in_mesh[g] = has(g, -2);
  for (int r = 0; r + 1 < static_cast<int>(elem.off.size()); ++r) {
    each_node(mesh, elem, r, [&](int n) { seen[n] = r; });
    for (int g = 0; g < tied.size(); ++g)
      if (all || (in_mesh[g] ? has(g, r) : r == 0)) out.item.push_back(g);
    out.off[r + 1] = static_cast<int>(out.item.size());
  }
  return out;
}

// nodes of the elements and groups of each rank; other nodes belong to the first one
OfRanks<int> nodes_of(const Mesh& mesh, const OfRanks<int>& elem, const ListTable& tied,
                      const OfRanks<int>& group)
{
  OfRanks<int> out;
  IntVec seen(mesh.nnode(), -1);
  for (const IntVec* list : {&mesh.conn.item, &tied.item})
    for (int n : *list) seen[n] = -2;
  for (int n = 0; n < mesh.nnode(); ++n)
    if (seen[n] == -1) out.item.push_back(n);
  out.off.push_back(0);
  for (int r = 0; r + 1 < static_cast<int>(elem.off.size()); ++r) {
    const auto take = [&](int n) {
      if (seen[n] != r) out.item.push_back(n);
      seen[n] = r;
    };
    each_node(mesh, elem, r, take);
    for (int k = group.off[r]; k < group.off[r + 1]; ++k)
      std::for_each(tied.begin(group.item[k]), tied.begin(group.item[k] + 1), take);
    std::sort(out.item.begin() + out.off[r], out.item.end());
    out.off.push_back(static_cast<int>(out.item.size()));
  }
  return out;
}

// ranks of each of the n nodes or elements, ascending
ListTable ranks_of(int n, const OfRanks<int>& list)
{
  return gather_lists(n, [&](auto use) {
    for (int r = 0; r + 1 < static_cast<int>(list.off.size()); ++r)
      for (int k = list.off[r]; k < list.off[r + 1]; ++k) use(list.item[k], r);
  });
}

// lists by rank, with the ranks of their nodes and elements
PieceLists divide_lists(const Mesh& mesh, const ModelLists& lists, const OfRanks<int>& node,
                        const OfRanks<int>& elem)
{
  PieceLists out;
  const int ranks = static_cast<int>(elem.off.size()) - 1;
  const ListTable near = ranks_of(mesh.nnode(), node), by = ranks_of(mesh.nelem(), elem);
  const auto of_node = [&](int n) { return std::make_pair(near.begin(n), near.begin(n + 1)); };
  const auto of_elem = [&](int e) { return std::make_pair(by.begin(e), by.begin(e + 1)); };
  const auto of_item = [&](const auto& x) { return of_elem(x.elem); };
  for (IntVec* list : lists.node) out.node.push_back(divide(*list, ranks, of_node));
  for (IntVec* list : lists.elem) out.elem.push_back(divide(*list, ranks, of_elem));
  for (std::vector<Face>* list : lists.face) out.face.push_back(divide(*list, ranks, of_item));
  for (std::vector<Member>* list : lists.member) out.member.push_back(divide(*list, ranks, of_item));
  return out;
}

// own and halo elements of each rank
OfRanks<int> with_outer(const OfRanks<int>& elem, const OfRanks<int>& outer)
{
  OfRanks<int> out;
  out.off.push_back(0);
  for (std::size_t r = 0; r + 1 < elem.off.size(); ++r) {
    std::merge(elem.item.begin() + elem.off[r], elem.item.begin() + elem.off[r + 1],
               outer.item.begin() + outer.off[r], outer.item.begin() + outer.off[r + 1],
               std::back_inserter(out.item));
    out.off.push_back(static_cast<int>(out.item.size()));
  }
  return out;
}

IntVec items(const OfRanks<int>& all, int r)
{
  return IntVec(all.item.begin() + all.off[r], all.item.begin() + all.off[r + 1]);
}

IntVec items(const OfRanks<int>& all, int r, const IntVec& index)
{
  IntVec out = items(all, r);
  for (int& k : out) k = index[k];
  return out;
}

// faces or members, with the index of their element in the piece
template <class T>
std::vector<T> items(const OfRanks<T>& all, int r, const IntVec& index)
{
  std::vector<T> out(all.item.begin() + all.off[r], all.item.begin() + all.off[r + 1]);
  for (T& x : out) x.elem = index[x.elem];
  return out;
}

void take_lists(const PieceLists& from, int r, const IntVec& node_index, const IntVec& elem_index,
                const ModelLists& to)
{
  for (std::size_t k = 0; k < to.node.size(); ++k) *to.node[k] = items(from.node[k], r, node_index);
  for (std::size_t k = 0; k < to.elem.size(); ++k) *to.elem[k] = items(from.elem[k], r, elem_index);
  for (std::size_t k = 0; k < to.face.size(); ++k) *to.face[k] = items(from.face[k], r, elem_index);
  for (std::size_t k = 0; k < to.member.size(); ++k) *to.member[k] = items(from.member[k], r, elem_index);
}

// equations and directions of the nodes of this piece; before: of the whole model
void take_equations(Model& m)
{
  const std::vector<Equation> equation = std::move(m.equation);
  const std::vector<Frame> frame       = std::move(m.frame);
  IntVec index(equation.size(), -1);
  m.equation.clear();
  m.frame.clear();
  for (std::size_t k = 0; k < equation.size(); ++k) {
    if (m.part.node_here(equation[k].term[0].node) < 0) continue;        // all its nodes or none
    index[k] = static_cast<int>(m.equation.size());
    m.equation.push_back(equation[k]);
    for (EquationTerm& t : m.equation.back().term) t.node = m.part.node_here(t.node);
  }
  for (Step& s : m.step) {
    for (int& k : s.equation) k = index[k];
    s.equation.erase(std::remove(s.equation.begin(), s.equation.end(), -1), s.equation.end());
  }
  for (Frame f : frame) {
    f.node = m.part.node_here(f.node);
    if (f.node < 0) continue;
    if (f.twin >= 0) f.equation = index[f.equation];
    if (f.twin >= 0) f.twin = m.part.node_here(f.twin);
    m.frame.push_back(f);
  }
}

// rigid bodies of this piece, which has all of their nodes, since equations connect them
void take_rigid(Model& m)
{
  const std::vector<RigidBody> rigid = std::move(m.rigid);
  m.rigid.clear();
  for (RigidBody b : rigid) {
    for (int* n : {&b.ref, &b.turn}) *n = m.part.node_here(*n);
    if (b.ref < 0) continue;
    for (int& n : b.node) n = m.part.node_here(n);
    m.rigid.push_back(b);
  }
}

Mesh cut_mesh(const Mesh& old, const MeshPart& part, const IntVec& node_index)
{
  Mesh mesh;
  std::size_t corners = 0;
  for (int e : part.elem) corners += static_cast<std::size_t>(old.conn.count(e));
  mesh.X.reserve(3 * part.node.size());
  mesh.conn.item.reserve(corners);
  mesh.conn.off.reserve(part.elem.size() + 1);
  for (int n : part.node) {
    const double* x = &old.X[3 * static_cast<std::size_t>(n)];
    mesh.X.insert(mesh.X.end(), x, x + 3);
  }
  for (int e : part.elem) {
    for (int i = old.conn.off[e]; i < old.conn.off[e + 1]; ++i)
      mesh.conn.item.push_back(node_index[old.conn.item[i]]);
    mesh.conn.off.push_back(static_cast<int>(mesh.conn.item.size()));
  }
  mesh.node_label   = picked(part.node, 1, old.node_label);
  mesh.elem_label   = picked(part.elem, 1, old.elem_label);
  mesh.elem_type    = picked(part.elem, 1, old.elem_type);
  mesh.elem_section = picked(part.elem, 1, old.elem_section);
  return mesh;
}

// Claims of this rank on shared nodes [Halo::shared]: rank; rank + ranks if an element of it that is not gone
// has the node; -1: halo elements alone
IntVec claims(const Model& m, const IntVec& gone)
{
  const MeshPart& part = m.part;
  const int me = comm_rank(), ranks = comm_size();
  IntVec claim(part.node.size(), -1);
  std::vector<char> elsewhere(part.node.size(), 0);
  for (std::size_t e = 0; e < part.elem.size(); ++e)
    for (int i = m.mesh.conn.off[e]; i < m.mesh.conn.off[e + 1]; ++i) {
      const int n = m.mesh.conn.item[i];
      if (!part.works(static_cast<int>(e))) elsewhere[n] = 1;
      else claim[n] = std::max(claim[n], m.mesh.elem_section[e] >= 0 && !gone[e] ? me + ranks : me);
    }
  IntVec shared;
  for (int n : part.halo.shared) shared.push_back(claim[n] < 0 && !elsewhere[n] ? me : claim[n]);
  return shared;
}

// elements whose points several ranks store
void find_around_points(MeshPart& part)
{
  IntVec known;
  std::vector<long> key;
  for (std::size_t e = 0; e < part.elem.size(); ++e)
    if (part.with_points[e]) {
      known.push_back(static_cast<int>(e));
      key.push_back(part.elem[e]);
    }
  halo_form(key, part.around_points);
  halo_renumber(known, part.around_points);
  part.around_points.owner = part.rank;
}

// index of a number in a list that ascends from its first number to the largest and continues with the
// smallest; -1: not found
int find_number(const IntVec& list, int number)
{
  if (list.empty()) return -1;
  const auto wrap = std::partition_point(list.begin(), list.end(), [&](int x) { return x >= list.front(); });
  const bool high = number >= list.front();
  const auto end  = high ? wrap : list.end(), at = std::lower_bound(high ? list.begin() : wrap, end, number);
  return at != end && *at == number ? static_cast<int>(at - list.begin()) : -1;
}

// [ranks] first of the nodes with elements of this rank and of no lower rank
IntVec first_nodes(const Mesh& mesh, const OfRanks<int>& own)
{
  IntVec first(own.off.size() - 1, mesh.nnode());
  std::vector<char> taken(mesh.nnode(), 0);
  for (std::size_t r = 0; r < first.size(); ++r)
    each_node(mesh, own, static_cast<int>(r), [&](int n) {
      if (!taken[n]) first[r] = std::min(first[r], n);
      taken[n] = 1;
    });
  return first;
}

}  // namespace

IntVec model_bonded_surfaces(const Model& m)
{
  IntVec bonded(m.surface.size(), 0);
  for (const BondDef& d : m.bond) {
    for (int s : {d.surface, d.contact.master})
      if (s >= 0) bonded[s] = 1;
    each_side(d, [&](const ContactSide& side) { if (side.surface >= 0) bonded[side.surface] = 1; });
  }
  return bonded;
}

IntVec model_removed(const Model& m)
{
  IntVec removed(m.mesh.nelem(), 0);
  for (const BrokenDef& b : m.broken)
    for (int e : b.elem) removed[e] = b.remove;
  return removed;
}

int MeshPart::elem_here(int number) const { return on ? find_number(elem, number) : number; }

int MeshPart::node_here(int number) const { return on ? find_number(node, number) : number; }

ModelCut model_cut_open(Model& whole, const IntVec& rank, const OfRanks<int>& outer, int ranks)
{
  ModelCut c;
  c.rest = std::move(whole);
  whole  = Model();
  std::swap(c.mesh, c.rest.mesh);
  std::swap(c.deck, c.rest.part.deck);
  c.rank = rank;
  for (ConversionDef& d : c.rest.conversion) d.elem = c.rest.elset[d.elset].item;
  for (BondDef& d : c.rest.bond)
    each_side(d, [&](ContactSide& side) { if (side.elset >= 0) side.elem = c.rest.elset[side.elset].item; });
  const IntVec bonded = model_bonded_surfaces(c.rest);
  for (std::size_t s = 0; s < bonded.size(); ++s) {
    Surface& of = c.rest.surface[s];
    for (std::size_t k = 0; k < of.face.size() && bonded[s]; ++k)
      of.member.push_back({of.face[k].elem, static_cast<int>(k)});
  }
  for (FractureDef& f : c.rest.fracture)
    for (std::size_t k = 0; f.elset >= 0 && k < c.rest.elset[f.elset].item.size(); ++k)
      f.member.push_back({c.rest.elset[f.elset].item[k], static_cast<int>(k)});
  IntVec all(c.mesh.nelem());
  std::iota(all.begin(), all.end(), 0);
  const OfRanks<int> own = divide(all, ranks, [&](int e) { return std::make_pair(&rank[e], &rank[e] + 1); });
  c.elem = outer.item.empty() ? own : with_outer(own, outer);
  const ListTable tied     = tied_nodes(c.rest.equation, c.mesh.nnode());
  const OfRanks<int> group = groups_of(c.mesh, c.elem, tied, !c.rest.conversion.empty());
  c.rest.part.tied = tied.size() > 0;
  c.node = nodes_of(c.mesh, own, tied, group);
  if (!c.deck.empty()) c.first = first_nodes(c.mesh, own);
  c.work = divide_lists(c.mesh, model_lists_of_work(c.rest), c.node, own);
  if (!outer.item.empty()) c.node = nodes_of(c.mesh, c.elem, tied, group);
  c.all = divide_lists(c.mesh, model_lists_of_all(c.rest), c.node, c.elem);
  c.elem_index.resize(c.mesh.nelem());
  c.node_index.resize(c.mesh.nnode());
  return c;
}

Model model_cut_piece(ModelCut& c, int r)
{
  Model m = c.rest;
  m.part.on    = true;
  m.part.nnode = c.mesh.nnode();
  m.part.nelem = c.mesh.nelem();
  m.part.node  = items(c.node, r);
  if (!c.first.empty())
    std::rotate(m.part.node.begin(), std::lower_bound(m.part.node.begin(), m.part.node.end(), c.first[r]),
                m.part.node.end());
  m.part.elem  = items(c.elem, r);
  for (int n : m.part.node) m.part.deck.push_back(c.deck.empty() ? n : c.deck[n]);
  for (int e : m.part.elem) m.part.rank.push_back(c.rank[e]);
  for (std::size_t d = 0; d < m.bond.size() && !c.present.empty(); ++d)
    m.bond[d].contact.present = c.present[r][d];
  if (!c.point.empty()) m.part.near_point = c.point[r];
  if (!c.notch.empty()) m.part.notch = picked(m.part.elem, 1, c.notch);
  if (m.part.window) {
    const auto first = c.near.item.begin() + c.near.off[r], last = c.near.item.begin() + c.near.off[r + 1];
    for (int e : m.part.elem)
      m.part.with_points.push_back(c.rank[e] == r || std::binary_search(first, last, e));
  }
  for (std::size_t k = 0; k < m.part.node.size(); ++k) c.node_index[m.part.node[k]] = static_cast<int>(k);
  for (std::size_t k = 0; k < m.part.elem.size(); ++k) c.elem_index[m.part.elem[k]] = static_cast<int>(k);
  m.mesh = cut_mesh(c.mesh, m.part, c.node_index);
  take_equations(m);
  take_rigid(m);
  take_lists(c.work, r, c.node_index, c.elem_index, model_lists_of_work(m));
  take_lists(c.all, r, c.node_index, c.elem_index, model_lists_of_all(m));
  return m;
}

ModelLists model_lists_of_work(Model& m)
{
  ModelLists l;
  const IntVec outer = outer_surfaces(m);
  for (Set& s : m.nset) l.node.push_back(&s.item);
  const IntVec of_points = outer_elsets(m);
  for (std::size_t s = 0; s < m.elset.size(); ++s)
    if (!of_points[s]) l.elem.push_back(&m.elset[s].item);
  for (std::size_t s = 0; s < m.surface.size(); ++s)
    if (!outer[s]) l.face.push_back(&m.surface[s].face);
  for (Step& s : m.step)
    for (Load& load : s.load) {
      l.node.push_back(&load.node);
      if (m.conversion.empty()) l.elem.push_back(&load.elem);
      l.face.push_back(&load.face);
    }
  return l;
}

ModelLists model_lists_of_all(Model& m)
{
  ModelLists l;
  const IntVec outer = outer_surfaces(m), of_points = outer_elsets(m);
  for (std::size_t s = 0; s < m.elset.size(); ++s)
    if (of_points[s]) l.elem.push_back(&m.elset[s].item);
  for (std::size_t s = 0; s < m.surface.size(); ++s)
    if (outer[s]) l.face.push_back(&m.surface[s].face);
  for (Surface& s : m.surface) l.member.push_back(&s.member);
  for (Step& s : m.step)
    for (Load& load : s.load)
      if (!m.conversion.empty()) l.elem.push_back(&load.elem);
  for (ConversionDef& c : m.conversion) l.elem.push_back(&c.elem);
  for (InitialValue& v : m.initial) l.node.push_back(&v.node);
  for (Step& s : m.step)
    for (Prescribed& b : s.prescribed) l.node.push_back(&b.node);
  for (BrokenDef& b : m.broken) l.elem.push_back(&b.elem);
  for (InitialStress& s : m.initial_stress) l.elem.push_back(&s.elem);
  for (Step& s : m.step)
    for (ModelChange& c : s.change) l.elem.push_back(&c.elem);
  for (FractureDef& f : m.fracture) l.member.push_back(&f.member);
  l.face.push_back(&m.part.skin);
  for (BondDef& d : m.bond)
    each_side(d, [&](ContactSide& side) { l.elem.push_back(&side.elem); });
  return l;
}

void model_owners(const IntVec& gone, Model& m)
{
  MeshPart& part = m.part;
  const int ranks = comm_size();
  const IntVec shared = claims(m, gone);
  IntVec claim(part.node.size(), comm_rank());
  std::vector<long> key;
  IntVec index;
  for (std::size_t k = 0; k < shared.size(); ++k) {
    const int n = part.halo.shared[k];
    claim[n]    = shared[k];
    if (shared[k] < ranks) continue;
    key.push_back(part.node[n]);
    index.push_back(n);
  }
  Halo moving;
  halo_form(key, moving);
  for (std::size_t k = 0; k < index.size(); ++k) claim[index[k]] = moving.owner[k] + ranks;
  std::vector<IntVec> send(ranks);
  for (int r = 0; r < ranks; ++r)
    for (int n : part.halo.common[r]) send[r].push_back(claim[n]);
  const std::vector<IntVec> received = comm_exchange(send);
  for (int r = 0; r < ranks; ++r)
    for (std::size_t k = 0; k < received[r].size(); ++k) {
      int& owner = claim[part.halo.common[r][k]];
      owner = std::max(owner, received[r][k]);
    }
  for (std::size_t n = 0; n < claim.size(); ++n) part.halo.owner[n] = claim[n] % ranks;
}

void model_find_common(const IntVec& gone, Model& m)
{
  MeshPart& part = m.part;
  const int me   = comm_rank();
  halo_form(std::vector<long>(part.node.begin(), part.node.end()), part.halo);
  model_owners(gone, m);
  const bool outer = std::any_of(part.rank.begin(), part.rank.end(), [&](int r) { return r != me; });
  if (comm_allreduce_max(static_cast<int>(outer)) == 0) return;
  halo_form(std::vector<long>(part.elem.begin(), part.elem.end()), part.around);
  part.around.owner = part.rank;
  if (part.window) find_around_points(part);
}

// Pieces exchange numbers with their neighbours until nothing changes, once for each rank that a part
// extends to.
void model_join_ranks(const MeshPart& part, const PointPart& points, const Halo& other, IntVec& root)
{
  const int nnode = static_cast<int>(part.node.size()), n = static_cast<int>(root.size()),
            others = n - static_cast<int>(other.owner.size());
  const auto number = [&](int i) {
    const int c = i - nnode;
    return c < 0 ? part.node[i] : part.nnode + (points.corner.empty() ? c : points.corner[c]);
  };
  IntVec least(n, std::numeric_limits<int>::max()), before;
  for (int i = 0; i < others; ++i) least[root[i]] = std::min(least[root[i]], number(i));
  const auto exchange = [&](const Halo& h, int first) {  // items that others have too, from first on
    if (!h.on()) return;
    std::vector<IntVec> to(comm_size());
    for (int r = 0; r < comm_size(); ++r)
      for (int i : h.common[r]) to[r].push_back(least[root[first + i]]);
    const std::vector<IntVec> from = comm_exchange(to);
    for (int r = 0; r < comm_size(); ++r)
      for (std::size_t k = 0; k < from[r].size(); ++k) {
        int& name = least[root[first + h.common[r][k]]];
        name = std::min(name, from[r][k]);
      }
  };
  do {
    before = least;
    exchange(part.halo, 0);
    exchange(points.halo, nnode);
    exchange(other, others);
  } while (comm_allreduce_max(static_cast<int>(least != before)));
  for (int& r : root) r = least[r];
}

// ---------------------------------------------------------------------------
// model_cut_close : shared nodes and elements, and their owners. A load at a node counts on its owner; all
// other loads belong to their element.
// ---------------------------------------------------------------------------
void model_cut_close(Model& m)
{
  model_find_common(model_removed(m), m);
}
