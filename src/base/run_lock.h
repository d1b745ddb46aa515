// ---------------------------------------------------------------------------
// run_lock.h : prevents two runs from writing the same files
//
// JOB.lock contains host and process of the run that writes JOB.*. The run holds it by flock, which is
// released with the process in any case; the file is removed at a regular end. A lock left on this host by a
// crash is taken over with a message. A lock of another host, where flock may not be visible,
// is not: the user decides.
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_RUN_LOCK_H
#define MPFE_BASE_RUN_LOCK_H

#include <string>

// lock_take : creates the lock file. False: another run has it, or it cannot be created; message gives reason
// and remedy. True: message is empty, or says which lock was taken over.
bool lock_take(const std::string& path, std::string& message);

// lock_held : does a run hold it at present? owner: its process and host, in words
bool lock_held(const std::string& path, std::string& owner);

// lock_release : removes the file, if this process has created it
void lock_release();

#endif
