// ---------------------------------------------------------------------------
// log.h : messages of the run. The listing (out/) and the terminal read them.
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_LOG_H
#define MPFE_BASE_LOG_H

#include <cstdio>

// log_open : from now on messages also go to this file; null: terminal only
void log_open(std::FILE* listing);

// log_mute : switches the output of log_note, log_warn and log_error off (on ranks other than the first) or
// on
void log_mute(bool mute);

// log_repeat : messages from now on repeat earlier ones: they are not printed, kept or counted
void log_repeat(bool repeat);

// log_keep : keeps warnings and errors of a mute rank for log_gather
// log_gather : the first rank prints the messages kept by the others, each text once. Collective.
void log_keep(bool keep);
void log_gather();

// log_note : listing only.  log_warn, log_error : listing and stderr, with the word in front
void log_note(const char* format, ...) __attribute__((format(printf, 1, 2)));
void log_warn(const char* format, ...) __attribute__((format(printf, 1, 2)));
void log_error(const char* format, ...) __attribute__((format(printf, 1, 2)));
int log_warnings();

// log_bug : error of the program: message, file, line, exit code EXIT_BUG; also on mute ranks
#define MPFE_CHECK(condition, message) \
  do { if (!(condition)) log_bug(message, __FILE__, __LINE__); } while (0)
[[noreturn]] void log_bug(const char* message, const char* file, int line);

#endif
