// Energy splits: against the vectors of verification/data, against differences, and against what must hold
// for any of them (parts add up, symmetry, rotation). Cases A3 and A11.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <random>
#include <sstream>

#include "mat/split.h"

namespace {

const Split all_splits[] = {SPLIT_RCE, SPLIT_VD, SPLIT_SPECTRAL, SPLIT_PRESSURE, SPLIT_NONE};
const int voigt_i[6] = {0, 1, 2, 0, 1, 2}, voigt_j[6] = {0, 1, 2, 1, 2, 0};
const int in_file[6] = {0, 1, 2, 5, 3, 4};          // file: xx yy zz yz xz xy; here 11 22 33 12 23 31

MatLaw law_of(double young, double poisson, Plane plane)
{
  Material m;
  m.young   = young;
  m.poisson = poisson;
  return mat_law(m, plane);
}

using Row = std::map<std::string, std::string>;

std::vector<Row> read_table(const std::string& name)
{
  std::ifstream in("verification/data/" + name);
  EXPECT_TRUE(in.good()) << "run the unit tests from the top folder: " << name;
  std::vector<Row> rows;
  std::vector<std::string> head;
  std::string line, word;
  while (std::getline(in, line)) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream s(line);
    std::vector<std::string> words;
    while (std::getline(s, word, ',')) words.push_back(word);
    if (head.empty()) { head = words; continue; }
    rows.emplace_back();
    for (size_t k = 0; k < words.size(); ++k) rows.back()[head[k]] = words[k];
  }
  return rows;
}

const char* const file_word[6] = {"xx", "yy", "zz", "yz", "xz", "xy"};

void six_from(const Row& r, const std::string& prefix, double out[6])
{
  for (int m = 0; m < 6; ++m) out[m] = std::stod(r.at(prefix + file_word[in_file[m]]));
}

Split split_of(const Row& r)
{
  const std::string& word = r.at("split");
  return word == "VD" ? SPLIT_VD : word == "SPEC" ? SPLIT_SPECTRAL : SPLIT_RCE;
}

struct Random {
  std::mt19937 gen;
  explicit Random(unsigned seed) : gen(seed) {}
  double operator()(double amplitude)
  {
    return std::uniform_real_distribution<double>(-amplitude, amplitude)(gen);
  }
  void unit(double N[3], int dim)
  {
    double sum = 0.0;
    N[2] = 0.0;
    for (int i = 0; i < dim; ++i) sum += (N[i] = (*this)(1.0), N[i] * N[i]);
    for (int i = 0; i < 3; ++i) N[i] /= std::sqrt(sum);
  }
  void strain(double amplitude, int dim, double* E)     // [dim*dim], symmetric
  {
    for (int i = 0; i < dim; ++i)
      for (int j = 0; j <= i; ++j) E[dim * i + j] = E[dim * j + i] = (*this)(amplitude);
  }
};

double largest(const double* a, int n)
{
  double x = 0.0;
  for (int k = 0; k < n; ++k) x = std::max(x, std::fabs(a[k]));
  return x;
}

// Voigt column m of a strain grows by h: engineering shear, so half of h in each of the two tensor components
void shift(int dim, int i, int j, double h, double* E)
{
  if (i == j) { E[dim * i + i] += h; return; }
  E[dim * i + j] += 0.5 * h;
  E[dim * j + i] += 0.5 * h;
}

}  // namespace

TEST(Split, Vectors)
{
  const MatLaw law = law_of(1.0, 0.2, PLANE_NONE);
  int seen = 0;
  for (const Row& r : read_table("split_vectors.csv")) {
    const std::string where = r.at("case") + " " + r.at("split");
    const Split split = split_of(r);
    double E[6], N[3] = {0, 0, 0}, s[6], sp[6], sm[6];
    six_from(r, "e_", E);
    six_from(r, "s_", s);
    six_from(r, "sp_", sp);
    six_from(r, "sm_", sm);
    if (split == SPLIT_RCE)
      for (int i = 0; i < 3; ++i) N[i] = std::stod(r.at(std::string("n_") + "xyz"[i]));
    SplitOut o;
    split_full(law, split, false, E, N, o);
    // each group relative to its own largest value
    const double psi = std::stod(r.at("psi")), big = largest(s, 6);
    EXPECT_NEAR(std::stod(r.at("psi_plus")), o.psi_plus, 1e-12 * psi) << where;
    EXPECT_NEAR(std::stod(r.at("psi_minus")), o.psi_minus, 1e-12 * psi) << where;
    for (int m = 0; m < 6; ++m) {
      EXPECT_NEAR(s[m], o.Sp[m] + o.Sm[m], 1e-12 * big) << where << " " << m;
      EXPECT_NEAR(sp[m], o.Sp[m], 1e-12 * big) << where << " " << m;
      EXPECT_NEAR(sm[m], o.Sm[m], 1e-12 * big) << where << " " << m;
      for (int n = 0; n < 6; ++n) {
        const int a = std::min(in_file[m], in_file[n]), b = std::max(in_file[m], in_file[n]);
        const double Cp = std::stod(r.at(std::string("Cp_") + file_word[a] + "_" + file_word[b]));
        // the largest entry is about E = 1
        EXPECT_NEAR(Cp, o.Cp[6 * m + n], 1e-12) << where << " " << m << " " << n;
      }
    }
    ++seen;
  }
  EXPECT_EQ(24, seen);
}

