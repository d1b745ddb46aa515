#include "elem/elem_share.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "base/comm.h"
#include "base/halo.h"
#include "elem/scalar_element.h"

namespace {

// Divisions of the mass of nodes: by stiffness, then by the frequencies that the last one gave. With nodes
// moved by 0.2 h the increment gains 1.22, 1.37, 1.40, 1.41; each costs a set-up of all elements
// (test: Explicit.SharedMassesBoundTheMesh)
const int DIVISIONS = 2;
// elements of a kind, on average: equal elements have nothing to divide
// (test: Explicit.SharedMassesBoundTheMesh)
const double EQUAL = 2.0;

// A scalar field in an element: stiffness [nen][nen], lower part, and mass by row sums [nen]
struct ScalarElement {
  Eigen::MatrixXd K;
  Eigen::VectorXd mass;
};

void scalar_element(const ElemBlock& b, int kind, ScalarElement& x)
{
  const int nen = shape_info[b.shape].nen;
  x.K.setZero(nen, nen);
  x.mass.resize(nen);
  scalar_masses(b, kind, x.mass.data());
  scalar_stiffness(b, kind, [&](int i, int j, double k) { x.K(i, j) += k; });
}

// square of the largest frequency of the stiffness K with these masses
double largest_frequency(const Eigen::MatrixXd& K, const Eigen::VectorXd& mass)
{
  const Eigen::VectorXd s = mass.cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd A = s.asDiagonal() * K * s.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(A, Eigen::EigenvaluesOnly);
  return eigen.eigenvalues()(s.size() - 1);
}

// calls use(block, slot, element) for each element that takes part, always in the same order
template <class Use>
void each_element(const Elements& el, Use use)
{
  ScalarElement x;
  for (const ElemBlock& b : el.block)
    for (int slot = 0; slot < static_cast<int>(b.elem.size()); ++slot) {
      if (!el.moves(b.elem[slot]) || (!el.rigid.empty() && el.rigid[b.elem[slot]])) continue;
      scalar_element(b, b.kind[slot], x);
      use(b, slot, x);
    }
}

// sums over ranks the values at nodes
void sum_nodes(const Model& m, RealVec& x)
{
  if (m.part.on) halo_sum(m.part.halo, 1, x);
}

// have the elements of all ranks many kinds? Collective
bool unequal(const Elements& el)
{
  double count[2] = {0.0, 0.0};                        // kinds, elements
  for (const ElemBlock& b : el.block) {
    IntVec kind;
    for (size_t slot = 0; slot < b.elem.size(); ++slot)
      if (el.moves(b.elem[slot])) kind.push_back(b.kind[slot]);
    std::sort(kind.begin(), kind.end());
    count[0] += static_cast<double>(std::unique(kind.begin(), kind.end()) - kind.begin());
    count[1] += static_cast<double>(kind.size());
  }
  comm_sum(count, 2);
  return count[1] > 0.0 && count[0] * EQUAL > count[1];
}

}  // namespace

// ---------------------------------------------------------------------------
// elem_share : any division of the nodal masses among the elements gives a bound of the largest frequency; an
// element that is stiff for its mass takes more of that of its nodes
//   theory      doc/theory.md (6.46)
// ---------------------------------------------------------------------------
void elem_share(const Model& m, Elements& el)
{
  if (!unequal(el)) return;
  RealVec node_mass(m.mesh.nnode(), 0.0), weight;
  std::vector<RealVec> shared(el.block.size());        // [kind] the largest of its elements
  double largest[2] = {0.0, 0.0};                      // with the own masses, and with the shared ones
  // 1. masses of nodes; weights of the elements at their nodes: stiffness
  each_element(el, [&](const ElemBlock& b, int slot, const ScalarElement& x) {
    for (int a = 0; a < x.mass.size(); ++a) {
      node_mass[elem_nodes(m.mesh, b, slot)[a]] += x.mass[a];
      weight.push_back(x.K(a, a));
    }
    largest[0] = std::max(largest[0], b.omega2[b.kind[slot]]);
  });
  sum_nodes(m, node_mass);
  // 2. divide the masses, and weigh by the frequency that follows
  for (int k = 0; k < DIVISIONS; ++k) {
    RealVec sum(m.mesh.nnode(), 0.0);
    size_t at = 0;
    each_element(el, [&](const ElemBlock& b, int slot, const ScalarElement& x) {
      for (int a = 0; a < x.mass.size(); ++a) sum[elem_nodes(m.mesh, b, slot)[a]] += weight[at++];
    });
    sum_nodes(m, sum);
    at = 0;
    largest[1] = 0.0;
    for (size_t i = 0; i < shared.size(); ++i) shared[i].assign(el.block[i].omega2.size(), 0.0);
    each_element(el, [&](const ElemBlock& b, int slot, const ScalarElement& x) {
      const int* node = elem_nodes(m.mesh, b, slot);
      Eigen::VectorXd part(x.mass.size());
      for (int a = 0; a < part.size(); ++a) part[a] = node_mass[node[a]] * weight[at + a] / sum[node[a]];
      const double omega2 = largest_frequency(x.K, part);
      for (int a = 0; a < part.size(); ++a) weight[at++] = part[a] * omega2;
      double& of_kind = shared[&b - el.block.data()][b.kind[slot]];
      of_kind    = std::max(of_kind, omega2);
      largest[1] = std::max(largest[1], omega2);
    });
  }
  // 3. one division for all elements
  comm_max(largest, 2);
  if (largest[1] >= largest[0]) return;
  for (size_t i = 0; i < shared.size(); ++i)
    for (size_t k = 0; k < shared[i].size(); ++k)
      if (shared[i][k] > 0.0) el.block[i].omega2[k] = shared[i][k];
}

void elem_share_end(Elements& el)
{
  for (ElemBlock& b : el.block) {
    b.omega2.clear();
    b.mean.clear();
  }
}
