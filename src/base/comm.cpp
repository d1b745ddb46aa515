#include "base/comm.h"

#include <cstdlib>

#include "base/run_lock.h"

#ifdef MPFE_MPI

#include <mpi.h>

#include <algorithm>
#include <ctime>
#include <initializer_list>

#include "base/timer.h"

namespace {

int rank = 0, nranks = 1;
int started = 1;               // ranks of the launcher, of which nranks work and the others wait
MPI_Comm world = MPI_COMM_NULL;      // the working ranks

// if ranks need no network, MPI need not probe the devices of the bus: saves 0.02 s of each start. Nor
// graphics: that part connects to an X server, and ends the run when that server ends
const char* const NO_DEVICES = "-linux:pci,-pci,-gl,-opencl";

// numbers of all ranks together; below, every rank receives all and sums them itself: fewer messages. Both
// ways add in the order of the ranks  (no test)
const long SHORT = 1 << 16;
// maximum bytes of a message, since MPI counts by int; MPFE_COMM_PIECE reduces it, for tests
long piece = 1L << 30;

// calls use(first, bytes) for each piece of a message
template <class Use>
void each_piece(long bytes, Use use)
{
  for (long at = 0; at < bytes; at += piece) use(at, static_cast<int>(std::min(piece, bytes - at)));
}

void receive(void* to, long bytes, int from, std::vector<MPI_Request>& request)
{
  each_piece(bytes, [&](long at, int n) {
    request.emplace_back();
    MPI_Irecv(static_cast<char*>(to) + at, n, MPI_BYTE, from, 0, world, &request.back());
  });
}

void send(const void* what, long bytes, int to, std::vector<MPI_Request>& request)
{
  each_piece(bytes, [&](long at, int n) {
    request.emplace_back();
    MPI_Isend(static_cast<const char*>(what) + at, n, MPI_BYTE, to, 0, world, &request.back());
  });
}

void wait_all(std::vector<MPI_Request>& request)
{
  MPI_Waitall(static_cast<int>(request.size()), request.data(), MPI_STATUSES_IGNORE);
}

// copies x of rank root to all ranks
void broadcast(void* x, long bytes, int root)
{
  char* const first = static_cast<char*>(x);
  each_piece(bytes, [&](long at, int n) { MPI_Bcast(first + at, n, MPI_BYTE, root, world); });
}

// Without a launcher, Open MPI 4 would start a daemon for every run (0.3 s), search for networks (0.2 s), and
// create a folder in /tmp that all such runs share: two runs started at the same moment would fail.
bool alone()
{
  for (const char* launcher : {"OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK", "PMI_SIZE"})
    if (std::getenv(launcher)) return false;
  return true;
}

// If all ranks are on one machine (according to Open MPI), shared memory suffices; the search
// for networks would take 0.2 s
bool one_machine()
{
  const char *here = std::getenv("OMPI_COMM_WORLD_LOCAL_SIZE"), *all = std::getenv("OMPI_COMM_WORLD_SIZE");
  return here && all && std::strcmp(here, all) == 0;
}

// adds all parts, of n numbers each, to x
void add_parts(const RealVec& part, int n, double* x)
{
  std::copy(part.begin(), part.begin() + n, x);
  for (int r = 1; r < nranks; ++r)
    for (int i = 0; i < n; ++i) x[i] += part[static_cast<size_t>(r) * n + i];
}

void sum_short(double* x, int n)
{
  RealVec part(static_cast<size_t>(n) * nranks);
  MPI_Allgather(x, n, MPI_DOUBLE, part.data(), n, MPI_DOUBLE, world);
  add_parts(part, n, x);
}

// each rank sums its slice of x, and sends it to all
void sum_slices(double* x, int n)
{
  IntVec count(nranks), first(nranks), length(nranks), offset(nranks);
  for (int r = 0; r < nranks; ++r) {
    first[r] = static_cast<int>(static_cast<long>(n) * r / nranks);
    count[r] = static_cast<int>(static_cast<long>(n) * (r + 1) / nranks) - first[r];
  }
  for (int r = 0; r < nranks; ++r) {
    length[r] = count[rank];
    offset[r] = count[rank] * r;
  }
  RealVec part(static_cast<size_t>(count[rank]) * nranks);
  MPI_Alltoallv(x, count.data(), first.data(), MPI_DOUBLE, part.data(), length.data(), offset.data(),
                MPI_DOUBLE, world);
  add_parts(part, count[rank], x + first[rank]);
  MPI_Allgatherv(MPI_IN_PLACE, 0, MPI_DOUBLE, x, count.data(), first.data(), MPI_DOUBLE, world);
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
    setenv("HWLOC_COMPONENTS", NO_DEVICES, 0);
    // MPI starts when MUMPS needs a communicator: saves 0.03 s with small decks
    return;
  }
  if (one_machine()) {
    setenv("OMPI_MCA_pml", "ob1", 0);
    setenv("OMPI_MCA_btl", "self,vader", 0);
    setenv("HWLOC_COMPONENTS", NO_DEVICES, 0);
  }
  MPI_Init(argc, argv);
  world = MPI_COMM_WORLD;
  MPI_Comm_rank(world, &rank);
  MPI_Comm_size(world, &nranks);
  started = nranks;
  if (const char* text = std::getenv("MPFE_COMM_PIECE")) piece = std::max(8L, std::atol(text) / 8 * 8);
}

