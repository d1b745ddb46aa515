#include "model/lumped.h"

#include <algorithm>

bool model_lumps(const Model& m)
{
  const bool moves   = std::any_of(m.step.begin(), m.step.end(),
                                   [](const Step& s) { return s.proc == PROC_DYNAMIC; });
  const bool touches = std::any_of(m.bond.begin(), m.bond.end(),
                                   [](const BondDef& b) { return b.kind == BOND_CONTACT; });
  const bool explicit_one = std::any_of(m.step.begin(), m.step.end(),
                                        [](const Step& s) { return s.explicit_steps(); });
  return explicit_one || (moves && (touches || !m.fracture.empty()));
}

bool points_lumped(const Model& m, int e)
{
  const int section = e < 0 ? -1 : m.mesh.elem_section[e];
  return section >= 0 && m.section[section].lumped;
}

void lump_mass(int nen, double* m)
{
  double row[MAX_NODES] = {0};
  for (int a = 0, k = 0; a < nen; ++a)
    for (int b = 0; b <= a; ++b, ++k) {
      row[a] += m[k];
      if (b < a) row[b] += m[k];
      m[k] = 0.0;
    }
  for (int a = 0; a < nen; ++a) m[a * (a + 3) / 2] = row[a];
}
