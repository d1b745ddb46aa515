#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>

#include "base/comm.h"
#include "base/hash.h"
#include "base/log.h"
#include "base/timer.h"
#include "base/version.h"
#include "contact/contact_masters.h"
#include "model/state_fits.h"
#include "model/state_io.h"
#include "model/state_number.h"
#include "model/state_window.h"
#include "out/out.h"
#include "out/out_branch.h"

IO_FIELDS(VtkSeries, file, time)
IO_FIELDS(CheckResult, done, pass, name, source, message, value, target, difference, tolerance)

// state of the output; JOB.his is written again from its rows
static void io(Archive& f, Output& x)
{
  io_all(f, x.history.names, x.history.rows, x.row_written, x.series, x.vtk_frame, x.vtk_time.next,
         x.vtk_time.inc, x.frag_time.next, x.frag_time.inc, x.result, x.restart_time.next);
}

namespace {

const char* const magic = "MPFE-RST";      // 8 letters
const int format = 45;                     // of the content; changes with every change of a struct in it

struct FileHead {                 // precedes the content
  char magic[8];
  std::uint64_t size = 0;      // of the content
  std::uint64_t hash = 0;      // of the content
};

// ---- the content ------------------------------------------------------------

struct Origin {                // what a file belongs to
  int format = 0;
  std::string version;
  std::uint64_t deck = 0;      // cards outside steps
  std::vector<std::uint64_t> step;     // Step::hash of the steps that have begun
};

IO_FIELDS(Origin, number, version, deck, step)

struct Lengths {               // of the files that are continued, -1: does not exist yet
  long dat = -1, ero = -1, frag = -1;
};

// Output::near as numbers, 11 per face
RealVec numbers_of(const std::vector<NearFace>& near)
{
  RealVec x;
  for (const NearFace& f : near) {
    x.insert(x.end(), {static_cast<double>(f.elem), static_cast<double>(f.def),
                       static_cast<double>(f.side), static_cast<double>(f.point), f.size});
    x.insert(x.end(), f.box.lo, f.box.lo + 3);
    x.insert(x.end(), f.box.hi, f.box.hi + 3);
  }
  return x;
}

std::vector<NearFace> faces_of(const RealVec& x)
{
  std::vector<NearFace> near(x.size() / 11);
  for (std::size_t k = 0; k < near.size(); ++k) {
    const double* of = &x[11 * k];
    near[k].elem  = static_cast<int>(of[0]);
    near[k].def   = static_cast<int>(of[1]);
    near[k].side  = static_cast<int>(of[2]);
    near[k].point = static_cast<int>(of[3]);
    near[k].size  = of[4];
    std::copy_n(of + 5, 3, near[k].box.lo);
    std::copy_n(of + 8, 3, near[k].box.hi);
  }
  return near;
}

void io_content(Archive& f, Lengths& length, State& s, ActiveGrid& grid, Output& out)
{
  io_all(f, s, grid.ncell, grid.cell, length.dat, length.ero, length.frag, out);
}

// ---- writing -------------------------------------------------------------------

// renames a complete file to its final name, and syncs the folder
void rename_file(const std::string& fresh, const std::string& path)
{
  if (std::rename(fresh.c_str(), path.c_str()) != 0)
    log_warn("%s cannot be renamed: %s", fresh.c_str(), std::strerror(errno));
  const std::string folder = std::filesystem::path(path).parent_path().string();
  const int handle = open(folder.empty() ? "." : folder.c_str(), O_RDONLY);
  if (handle < 0) return;
  fsync(handle);
  close(handle);
}

// begins a file with a header that is completed once the content is known
void begin_file(const std::string& fresh, Archive& f)
{
  FileHead frame = {};
  f.filed = true;
  if (comm_rank() > 0) return;
  f.file = out_file_open(fresh);
  std::fwrite(&frame, sizeof frame, 1, f.file);
}

void end_file(const std::string& fresh, const std::string& path, Archive& f)
{
  if (!f.file) return;
  archive_flush(f);
  FileHead frame;
  std::memcpy(frame.magic, magic, sizeof frame.magic);
  frame.size = f.at;
  frame.hash = f.hash;
  out_file_flush(f.file, fresh);
  std::rewind(f.file);
  std::fwrite(&frame, sizeof frame, 1, f.file);
  out_file_sync(f.file, fresh);
  out_file_close(f.file, fresh);
  rename_file(fresh, path);
}

void copy_file(const std::string& from, const std::string& path)
{
  const std::string fresh = path + ".new";
  std::FILE* source = std::fopen(from.c_str(), "rb");
  std::FILE* file   = out_file_open(fresh);
  std::vector<char> bytes(1 << 20);
  for (std::size_t n = 1; source && n > 0;) {
    n = std::fread(bytes.data(), 1, bytes.size(), source);
    std::fwrite(bytes.data(), 1, n, file);
  }
  if (source) std::fclose(source);
  out_file_sync(file, fresh);
  out_file_close(file, fresh);
  if (source) rename_file(fresh, path);
  else log_warn("%s cannot be read any more: %s", from.c_str(), std::strerror(errno));
}

// items of the mesh of the deck, and points, on this rank of a divided model
//   out  part   [ARCHIVE_KINDS]
void find_parts(const Model& m, const Points& pts, std::vector<ArchivePart>& part)
{
  part[PER_NODE].whole = m.part.nnode;
  part[PER_NODE].at    = deck_order(m.part);
  for (int n : part[PER_NODE].at) {
    part[PER_NODE].item.push_back(m.part.deck[n]);
    part[PER_NODE].brings.push_back(m.part.counts(n));
  }
  part[PER_ELEM].whole = part[PER_GAUSS].whole = m.part.nelem;
  part[PER_ELEM].item = part[PER_GAUSS].item = m.part.elem;
  part[PER_GAUSS].ragged = true;
  for (int e = 0; e < m.mesh.nelem(); ++e) {
    part[PER_ELEM].brings.push_back(m.part.works(e));
    part[PER_GAUSS].units.push_back(
        m.mesh.elem_section[e] < 0 ? 0 : shape_info[elem_table[m.mesh.elem_type[e]].shape].ngp);
  }
  part[PER_GAUSS].brings = part[PER_ELEM].brings;
  const PointPart& own = pts.part;
  const bool all = !m.part.points && !m.part.window;
  part[PER_POINT].all = part[PER_CORNER].all = all;
  if (all) return;
  part[PER_POINT].whole  = own.npoint;
  part[PER_POINT].item   = own.point;
  for (int rank : own.rank) part[PER_POINT].brings.push_back(rank == comm_rank());
  part[PER_CORNER].whole = own.ncorner;
  part[PER_CORNER].item  = own.corner;
  for (int owner : own.halo.owner) part[PER_CORNER].brings.push_back(owner == comm_rank());
  if (pts.of_elem.empty()) return;
  for (ArchiveKind kind : {PER_CONN, PER_PAIR}) part[kind] = part[PER_POINT];
  part[PER_HANG] = part[PER_CORNER];
  for (ArchiveKind kind : {PER_CONN, PER_PAIR, PER_HANG}) part[kind].ragged = true;
  for (int q = 0; q < pts.conn.size(); ++q) {
    const int n = pts.conn.count(q);
    part[PER_CONN].units.push_back(n);
    part[PER_PAIR].units.push_back(pair_count(n));
  }
  for (int c = 0; c < pts.hang.size(); ++c) part[PER_HANG].units.push_back(pts.hang.count(c));
}

// the cells of the grid; divided model: of all ranks, on rank 0
ActiveGrid cells_of_all(const Model& m, const ActiveGrid& grid)
{
  ActiveGrid all;
  all.cell = grid.cell;
  if (m.part.on) {
    all.cell.clear();
    for (const std::vector<long>& own : comm_gather(grid.cell))
      all.cell.insert(all.cell.end(), own.begin(), own.end());
    std::sort(all.cell.begin(), all.cell.end());
  }
  all.ncell = static_cast<int>(all.cell.size());
  return all;
}

// calls write(cells of the grid) with state and arrays of f as on one rank
template <class Write>
void write_whole(const Model& m, const ActiveGrid& grid, State& s, Archive& f, Write write)
{
  std::vector<ArchivePart> part(ARCHIVE_KINDS);
  IntVec releasing = m.part.on ? frac_releasing(m, s.frac) : s.frac.releasing;
  if (m.part.on) s.division.elem = m.part.rank;
  state_to_deck(m.part, s);
  releasing.swap(s.frac.releasing);
  ActiveGrid cells = cells_of_all(m, grid);
  WindowState kept;
  if (m.part.on) {
    state_for_file(m, kept, s, part);
    find_parts(m, s.points, part);
    f.part = part.data();
  }
  write(cells);
  if (m.part.on) state_swap(kept, s);
  releasing.swap(s.frac.releasing);
  state_from_deck(m.part, s);
  if (m.part.on) s.division.elem.clear();
  f.part = nullptr;
}

long length_of(std::FILE* file, const std::string& path)
{
  if (!file) return -1;
  out_file_sync(file, path);
  return std::ftell(file);
}

bool restart_due(const Model& m, const State& s, Output& out)
{
  const RestartDef& r = m.output.restart;
  bool due = clock_over(m.step[s.log.step - 1], s.clock);       // the end of a step
  if (r.frequency > 0) due = due || s.log.inc_total % r.frequency == 0;
  return out_interval(r.interval, s.n.time, out.restart_time.next) || due;
}

// ---- reading -------------------------------------------------------------------

bool refuse(const std::string& path, const std::string& why)
{
  log_error("the run cannot continue from %s: %s", path.c_str(), why.c_str());
  return false;
}

// rank 0: is the file complete and undamaged? f: opened at the start of its content
bool open_file(const std::string& path, Archive& f)
{
  f.file = std::fopen(path.c_str(), "rb");
  if (!f.file)
    return refuse(path, std::string(std::strerror(errno)) +
                            ". *RESTART, WRITE makes it; mpfe --restart FILE reads another one");
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) return refuse(path, "it cannot be read");
  FileHead frame = {};
  const bool whole = std::fread(&frame, sizeof frame, 1, f.file) == 1;
  if (!whole || std::memcmp(frame.magic, magic, sizeof frame.magic) != 0)
    return refuse(path, "it is no restart file of mpfe, or its beginning is damaged");
  if (size - sizeof frame != frame.size)
    return refuse(path, "it is not complete, " + std::to_string(size - sizeof frame) + " bytes instead of " +
                            std::to_string(frame.size) + "; take an earlier one");
  std::uint64_t hash = hash_start;
  std::vector<char> bytes(1 << 20);
  for (std::size_t n = 1; n > 0;) {
    n    = std::fread(bytes.data(), 1, bytes.size(), f.file);
    hash = hash_add(hash, bytes.data(), n);
  }
  if (std::ferror(f.file)) return refuse(path, "it cannot be read");
  f.size = frame.size;
  f.head = sizeof frame;
  return hash == frame.hash || refuse(path, "it is damaged (wrong checksum); take an earlier one");
}

