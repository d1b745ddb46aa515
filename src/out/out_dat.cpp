// Tables of *NODE PRINT and *EL PRINT, in the format of the .dat files of CalculiX. Rows of a divided model
// are gathered on rank 0, in the order of the mesh of the deck.
#include <algorithm>
#include <cmath>

#include "out/out.h"

namespace {

// 0.5000000E+00 in 14 columns, as Fortran writes E14.7
std::string fortran_time(double t)
{
  int exponent = t == 0.0 ? 0 : static_cast<int>(std::floor(std::log10(std::fabs(t)))) + 1;
  double mantissa = t == 0.0 ? 0.0 : t / std::pow(10.0, exponent);
  if (std::fabs(mantissa) >= 0.99999995) {
    mantissa /= 10.0;
    ++exponent;
  }
  char text[40];
  std::snprintf(text, sizeof text, "%10.7fE%+03d", mantissa, exponent);
  return std::string(text).size() < 14 ? " " + std::string(text) : text;
}

void header(std::FILE* file, const char* what, const Set& set, double time)
{
  std::fprintf(file, "\n %s for set %s and time %s\n\n", what, set.name.c_str(), fortran_time(time).c_str());
}

struct Row {                   // of a node or a Gauss point
  int index;                   // in the mesh of the deck
  int label, gauss;
  double v[6];
};

// gathers the rows of all ranks on rank 0, in the order of the deck; on one rank they already have it
void gather_rows(const Model& m, std::vector<Row>& rows)
{
  if (!m.part.on) return;
  std::vector<Row> all;
  for (const std::vector<Row>& part : comm_gather(rows)) all.insert(all.end(), part.begin(), part.end());
  std::stable_sort(all.begin(), all.end(), [](const Row& a, const Row& b) { return a.index < b.index; });
  rows.swap(all);
}

void node_table(std::FILE* file, const char* what, const Model& m, const RealVec& field, const Set& set,
                double time)
{
  std::vector<Row> rows;
  for (int n : set.item) {
    if (!m.part.counts(n)) continue;
    Row row = {m.part.deck_number(n), m.mesh.node_label[n], 0, {}};
    std::copy_n(&field[n * m.dim], m.dim, row.v);
    rows.push_back(row);
  }
  gather_rows(m, rows);
  header(file, what, set, time);
  for (const Row& r : rows)
    std::fprintf(file, "%10d%14.6E%14.6E%14.6E\n", r.label, r.v[0], r.v[1], r.v[2]);
}

// components in the nodal coordinate systems (*TRANSFORM), as CalculiX prints them
RealVec local_field(const Model& m, const RealVec& field)
{
  RealVec out = field;
  for (const Frame& f : m.frame) frame_turn(f, m.dim, false, &field[f.node * m.dim], &out[f.node * m.dim]);
  return out;
}

void total_rows(std::FILE* file, const Model& m, const RealVec& field, const Set& set, double time)
{
  double sum[3] = {0, 0, 0};
  for (int n : set.item)
    for (int i = 0; i < m.dim && m.part.counts(n); ++i) sum[i] += field[n * m.dim + i];
  out_sum(m, sum, 3);
  header(file, "total force (fx,fy,fz)", set, time);
  std::fprintf(file, "%6s%14.6E%14.6E%14.6E\n", "", sum[0], sum[1], sum[2]);
}

void node_print(std::FILE* file, const Model& m, const State& s, const PrintRequest& request)
{
  const Set& set = m.nset[request.set];
  const auto table = [&](const char* head, const RealVec& field) {
    if (request.global || m.frame.empty()) node_table(file, head, m, field, set, s.n.time);
    else node_table(file, head, m, local_field(m, field), set, s.n.time);
  };
  for (const std::string& what : request.what) {
    if (what == "U") table("displacements (vx,vy,vz)", s.n.u);
    if (what == "V") table("velocities (vx,vy,vz)", s.n.v);
    if (what == "A") table("accelerations (vx,vy,vz)", s.n.a);
    if (what == "RF" && !request.only) table("forces (fx,fy,fz)", s.rf);
    if (what == "RF" && request.totals) total_rows(file, m, s.rf, set, s.n.time);
  }
}

// order of CalculiX: xx yy zz xy xz yz
void six(std::FILE* file, const double v[6])
{
  std::fprintf(file, "%14.6E%14.6E%14.6E%14.6E%14.6E%14.6E\n", v[0], v[1], v[2], v[3], v[5], v[4]);
}

void el_rows(std::FILE* file, const Model& m, const Elements& el, const State& s, const Set& set, char what)
{
  IpFields f;
  std::vector<Row> rows;
  for (int e : set.item)
    for (int g = 0; g < elem_gauss(m, el, e); ++g) {
      elem_ip_fields(m, el, s.n, out_nlgeom(m, s), e, g, f);
      Row row = {m.part.elem_number(e), m.mesh.elem_label[e], g + 1, {}};
      if (what == 'S') std::copy_n(f.sig, 6, row.v);
      if (what == 'E') std::copy_n(f.E, 6, row.v);
      if (what == 'W') row.v[0] = f.psi;
      if (what == 'P') row.v[0] = f.plastic;
      rows.push_back(row);
    }
  gather_rows(m, rows);
  for (const Row& r : rows) {
    std::fprintf(file, "%10d%4d", r.label, r.gauss);
    if (what == 'S' || what == 'E') six(file, r.v);
    else std::fprintf(file, "%14.6E\n", r.v[0]);
  }
}

void el_print(std::FILE* file, const Model& m, const Elements& el, const State& s,
              const PrintRequest& request)
{
  const Set& set = m.elset[request.set];
  const char* const points = "elem, integ.pnt.,";
  for (const std::string& what : request.what) {
    const bool stress = what == "S", strain = what == "E", energy = what == "ENER", plastic = what == "PEEQ";
    if (!stress && !strain && !energy && !plastic) continue;
    const std::string head = stress ? std::string("stresses (") + points + "sxx,syy,szz,sxy,sxz,syz)"
                           : strain ? std::string("strains (") + points + "exx,eyy,ezz,exy,exz,eyz)"
                           : energy ? std::string("internal energy density (") + points + "energy)"
                                    : std::string("equivalent plastic strain (") + points + "pe)";
    header(file, head.c_str(), set, s.n.time);
    el_rows(file, m, el, s, set, stress ? 'S' : strain ? 'E' : energy ? 'W' : 'P');
  }
}

}  // namespace

// ---------------------------------------------------------------------------
// out_dat : prints the requests of the current step, every n-th increment and at the end of the step
// ---------------------------------------------------------------------------
void out_dat(const Model& m, const Elements& el, const State& s, Output& out)
{
  if (s.log.step < 1) return;
  const Step& step = m.step[s.log.step - 1];
  const bool last  = clock_over(step, s.clock);
  for (const PrintRequest& request : step.print) {
    const int every = request.frequency < 1 ? 1 : request.frequency;
    if (!last && s.log.inc % every != 0) continue;
    if (!out.dat) out.dat = out_file_first(out.base + ".dat");
    if (request.element)
      el_print(out.dat, m, el, s, request);
    else
      node_print(out.dat, m, s, request);
  }
  if (out.dat) out_file_flush(out.dat, out.base + ".dat");
}
