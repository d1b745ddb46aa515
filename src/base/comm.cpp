#include "base/comm.h"

#include <cstdlib>

#ifdef MPFE_MPI

#include <mpi.h>

#include <algorithm>
#include <initializer_list>

#include "base/timer.h"

namespace {

int rank = 0, size = 1;

const long SHORT = 1 << 16;    // numbers of all ranks; below, every rank gets all of them and sums for itself

// Started without a launcher, Open MPI 4 would start a daemon beside every run (0.3 s), look for networks (0.2 s), and
// make a folder in /tmp that all such runs share: two of them that start at the same moment end with an error.
bool alone()
{
  for (const char* launcher : {"OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK", "PMI_SIZE"})
    if (std::getenv(launcher)) return false;
  return true;
}

// All ranks on one machine (Open MPI tells): shared memory is all they need, and the search for networks takes 0.2 s
bool one_machine()
{
  const char *here = std::getenv("OMPI_COMM_WORLD_LOCAL_SIZE"), *all = std::getenv("OMPI_COMM_WORLD_SIZE");
  return here && all && std::strcmp(here, all) == 0;
}

// x += part after part, n numbers each
void add_parts(const RealVec& part, int n, double* x)
{
  std::copy(part.begin(), part.begin() + n, x);
  for (int r = 1; r < size; ++r)
    for (int i = 0; i < n; ++i) x[i] += part[static_cast<size_t>(r) * n + i];
}

void sum_short(double* x, int n)
{
  RealVec part(static_cast<size_t>(n) * size);
  MPI_Allgather(x, n, MPI_DOUBLE, part.data(), n, MPI_DOUBLE, MPI_COMM_WORLD);
  add_parts(part, n, x);
}

// each rank sums its slice of x, and gives it to all
void sum_slices(double* x, int n)
{
  IntVec count(size), first(size), mine(size), place(size);
  for (int r = 0; r < size; ++r) {
    first[r] = static_cast<int>(static_cast<long>(n) * r / size);
    count[r] = static_cast<int>(static_cast<long>(n) * (r + 1) / size) - first[r];
  }
  for (int r = 0; r < size; ++r) {
    mine[r]  = count[rank];
    place[r] = count[rank] * r;
  }
  RealVec part(static_cast<size_t>(count[rank]) * size);
  MPI_Alltoallv(x, count.data(), first.data(), MPI_DOUBLE, part.data(), mine.data(), place.data(), MPI_DOUBLE, MPI_COMM_WORLD);
  add_parts(part, count[rank], x + first[rank]);
  MPI_Allgatherv(MPI_IN_PLACE, 0, MPI_DOUBLE, x, count.data(), first.data(), MPI_DOUBLE, MPI_COMM_WORLD);
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
    return;                    // MPI starts when MUMPS asks for a communicator: 0.03 s that small decks need not spend
  }
  if (one_machine()) {
    setenv("OMPI_MCA_pml", "ob1", 0);
    setenv("OMPI_MCA_btl", "self,vader", 0);
  }
  MPI_Init(argc, argv);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);
}

void comm_close()
{
  int begun = 0, done = 0;
  MPI_Initialized(&begun);
  MPI_Finalized(&done);
  if (begun && !done) MPI_Finalize();
}

int comm_rank() { return rank; }
int comm_size() { return size; }

int comm_fortran(bool all)
{
  int begun = 0;
  MPI_Initialized(&begun);
  if (!begun) MPI_Init(nullptr, nullptr);
  return MPI_Comm_c2f(all ? MPI_COMM_WORLD : MPI_COMM_SELF);
}

void comm_stop(int code)
{
  if (size > 1) MPI_Abort(MPI_COMM_WORLD, code);
  std::exit(code);
}

void comm_share(double* x, int n)
{
  if (size == 1) return;
  Timer timer(PHASE_COMM);
  MPI_Bcast(x, n, MPI_DOUBLE, 0, MPI_COMM_WORLD);
}

