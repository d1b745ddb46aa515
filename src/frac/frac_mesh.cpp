#include <algorithm>
#include <array>
#include <cmath>

#include "base/weibull.h"
#include "frac/frac.h"
#include "frac/free_face.h"
#include "shape/shape.h"

namespace {

const int MAX_BINS = 2000;    // in a direction: limits the memory of empty bins of distant parts  (no test)

void find_sizes(const Model& m, const Elements& el, FracMesh& fm)
{
  const int nelem = m.mesh.nelem();
  fm.centre.assign(3 * static_cast<size_t>(nelem), 0.0);
  fm.volume.assign(nelem, 0.0);
  fm.thickness.assign(nelem, 1.0);
  fm.size.assign(nelem, 0.0);
  for (int e = 0; e < nelem; ++e) {
    const int n = m.mesh.conn.count(e), *node = m.mesh.conn.begin(e);
    for (int a = 0; a < n; ++a)
      for (int i = 0; i < 3; ++i) fm.centre[3 * e + i] += m.mesh.X[3 * node[a] + i] / n;
    if (el.initial_block[e] < 0) continue;
    const ElemBlock& b    = el.block[el.initial_block[e]];
    fm.volume[e] = elem_volume(b, el.slot_of[e]);
    fm.size[e]   = elem_size(b, el.slot_of[e]);
    if (m.dim == 2) fm.thickness[e] = b.thickness;
  }
}

// adjacent element at each face
void find_across(const Model& m, FracMesh& fm)
{
  struct Side { std::array<int, 4> node; int e, f; };
  std::vector<Side> all;
  const int nelem = m.mesh.nelem();
  fm.across.assign(6 * static_cast<size_t>(nelem), -1);
  fm.across_face.assign(6 * static_cast<size_t>(nelem), -1);
  for (int e = 0; e < nelem; ++e) {
    const ShapeInfo& s = shape_info[elem_table[m.mesh.elem_type[e]].shape];
    for (int f = 0; f < s.nface; ++f) {
      Side side{{{-1, -1, -1, -1}}, e, f};
      for (int a = 0; a < s.nfnode[f]; ++a) side.node[a] = m.mesh.conn.begin(e)[s.face[f][a]];
      std::sort(side.node.begin(), side.node.end());
      all.push_back(side);
    }
  }
  std::stable_sort(all.begin(), all.end(), [](const Side& a, const Side& b) { return a.node < b.node; });
  for (size_t i = 0; i + 1 < all.size(); ++i) {
    const Side &a = all[i], &b = all[i + 1];
    if (a.node != b.node) continue;
    fm.across[6 * a.e + a.f]      = b.e;
    fm.across_face[6 * a.e + a.f] = b.f;
    fm.across[6 * b.e + b.f]      = a.e;
    fm.across_face[6 * b.e + b.f] = a.f;
  }
}

void find_local(FracMesh& fm)
{
  fm.local = fm.size;
  for (size_t e = 0; e < fm.size.size(); ++e) {
    double sum = fm.size[e], count = 1.0;
    for (int f = 0; f < 6; ++f) {
      const int o = fm.across[6 * e + f];
      if (o < 0 || fm.size[o] == 0.0) continue;
      sum += fm.size[o];
      count += 1.0;
    }
    fm.local[e] = sum / count;
  }
}

void find_bins(const Model& m, FracMesh& fm)
{
  const int nelem = m.mesh.nelem();
  double hi[3], mean = 0.0;
  for (int i = 0; i < 3; ++i) fm.lo[i] = hi[i] = nelem > 0 ? fm.centre[i] : 0.0;
  for (int e = 0; e < nelem; ++e) {
    mean += fm.size[e] / nelem;
    for (int i = 0; i < 3; ++i) {
      fm.lo[i] = std::min(fm.lo[i], fm.centre[3 * e + i]);
      hi[i]    = std::max(hi[i], fm.centre[3 * e + i]);
    }
  }
  fm.bin = mean > 0.0 ? 2.0 * mean : 1.0;            // a rank may own points only
  long cells = 1;
  for (int i = 0; i < 3; ++i) {
    fm.nbin[i] = std::min(MAX_BINS, static_cast<int>((hi[i] - fm.lo[i]) / fm.bin) + 1);
    cells *= fm.nbin[i];
  }
  for (int i = 0; i < 3; ++i) fm.bin = std::max(fm.bin, (hi[i] - fm.lo[i]) / fm.nbin[i] * (1.0 + 1e-12));
  std::vector<IntVec> in(cells);
  for (int e = 0; e < nelem; ++e) {
    int c[3];
    for (int i = 0; i < 3; ++i)
      c[i] = std::min(fm.nbin[i] - 1, static_cast<int>((fm.centre[3 * e + i] - fm.lo[i]) / fm.bin));
    in[(c[2] * fm.nbin[1] + c[1]) * fm.nbin[0] + c[0]].push_back(e);
  }
  fm.in_bin = ListTable();
  for (const IntVec& list : in) {
    fm.in_bin.item.insert(fm.in_bin.item.end(), list.begin(), list.end());
    fm.in_bin.off.push_back(static_cast<int>(fm.in_bin.item.size()));
  }
}

// travel time of a Rayleigh wave over a length; c_R/c_s = (0.862 + 1.14 nu)/(1 + nu) to 0.5 %; without
// density: 0
double rayleigh_time(const Elements& el, int e, double length)
{
  const ElemBlock& b = el.block[el.initial_block[e]];
  // plane stress: nu/(1 + nu), as lam is reduced
  const double nu    = b.law.lam / (2.0 * (b.law.lam + b.law.mu));
  return length * std::sqrt(b.density / b.law.mu) * (1.0 + nu) / (0.862 + 1.14 * nu);
}

// toughness of each element: mean Gc, with a Weibull distribution
void find_toughness(const Model& m, const Elements& el, const FractureDef& d, int def, FracMesh& fm)
{
  const auto members = model_members(m, d);
  IntVec at;
  for (const Member& x : members) at.push_back(x.at);
  const RealVec gc = d.weibull > 0.0 ? weibull_draw(d.weibull, d.gc, d.seed, at) : RealVec(at.size(), d.gc);
  for (size_t k = 0; k < at.size(); ++k) {
    const int e = members[k].elem;
    if (fm.size[e] == 0.0) continue;
    fm.def[e] = def;
    fm.gc[e]  = gc[k];
    const double part = fm.volume[e] / fm.thickness[e];
    // (7.15), (7.26)
    fm.release[e] = rayleigh_time(el, e, d.release * (m.dim == 2 ? std::sqrt(part) : std::cbrt(part)));
    fm.average[e] = rayleigh_time(el, e, d.average * fm.size[e]);
  }
}

// do the materials of two elements differ?
bool differ(const Elements& el, const FracMesh& fm, int a, int b)
{
  return frac_other_material(el, a, b) || fm.thickness[a] != fm.thickness[b];
}

// is a node between materials? Not with an element without section
bool is_between(const Elements& el, const FracMesh& fm, int node)
{
  const int n = fm.of_node.count(node), *elem = fm.of_node.begin(node);
  bool mixed = false;
  for (int k = 0; k < n; ++k) {
    if (el.initial_block[elem[k]] < 0) return false;
    mixed = mixed || differ(el, fm, elem[0], elem[k]);
  }
  return mixed;
}

// length of the mean normal of the faces of an interface at a node; less: a bend of 120 degrees or more
// (theory 7.1)  (no test)
const double INTERFACE = 0.5;

// mean normal of the interface faces at a node, from the smaller block number to the larger
void interface_normal(const Model& m, const Elements& el, const FracMesh& fm, int node, double* n)
{
  double length = 0.0;
  n[0] = n[1] = n[2] = 0.0;
  for (int k = 0; k < fm.of_node.count(node); ++k) {
    const int e = fm.of_node.begin(node)[k], block = el.initial_block[e];
    for (int f = 0; f < shape_info[el.block[block].shape].nface; ++f) {
      const int o = fm.across[6 * e + f];
      if (o < 0 || block >= el.initial_block[o] || !differ(el, fm, e, o)) continue;
      const FreeFace face = free_face(m.mesh, e, f, false);
      if (std::find(face.node, face.node + face.n, node) == face.node + face.n) continue;
      for (int i = 0; i < 3; ++i) n[i] += face.area[i];
      length += std::hypot(face.area[0], face.area[1], face.area[2]);
    }
  }
  const double sum = std::hypot(n[0], n[1], n[2]);
  for (int i = 0; i < 3; ++i) n[i] = sum > INTERFACE * length ? n[i] / sum : 0.0;
}

void find_interfaces(const Model& m, const Elements& el, FracMesh& fm)
{
  if (m.fracture.empty() || el.block.size() < 2) return;
  for (int node = 0; node < m.mesh.nnode(); ++node) {
    if (!is_between(el, fm, node)) continue;
    double n[3];
    interface_normal(m, el, fm, node, n);
    fm.between.push_back(node);
    fm.between_normal.insert(fm.between_normal.end(), n, n + 3);
  }
}

}  // namespace

