#include <algorithm>
#include <cmath>

#include "assem/assem.h"
#include "base/comm.h"
#include "base/timer.h"
#include "shape/face.h"

namespace {

// does the deck need a damping matrix?
bool damped(const Model& m)
{
  return !m.viscous.empty() ||
         std::any_of(m.material.begin(), m.material.end(), [](const Material& a) { return a.alpha > 0.0; });
}

// rows and weights of a node or a corner
struct FaceNode {
  int n = 0;                   // rows
  const int* row = nullptr;
  const double* w = nullptr;
  int first = 0;               // offset of the rows
};

// C_IJ += w k; in diagonal blocks the lower part only
void add_block(Dofs& s, int I, int J, double w, const double* k)
{
  const SysMatrix& A = s.pattern.A;
  const auto begin   = A.col.begin() + A.off[I], end = A.col.begin() + A.off[I + 1];
  const size_t at    = std::lower_bound(begin, end, J) - A.col.begin();
  double* v = &s.mass.C[at * s.rows.dim * s.rows.dim];
  for (int i = 0; i < s.rows.dim; ++i)
    for (int j = 0; j < (I == J ? i + 1 : s.rows.dim); ++j)
      v[i * s.rows.dim + j] += w * k[i * s.rows.dim + j];
}

// Damping of a face of an element or a point: impedances times the factors of the deck
struct Impedance {
  double normal, shear;        // rho c_p, rho c_s                                   mass/(length^2 time)
};

Impedance impedance_of(const MatLaw& law, double density, const ViscousBoundary& v)
{
  return {v.a * std::sqrt(density * (law.lam + 2.0 * law.mu)), v.b * std::sqrt(density * law.mu)};
}

// C_ab += int N_a N_b [ rho c_p n n + rho c_s (I - n n) ] dA on the face at t = 0, X [nen*3]       (6.19)
void add_face(Dofs& s, int nen, const double* X, const FaceNode* node, double thickness, const Impedance& z)
{
  const int kind       = face_kind(s.rows.dim, nen);
  const FaceRule& rule = face_rule(kind);
  double N[MAX_FACE_NODES], n[3], k[9];
  for (int g = 0; g < rule.n; ++g) {
    face_eval(kind, rule.xi[g], N, nullptr);
    const double dA = face_area(kind, X, rule.xi[g], n);
    for (int i = 0; i < s.rows.dim; ++i)
      for (int j = 0; j < s.rows.dim; ++j)
        k[i * s.rows.dim + j] = rule.w[g] * thickness * dA *
                           ((i == j) * z.shear + (z.normal - z.shear) * n[i] * n[j] / (dA * dA));
    for (int a = 0; a < nen; ++a)
      for (int b = 0; b < nen; ++b)
        for (int p = 0; p < node[a].n; ++p)
          for (int q = 0; q < node[b].n; ++q) {
            const int I = node[a].first + node[a].row[p], J = node[b].first + node[b].row[q];
            if (I >= J) add_block(s, I, J, N[a] * N[b] * node[a].w[p] * node[b].w[q], k);
          }
  }
}

void add_element_face(const Mesh& mesh, const Elements& el, const ViscousBoundary& v, const Face& f, Dofs& s)
{
  if (el.block_of[f.elem] < 0) return;               // no longer an element
  const double one      = 1.0;
  const ElemBlock& b    = el.block[el.block_of[f.elem]];
  const ShapeInfo& info = shape_info[b.shape];
  const int* conn       = mesh.conn.begin(f.elem);
  const int nen         = info.nfnode[f.face];
  double X[3 * MAX_FACE_NODES];
  FaceNode node[MAX_FACE_NODES];
  for (int k = 0; k < nen; ++k) {
    const int n = conn[info.face[f.face][k]];
    std::copy(&mesh.X[3 * n], &mesh.X[3 * n] + 3, X + 3 * k);
    node[k] = {1, &s.rows.row_of_node[n], &one, 0};
  }
  add_face(s, nen, X, node, s.rows.dim == 2 ? b.thickness : 1.0, impedance_of(b.law, b.density, v));
}

void add_point_face(const Model& m, const Points& pts, const Discretisation& d, const ViscousBoundary& v,
                    const Face& f, Dofs& s)
{
  if (!s.pattern.owns_point(f.elem)) return;
  const Body& body      = m.body[pts.body[f.elem]];
  const ShapeInfo& info = shape_info[pts.shape[f.elem]];
  const int* conn       = pts.conn.begin(f.elem);
  const int nen         = info.nfnode[f.face];
  double X[12];
  FaceNode node[4];
  for (int k = 0; k < nen; ++k) {
    const int c = conn[info.face[f.face][k]];
    for (int i = 0; i < 3; ++i) X[3 * k + i] = i < s.rows.dim ? pts.Xc[c * s.rows.dim + i] : 0.0;
    const ActiveGrid& g = d.grid;
    node[k] = {g.corner.count(c), g.corner.begin(c), &g.corner_w[g.corner.off[c]], s.rows.nfe};
  }
  add_face(s, nen, X, node, s.rows.dim == 2 ? body.thickness : 1.0,
           impedance_of(d.point_law.body[pts.body[f.elem]], m.material[body.material].density, v));
}

}  // namespace

