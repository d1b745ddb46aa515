#include "out/out.h"

// ---------------------------------------------------------------------------
// out_erosion : JOB.ero, one line for each element that broke since the last increment
// ---------------------------------------------------------------------------
void out_erosion(const Model& m, const State& s, Output& out)
{
  if (m.fracture.empty()) return;
  if (!out.ero) {
    out.ero = out_file_open(out.base + ".ero");
    std::fprintf(out.ero, "# elements that broke: criterion = estimate / toughness; released: strain energy at fixed displacement\n"
                          "#%18s %8s %10s %19s %19s %19s %12s %19s\n", "time", "step", "element", "x", "y", "z", "criterion", "released");
  }
  for (const ErosionLog& e : s.eroded) {
    double x[3] = {0, 0, 0};
    const int n = m.mesh.conn.count(e.elem);
    for (int a = 0; a < n; ++a)
      for (int i = 0; i < 3; ++i) x[i] += m.mesh.X[3 * m.mesh.conn.begin(e.elem)[a] + i] / n;
    std::fprintf(out.ero, "%19.11e %8d %10d %19.11e %19.11e %19.11e %12.5g %19.11e\n", e.time, s.log.step,
                 m.mesh.elem_label[e.elem], x[0], x[1], x[2], e.value, e.released);
  }
  if (!s.eroded.empty()) out_file_flush(out.ero, out.base + ".ero");
}