bool frac_other_material(const Elements& el, int a, int b)
{
  const MatLaw &x = el.block[el.initial_block[a]].law, &y = el.block[el.initial_block[b]].law;
  return x.mu != y.mu || x.lam3 != y.lam3 || x.kind != y.kind;
}

ListTable frac_of_node(const Mesh& mesh)
{
  ListTable out;
  IntVec next(mesh.nnode() + 1, 0);
  for (int n : mesh.conn.item) ++next[n + 1];
  for (int n = 0; n < mesh.nnode(); ++n) next[n + 1] += next[n];
  out.off = next;
  out.item.resize(mesh.conn.item.size());
  for (int e = 0; e < mesh.nelem(); ++e)
    for (int k = mesh.conn.off[e]; k < mesh.conn.off[e + 1]; ++k) out.item[next[mesh.conn.item[k]]++] = e;
  return out;
}

int frac_mesh(const Model& m, const Elements& el, FracMesh& fm)
{
  fm    = FracMesh();
  fm.on = !m.fracture.empty() || !m.conversion.empty();
  if (!fm.on) return 0;
  const int nelem = m.mesh.nelem();
  find_sizes(m, el, fm);
  find_across(m, fm);
  find_local(fm);
  find_bins(m, fm);
  fm.of_node = frac_of_node(m.mesh);
  find_interfaces(m, el, fm);
  fm.def.assign(nelem, -1);
  fm.conv.assign(nelem, -1);
  fm.gc.assign(nelem, 0.0);
  fm.release.assign(nelem, 0.0);
  fm.average.assign(nelem, 0.0);
  for (size_t d = 0; d < m.fracture.size(); ++d)
    find_toughness(m, el, m.fracture[d], static_cast<int>(d), fm);
  if (m.part.around.on()) halo_copy(m.part.around, 1, fm.release);
  for (size_t c = 0; c < m.conversion.size(); ++c)
    for (int e : m.part.on ? m.conversion[c].elem : m.elset[m.conversion[c].elset].item)
      fm.conv[e] = static_cast<int>(c);
  return 0;
}

