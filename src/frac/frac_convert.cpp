#include <algorithm>
#include <cmath>
#include <map>

#include <Eigen/Eigenvalues>

#include "base/comm.h"
#include "base/grow.h"
#include "base/log.h"
#include "contact/contact.h"
#include "frac/frac.h"
#include "mat/voigt.h"
#include "shape/shape.h"

namespace {

// values of a nodal field at the corners created by an element                               (7.9)
void interpolate(const CornerShare& share, const RealVec& node, int dim, RealVec& corner)
{
  room_for(corner, share.made.size() * dim, 8);      // three levels have such arrays
  for (size_t k = 0; k < share.made.size(); ++k)
    for (int i = 0; i < dim; ++i) {
      double sum = 0.0;
      for (int j = share.node.off[k]; j < share.node.off[k + 1]; ++j)
        sum += share.weight[j] * node[share.node.item[j] * dim + i];
      corner.push_back(sum);
    }
}

// velocity of element e at corner c: of the node at the corner, or (no hang: a body that does not follow
// nodes) interpolated in the element
void element_velocity(const Model& m, const Points& pts, int e, int c, const RealVec& v, double* out)
{
  if (pts.hang.count(c) == 1) {
    std::copy_n(&v[pts.hang.begin(c)[0] * m.dim], m.dim, out);
    return;
  }
  double N[8];
  MPFE_CHECK(point_corner_in_element(m, pts, e, c, N),
             "a corner of a converted element lies outside of the element");
  for (int i = 0; i < m.dim; ++i) {
    out[i] = 0.0;
    for (int a = 0; a < m.mesh.conn.count(e); ++a) out[i] += N[a] * v[m.mesh.conn.begin(e)[a] * m.dim + i];
  }
}

// velocity of a corner shared with a neighbour converted earlier: the mean, weighted by mass  (7.11)
//   in   before, added: masses of the neighbours and of e at corner c
void share_momentum(const Model& m, const Points& pts, int e, int c, double before, double added, Level& l)
{
  double v[3];
  element_velocity(m, pts, e, c, l.v, v);
  for (int i = 0; i < m.dim; ++i) {
    double& vc = l.vc[c * m.dim + i];
    vc = (before * vc + added * v[i]) / (before + added);
  }
}

using Mat3 = Eigen::Matrix3d;

Mat3 plastic_metric(const double* a)                   // Cp^-1 of HISTORY_DEFORMATION
{
  return full_tensor(a) + Mat3::Identity();
}

Mat3 matrix(const double* F) { return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(F); }

// index of the plastic deformation in the history of point p, -1: none. Broken material keeps that of its
// plastic law
int plastic_part(const Model& m, const Points& pts, int p)
{
  if (pts.broken[p] >= 0 && !law_flows(point_material(m, pts, p).law)) return -1;
  return law_field(law_of(mat_law(point_material(m, pts, p), PLANE_NONE)), HISTORY_DEFORMATION);
}

// F of a Gauss point or a point for its law: with an initial strain the rotation of Fbar times the root of
// Fbar^T Fbar + 2 E0                                                                               (2.44)
Mat3 total_gradient(const MatLaw& law, const IpFields& f, const double* h)
{
  const Mat3 F = matrix(f.Fbar);
  if (law.initial < 0) return F;
  const Mat3 E = full_tensor(h + law.initial);
  const Mat3 C = F.transpose() * F;
  const Eigen::SelfAdjointEigenSolver<Mat3> own(C), all(C + 2.0 * E);
  return F * own.operatorInverseSqrt() * all.operatorSqrt();
}

// Elastic deformation be = F Cp^-1 F^T of a Gauss point or a point of plastic material: what its stress
// depends on
Mat3 elastic_metric(const MatLaw& law, const IpFields& f, const double* h, int plastic)
{
  const Mat3 F = total_gradient(law, f, h);
  return F * plastic_metric(h + plastic) * F.transpose();
}

MatLaw intact_law(const Model& m, const Points& pts, int p)
{
  return mat_law(point_material(m, pts, p), PLANE_NONE);
}

// sets the plastic deformation of point p for the elastic deformation be
void set_elastic(const Model& m, int p, const Mat3& be, State& st)
{
  const size_t n = point_history_size(st.points, st.n);
  IpFields f;
  point_ip_fields(m, st.points, st.n, p, f);
  double* h = history_at(st.n.hp, n, p);
  const Mat3 inv = total_gradient(intact_law(m, st.points, p), f, h).inverse(),
             C   = inv * be * inv.transpose() - Mat3::Identity();
  h += plastic_part(m, st.points, p);
  using V = VoigtIndex<3>;
  for (int k = 0; k < 6; ++k) h[k] = 0.5 * (C(V::row[k], V::col[k]) + C(V::col[k], V::row[k]));
}

// Gauss point of element e nearest to point p at t = 0
int nearest_gauss(const Model& m, const Elements& el, int e, const Points& pts, int p)
{
  double X[3], at[3], N[8], nearest = 1e300;
  int best = 0;
  point_centre(pts, m.dim, p, X);
  for (int g = 0; g < shape_info[el.block[el.initial_block[e]].shape].ngp; ++g) {
    elem_gauss_position(m, el, e, g, at, N);
    double d = 0.0;
    for (int i = 0; i < m.dim; ++i) d += (X[i] - at[i]) * (X[i] - at[i]);
    if (d >= nearest * (1.0 - 1e-9)) continue;
    nearest = d;
    best    = g;
  }
  return best;
}

// copies the history of the nearest Gauss point to the points of element e, since the mean of plastic
// deformations is not a plastic deformation;  be: elastic deformations, of plastic material
void pass_history(const Model& m, const Elements& el, int e, int first, State& st, std::map<int, Mat3>& be)
{
  const size_t n = static_cast<size_t>(el.history);
  if (n == 0) return;
  append(st.n.hp, st.points.npoint * n - st.n.hp.size(), 0.0);
  IpFields f;
  for (int p = first; p < st.points.npoint; ++p) {
    const int g     = nearest_gauss(m, el, e, st.points, p);
    const double* h = history_at(st.n.he, n, el.gauss_of[e] + g);
    std::copy_n(h, n, history_at(st.n.hp, n, p));
    const int plastic = plastic_part(m, st.points, p);
    if (plastic < 0) continue;
    elem_ip_fields(m, el, st.n, true, e, g, f);
    be[p] = elastic_metric(intact_law(m, st.points, p), f, h, plastic);
  }
}

// elastic deformations of points whose gradients conversion may change (7.14)
void note_elastic(const Model& m, const State& st, std::map<int, Mat3>& be)
{
  if (st.n.hp.empty()) return;
  const size_t n = point_history_size(st.points, st.n);
  IpFields f;
  for (int p = 0; p < st.points.npoint; ++p) {
    const int plastic = st.points.parent[p] < 0 ? -1 : plastic_part(m, st.points, p);
    if (plastic < 0) continue;
    point_ip_fields(m, st.points, st.n, p, f);
    be[p] = elastic_metric(intact_law(m, st.points, p), f, history_at(st.n.hp, n, p), plastic);
  }
}

//   mass [ncorner]    of the domains so far, at corners
//   added [ncorner]   scratch, all zero before and after
void convert_one(const Model& m, const Elements& el, const FracMesh& fm, int e, CornerShare& share,
                 RealVec& mass, RealVec& added, State& st, std::map<int, Mat3>& be)
{
  const ConversionDef& c = m.conversion[fm.conv[e]];
  const int first = st.points.npoint, old = st.points.ncorner;
  point_convert(m, c.body[m.mesh.elem_section[e]], e, st.points.npoint_all(), share, st.points);
  interpolate(share, st.n.u, m.dim, st.n.uc);
  interpolate(share, st.n.v, m.dim, st.n.vc);
  mass.resize(st.points.ncorner, 0.0);
  added.resize(st.points.ncorner, 0.0);
  point_add_mass(st.points, first, added);
  for (int k = st.points.conn.off[first]; k < st.points.conn.off[st.points.npoint]; ++k) {
    const int corner = st.points.conn.item[k];
    if (added[corner] == 0.0) continue;
    if (corner < old) share_momentum(m, st.points, e, corner, mass[corner], added[corner], st.n);
    mass[corner] += added[corner];
    added[corner] = 0.0;
  }
  for (int p = first; p < st.points.npoint; ++p) {
    st.points.broken[p] = st.frac.broken[e];
    for (int i = 0; i < 3; ++i) st.points.normal[3 * p + i] = st.frac.normal[3 * e + i];
  }
  pass_history(m, el, e, first, st, be);
  st.frac.phase[e] = AS_POINTS;
  st.frac.converted.push_back(e);
}

// faces of finite elements adjacent to converted elements with an interface, by definition
std::vector<BondFace> interface_faces(const Model& m, const FracMesh& fm, const Points& pts,
                                      const Fracture& fr)
{
  std::vector<BondFace> out;
  for (int e : fr.converted) {
    if (!m.conversion[fm.conv[e]].bonded || point_any_released(pts, e)) continue;
    for (int f = 0; f < 6; ++f) {
      const int o = fm.across[6 * e + f];
      if (o < 0 || fr.phase[o] != AS_ELEMENT) continue;
      out.push_back(
          {m.conversion[fm.conv[e]].bond_of[m.mesh.elem_section[e]], {o, fm.across_face[6 * e + f]}});
    }
  }
  std::stable_sort(out.begin(), out.end(), [](const BondFace& a, const BondFace& b) {
    return a.def != b.def               ? a.def < b.def
           : a.face.elem != b.face.elem ? a.face.elem < b.face.elem
                                        : a.face.face < b.face.face;
  });
  return out;
}

// Converted elements whose corners are not on the grid: with a node that has an element, and in the second
// row elements without an interior node of converted elements: too few points for the grid (7.14)
//   lost [nnode]   1: without an element
std::vector<char> rim_elements(const Model& m, const FracMesh& fm, const IntVec& lost, const Fracture& fr,
                               const Points& pts)
{
  // beside: nodes of elements of the first row
  std::vector<char> rim(m.mesh.nelem(), 0), beside(m.mesh.nnode(), 0);
  const auto any = [&](int e, auto good) {
    return std::any_of(m.mesh.conn.begin(e), m.mesh.conn.begin(e) + m.mesh.conn.count(e), good);
  };
  for (int e : fr.converted) {
    if (!any(e, [&](int n) { return !lost[n]; })) continue;
    for (int k = m.mesh.conn.off[e]; k < m.mesh.conn.off[e + 1]; ++k) beside[m.mesh.conn.item[k]] = 1;
    rim[e] = !point_any_released(pts, e);
  }
  for (int e : fr.converted) {
    const int most    = shape_info[elem_table[m.mesh.elem_type[e]].shape].around;
    const auto inside = [&](int n) { return lost[n] && !beside[n] && fm.of_node.count(n) >= most; };
    if (any(e, [&](int n) { return beside[n]; }) && !any(e, inside)) rim[e] = !point_any_released(pts, e);
  }
  return rim;
}

// Carriers of the corners of rim elements: the node at the corner; at a node without elements, unknowns of
// its own, or the grid if other broken elements share it; corners between nodes follow those at the nodes.
// All other corners are on the grid. (7.14)
void hang_corners(const Model& m, const FracMesh& fm, const IntVec& lost, const Fracture& fr, Points& pts)
{
  enum { RIM = 1, DEBRIS = 2, APART = 4 };
  std::vector<char> rim = rim_elements(m, fm, lost, fr, pts);
  if (m.part.around_points.on()) halo_copy(m.part.around_points, 1, rim);
  for (int e : fr.converted) point_sample(m, e, rim[e] && !m.conversion[fm.conv[e]].bonded, pts);
  IntVec used(pts.ncorner, 0), name(pts.ncorner, 0); // by elements; of all copies of a corner
  for (int e : fr.converted) {
    const int first = pts.of_elem[e], by = rim[e]                   ? RIM
                                           : point_any_released(pts, e)      ? APART
                                           : pts.broken[first] >= 0 ? DEBRIS
                                                                    : 0;
    for (int p = first; p < pts.npoint && pts.parent[p] == e; ++p)
      for (int k = pts.conn.off[p]; k < pts.conn.off[p + 1]; ++k) used[pts.conn.item[k]] |= by;
  }
  for (int c = 0; c < pts.ncorner; ++c) name[pts.first_copy[c]] |= used[c];
  pts.hangs.assign(pts.ncorner, HANG_GRID);
  for (int c = 0; c < pts.ncorner; ++c) {
    const bool apart = used[c] & (DEBRIS | APART);
    const int n      = pts.hang.count(c);
    if (n > 1 && (name[pts.first_copy[c]] & RIM) && !apart) pts.hangs[c] = HANG_CORNERS;
    if (n != 1 || !(used[c] & RIM)) continue;
    if (!lost[pts.hang.begin(c)[0]]) pts.hangs[c] = HANG_NODE;
    else if (!apart) pts.hangs[c] = HANG_OWN;
  }
}

// nodes whose last element has been converted
IntVec lost_nodes(const Model& m, const FracMesh& fm, const Fracture& fr)
{
  IntVec lost(m.mesh.nnode(), 0);
  for (int e : fr.converted)
    for (int k = m.mesh.conn.off[e]; k < m.mesh.conn.off[e + 1]; ++k) lost[m.mesh.conn.item[k]] = 1;
  for (int n = 0; n < m.mesh.nnode(); ++n)
    for (int k = fm.of_node.off[n]; lost[n] && k < fm.of_node.off[n + 1]; ++k)
      if (fr.phase[fm.of_node.item[k]] == AS_ELEMENT) lost[n] = 0;
  return lost;
}

// det F and the ratio of the principal stretches, at the worst Gauss point
double distortion(const Model& m, const Elements& el, int e, const Level& l)
{
  double worst = 1.0;
  IpFields f;
  for (int g = 0; g < shape_info[el.block[el.initial_block[e]].shape].ngp; ++g) {
    elem_ip_fields(m, el, l, true, e, g, f);
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> F(f.F);
    Eigen::VectorXd stretch2;
    if (m.dim == 2)
      stretch2 = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(F.topLeftCorner<2, 2>().transpose() *
                                                                F.topLeftCorner<2, 2>())
                     .eigenvalues();
    else stretch2 = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(F.transpose() * F).eigenvalues();
    worst = std::min(
        {worst, F.determinant(), std::sqrt(std::max(0.0, stretch2.minCoeff() / stretch2.maxCoeff()))});
  }
  return worst;
}

// elements from index first on, of all ranks, ascending by their numbers in the deck
void join_sorted(const MeshPart& deck, size_t first, IntVec& list)
{
  if (!deck.on) return;
  IntVec part;
  for (size_t k = first; k < list.size(); ++k) part.push_back(deck.elem_number(list[k]));
  comm_allgatherv(part);
  std::sort(part.begin(), part.end());
  list.resize(first);
  list.insert(list.end(), part.begin(), part.end());
}

}  // namespace

