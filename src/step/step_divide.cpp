#include <algorithm>
#include <cstdlib>

#include "base/comm.h"
#include "base/log.h"
#include "contact/contact_masters.h"
#include "step/step.h"

namespace {

// Increments lost to uneven work before a repartitioning, which costs one or two. Measured:
// doc/benchmarks.md, "What two ranks lose"  (no test)
const double MAX_LOST = 1.5;
// with MPFE_DIVIDE=1: sooner, and for the imbalance of the first division too  (test: ranks/compare)
const double MAX_LOST_TESTS = 0.25;

bool sooner()
{
  const char* text = std::getenv("MPFE_DIVIDE");
  return text && *text == '1';
}

// faces of general contact of this rank with their near faces
std::vector<NearFace> faces_here(const Problem& p, const ContactScene& s)
{
  if (s.skin.empty()) return {};
  const Points& pts = p.st.points;
  const NearReach reach = {s.part, s.max_travel, s.margin};
  return near_own(p.m, pts, s.skin, near_faces(p.m, pts, s.skin, s.u, s.uc, reach));
}

}  // namespace

bool step_divides_again(Problem& p, const Step& s)
{
  const Model& m     = p.m;
  State& st          = p.st;
  const Fracture& fr = st.frac;
  if (!m.part.on || fr.empty() || p.next.stays) return false;
  if (m.part.window) dof_share_points(m, p.d.el, st.n.uc, st.points, st.division);
  WorkShare& share = st.work;
  if (share.events == DIVIDED) {
    share.events = AFTER_DIVISION;
    return false;
  }
  const int events = fr.neroded + fr.nconverted;
  if (events != share.events) {
    const IntVec& rank = m.part.window ? st.division.point : st.points.part.rank;
    share.now = dof_excess(m, p.d.el, st.points, st.n.uc, rank);
    const bool intact = share.events == AT_START && events == 0 && !sooner();
    if (intact || share.events == AFTER_DIVISION) share.excess = std::max(1.0, share.now);
  }
  share.events = events;
  if (share.now > WORK_EVEN * share.excess) share.lost += share.now / share.excess - 1.0;
  if (share.lost <= (sooner() ? MAX_LOST_TESTS : MAX_LOST)) return false;
  // explicit: contact is searched again after a repartitioning, so this one waits for a search
  if (st.bonds.nbond_all() > 0 && step_contact_stays(p, s)) return false;
  log_note("  the model is divided among the ranks again: the largest part was %.2f of the mean",
           share.now);
  return true;
}

bool step_contact_faces_known(Problem& p)
{
  const ContactScene& scene = p.d.scene;
  if (!p.m.part.window || model_general_contact(p.m) < 0) return true;
  const bool made = scene.built != p.next.lists;
  if (comm_allreduce_max(static_cast<int>(made)) == 0) return true;
  p.next.lists = scene.built;
  return step_scene_faces_known(p, scene);
}

bool step_scene_faces_known(Problem& p, const ContactScene& scene)
{
  if (!p.m.part.window) return true;
  std::vector<NearFace> own = faces_here(p, scene);
  const bool known = near_known(p.m.part, p.st.points, own, own);
  if (!known) p.next.faces.swap(own);
  return known;
}

DivideBy step_divide_by(const Problem& p)
{
  const Model& m       = p.m;
  const MeshPart& part = m.part;
  DivideBy by;
  IntVec number;
  for (int e = 0; e < m.mesh.nelem(); ++e)
    if (part.works(e)) number.push_back(part.elem_number(e));
  const std::vector<IntVec> of_rank = comm_gather(number);
  if (p.again == AGAIN_FACES) {
    by.rank.resize(comm_rank() == 0 ? part.nelem : 0);
    for (size_t r = 0; r < of_rank.size(); ++r)
      for (int e : of_rank[r]) by.rank[e] = static_cast<int>(r);
  } else {
    by.work = dof_work(m, p.d.el, p.st.points, p.st.n.uc);
  }
  for (RealVec& kind : by.work) {
    RealVec own, all(comm_rank() == 0 ? part.nelem : 0, 0.0);
    for (int e = 0; e < m.mesh.nelem(); ++e)
      if (part.works(e)) own.push_back(kind[e]);
    const std::vector<RealVec> received = comm_gather(own);
    for (size_t r = 0; r < received.size(); ++r)
      for (size_t k = 0; k < received[r].size(); ++k) all[of_rank[r][k]] = received[r][k];
    kind.swap(all);
  }
  const State& st = p.st;
  const auto take = [&](const std::vector<NearFace>& now) {
    for (const std::vector<NearFace>& own : comm_gather(now))
      by.near.insert(by.near.end(), own.begin(), own.end());
  };
  if (model_general_contact(m) >= 0) take(faces_here(p, p.d.scene));
  take(masters_and_slaves(m, st.points, st.n.u, st.n.uc, false));
  take(p.next.faces);
  return by;
}

void step_free_memory(Problem& p)
{
  ActiveGrid cells;
  cells.cell.swap(p.d.grid.cell);
  cells.ncell = p.d.grid.ncell;
  p.d.grid    = std::move(cells);
  Solver solver;
  std::swap(solver, p.newton.solver);
  solve_close(solver);
  MPFE_CHECK(solve_open(solver, p.m.solver), "the solver could not be re-opened");
  p.newton = NewtonMemory();
  p.newton.solver = std::move(solver);
  p.dofs  = Dofs();
  p.ready = false;
}