bool fits(const std::string& path, const Model& m, const Origin& o)
{
  if (o.version != MPFE_VERSION || o.format != format)
    return refuse(path, "mpfe " + o.version + ", format " + std::to_string(o.format) +
                            ", has written it; this is mpfe " MPFE_VERSION ", format " +
                            std::to_string(format));
  std::size_t same = 0;        // steps
  while (same < o.step.size() && same < m.step.size() && o.step[same] == m.step[same].hash) ++same;
  const std::string other = o.deck != m.hash ? "outside its steps" : "up to step " + std::to_string(same + 1);
  return (o.deck == m.hash && same == o.step.size()) ||
         refuse(path, "it belongs to another deck: the cards " + other +
                          " are not those of now. Only steps that have not begun, *RESTART, *VTK, "
                          "*FRAGMENTS, *NODE FILE, *EL FILE, *CONTACT FILE, *NODE PRINT, *EL PRINT, "
                          "*CONTACT PRINT, *HEADING, *NEWTON, *SOLVER and INC of *STEP may change");
}

// the same, at what follows the origin. Collective
bool open_content(const Model& m, const std::string& path, Archive& f)
{
  f = Archive();
  f.reading = f.filed = true;
  if (comm_bcast(comm_rank() == 0 && !open_file(path, f))) return false;
  double size = static_cast<double>(f.size);
  comm_bcast(&size, 1);
  f.size = static_cast<std::size_t>(size);
  Origin origin;
  io(f, origin);
  return fits(path, m, origin);
}

