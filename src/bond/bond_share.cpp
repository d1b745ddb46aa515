#include "base/comm.h"
#include "bond/bond.h"

namespace {

// is bond q a point of general contact, which one rank alone has?
bool is_alone(const Model& m, const Bonds& b, int q) { return m.part.window && b.contact.skin_of[q] >= 0; }

// owner of a bond: the rank of its first node or corner
int rank_of(const Model& m, const Points& pts, const Bonds& b, int q)
{
  if (is_alone(m, b, q)) return comm_rank();
  const int first = b.a.item[b.a.off[q]], c = first - m.mesh.nnode();
  return c < 0 ? m.part.halo.owner[first] : pts.part.halo.owner[c];
}

// Owners of bonds on several ranks: the rank that considers itself the owner, since it stores everything at
// their corners; at the edge of its halo a rank may assume a wrong owner. -1: none of the ranks. Collective
void claim_bonds(Bonds& b)
{
  const int ranks = comm_size(), me = comm_rank();
  std::vector<std::vector<char>> own(ranks);
  for (int r = 0; r < ranks; ++r)
    for (int q : b.halo.common[r]) own[r].push_back(b.rank[q] == me);
  const std::vector<std::vector<char>> claims = comm_exchange(own);
  for (int& rank : b.rank)
    if (rank != me) rank = -1;
  for (int r = 0; r < ranks; ++r)
    for (size_t i = 0; i < claims[r].size(); ++i)
      if (claims[r][i]) b.rank[b.halo.common[r][i]] = r;
}

}  // namespace

void bond_share(const Model& m, const Points& pts, Bonds& b)
{
  if (!m.part.on) return;
  b.rank.clear();
  IntVec known;                // bonds that other ranks may have too
  std::vector<long> key;
  for (int q = 0; q < b.nbond; ++q) {
    b.rank.push_back(rank_of(m, pts, b, q));
    if (is_alone(m, b, q)) continue;
    known.push_back(q);
    key.push_back(b.name[q]);
  }
  halo_form(key, b.halo);
  const IntVec first = b.halo.owner;
  halo_renumber(known, b.halo);
  claim_bonds(b);
  // a rank may have a node only because of an equation, and then no bond of the deck there
  for (size_t k = 0; k < known.size(); ++k)
    if (known[k] < b.nfixed && b.rank[known[k]] < 0) b.rank[known[k]] = first[k];
  double own = 0.0;
  for (int rank : b.rank) own += rank == comm_rank();
  comm_sum(&own, 1);
  b.nall = static_cast<int>(own);
  b.halo.owner = b.rank;
  halo_copy_all(b.halo, 1, std::vector<RealVec*>{&b.area, &b.cn, &b.ct, &b.contact.offset});
}

void bond_copy_contact(const Model& m, Bonds& b, Level& l)
{
  if (!b.halo.on() || !model_has_pairs(m)) return;
  halo_copy_all(b.halo, m.dim, std::vector<RealVec*>{&l.slip, &l.lambda});
  ContactState& c = b.contact;
  halo_copy_all(b.halo, 1, std::vector<RealVec*>{&l.lambda_n, &c.offset, &c.initial_penetration, &c.deep,
                                                 &b.cn, &b.ct});
}