void frac_due(const Model& m, const Elements& el, const FracMesh& fm, const Fracture& fr, const Level& l,
              IntVec& out)
{
  out.clear();
  for (size_t c = 0; c < m.conversion.size(); ++c) {
    const ConversionDef& d = m.conversion[c];
    const size_t first     = out.size();
    if (d.trigger == TRIGGER_EROSION || (d.trigger == TRIGGER_TIME && l.time < d.limit * (1.0 - 1e-9)))
      continue;
    for (int e : m.elset[d.elset].item) {
      if (fm.conv[e] != static_cast<int>(c) || fr.phase[e] != AS_ELEMENT || el.initial_block[e] < 0) continue;
      if (d.trigger == TRIGGER_TIME || distortion(m, el, e, l) < d.limit) out.push_back(e);
    }
    join_sorted(m.part, first, out);
  }
}

void frac_convert(const Model& m, Elements& el, const FracMesh& fm, const IntVec& number, CornerShare& share,
                  State& st)
{
  if (number.empty()) return;
  IntVec elem, turn;           // of elements whose points this rank stores
  for (size_t k = 0; k < number.size(); ++k) {
    const int e = m.part.elem_here(number[k]);
    if (e < 0) continue;
    if (!m.part.stores_points(e)) {
      st.frac.phase[e] = AS_POINTS;
      continue;
    }
    elem.push_back(e);
    turn.push_back(static_cast<int>(k));
  }
  ListTable made;
  RealVec mass(st.points.ncorner, 0.0), added;
  std::map<int, Mat3> be;      // [point] of plastic material: conserves the stress
  note_elastic(m, st, be);
  point_add_mass(st.points, 0, mass);
  for (int e : elem) {
    convert_one(m, el, fm, e, share, mass, added, st, be);
    made.item.insert(made.item.end(), share.made.begin(), share.made.end());
    made.off.push_back(static_cast<int>(made.item.size()));
  }
  if (m.part.window) {
    point_number(m, elem, turn, made, st.points);
    point_copy_corners(st.points, m.dim, {&st.n.uc, &st.n.vc});
  }
  st.frac.nconverted += static_cast<int>(number.size());
  elem_refresh(el);
  frac_interfaces(m, fm, st);
  for (const auto& b : be) set_elastic(m, b.first, b.second, st);
  if (m.part.window) point_copy_history(m.part, point_ranks(m.part, st.points), st.points, el.history, st.n);
}

void frac_interfaces(const Model& m, const FracMesh& fm, State& st)
{
  point_surfaces(m, st.points);
  const IntVec lost = lost_nodes(m, fm, st.frac);
  hang_corners(m, fm, lost, st.frac, st.points);
  if (m.part.window) halo_copy(st.points.part.halo, 1, st.points.hangs);
  const std::vector<BondFace> bonded = interface_faces(m, fm, st.points, st.frac);
  std::vector<Face> tied;
  for (const BondFace& b : bonded) tied.push_back(b.face);
  const IntVec fresh = bond_rebuild(m, st.points, bonded, lost, contact_skin(m, st.frac, st.points, tied),
                                    st.bonds, st.n);
  contact_offsets(m, st.points, fresh, st.bonds);
}
