#include "base/run_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>

namespace {

int handle = -1;               // of the open lock file
std::string lock_path;         // of this run

std::string host_name()
{
  char name[256] = "";
  gethostname(name, sizeof name - 1);
  return *name ? name : "unknown";
}

// "host NAME process NUMBER"; false: no such text, a run was killed before it wrote it
bool read_owner(int file, std::string& host, long& process)
{
  char text[600] = "", name[300] = "";
  const ssize_t n = pread(file, text, sizeof text - 1, 0);
  if (n <= 0 || std::sscanf(text, "host %299s process %ld", name, &process) != 2) return false;
  host = name;
  return true;
}

bool write_owner(int file)
{
  const std::string text = "host " + host_name() + " process " + std::to_string(getpid()) + "\n";
  return ftruncate(file, 0) == 0 &&
         pwrite(file, text.data(), text.size(), 0) == static_cast<ssize_t>(text.size());
}

// is the open file still the one at this path? Its owner may have removed it in between
bool same_file(int file, const std::string& path)
{
  struct stat opened, there;
  return fstat(file, &opened) == 0 && stat(path.c_str(), &there) == 0 && opened.st_dev == there.st_dev &&
         opened.st_ino == there.st_ino;
}

bool alive(long process) { return kill(static_cast<pid_t>(process), 0) == 0 || errno == EPERM; }

bool refuse(const std::string& path, const std::string& host, long process, std::string& message)
{
  message = "another run writes to the same files: process " + std::to_string(process) + " on " + host +
            " holds " + path +
            ". Wait for its end, or take another folder (-o) or another name of the deck. If that process no "
            "longer exists, after a crash, "
            "remove " +
            path + " and start again; *RESTART, READ goes on from its restart file";
  return false;
}

bool fail(const std::string& path, int code, std::string& message)
{
  message = "cannot open " + path + ": " + std::strerror(code) +
            ". Check the folder, its permissions and the free space of the disk.";
  return false;
}

enum Taken { TAKEN, REFUSED, AGAIN };

// one attempt; AGAIN: the file was removed by its owner meanwhile
Taken try_lock(const std::string& path, std::string& message)
{
  const int file = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (file < 0) return fail(path, errno, message), REFUSED;
  std::string host;
  long process     = 0;
  const bool free  = flock(file, LOCK_EX | LOCK_NB) == 0;
  // neither: no flock on this disk, only the text of the file is available
  const bool taken = !free && errno == EWOULDBLOCK;
  if (free && !same_file(file, path)) return close(file), AGAIN;
  const bool owned = read_owner(file, host, process);
  const bool here  = host == host_name();
  const bool dead  = here && (free || !alive(process));
  if (taken || (owned && !dead)) {
    refuse(path, owned ? host : "this or another machine", process, message);
    return close(file), REFUSED;
  }
  if (owned)
    message = "process " + std::to_string(process) + " on this machine has left " + path +
              " behind when it was ended: taken over";
  if (!write_owner(file)) {
    fail(path, errno, message);
    return close(file), REFUSED;
  }
  handle = file;
  lock_path = path;
  return TAKEN;
}

}  // namespace

bool lock_take(const std::string& path, std::string& message)
{
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  std::error_code error;
  if (!folder.empty()) std::filesystem::create_directories(folder, error);
  if (error) return fail(path, error.value(), message);
  for (int k = 0; k < 100; ++k) {
    message.clear();
    const Taken answer = try_lock(path, message);
    if (answer == AGAIN) continue;
    if (answer == TAKEN) std::atexit(lock_release);
    return answer == TAKEN;
  }
  return fail(path, EAGAIN, message);
}

bool lock_held(const std::string& path, std::string& owner)
{
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  std::string host;
  long process    = 0;
  const bool named = read_owner(file, host, process);
  owner = named ? "process " + std::to_string(process) + " on " + host : "it has just begun";
  const bool dead = named && host == host_name() && !alive(process);
  // a lock without a process was left by a crash; one without a name is about to get it
  const bool free = named && !dead && flock(file, LOCK_SH | LOCK_NB) == 0;
  close(file);
  return !dead && !free;
}

void lock_release()
{
  if (handle < 0) return;
  unlink(lock_path.c_str());
  close(handle);
  handle = -1;
}
