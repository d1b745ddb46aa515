#include "shape/face.h"

#include <algorithm>
#include <cmath>

namespace {

FaceRule of_cell(const GaussRule& cell)
{
  FaceRule r{};
  r.n = cell.n;
  for (int g = 0; g < cell.n; ++g) {
    r.w[g] = cell.w[g];
    for (int i = 0; i < 2; ++i) r.xi[g][i] = cell.xi[g][i];
  }
  return r;
}

FaceRule edge3_rule()
{
  const double g = std::sqrt(0.6);
  return {3, {{-g, 0}, {0, 0}, {g, 0}}, {5.0 / 9, 8.0 / 9, 5.0 / 9}};
}

// -1, 1, 0
void edge3(double xi, double* N, double* dN)
{
  N[0] = 0.5 * xi * (xi - 1.0);
  N[1] = 0.5 * xi * (xi + 1.0);
  N[2] = 1.0 - xi * xi;
  if (!dN) return;
  dN[0] = xi - 0.5;
  dN[2] = xi + 0.5;
  dN[4] = -2.0 * xi;
  dN[1] = dN[3] = dN[5] = 0.0;
}

}  // namespace

const FaceRule& face_rule(int nen)
{
  static const double g = 1.0 / std::sqrt(3.0), a = 1.0 / 6, b = 2.0 / 3;
  static const FaceRule edge{2, {{-g, 0}, {g, 0}}, {1, 1}};
  static const FaceRule tri{3, {{a, a}, {b, a}, {a, b}}, {a, a, a}};
  static const FaceRule quad{4, {{-g, -g}, {g, -g}, {g, g}, {-g, g}}, {1, 1, 1, 1}};
  static const FaceRule edge3 = edge3_rule(), tri6 = of_cell(gauss_rule_mass(SHAPE_TRI6)),
                        quad8 = of_cell(gauss_rule(SHAPE_QUAD8));
  switch (nen) {
    case 2: return edge;
    case 3: return tri;
    case 4: return quad;
    case FACE_EDGE3: return edge3;
    case 6: return tri6;
    default: return quad8;
  }
}

void face_eval(int nen, const double* xi, double* N, double* dN)
{
  switch (nen) {
    case 2: break;
    case 3: return shape_eval(SHAPE_TRI3, xi, N, dN);
    case 4: return shape_eval(SHAPE_QUAD4, xi, N, dN);
    case 6: return shape_eval(SHAPE_TRI6, xi, N, dN);
    case 8: return shape_eval(SHAPE_QUAD8, xi, N, dN);
    default: return edge3(xi[0], N, dN);
  }
  N[0] = 0.5 * (1.0 - xi[0]);
  N[1] = 0.5 * (1.0 + xi[0]);
  if (!dN) return;
  dN[0] = -0.5;
  dN[1] = dN[3] = 0.0;
  dN[2] = 0.5;
}

double face_area(int nen, const double* x, const double* xi, double* n)
{
  double N[MAX_FACE_NODES], dN[2 * MAX_FACE_NODES], t[2][3] = {{0, 0, 0}, {0, 0, 0}};
  const int nodes = nen == FACE_EDGE3 ? 3 : nen;
  face_eval(nen, xi, N, dN);
  for (int a = 0; a < nodes; ++a)
    for (int k = 0; k < 2; ++k)
      for (int i = 0; i < 3; ++i) t[k][i] += dN[2 * a + k] * x[3 * a + i];
  if (nen == 2 || nen == FACE_EDGE3) {
    t[1][2] = 1.0;               // normal to the plane: t x e3 points out of a counter-clockwise cell
  }
  n[0] = t[0][1] * t[1][2] - t[0][2] * t[1][1];
  n[1] = t[0][2] * t[1][0] - t[0][0] * t[1][2];
  n[2] = t[0][0] * t[1][1] - t[0][1] * t[1][0];
  return std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
}

double face_whole_area(int nen, const double* x)
{
  const FaceRule& rule = face_rule(nen);
  double n[3], sum = 0.0;
  for (int g = 0; g < rule.n; ++g) sum += rule.w[g] * face_area(nen, x, rule.xi[g], n);
  return sum;
}