void comm_close()
{
  int begun = 0, done = 0;
  MPI_Initialized(&begun);
  MPI_Finalized(&done);
  if (begun && !done) MPI_Finalize();
}

int comm_rank() { return rank; }
int comm_size() { return nranks; }
int comm_started() { return started; }

bool comm_keep(int n)
{
  if (n >= nranks) return true;
  const bool works = rank < n;
  MPI_Comm_split(MPI_COMM_WORLD, works ? 0 : MPI_UNDEFINED, rank, &world);
  nranks = works ? n : 1;
  return works;
}

int comm_end(int code)
{
  if (started == nranks) return code;
  const timespec nap = {0, 10 * 1000 * 1000};        // 0.01 s: MPI_Wait would keep the core busy
  MPI_Request request;
  MPI_Ibcast(&code, 1, MPI_INT, 0, MPI_COMM_WORLD, &request);
  for (int done = 0; !done;) {
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    if (!done) nanosleep(&nap, nullptr);
  }
  return code;
}
long comm_piece() { return piece; }

int comm_fortran(bool all)
{
  int begun = 0;
  MPI_Initialized(&begun);
  if (!begun) MPI_Init(nullptr, nullptr);
  return MPI_Comm_c2f(all && nranks > 1 ? world : MPI_COMM_SELF);
}

CommAlone::CommAlone() : rank(::rank), size(::nranks)
{
  ::rank = 0;
  ::nranks = 1;
}

CommAlone::~CommAlone()
{
  ::rank = rank;
  ::nranks = size;
}

void comm_stop(int code)
{
  lock_release();
  if (started > 1) MPI_Abort(MPI_COMM_WORLD, code);
  std::exit(code);
}

void comm_bcast(double* x, int n)
{
  if (nranks == 1) return;
  Timer timer(PHASE_COMM);
  broadcast(x, 8L * n, 0);
}

void comm_bcast(std::string& bytes)
{
  if (nranks == 1) return;
  Timer timer(PHASE_COMM);
  long length = static_cast<long>(bytes.size());
  MPI_Bcast(&length, 1, MPI_LONG, 0, world);
  bytes.resize(length);
  broadcast(&bytes[0], length, 0);
}

int comm_bcast(int x)
{
  if (nranks == 1) return x;
  Timer timer(PHASE_COMM);
  MPI_Bcast(&x, 1, MPI_INT, 0, world);
  return x;
}

void comm_send(const std::string& bytes, int to)
{
  Timer timer(PHASE_COMM);
  const long length = static_cast<long>(bytes.size());
  MPI_Send(&length, 1, MPI_LONG, to, 0, world);
  each_piece(length, [&](long at, int n) {
    MPI_Send(bytes.data() + at, n, MPI_BYTE, to, 0, world);
  });
}

void comm_receive(std::string& bytes, int from)
{
  Timer timer(PHASE_COMM);
  long length = 0;
  MPI_Recv(&length, 1, MPI_LONG, from, 0, world, MPI_STATUS_IGNORE);
  bytes.resize(static_cast<size_t>(length));
  each_piece(length, [&](long at, int n) {
    MPI_Recv(&bytes[at], n, MPI_BYTE, from, 0, world, MPI_STATUS_IGNORE);
  });
}