// the driving energy, and the normal, from the components that the kernel sees
TEST(Split, DriveAgainstVectors)
{
  int seen = 0;
  for (const Row& r : read_table("split_vectors.csv")) {
    if (r.at("split") == "RCE_nfix") continue;
    const std::string where = r.at("case") + " " + r.at("split");
    const int dim    = std::stoi(r.at("dim"));
    const MatLaw law = law_of(1.0, 0.2, dim == 3 ? PLANE_NONE : PLANE_STRAIN);
    double e[6], E[9], N[3];
    six_from(r, "e_", e);
    for (int m = 0; m < 6; ++m)
      if (voigt_i[m] < dim && voigt_j[m] < dim)
        E[dim * voigt_i[m] + voigt_j[m]] = E[dim * voigt_j[m] + voigt_i[m]] = e[m];
    EXPECT_NEAR(std::stod(r.at("psi_plus")), split_drive(law, dim, split_of(r), false, E),
                1e-12 * std::stod(r.at("psi")))
        << where;
    if (split_of(r) == SPLIT_RCE && r.at("case")[0] != 'E') {     // E has two equal principal stresses
      split_normal(law, dim, E, N);
      double cosine = 0.0;
      for (int i = 0; i < 3; ++i) cosine += N[i] * std::stod(r.at(std::string("n_") + "xyz"[i]));
      EXPECT_NEAR(1.0, std::fabs(cosine), 1e-12) << where;
    }
    ++seen;
  }
  EXPECT_EQ(18, seen);
}

TEST(Split, StressAndTangentAgainstDifferences)
{
  const MatLaw law = law_of(1.0, 0.2, PLANE_NONE);
  const double h   = 1e-5;
  Random rnd(3);
  int closed = 0;                                    // samples on the closed side
  for (Split split : all_splits)
    for (bool finite : {false, true})
      for (int sample = 0; sample < 40; ++sample) {
        double E9[9], E[6], N[3];
        do rnd.strain(0.15, 3, E9);
        // tangents jump at tr E = 0; no sample is at another kink
        while (std::fabs(E9[0] + E9[4] + E9[8]) < 1e-3);
        rnd.unit(N, 3);
        auto full = [&](const double* strain, SplitOut& o) {
          for (int m = 0; m < 6; ++m) E[m] = strain[3 * voigt_i[m] + voigt_j[m]];
          split_full(law, split, finite, E, N, o);
        };
        SplitOut o, up, down;
        full(E9, o);
        closed += o.psi_minus > 0.0;
        for (int n = 0; n < 6; ++n) {
          double Eu[9], Ed[9];
          std::copy(E9, E9 + 9, Eu);
          std::copy(E9, E9 + 9, Ed);
          shift(3, voigt_i[n], voigt_j[n], h, Eu);
          shift(3, voigt_i[n], voigt_j[n], -h, Ed);
          full(Eu, up);
          full(Ed, down);
          EXPECT_NEAR((up.psi_plus - down.psi_plus) / (2 * h), o.Sp[n], 1e-7) << split << finite << sample;
          EXPECT_NEAR((up.psi_minus - down.psi_minus) / (2 * h), o.Sm[n], 1e-7) << split << finite << sample;
          for (int m = 0; m < 6; ++m) {
            EXPECT_NEAR((up.Sp[m] - down.Sp[m]) / (2 * h), o.Cp[6 * m + n], 1e-7)
                << split << finite << sample;
            EXPECT_NEAR((up.Sm[m] - down.Sm[m]) / (2 * h), o.Cm[6 * m + n], 1e-7)
                << split << finite << sample;
          }
        }
      }
  EXPECT_GT(closed, 150);
}