namespace {

std::vector<FacePoint> edge_lattice(int parts)
{
  std::vector<FacePoint> out(parts + 1);
  for (int i = 0; i <= parts; ++i) {
    out[i].iw[0] = (parts - i) * parts;
    out[i].iw[1] = i * parts;
    out[i].xi[0] = 2.0 * i / parts - 1.0;
    out[i].share = i == 0 || i == parts ? 0.5 : 1.0;
  }
  return out;
}

std::vector<FacePoint> quad_lattice(int parts)
{
  std::vector<FacePoint> out;
  for (int j = 0; j <= parts; ++j)
    for (int i = 0; i <= parts; ++i) {
      const double wi = i == 0 || i == parts ? 0.5 : 1.0, wj = j == 0 || j == parts ? 0.5 : 1.0;
      FacePoint p;
      p.iw[0] = (parts - i) * (parts - j);
      p.iw[1] = i * (parts - j);
      p.iw[2] = i * j;
      p.iw[3] = (parts - i) * j;
      p.xi[0] = 2.0 * i / parts - 1.0;
      p.xi[1] = 2.0 * j / parts - 1.0;
      p.share = wi * wj;
      out.push_back(p);
    }
  return out;
}

// every small triangle contributes a third of its area to each corner: 1, 3 or 6 of them meet at a point
std::vector<FacePoint> tri_lattice(int parts)
{
  std::vector<FacePoint> out;
  for (int j = 0; j <= parts; ++j)
    for (int i = 0; i + j <= parts; ++i) {
      const int k = parts - i - j, on_edges = (i == 0) + (j == 0) + (k == 0);
      FacePoint p;
      p.iw[0] = k * parts;
      p.iw[1] = i * parts;
      p.iw[2] = j * parts;
      p.xi[0] = static_cast<double>(i) / parts;
      p.xi[1] = static_cast<double>(j) / parts;
      p.share = on_edges == 2 ? 1.0 : on_edges == 1 ? 3.0 : 6.0;
      out.push_back(p);
    }
  return out;
}

}  // namespace

std::vector<FacePoint> face_lattice(int nen, const double* x, int parts)
{
  std::vector<FacePoint> out = nen == 2   ? edge_lattice(parts)
                               : nen == 3 ? tri_lattice(parts)
                                          : quad_lattice(parts);
  double n[3], sum = 0.0;
  for (FacePoint& p : out) {
    p.share *= face_area(nen, x, p.xi, n);
    sum += p.share;
  }
  const double scale = face_whole_area(nen, x) / sum;
  for (FacePoint& p : out) p.share *= scale;
  return out;
}

namespace {

// xi = a + A eta of a piece of a triangle: upright, or inverted
void tri_piece(int parts, int i, int j, bool turned, const double* eta, double* xi)
{
  const double h = 1.0 / parts, sign = turned ? -1.0 : 1.0;
  xi[0] = h * (i + turned) + sign * h * eta[0];
  xi[1] = h * (j + turned) + sign * h * eta[1];
}

void add_sample(int nen, const double* x, const double* xi, double w, std::vector<FaceSample>& out)
{
  FaceSample s;
  double n[3];
  std::copy(xi, xi + 2, s.xi);
  face_eval(nen, xi, s.N, nullptr);
  s.area = w * face_area(nen, x, xi, n);
  out.push_back(s);
}

}  // namespace

std::vector<FaceSample> face_samples(int nen, const double* x, int parts)
{
  std::vector<FaceSample> out;
  const int corners = nen == FACE_EDGE3 ? 2 : nen == 6 ? 3 : nen == 8 ? 4 : nen;
  const FaceRule& rule = face_rule(corners);
  const double h = 1.0 / parts;
  const int rows = corners == 2 ? 1 : parts;
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < (corners == 3 ? parts - j : parts); ++i)
      for (int g = 0; g < rule.n; ++g) {
        double xi[2] = {h * (2 * i + 1 + rule.xi[g][0]) - 1.0,
                        corners == 2 ? 0.0 : h * (2 * j + 1 + rule.xi[g][1]) - 1.0};
        if (corners == 3) tri_piece(parts, i, j, false, rule.xi[g], xi);
        add_sample(nen, x, xi, rule.w[g] * (corners == 2 ? h : h * h), out);
        if (corners != 3 || i + j + 1 >= parts) continue;
        tri_piece(parts, i, j, true, rule.xi[g], xi);
        add_sample(nen, x, xi, rule.w[g] * h * h, out);
      }
  return out;
}