void comm_share(std::string& bytes)
{
  if (size == 1) return;
  Timer timer(PHASE_COMM);
  long length = static_cast<long>(bytes.size());
  MPI_Bcast(&length, 1, MPI_LONG, 0, MPI_COMM_WORLD);
  bytes.resize(length);
  const long most = 1L << 30;          // MPI counts by int
  for (long at = 0; at < length; at += most)
    MPI_Bcast(&bytes[at], static_cast<int>(std::min(most, length - at)), MPI_BYTE, 0, MPI_COMM_WORLD);
}

int comm_share(int x)
{
  if (size == 1) return x;
  Timer timer(PHASE_COMM);
  MPI_Bcast(&x, 1, MPI_INT, 0, MPI_COMM_WORLD);
  return x;
}

int comm_most(int x)
{
  if (size == 1) return x;
  Timer timer(PHASE_COMM);
  int most = x;
  MPI_Allreduce(&x, &most, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
  return most;
}

void comm_sum(double* x, int n)
{
  if (size == 1) return;
  Timer timer(PHASE_COMM);
  // two ranks: slices bring as many numbers in two messages
  if (size == 2 || static_cast<long>(n) * size < SHORT) sum_short(x, n);
  else sum_slices(x, n);
}

void comm_trade(const std::vector<RealVec>& to, std::vector<RealVec>& from)
{
  Timer timer(PHASE_COMM);
  std::vector<MPI_Request> request(2 * size, MPI_REQUEST_NULL);
  for (int r = 0; r < size; ++r)
    if (r != rank && !from[r].empty())
      MPI_Irecv(from[r].data(), static_cast<int>(from[r].size()), MPI_DOUBLE, r, 0, MPI_COMM_WORLD, &request[2 * r]);
  for (int r = 0; r < size; ++r)
    if (r != rank && !to[r].empty())
      MPI_Isend(to[r].data(), static_cast<int>(to[r].size()), MPI_DOUBLE, r, 0, MPI_COMM_WORLD, &request[2 * r + 1]);
  MPI_Waitall(2 * size, request.data(), MPI_STATUSES_IGNORE);
}

void comm_gather(RealVec& x, const IntVec& count)
{
  if (size == 1) return;
  Timer timer(PHASE_COMM);
  IntVec first(size, 0);
  for (int r = 1; r < size; ++r) first[r] = first[r - 1] + count[r - 1];
  MPI_Allgatherv(MPI_IN_PLACE, 0, MPI_DOUBLE, x.data(), count.data(), first.data(), MPI_DOUBLE, MPI_COMM_WORLD);
}

std::vector<std::string> comm_bytes(const std::vector<std::string>& to)
{
  if (size == 1) return to;
  Timer timer(PHASE_COMM);
  IntVec out(size), in(size), out_at(size + 1, 0), in_at(size + 1, 0);
  for (int r = 0; r < size; ++r) out[r] = static_cast<int>(to[r].size());
  MPI_Alltoall(out.data(), 1, MPI_INT, in.data(), 1, MPI_INT, MPI_COMM_WORLD);
  std::string send, got;
  for (int r = 0; r < size; ++r) {
    send += to[r];
    out_at[r + 1] = out_at[r] + out[r];
    in_at[r + 1]  = in_at[r] + in[r];
  }
  got.resize(in_at[size]);
  MPI_Alltoallv(send.data(), out.data(), out_at.data(), MPI_BYTE, &got[0], in.data(), in_at.data(), MPI_BYTE, MPI_COMM_WORLD);
  std::vector<std::string> from;
  for (int r = 0; r < size; ++r) from.push_back(got.substr(in_at[r], in[r]));
  return from;
}

#else

void comm_open(int*, char***) {}
void comm_close() {}
int comm_rank() { return 0; }
int comm_size() { return 1; }
int comm_fortran(bool) { return -987654; }           // MUMPS without MPI
void comm_stop(int code) { std::exit(code); }
void comm_share(double*, int) {}
void comm_share(std::string&) {}
int comm_share(int x) { return x; }
int comm_most(int x) { return x; }
void comm_sum(double*, int) {}
void comm_trade(const std::vector<RealVec>&, std::vector<RealVec>&) {}
void comm_gather(RealVec&, const IntVec&) {}
std::vector<std::string> comm_bytes(const std::vector<std::string>& to) { return to; }

#endif
