#include "base/comm.h"

#ifdef MPFE_MPI

#include <mpi.h>

#include <cstdlib>
#include <initializer_list>

namespace {

// Started without a launcher, Open MPI 4 would start a daemon beside every run (0.3 s), look for networks (0.2 s), and
// make a folder in /tmp that all such runs share: two of them that start at the same moment end with an error.
bool alone()
{
  for (const char* launcher : {"OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK", "PMI_SIZE"})
    if (std::getenv(launcher)) return false;
  return true;
}

}  // namespace

void comm_open(int* argc, char*** argv)
{
  int done = 0;
  MPI_Initialized(&done);
  if (done) return;
  if (alone()) {
    setenv("OMPI_MCA_ess_singleton_isolated", "1", 0);
    setenv("OMPI_MCA_orte_create_session_dirs", "0", 0);
    setenv("OMPI_MCA_pml", "ob1", 0);
    setenv("OMPI_MCA_btl", "self", 0);
  }
  MPI_Init(argc, argv);
}

void comm_close()
{
  int done = 0;
  MPI_Finalized(&done);
  if (!done) MPI_Finalize();
}

int comm_rank()
{
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  return rank;
}

int comm_size()
{
  int size = 1;
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  return size;
}

void comm_share(double* x, int n)
{
  if (comm_size() > 1) MPI_Bcast(x, n, MPI_DOUBLE, 0, MPI_COMM_WORLD);
}

#else

void comm_open(int*, char***) {}
void comm_close() {}
int comm_rank() { return 0; }
int comm_size() { return 1; }
void comm_share(double*, int) {}

#endif