// the fault of the first rank that has one, since the state of a divided model is distributed. Collective
std::string first_fault(const char* here)
{
  const std::vector<std::string> own(comm_size(), here ? here : "");
  for (const std::string& fault : comm_exchange(own))
    if (!fault.empty()) return fault;
  return "";
}

// rows of the history under the columns of the deck, results of its checks, cells of its grid
bool output_fits(const Model& m, const ActiveGrid& grid, const std::vector<std::string>& names,
                 const Output& out)
{
  const int rows = static_cast<int>(out.history.rows.size());
  if (out.history.names != names || out.result.size() != m.output.check.size() || out.row_written < -1 ||
      out.row_written >= rows)
    return false;
  for (const RealVec& row : out.history.rows)
    if (row.size() != names.size()) return false;
  for (const VtkSeries& s : out.series)
    if (s.file.size() != s.time.size()) return false;
  return out.vtk_frame >= 0 && grid.ncell == static_cast<int>(grid.cell.size());
}

// calls read() with arrays of f in the parts of the ranks; points of elements are read if the element is
// stored on this rank; begin: points at t = 0. False: the file has another content. Collective.
template <class Read>
bool read_whole(const Model& m, const Points& begin, Archive& f, Read read)
{
  std::vector<ArchivePart> part(ARCHIVE_KINDS);
  if (m.part.on) {
    find_parts(m, begin, part);
    f.part = part.data();
  }
  if (m.part.window)
    part[PER_POINT].takes = [&](int point, int parent) {
      if (parent < 0) return begin.point_here(point) >= 0;
      const int e = m.part.elem_here(parent);
      return e >= 0 && m.part.stores_points(e);
    };
  read();
  if (f.file) std::fclose(f.file);
  f.file = nullptr;
  f.part = nullptr;
  std::string().swap(f.bytes);
  return comm_allreduce_max(static_cast<int>(!f.good || f.at != f.end())) == 0;
}

