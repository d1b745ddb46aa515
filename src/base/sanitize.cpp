// Settings of the sanitizers (make MACHINE=debug); without them this file is empty.
#ifdef __SANITIZE_ADDRESS__

// Open MPI and hwloc do not free their memory, and memory that mpfe holds at its end is no leak. A fault must
// not look like a failed check, whose exit code is 1.
extern "C" const char* __asan_default_options();
const char* __asan_default_options() { return "detect_leaks=0:exitcode=99"; }

#endif
