#include <algorithm>
#include <filesystem>

#include "base/picked.h"
#include "bond/bond.h"
#include "out/out.h"
#include "out/out_vtk_file.h"

namespace {

const char* const kind_name[VTK_KINDS] = {"fe", "mp", "bond", "grid"};

double det_F(const IpFields& f)
{
  const double* F = f.F;
  return F[0] * (F[4] * F[8] - F[5] * F[7]) - F[1] * (F[3] * F[8] - F[5] * F[6]) +
         F[2] * (F[3] * F[7] - F[4] * F[6]);
}

// is there plastic flow: a plastic law, or fracture with friction?
bool yields(const Model& m)
{
  return std::any_of(m.material.begin(), m.material.end(),
                     [](const Material& a) { return a.used && law_flows(a.law); }) ||
         std::any_of(m.fracture.begin(), m.fracture.end(),
                     [](const FractureDef& f) { return f.residual == SPLIT_GRANULAR; });
}

bool opens(const Model& m)
{
  return std::any_of(m.fracture.begin(), m.fracture.end(),
                     [](const FractureDef& f) { return f.criterion == CRITERION_COHESIVE; });
}

bool in_space(const Model& m) { return m.dim == 3; }

// Fields of elements and points, in the order of the file; after the stress SMISES
struct CellField {
  const char* word;
  double (*value)(const IpFields& f);
  bool (*shown)(const Model& m);       // null: always
};

const CellField cell_field[] = {
    {"S11", [](const IpFields& f) { return f.sig[0]; }, nullptr},
    {"S22", [](const IpFields& f) { return f.sig[1]; }, nullptr},
    {"S33", [](const IpFields& f) { return f.sig[2]; }, nullptr},
    {"S12", [](const IpFields& f) { return f.sig[3]; }, nullptr},
    {"S23", [](const IpFields& f) { return f.sig[4]; }, in_space},
    {"S31", [](const IpFields& f) { return f.sig[5]; }, in_space},
    {"ENER", [](const IpFields& f) { return f.psi; }, nullptr},
    {"J", det_F, nullptr},
    {"PEEQ", [](const IpFields& f) { return f.plastic; }, yields},
    {"CRACKW", [](const IpFields& f) { return f.opening; }, opens},
};
const int LAST_STRESS = 5, CELL_FIELDS = sizeof cell_field / sizeof *cell_field;

struct CellFields {            // one value per cell
  RealVec of[CELL_FIELDS], mises;
  explicit CellFields(std::size_t n)                 // reserves memory
  {
    for (RealVec& x : of) x.reserve(n);
    mises.reserve(n);
  }
  void add(const double* value)
  {
    for (int k = 0; k < CELL_FIELDS; ++k) of[k].push_back(value[k]);
    mises.push_back(mises_stress(value));
  }
};

void write_fields(VtkFile& f, const Model& m, const CellFields& c)
{
  for (int k = 0; k < CELL_FIELDS; ++k) {
    if (!cell_field[k].shown || cell_field[k].shown(m)) vtk_scalars(f, cell_field[k].word, c.of[k]);
    if (k == LAST_STRESS) vtk_scalars(f, "SMISES", c.mises);
  }
}

// a divided model has a .vtu per rank, independent of the deck, and a .pvtu that refers to them
const char* const endings[] = {"vtk", "vtu", "pvtu"};

const char* ending_of(const Model& m) { return endings[m.part.on ? 2 : m.output.vtk.xml ? 1 : 0]; }

std::string frame_tail(VtkKind kind, int frame, const std::string& ending)
{
  char tail[60];
  std::snprintf(tail, sizeof tail, "_%s_%06d%s", kind_name[kind], frame, ending.c_str());
  return tail;
}

std::string piece_tail(VtkKind kind, int frame, std::size_t rank)
{
  return frame_tail(kind, frame, "_r" + std::to_string(rank) + ".vtu");
}

// ---------------------------------------------------------------------------
// write_series : frames with one file ending, since ParaView reads a series with one reader; there are
// several endings if a run was continued in another format, or on another number of ranks.
// No frames: deletes the file.
// ---------------------------------------------------------------------------
void write_series(const Output& out, VtkKind kind, const std::string& ending)
{
  const VtkSeries& all = out.series[kind];
  const std::string path = out.base + "_" + kind_name[kind] + "." + ending + ".series";
  VtkSeries series;
  for (std::size_t i = 0; i < all.file.size(); ++i) {
    if (std::filesystem::path(all.file[i]).extension() != "." + ending) continue;
    series.file.push_back(all.file[i]);
    series.time.push_back(all.time[i]);
  }
  std::error_code error;
  if (series.file.empty()) std::filesystem::remove(path, error);
  else out_vtk_series(path, series);
}

// has any rank data to write?
bool anybody(const Model& m, bool here)
{
  double any = here;
  out_max(m, &any, 1);
  return any > 0.0;
}

// opens JOB_kind_000123.vtk, or the piece of this rank, and adds the frame to the series. here: this rank has
// data; otherwise its piece is written to /dev/null
void begin(VtkFile& f, VtkKind kind, const Model& m, const State& s, bool here, Output& out)
{
  const std::string tail = frame_tail(kind, out.vtk_frame, std::string(".") + ending_of(m));
  out.series[kind].file.push_back(m.job + tail);
  out.series[kind].time.push_back(s.n.time);
  char title[240];
  std::snprintf(title, sizeof title, "mpfe %.150s, %s, time %.9g", m.job.c_str(), kind_name[kind], s.n.time);
  std::string path = out.base + tail;
  if (m.part.on) path = here ? out.base + piece_tail(kind, out.vtk_frame, comm_rank()) : "/dev/null";
  vtk_open(f, path, title, s.n.time,
           m.part.on || m.output.vtk.xml ? VTK_XML : m.output.vtk.ascii ? VTK_ASCII : VTK_BINARY);
}

void end(VtkFile& f, VtkKind kind, const Model& m, bool here, const Output& out)
{
  vtk_close(f);
  if (m.part.on) {
    const std::vector<IntVec> has = comm_gather(IntVec{here});         // all pieces are on the disk now
    if (comm_rank() > 0) return;
    std::vector<std::string> piece;
    for (std::size_t r = 0; r < has.size(); ++r)
      if (has[r][0]) piece.push_back(m.job + piece_tail(kind, out.vtk_frame, r));
    vtk_parallel(f, out.base + frame_tail(kind, out.vtk_frame, ".pvtu"), piece);
  }
  write_series(out, kind, ending_of(m));
}

// ---- finite elements --------------------------------------------------------

struct FeMesh {                // elements that still exist, and their nodes
  IntVec elem, node, type;
  ListTable conn;
};

int material_of(const Model& m, int e) { return model_material(m, e) + 1; }

void collect_elements(const Model& m, const Elements& el, FeMesh& fe)
{
  IntVec index(m.mesh.nnode(), -1);
  for (int e = 0; e < m.mesh.nelem(); ++e) {
    if (el.block_of[e] < 0) continue;
    for (int a = 0; a < m.mesh.conn.count(e); ++a) {
      const int n = m.mesh.conn.begin(e)[a];
      if (index[n] < 0) {
        index[n] = static_cast<int>(fe.node.size());
        fe.node.push_back(n);
      }
      fe.conn.item.push_back(index[n]);
    }
    fe.conn.off.push_back(static_cast<int>(fe.conn.item.size()));
    fe.elem.push_back(e);
    fe.type.push_back(shape_info[elem_table[m.mesh.elem_type[e]].shape].vtk);
  }
}

// means over the Gauss points, weighted by their volume
CellFields element_fields(const Model& m, const Elements& el, const State& s, const FeMesh& fe)
{
  CellFields cell(fe.elem.size());
  IpFields f;
  for (int e : fe.elem) {
    double mean[CELL_FIELDS] = {}, volume = 0.0;
    for (int g = 0; g < elem_gauss(m, el, e); ++g) {
      elem_ip_fields(m, el, s.n, out_nlgeom(m, s), e, g, f);
      for (int k = 0; k < CELL_FIELDS; ++k) mean[k] += f.V0 * cell_field[k].value(f);
      volume += f.V0;
    }
    for (double& k : mean) k /= volume;
    cell.add(mean);
  }
  return cell;
}

// present positions of the nodes
void write_elements(VtkFile& f, const Model& m, const State& s, const FeMesh& fe)
{
  RealVec x;
  x.reserve(fe.node.size() * static_cast<std::size_t>(m.dim));
  for (int n : fe.node)
    for (int i = 0; i < m.dim; ++i) x.push_back(m.mesh.X[n * 3 + i] + s.n.u[n * m.dim + i]);
  vtk_mesh(f, x, m.dim, fe.conn, fe.type);
}

void write_fe(const Model& m, const Elements& el, const State& s, const Fragments& fragments, Output& out)
{
  FeMesh fe;
  collect_elements(m, el, fe);
  const bool here = !fe.elem.empty();
  if (!anybody(m, here)) return;
  VtkFile f;
  begin(f, VTK_FE, m, s, here, out);
  write_elements(f, m, s, fe);
  vtk_point_data(f, static_cast<int>(fe.node.size()));
  vtk_vectors(f, "displacement", picked(fe.node, m.dim, s.n.u), m.dim);
  vtk_vectors(f, "velocity", picked(fe.node, m.dim, s.n.v), m.dim);
  vtk_vectors(f, "acceleration", picked(fe.node, m.dim, s.n.a), m.dim);
  vtk_vectors(f, "reaction", picked(fe.node, m.dim, s.rf), m.dim);
  vtk_labels(f, "node_label", picked(fe.node, 1, m.mesh.node_label));
  vtk_cell_data(f, fe.conn.size());
  write_fields(f, m, element_fields(m, el, s, fe));
  vtk_labels(f, "label", picked(fe.elem, 1, m.mesh.elem_label));
  IntVec material;
  for (int e : fe.elem) material.push_back(material_of(m, e));
  vtk_labels(f, "material", material);
  if (!s.frac.empty()) {
    IntVec broken;
    RealVec time, degr;
    for (int e : fe.elem) {
      broken.push_back(s.frac.broken[e] >= 0);
      time.push_back(s.frac.time[e]);
      degr.push_back(s.n.degr[e]);
    }
    vtk_labels(f, "broken", broken);
    vtk_scalars(f, "time_broken", time);
    vtk_scalars(f, "degradation", degr);
  }
  if (m.output.fragments.on) vtk_labels(f, "fragment", picked(fe.elem, 1, fragments.of_elem));
  end(f, VTK_FE, m, here, out);
}

// ---- material points ----------------------------------------------------------

// points that this rank writes, and their corners
struct Shown {
  IntVec point, corner;
  ListTable conn;              // [point] indices into corner
};

Shown points_shown(const Model& m, const Points& pts)
{
  Shown s;
  const bool others = pts.part.on || pts.part.window;          // may there be points of other ranks?
  IntVec index(pts.ncorner, others ? -1 : 0);
  for (int p = 0; p < pts.npoint; ++p) {
    if (others && !point_counts(m, pts, p)) continue;
    s.point.push_back(p);
    for (int k = pts.conn.off[p]; k < pts.conn.off[p + 1]; ++k) index[pts.conn.item[k]] = 0;
  }
  for (int c = 0; c < pts.ncorner; ++c) {
    if (index[c] < 0) continue;
    index[c] = static_cast<int>(s.corner.size());
    s.corner.push_back(c);
  }
  std::size_t corners = 0;
  for (int p : s.point) corners += static_cast<std::size_t>(pts.conn.count(p));
  s.conn.item.reserve(corners);
  for (int p : s.point) {
    for (int k = pts.conn.off[p]; k < pts.conn.off[p + 1]; ++k)
      s.conn.item.push_back(index[pts.conn.item[k]]);
    s.conn.off.push_back(static_cast<int>(s.conn.item.size()));
  }
  return s;
}

// present positions of the corners of the domains
void write_domains(VtkFile& f, const Model& m, const State& s, const Shown& shown)
{
  RealVec x = picked(shown.corner, m.dim, s.points.Xc);
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] += s.n.uc[static_cast<std::size_t>(shown.corner[i / m.dim]) * m.dim + i % m.dim];
  IntVec type;
  for (int p : shown.point) type.push_back(shape_info[s.points.shape[p]].vtk);
  vtk_mesh(f, x, m.dim, shown.conn, type);
}