int comm_allreduce_max(int x)
{
  if (nranks == 1) return x;
  Timer timer(PHASE_COMM);
  int most = x;
  MPI_Allreduce(&x, &most, 1, MPI_INT, MPI_MAX, world);
  return most;
}

void comm_sum(double* x, long n)
{
  if (nranks == 1) return;
  Timer timer(PHASE_COMM);
  // two ranks: slices would send as many numbers in two messages
  const bool small = nranks == 2 || n * nranks < SHORT;
  each_piece(8 * n, [&](long at, int bytes) { (small ? sum_short : sum_slices)(x + at / 8, bytes / 8); });
}

void comm_max(double* x, long n)
{
  if (nranks == 1) return;
  Timer timer(PHASE_COMM);
  each_piece(8 * n, [&](long at, int bytes) {
    MPI_Allreduce(MPI_IN_PLACE, x + at / 8, bytes / 8, MPI_DOUBLE, MPI_MAX, world);
  });
}

void comm_exchange(const std::vector<RealVec>& to, std::vector<RealVec>& from)
{
  Timer timer(PHASE_COMM);
  std::vector<MPI_Request> request;
  for (int r = 0; r < nranks; ++r)
    if (r != rank) receive(from[r].data(), 8L * static_cast<long>(from[r].size()), r, request);
  for (int r = 0; r < nranks; ++r)
    if (r != rank) send(to[r].data(), 8L * static_cast<long>(to[r].size()), r, request);
  wait_all(request);
}

void comm_allgatherv(RealVec& x, const IntVec& count)
{
  if (nranks == 1) return;
  Timer timer(PHASE_COMM);
  if (8 * static_cast<long>(x.size()) > piece) {     // MPI's offsets are int too
    long at = 0;
    for (int r = 0; r < nranks; at += count[r++]) broadcast(x.data() + at, 8L * count[r], r);
    return;
  }
  IntVec first(nranks, 0);
  for (int r = 1; r < nranks; ++r) first[r] = first[r - 1] + count[r - 1];
  MPI_Allgatherv(MPI_IN_PLACE, 0, MPI_DOUBLE, x.data(), count.data(), first.data(), MPI_DOUBLE,
                 world);
}

std::vector<long> comm_counts(const std::vector<long>& out)
{
  Timer timer(PHASE_COMM);
  std::vector<long> in(out);
  MPI_Alltoall(out.data(), 1, MPI_LONG, in.data(), 1, MPI_LONG, world);
  return in;
}

void comm_raw(const std::vector<const void*>& to, const std::vector<long>& out,
              const std::vector<void*>& from, const std::vector<long>& in)
{
  Timer timer(PHASE_COMM);
  std::vector<MPI_Request> request;
  for (int r = 0; r < nranks; ++r)
    if (r != rank) receive(from[r], in[r], r, request);
  for (int r = 0; r < nranks; ++r)
    if (r != rank) send(to[r], out[r], r, request);
  if (in[rank] > 0) std::memcpy(from[rank], to[rank], static_cast<size_t>(in[rank]));
  wait_all(request);
}

#else

void comm_open(int*, char***) {}
void comm_close() {}
int comm_rank() { return 0; }
int comm_size() { return 1; }
int comm_started() { return 1; }
bool comm_keep(int) { return true; }
int comm_end(int code) { return code; }
int comm_fortran(bool) { return -987654; }           // MUMPS without MPI
void comm_stop(int code) { std::exit(code); }
CommAlone::CommAlone() : rank(0), size(1) {}
CommAlone::~CommAlone() {}
void comm_bcast(double*, int) {}
void comm_bcast(std::string&) {}
int comm_bcast(int x) { return x; }
void comm_send(const std::string&, int) {}
void comm_receive(std::string&, int) {}
int comm_allreduce_max(int x) { return x; }
long comm_piece() { return 1L << 30; }
void comm_sum(double*, long) {}
void comm_max(double*, long) {}
void comm_exchange(const std::vector<RealVec>&, std::vector<RealVec>&) {}
void comm_allgatherv(RealVec&, const IntVec&) {}
std::vector<long> comm_counts(const std::vector<long>& out) { return out; }
void comm_raw(const std::vector<const void*>&, const std::vector<long>&, const std::vector<void*>&,
              const std::vector<long>&)
{
}

#endif
