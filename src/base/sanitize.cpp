// Settings of the sanitizers (make MACHINE=debug); without them this file is empty.
#ifdef __SANITIZE_ADDRESS__

// Open MPI and hwloc never give back what they hold; what mpfe holds at its end costs nothing. A fault must
// not look like a failed check, whose exit code is 1.
extern "C" const char* __asan_default_options();
const char* __asan_default_options() { return "detect_leaks=0:exitcode=99"; }

#endif