// the parts add up to the intact law, also at kinks; tangents are symmetric
TEST(Split, PartsAddUp)
{
  const MatLaw law = law_of(1.0, 0.3, PLANE_NONE);
  Random rnd(5);
  const double special[5][6] = {{0, 0, 0, 0, 0, 0},                  // zero strain
                                {0.1, 0.1, 0.1, 0, 0, 0},            // three equal
                                {0.1, 0.1, -0.2, 0, 0, 0},           // two equal, tr = 0
                                {-0.1, -0.1, -0.1, 0, 0, 0},
                                {0.1, -0.1, 0, 0, 0, 0}};
  for (Split split : all_splits)
    for (bool finite : {false, true})
      for (int sample = 0; sample < 45; ++sample) {
        double E[6], N[3];
        for (int m = 0; m < 6; ++m) E[m] = sample < 5 ? special[sample][m] : rnd(0.15);
        rnd.unit(N, 3);
        SplitOut o, whole;
        split_full(law, split, finite, E, N, o);
        split_full(law, SPLIT_NONE, finite, E, N, whole);
        EXPECT_NEAR(whole.psi_plus, o.psi_plus + o.psi_minus, 1e-15) << split << finite << sample;
        for (int m = 0; m < 6; ++m) {
          EXPECT_NEAR(whole.Sp[m], o.Sp[m] + o.Sm[m], 1e-15) << split << finite << sample;
          for (int n = 0; n < 6; ++n) {
            // SPECTRAL: four eigenvectors in a product, each orthonormal to 2e-15
            EXPECT_NEAR(whole.Cp[6 * m + n], o.Cp[6 * m + n] + o.Cm[6 * m + n], 1e-14)
                << split << finite << sample;
            EXPECT_NEAR(o.Cp[6 * n + m], o.Cp[6 * m + n], 1e-15) << split << finite << sample;
            EXPECT_NEAR(o.Cm[6 * n + m], o.Cm[6 * m + n], 1e-15) << split << finite << sample;
          }
        }
      }
}

// psi, S and C do not depend on the axes: E and N turned by Q give Q S Q^T. Covers finite PRESSURE under J <
// 1, and equal principal strains, where any pair of directions must give the same.
TEST(Split, TurnsWithTheAxes)
{
  const MatLaw law = law_of(1.0, 0.2, PLANE_NONE);
  Random rnd(7);
  for (int sample = 0; sample < 60; ++sample) {
    double e[3] = {rnd(0.3), rnd(0.3), rnd(0.3)}, N0[3], q[4], Q[3][3], norm = 0.0;
    if (sample % 3 == 0) e[1] = e[0];                          // two equal
    if (sample % 3 == 1) e[1] = e[0] * (1.0 + 1e-9);           // nearly
    rnd.unit(N0, 3);
    for (double& x : q) norm += (x = rnd(1.0), x * x);
    for (double& x : q) x /= std::sqrt(norm);                  // quaternion
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      Q[i][i] = q[0] * q[0] + q[1 + i] * q[1 + i] - q[1 + j] * q[1 + j] - q[1 + k] * q[1 + k];
      Q[i][j] = 2.0 * (q[1 + i] * q[1 + j] - q[0] * q[1 + k]);
      Q[j][i] = 2.0 * (q[1 + i] * q[1 + j] + q[0] * q[1 + k]);
    }
    double E0[6] = {e[0], e[1], e[2], 0, 0, 0}, E[6], N[3] = {0, 0, 0};
    for (int m = 0; m < 6; ++m) {
      E[m] = 0.0;
      for (int a = 0; a < 3; ++a) E[m] += Q[voigt_i[m]][a] * Q[voigt_j[m]][a] * e[a];
    }
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) N[i] += Q[i][j] * N0[j];
    for (Split split : all_splits) {
      SplitOut a, b;
      split_full(law, split, true, E0, N0, a);
      split_full(law, split, true, E, N, b);
      EXPECT_NEAR(a.psi_minus, b.psi_minus, 1e-14) << split << " " << sample;
      // share of component m in component c after turning
      auto turn = [&Q](int c, int m) {
        const int i = voigt_i[c], j = voigt_j[c], k = voigt_i[m], l = voigt_j[m];
        return Q[i][k] * Q[j][l] + (m < 3 ? 0.0 : Q[i][l] * Q[j][k]);
      };
      double scale = 1.0;
      for (int m = 0; m < 36; ++m) scale = std::max(scale, std::fabs(a.Cm[m]));
      for (int c = 0; c < 6; ++c) {
        double S = 0.0;
        for (int m = 0; m < 6; ++m) S += turn(c, m) * a.Sm[m];
        EXPECT_NEAR(S, b.Sm[c], 1e-14 * scale) << split << " " << sample;
        for (int d = 0; d < 6; ++d) {
          double C = 0.0;
          for (int m = 0; m < 6; ++m)
            for (int n = 0; n < 6; ++n) C += turn(c, m) * turn(d, n) * a.Cm[6 * m + n];
          EXPECT_NEAR(C, b.Cm[6 * c + d], 1e-13 * scale) << split << " " << sample;
        }
      }
    }
  }
}