CellFields point_fields(const Model& m, const State& s, const IntVec& list)
{
  CellFields cell(list.size());
  IpFields ip;
  for (int p : list) {
    point_ip_fields(m, s.points, s.n, p, ip);
    double value[CELL_FIELDS];
    for (int k = 0; k < CELL_FIELDS; ++k) value[k] = cell_field[k].value(ip);
    cell.add(value);
  }
  return cell;
}

void write_mp(const Model& m, const State& s, const Fragments& fragments, Output& out)
{
  const Points& pts  = s.points;
  const Shown shown  = points_shown(m, pts);
  const bool here    = !shown.point.empty();
  const IntVec& list = shown.point;
  if (!anybody(m, here)) return;
  VtkFile f;
  begin(f, VTK_MP, m, s, here, out);
  write_domains(f, m, s, shown);
  vtk_point_data(f, static_cast<int>(shown.corner.size()));
  vtk_vectors(f, "displacement", picked(shown.corner, m.dim, s.n.uc), m.dim);
  vtk_cell_data(f, static_cast<int>(list.size()));
  vtk_vectors(f, "velocity", picked(list, m.dim, point_velocities(pts, m.dim, s.n.vc)), m.dim);
  write_fields(f, m, point_fields(m, s, list));
  IntVec body;
  for (int p : list) body.push_back(pts.body[p] + 1);
  vtk_labels(f, "body", body);
  vtk_labels(f, "label", picked(list, 1, pts.label));
  if (!s.frac.empty() || !m.fracture.empty()) {
    IntVec parent, broken;
    RealVec time;
    for (int p : list) {
      parent.push_back(pts.parent[p] >= 0 ? m.mesh.elem_label[pts.parent[p]] : 0);
      broken.push_back(pts.broken[p] >= 0 || point_open(m, pts, s.n, p));
      time.push_back(pts.parent[p] >= 0 ? s.frac.time[pts.parent[p]] : -1.0);
    }
    vtk_labels(f, "parent", parent);
    vtk_labels(f, "broken", broken);
    vtk_labels(f, "released", picked(list, 1, pts.released));
    vtk_scalars(f, "time_broken", time);
  }
  if (m.output.fragments.on) vtk_labels(f, "fragment", picked(list, 1, fragments.of_point));
  end(f, VTK_MP, m, here, out);
}

