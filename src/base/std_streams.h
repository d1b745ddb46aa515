// ---------------------------------------------------------------------------
// std_streams.h : stdin, stdout, stderr of the program
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_STD_STREAMS_H
#define MPFE_BASE_STD_STREAMS_H

// streams_open : first of all. Streams that the caller has closed (>&- 2>&-) become /dev/null: else the first
// files that are opened would take their numbers, and messages would go into results.
void streams_open();

// streams_good : has stdout taken all that was written? false: a full disk, told on stderr
bool streams_good();

#endif