namespace {

// lumps C: row sums in the diagonal blocks, zero elsewhere
void lump_damping(Dofs& s)
{
  const int dim = s.rows.dim;
  const auto block = [&](size_t k) { return &s.mass.C[k * dim * dim]; };
  for (int r = 0; r < s.rows.nrow; ++r) {
    double* own = block(s.pattern.A.off[r + 1] - 1);
    for (int i = 0; i < dim; ++i)                      // only the lower part is stored
      for (int j = 0; j < i; ++j) own[j * dim + i] = own[i * dim + j];
  }
  for (int r = 0; r < s.rows.nrow; ++r)
    for (int k = s.pattern.A.off[r]; k < s.pattern.A.off[r + 1] - 1; ++k) {
      double *b = block(k), *row = block(s.pattern.A.off[r + 1] - 1),
          *col = block(s.pattern.A.off[s.pattern.A.col[k] + 1] - 1);
      for (int i = 0; i < dim; ++i)
        for (int j = 0; j < dim; ++j) {
          row[i * dim + j] += b[i * dim + j];
          col[j * dim + i] += b[i * dim + j];
          b[i * dim + j] = 0.0;
        }
    }
}

}  // namespace

void assem_damping(const Model& m, const Points& pts, const Discretisation& d, bool lumped, Dofs& s)
{
  const long made = d.grid.made;
  if (!damped(m)) return;
  if (s.mass.damping_of == s.pattern.number && s.mass.damping_made == made &&
      s.mass.damping_lumped == lumped) return;
  Timer timer(PHASE_MASS);
  s.mass.damping_of   = s.pattern.number;
  s.mass.damping_made = made;
  s.mass.damped       = true;
  RealVec M;
  mass_damping(m, pts, d, s, M);                       // alpha M                                     (6.18)
  const int dim = s.rows.dim;
  s.mass.C.assign(s.pattern.A.val.size(), 0.0);
  for (size_t k = 0; k < M.size(); ++k)
    for (int i = 0; i < dim; ++i) s.mass.C[(k * dim + i) * dim + i] = M[k];
  for (const ViscousBoundary& v : m.viscous) {
    for (const Face& f : m.surface[v.surface].face) add_element_face(m.mesh, d.el, v, f, s);
    for (const Face& f : pts.surface[v.surface]) add_point_face(m, pts, d, v, f, s);
  }
  s.mass.damping_lumped = lumped;
  if (lumped) lump_damping(s);
  s.mass.C_diag.resize(s.rows.neq());
  for (int r = 0; r < s.rows.nrow; ++r)
    for (int i = 0; i < dim; ++i)
      s.mass.C_diag[r * dim +
                    i] = s.mass.C[(static_cast<size_t>(s.pattern.A.off[r + 1] - 1) * dim + i) * dim + i];
  sys_sum(s.pattern.A, s.mass.C_diag);
}

void damping_multiply(const Dofs& s, const RealVec& x, RealVec& y)
{
  sys_multiply(s.pattern.A, s.mass.C, x, y);
  sys_sum(s.pattern.A, y);
}

double damping_work(const Dofs& s, const RealVec& x)
{
  RealVec y;
  sys_multiply(s.pattern.A, s.mass.C, x, y);
  double work = 0.0;
  for (int i = 0; i < s.rows.neq(); ++i) work += x[i] * y[i];
  comm_sum(&work, 1);
  return work;
}
