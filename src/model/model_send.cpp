#include "model/model_send.h"

#include "model/model_io.h"

namespace {

void write(Model& m, int ranks)
{
  Archive f;
  f.ranks = ranks;
  io(f, m);
  archive_flush(f);
}

Model read(int ranks)
{
  Archive f;
  f.reading = true;
  f.ranks   = ranks;
  Model m;
  io(f, m);
  MPFE_CHECK(f.good && f.at == f.begin + f.bytes.size(), "the model was not sent whole");
  return m;
}

}  // namespace

void model_send(Model& m, int rank) { write(m, rank); }

Model model_receive() { return read(RANKS_ONE); }

void model_bcast(Model& m)
{
  if (comm_size() == 1) return;
  if (comm_rank() == 0) write(m, RANKS_ALL);
  else m = read(RANKS_ALL);
}