TEST(Split, CrackOpenAndClosed)
{
  const MatLaw law = law_of(1.0, 0.2, PLANE_NONE);
  Random rnd(11);
  int open = 0;
  for (int sample = 0; sample < 100; ++sample) {
    double E[6], N[3];
    for (int m = 0; m < 6; ++m) E[m] = rnd(1e-3);
    rnd.unit(N, 3);
    SplitOut o;
    split_full(law, SPLIT_RCE, false, E, N, o);
    double S0[3][3], Sm[3][3], t0[3] = {0, 0, 0}, t[3] = {0, 0, 0}, sn = 0.0;
    for (int m = 0; m < 6; ++m) {
      S0[voigt_i[m]][voigt_j[m]] = S0[voigt_j[m]][voigt_i[m]] = o.Sp[m] + o.Sm[m];
      Sm[voigt_i[m]][voigt_j[m]] = Sm[voigt_j[m]][voigt_i[m]] = o.Sm[m];
    }
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        t0[i] += S0[i][j] * N[j];
        t[i] += Sm[i][j] * N[j];
      }
    for (int i = 0; i < 3; ++i) sn += t0[i] * N[i];
    open += sn > 0.0;
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(sn > 0.0 ? 0.0 : sn * N[i], t[i], 1e-17) << sample;
    EXPECT_GE(o.psi_minus, 0.0);
  }
  EXPECT_GT(open, 30);
  EXPECT_LT(open, 70);
}

// A11: crack normal 2, compression across it and shear along it. RCE keeps the compression in full and loses
// the shear; pulled, it carries nothing. VD and SPECTRAL keep part of the shear or lose part of the
// compression.
TEST(Split, ClosedCrackUnderCompressionAndShear)
{
  const MatLaw law  = law_of(1.0, 0.2, PLANE_STRAIN);
  const double N[3] = {0, 1, 0}, c = 1e-9;
  const double press[4] = {0, 2e-3, 2e-3, -1e-3}, pull[4] = {0, 2e-3, 2e-3, 1e-3};
  const double M = law.lam + 2.0 * law.mu, K = law.lam + 2.0 / 3.0 * law.mu;
  double psi, S[4], C[9];
  split_eroded(law, 2, SPLIT_RCE, false, c, press, N, &psi, S, C);
  EXPECT_NEAR(-1e-3 * M, S[3], 1e-15);                              // 22 in full
  EXPECT_NEAR(-1e-3 * law.lam, S[0], 1e-15);                        // along the crack as intact
  EXPECT_NEAR(c * 2.0 * law.mu * 2e-3, S[1], 1e-15);                // no shear
  split_eroded(law, 2, SPLIT_RCE, false, c, pull, N, &psi, S, C);
  EXPECT_NEAR(c * M * 1e-3, S[3], 1e-15);                           // no tension
  EXPECT_NEAR(c * 2.0 * law.mu * 2e-3, S[1], 1e-15);
  EXPECT_NEAR(c * 1e-3 * law.lam, S[0], 1e-15);
  split_eroded(law, 2, SPLIT_VD, false, c, press, N, &psi, S, C);
  // half of M at nu = 0.2: compression is lost
  EXPECT_NEAR(-1e-3 * K, S[3], 1e-11);
  EXPECT_NEAR(0.0, S[1], 1e-11);
  split_eroded(law, 2, SPLIT_SPECTRAL, false, c, press, N, &psi, S, C);
  EXPECT_GT(S[1], 0.3 * 2.0 * law.mu * 2e-3);                       // keeps shear of a closed crack
  EXPECT_LT(S[3], -1e-3 * M);                                       // and presses more than the intact law
}

