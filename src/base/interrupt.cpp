#include "base/interrupt.h"

#include <csignal>
#include <initializer_list>

namespace {

volatile std::sig_atomic_t seen = 0;

void note(int number) { seen = number; }

}  // namespace

void interrupt_watch()
{
  for (int number : {SIGINT, SIGTERM}) {
    struct sigaction now;
    if (sigaction(number, nullptr, &now) != 0 || now.sa_handler == SIG_IGN) continue;
    struct sigaction then = {};
    then.sa_handler = note;
    then.sa_flags   = SA_RESETHAND | SA_RESTART;
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
