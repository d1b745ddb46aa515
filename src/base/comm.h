// ---------------------------------------------------------------------------
// comm.h : ranks of the run. Without MPFE_MPI: one rank, nothing to open.
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_COMM_H
#define MPFE_BASE_COMM_H

// comm_open, comm_close : once each, around everything that uses the other routines or MUMPS
void comm_open(int* argc, char*** argv);
void comm_close();

int comm_rank();   // 0 ... comm_size()-1
int comm_size();

// comm_share : x [n] of rank 0 to all ranks
void comm_share(double* x, int n);

#endif
