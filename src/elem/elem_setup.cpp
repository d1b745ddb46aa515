#include <map>
#include <tuple>

#include "elem/elem.h"
#include "shape/shape.h"

namespace {

ElemBlock& block_for(const Model& m, Elements& el, std::map<std::tuple<int, int, double, bool>, int>& known, int e)
{
  const Section& s = m.section[m.mesh.elem_section[e]];
  const int type   = m.mesh.elem_type[e];
  const auto key   = std::make_tuple(type, s.material, s.thickness, s.lumped);
  auto it          = known.find(key);
  if (it == known.end()) {
    it = known.emplace(key, static_cast<int>(el.block.size())).first;
    const Material& mat = m.material[s.material];
    ElemBlock b;
    b.type      = type;
    b.shape     = elem_table[type].shape;
    b.law       = mat_law(mat, elem_table[type].plane);
    b.density   = mat.density;
    b.thickness = s.thickness;
    b.lumped    = s.lumped;
    el.block.push_back(b);
  }
  el.block_of[e] = it->second;
  return el.block[it->second];
}

// m [pairs a >= b]: the sums of the rows on the diagonal
void lump(int nen, double* m)
{
  double row[8] = {0};
  for (int a = 0, k = 0; a < nen; ++a)
    for (int b = 0; b <= a; ++b, ++k) {
      row[a] += m[k];
      if (b < a) row[b] += m[k];
      m[k] = 0.0;
    }
  for (int a = 0; a < nen; ++a) m[a * (a + 3) / 2] = row[a];
}

}  // namespace

Status elem_setup(const Model& m, Elements& el, int* worst)
{
  const Mesh& mesh = m.mesh;
  std::map<std::tuple<int, int, double, bool>, int> known;
  el = Elements();
  el.block_of.assign(mesh.nelem(), -1);
  el.slot_of.assign(mesh.nelem(), -1);
  for (int e = 0; e < mesh.nelem(); ++e) {
    if (mesh.elem_section[e] < 0) continue;
    ElemBlock& b          = block_for(m, el, known, e);
    const ShapeInfo& info = shape_info[b.shape];
    const GaussRule& rule = gauss_rule(b.shape);
    double X[24], N[8], dN[24], dNdX[24];
    for (int a = 0; a < info.nen; ++a)
      for (int i = 0; i < info.dim; ++i) X[a * info.dim + i] = mesh.X[3 * mesh.conn.begin(e)[a] + i];
    el.slot_of[e] = static_cast<int>(b.elem.size());
    b.elem.push_back(e);
    for (int g = 0; g < rule.n; ++g) {
      shape_eval(b.shape, rule.xi[g], N, dN);
      const double det = shape_jacobian(b.shape, dN, X, dNdX);
      if (!(det > 0.0)) {
        *worst = e;
        return BAD_JACOBIAN;
      }
      b.w.push_back(det * rule.w[g] * (info.dim == 2 ? b.thickness : 1.0));
      b.dNdX.insert(b.dNdX.end(), dNdX, dNdX + info.nen * info.dim);
    }
    if (!elem_table[b.type].enhanced) continue;
    b.eas.resize(b.eas.size() + eas_size(b.shape));
    eas_setup(b.shape, X, &b.w[b.w.size() - rule.n], b.law, &b.eas[b.eas.size() - eas_size(b.shape)]);
  }
  el.home = el.block_of;
  elem_refresh(el);
  return STATUS_OK;
}

void elem_mass(const Model& m, const ElemBlock& b, int slot, double* me)
{
  const ShapeInfo& info = shape_info[b.shape];
  const int* node       = m.mesh.conn.begin(b.elem[slot]);
  double X[24];
  for (int a = 0; a < info.nen; ++a)
    for (int i = 0; i < info.dim; ++i) X[a * info.dim + i] = m.mesh.X[3 * node[a] + i];
  shape_mass(b.shape, X, b.density * (info.dim == 2 ? b.thickness : 1.0), me);
  if (b.lumped) lump(info.nen, me);
}

void elem_refresh(Elements& el)
{
  for (ElemBlock& b : el.block) b.live.clear();
  for (size_t e = 0; e < el.home.size(); ++e) {
    const bool is = el.home[e] >= 0 && (!el.frac || el.frac->form[e] == FORM_ELEMENT);
    el.block_of[e] = is ? el.home[e] : -1;
    if (is) el.block[el.home[e]].live.push_back(el.slot_of[e]);
  }
  for (ElemBlock& b : el.block) b.mine = b.live;
}
