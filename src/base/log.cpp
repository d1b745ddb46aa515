#include "base/log.h"

#include <cstdarg>
#include <set>
#include <string>

#include "base/comm.h"
#include "base/types.h"

namespace {

std::FILE* listing = nullptr;
bool muted = false, keeping = false, repeating = false;
std::string kept;              // texts of this rank, each terminated by a zero
std::set<std::string> heard;   // texts of the first rank while the others keep theirs
int warnings = 0;

void say(const std::string& text, bool terminal)
{
  if (listing) std::fprintf(listing, "%s\n", text.c_str());
  if (terminal) std::fprintf(stderr, "%s\n", text.c_str());
}

void put(const char* word, bool terminal, const char* format, va_list args)
{
  const bool note = keeping && terminal;
  if (repeating || (muted && !note)) return;
  va_list copy;
  va_copy(copy, args);
  std::string text(static_cast<size_t>(std::vsnprintf(nullptr, 0, format, copy)) + 1, ' ');
  va_end(copy);
  std::vsnprintf(&text[0], text.size(), format, args);
  text = word + std::string(text.c_str());
  if (note && heard.insert(text).second && muted) kept += text + '\0';
  if (!muted) say(text, terminal);
}

}  // namespace

void log_open(std::FILE* file) { listing = file; }
void log_mute(bool mute) { muted = mute; }
void log_keep(bool keep) { keeping = keep; }
void log_repeat(bool repeat) { repeating = repeat; }

void log_gather()
{
  if (!keeping || comm_allreduce_max(static_cast<int>(!kept.empty())) == 0) return;
  std::vector<std::string> to(comm_size());
  to[0].swap(kept);
  for (const std::string& all : comm_exchange(to))
    for (size_t at = 0; at < all.size(); at = all.find('\0', at) + 1) {
      const std::string text = all.c_str() + at;
      if (!heard.insert(text).second) continue;
      say(text, true);
      ++warnings;
    }
}

void log_note(const char* format, ...)
{
  va_list args;
  va_start(args, format);
  put("", false, format, args);
  va_end(args);
}

void log_warn(const char* format, ...)
{
  warnings += !repeating;
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
