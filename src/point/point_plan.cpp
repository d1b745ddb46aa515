// Several ranks: domains of elements that are material points from the start, and their numbers. Each rank
// plans the lattices of its elements and of their neighbours in the order of the deck, as a run on one rank
// would, and so finds the element that creates a corner; the owner of that element sends the number.
#include <algorithm>
#include <map>
#include <numeric>

#include "base/comm.h"
#include "base/log.h"
#include "point/filler.h"

namespace {

// Number of points and corners that an element creates, or its first ones; elem: number in the deck's mesh
struct PlanCount { int elem, points, corners; };

// A planned element: its domains in the list of its body, and the corners that it creates
struct Planned { int elem, body, first, end, corner, corner_end; };

int corners(const Domain& d) { return shape_info[d.shape].nen; }

// Converts the counts of owned elements to the numbers of their first point and corner, in the order of the
// deck; rank 0 alone gathers all counts. Adds to npoint and ncorner of all ranks. Collective
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

// domains of one body; numbers the domains of owned elements, and the corners that these create
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

// sends the numbers of the points and corners of owned elements to all ranks that planned them; numbers that
// are not known here yet (-1) are ignored there. of_elem: index into planned, -1
void send_numbers(const MeshPart& mesh, const std::vector<Planned>& planned, const IntVec& of_elem,
                  FillPlan& plan)
{
  if (!mesh.around.on()) return;
  const int ranks = comm_size(), me = comm_rank();
  // calls use(number) for the elements of owner that other stores too, always in the same order
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
  std::vector<IntVec> send(ranks);
  for (int r = 0; r < ranks; ++r) each(r, me, [&](int number) { send[r].push_back(number); });
  const std::vector<IntVec> received = comm_exchange(send);
  for (int r = 0; r < ranks; ++r) {
    const int* next = received[r].data();
    each(r, r, [&](int& number) { number = std::max(number, *next++); });
  }
}

// A corner of a domain that another rank has requested
struct CornerAt { int number; double X[3]; };

// corners of the plan by number; missing ones are appended
struct ByNumber {
  FillPlan& plan;
  int dim;
  IntVec order;                // original corners of the plan, ascending by number
  std::map<int, int> added;    // number and index of the others
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

// [corner] 1: belongs to one of these domains of this rank (numbers, ascending)
std::vector<char> corners_of(const IntVec& number, const FillPlan& plan)
{
  std::vector<char> out(plan.number.size(), 0);
  const auto listed = [&](const Domain& d) {
    return d.rank == comm_rank() && std::binary_search(number.begin(), number.end(), d.point);
  };
  for (const std::vector<Domain>& list : plan.domain)
    for (const Domain& d : list)
      for (int a = 0; a < corners(d) && listed(d); ++a) out[d.corner[a]] = 1;
  return out;
}

// Message to a rank: domains of each body [body] with the numbers of their corners, and the positions of the
// corners of the requested domains
struct DomainMessage {
  std::vector<std::vector<Domain>> domain;
  std::vector<CornerAt> position;
};

// the requested domains of this rank (numbers, ascending), and the domains that share a corner with them
DomainMessage domains_around(const IntVec& requested, int dim, const FillPlan& plan)
{
  DomainMessage out;
  out.domain.resize(plan.domain.size());
  if (requested.empty()) return out;
  const std::vector<char> with = corners_of(requested, plan);
  for (size_t c = 0; c < with.size(); ++c) {
    if (!with[c]) continue;
    out.position.push_back({plan.number[c], {0, 0, 0}});
    std::copy_n(&plan.X[c * dim], dim, out.position.back().X);
  }
  for (size_t b = 0; b < plan.domain.size(); ++b)
    for (Domain d : plan.domain[b]) {
      if (std::none_of(d.corner, d.corner + corners(d), [&](int c) { return with[c] != 0; })) continue;
      for (int a = 0; a < corners(d); ++a) d.corner[a] = plan.number[d.corner[a]];
      out.domain[b].push_back(d);
    }
  return out;
}

// adds domains received from other ranks, with the numbers of their corners, to the list
void join_domains(const std::vector<Domain>& received, ByNumber& of, std::vector<Domain>& list)
{
  for (Domain d : received) {
    for (int a = 0; a < corners(d); ++a) d.corner[a] = of.corner(d.corner[a]);
    list.push_back(d);
  }
  std::stable_sort(list.begin(), list.end(),         // of equal domains the one already here is first
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
  // first the corners that an element creates, which elements of other ranks may share; then all
  send_numbers(m.part, planned, of_elem, plan);
  send_numbers(m.part, planned, of_elem, plan);
  MPFE_CHECK(std::find(plan.number.begin(), plan.number.end(), -1) == plan.number.end(),
             "a corner of an element that is material points has no number");
  return 0;
}

void fill_plan_halo(const std::vector<OriginalPoint>& point, int dim, FillPlan& plan)
{
  if (plan.domain.empty()) return;       // on all ranks
  std::vector<IntVec> request(comm_size());
  for (const OriginalPoint& p : point) request[p.rank].push_back(p.point);
  std::vector<DomainMessage> send;
  for (const IntVec& requested : comm_exchange(request))
    send.push_back(domains_around(requested, dim, plan));
  ByNumber of(plan, dim);
  for (size_t b = 0; b < plan.domain.size(); ++b) {
    std::vector<std::vector<Domain>> domain;
    for (const DomainMessage& x : send) domain.push_back(x.domain[b]);
    std::vector<Domain> received;
    for (const std::vector<Domain>& list : comm_exchange(domain))
      received.insert(received.end(), list.begin(), list.end());
    join_domains(received, of, plan.domain[b]);
  }
  std::vector<std::vector<CornerAt>> position;
  for (const DomainMessage& x : send) position.push_back(x.position);
  for (const std::vector<CornerAt>& list : comm_exchange(position))
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
