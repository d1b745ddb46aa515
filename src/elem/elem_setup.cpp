#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <tuple>
#include <unordered_map>

#include "base/comm.h"
#include "base/hash.h"
#include "base/log.h"
#include "elem/elem.h"
#include "mat/law.h"
#include "model/lumped.h"
#include "shape/shape.h"

namespace {

using BlockKey = std::tuple<int, int, double, bool, int>;

// fracture definition of cohesive elements, -1: others                                      [nelem]
IntVec cohesive_elements(const Model& m)
{
  IntVec def(m.mesh.nelem(), -1);
  for (size_t d = 0; d < m.fracture.size(); ++d) {
    if (m.fracture[d].criterion != CRITERION_COHESIVE) continue;
    for (const Member& x : model_members(m, m.fracture[d])) def[x.elem] = static_cast<int>(d);
  }
  return def;
}

//   in   cohesive   definition, -1: none
ElemBlock& block_for(const Model& m, Elements& el, std::map<BlockKey, int>& known, int e, int cohesive)
{
  const Section& s = m.section[m.mesh.elem_section[e]];
  const int type   = m.mesh.elem_type[e];
  const auto key   = std::make_tuple(type, s.material, s.thickness, s.lumped, cohesive);
  auto it          = known.find(key);
  if (it == known.end()) {
    it = known.emplace(key, static_cast<int>(el.block.size())).first;
    const Material& mat = m.material[s.material];
    ElemBlock b;
    b.type      = type;
    b.shape     = elem_table[type].shape;
    b.law       = mat_law(mat, elem_table[type].plane);
    if (cohesive >= 0) {
      b.law.kind  = law_flows(mat.law) ? LAW_COHESIVE_FLOW : LAW_COHESIVE;
      b.law.c     = m.fracture[cohesive].stiffness;
      b.law.crack = crack_of(m.fracture[cohesive]);
    }
    b.density   = mat.density;
    b.alpha     = mat.alpha;
    b.thickness = s.thickness;
    b.lumped    = s.lumped;
    b.bar       = b.law.bar && !elem_table[type].enhanced && shape_info[b.shape].ngp > 1 &&
                  !shape_quadratic(b.shape);
    b.general   = b.law.kind != LAW_SVK || b.bar || (b.law.initial >= 0 && !b.enhanced_start());
    el.block.push_back(b);
  }
  el.block_of[e] = it->second;
  return el.block[it->second];
}

// relative to the size of an element: round-off of coordinates; equal elements share one kind  (no test)
const double COORDINATE_TOL = 1e-12;

// Kinds found so far, by the nodal coordinates relative to the first node, coarsely rounded
struct Kinds {
  std::unordered_map<std::uint64_t, IntVec> bucket;
  RealVec rel;                 // [kind][nen*dim] coordinates relative to the first node
};

double size_of(const double* rel, int n)
{
  double size = 0.0;
  for (int k = 0; k < n; ++k) size = std::max(size, std::fabs(rel[k]));
  return size;
}

// the kind of an element with these relative coordinates [n]; fresh: a new one
int kind_of(Kinds& k, const double* rel, int n, bool& fresh)
{
  const double size = size_of(rel, n);
  int exponent;
  std::frexp(size, &exponent);
  std::uint64_t key = hash_start;
  for (int i = 0; i < n; ++i)
    key = hash_mix(key, static_cast<std::uint64_t>(std::llround(std::ldexp(rel[i], 20 - exponent))));
  IntVec& list = k.bucket[key];
  fresh = false;
  for (int c : list) {
    bool same = true;
    for (int i = 0; i < n; ++i)
      same = same && std::fabs(k.rel[static_cast<size_t>(c) * n + i] - rel[i]) <= COORDINATE_TOL * size;
    if (same) return c;
  }
  fresh = true;
  list.push_back(static_cast<int>(k.rel.size()) / n);
  k.rel.insert(k.rel.end(), rel, rel + n);
  return list.back();
}

// Cohesive pyramids: bricks of six pyramids around a common apex open as a brick, and each pyramid has the
// width of the brick; that of the pyramid alone is half of it where the base lies across the crack
// (test: strength/bar_3d.inp), with type=5
const int BRICK_PYRAMIDS = 6, BRICK_NODES = 8;

// nodes between which a crack of this element measures its width: pyramids have those of a brick
int width_nodes(int shape) { return shape == SHAPE_PYR5 ? BRICK_NODES : shape_info[shape].nen; }

// pyramids at each node that is an apex and nothing else; others 0. Halo elements complete the neighbours of
// a rank's own elements                                                                   [nnode]
IntVec pyramids_at_apex(const Mesh& mesh, const IntVec& cohesive)
{
  IntVec count;
  const auto pyramid = [&](int e) { return elem_table[mesh.elem_type[e]].shape == SHAPE_PYR5; };
  const auto cracks  = [&](int e) { return cohesive[e] >= 0 && pyramid(e); };
  bool any = false;
  for (int e = 0; e < mesh.nelem() && !any; ++e) any = cracks(e);
  if (!any) return count;
  count.assign(mesh.nnode(), 0);
  for (int e = 0; e < mesh.nelem(); ++e)
    if (mesh.elem_section[e] >= 0 && pyramid(e)) ++count[mesh.conn.begin(e)[4]];
  for (int e = 0; e < mesh.nelem(); ++e)
    for (int a = 0; a < mesh.conn.count(e); ++a)
      if (!(pyramid(e) && a == 4)) count[mesh.conn.begin(e)[a]] = 0;
  return count;
}

// nodes of the width from those of the element, rel [nen*dim]. Pyramids: the base, and its mirror image at
// the apex (of_brick) or the apex
void append_width_nodes(int shape, const double* rel, bool of_brick, RealVec& out)
{
  const ShapeInfo& info = shape_info[shape];
  if (shape != SHAPE_PYR5) {
    out.insert(out.end(), rel, rel + info.nen * info.dim);
    return;
  }
  const double* apex = rel + 12;
  out.insert(out.end(), rel, apex);
  for (int k = 0; k < 12; ++k) out.push_back(of_brick ? 2.0 * apex[k % 3] - rel[k] : apex[k % 3]);
}

// gradients, weights, enhanced modes and mass of a new kind. false: det(dX/dxi) <= 0 at a Gauss point
bool add_kind(ElemBlock& b, const double* X)
{
  const ShapeInfo& info = shape_info[b.shape];
  const GaussRule& rule = gauss_rule(b.shape);
  const double depth    = info.dim == 2 ? b.thickness : 1.0;
  double N[MAX_NODES], dN[3 * MAX_NODES], dNdX[3 * MAX_NODES], me[pair_count(MAX_NODES)];
  for (int g = 0; g < rule.n; ++g) {
    shape_eval(b.shape, rule.xi[g], N, dN);
    const double det = shape_jacobian(b.shape, dN, X, dNdX);
    if (!(det > 0.0)) return false;
    b.w.push_back(det * rule.w[g] * depth);
    b.dNdX.insert(b.dNdX.end(), dNdX, dNdX + info.nen * info.dim);
  }
  elem_mass_form(b, X, me);
  b.me.insert(b.me.end(), me, me + pair_count(info.nen));
  if (!elem_table[b.type].enhanced) return true;
  b.eas.resize(b.eas.size() + eas_size(b.shape));
  eas_setup(b.shape, X, &b.w[b.w.size() - rule.n], b.law, &b.eas[b.eas.size() - eas_size(b.shape)]);
  return true;
}

// order of the elements in the blocks: as in the mesh; in a divided model by their smallest node number, in
// the order of the rows (model_order_nodes)
IntVec block_order(const Model& m)
{
  const Mesh& mesh = m.mesh;
  IntVec order(mesh.nelem()), first;
  std::iota(order.begin(), order.end(), 0);
  if (!m.part.on) return order;
  for (int e = 0; e < mesh.nelem(); ++e)
    first.push_back(*std::min_element(mesh.conn.begin(e), mesh.conn.begin(e) + mesh.conn.count(e)));
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return first[a] < first[b]; });
  return order;
}

}  // namespace

