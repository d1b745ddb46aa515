// developer.md, "How to add a material", followed: a law with one number of history, scalar damage
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "deck/deck.h"
#include "mat/law.h"
#include "mat/voigt.h"
#include "step/step.h"

namespace {

const double FROM = 2e-3, SCALE = 2e-2;        // strains where damage begins, and over which it grows by 1/e

// energy / volume that damage up to the strain k has dissipated: int k^2/2 exp(-(k - k0)/kc)/kc dk
double dissipated(double k)
{
  const auto rest = [](double q) {
    return std::exp(-(q - FROM) / SCALE) * (0.5 * q * q + q * SCALE + SCALE * SCALE);
  };
  return rest(FROM) - rest(std::max(k, FROM));
}

// psi = g psi0 of St.Venant-Kirchhoff, g = exp(-(k - k0)/kc), k the largest sqrt(2 psi0 / E) so far, E = 1
bool damage(const MatLaw& law, bool finite, const double* E, const double* h_n, double* h_np1, bool tangent,
            LawOutput& out)
{
  if (!law_svk(law, finite, E, nullptr, nullptr, tangent, out)) return false;
  const double k = std::sqrt(2.0 * out.psi), largest = std::max(h_n[0], k);
  const double g = std::exp(-std::max(0.0, largest - FROM) / SCALE);
  h_np1[0]       = largest;
  out.dissipated = dissipated(largest) - dissipated(h_n[0]);
  if (tangent) {
    for (double& d : out.D) d *= g;
    for (int i = 0; i < 36 && k >= h_n[0] && k > FROM; ++i)
      out.D[i] -= g / SCALE / k * out.S[i / 6] * out.S[i % 6];
  }
  for (double& s : out.S) s *= g;
  out.psi *= g;
  return true;
}

// one element, stretched by 0.02 sin^2 and released; the force on the moved side at two times, and the balance
struct Bar { double force60, force100, balance, plastic; };

Bar stretch(const std::string& scheme)
{
  const auto folder =
      std::filesystem::temp_directory_path() / ("mpfe_test_recipe_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "deck.inp")
      << "*MATERIAL, NAME=M\n*HYPERELASTIC, NEO HOOKE\n0.25, 6\n*DENSITY\n1e-6\n*BLOCK, TYPE=CPE4, ELSET=B\n"
         "0, 0, 1, 1\n1, 1\n*SOLID SECTION, ELSET=B, MATERIAL=M\n1\n"
         "*BOUNDARY\nB_XMIN, 1\nB_YMIN, 2\nB_YMAX, 2\n"
         "*STEP, NLGEOM\n*DYNAMIC, DIRECT, SCHEME=" + scheme + "\n0.01, 2\n*BOUNDARY\n"
         "B_XMAX, 1, 1, \"0.02*sin(pi*t/2)^2\"\n*END STEP\n";
  Model m;
  State st;
  Problem p{m, st};
  EXPECT_EQ(0, deck_read((folder / "deck.inp").string(), {}, m));
  std::filesystem::remove_all(folder);
  m.material[0].law = LAW_OTHER;
  EXPECT_EQ(0, step_open(p));
  Bar bar{};
  for (int k = 1; k <= 200; ++k) {
    RealVec energy;
    EXPECT_TRUE(step_prepare(p, m.step[0]).ok());
    EXPECT_TRUE(step_increment(p, m.step[0], 0.01 * (k - 1), 0.01, energy).ok()) << k;
    std::swap(st.n, st.np1);
    ++st.log.inc_total;
    double force = 0.0;
    for (int n = 0; n < m.mesh.nnode(); ++n)
      if (m.mesh.X[3 * n] == 1.0) force += st.rf[2 * n];
    if (k == 60) bar.force60 = force;
    if (k == 100) bar.force100 = force;
  }
  bar.balance = st.ledger.balance;
  bar.plastic = st.ledger.plastic;
  return bar;
}

}  // namespace

TEST(Recipe, LawWithOneNumberOfHistory)
{
  law_other() = {"damage", {{"largest strain", 1, HISTORY_KEPT}}, false, damage, nullptr};
  // at the largest stretch: (1-d) S F by hand, uniaxial strain; E = 1, nu = 0 by the constants of the deck
  const double u = 0.02, k = u + 0.5 * u * u, exact = std::exp(-(k - FROM) / SCALE) * k * (1.0 + u);
  EXPECT_NEAR(exact, 8.294e-3, 1e-6);
  const Bar newmark = stretch("NEWMARK"), momentum = stretch("ENERGY-MOMENTUM");
  EXPECT_NEAR(newmark.force100, 8.294e-3, 5e-6);
  EXPECT_NEAR(momentum.force100, 8.294e-3, 5e-6);
  EXPECT_NEAR(momentum.force60, newmark.force60, 0.006 * newmark.force60);     // the middle, and the end
  for (const Bar& bar : {newmark, momentum}) {
    EXPECT_NEAR(bar.balance, 0.0, 1e-7);
    EXPECT_NEAR(bar.plastic, dissipated(k), 1e-4 * dissipated(k));
  }
  law_other() = {"other", {}, false, law_svk, nullptr};
}