// was the state written by a model with the same division? Collective
bool same_pieces(const MeshPart& part, const Division& d)
{
  bool same = part.on && d.pieces && d.ranks == comm_size() && d.elem.size() == part.elem.size();
  for (std::size_t e = 0; e < part.elem.size() && same; ++e)
    same = !part.works(static_cast<int>(e)) || d.elem[e] == part.rank[e];
  return comm_allreduce_max(static_cast<int>(!same)) == 0;
}

// keeps the owners, if the division is the same; otherwise they are found again. Collective
void take_division(const Model& m, bool same, State& s)
{
  if (!same) s.work = WorkShare();
  if (!(m.part.on && same && m.part.window)) s.division = Division();
  Division& d = s.division;
  if (!d.pieces) return;
  d.elem.clear();
  if (!d.handed) d.point = point_ranks(m.part, s.points);
  else point_find_common(m.part, d.point, s.points);
}

// converts the state read to this rank; returns a text on what does not fit the model
//   in   other   it was written with another division
std::string take_state(const Points& begin, bool other, Model& m, const FracMesh& fm, State& s,
                       ActiveGrid& grid)
{
  const bool same = same_pieces(m.part, s.division) && !other;
  const bool good = frac_reload(begin, s, m, fm);
  if (good) take_division(m, same, s);
  const std::string fault = good ? first_fault(state_fault(m, begin, s)) : "material points or bonds";
  if (fault.empty() && !m.part.window && s.frac.nconverted > 0) point_surfaces(m, s.points);
  if (m.part.on && comm_rank() > 0) {                // rank 0 has it until it is rebuilt
    grid.cell.clear();
    grid.ncell = 0;
  }
  return fault;
}

// removes files of out_unfinished, if there is a JOB.unfinished.ero: these elements break again
void remove_unfinished(const std::string& base)
{
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(base).parent_path();
  const std::string name = fs::path(base).filename().string();
  std::error_code error;
  if (!fs::exists(base + ".ero", error)) return;
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(folder.empty() ? fs::path(".") : folder, error))
    for (const char* next : {".ero", "_"})
      if (entry.path().filename().string().compare(0, name.size() + std::strlen(next), name + next) == 0)
        found.push_back(entry.path());
  for (const fs::path& path : found) fs::remove(path, error);
}

}  // namespace

