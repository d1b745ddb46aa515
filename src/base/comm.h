// ---------------------------------------------------------------------------
// comm.h : ranks of the run. Without MPFE_MPI: one rank, nothing to open.
//
// Routines marked collective are called by all ranks, in the same order. On one rank they return at once.
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_COMM_H
#define MPFE_BASE_COMM_H

#include <cstring>
#include <string>
#include <type_traits>

#include "base/types.h"

// comm_open, comm_close : once each, around everything that uses the other routines or MUMPS
void comm_open(int* argc, char*** argv);
void comm_close();

int comm_rank();   // 0 ... comm_size()-1
int comm_size();   // working ranks
int comm_started();      // ranks started by the launcher

// comm_keep : only ranks 0 ... n-1 work from now on; false on the others, which must call comm_end and
// nothing else of this header. Collective.
bool comm_keep(int n);

// comm_end : exit code of rank 0 on all ranks; idle ranks sleep until then. At the end of the program.
int comm_end(int code);

// comm_fortran : Fortran handle of the communicator of all ranks, or of this rank alone (MUMPS)
int comm_fortran(bool all);

// CommAlone : until the end of its block this rank acts as the only one; routines there are not collective
struct CommAlone {
  CommAlone();
  ~CommAlone();
  CommAlone(const CommAlone&) = delete;
  CommAlone& operator=(const CommAlone&) = delete;
  int rank, size;
};

// comm_stop : aborts this rank and all others, when they can no longer agree on an orderly end
[[noreturn]] void comm_stop(int code);

// comm_bcast : copies the value of rank 0 to all ranks. Collective.
void comm_bcast(double* x, int n);
void comm_bcast(std::string& bytes);
int comm_bcast(int x);

// comm_send, comm_receive : bytes to one rank, and from one; both block until the transfer
void comm_send(const std::string& bytes, int to);
void comm_receive(std::string& bytes, int from);

// comm_allreduce_max : maximum of x over the ranks. Collective.
int comm_allreduce_max(int x);

// comm_sum : sum over the ranks, in their order, so that all get the same bits in every run. Collective.
void comm_sum(double* x, long n);
inline void comm_sum(RealVec& x) { comm_sum(x.data(), static_cast<long>(x.size())); }

// comm_max : maximum over the ranks of each of the n numbers, on all ranks. Collective.
void comm_max(double* x, long n);
inline double comm_allreduce_max(double x)
{
  comm_max(&x, 1);
  return x;
}

// comm_exchange : sends to[r] to rank r, receives from[r] from it, of the given size. Collective.
void comm_exchange(const std::vector<RealVec>& to, std::vector<RealVec>& from);

// comm_allgatherv : x holds count[r] numbers of rank r, rank by rank; on entry each rank has set its own.
// Collective.
void comm_allgatherv(RealVec& x, const IntVec& count);

// comm_piece : maximum bytes of a message; MPFE_COMM_PIECE in the environment reduces it, for tests
long comm_piece();

// comm_counts : sends out[r] to rank r; returns the numbers received from the ranks. Collective.
std::vector<long> comm_counts(const std::vector<long>& out);

// comm_raw : sends out[r] bytes at to[r] to rank r, receives in[r] bytes from it at from[r]; bytes of this
// rank are copied. Collective.
void comm_raw(const std::vector<const void*>& to, const std::vector<long>& out,
              const std::vector<void*>& from, const std::vector<long>& in);

// comm_exchange : sends to[r] to rank r; returns what was received from each rank: vectors of plain numbers
// or structs, or strings, of any length. Collective.
template <class Box>
std::vector<Box> comm_exchange(const std::vector<Box>& to)
{
  using T = typename Box::value_type;
  static_assert(std::is_trivially_copyable<T>::value, "comm_exchange sends bytes");
  if (comm_size() == 1) return to;
  const long size = static_cast<long>(sizeof(T));
  std::vector<const void*> source;
  std::vector<void*> target;
  std::vector<long> out, in;
  for (const Box& x : to) {
    source.push_back(x.data());
    out.push_back(size * static_cast<long>(x.size()));
  }
  in = comm_counts(out);
  std::vector<Box> from(to.size());
  for (std::size_t r = 0; r < to.size(); ++r) {
    from[r].resize(static_cast<std::size_t>(in[r] / size));
    target.push_back(from[r].data());
  }
  comm_raw(source, out, target, in);
  return from;
}

// comm_allgatherv : concatenates the vectors of all ranks, in the order of the ranks, on all ranks.
// Collective.
template <class T>
void comm_allgatherv(std::vector<T>& x)
{
  if (comm_size() == 1) return;
  const std::vector<std::vector<T>> from = comm_exchange(std::vector<std::vector<T>>(comm_size(), x));
  x.clear();
  for (const std::vector<T>& part : from) x.insert(x.end(), part.begin(), part.end());
}

// comm_gather : [ranks] on rank 0 the vectors of all ranks, elsewhere nothing. Collective.
template <class T>
std::vector<std::vector<T>> comm_gather(std::vector<T> x)
{
  std::vector<std::vector<T>> to(comm_size());
  to[0].swap(x);
  return comm_exchange(to);
}

#endif
