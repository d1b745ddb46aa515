#include <algorithm>
#include <cmath>

#include "base/log.h"
#include "base/box_tree.h"
#include "mat/law.h"
#include "model/lumped.h"
#include "out/out.h"

namespace {

struct Range {
  double lo = 1e300, hi = 0.0;
  void add(double v)
  {
    lo = std::min(lo, v);
    hi = std::max(hi, v);
  }
};

void print_box(std::FILE* file, const char* what, const BoundingBox& box, int dim)
{
  std::fprintf(file, "  %-16s", what);
  for (int i = 0; i < dim; ++i)
    std::fprintf(file, "%s%c %g ... %g", i ? ", " : "", 'x' + i, box.lo[i], box.hi[i]);
  std::fprintf(file, "\n");
}

double distance(const double* a, const double* b, int dim)
{
  double sum = 0.0;
  for (int i = 0; i < dim; ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum);
}

// edges of the elements that exist, at t = 0
Range edge_range(const Model& m, const Elements& el)
{
  Range range;
  for (int e = 0; e < m.mesh.nelem(); ++e) {
    if (el.block_of[e] < 0) continue;
    const ShapeInfo& info = shape_info[elem_table[m.mesh.elem_type[e]].shape];
    const int* conn = m.mesh.conn.begin(e);
    for (int f = 0; f < info.nface; ++f)
      for (int a = 0; a < (info.dim == 2 ? 1 : face_corners(info, f)); ++a) {
        const int n1 = conn[info.face[f][a]], n2 = conn[info.face[f][(a + 1) % face_corners(info, f)]];
        range.add(distance(&m.mesh.X[3 * n1], &m.mesh.X[3 * n2], 3));
      }
  }
  double most[2] = {-range.lo, range.hi};
  out_max(m, most, 2);
  range.lo = -most[0];
  range.hi = most[1];
  return range;
}

// speed of pressure waves, 0 when the density is missing or the material incompressible
double wave_speed(const Material& mat)
{
  if (mat.density <= 0.0 || mat.poisson >= 0.5) return 0.0;
  return std::sqrt(mat_stiffness(mat, PLANE_NONE) / mat.density);
}

double smallest_cell(const Model& m)
{
  return *std::min_element(m.grid.h.begin(), m.grid.h.begin() + m.dim);
}

// stiffness of the stiffer side of a bond. Collective
double side_stiffness(const Model& m, const BondDef& d)
{
  double stiff = bond_side_stiffness(m, d);
  out_max(m, &stiff, 1);
  return stiff;
}

void print_mesh(std::FILE* file, const Model& m, const Elements& el)
{
  const int nnode = m.part.on ? m.part.nnode : m.mesh.nnode();
  if (nnode == 0) return;
  RealVec count(ELEM_TYPES + 1, 0.0);                  // the last one: no finite elements
  for (int e = 0; e < m.mesh.nelem(); ++e)
    if (m.part.works(e)) ++count[el.block_of[e] < 0 ? ELEM_TYPES : m.mesh.elem_type[e]];
  out_sum(m, count.data(), ELEM_TYPES + 1);
  double twins = 0.0;
  for (const Frame& f : m.frame) twins += f.twin >= 0 && m.part.counts(f.twin);
  out_sum(m, &twins, 1);
  std::fprintf(file, "  nodes           %.0f\n", nnode - twins);
  for (int t = 0; t < ELEM_TYPES; ++t)
    if (count[t] > 0.0) std::fprintf(file, "  elements        %.0f %s\n", count[t], elem_table[t].name);
  if (count[ELEM_TYPES] > 0.0)
    std::fprintf(file, "  cells           %.0f elements of the deck that are no finite elements\n",
                 count[ELEM_TYPES]);
  BoundingBox box;
  for (int n = 0; n < m.mesh.nnode(); ++n) box_take(box, &m.mesh.X[3 * n], m.dim);
  if (m.part.on) box_join(box);
  print_box(file, "nodes lie in", box, m.dim);
  const Range edge = edge_range(m, el);
  if (edge.hi > 0.0) std::fprintf(file, "  edges           %g ... %g\n", edge.lo, edge.hi);
}

void print_grid(std::FILE* file, const Grid& g, int dim)
{
  if (!g.given) return;
  std::fprintf(file, "  grid            ");
  for (int i = 0; i < dim; ++i) std::fprintf(file, "%s%d", i ? " x " : "", g.n[i]);
  std::fprintf(file, " cells of ");
  for (int i = 0; i < dim; ++i) std::fprintf(file, "%s%g", i ? " x " : "", g.h[i]);
  std::fprintf(file, ", from");
  for (int i = 0; i < dim; ++i) std::fprintf(file, " %g", g.lo[i]);
  std::fprintf(file, " to");
  for (int i = 0; i < dim; ++i) std::fprintf(file, " %g", g.lo[i] + g.n[i] * g.h[i]);
  std::fprintf(file, "\n");
}

// kind of mass of a section, if it is not the consistent mass for smooth waves, with the reason
const char* mass_of(const Model& m, const Section& s)
{
  if (!model_lumps(m)) return s.lumped ? ", lumped by name" : "";
  return s.lumped ? ", lumped: something can break or touch"
                  : ", consistent by name or as quadratic elements";
}

void print_sections(std::FILE* file, const Model& m, const Elements& el)
{
  for (std::size_t i = 0; i < m.section.size(); ++i) {
    const Section& section = m.section[i];
    double sum[2] = {0.0, 0.0}, &volume = sum[0], &elements = sum[1];
    for (int e = 0; e < m.mesh.nelem(); ++e) {
      if (el.block_of[e] < 0 || m.mesh.elem_section[e] != static_cast<int>(i)) continue;
      volume += elem_volume(el.block[el.block_of[e]], el.slot_of[e]);
      ++elements;
    }
    out_sum(m, sum, 2);
    const Material& mat = m.material[section.material];
    std::fprintf(file, "  section %-7s of %s: %.0f elements", m.elset[section.elset].name.c_str(),
                 mat.name.c_str(), elements);
    if (m.dim == 2) std::fprintf(file, ", thickness %g", section.thickness);
    std::fprintf(file, ", volume %.9g, mass %.9g%s\n", volume, volume * mat.density, mass_of(m, section));
  }
}

// strength of an uncracked body of elements of size h: by its material, or by the mesh       (7.20), (2.34)
void print_strength(std::FILE* file, const FractureDef& f, const Material& mat, Plane plane, double h)
{
  const double E = mat.young, E1 = plane == PLANE_STRESS ? E : E / (1.0 - mat.poisson * mat.poisson);
  if (f.criterion == CRITERION_COHESIVE) {
    const double zone = E * f.gc / (f.ft * f.ft);
    std::fprintf(file, ", strength %.4g, E Gc/ft^2 = %.4g: %.3g %s%s\n", f.ft, zone, zone / h,
                 f.body < 0 ? "elements" : "cells", f.track ? "; cracks along lines (TRACK)" : "");
    return;
  }
  if (f.criterion == CRITERION_GRIFFITH && f.epsilon == 0.0 && f.drive == SPLIT_RCE) {
    const double mesh = std::sqrt(E1 * f.gc / h);
    std::fprintf(file, ", strength of the mesh %.4g in statics, %.4g in motion", 0.52 * mesh,
                 (plane == PLANE_NONE ? 0.413 : 0.393) * mesh);
  }
  std::fprintf(file, "\n");
}

// the same of a body of material points, h the edge of a cell of its grid
void print_body_strength(std::FILE* file, const Model& m, const FractureDef& f)
{
  const Body& b  = m.body[f.body];
  const double h = *std::max_element(m.grid.h.begin(), m.grid.h.begin() + m.dim);
  std::fprintf(file, "  may break: points of %s, cells %.4g, toughness %.4g", b.name.c_str(), h, f.gc);
  print_strength(file, f, m.material[b.material], b.plane, h);
}

// plane strain or stress of the elements of a section, as named in the deck
Plane plane_of(const Model& m, std::size_t section)
{
  for (int e = 0; e < m.mesh.nelem(); ++e)
    if (m.mesh.elem_section[e] == static_cast<int>(section)) return elem_table[m.mesh.elem_type[e]].plane;
  return m.dim == 3 ? PLANE_NONE : PLANE_STRAIN;
}

void print_fracture(std::FILE* file, const Model& m, const Elements& el)
{
  for (const FractureDef& f : m.fracture) {
    if (f.body >= 0) print_body_strength(file, m, f);
    for (std::size_t i = 0; f.elset >= 0 && i < m.section.size(); ++i) {
      double sum[2] = {0.0, 0.0};
      const Plane plane = plane_of(m, i);
      for (const Member& x : model_members(m, f)) {
        const int e = x.elem;
        if (el.block_of[e] < 0 || m.mesh.elem_section[e] != static_cast<int>(i)) continue;
        sum[0] += elem_size(el.block[el.block_of[e]], el.slot_of[e]);
        ++sum[1];
      }
      out_sum(m, sum, 2);
      if (sum[1] == 0.0) continue;
      const double h = sum[0] / sum[1];
      std::fprintf(file, "  may break: %.0f elements of %s, mean size %.4g, toughness %.4g", sum[1],
                   m.elset[m.section[i].elset].name.c_str(), h, f.gc);
      print_strength(file, f, m.material[m.section[i].material], plane, h);
    }
  }
}

void print_bodies(std::FILE* file, const Model& m, const Points& pts)
{
  if (pts.npoint_all() == 0) return;
  const auto own = [&](int p) { return !m.part.points || point_counts(m, pts, p); };
  double faces = 0.0;
  for (const Face& f : pts.boundary) faces += own(f.elem);
  if (m.part.points) out_sum(m, &faces, 1);
  std::fprintf(file, "  points          %d with %d corners, %.0f faces on the boundary\n", pts.npoint_all(),
               pts.part.on ? pts.part.ncorner : pts.ncorner, faces);
  for (std::size_t i = 0; i < m.body.size(); ++i) {
    double sum[3] = {0.0, 0.0, 0.0};       // points, volume, mass
    BoundingBox box;
    for (int p = 0; p < pts.npoint; ++p) {
      if (pts.body[p] != static_cast<int>(i) || !own(p)) continue;
      sum[0] += 1.0;
      sum[1] += pts.V0[p];
      sum[2] += pts.mass[p];
      for (int a = 0; a < pts.conn.count(p); ++a) box_take(box, &pts.Xc[pts.conn.begin(p)[a] * m.dim], m.dim);
    }
    if (m.part.points) {
      out_sum(m, sum, 3);
      if (m.part.on) box_join(box);
    }
    std::fprintf(file, "  body %-10s of %s: %.0f points, grid field %d, volume %.9g, mass %.9g\n",
                 m.body[i].name.c_str(), m.material[m.body[i].material].name.c_str(), sum[0], m.body[i].field,
                 sum[1], sum[2]);
    if (sum[0] > 0.0) print_box(file, "  lies in", box, m.dim);
  }
}

void print_bonds(std::FILE* file, const Model& m, const Bonds& bonds)
{
  for (std::size_t i = 0; i < m.bond.size(); ++i) {
    const BondSums sum = bond_sums(bonds, static_cast<int>(i));
    std::fprintf(file, "  bond %-10s %.0f nodal, %.0f intermediate, area %g", m.bond[i].name.c_str(),
                 sum.nodal, sum.between, sum.area);
    const double penalty = sum.penalty, stiff = side_stiffness(m, m.bond[i]);
    if (penalty > 0.0) std::fprintf(file, ", penalty %g", penalty);
    if (penalty > 0.0 && stiff > 0.0 && m.grid.given)
      std::fprintf(file, " = %.4g M/h", penalty / (stiff / smallest_cell(m)));
    std::fprintf(file, "\n");
  }
}

void print_materials(std::FILE* file, const Model& m)
{
  for (const Material& mat : m.material) {
    std::fprintf(file, "  material %-6s %s, E %g, nu %g%s, density %g", mat.name.c_str(),
                 law_of(mat_law(mat, PLANE_NONE)).name, mat.young, mat.poisson,
                 mat.elastic.empty() ? "" : " for penalties and waves", mat.density);
    if (wave_speed(mat) > 0.0) std::fprintf(file, ", pressure waves %.6g", wave_speed(mat));
    if (mat.has_damping) std::fprintf(file, ", damping alpha %g, beta %g", mat.alpha, mat.beta);
    std::fprintf(file, "%s\n", mat.used ? "" : " (not used)");
  }
}

void print_viscous(std::FILE* file, const Model& m, const Points& pts)
{
  for (const ViscousBoundary& v : m.viscous) {
    const Surface& s  = m.surface[v.surface];
    const bool body    = s.body >= 0;
    const auto counts  = [&](const Face& f) {
      return body ? point_counts(m, pts, f.elem) : m.part.works(f.elem);
    };
    const std::vector<Face>& list = body ? pts.surface[v.surface] : s.face;
    double face = static_cast<double>(std::count_if(list.begin(), list.end(), counts));
    out_sum(m, &face, 1);
    std::fprintf(file, "  dampers %-7s %.0f faces, factors %g along the normal, %g across\n", s.name.c_str(),
                 face, v.a, v.b);
  }
}

// number of elements that a wave may cross in an increment for fracture to be resolved. With lumped masses
// the number of broken elements is the same within its scatter up to 2.3 (doc/verification/fracture.md, MASS)
// (test: fracture/mass_named)
const double MOST_CROSSED = 3.0;
// the same with consistent masses: above it the number grows as the increment decreases, below by 2 %
// (fracture/increment.inp)  (test: fracture/mass_named)
const double CROSSED_CONSISTENT = 0.3;

// Is there material with fracture and a consistent mass, on any rank?
bool breaks_consistent(const Model& m)
{
  double found = 0.0;
  for (const FractureDef& f : m.fracture)
    if (f.elset >= 0)
      for (int e : m.elset[f.elset].item) {
        const int section = m.mesh.elem_section[e];
        if (section >= 0 && !m.section[section].lumped) found = 1.0;
      }
  out_sum(m, &found, 1);
  return found > 0.0;
}

void warn_of_increment(const Model& m, std::size_t step, double crossed)
{
  const double dt = m.step[step].dt;
  const bool consistent = breaks_consistent(m);
  if (consistent && crossed > CROSSED_CONSISTENT)
    log_warn("step %zu, *DYNAMIC: dt = %.3g: a wave crosses %.3g elements in an increment, and what may "
             "break has MASS=CONSISTENT: waves as short as an element run ahead and break what they meet, "
             "the more the shorter the increment. Leave MASS= of *SOLID SECTION out (lumped), or take DIRECT "
             "and dt = %.3g",
             step + 1, dt, crossed, dt * CROSSED_CONSISTENT / crossed);
  else if (crossed > MOST_CROSSED)
    log_warn("step %zu, *DYNAMIC: dt = %.3g: a wave crosses %.3g elements in an increment, so fracture by "
             "waves is not resolved; take DIRECT and dt = %.3g, in which it crosses one",
             step + 1, dt, crossed, dt / crossed);
}

// cells and elements that the fastest wave crosses in one increment;
// with fracture a warning if these are many
void print_wave_travel(std::FILE* file, const Model& m, const Elements& el, const Points& pts)
{
  double c = 0.0;
  for (const Material& mat : m.material)
    if (mat.used) c = std::max(c, wave_speed(mat));
  const Range edge = edge_range(m, el);
  const double h = smallest_cell(m);
  for (std::size_t i = 0; i < m.step.size(); ++i) {
    if (m.step[i].proc != PROC_DYNAMIC || m.step[i].explicit_steps() || c <= 0.0) continue;
    std::fprintf(file, "  step %zu          dt %g: a wave travels %g", i + 1, m.step[i].dt, c * m.step[i].dt);
    if (edge.hi > 0.0) std::fprintf(file, ", %.3g of the smallest edge", c * m.step[i].dt / edge.lo);
    if (pts.npoint_all() > 0 && h > 0.0) std::fprintf(file, ", %.3g cells", c * m.step[i].dt / h);
    std::fprintf(file, "\n");
    const double crossed = edge.hi > 0.0 ? c * m.step[i].dt / edge.lo : 0.0;
    if (!m.fracture.empty()) warn_of_increment(m, i, crossed);
  }
}

void print_sets(std::FILE* file, const Model& m)
{
  const auto print = [file, &m](const char* word, const std::vector<Set>& sets, bool nodes) {
    if (sets.empty()) return;
    RealVec count(sets.size(), 0.0);
    for (std::size_t i = 0; i < sets.size(); ++i)
      for (int k : sets[i].item) count[i] += nodes ? m.part.counts(k) : m.part.works(k);
    out_sum(m, count.data(), static_cast<long>(count.size()));
    std::fprintf(file, "  %-16s", word);
    for (std::size_t i = 0; i < sets.size(); ++i)
      std::fprintf(file, "%s%s %.0f", i ? ", " : "", sets[i].name.c_str(), count[i]);
    std::fprintf(file, "\n");
  };
  print("node sets", m.nset, true);
  print("element sets", m.elset, false);
  std::string names;
  for (const Surface& s : m.surface)                 // surfaces of *DLOAD have no name
    if (!s.name.empty()) names += (names.empty() ? "" : ", ") + s.name;
  if (!names.empty()) std::fprintf(file, "  surfaces        %s\n", names.c_str());
}

}  // namespace

// ---------------------------------------------------------------------------
// out_model_summary : summary of the model: counts, boxes, volumes, masses, wave speeds, penalties
// ---------------------------------------------------------------------------
void out_model_summary(std::FILE* file, const Model& m, const Elements& el, const Points& pts,
                       const Bonds& bonds)
{
  std::FILE* nowhere = file ? nullptr : out_file_open("/dev/null");
  if (!file) file = nowhere;
  std::fprintf(file, "\nMODEL  %d dimensions, %zu steps, %zu checks\n", m.dim, m.step.size(),
               m.output.check.size());
  print_mesh(file, m, el);
  print_grid(file, m.grid, m.dim);
  print_materials(file, m);
  print_sections(file, m, el);
  print_fracture(file, m, el);
  print_bodies(file, m, pts);
  print_bonds(file, m, bonds);
  print_viscous(file, m, pts);
  print_wave_travel(file, m, el, pts);
  print_sets(file, m);
  if (nowhere) std::fclose(nowhere);
}
