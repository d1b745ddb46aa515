#include "base/comm.h"
#include "out/out.h"

// ---------------------------------------------------------------------------
// out_erosion : JOB.ero, one line for each element that broke since the last call
//
// In statics it is called after each equilibrium of an increment, so that progress is visible
// in a long increment.
// ---------------------------------------------------------------------------
void out_erosion(const Model& m, const State& s, Output& out)
{
  if (m.fracture.empty() || comm_rank() > 0) return;
  if (!out.ero) {
    out.ero = out_file_open(out.base + ".ero");
    std::fprintf(out.ero,
                 "# elements that broke: criterion = estimate / toughness; released: strain energy at fixed "
                 "displacement\n"
                 "#%18s %8s %10s %19s %19s %19s %12s %19s\n",
                 "time", "step", "element", "x", "y", "z", "criterion", "released");
    out_file_flush(out.ero, out.base + ".ero");
  }
  if (s.eroded.size() <= out.ero_written) return;
  if (out.ero_written == 0) {
    std::fseek(out.ero, 0, SEEK_END);
    out.ero_length = std::ftell(out.ero);
    out.tip_before = out.tip;
  }
  for (std::size_t k = out.ero_written; k < s.eroded.size(); ++k) {
    const ErosionLog& e = s.eroded[k];
    std::fprintf(out.ero, "%19.11e %8d %10d %19.11e %19.11e %19.11e %12.5g %19.11e\n", e.time, s.log.step,
                 e.label, e.X[0], e.X[1], e.X[2], e.value, e.released);
  }
  out.ero_written = s.eroded.size();
  out.tip         = s.eroded.back();
  out_file_flush(out.ero, out.base + ".ero");
}

// ---------------------------------------------------------------------------
// out_erosion_undo : removes the lines of an increment that is undone from JOB.ero
// ---------------------------------------------------------------------------
void out_erosion_undo(Output& out)
{
  if (out.ero_written == 0) return;
  out.ero_written = 0;
  out.tip         = out.tip_before;
  out_file_cut(out.ero, out.ero_length, out.base + ".ero");
}

// ---------------------------------------------------------------------------
// out_unfinished : elements broken in an increment ended by a signal: JOB.unfinished.ero and frames
// JOB.unfinished_*, with the present state, whose fracture is not yet in equilibrium. Returns a message.
// ---------------------------------------------------------------------------
std::string out_unfinished(const Model& m, const Elements& el, const State& s, const ActiveGrid& grid,
                           const Output& out)
{
  if (s.eroded.empty()) return "";
  Output apart;
  apart.base = out.base + ".unfinished";
  out_erosion(m, s, apart);
  if (apart.ero) out_file_close(apart.ero, apart.base + ".ero");
  if (m.output.vtk.on) out_vtk(m, el, s, grid, apart);
  return std::to_string(s.eroded.size()) + " elements broke in an increment that had not ended: " +
         apart.base + ".ero" + (m.output.vtk.on ? " and frames of this name" : "") +
         ", not yet in equilibrium; a run that goes on breaks them again";
}
