#include <algorithm>
#include <cmath>

#include "frac/frac_scan.h"
#include "shape/shape.h"

// The configurational force on the interface of two materials, which exists without a crack.        (7.36)

namespace {

// cosine between the normals of two free faces at a node, above which the surface there is no tip of a crack:
// the corners at the end of a notch of one element have 0 (test: fracture/slit_interface.inp)
const double TIP_COS = 0.2;

// do two free faces at the node face each other, as at the end of a slit?
bool ends_notch(const Scan& s, int node)
{
  std::vector<FreeFace> face;
  for (int k = 0; k < s.fm.of_node.count(node); ++k) {
    const int e = s.fm.of_node.begin(node)[k];
    if (s.el.initial_block[e] < 0) continue;
    for (int f = 0; f < shape_info[s.el.block[s.el.initial_block[e]].shape].nface; ++f) {
      if (s.fm.across[6 * e + f] >= 0) continue;
      const FreeFace x = free_face(s.m.mesh, e, f, false);
      if (std::find(x.node, x.node + x.n, node) != x.node + x.n) face.push_back(x);
    }
  }
  for (size_t i = 0; i < face.size(); ++i)
    for (size_t j = 0; j < i; ++j) {
      const FreeFace &a = face[i], &b = face[j];
      double dot = 0.0;
      for (int k = 0; k < 3; ++k) dot += a.area[k] * b.area[k];
      if (dot < TIP_COS * a.size * b.size && facing(a, b, a.n == 2 ? a.size : std::sqrt(a.size), dot < 0.0))
        return true;
    }
  return false;
}

// Fields on one side of an interface; strains include the initial one, which is 0 for most
struct InterfaceSide {
  double lam, mu;              // times thickness
  double along[9] = {0};       // strain along the face [dim*dim]
  double initial[9] = {0};
  double E33 = 0.0;            // plane strain with an initial stress
};

// part of a strain along a face with the normal n                                             [D*D]
template <int D>
void strain_along(const double* E, const double* n, double* along)
{
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) {
      along[i * D + j] = 0.0;
      for (int p = 0; p < D; ++p)
        for (int q = 0; q < D; ++q)
          along[i * D + j] += ((i == p) - n[i] * n[p]) * E[p * D + q] * ((q == j) - n[q] * n[j]);
    }
}

// W - t . du/dn on a side, times thickness, from the traction t (times thickness) and the strain along it
template <int D>
double side_of(const InterfaceSide& x, const double* t, const double* n)
{
  double tn = 0.0, tt = 0.0, nn0 = 0.0, t0 = 0.0, trace = x.E33, square = x.E33 * x.E33;
  for (int i = 0; i < D; ++i) {
    tn += t[i] * n[i];
    tt += t[i] * t[i];
    trace += x.along[D * i + i];
    for (int j = 0; j < D; ++j) {
      nn0 += n[i] * x.initial[D * i + j] * n[j];
      t0 += t[i] * x.initial[D * i + j] * n[j];
    }
  }
  for (int k = 0; k < D * D; ++k) square += x.along[k] * x.along[k];
  const double nn     = (tn - x.lam * trace) / (x.lam + 2.0 * x.mu);
  const double shear2 = std::max(0.0, tt - tn * tn);
  return 0.5 * (x.lam * (nn + trace) * trace + 2.0 * x.mu * square - tn * nn - shear2 / x.mu) + 2.0 * t0 -
         tn * nn0;
}

// jump of the same across a face with the normal n from e to o
template <int D>
double jump_at(const Scan& s, int e, int o, const double* n)
{
  const int elem[2] = {e, o};
  InterfaceSide side[2];
  double t[D] = {0}, total[D * D] = {0};
  for (int k = 0; k < 2; ++k) {
    const MatLaw& law = s.law(elem[k]);
    const double thickness = s.fm.thickness[elem[k]];
    double E[9], S[9], along[9];
    mean_strain(s, elem[k], E);
    ip_law<D>(law, E, S);
    side[k].lam = law.lam * thickness;
    side[k].mu  = law.mu * thickness;
    if (law.initial >= 0) {
      mean_initial(s, elem[k], side[k].initial);
      const double p = stress_of_33(s, elem[k]);
      side[k].E33 = p == 0.0 ? 0.0 : p / law.lam;
      for (int i = 0; i < D; ++i) S[i * D + i] += p;
    }
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j) t[i] += 0.5 * thickness * S[i * D + j] * n[j];
    for (int i = 0; i < D * D; ++i) E[i] -= side[k].initial[i];
    strain_along<D>(E, n, along);
    for (int i = 0; i < D * D; ++i) total[i] += 0.5 * along[i];
  }
  for (InterfaceSide& x : side) {
    strain_along<D>(x.initial, n, x.along);
    for (int i = 0; i < D * D; ++i) x.along[i] += total[i];
  }
  return side_of<D>(side[1], t, n) - side_of<D>(side[0], t, n);
}

bool unlike(const Scan& s, int a, int b)
{
  return frac_other_material(s.el, a, b) || s.fm.thickness[a] != s.fm.thickness[b];
}

// J -= the force of the interface faces of e at one of its nodes, in the share q of the node
void take_faces(const Scan& s, int e, int node, double q, double* J)
{
  const int block = s.el.initial_block[e];
  for (int f = 0; f < shape_info[s.el.block[block].shape].nface; ++f) {
    const int o = s.fm.across[6 * e + f];
    if (o < 0 || !s.intact(o) || block >= s.el.initial_block[o] || !unlike(s, e, o)) continue;
    const FreeFace face = free_face(s.m.mesh, e, f, false);
    if (std::find(face.node, face.node + face.n, node) == face.node + face.n) continue;
    double n[3];
    for (int i = 0; i < 3; ++i) n[i] = face.area[i] / face.size;
    const double jump = s.m.dim == 2 ? jump_at<2>(s, e, o, n) : jump_at<3>(s, e, o, n);
    for (int i = 0; i < 3; ++i) J[i] -= q * jump * face.area[i] / face.n;
  }
}

}  // namespace

// a node of two materials off the crack: its index in fm.between, -1: none
int interface_node(const Scan& s, int node)
{
  const IntVec& between = s.fm.between;
  const auto at = std::lower_bound(between.begin(), between.end(), node);
  if (at == between.end() || *at != node) return -1;
  for (int k = 0; k < s.fm.of_node.count(node); ++k)
    if (s.cracked(s.fm.of_node.begin(node)[k])) return -1;
  return ends_notch(s, node) ? -1 : static_cast<int>(at - between.begin());
}

bool interface_bends(const Scan& s, int k)
{
  const double* n = &s.fm.between_normal[3 * static_cast<size_t>(k)];
  return n[0] == 0.0 && n[1] == 0.0 && n[2] == 0.0;
}

void take_interfaces(const Scan& s, const double* c, double radius, double* J)
{
  for (int node : s.fm.between) {
    const double q = weight_of(s, node, c, radius);
    if (q == 0.0) continue;
    const int k = interface_node(s, node);
    if (k < 0 || interface_bends(s, k)) continue;
    for (int i = 0; i < s.fm.of_node.count(node); ++i)
      if (s.intact(s.fm.of_node.begin(node)[i])) take_faces(s, s.fm.of_node.begin(node)[i], node, q, J);
  }
}
