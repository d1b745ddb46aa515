#include "base/std_streams.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <initializer_list>

#include "base/log.h"

void streams_open()
{
  for (int number : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (fcntl(number, F_GETFD) == -1 && errno == EBADF) {
      const int handle = open("/dev/null", O_RDWR);      // the lowest number that is free
      if (handle >= 0 && handle != number) {
        dup2(handle, number);
        close(handle);
      }
    }
}

bool streams_good()
{
  errno = 0;
  if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return true;
  log_error("cannot write to the standard output: %s. Check the free space of the disk.",
            errno ? std::strerror(errno) : "the disk refused the data");
  return false;
}