TEST(Split, PressureAloneWhenVolumeShrinks)
{
  const MatLaw law = law_of(1.0, 0.2, PLANE_NONE);
  const double N[3] = {0, 0, 0}, K = law.lam3 + 2.0 / 3.0 * law.mu;
  Random rnd(13);
  for (int sample = 0; sample < 40; ++sample) {
    double F[9], E[9], sig[9], S[9], C[36], psi;
    for (int k = 0; k < 9; ++k) F[k] = rnd(0.2) + (k % 4 == 0 ? (sample % 2 ? 0.9 : 1.1) : 0.0);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        double c = 0.0;
        for (int k = 0; k < 3; ++k) c += F[3 * k + i] * F[3 * k + j];
        E[3 * i + j] = 0.5 * (c - (i == j));
      }
    const double J = F[0] * (F[4] * F[8] - F[5] * F[7]) - F[1] * (F[3] * F[8] - F[5] * F[6]) +
                     F[2] * (F[3] * F[7] - F[4] * F[6]);
    split_eroded(law, 3, SPLIT_PRESSURE, true, 0.0, E, N, &psi, S, C);
    // Cauchy stress F S F^T / J is K (J - 1) I, or nothing
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        sig[3 * i + j] = 0.0;
        for (int k = 0; k < 3; ++k)
          for (int l = 0; l < 3; ++l) sig[3 * i + j] += F[3 * i + k] * S[3 * k + l] * F[3 * j + l] / J;
        EXPECT_NEAR(i == j && J < 1.0 ? K * (J - 1.0) : 0.0, sig[3 * i + j], 2e-15) << sample;
      }
    EXPECT_NEAR(J < 1.0 ? 0.5 * K * (J - 1.0) * (J - 1.0) : 0.0, psi, 1e-15) << sample;
  }
  // small strains lose no digits: J - 1 = (1 + 2e)^(3/2) - 1 = 3e + 1.5 e^2 - 0.5 e^3
  const double e = -1e-7, small[6] = {e, e, e, 0, 0, 0}, J1 = 3.0 * e + 1.5 * e * e - 0.5 * e * e * e;
  SplitOut o;
  split_full(law, SPLIT_PRESSURE, true, small, N, o);
  EXPECT_NEAR(1.0, o.psi_minus / (0.5 * K * J1 * J1), 1e-14);
}

// 2E + I not positive definite: psi NaN, the rest zero, in every routine that can meet it
TEST(Split, PressureOutsideItsDomain)
{
  const double bad[3][9] = {{-0.6, 0, 0, 0, 0.1, 0, 0, 0, 0.1},
                            {-0.6, 0, 0, 0, -0.6, 0, 0, 0, 0.1},       // determinant positive
                            {0.1, 0.9, 0, 0.9, 0.1, 0, 0, 0, 0.1}};
  const double N[3] = {0, 0, 0};
  for (const auto& E : bad)
    for (Plane plane : {PLANE_NONE, PLANE_STRAIN, PLANE_STRESS}) {
      const MatLaw law = law_of(1.0, 0.2, plane);
      const int dim = plane == PLANE_NONE ? 3 : 2, nv = dim == 3 ? 6 : 3;
      const double flat[4] = {E[0], E[1], E[3], E[4]};
      double psi, S[9], C[36];
      split_eroded(law, dim, SPLIT_PRESSURE, true, 1e-6, dim == 3 ? E : flat, N, &psi, S, C);
      EXPECT_TRUE(std::isnan(psi));
      EXPECT_TRUE(std::isnan(split_drive(law, dim, SPLIT_PRESSURE, true, dim == 3 ? E : flat)));
      EXPECT_EQ(0.0, largest(S, dim * dim));
      EXPECT_EQ(0.0, largest(C, nv * nv));
      split_eroded(law, dim, SPLIT_PRESSURE, false, 1e-6, dim == 3 ? E : flat, N, &psi, S, C);
      EXPECT_FALSE(std::isnan(psi));                                  // linear: no such limit
    }
}

TEST(Split, IntactIsTheLaw)      // c = 1, any split: (2.1) in the components of the kernel
{
  Random rnd(17);
  for (Plane plane : {PLANE_NONE, PLANE_STRAIN, PLANE_STRESS}) {
    const MatLaw law = law_of(1.0, 0.3, plane);
    const int dim = plane == PLANE_NONE ? 3 : 2;
    for (Split split : all_splits)
      for (int sample = 0; sample < 20; ++sample) {
        double E[9], N[3], S[9], C[36], psi, tr = 0.0, ee = 0.0;
        rnd.strain(0.15, dim, E);
        rnd.unit(N, dim);
        split_eroded(law, dim, split, true, 1.0, E, N, &psi, S, C);
        for (int i = 0; i < dim; ++i) tr += E[dim * i + i];
        for (int k = 0; k < dim * dim; ++k) ee += E[k] * E[k];
        EXPECT_NEAR(0.5 * law.lam * tr * tr + law.mu * ee, psi, 1e-14) << split;
        for (int k = 0; k < dim * dim; ++k)
          EXPECT_NEAR((k % (dim + 1) == 0 ? law.lam * tr : 0.0) + 2.0 * law.mu * E[k], S[k], 1e-14) << split;
        EXPECT_NEAR(law.lam + 2.0 * law.mu, C[0], 1e-13);
        EXPECT_NEAR(law.lam, C[1], 1e-13);
        EXPECT_NEAR(law.mu, C[dim == 2 ? 8 : 21], 1e-13);
      }
  }
}

