#include <algorithm>

#include "base/comm.h"
#include "frac/frac.h"
#include "model/model_cut.h"
#include "model/state_number.h"
#include "model/state_window.h"

IntVec frac_gone(const Fracture& fr)
{
  IntVec gone;
  for (int phase : fr.phase) gone.push_back(phase != AS_ELEMENT);
  return gone;
}

IntVec frac_releasing(const Model& m, const Fracture& fr)
{
  struct Broken { double time; int number; };
  std::vector<Broken> all;
  for (int e : fr.releasing)
    if (m.part.works(e)) all.push_back({fr.time[e], m.part.elem_number(e)});
  comm_allgatherv(all);
  std::sort(all.begin(), all.end(), [](const Broken& a, const Broken& b) {
    return a.time != b.time ? a.time < b.time : a.number < b.number;
  });
  IntVec list;
  for (const Broken& b : all) list.push_back(b.number);
  return list;
}

namespace {

bool reload_parts(const Points& begin, State& st, Model& m, const FracMesh& fm)
{
  PointPart known;
  std::swap(known, st.points.part);      // bonds refer to corners of all ranks
  state_from_deck(m.part, st);
  std::swap(known, st.points.part);
  bool good = st.frac.phase.size() == m.part.elem.size() || st.frac.empty();
  good = good && frac_take(m, fm, begin, st);
  if (comm_allreduce_max(static_cast<int>(!good))) return false;
  if (st.frac.nconverted > 0) point_surfaces(m, st.points);
  if ((m.part.window || model_changes(m)) && !st.frac.empty()) model_owners(frac_gone(st.frac), m);
  if (st.frac.nconverted > 0) point_find_common(m.part, point_ranks(m.part, st.points), st.points);
  bond_share(m, st.points, st.bonds);
  st.np1 = st.n;
  return true;
}

}  // namespace

bool frac_reload(const Points& begin, State& st, Model& m, const FracMesh& fm)
{
  return !m.part.on || reload_parts(begin, st, m, fm);
}

void frac_gather(const Model& m, const Fracture& fr, IntVec& elem, size_t first)
{
  struct Due { double time; int number; };
  std::vector<Due> all;
  for (size_t k = first; k < elem.size(); ++k) all.push_back({fr.time[elem[k]], m.part.elem_number(elem[k])});
  if (m.part.on) comm_allgatherv(all);
  std::sort(all.begin(), all.end(), [](const Due& a, const Due& b) {
    return a.time != b.time ? a.time < b.time : a.number < b.number;
  });
  elem.resize(first);
  for (const Due& d : all) elem.push_back(d.number);
}
