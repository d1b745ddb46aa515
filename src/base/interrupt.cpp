#include "base/interrupt.h"

#include <csignal>
#include <ctime>
#include <initializer_list>

#include "base/comm.h"

namespace {

// seconds: a queue and mpirun may both send the signal that ends a run
const std::time_t TOGETHER = 3;

volatile std::sig_atomic_t seen = 0;
std::time_t when = 0;

// the second one ends the program
void note(int number)
{
  const std::time_t now = std::time(nullptr);
  if (seen && (comm_started() == 1 || now - when > TOGETHER)) {
    std::signal(number, SIG_DFL);
    std::raise(number);              // delivered when this routine returns
    return;
  }
  if (!seen) when = now;
  seen = number;
}

}  // namespace

void interrupt_watch()
{
  std::signal(SIGXFSZ, SIG_IGN);         // a limit of file sizes is reported as a full disk is
  for (int number : {SIGINT, SIGTERM, SIGUSR1, SIGUSR2}) {
    struct sigaction now;
    if (sigaction(number, nullptr, &now) != 0 || now.sa_handler == SIG_IGN) continue;
    struct sigaction then = {};
    then.sa_handler = note;
    then.sa_flags   = SA_RESTART;
    sigemptyset(&then.sa_mask);
    sigaction(number, &then, nullptr);
  }
}

int interrupt_signal() { return seen; }
void interrupt_note(int number) { seen = number; }

void interrupt_finish()
{
  if (!seen) return;
  std::signal(seen, SIG_DFL);
  std::raise(seen);
}
