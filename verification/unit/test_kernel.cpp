// Kernel, elements, CPDI2 weights: against vectors of verification/data, against differences, and against
// what must hold for any law (patch, rigid motion, symmetry). Cases A1 - A3.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>
#include <sstream>

#include "elem/elem.h"
#include "point/point.h"
#include "shape/shape.h"

namespace {

std::vector<std::vector<std::string>> read_csv(const std::string& name)
{
  std::ifstream in("verification/data/" + name);
  EXPECT_TRUE(in.good()) << "run the unit tests from the top folder: " << name;
  std::vector<std::vector<std::string>> rows;
  std::string line, word;
  while (std::getline(in, line)) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream s(line);
    rows.emplace_back();
    while (std::getline(s, word, ',')) rows.back().push_back(word);
  }
  return rows;
}

MatLaw law_of(double young, double poisson, Plane plane)
{
  Material m;
  m.young   = young;
  m.poisson = poisson;
  return mat_law(m, plane);
}

struct Sample {                // one element with random displacements
  RealVec dNdX, w, u0, u1, X;
  int nen, dim, ngp;
};

// coordinates of the nodes of the sample: distorted; middles off the middle of straight edges  [nen*dim]
RealVec sample_nodes(Shape s)
{
  static const double base[SHAPE_TRI6][24] = {
    {0, 0, 1.1, 0.1, 0.2, 0.9},
    {0, 0, 1.2, 0.1, 1.0, 1.1, -0.1, 0.8},
    {0, 0, 0, 1, 0.1, 0, 0.1, 1.1, 0, 0.2, 0.1, 0.9},
    {0, 0, 0, 1, 0.1, 0, 0.1, 1.1, 0, 0, 0, 1, 1.1, 0, 1.2, 0, 1, 1.1},
    {0, 0, 0, 1.2, 0.1, 0, 1.0, 1.1, 0.1, -0.1, 0.8, 0, 0, 0.1, 1, 1.1, 0, 1.2, 1, 1, 0.9, 0, 1.1, 1.1},
    {0, 0, 0, 1.2, 0.1, 0, 1.0, 1.1, 0.1, -0.1, 0.8, 0, 0.4, 0.5, 0.9}};
  const ShapeInfo &info = shape_info[s], &corners = shape_info[info.linear];
  const double* x       = base[info.linear];
  RealVec X(x, x + corners.nen * info.dim);
  for (int a = corners.nen; a < info.nen; ++a) {
    int end[2];
    shape_edge(s, a, end);
    for (int i = 0; i < info.dim; ++i)
      X.push_back(0.5 * (x[end[0] * info.dim + i] + x[end[1] * info.dim + i]) + 0.03 * std::sin(7.0 * a + i));
  }
  return X;
}

Sample make_sample(Shape s, unsigned seed, double amplitude)
{
  const ShapeInfo& info = shape_info[s];
  const GaussRule& rule = gauss_rule(s);
  Sample e;
  e.X   = sample_nodes(s);
  e.nen = info.nen;
  e.dim = info.dim;
  e.ngp = rule.n;
  double N[MAX_NODES], dN[3 * MAX_NODES], d[3 * MAX_NODES];
  for (int g = 0; g < rule.n; ++g) {
    shape_eval(s, rule.xi[g], N, dN);
    e.w.push_back(rule.w[g] * shape_jacobian(s, dN, e.X.data(), d));
    e.dNdX.insert(e.dNdX.end(), d, d + e.nen * e.dim);
  }
  std::mt19937 gen(seed);
  std::uniform_real_distribution<double> rnd(-amplitude, amplitude);
  for (int i = 0; i < e.nen * e.dim; ++i) {
    e.u0.push_back(rnd(gen));
    e.u1.push_back(rnd(gen));
  }
  return e;
}

// the sample as the only element of a block
ElemBlock block_of(Shape s, const Sample& e, const MatLaw& law, bool enhanced)
{
  ElemBlock b;
  b.shape = s;
  b.law   = law;
  b.dNdX  = e.dNdX;
  b.w     = e.w;
  b.elem  = {0};
  b.kind  = {0};
  b.type  = !enhanced ? ELEM_CPE4 : s == SHAPE_QUAD4 ? ELEM_CPE4I : ELEM_C3D8I;
  if (!enhanced) return b;
  b.eas.resize(eas_size(s));
  eas_setup(s, e.X.data(), e.w.data(), law, b.eas.data());
  return b;
}