void frac_begin(const Model& m, const FracMesh& fm, Fracture& fr, Level& l)
{
  fr = Fracture();
  if (!fm.on && m.broken.empty() && !model_changes(m)) return;
  const int nelem = m.mesh.nelem();
  fr.phase.assign(nelem, AS_ELEMENT);
  fr.broken.assign(nelem, -1);
  fr.time.assign(nelem, -1.0);
  l.degr.assign(nelem, 1.0);
  fr.normal.assign(3 * static_cast<size_t>(nelem), 0.0);
  for (const BrokenDef& b : m.broken)
    for (int e : b.elem) {
      if (b.remove) {
        fr.phase[e] = AS_NOTHING;
        continue;
      }
      const int c = fm.conv[e];
      if (c >= 0 && m.conversion[c].trigger == TRIGGER_EROSION && fr.broken[e] < 0) fr.releasing.push_back(e);
      fr.broken[e] = fm.def[e];
      fr.time[e]   = 0.0;
      l.degr[e]    = m.fracture[fm.def[e]].stiffness;
      for (int i = 0; i < 3; ++i) fr.normal[3 * static_cast<size_t>(e) + i] = b.normal[i];
    }
  std::sort(fr.releasing.begin(), fr.releasing.end());
  frac_count_releasing(m, fr);
}
