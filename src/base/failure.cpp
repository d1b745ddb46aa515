#include "base/comm.h"
#include "base/failure.h"

Failure failure_agree(const Failure& own)
{
  const int ranks = comm_size(), me = comm_rank();
  const int first = ranks - comm_allreduce_max(own.ok() ? 0 : ranks - me);
  if (first == ranks) return STATUS_OK;
  const char head[2] = {static_cast<char>(own.status), static_cast<char>(own.at)};
  std::vector<std::string> to(ranks);
  if (me == first) to.assign(ranks, std::string(head, 2) + own.note);
  const std::string text = comm_exchange(to)[first];
  Failure f;
  f.status = static_cast<Status>(text[0]);
  f.at     = static_cast<FailureAt>(text[1]);
  f.index  = me == first ? own.index : -1;
  f.note   = text.substr(2);
  return f;
}
