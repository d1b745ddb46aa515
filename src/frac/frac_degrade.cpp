#include <algorithm>

#include "base/comm.h"
#include "frac/frac.h"
#include "model/scheme.h"

namespace {

// strain energy of a broken element, or of its points, with the degradation factor c
double broken_energy(const Model& m, const Step& s, const Elements& el, const Points& pts, const Fracture& fr,
                     const Level& l, int e, double c)
{
  if (fr.phase[e] == AS_ELEMENT) return elem_energy_one(m, el, e, l, c, s.nlgeom);
  double sum = 0.0;
  for (int p = pts.of_elem[e]; p < pts.npoint && pts.parent[p] == e; ++p)
    sum += point_energy_one(m, pts, l, p, c);
  return sum;
}

// internal force of an element in level l, broken with the degradation factor c, or intact        [nen*dim]
bool force_of(const Model& m, const Step& s, const Elements& el, const Level& l, int e, double c, double* re)
{
  const ElemBlock& b = el.block[el.initial_block[e]];
  const int slot = el.slot_of[e], *node = m.mesh.conn.begin(e), nen = shape_info[b.shape].nen;
  double u[3 * MAX_NODES], unused[MAX_GAUSS * MAX_HISTORY];
  HistoryStep h[MAX_GAUSS];
  KernelMode mode;
  mode.finite = s.nlgeom;
  for (int k = el.gauss_of[e], g = 0; k < el.gauss_of[e + 1]; ++k, ++g)
    h[g] = {history_at(l.he, el.history, k), unused + g * MAX_HISTORY};
  for (int a = 0; a < nen; ++a) std::copy_n(&l.u[node[a] * m.dim], m.dim, u + a * m.dim);
  return elem_form_general(b, slot, elem_law(m, el, b, slot, c), mode, u, u, h, re, nullptr) == STATUS_OK;
}

// work over the step of the force that a broken element has in level l with the degradation factor c
double broken_work(const Model& m, const Step& s, const Elements& el, const Level& l0, const Level& l1,
                   const Level& l, int e, double c)
{
  const int *node = m.mesh.conn.begin(e), n = m.mesh.conn.count(e) * m.dim;
  double re[3 * MAX_NODES], work = 0.0;
  if (!force_of(m, s, el, l, e, c, re)) return 0.0;
  for (int k = 0; k < n; ++k) {
    const int dof = node[k / m.dim] * m.dim + k % m.dim;
    work += re[k] * (l1.u[dof] - l0.u[dof]);
  }
  return work;
}

}  // namespace

void frac_degrade(const Model& m, const Step& s, const FracMesh& fm, const Fracture& fr, const Level& l0,
                  double dt, Level& l1)
{
  for (int e : fr.releasing) {
    const double c = m.fracture[fr.broken[e]].stiffness;
    const double fallen = (1.0 - c) * (l0.time + dt - fr.time[e]) / fm.release[e];
    l1.degr[e] = s.proc == PROC_STATIC ? c : std::min(l0.degr[e], std::max(c, 1.0 - fallen));
  }
}

double frac_degraded(const Model& m, const Step& s, const Elements& el, const Points& pts, const Fracture& fr,
                     const Level& l0, const Level& l1)
{
  double sum = 0.0;
  // forces of both ends do the work of the step, and not those of the middle
  const bool ends = s.proc == PROC_DYNAMIC && !scheme_of(s).midpoint;
  for (int e : fr.releasing) {
    if (!m.part.works(e)) continue;
    const double c0 = l0.degr[e], c1 = l1.degr[e], mean = 0.5 * (c0 + c1);
    const auto energy = [&](const Level& l, double c) { return broken_energy(m, s, el, pts, fr, l, e, c); };
    sum += energy(l0, c0) - energy(l0, mean) + energy(l1, mean) - energy(l1, c1);
    if (!ends || fr.phase[e] != AS_ELEMENT) continue;
    const auto work = [&](const Level& l, double c) { return broken_work(m, s, el, l0, l1, l, e, c); };
    sum += 0.5 * (work(l0, c0) - work(l0, mean) + work(l1, c1) - work(l1, mean));
  }
  return sum;
}

void frac_forces(const Model& m, const Step& s, const Elements& el, const std::vector<Erosion>& all,
                 const Level& l, double sign, RealVec& f)
{
  double re[3 * MAX_NODES];
  for (const Erosion& x : all) {
    if (x.elem < 0 || !m.part.works(x.elem)) continue;
    const int* node = m.mesh.conn.begin(x.elem);
    if (!force_of(m, s, el, l, x.elem, l.degr[x.elem], re)) continue;
    for (int k = 0; k < m.mesh.conn.count(x.elem) * m.dim; ++k)
      f[static_cast<size_t>(node[k / m.dim]) * m.dim + k % m.dim] += sign * re[k];
  }
}

void frac_count_releasing(const Model& m, Fracture& fr)
{
  fr.nreleasing = static_cast<int>(
      std::count_if(fr.releasing.begin(), fr.releasing.end(), [&](int e) { return m.part.works(e); }));
  if (!m.part.on) return;
  double count = fr.nreleasing;
  comm_sum(&count, 1);
  fr.nreleasing = static_cast<int>(count);
}

void frac_open(const Model& m, const FracMesh& fm, const Level& l, Fracture& fr, IntVec& convert)
{
  if (m.part.on && fr.nreleasing == 0) return;
  const size_t first = convert.size();
  IntVec still;
  for (int e : fr.releasing) {
    if (l.degr[e] > m.fracture[fr.broken[e]].stiffness) {
      still.push_back(e);
      continue;
    }
    const int c = fm.conv[e];
    if (c >= 0 && m.part.works(e) && m.conversion[c].trigger == TRIGGER_EROSION && fr.phase[e] == AS_ELEMENT)
      convert.push_back(e);
  }
  if (!m.conversion.empty()) frac_gather(m, fr, convert, first);
  fr.releasing.swap(still);
  frac_count_releasing(m, fr);
}
