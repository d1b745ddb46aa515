#include <algorithm>

#include "base/comm.h"
#include "frac/frac.h"

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
  for (int e : fr.releasing) {
    if (!m.part.works(e)) continue;
    const double c0 = l0.degr[e], c1 = l1.degr[e], mean = 0.5 * (c0 + c1);
    const auto energy = [&](const Level& l, double c) { return broken_energy(m, s, el, pts, fr, l, e, c); };
    sum += energy(l0, c0) - energy(l0, mean) + energy(l1, mean) - energy(l1, c1);
  }
  comm_sum(&sum, 1);
  return sum;
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
