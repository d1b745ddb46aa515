// ---------------------------------------------------------------------------
// interrupt.h : Ctrl-C, kill and the signals of queues end the run after the increment that is under way,
// with all files complete
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_INTERRUPT_H
#define MPFE_BASE_INTERRUPT_H

// interrupt_watch : from now on SIGINT, SIGTERM, SIGUSR1 and SIGUSR2 (which mpirun hands on, other than the
// first two) are only noted; a second one ends the program at once, on several ranks not within seconds.
// Signals that the user has switched off (nohup) stay off.
void interrupt_watch();

// interrupt_signal : number of the signal that has come, 0: none
int interrupt_signal();

// interrupt_note : a signal that another rank has seen
void interrupt_note(int number);

// interrupt_finish : ends the program by the signal that has come, so that the shell sees it; returns when
// none has
void interrupt_finish();

#endif