// The law of eroded material in the components of the kernel: S = dpsi/dE, C = dS/dE, C symmetric. In plane
// stress psi is the least over E33, found here by bisection of S33 of split_full.
TEST(Split, ErodedAgainstDifferences)
{
  Random rnd(19);
  for (Plane plane : {PLANE_STRESS, PLANE_STRAIN, PLANE_NONE}) {
    const MatLaw law = law_of(1.0, 0.2, plane);
    const int dim = plane == PLANE_NONE ? 3 : 2, nv = dim == 3 ? 6 : 3;
    const int seen[6] = {0, 1, dim == 2 ? 3 : 2, 3, 4, 5};
    for (Split split : all_splits)
      for (bool finite : {false, true})
        for (double c : {1.0, 0.3, 1e-2, 1e-6})
          for (int sample = 0; sample < 15; ++sample) {
            double E[9], N[3], S[9], C[36], psi;
            rnd.strain(0.1, dim, E);
            rnd.unit(N, dim);
            split_eroded(law, dim, split, finite, c, E, N, &psi, S, C);
            const double h = 1e-6;
            for (int n = 0; n < nv; ++n) {
              double Eu[9], Ed[9], Su[9], Sd[9], skip[36], pu, pd;
              std::copy(E, E + 9, Eu);
              std::copy(E, E + 9, Ed);
              shift(dim, voigt_i[seen[n]], voigt_j[seen[n]], h, Eu);
              shift(dim, voigt_i[seen[n]], voigt_j[seen[n]], -h, Ed);
              split_eroded(law, dim, split, finite, c, Eu, N, &pu, Su, skip);
              split_eroded(law, dim, split, finite, c, Ed, N, &pd, Sd, skip);
              EXPECT_NEAR((pu - pd) / (2 * h), S[dim * voigt_i[seen[n]] + voigt_j[seen[n]]], 1e-7)
                << plane << split << finite << " " << c << " " << sample;
              for (int m = 0; m < nv; ++m) {
                const int k = dim * voigt_i[seen[m]] + voigt_j[seen[m]];
                EXPECT_NEAR((Su[k] - Sd[k]) / (2 * h), C[nv * m + n], 1e-7)
                  << plane << split << finite << " " << c << " " << sample;
                EXPECT_NEAR(C[nv * n + m], C[nv * m + n], 1e-15);
              }
            }
          }
  }
}

// S33 = 0: energy and stress are those at the E33 that bisection of split_full finds. PRESSURE measured
// 5.2e-15: with E33 up to 9 the terms of det(2E + I) are 20 times the result, so J has lost that factor, the
// others 2e-16 times a few.
TEST(Split, PlaneStressHasNoStressAcross)
{
  const MatLaw law = law_of(1.0, 0.2, PLANE_STRESS);
  Random rnd(23);
  for (Split split : all_splits)
    for (bool finite : {false, true})
      for (double c : {1.0, 0.3, 1e-3, 1e-6, 1e-9})
        for (int sample = 0; sample < 80; ++sample) {
          const bool floor = finite && split == SPLIT_PRESSURE;
          double E[4], N[3], S[4], C[9], psi;
          do rnd.strain(sample % 2 ? 0.45 : 0.1, 2, E);
          while (floor && (1.0 + 2.0 * E[0]) * (1.0 + 2.0 * E[3]) - 4.0 * E[1] * E[1] < 0.05);
          rnd.unit(N, 2);
          split_eroded(law, 2, split, finite, c, E, N, &psi, S, C);
          double lo = floor ? -0.5 : -2.0, hi = floor ? 20.0 : 2.0, E6[6] = {E[0], E[3], 0, E[1], 0, 0};
          SplitOut o;
          auto across = [&](double e33) {
            E6[2] = e33;
            split_full(law, split, finite, E6, N, o);
            return c * o.Sp[2] + o.Sm[2];
          };
          for (int it = 0; it < 80; ++it) {
            const double mid = 0.5 * (lo + hi);
            (across(mid) > 0.0 ? hi : lo) = mid;
          }
          EXPECT_NEAR(0.0, across(0.5 * (lo + hi)), 1e-15);
          EXPECT_NEAR(c * o.psi_plus + o.psi_minus, psi, 1e-15)
              << split << finite << " " << c << " " << sample;
          const int seen[3] = {0, 1, 3}, at[3] = {0, 3, 1};
          for (int m = 0; m < 3; ++m)
            EXPECT_NEAR(c * o.Sp[seen[m]] + o.Sm[seen[m]], S[at[m]], floor ? 2e-14 : 2e-15)
                << split << finite << " " << c << " " << sample;
        }
}