RealVec force_of(Shape s, const Sample& e, const MatLaw& law, const KernelMode& mode, const RealVec& u1,
                 bool enhanced = false)
{
  RealVec re(e.nen * e.dim);
  const ElemBlock b = block_of(s, e, law, enhanced);
  EXPECT_EQ(STATUS_OK, elem_form(b)(b, 0, mode, e.u0.data(), u1.data(), re.data(), nullptr));
  return re;
}

// full tangent from the pairs a >= b
RealVec tangent_of(Shape s, const Sample& e, const MatLaw& law, const KernelMode& mode, bool enhanced = false)
{
  const ElemBlock block = block_of(s, e, law, enhanced);
  const int d = e.dim, n = e.nen * d;
  RealVec re(n), ke(pair_count(e.nen) * d * d), K(n * n);
  elem_form(block)(block, 0, mode, e.u0.data(), e.u1.data(), re.data(), ke.data());
  for (int a = 0; a < e.nen; ++a)
    for (int b = 0; b <= a; ++b)
      for (int i = 0; i < d; ++i)
        for (int j = 0; j < d; ++j) {
          const double k = ke[pair_index(a, b) * d * d + i * d + j];
          K[(a * d + i) * n + b * d + j] = k;
          K[(b * d + j) * n + a * d + i] = k;
        }
  return K;
}

double tangent_error(Shape s, const KernelMode& mode, double amplitude, bool enhanced = false)
{
  MatLaw law = law_of(1.0, 0.3, shape_info[s].dim == 3 ? PLANE_NONE : PLANE_STRAIN);
  law.beta   = 0.5;
  const Sample e   = make_sample(s, 7, amplitude);
  const RealVec K  = tangent_of(s, e, law, mode, enhanced);
  const int n      = e.nen * e.dim;
  const double h   = 1e-5;
  double worst = 0.0, size = 0.0;
  for (int j = 0; j < n; ++j) {
    RealVec up = e.u1, down = e.u1;
    up[j] += h;
    down[j] -= h;
    const RealVec fu = force_of(s, e, law, mode, up, enhanced),
                  fd = force_of(s, e, law, mode, down, enhanced);
    for (int i = 0; i < n; ++i) {
      worst = std::fmax(worst, std::fabs((fu[i] - fd[i]) / (2 * h) - K[i * n + j]));
      size  = std::fmax(size, std::fabs(K[i * n + j]));
    }
  }
  return worst / size;
}

const Shape all_shapes[] = {SHAPE_TRI3, SHAPE_QUAD4, SHAPE_TET4, SHAPE_WEDGE6, SHAPE_HEX8, SHAPE_PYR5,
                            SHAPE_TRI6, SHAPE_QUAD8, SHAPE_QUAD8R, SHAPE_TET10, SHAPE_WEDGE15, SHAPE_HEX20,
                            SHAPE_HEX20R};
const Shape linear_shapes[] = {SHAPE_TRI3, SHAPE_QUAD4, SHAPE_TET4, SHAPE_WEDGE6, SHAPE_HEX8, SHAPE_PYR5};

// all elements, with NLGEOM and without, at this rate of the viscous stress
void expect_tangents(double rate)
{
  for (bool nlgeom : {true, false}) {
    KernelMode mode;
    mode.finite = nlgeom;
    mode.rate   = rate;
    for (Shape s : all_shapes)
      EXPECT_LT(tangent_error(s, mode, shape_quadratic(s) ? 0.02 : 0.2), 1e-7) << s << nlgeom;
    for (Shape s : {SHAPE_QUAD4, SHAPE_HEX8}) EXPECT_LT(tangent_error(s, mode, 0.2, true), 1e-7) << s << nlgeom;
  }
}

}  // namespace