// ---- bonds ------------------------------------------------------------------------

// force of side A on side B: C slip + lambda
void bond_force(const State& s, int dim, int b, double force[3])
{
  double C[9];
  // contact: pressure along the normal, and friction
  if (s.bonds.side[b] == SIDE_CONTACT) {
    const double g = s.n.slip[b * dim], n = s.bonds.beyond(b, g),
                 p = std::min(s.bonds.cn[b] * g + s.n.lambda_n[b], 0.0) + s.bonds.growth(b) * n * n * n;
    for (int i = 0; i < dim; ++i) force[i] = p * s.bonds.normal[b * dim + i] + s.n.lambda[b * dim + i];
    return;
  }
  bond_stiffness(s.bonds, dim, b, C);
  for (int i = 0; i < dim; ++i) {
    force[i] = s.n.lambda[b * dim + i];
    for (int j = 0; j < dim; ++j) force[i] += C[i * dim + j] * s.n.slip[b * dim + j];
  }
}

void write_bonds(const Model& m, const State& s, Output& out)
{
  const Bonds& bonds = s.bonds;
  const int dim      = m.dim;
  IntVec list;
  for (int b = 0; b < bonds.nbond; ++b)
    if (bonds.counts(b)) list.push_back(b);
  const bool here = !list.empty();
  if (!anybody(m, here)) return;
  RealVec x, u, force, slip = s.n.slip;
  ListTable conn;
  IntVec kind = bonds.intermediate;
  bond_places(m, s.points, bonds, s.n.u, s.n.uc, x);
  const RealVec position = picked(list, dim, x);
  u = position;
  for (int b : list) {
    const int k = conn.size();
    double f[3];
    for (int i = 0; i < dim; ++i) u[k * dim + i] -= bonds.X[3 * b + i];
    // contact: the penetration along the normal; kind 2 open, 3 closed
    if (bonds.side[b] == SIDE_CONTACT) {
      const double g = std::min(s.n.slip[b * dim], 0.0);
      kind[b] = bonds.cn[b] * s.n.slip[b * dim] + s.n.lambda_n[b] < 0.0 ? 3 : 2;
      for (int i = 0; i < dim; ++i) slip[b * dim + i] = g * bonds.normal[b * dim + i];
    }
    bond_force(s, dim, b, f);
    force.insert(force.end(), f, f + dim);
    conn.item.push_back(k);
    conn.off.push_back(k + 1);
  }
  const int n = conn.size(), vertex = 1;
  VtkFile file;
  begin(file, VTK_BOND, m, s, here, out);
  vtk_mesh(file, position, dim, conn, IntVec(n, vertex));
  vtk_point_data(file, n);
  vtk_vectors(file, "displacement", u, dim);
  vtk_vectors(file, "slip", picked(list, dim, slip), dim);
  vtk_vectors(file, "force", force, dim);
  vtk_scalars(file, "area", picked(list, 1, bonds.area));
  vtk_labels(file, "kind", picked(list, 1, kind));
  vtk_labels(file, "bond", picked(list, 1, bonds.def));
  end(file, VTK_BOND, m, here, out);
}

