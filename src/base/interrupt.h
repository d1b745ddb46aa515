// ---------------------------------------------------------------------------
// interrupt.h : Ctrl-C, kill and the signals of queues end the run after the current increment,
// with all files complete
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_INTERRUPT_H
#define MPFE_BASE_INTERRUPT_H

// interrupt_watch : from now on SIGINT, SIGTERM, SIGUSR1 and SIGUSR2 (the latter two are forwarded by mpirun)
// are only recorded; a second signal ends the program at once, on several ranks only some seconds later.
// Signals that the user ignores (nohup) remain ignored.
void interrupt_watch();

// interrupt_signal : number of the signal received, 0: none
int interrupt_signal();

// interrupt_note : records a signal received by another rank
void interrupt_note(int number);

// interrupt_finish : ends the program by the signal received, so that the shell sees it;
// returns if there was none
void interrupt_finish();

#endif