TEST(Cpdi, WeightsAgainstVectors)
{
  const auto rows = read_csv("cpdi2_vectors.csv");
  for (const std::string name : {"quad", "hex"}) {
    const Shape s = name == "quad" ? SHAPE_QUAD4 : SHAPE_HEX8;
    const int dim = shape_info[s].dim, nen = shape_info[s].nen;
    double X[24], w[8], G[24];
    std::vector<std::vector<double>> want;
    for (const auto& r : rows) {
      if (r[0] != name) continue;
      for (int i = 0; i < dim; ++i) X[want.size() * dim + i] = std::stod(r[2 + i]);
      want.push_back({std::stod(r[5]), std::stod(r[6]), std::stod(r[7]), std::stod(r[8]), std::stod(r[9])});
    }
    ASSERT_EQ(nen, static_cast<int>(want.size()));
    EXPECT_NEAR(want[0][0], cpdi_weights(s, X, w, G), 1e-12 * want[0][0]);
    for (int c = 0; c < nen; ++c) {
      EXPECT_NEAR(want[c][1], w[c], 1e-13);
      for (int i = 0; i < dim; ++i) EXPECT_NEAR(want[c][2 + i], G[c * dim + i], 1e-13);
    }
  }
}

TEST(Cpdi, PartitionAndLinearExactness)
{
  for (Shape s : linear_shapes) {
    const Sample e = make_sample(s, 3, 0.1);
    double X[24], w[8], G[24], sum = 0.0;
    for (int i = 0; i < e.nen * e.dim; ++i) X[i] = 0.3 * e.u0[i];
    static const double sign[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                      {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    static const int corner[SHAPE_TRI6][8] = {
        {0, 1, 3}, {0, 1, 2, 3}, {0, 1, 3, 4}, {0, 1, 3, 4, 5, 7}, {0, 1, 2, 3, 4, 5, 6, 7}, {0, 1, 2, 3, 5}};
    for (int a = 0; a < e.nen; ++a)
      for (int i = 0; i < e.dim; ++i) X[a * e.dim + i] += sign[corner[s][a]][i];
    EXPECT_GT(cpdi_weights(s, X, w, G), 0.0);
    for (int a = 0; a < e.nen; ++a) sum += w[a];
    EXPECT_NEAR(1.0, sum, 1e-14);
    for (int i = 0; i < e.dim; ++i)
      for (int j = 0; j < e.dim; ++j) {
        double I = 0.0;
        for (int a = 0; a < e.nen; ++a) I += X[a * e.dim + i] * G[a * e.dim + j];
        EXPECT_NEAR(i == j ? 1.0 : 0.0, I, 1e-13);
      }
  }
}

TEST(Kernel, StVenantKirchhoffAgainstVectors)
{
  const auto rows  = read_csv("svk_vectors.csv");
  const MatLaw law = law_of(1.0, 0.2, PLANE_NONE);
  int seen = 0;
  for (const auto& r : rows) {
    if (r[0] == "case") continue;
    auto number = [&](int k) { return std::stod(r[k]); };
    IpFields f;
    for (int k = 0; k < 9; ++k) f.F[k] = number(1 + k);
    ip_fields_from(law, 3, true, f);
    EXPECT_NEAR(number(11), f.psi, 1e-13) << r[0];
    const int order[6] = {0, 1, 2, 5, 3, 4};          // file: xx yy zz yz xz xy; here 11 22 33 12 23 31
    for (int k = 0; k < 6; ++k) EXPECT_NEAR(number(18 + order[k]), f.sig[k], 1e-13) << r[0] << " " << k;
    double H[9], E[9], Fb[9], S[9];
    for (int k = 0; k < 9; ++k) H[k] = f.F[k] - (k % 4 == 0);
    EXPECT_NEAR(number(10), ip_stress<3>(law, KernelMode(), H, H, Fb, S), 1e-13);
    ip_strain<3>(true, H, E);
    const int full[6] = {0, 4, 8, 1, 5, 6};
    for (int k = 0; k < 6; ++k) EXPECT_NEAR(number(12 + order[k]), S[full[k]], 1e-13) << r[0];
    ++seen;
  }
  EXPECT_EQ(5, seen);
}

TEST(Kernel, TangentAgainstDifferences) { expect_tangents(0.0); }

// a law with beta in motion: viscous stress of E(n+1) - E(n)
TEST(Kernel, ViscousTangentAgainstDifferences) { expect_tangents(3.0); }

// patch test of the enhanced types: a linear field gives the force of the plain element
// (2.46): the tangent of elements with enhanced strains and an initial stress, against differences; without
// displacement the force is that of the initial stress alone, as without enhanced strains
TEST(Kernel, EnhancedStrainsWithInitialStress)
{
  for (const Shape s : {SHAPE_QUAD4, SHAPE_HEX8}) {
    const int d = shape_info[s].dim, n = shape_info[s].nen * d;
    Sample e = make_sample(s, 11, 0.1);
    const ElemBlock b = block_of(s, e, law_of(1.0, 0.3, d == 3 ? PLANE_NONE : PLANE_STRAIN), true);
    RealVec S0(9 * MAX_GAUSS), re(n), back(n), rest(n, 0.0), ke(pair_count(e.nen) * d * d);
    for (int g = 0; g < e.ngp; ++g)
      for (int i = 0; i < d; ++i)
        for (int j = 0; j < d; ++j) S0[(g * d + i) * d + j] = 0.2 * std::cos(g + i * j) + 0.1 * (i + j);
    KernelMode mode;
    const auto form = [&](const RealVec& u, double* k, RealVec& out) {
      EXPECT_EQ(STATUS_OK,
                eas_form_start(s)(b, 0, mode, e.u0.data(), u.data(), S0.data(), out.data(), k));
    };
    form(e.u1, ke.data(), re);
    for (int q = 0; q < n; ++q) {
      const double h = 1e-6;
      RealVec u = e.u1;
      u[q] += h;
      form(u, nullptr, re);
      u[q] -= 2.0 * h;
      form(u, nullptr, back);
      for (int p = 0; p < n; ++p) {
        const int x = p / d >= q / d ? p : q, y = p / d >= q / d ? q : p;      // pairs a >= b
        const double k = ke[pair_index(x / d, y / d) * d * d + (x % d) * d + y % d];
        EXPECT_NEAR(k, (re[p] - back[p]) / (2.0 * h), 1e-8);
      }
    }
    form(rest, nullptr, re);
    for (int a = 0; a < e.nen; ++a)
      for (int i = 0; i < d; ++i) {
        double f = 0.0;
        for (int g = 0; g < e.ngp; ++g)
          for (int j = 0; j < d; ++j) f += e.w[g] * S0[(g * d + i) * d + j] * e.dNdX[(g * e.nen + a) * d + j];
        EXPECT_NEAR(re[a * d + i], f, 1e-14);
      }
  }
}

TEST(Kernel, EnhancedStrainsPassThePatchTest)
{
  for (Shape s : {SHAPE_QUAD4, SHAPE_HEX8}) {
    const int dim    = shape_info[s].dim;
    const MatLaw law = law_of(1.0, 0.3, dim == 3 ? PLANE_NONE : PLANE_STRAIN);
    Sample e         = make_sample(s, 1, 0.0);
    const double A[9] = {0.11, -0.07, 0.05, 0.03, 0.09, -0.04, 0.02, 0.06, -0.12};
    for (int a = 0; a < e.nen; ++a)
      for (int i = 0; i < dim; ++i)
        for (int j = 0; j < dim; ++j) e.u1[a * dim + i] += A[3 * i + j] * e.X[a * dim + j];
    const RealVec plain = force_of(s, e, law, KernelMode(), e.u1),
                  rich = force_of(s, e, law, KernelMode(), e.u1, true);
    for (size_t i = 0; i < plain.size(); ++i) EXPECT_NEAR(plain[i], rich[i], 1e-15);
  }
}

// in-plane bending of a rectangle: with nu = 0 the enhanced element has the exact stiffness, the plain one
// locks
TEST(Kernel, EnhancedStrainsBendWithoutLocking)
{
  Sample e = make_sample(SHAPE_QUAD4, 1, 0.0);
  const double L = 5.0, h = 1.0;
  e.X = {0, 0, L, 0, L, h, 0, h};
  double N[4], dN[8], d[8];
  for (int g = 0; g < 4; ++g) {
    shape_eval(SHAPE_QUAD4, gauss_rule(SHAPE_QUAD4).xi[g], N, dN);
    e.w[g] = shape_jacobian(SHAPE_QUAD4, dN, e.X.data(), d);
    for (int i = 0; i < 8; ++i) e.dNdX[8 * g + i] = d[i];
  }
  const double k = 1e-4;                             // u = k X (Y - h/2), v = -k X^2/2, linear geometry
  for (int a = 0; a < 4; ++a) {
    e.u1[2 * a]     = k * e.X[2 * a] * (e.X[2 * a + 1] - 0.5 * h);
    e.u1[2 * a + 1] = -0.5 * k * e.X[2 * a] * e.X[2 * a];
  }
  KernelMode linear;
  linear.finite = false;
  const MatLaw law = law_of(1.0, 0.0, PLANE_STRAIN);
  double plain = 0.0, rich = 0.0;
  const RealVec fp = force_of(SHAPE_QUAD4, e, law, linear, e.u1),
                fr = force_of(SHAPE_QUAD4, e, law, linear, e.u1, true);
  for (int i = 0; i < 8; ++i) {
    plain += 0.5 * fp[i] * e.u1[i];
    rich += 0.5 * fr[i] * e.u1[i];
  }
  const double exact = 0.5 * k * k * L * h * h * h / 12.0;     // E I kappa^2 L / 2
  EXPECT_NEAR(1.0, rich / exact, 1e-12);
  EXPECT_GT(plain / exact, 2.0);
}

// The tangent of the energy-momentum scheme is symmetrised: exact when u(n+1) = u(n), and off by the order of
// the step otherwise.
TEST(Kernel, EnergyMomentumTangentIsExactAtRest)
{
  KernelMode mode;
  mode.mid   = true;
  mode.s_new = 0.5;
  mode.s_old = 0.5;
  for (Shape s : all_shapes) {
    const MatLaw law = law_of(1.0, 0.3, shape_info[s].dim == 3 ? PLANE_NONE : PLANE_STRAIN);
    Sample e = make_sample(s, 5, shape_quadratic(s) ? 0.02 : 0.2);
    e.u0     = e.u1;
    const RealVec K = tangent_of(s, e, law, mode);
    const int n = e.nen * e.dim;
    const double h = 1e-5;
    for (int j = 0; j < n; ++j) {
      RealVec up = e.u1, down = e.u1;
      up[j] += h;
      down[j] -= h;
      const RealVec fu = force_of(s, e, law, mode, up), fd = force_of(s, e, law, mode, down);
      for (int i = 0; i < n; ++i) EXPECT_NEAR((fu[i] - fd[i]) / (2 * h), K[i * n + j], 1e-7) << s;
    }
  }
}

// f(n+1/2) . (u(n+1) - u(n)) is the change of the strain energy, exactly
TEST(Kernel, EnergyMomentumWorkIsEnergy)
{
  KernelMode mode;
  mode.mid   = true;
  mode.s_new = mode.s_old = 0.5;
  for (Shape s : all_shapes) {
    const int dim    = shape_info[s].dim;
    const MatLaw law = law_of(1.0, 0.3, dim == 3 ? PLANE_NONE : PLANE_STRAIN);
    const Sample e   = make_sample(s, 11, shape_quadratic(s) ? 0.03 : 0.15);
    const RealVec f  = force_of(s, e, law, mode, e.u1);
    double work = 0.0, change = 0.0;
    for (int i = 0; i < e.nen * dim; ++i) work += f[i] * (e.u1[i] - e.u0[i]);
    for (int g = 0; g < e.ngp; ++g)
      for (int k = 0; k < 2; ++k) {
        double H[9], E[9], tr = 0.0, ee = 0.0;
        const RealVec& u = k ? e.u1 : e.u0;
        if (dim == 2) {
          ip_gradient<2, 0>(&e.dNdX[g * e.nen * 2], e.nen, u.data(), H);
          ip_strain<2>(true, H, E);
        } else {
          ip_gradient<3, 0>(&e.dNdX[g * e.nen * 3], e.nen, u.data(), H);
          ip_strain<3>(true, H, E);
        }
        for (int i = 0; i < dim; ++i) tr += E[i * dim + i];
        for (int i = 0; i < dim * dim; ++i) ee += E[i] * E[i];
        change += (k ? 1.0 : -1.0) * e.w[g] * (0.5 * law.lam * tr * tr + law.mu * ee);
      }
    EXPECT_NEAR(change, work, 1e-14) << s;
  }
}

// and with viscous stress the rest of the work is beta/dt sum w dE : D : dE, enhanced strains included
TEST(Kernel, EnergyMomentumWorkOfViscousStress)
{
  KernelMode mode;
  mode.mid   = true;
  mode.s_new = mode.s_old = 0.5;
  for (bool enhanced : {false, true})
    for (Shape s : all_shapes) {
      if (enhanced && s != SHAPE_QUAD4 && s != SHAPE_HEX8) continue;
      const int dim  = shape_info[s].dim;
      MatLaw law     = law_of(1.0, 0.3, dim == 3 ? PLANE_NONE : PLANE_STRAIN);
      const Sample e = make_sample(s, 11, shape_quadratic(s) ? 0.03 : 0.15);
      mode.rate      = 0.0;
      const RealVec elastic = force_of(s, e, law, mode, e.u1, enhanced);
      law.beta  = 0.5;
      mode.rate = 3.0;
      const RealVec viscous = force_of(s, e, law, mode, e.u1, enhanced);
      const ElemBlock b = block_of(s, e, law, enhanced);
      double work = 0.0, lost = 0.0, dE[9 * MAX_GAUSS], extra[9], S[9];
      for (int i = 0; i < e.nen * dim; ++i) work += (viscous[i] - elastic[i]) * (e.u1[i] - e.u0[i]);
      for (int g = 0; g < e.ngp; ++g) {
        double H[9], E[2][9];
        for (int k = 0; k < 2; ++k) {
          const double *dN = &e.dNdX[g * e.nen * dim], *u = k ? e.u1.data() : e.u0.data();
          if (dim == 2) {
            ip_gradient<2, 0>(dN, e.nen, u, H);
            ip_strain<2>(true, H, E[k]);
          } else {
            ip_gradient<3, 0>(dN, e.nen, u, H);
            ip_strain<3>(true, H, E[k]);
          }
        }
        for (int i = 0; i < dim * dim; ++i) dE[g * dim * dim + i] = E[1][i] - E[0][i];
      }
      const RealVec plain(dE, dE + e.ngp * dim * dim);
      for (int g = 0; g < e.ngp; ++g) {
        double* at = dE + g * dim * dim;
        if (enhanced) eas_strain(s, b.eas.data(), e.w.data(), law, plain.data(), g, extra);
        for (int i = 0; i < dim * dim && enhanced; ++i) at[i] += extra[i];
        if (dim == 2) ip_law<2>(law, at, S);
        else ip_law<3>(law, at, S);
        for (int i = 0; i < dim * dim; ++i) lost += e.w[g] * law.beta * mode.rate * S[i] * at[i];
      }
      EXPECT_GT(lost, 0.0) << s;
      EXPECT_NEAR(lost, work, 1e-13) << s;
    }
}

TEST(Element, RigidMotionGivesNoForce)
{
  for (Shape s : all_shapes) {
    const int dim = shape_info[s].dim, nen = shape_info[s].nen;
    Sample e = make_sample(s, 1, 0.0);
    const double c = std::cos(1.1), n = std::sin(1.1);
    for (int a = 0; a < nen; ++a) {
      const double* x = &e.X[a * dim];
      e.u1[a * dim]     = c * x[0] - n * x[1] - x[0] + 3.0;
      e.u1[a * dim + 1] = n * x[0] + c * x[1] - x[1] - 2.0;
    }
    const MatLaw law = law_of(1.0, 0.3, dim == 3 ? PLANE_NONE : PLANE_STRAIN);
    for (double f : force_of(s, e, law, KernelMode(), e.u1)) EXPECT_NEAR(0.0, f, 1e-14) << s;
  }
}

TEST(Element, LumpedMassHasTheSumsOfTheRows)
{
  for (Shape s : linear_shapes) {
    const Sample e = make_sample(s, 1, 0.0);
    ElemBlock b    = block_of(s, e, law_of(1.0, 0.3, PLANE_NONE), false);
    b.density = 3.0, b.thickness = 0.5;
    double consistent[36], lumped[36];
    elem_mass_form(b, e.X.data(), consistent);
    b.lumped = true;
    elem_mass_form(b, e.X.data(), lumped);
    for (int a = 0; a < e.nen; ++a) {
      double row = 0.0;
      for (int c = 0; c < e.nen; ++c) {
        row += consistent[a >= c ? pair_index(a, c) : pair_index(c, a)];
        if (c < a) {
          EXPECT_EQ(0.0, lumped[pair_index(a, c)]);
        }
      }
      EXPECT_GT(row, 0.0);
      EXPECT_NEAR(row, lumped[pair_index(a, a)], 1e-15) << s;
    }
  }
}

TEST(Shape, PlaceInACellFarFromTheOrigin)
{
  for (Shape s : all_shapes) {
    const int dim = shape_info[s].dim, nen = shape_info[s].nen;
    const Sample e = make_sample(s, 1, 0.0);
    double X[3 * MAX_NODES], N[MAX_NODES], x[3] = {0, 0, 0}, xi[3];
    for (int k = 0; k < nen * dim; ++k) X[k] = 100.0 + 1e-3 * e.X[k];
    const double at[3] = {0.2, 0.3, 0.1};
    shape_eval(s, at, N, nullptr);
    for (int a = 0; a < nen; ++a)
      for (int i = 0; i < dim; ++i) x[i] += N[a] * X[a * dim + i];
    ASSERT_TRUE(shape_inverse(s, X, x, xi)) << s;
    for (int i = 0; i < dim; ++i) EXPECT_NEAR(at[i], xi[i], 1e-9) << s;
  }
}

// eight elements at once, equal ones and others: force and tangent of each alone
TEST(Element, PacksGiveTheSame)
{
  for (Shape s : all_shapes) {
    for (bool equal : {true, false}) {
      MatLaw law = law_of(1.0, 0.3, shape_info[s].dim == 3 ? PLANE_NONE : PLANE_STRAIN);
      law.beta   = 0.1;
      const double amplitude = shape_quadratic(s) ? 0.02 : 0.05;
      const Sample one = make_sample(s, 1, amplitude);
      const int n = one.nen * one.dim, pairs = pair_count(one.nen) * one.dim * one.dim;
      ElemBlock b = block_of(s, one, law, false);
      b.type = 0;
      while (elem_table[b.type].shape != s) ++b.type;
      b.kind.assign(PACK, 0);
      int slot[PACK];
      alignas(Pack) double u0[60 * PACK], u1[60 * PACK], re[60 * PACK], ke[1890 * PACK];
      std::vector<Sample> e;
      for (int l = 0; l < PACK; ++l) {
        e.push_back(make_sample(s, 10 + l, amplitude));
        slot[l] = l;
        for (int k = 0; k < n; ++k) u0[k * PACK + l] = e[l].u0[k], u1[k * PACK + l] = e[l].u1[k];
        if (equal || l == 0) continue;
        b.kind[l] = l;                               // l times as large
        for (size_t k = 0; k < one.w.size(); ++k) b.w.push_back(one.w[k] * l * l);
        for (size_t k = 0; k < one.dNdX.size(); ++k) b.dNdX.push_back(one.dNdX[k] / l);
      }
      KernelMode mode;
      mode.mid = !equal, mode.s_new = mode.mid ? 0.5 : 1.0, mode.s_old = 1.0 - mode.s_new;
      mode.rate = 3.0;
      unsigned bad = 1;
      double psi[PACK];
      EXPECT_EQ(STATUS_OK, elem_form_pack(b)(b, slot, mode, u0, u1, re, ke, bad, psi, nullptr));
      EXPECT_EQ(0u, bad);
      for (int l = 0; l < PACK; ++l) {
        RealVec re1(n), ke1(pairs);
        elem_form(b)(b, l, mode, e[l].u0.data(), e[l].u1.data(), re1.data(), ke1.data());
        for (int k = 0; k < n; ++k) EXPECT_NEAR(re1[k], re[k * PACK + l], 1e-13 * l + 1e-14) << s;
        for (int k = 0; k < pairs; ++k) EXPECT_NEAR(ke1[k], ke[k * PACK + l], 1e-13 * (1 + l)) << s;
      }
    }
  }
}

TEST(Element, InsideOutIsReported)
{
  Sample e = make_sample(SHAPE_QUAD4, 1, 0.0);
  for (int a = 0; a < 4; ++a) e.u1[2 * a] = a == 1 || a == 2 ? -2.5 : 0.0;
  RealVec re(8);
  const ElemBlock b = block_of(SHAPE_QUAD4, e, law_of(1, 0.3, PLANE_STRAIN), false);
  EXPECT_EQ(BAD_JACOBIAN, elem_form(b)(b, 0, KernelMode(), e.u0.data(), e.u1.data(), re.data(), nullptr));
}

TEST(Material, PlaneStressHasNoStressAcross)
{
  const MatLaw law = law_of(200.0, 0.3, PLANE_STRESS);
  IpFields f;
  f.F[0] = 1.01;
  ip_fields_from(law, 2, true, f);
  EXPECT_NEAR(0.0, f.sig[2], 1e-12);
  const double E11 = 0.5 * (1.01 * 1.01 - 1.0);
  EXPECT_NEAR(-0.3 / 0.7 * E11, f.E[2], 1e-14);                            // S33 = 0, E22 = 0
  EXPECT_NEAR(0.5 * 200.0 / (1 - 0.09) * E11 * E11, f.psi, 1e-12);
}
