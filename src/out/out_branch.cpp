#include "out/out_branch.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <set>

#include "base/log.h"

namespace fs = std::filesystem;

namespace {

fs::path folder_of(const std::string& path)
{
  const fs::path folder = fs::path(path).parent_path();
  return folder.empty() ? fs::path(".") : folder;
}

bool is_other(const fs::path& a, const fs::path& b)
{
  std::error_code error;
  return !fs::equivalent(a, b, error);
}

// text without a trailing _ and digits after the letters of `word`: "JOB_000123" with "" is "JOB"
std::string without_number(const std::string& text, const std::string& word)
{
  std::size_t k = text.size();
  while (k > 0 && std::isdigit(static_cast<unsigned char>(text[k - 1]))) --k;
  const std::string head = "_" + word;
  if (k == text.size() || k < head.size()) return text;
  const std::string before = text.substr(0, k - head.size());
  return text.compare(before.size(), head.size(), head) == 0 ? before : text;
}

// a table of sufficient length in the folder of the restart file: with its name, with that name without the
// number of the increment, or with the name of the deck. Empty: none
std::string table_beside(const Model& m, const Output& out, const std::string& ending, long length)
{
  const fs::path folder = folder_of(out.from);
  const std::string name = fs::path(out.from).stem().string();
  for (const std::string& job : {name, without_number(name, ""), m.job}) {
    const std::string path = (folder / (job + "." + ending)).string();
    std::error_code error;
    const std::uintmax_t size = fs::file_size(path, error);
    if (!error && size >= static_cast<std::uintmax_t>(length)) return path;
  }
  return "";
}

// the first bytes of a table
void copy_lines(const std::string& from, const std::string& path, long length)
{
  std::FILE* source = std::fopen(from.c_str(), "rb");
  std::FILE* file   = out_file_open(path);
  std::vector<char> bytes(1 << 20);
  for (long left = length; source && left > 0;) {
    const long most     = std::min(left, static_cast<long>(bytes.size()));
    const std::size_t n = std::fread(bytes.data(), 1, static_cast<std::size_t>(most), source);
    if (n == 0) break;
    std::fwrite(bytes.data(), 1, n, file);
    left -= static_cast<long>(n);
  }
  if (source) std::fclose(source);
  out_file_close(file, path);
}

// JOB_fe_000012.vtk, and a piece JOB_fe_000012_r3.vtu, belong to the frame JOB_fe_000012
std::string frame_of(const fs::path& file) { return without_number(file.stem().string(), "r"); }

void copy_frames(const std::set<std::string>& frames, const fs::path& from, const fs::path& to)
{
  std::error_code error;
  std::vector<fs::path> found;
  for (const fs::directory_entry& e : fs::directory_iterator(from, error)) {
    const std::string ending = e.path().extension().string();
    if (ending != ".vtk" && ending != ".vtu" && ending != ".pvtu") continue;
    if (frames.count(e.path().stem().string()) || frames.count(frame_of(e.path()))) found.push_back(e.path());
  }
  for (const fs::path& file : found) {
    fs::copy_file(file, to / file.filename(), fs::copy_options::overwrite_existing, error);
    if (error) log_warn("%s cannot be copied: %s", file.c_str(), error.message().c_str());
  }
}

}  // namespace

void branch_table(const Model& m, const Output& out, const char* ending, long length, std::FILE*& file)
{
  const std::string path = out.base + "." + ending;
  std::error_code error;
  if (length < 0) {
    fs::remove(path, error);
    return;
  }
  const std::string beside = table_beside(m, out, ending, length);
  if (!beside.empty() && is_other(beside, path)) {
    copy_lines(beside, path, length);
  } else {
    const std::uintmax_t now = fs::file_size(path, error);
    if (error || now < static_cast<std::uintmax_t>(length)) {
      log_warn("%s begins here: its first %ld bytes are neither in this folder nor beside %s", path.c_str(),
               length, out.from.c_str());
      return;
    }
    fs::resize_file(path, static_cast<std::uintmax_t>(length), error);
  }
  file = out_file_open(path, true);
}

void branch_frames(const Model& m, Output& out)
{
  if (!m.output.vtk.on) return;
  const fs::path here = folder_of(out.base), there = folder_of(out.from);
  std::set<std::string> frames;
  for (const VtkSeries& s : out.series)
    for (const std::string& file : s.file) frames.insert(fs::path(file).stem().string());
  if (is_other(here, there)) copy_frames(frames, there, here);
  std::size_t missing = 0;
  for (VtkSeries& s : out.series) {
    VtkSeries kept;
    for (std::size_t i = 0; i < s.file.size(); ++i) {
      if (!fs::exists(here / s.file[i])) {
        ++missing;
        continue;
      }
      kept.file.push_back(s.file[i]);
      kept.time.push_back(s.time[i]);
    }
    s = kept;
  }
  if (missing > 0)
    log_warn("%zu files of earlier frames (*VTK) are neither in this folder nor beside %s: the series begin "
             "without them",
             missing, out.from.c_str());
}