// ---------------------------------------------------------------------------
// out_restart : the state between two increments, and the state of the output
//
// JOB.rst is always the last one; without OVERLAY each is also kept as JOB_000123.rst. For a divided model
// rank 0 writes the data of all ranks, as one rank would. doc/developer.md, Restart
// ---------------------------------------------------------------------------
void out_restart(const Model& m, State& s, const ActiveGrid& grid, bool now, Output& out)
{
  if (!m.output.restart.write) return;
  const bool due = s.log.inc > 0 && restart_due(m, s, out);
  if (!(due || now) || out.restart_time.inc == s.log.inc_total) return;
  Timer timer(PHASE_OUTPUT);
  out.restart_time.inc = s.log.inc_total;
  Lengths length;
  length.dat = length_of(out.dat, out.base + ".dat");
  length.ero = length_of(out.ero, out.base + ".ero");
  length.frag = length_of(out.frag, out.base + ".frag");
  Archive f;
  char tail[40] = "";
  if (!m.output.restart.overlay) std::snprintf(tail, sizeof tail, "_%06d", s.log.inc_total);
  const std::string path = out.base + tail + ".rst", fresh = path + ".new";
  begin_file(fresh, f);
  Origin origin;
  origin.format  = format;
  origin.version = MPFE_VERSION;
  origin.deck    = m.hash;
  for (int k = 0; k < s.log.step; ++k) origin.step.push_back(m.step[k].hash);
  write_whole(m, grid, s, f, [&](ActiveGrid& cells) {
    RealVec near = numbers_of(out.near);
    io_all(f, origin, near);
    io_content(f, length, s, cells, out);
  });
  end_file(fresh, path, f);
  if (!m.output.restart.overlay && comm_rank() == 0) copy_file(path, out.base + ".rst");
  log_note("  restart file written, %.3g MB", 1e-6 * static_cast<double>(f.at));
}

void out_mark(const Output& out, bool waits)
{
  if (comm_rank() > 0) return;
  const std::string path = out.base + ".continue";
  if (!waits) {
    std::remove(path.c_str());
    return remove_unfinished(out.base + ".unfinished");
  }
  std::FILE* file = out_file_open(path);
  std::fprintf(file, "%s.rst\n", out.base.c_str());
  out_file_close(file, path);
}

bool out_restart_load(const Model& m, const std::string& path, Archive& f)
{
  if (!open_content(m, path, f)) return false;
  archive_skip<double>(f);               // Output::near
  return true;
}

bool out_restart_pieces(const Model& m, const std::string& path, DivideBy& by)
{
  const int ranks = comm_size();
  if (path.empty() || ranks == 1) return false;
  const CommAlone alone;
  Archive f;
  RealVec near;
  Division d;
  log_mute(true);              // errors are reported when the file is read
  const bool good = open_content(m, path, f);
  log_mute(false);
  if (good) io_all(f, near, d);
  if (f.file) std::fclose(f.file);
  if (!good || !f.good || !d.pieces || d.ranks != ranks) return false;
  const auto is_rank = [&](int r) { return r >= 0 && r < ranks; };
  if (static_cast<int>(d.elem.size()) != m.mesh.nelem()) return false;
  if (!std::all_of(d.elem.begin(), d.elem.end(), is_rank)) return false;
  by.rank.swap(d.elem);
  by.near = faces_of(near);
  return true;
}

std::vector<NearFace> out_restart_near(const Model& m, const std::string& path)
{
  const bool general = model_general_contact(m) >= 0, pairs = model_has_pairs(m);
  if (path.empty() || comm_size() == 1 || !(general || pairs)) return {};
  const CommAlone alone;
  Archive f;
  Lengths length;
  State s;
  ActiveGrid grid;
  Output out;
  point_fill_whole(m, s.points);
  const Points begin = s.points;
  log_mute(true);              // errors are reported when the file is read
  bool good = out_restart_load(m, path, f);
  log_mute(false);
  if (good) io_content(f, length, s, grid, out);
  if (f.file) std::fclose(f.file);
  if (!good || !f.good || state_fault(m, begin, s)) return {};
  double most = 0.0;
  for (const RealVec* v : {&s.n.v, &s.n.vc})
    for (double x : *v) most = std::max(most, std::fabs(x));
  std::vector<NearFace> near;
  const std::vector<SkinFace>& skin = s.bonds.contact.skin;
  if (general) near = near_now(m, s.points, skin, s.n.u, s.n.uc, false, 2.0 * s.clock.dt * most);
  if (pairs) point_surfaces(m, s.points);
  for (const NearFace& of : masters_and_slaves(m, s.points, s.n.u, s.n.uc, false)) near.push_back(of);
  return near;
}