// stretched so far that the intact E33 is below -1/2, where no body has a thickness
TEST(Split, PlaneStressKeepsAThickness)
{
  const MatLaw law = law_of(1.0, 0.45, PLANE_STRESS);
  const double E[4] = {1.5, 0.2, 0.2, 1.2}, N[3] = {1, 0, 0}, K = law.lam3 + 2.0 / 3.0 * law.mu;
  // of the plane part
  const double det2 = 4.0 * 3.4 - 0.16, tr2 = 2.7, ee2 = 1.5 * 1.5 + 1.2 * 1.2 + 2.0 * 0.04;
  double psi, S[4], C[9];
  for (double c : {0.3, 1e-3, 1e-6, 1e-9}) {
    double lo = -0.5, hi = 1.0;
    auto J = [&](double e33) { return std::min(1.0, std::sqrt(det2 * (1.0 + 2.0 * e33))); };
    for (int it = 0; it < 80; ++it) {
      const double x = 0.5 * (lo + hi);
      const double S33 = c * (law.lam3 * (tr2 + x) + 2.0 * law.mu * x) +
                         (1.0 - c) * K * (J(x) - 1.0) * det2 / J(x);
      (S33 > 0.0 ? hi : lo) = x;
    }
    const double tr = tr2 + lo, psi0 = 0.5 * law.lam3 * tr * tr + law.mu * (ee2 + lo * lo);
    split_eroded(law, 2, SPLIT_PRESSURE, true, c, E, N, &psi, S, C);
    EXPECT_NEAR(1.0, (c * psi0 + (1.0 - c) * 0.5 * K * std::pow(J(lo) - 1.0, 2)) / psi, 1e-12) << c;
  }
  split_eroded(law, 2, SPLIT_PRESSURE, true, 1.0, E, N, &psi, S, C);
  EXPECT_TRUE(std::isnan(psi));
  EXPECT_EQ(0.0, largest(S, 4));
}

// RCE in plane stress: what a crack releases is (2.6) with the moduli of plane stress, so psi(c = 1) - psi(c
// = 0) with the normal of split_normal is split_drive
TEST(Split, DriveInPlaneStress)
{
  const MatLaw law = law_of(1.0, 0.2, PLANE_STRESS);
  Random rnd(29);
  for (int sample = 0; sample < 100; ++sample) {
    double E[4], N[3], S[4], C[9], whole, rest;
    rnd.strain(0.1, 2, E);
    const double s1 = split_normal(law, 2, E, N);
    split_eroded(law, 2, SPLIT_RCE, true, 1.0, E, N, &whole, S, C);
    const double s_NN = N[0] * N[0] * S[0] + 2.0 * N[0] * N[1] * S[1] + N[1] * N[1] * S[3];
    const double s_NT = (S[3] - S[0]) * N[0] * N[1] + S[1] * (N[0] * N[0] - N[1] * N[1]);
    EXPECT_NEAR(s_NN, s1, 1e-15);
    EXPECT_NEAR(0.0, s_NT, 1e-15);
    EXPECT_GE(s1, 0.5 * (S[0] + S[3]));
    split_eroded(law, 2, SPLIT_RCE, true, 0.0, E, N, &rest, S, C);
    EXPECT_NEAR(whole - rest, split_drive(law, 2, SPLIT_RCE, true, E), 1e-15) << sample;
  }
  // uniaxial tension: (1 - nu^2) of the energy, the crack keeps the strain along it
  const double e = 1e-3, pull[4] = {e, 0, 0, -0.2 * e};
  EXPECT_NEAR(0.5 * e * e * (1.0 - 0.04), split_drive(law, 2, SPLIT_RCE, false, pull), 1e-18);
  EXPECT_NEAR(0.5 * e * e, split_drive(law, 2, SPLIT_NONE, false, pull), 1e-18);
}

