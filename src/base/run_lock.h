// ---------------------------------------------------------------------------
// run_lock.h : one run in a place at a time
//
// JOB.lock names the host and the process of the run that writes JOB.*. The run holds it by flock, which ends
// with the process, however that ends; the file is removed when the run ends by itself. A lock that a crash
// has left on this host is taken over with a word. One of another host, where flock may not be seen, is not:
// the user decides.
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_RUN_LOCK_H
#define MPFE_BASE_RUN_LOCK_H

#include <string>

// lock_take : makes the lock file. False: another run has it, or it cannot be made; message says why and how
// to go on. True: message is empty, or tells what was taken over.
bool lock_take(const std::string& path, std::string& message);

// lock_held : does a run hold it now? owner: its process and host, in words
bool lock_held(const std::string& path, std::string& owner);

// lock_release : removes the file; nothing when there is none of this process
void lock_release();

#endif