Status elem_setup(const Model& m, Elements& el, int* worst)
{
  const Mesh& mesh = m.mesh;
  std::map<BlockKey, int> known;
  const IntVec cohesive = cohesive_elements(m), apex = pyramids_at_apex(mesh, cohesive);
  std::vector<Kinds> kinds;    // [block]
  el = Elements();
  el.block_of.assign(mesh.nelem(), -1);
  el.slot_of.assign(mesh.nelem(), -1);
  el.gauss_of.assign(1, 0);
  el.history = law_history(m);
  if (m.part.around.on())
    for (int e = 0; e < mesh.nelem(); ++e) el.outer.push_back(!m.part.works(e));
  for (int e = 0; e < mesh.nelem(); ++e) {
    const bool is = mesh.elem_section[e] >= 0;
    const int points = is ? shape_info[block_for(m, el, known, e, cohesive[e]).shape].ngp : 0;
    el.gauss_of.push_back(el.gauss_of[e] + points);
  }
  kinds.resize(el.block.size());
  for (int e : block_order(m)) {
    if (mesh.elem_section[e] < 0) continue;
    ElemBlock& b          = el.block[el.block_of[e]];
    const ShapeInfo& info = shape_info[b.shape];
    const int* node       = mesh.conn.begin(e);
    const bool pyramid    = b.shape == SHAPE_PYR5 && !apex.empty(),
               of_brick   = pyramid && apex[node[4]] == BRICK_PYRAMIDS;
    double X[3 * MAX_NODES], rel[3 * MAX_NODES + 1];
    for (int a = 0; a < info.nen; ++a)
      for (int i = 0; i < info.dim; ++i) {
        X[a * info.dim + i]   = mesh.X[3 * node[a] + i];
        rel[a * info.dim + i] = mesh.X[3 * node[a] + i] - mesh.X[3 * node[0] + i];
      }
    bool fresh;
    el.slot_of[e] = static_cast<int>(b.elem.size());
    b.elem.push_back(e);
    if (m.part.on) b.conn.insert(b.conn.end(), node, node + info.nen);
    const int n = info.nen * info.dim;
    rel[n] = of_brick ? size_of(rel, n) : 0.0;           // pyramids of bricks and others differ in width
    b.kind.push_back(kind_of(kinds[el.block_of[e]], rel, n + pyramid, fresh));
    if (!fresh) continue;
    if (b.opens()) append_width_nodes(b.shape, rel, of_brick, b.node_offset);
    if (add_kind(b, X)) continue;
    *worst = e;
    return BAD_JACOBIAN;
  }
  el.initial_block = el.block_of;
  elem_refresh(el);
  return STATUS_OK;
}

