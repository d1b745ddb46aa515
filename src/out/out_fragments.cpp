#include "out/out.h"

namespace {

const char* const column_names[] = {
    "time", "fragment", "elements",    "points",   "volume", "mass", "x",    "y",    "z",   "vx",
    "vy",   "vz",       "px",          "py",       "pz",     "lx",   "ly",   "lz",   "wx",  "wy",
    "wz",   "kinetic",  "translation", "rotation", "rest",   "i11",  "i22",  "i33",  "i12", "i23",
    "i31",  "p1",       "p2",          "p3",       "a1x",    "a1y",  "a1z",  "a2x",  "a2y", "a2z",
    "a3x",  "a3y",      "a3z",         "xmin",     "ymin",   "zmin", "xmax", "ymax", "zmax"};

void write_header(std::FILE* file)
{
  std::fputc('#', file);
  for (const char* name : column_names) std::fprintf(file, " %s", name);
  std::fputc('\n', file);
}

void write_numbers(std::FILE* file, const double* value, int n)
{
  for (int i = 0; i < n; ++i) std::fprintf(file, " %23.15e", value[i]);
}

void write_line(std::FILE* file, double time, int id, const Fragment& k)
{
  std::fprintf(file, "%19.11e %8d %8d %8d", time, id, k.nelem, k.npoint);
  const double energy[4] = {k.kinetic, k.translation, k.rotation, k.rest};
  write_numbers(file, &k.volume, 1);
  write_numbers(file, &k.mass, 1);
  for (const double* v : {k.centre, k.velocity, k.momentum, k.angular, k.spin}) write_numbers(file, v, 3);
  write_numbers(file, energy, 4);
  write_numbers(file, k.inertia, 6);
  write_numbers(file, k.principal, 3);
  write_numbers(file, k.axis, 9);
  write_numbers(file, k.lo, 3);
  write_numbers(file, k.hi, 3);
  std::fputc('\n', file);
}

void write_listing(std::FILE* file, double time, const Fragments& f)
{
  double total = 0.0;
  for (const Fragment& k : f.item) total += k.mass;
  std::fprintf(file, "\nFRAGMENTS at time %.9g: %d\n", time, f.count());
  for (int i = 1; i <= f.count() && i <= 5; ++i)
    std::fprintf(file, "  %-15d mass %.9g (%.4g %%), %d elements, %d points\n", i, f.item[i].mass,
                 100.0 * f.item[i].mass / total, f.item[i].nelem, f.item[i].npoint);
  const Fragment& debris = f.item[0];
  std::fprintf(file, "  debris          mass %.9g (%.4g %%), %d elements, %d points\n", debris.mass,
               100.0 * debris.mass / total, debris.nelem, debris.npoint);
}

bool due(const FragmentsDef& d, const State& s, Output& out)
{
  const bool by_number = d.frequency > 0 && s.log.inc_total % d.frequency == 0;
  return out_interval(d.interval, s.n.time, out.frag_time.next) || by_number;
}

}  // namespace

// ---------------------------------------------------------------------------
// out_fragments : writes the fragments at t(n) to JOB.frag when due, and at the end of the run to the listing
// ---------------------------------------------------------------------------
void out_fragments(const Model& m, const Elements& el, const State& s, bool last, Output& out)
{
  if (!m.output.fragments.on || !(last || due(m.output.fragments, s, out))) return;
  Fragments f;
  frac_fragments(m, el, s, f);
  if (!out.frag) {
    out.frag = out_file_first(out.base + ".frag");
    write_header(out.frag);
  }
  if (out.frag_time.inc != s.log.inc_total) {
    for (size_t i = 0; i < f.item.size(); ++i)
      if (f.item[i].nelem + f.item[i].npoint > 0)
        write_line(out.frag, s.n.time, static_cast<int>(i), f.item[i]);
    out_file_flush(out.frag, out.base + ".frag");
    out.frag_time.inc = s.log.inc_total;
  }
  if (!last) return;
  write_listing(out.lst, s.n.time, f);
  out_file_close(out.frag, out.base + ".frag");
}
