#include <algorithm>
#include <cmath>

#include "base/halo_numbers.h"
#include "frac/frac.h"
#include "shape/shape.h"

namespace {

// the average relaxes to psi+, which is linear in the increment: d mean/dt = (psi+ - mean)/T  (7.26)
double averaged(double mean, double before, double now, double dt, double T)
{
  const double lag = T * (now - before) / dt;
  return now - lag + (mean - before + lag) * std::exp(-dt / T);
}

// psi+ of the plane strain E [dim*dim] with E33, which an initial stress may leave in plane strain
double drive_at(const MatLaw& law, int dim, Split split, bool finite, const double* E, double E33)
{
  if (E33 == 0.0) return split_drive(law, dim, split, finite, E);
  MatLaw space = law;
  space.plane  = PLANE_NONE;
  const double full[9] = {E[0], E[1], 0.0, E[2], E[3], 0.0, 0.0, 0.0, E33};
  return split_drive(space, 3, split, finite, full);
}

}  // namespace

void frac_share(const MeshPart& part, RealVec& x)
{
  if (part.around.on()) halo_numbers(part.around, 1, x);
}

double frac_drive(const Model& m, const Step& s, const Elements& el, const FracMesh& fm, const Level& l,
                  int e, Split split)
{
  const ElemBlock& b    = el.block[el.initial_block[e]];
  const ShapeInfo& info = shape_info[b.shape];
  double all[72], sum = 0.0;
  elem_strains(m, el, e, l.u, &l.he, s.nlgeom, all);
  for (int g = 0; g < info.ngp; ++g)
    sum += b.w[b.gauss(el.slot_of[e]) + g] *
           drive_at(b.law, m.dim, split, s.nlgeom, all + g * m.dim * m.dim, elem_initial33(el, l.he, e, g));
  return sum / fm.volume[e];
}

bool frac_uses_energy(const Model& m)
{
  return std::any_of(m.fracture.begin(), m.fracture.end(),
                     [](const FractureDef& f) { return f.criterion != CRITERION_COHESIVE; });
}

void frac_average(const Model& m, const Step& s, const Elements& el, const FracMesh& fm, const Level& l,
                  const RealVec& energy, Fracture& fr)
{
  if (s.proc != PROC_DYNAMIC || !frac_uses_energy(m)) return;
  const size_t nelem = fm.def.size();
  const double dt    = l.time - fr.drive_time;
  if (!fr.mean.empty() && dt <= 0.0) return;
  RealVec now(nelem, 0.0);
  for (size_t e = 0; e < nelem; ++e) {
    if (fm.def[e] < 0 || fm.average[e] == 0.0 || fr.broken[e] >= 0 || fr.phase[e] != AS_ELEMENT ||
        el.initial_block[e] < 0)
      continue;
    if (energy[e] <= FRAC_MIN_DRIVE * fm.gc[e] / fm.size[e] * fm.volume[e]) continue;
    now[e] = std::max(0.0, frac_drive(m, s, el, fm, l, static_cast<int>(e), m.fracture[fm.def[e]].drive));
  }
  frac_share(m.part, now);
  if (fr.mean.empty()) {
    fr.drive.assign(nelem, 0.0);
    fr.mean.assign(nelem, 0.0);
  }
  for (size_t e = 0; e < nelem; ++e)
    fr.mean[e] = fr.drive[e] > 0.0 && now[e] > 0.0
                     ? averaged(fr.mean[e], fr.drive[e], now[e], dt, fm.average[e])
                     : now[e];
  fr.drive.swap(now);
  fr.drive_time = l.time;
}