// ---- active grid --------------------------------------------------------------------

void cell_corners(const Grid& g, int dim, long key, RealVec& x)
{
  const int corner[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                            {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  double low[3];
  grid_cell_position(g, dim, key, low);
  for (int a = 0; a < (dim == 3 ? 8 : 4); ++a)
    for (int i = 0; i < dim; ++i) x.push_back(low[i] + g.h[i] * corner[a][i]);
}

void write_grid(const Model& m, const State& s, const ActiveGrid& grid, Output& out)
{
  const bool here = grid.ncell > 0;
  if (!anybody(m, here)) return;
  const int nen = m.dim == 3 ? 8 : 4;
  RealVec x;
  IntVec field;
  ListTable conn;
  for (int c = 0; c < grid.ncell; ++c) {
    cell_corners(m.grid, m.dim, grid.cell[c], x);
    field.push_back(static_cast<int>(grid.cell[c] / grid_cells(m.grid, m.dim)));
    for (int a = 0; a < nen; ++a) conn.item.push_back(c * nen + a);
    conn.off.push_back((c + 1) * nen);
  }
  VtkFile f;
  begin(f, VTK_GRID, m, s, here, out);
  vtk_mesh(f, x, m.dim, conn, IntVec(grid.ncell, shape_info[m.dim == 3 ? SHAPE_HEX8 : SHAPE_QUAD4].vtk));
  vtk_cell_data(f, grid.ncell);
  vtk_labels(f, "field", field);
  end(f, VTK_GRID, m, here, out);
}

// number of 000123.vtk, .vtu, .pvtu, or of a piece 000123_r2.vtu; -1: not the name of a frame
int frame_number(const std::string& name)
{
  int frame = 0, rank = 0, end = 0;
  if (std::sscanf(name.c_str(), "%d%n", &frame, &end) != 1) return -1;
  const std::string tail = name.substr(static_cast<std::size_t>(end));
  for (const char* ending : endings)
    if (tail == std::string(".") + ending) return frame;
  end = 0;
  const bool piece = std::sscanf(tail.c_str(), "_r%d.vtu%n", &rank, &end) == 1;
  return piece && end > 0 && tail.size() == static_cast<std::size_t>(end) ? frame : -1;
}

}  // namespace

// ---------------------------------------------------------------------------
// out_vtk_series : the list of frames and their times, for ParaView
// ---------------------------------------------------------------------------
void out_vtk_series(const std::string& path, const VtkSeries& series)
{
  std::FILE* file = out_file_open(path);
  std::fprintf(file, "{\n  \"file-series-version\" : \"1.0\",\n  \"files\" : [\n");
  for (std::size_t i = 0; i < series.file.size(); ++i)
    std::fprintf(file, "    { \"name\" : \"%s\", \"time\" : %.16g }%s\n", series.file[i].c_str(),
                 series.time[i], i + 1 < series.file.size() ? "," : "");
  std::fprintf(file, "  ]\n}\n");
  out_file_close(file, path);
}

// ---------------------------------------------------------------------------
// out_vtk_continue : deletes frames from out.vtk_frame on, also from the series
// ---------------------------------------------------------------------------
void out_vtk_continue(const Output& out)
{
  namespace fs = std::filesystem;
  const fs::path base(out.base);
  std::error_code error;
  std::vector<fs::path> late;
  for (const fs::directory_entry& e :
       fs::directory_iterator(base.has_parent_path() ? base.parent_path() : fs::path("."), error)) {
    const std::string name = e.path().filename().string();
    for (int k = 0; k < VTK_KINDS; ++k) {
      const std::string head = base.filename().string() + "_" + kind_name[k] + "_";
      if (name.compare(0, head.size(), head) == 0 && frame_number(name.substr(head.size())) >= out.vtk_frame)
        late.push_back(e.path());
    }
  }
  for (const fs::path& path : late) fs::remove(path, error);
  for (int k = 0; k < VTK_KINDS; ++k)
    for (const char* ending : endings) write_series(out, static_cast<VtkKind>(k), ending);
}

// ---------------------------------------------------------------------------
// out_vtk : one frame at t(n), in the present configuration, so that the four kinds fit together
// ---------------------------------------------------------------------------
void out_vtk(const Model& m, const Elements& el, const State& s, const ActiveGrid& grid, Output& out)
{
  Fragments fragments;
  if (m.output.fragments.on) frac_fragments(m, el, s, fragments);
  write_fe(m, el, s, fragments, out);
  write_mp(m, s, fragments, out);
  write_bonds(m, s, out);
  write_grid(m, s, grid, out);
  ++out.vtk_frame;
  out.vtk_time.inc = s.log.inc_total;
}
