#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "base/comm.h"
#include "base/log.h"
#include "out/out.h"

namespace {

[[noreturn]] void stop(const std::string& path, const char* what, int code)
{
  log_error("cannot %s %s: %s. Check the folder, its permissions and the free space of the disk.",
            what, path.c_str(), code ? std::strerror(code) : "the disk refused the data");
  comm_stop(EXIT_RESOURCE);
}

}  // namespace

std::FILE* out_file_open(const std::string& path, bool append)
{
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  std::error_code error;
  if (!folder.empty()) std::filesystem::create_directories(folder, error);
  errno = 0;
  std::FILE* file = std::fopen(path.c_str(), append ? "ab" : "wb");
  if (!file) stop(path, "open", error ? error.value() : errno);
  return file;
}

std::FILE* out_file_first(const std::string& path, bool append)
{
  return comm_rank() == 0 ? out_file_open(path, append) : out_file_open("/dev/null");
}

void out_file_flush(std::FILE* file, const std::string& path)
{
  errno = 0;
  if (std::fflush(file) != 0 || std::ferror(file)) stop(path, "write", errno);
}

void out_file_sync(std::FILE* file, const std::string& path)
{
  out_file_flush(file, path);
  errno = 0;
  // EINVAL: not a file on a disk
  if (fsync(fileno(file)) != 0 && errno != EINVAL) stop(path, "write", errno);
}

void out_file_cut(std::FILE* file, long length, const std::string& path)
{
  out_file_flush(file, path);
  errno = 0;
  if (ftruncate(fileno(file), length) != 0 || std::fseek(file, length, SEEK_SET) != 0)
    stop(path, "write", errno);
}

void out_file_close(std::FILE*& file, const std::string& path)
{
  if (!file) return;
  out_file_flush(file, path);
  std::fclose(file);
  file = nullptr;
}
