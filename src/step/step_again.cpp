#include <algorithm>
#include <cstdlib>

#include "base/comm.h"
#include "base/log.h"
#include "step/step.h"

namespace {

// the largest work over the mean may grow by so much before the model is divided again, which costs as much
// as an increment or several. Measured: doc/benchmarks.md, "Points of near elements"
// MPFE_DIVIDE=1 (tests): more often
const double UNEVEN = 1.4, UNEVEN_TESTS = 1.1;

double uneven()
{
  const char* text = std::getenv("MPFE_DIVIDE");
  return text && *text == '1' ? UNEVEN_TESTS : UNEVEN;
}

}  // namespace

bool step_divides_again(Problem& p)
{
  const Model& m     = p.m;
  const Fracture& fr = p.st.frac;
  const bool shares  = !m.part.points && (m.part.window || m.conversion.empty());
  if (!m.part.on || !shares || fr.empty() || p.share.stays) return false;
  const int events = fr.neroded + fr.nconverted;
  if (events == p.share.events) return false;
  const double excess = dof_excess(m, p.d.el, p.st.points, p.st.division.point);
  if (p.share.events == AFTER_DIVISION) p.share.excess = std::max(1.0, excess);
  p.share.events = events;
  if (excess <= uneven() * p.share.excess) return false;
  log_note("  the model is divided among the ranks again: the largest part was %.2f of the mean", excess);
  return true;
}

std::vector<RealVec> step_work_of_all(const Problem& p)
{
  const MeshPart& part = p.m.part;
  std::vector<RealVec> work = dof_work(p.m, p.d.el, p.st.points);
  IntVec number;
  for (int e = 0; e < p.m.mesh.nelem(); ++e)
    if (part.works(e)) number.push_back(part.elem_number(e));
  const std::vector<IntVec> of_rank = comm_gather(number);
  for (RealVec& kind : work) {
    RealVec own, all(comm_rank() == 0 ? part.nelem : 0, 0.0);
    for (int e = 0; e < p.m.mesh.nelem(); ++e)
      if (part.works(e)) own.push_back(kind[e]);
    const std::vector<RealVec> told = comm_gather(own);
    for (size_t r = 0; r < told.size(); ++r)
      for (size_t k = 0; k < told[r].size(); ++k) all[of_rank[r][k]] = told[r][k];
    kind.swap(all);
  }
  return work;
}
