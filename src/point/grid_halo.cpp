#include "point/grid_halo.h"

#include "base/comm.h"
#include "base/sort_once.h"

namespace {

struct Span {                  // bounding box of the nodes of a rank, in cells
  double bad = 0.0;
  double lo[3] = {1e9, 1e9, 1e9}, hi[3] = {-1e9, -1e9, -1e9};
};

template <class IndicesOf>
void key_halo(const std::vector<long>& own, const std::vector<Span>& span, int dim, int reach,
              IndicesOf indices_of, KeyHalo& h)
{
  const int ranks = comm_size(), me = comm_rank();
  std::vector<std::vector<long>> send(ranks);
  for (long k : own) {
    int at[3];
    indices_of(k, at);
    for (int r = 0; r < ranks; ++r) {
      bool close = r != me;
      for (int i = 0; i < dim && close; ++i)
        close = at[i] >= span[r].lo[i] - reach && at[i] <= span[r].hi[i] + reach;
      if (close) send[r].push_back(k);
    }
  }
  const std::vector<std::vector<long>> received = comm_exchange(send);
  h     = KeyHalo();
  h.key = own;
  for (const std::vector<long>& list : received) h.key.insert(h.key.end(), list.begin(), list.end());
  sort_once(h.key);
  const auto indices = [&](const std::vector<long>& list) {
    IntVec index;
    for (long k : list) index.push_back(find_key(h.key, k));
    return index;
  };
  h.here = indices(own);
  h.own.assign(h.key.size(), 0);
  h.shared.assign(h.key.size(), 0);
  h.first.assign(h.key.size(), ranks);
  for (int k : h.here) {
    h.own[k]   = 1;
    h.first[k] = me;
  }
  for (int r = 0; r < ranks; ++r) {
    h.to.push_back(indices(send[r]));
    h.from.push_back(indices(received[r]));
    for (int k : h.from[r]) {
      h.first[k] = std::min(h.first[k], r);
      h.shared[k]  = 1;
    }
  }
}

}  // namespace

bool grid_halo(const Grid& g, int dim, bool good, const std::vector<long>& node,
               const std::vector<long>& cell, int reach, GridHalo& h)
{
  std::vector<Span> span(1);
  span[0].bad = !good;
  const auto node_at = [&](long k, int* at) { node_of_key(g, dim, k, at); };
  const auto cell_at = [&](long k, int* at) { cell_of_key(g, dim, k, at); };
  for (long k : node) {
    int at[3];
    node_at(k, at);
    for (int i = 0; i < dim; ++i) {
      span[0].lo[i] = std::min(span[0].lo[i], static_cast<double>(at[i]));
      span[0].hi[i] = std::max(span[0].hi[i], static_cast<double>(at[i]));
    }
  }
  comm_allgatherv(span);
  for (const Span& s : span)
    if (s.bad != 0.0) return false;
  key_halo(node, span, dim, reach, node_at, h.node);
  key_halo(cell, span, dim, reach, cell_at, h.cell);
  return true;
}

void key_max(const KeyHalo& h, RealVec& x)
{
  std::vector<RealVec> send(h.to.size());
  for (size_t r = 0; r < h.to.size(); ++r)
    for (int k : h.to[r]) send[r].push_back(x[k]);
  const std::vector<RealVec> received = comm_exchange(send);
  for (size_t r = 0; r < h.from.size(); ++r) {
    const double* value = received[r].data();
    for (int k : h.from[r]) x[k] = std::max(x[k], *value++);
  }
}
