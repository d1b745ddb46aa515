// ---------------------------------------------------------------------------
// std_streams.h : stdin, stdout, stderr of the program
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_STD_STREAMS_H
#define MPFE_BASE_STD_STREAMS_H

// streams_open : first of all. Opens streams closed by the caller (>&- 2>&-) as /dev/null: otherwise the
// first files opened would get their numbers, and messages would be written into results.
void streams_open();

// streams_good : was all output to stdout written? false: a full disk, reported on stderr
bool streams_good();

#endif
