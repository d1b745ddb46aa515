// Several ranks: domains of elements that are material points from the start, and their numbers. Each rank
// plans the lattices of its elements and of those around them, as one rank does in the order of the deck, so
// it finds which element makes a corner; numbers come from the ranks of these.
#include <algorithm>
#include <map>
#include <numeric>

#include "base/comm.h"
#include "base/log.h"
#include "point/filler.h"
#include "shape/shape.h"

namespace {

// How many points and corners an element makes, or its first ones; elem: number in the mesh of the deck
struct PlanCount { int elem, points, corners; };

// An element that is planned: its domains in the list of its body, and the corners that it makes
struct Planned { int elem, body, first, end, corner, corner_end; };

int corners(const Domain& d) { return shape_info[d.shape].nen; }

// Counts of the elements of this rank become numbers of their first point and corner, in the order of the
// deck; rank 0 alone sees all of them. npoint and ncorner of all ranks go on. Collective
void planned_numbers(PointPart& part, std::vector<PlanCount>& own)
{
  std::vector<std::vector<PlanCount>> of_rank = comm_gather(own);
  std::vector<PlanCount*> all;
  for (std::vector<PlanCount>& list : of_rank)
    for (PlanCount& x : list) all.push_back(&x);
  std::sort(all.begin(), all.end(), [](const auto* a, const auto* b) { return a->elem < b->elem; });
  for (PlanCount* x : all) {
    const PlanCount count = *x;
    *x = {count.elem, part.npoint, part.ncorner};
    part.npoint += count.points;
    part.ncorner += count.corners;
  }
  own.swap(comm_exchange(of_rank)[0]);
  part.npoint  = comm_bcast(part.npoint);
  part.ncorner = comm_bcast(part.ncorner);
}

// domains of one body; those of this rank get their numbers, and the corners that its elements make
void plan_body(Filler& f, int body, std::vector<Planned>& planned)
{
  const MeshPart& mesh = f.m.part;
  FillPlan& plan = *f.plan;
  std::vector<Domain>& domain = plan.domain[body];
  const auto ncorner  = [&] { return static_cast<int>(plan.number.size()); };
  const size_t before = planned.size();
  std::vector<PlanCount> own;
  for (int e : f.m.elset[f.m.body[body].elset].item) {
    if (f.errors) break;
    const int first = static_cast<int>(domain.size()), corner = ncorner();
    fill_element(f, body, e);
    const int end = static_cast<int>(domain.size());
    for (int q = first; q < end; ++q) {
      domain[q].elem = e;
      domain[q].rank = mesh.rank[e];
    }
    planned.push_back({e, body, first, end, corner, ncorner()});
    if (mesh.works(e)) own.push_back({mesh.elem[e], end - first, ncorner() - corner});
  }
  planned_numbers(f.pts.part, own);
  auto made = own.begin();
  for (size_t k = before; k < planned.size(); ++k) {
    const Planned& x = planned[k];
    if (!mesh.works(x.elem)) continue;
    for (int q = x.first; q < x.end; ++q) domain[q].point = made->points + q - x.first;
    std::iota(plan.number.begin() + x.corner, plan.number.begin() + x.corner_end, made->corners);
    ++made;
  }
}

// numbers of the points and corners of elements of this rank, to all that have planned them; those that are
// not known here yet (-1) are left out. of_elem: index into planned, -1
void tell_numbers(const MeshPart& mesh, const std::vector<Planned>& planned, const IntVec& of_elem,
                  FillPlan& plan)
{
  if (!mesh.around.on()) return;
  const int ranks = comm_size(), me = comm_rank();
  // calls use(number) for those of the elements of a rank that another one has too, always in the same order
  const auto each = [&](int other, int owner, auto use) {
    for (int e : mesh.around.common[other]) {
      if (of_elem[e] < 0 || mesh.rank[e] != owner) continue;
      const Planned& x = planned[of_elem[e]];
      for (int q = x.first; q < x.end; ++q) {
        Domain& d = plan.domain[x.body][q];
        use(d.point);
        for (int a = 0; a < corners(d); ++a) use(plan.number[d.corner[a]]);
      }
    }
  };
  std::vector<IntVec> tell(ranks);
  for (int r = 0; r < ranks; ++r) each(r, me, [&](int number) { tell[r].push_back(number); });
  const std::vector<IntVec> told = comm_exchange(tell);
  for (int r = 0; r < ranks; ++r) {
    const int* next = told[r].data();
    each(r, r, [&](int& number) { number = std::max(number, *next++); });
  }
}

// A corner of a domain that another rank asks for
struct CornerAt { int number; double X[3]; };

// corners of the plan by their numbers; those that are not there come behind the others
struct ByNumber {
  FillPlan& plan;
  int dim;
  IntVec order;                // corners that the plan has had, ascending
  std::map<int, int> added;    // number and place of others
  ByNumber(FillPlan& p, int d) : plan(p), dim(d), order(p.number.size())
  {
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](int a, int b) { return plan.number[a] < plan.number[b]; });
  }
  int corner(int number)
  {
    const auto at = std::lower_bound(order.begin(), order.end(), number,
                                     [&](int c, int value) { return plan.number[c] < value; });
    if (at != order.end() && plan.number[*at] == number) return *at;
    const auto fresh = added.emplace(number, static_cast<int>(plan.number.size()));
    if (fresh.second) {
      plan.number.push_back(number);
      plan.X.resize(plan.X.size() + dim, 0.0);
    }
    return fresh.first->second;
  }
};