// the largest principal stress in space, without its direction: that of the strains that it was made of, also
// where two of them are nearly the same
TEST(Split, LargestPrincipal)
{
  const MatLaw law = law_of(1.0, 0.2, PLANE_NONE);
  std::mt19937 engine(31);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  for (int sample = 0; sample < 4000; ++sample) {
    const double size = std::pow(10.0, 6.0 * any(engine) - 6.0), gap = std::pow(10.0, 8.0 * any(engine) - 8.0);
    double e[3] = {size * any(engine), size * any(engine), size * any(engine)};
    if (sample % 4 == 1) e[1] = e[0] + size * gap;
    if (sample % 4 == 2) e[2] = e[1] = e[0];
    if (sample % 4 == 3) e[1] = e[0];
    double q[3][3] = {{any(engine), any(engine), any(engine)}, {any(engine), any(engine), any(engine)}};
    const auto normalize = [](double* x) {
      const double length = std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
      for (int i = 0; i < 3; ++i) x[i] /= length;
    };
    normalize(q[0]);
    const double along = q[0][0] * q[1][0] + q[0][1] * q[1][1] + q[0][2] * q[1][2];
    for (int i = 0; i < 3; ++i) q[1][i] -= along * q[0][i];
    normalize(q[1]);
    for (int i = 0; i < 3; ++i) q[2][i] = q[0][(i + 1) % 3] * q[1][(i + 2) % 3] - q[0][(i + 2) % 3] * q[1][(i + 1) % 3];
    double E[9] = {0};
    for (int a = 0; a < 3; ++a)
      for (int i = 0; i < 9; ++i) E[i] += e[a] * q[a][i / 3] * q[a][i % 3];
    const double stress = law.lam * (e[0] + e[1] + e[2]) + 2.0 * law.mu * std::max({e[0], e[1], e[2]});
    EXPECT_NEAR(stress, split_normal(law, 3, E, nullptr), 1e-14 * size) << sample;
  }
}

TEST(Split, ZeroStrain)
{
  for (Plane plane : {PLANE_NONE, PLANE_STRAIN, PLANE_STRESS}) {
    const MatLaw law = law_of(1.0, 0.2, plane);
    const int dim = plane == PLANE_NONE ? 3 : 2, nv = dim == 3 ? 6 : 3;
    const double zero[9] = {0};
    for (Split split : all_splits)
      for (bool finite : {false, true}) {
        double N[3], S[9], C[36], psi;
        EXPECT_EQ(0.0, split_normal(law, dim, zero, N));
        EXPECT_NEAR(1.0, N[0] * N[0] + N[1] * N[1] + N[2] * N[2], 1e-15);
        EXPECT_EQ(0.0, split_drive(law, dim, split, finite, zero));
        split_eroded(law, dim, split, finite, 1e-6, zero, N, &psi, S, C);
        EXPECT_EQ(0.0, psi);
        EXPECT_EQ(0.0, largest(S, dim * dim));
        for (int m = 0; m < nv * nv; ++m) EXPECT_TRUE(std::isfinite(C[m]));
      }
  }
}

// compressed or unstrained in every direction: nothing of the spectral law belongs to +
TEST(Split, SpectralClosed)
{
  const MatLaw law = law_of(1.0, 0.2, PLANE_NONE);
  const double N[3] = {0, 0, 0},
               closed[3][6] = {{0, 0, 0, 0, 0, 0}, {0, 0, -0.1, 0, 0, 0}, {-0.1, -0.1, -0.1, 0, 0, 0}};
  for (const auto& E : closed) {
    SplitOut o;
    split_full(law, SPLIT_SPECTRAL, true, E, N, o);
    EXPECT_EQ(0.0, o.psi_plus);
    EXPECT_EQ(0.0, largest(o.Sp, 6));
    EXPECT_EQ(0.0, largest(o.Cp, 36));
  }
}

// pressure alone bears no shear: the constants 1 1 1 0 0 0 of a gradient must not be copied as 1 1 1 1 0 0
// (GCC 12.2, AVX-512, -O1)
TEST(Split, PressureBearsNoShear)
{
  const double N[3] = {1, 0, 0}, plane[4] = {-0.01, 0.003, 0.003, -0.01};
  const double space[9] = {-0.01, 0.003, 0.004, 0.003, -0.01, 0.002, 0.004, 0.002, -0.01};
  for (int dim : {2, 3}) {
    const MatLaw law = law_of(1.0, 0.2, dim == 3 ? PLANE_NONE : PLANE_STRAIN);
    const int nv = dim == 3 ? 6 : 3, first = dim == 3 ? 3 : 2;
    double psi, S[9], C[36];
    split_eroded(law, dim, SPLIT_PRESSURE, false, 0.0, dim == 3 ? space : plane, N, &psi, S, C);
    EXPECT_LT(S[0], 0.0);
    EXPECT_EQ(0.0, S[1]) << dim;
    for (int m = first; m < nv; ++m) EXPECT_EQ(0.0, C[nv * m + m]) << dim;
  }
}
