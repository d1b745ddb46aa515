#include <algorithm>
#include <cmath>

#include "mat/law.h"

namespace {

// Poisson's ratio from which full integration locks: without F-bar, 32 x 32 CPE4 of Cook's membrane
// (A17) give 7.20 of 7.77 just below it, and 2.83 at 0.4999
// (test: Deck.nearly_incompressible_material_locks, analytic/cook_hooke.inp)
const double LOCKING_POISSON = 0.49;

}  // namespace

MatLaw mat_law(const Material& m, Plane plane)
{
  MatLaw law;
  law.mu    = m.young / (2.0 * (1.0 + m.poisson));
  law.lam3  = m.young * m.poisson / ((1.0 + m.poisson) * (1.0 - 2.0 * m.poisson));
  law.lam   = plane == PLANE_STRESS ? 2.0 * law.lam3 * law.mu / (law.lam3 + 2.0 * law.mu) : law.lam3;
  law.beta  = m.beta;
  law.plane = plane;
  law.kind  = m.law;
  law.bar   = plane != PLANE_STRESS && !m.breaks && (law_flows(m.law) || m.poisson >= LOCKING_POISSON);
  law.material = &m;
  law.initial  = m.initial;
  return law;
}

double mat_stiffness(const Material& m, Plane plane)
{
  const MatLaw law = mat_law(m, plane);
  return law.lam + 2.0 * law.mu;
}

void mat_full(const MatLaw& law, int dim, double E[6], double S[6])
{
  if (dim == 2) {
    E[4] = E[5] = 0.0;
    E[2] = law.plane == PLANE_STRESS ? -law.lam3 / (law.lam3 + 2.0 * law.mu) * (E[0] + E[1]) : 0.0;
  }
  const double p = law.lam3 * (E[0] + E[1] + E[2]);
  for (int i = 0; i < 3; ++i) S[i] = p + 2.0 * law.mu * E[i];
  for (int i = 3; i < 6; ++i) S[i] = 2.0 * law.mu * E[i];
  if (dim == 2 && law.plane == PLANE_STRESS) S[2] = 0.0;
}

MatLaw law_broken(const MatLaw& intact, const FractureDef& f, double c, const double* N)
{
  MatLaw law = intact;
  if (f.criterion == CRITERION_COHESIVE && intact.material && law_flows(intact.material->law)) {
    law.kind      = LAW_COHESIVE_FLOW;                 // open: no traction; in compression it flows
    law.crack     = crack_of(f);
    law.crack.dim = intact.plane == PLANE_NONE ? 3 : 2;
    law.broken    = true;
    law.c         = c;
    law.bar       = false;
    return law;
  }
  law.kind     = f.residual == SPLIT_GRANULAR ? LAW_GRANULAR : LAW_SPLIT;
  law.broken   = true;
  law.split    = f.residual;
  law.c        = c;
  law.friction = f.friction;
  law.beta     = 0.0;
  law.bar      = false;
  for (int i = 0; i < 3; ++i) law.N[i] = N[i];
  return law;
}

// St.Venant-Kirchhoff stiffens along the largest square stretch, laws in logarithmic strains along the
// smallest
double law_stiffening(LawKind kind, double above, double least)
{
  const double stretched = 1.0 + 1.5 * above;
  if (kind == LAW_SVK || kind == LAW_GRANULAR || kind == LAW_COHESIVE) return stretched;
  return least > 0.0 ? std::max(stretched, (1.0 - 0.5 * std::log(least)) / least) : HUGE_VAL;
}