// ---------------------------------------------------------------------------
// out_reopen : columns are set up with the state at t = 0, as at the start of the run; then everything is
// restored. Rank 0 reads the file; a rank of a divided model gets its part of each array.
// ---------------------------------------------------------------------------
int out_reopen(Model& m, const Elements& el, const FracMesh& fm, Archive& f, State& s, ActiveGrid& grid,
               Output& out)
{
  const bool first = comm_rank() == 0;
  const int errors = history_setup(m, el, s, out);
  if (errors > 0) return errors;
  const Points begin = s.points;
  const std::vector<std::string> names = out.history.names;
  Lengths length;
  const bool whole = read_whole(m, begin, f, [&] { io_content(f, length, s, grid, out); });
  if (!whole) {
    log_error("the restart file has another content than this program expects: another build of mpfe has "
              "written it");
    return 1;
  }
  std::string fault = take_state(begin, false, m, fm, s, grid);
  if (fault.empty() && !output_fits(m, grid, names, out)) fault = "history and checks";
  if (!fault.empty()) {
    log_error("the restart file does not fit this model (%s): it is damaged, although its checksum is right; "
              "take an earlier one",
              fault.c_str());
    return 1;
  }
  out.chk = out_file_first(out.base + ".chk");
  if (first) {
    branch_table(m, out, "dat", length.dat, out.dat);
    branch_table(m, out, "ero", length.ero, out.ero);
    branch_table(m, out, "frag", length.frag, out.frag);
    branch_frames(m, out);
    if (m.output.vtk.on) out_vtk_continue(out);
  }
  history_open(out);
  for (int row = 0; row <= out.row_written; ++row)
    if (history_shown(m, out.history, row)) history_write(out, row);
  log_note("the run goes on from step %d, increment %d, time %.9g", s.log.step, s.log.inc, s.n.time);
  out.progress.terminal      = first && isatty(STDERR_FILENO) == 1;
  out.progress.wall = timer_wall();
  out.progress.from = s.n.time;
  out_status_row(m, s, out);
  return 0;
}

bool out_hold(const Model& m, State& s, const ActiveGrid& grid, Archive& f)
{
  f       = Archive();
  f.filed = true;
  if (comm_rank() == 0) f.file = std::tmpfile();
  if (!comm_bcast(static_cast<int>(f.file != nullptr))) return false;
  write_whole(m, grid, s, f, [&](ActiveGrid& cells) { io_all(f, s, cells.ncell, cells.cell); });
  archive_flush(f);
  const bool good = comm_rank() > 0 || (std::fflush(f.file) == 0 && std::ferror(f.file) == 0);
  double size = static_cast<double>(f.at);
  comm_bcast(&size, 1);
  std::FILE* const file = f.file;
  f         = Archive();
  f.file    = file;
  f.reading = f.filed = true;
  f.size    = static_cast<std::size_t>(size);
  if (comm_bcast(static_cast<int>(good))) return true;
  if (f.file) std::fclose(f.file);
  return false;
}

void out_resume(Model& m, const Elements& el, const FracMesh& fm, Archive& f, State& s, ActiveGrid& grid,
                Output& out)
{
  out.probe.clear();
  out.history.names.clear();
  out.converted = -1;                                // items of columns are found again
  MPFE_CHECK(history_setup(m, el, s, out) == 0, "history set-up failed after the model was divided again");
  const Points begin = s.points;
  MPFE_CHECK(read_whole(m, begin, f, [&] { io_all(f, s, grid.ncell, grid.cell); }) &&
                 take_state(begin, true, m, fm, s, grid).empty(),
             "the saved state does not match the model");
  s.work.events = DIVIDED;
}