// [corner] one of these domains of this rank (numbers, ascending) has it
std::vector<char> corners_of(const IntVec& number, const FillPlan& plan)
{
  std::vector<char> out(plan.number.size(), 0);
  const auto asked = [&](const Domain& d) {
    return d.rank == comm_rank() && std::binary_search(number.begin(), number.end(), d.point);
  };
  for (const std::vector<Domain>& list : plan.domain)
    for (const Domain& d : list)
      for (int a = 0; a < corners(d) && asked(d); ++a) out[d.corner[a]] = 1;
  return out;
}

// What a rank is told: domains of each body [body], with the numbers of their corners, and the places of the
// corners of those that it has asked for
struct Told {
  std::vector<std::vector<Domain>> domain;
  std::vector<CornerAt> place;
};

// of domains of this rank (numbers, ascending), and of those that share a corner with them
Told domains_near(const IntVec& asked, int dim, const FillPlan& plan)
{
  Told out;
  out.domain.resize(plan.domain.size());
  if (asked.empty()) return out;
  const std::vector<char> with = corners_of(asked, plan);
  for (size_t c = 0; c < with.size(); ++c) {
    if (!with[c]) continue;
    out.place.push_back({plan.number[c], {0, 0, 0}});
    std::copy_n(&plan.X[c * dim], dim, out.place.back().X);
  }
  for (size_t b = 0; b < plan.domain.size(); ++b)
    for (Domain d : plan.domain[b]) {
      if (std::none_of(d.corner, d.corner + corners(d), [&](int c) { return with[c] != 0; })) continue;
      for (int a = 0; a < corners(d); ++a) d.corner[a] = plan.number[d.corner[a]];
      out.domain[b].push_back(d);
    }
  return out;
}

// domains that other ranks tell, with the numbers of their corners, join the list
void join_domains(const std::vector<Domain>& told, ByNumber& of, std::vector<Domain>& list)
{
  for (Domain d : told) {
    for (int a = 0; a < corners(d); ++a) d.corner[a] = of.corner(d.corner[a]);
    list.push_back(d);
  }
  std::stable_sort(list.begin(), list.end(),         // what was here comes first
                   [](const Domain& a, const Domain& b) { return a.point < b.point; });
  const auto same = [](const Domain& a, const Domain& b) { return a.point == b.point; };
  list.erase(std::unique(list.begin(), list.end(), same), list.end());
}

}  // namespace

int fill_plan(const Model& m, FillPlan& plan)
{
  Points counts;                         // of all ranks, in PointPart
  CornerShare share;
  Filler f{m, counts, share};
  f.plan = &plan;
  const auto fills = [](const Body& b) { return b.fill == FILL_ELSET; };
  if (std::none_of(m.body.begin(), m.body.end(), fills)) return 0;
  plan.domain.resize(m.body.size());
  std::vector<Planned> planned;
  for (size_t b = 0; b < m.body.size(); ++b) {
    const PointPart before = counts.part;
    if (m.body[b].fill == FILL_ELSET) plan_body(f, static_cast<int>(b), planned);
    else if (m.body[b].fill != FILL_CONVERSION) fill_box_counts(f, static_cast<int>(b));
    plan.npoint.push_back(counts.part.npoint - before.npoint);
    plan.ncorner.push_back(counts.part.ncorner - before.ncorner);
  }
  const int errors = comm_allreduce_max(f.errors);
  if (errors) return errors;
  IntVec of_elem(m.mesh.nelem(), -1);
  for (size_t k = 0; k < planned.size(); ++k) of_elem[planned[k].elem] = static_cast<int>(k);
  // at first those that an element has made, which others may share with one of theirs; then all
  tell_numbers(m.part, planned, of_elem, plan);
  tell_numbers(m.part, planned, of_elem, plan);
  MPFE_CHECK(std::find(plan.number.begin(), plan.number.end(), -1) == plan.number.end(),
             "a corner of an element that is material points has no number");
  return 0;
}

void fill_plan_near(const std::vector<PointHome>& point, int dim, FillPlan& plan)
{
  if (plan.domain.empty()) return;       // on all ranks
  std::vector<IntVec> ask(comm_size());
  for (const PointHome& p : point) ask[p.rank].push_back(p.point);
  std::vector<Told> tell;
  for (const IntVec& asked : comm_exchange(ask)) tell.push_back(domains_near(asked, dim, plan));
  ByNumber of(plan, dim);
  for (size_t b = 0; b < plan.domain.size(); ++b) {
    std::vector<std::vector<Domain>> domain;
    for (const Told& t : tell) domain.push_back(t.domain[b]);
    std::vector<Domain> told;
    for (const std::vector<Domain>& list : comm_exchange(domain))
      told.insert(told.end(), list.begin(), list.end());
    join_domains(told, of, plan.domain[b]);
  }
  std::vector<std::vector<CornerAt>> place;
  for (const Told& t : tell) place.push_back(t.place);
  for (const std::vector<CornerAt>& list : comm_exchange(place))
    for (const CornerAt& p : list)
      std::copy_n(p.X, dim, &plan.X[static_cast<size_t>(of.corner(p.number)) * dim]);
}

void fill_plan_begin(const Filler& f, FillPlan& plan)
{
  plan.index.assign(plan.number.size(), -1);
  std::vector<char> used(plan.number.size(), 0);
  for (const std::vector<Domain>& list : plan.domain)
    for (const Domain& d : list)
      for (int a = 0; a < corners(d) && f.has(d.point, d.rank); ++a) used[d.corner[a]] = 1;
  plan.used.clear();
  for (size_t c = 0; c < used.size(); ++c)
    if (used[c]) plan.used.push_back(static_cast<int>(c));
  std::sort(plan.used.begin(), plan.used.end(),
            [&](int a, int b) { return plan.number[a] < plan.number[b]; });
}