void elem_scatter(const Model& m, const RealVec& gc, Elements& el)
{
  const IntVec def = cohesive_elements(m);
  for (ElemBlock& b : el.block)
    if (b.opens() && m.fracture[def[b.elem[0]]].weibull > 0.0)
      for (int e : b.elem) b.scatter.push_back(gc[e] / b.law.crack.gc);
}

double elem_volume(const ElemBlock& b, size_t slot)
{
  double volume = 0.0;
  for (int g = 0; g < shape_info[b.shape].ngp; ++g) volume += b.w[b.gauss(slot) + g];
  return volume;
}

double elem_size(const ElemBlock& b, size_t slot)
{
  const ShapeInfo& info = shape_info[b.shape];
  const double cube     = elem_volume(b, slot) / (info.dim == 2 ? b.thickness : 1.0) * info.cube_parts;
  return info.dim == 2 ? std::sqrt(cube) : std::cbrt(cube);
}

MatLaw elem_law(const Model& m, const Elements& el, const ElemBlock& b, size_t slot, double c)
{
  const int e = b.elem[slot], def = el.broken(e);
  MatLaw law = b.law;
  if (def >= 0) law = law_broken(b.law, m.fracture[def], c, &el.frac->normal[3 * static_cast<size_t>(e)]);
  if (!b.opens() || !law_opens(law.kind)) return law;
  law.crack.nodes = width_nodes(b.shape);
  law.crack.dim   = shape_info[b.shape].dim;
  law.crack.X = &b.node_offset[static_cast<size_t>(b.kind[slot]) * law.crack.nodes * law.crack.dim];
  if (!b.scatter.empty()) law.crack.scatter = b.scatter[slot];
  return law;
}

const double* elem_mass(const ElemBlock& b, int slot)
{
  return &b.me[static_cast<size_t>(b.kind[slot]) * pair_count(shape_info[b.shape].nen)];
}

void elem_mass_form(const ElemBlock& b, const double* X, double* me)
{
  const ShapeInfo& info = shape_info[b.shape];
  shape_mass(b.shape, X, b.density * (info.dim == 2 ? b.thickness : 1.0), me);
  if (b.lumped) lump_mass(info.nen, me);
}

void elem_refresh(Elements& el)
{
  for (ElemBlock& b : el.block) b.live.clear();
  for (size_t e = 0; e < el.initial_block.size(); ++e) {
    const bool is = el.initial_block[e] >= 0 && (el.outer.empty() || !el.outer[e]) &&
                    (!el.frac || el.frac->phase[e] == AS_ELEMENT);
    el.block_of[e] = is ? el.initial_block[e] : -1;
    if (is) el.block[el.initial_block[e]].live.push_back(el.slot_of[e]);
  }
  for (ElemBlock& b : el.block)
    if (!std::is_sorted(b.live.begin(), b.live.end())) std::sort(b.live.begin(), b.live.end());
}

void elem_rigid(const Model& m, const Step& step, Elements& el)
{
  const bool turns = !m.rigid.empty() && step.explicit_steps() && step.nlgeom;
  if (turns != el.rigid.empty()) return;             // unchanged
  el.rigid.clear();
  if (!turns) return;
  IntVec body(m.mesh.nnode(), -1);
  for (size_t b = 0; b < m.rigid.size(); ++b) {
    for (int n : m.rigid[b].node) body[n] = static_cast<int>(b);
    if (body[m.rigid[b].ref] < 0) body[m.rigid[b].ref] = static_cast<int>(b);
  }
  el.rigid.assign(m.mesh.nelem(), 0);
  for (int e = 0; e < m.mesh.nelem(); ++e) {
    const int *node = m.mesh.conn.begin(e), first = body[node[0]];
    el.rigid[e] =
        first >= 0 && std::all_of(node, node + m.mesh.conn.count(e), [&](int n) { return body[n] == first; });
  }
}
