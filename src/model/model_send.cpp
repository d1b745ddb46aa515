#include "model/model_send.h"

#include "model/model_io.h"

void model_send(Model& m, int rank)
{
  Archive f;
  f.rank = rank;
  io(f, m);
  archive_flush(f);
}

Model model_receive()
{
  Archive f;
  f.reading = true;
  f.rank    = comm_rank();
  Model m;
  io(f, m);
  MPFE_CHECK(f.good && f.at == f.begin + f.bytes.size(), "the model was received incompletely");
  return m;
}
