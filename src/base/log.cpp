#include "base/log.h"

#include <cstdarg>

#include "base/comm.h"
#include "base/types.h"

namespace {

std::FILE* listing = nullptr;
bool muted = false;
int warnings = 0;

void put(const char* word, bool terminal, const char* format, va_list args)
{
  if (muted) return;
  if (listing) {
    va_list copy;
    va_copy(copy, args);
    std::fputs(word, listing);
    std::vfprintf(listing, format, copy);
    std::fputc('\n', listing);
    va_end(copy);
  }
  if (terminal) {
    std::fputs(word, stderr);
    std::vfprintf(stderr, format, args);
    std::fputc('\n', stderr);
  }
}

}  // namespace

void log_open(std::FILE* file) { listing = file; }
void log_mute(bool mute) { muted = mute; }

void log_note(const char* format, ...)
{
  va_list args;
  va_start(args, format);
  put("", false, format, args);
  va_end(args);
}

void log_warn(const char* format, ...)
{
  ++warnings;
  va_list args;
  va_start(args, format);
  put("WARNING  ", true, format, args);
  va_end(args);
}

void log_error(const char* format, ...)
{
  va_list args;
  va_start(args, format);
  put("ERROR  ", true, format, args);
  va_end(args);
}

int log_warnings() { return warnings; }

void log_bug(const char* message, const char* file, int line)
{
  log_mute(false);
  log_error("internal: %s (%s:%d). This is a bug, please report it.", message, file, line);
  if (listing) std::fflush(listing);
  comm_stop(EXIT_BUG);
}
