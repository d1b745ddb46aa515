#include <algorithm>

#include "base/log.h"
#include "base/sort_once.h"
#include "dof/dof.h"

namespace {

struct Coupling { int dof; double value; };          // an entry of a row of A

// adds to the entry of A that couples two dofs
void add_entry(SysMatrix& A, int i, int j, double value)
{
  const int D = A.dim;
  if (i < j) std::swap(i, j);
  const int I = i / D, J = j / D;
  const auto first = A.col.begin() + A.off[I], last = A.col.begin() + A.off[I + 1];
  const auto found = std::lower_bound(first, last, J);
  MPFE_CHECK(found != last && *found == J, "an equation couples rows that the pattern does not");
  A.val[static_cast<size_t>(found - A.col.begin()) * D * D + static_cast<size_t>(i % D) * D + j % D] += value;
}

// removes row and column of dof d from A, which are zero afterwards
//   out   row   its nonzero couplings with other dofs
//   returns the diagonal
double take_row(SysMatrix& A, const ListTable& below, int d, std::vector<Coupling>& row)
{
  const int D = A.dim, I = d / D, i = d % D;
  row.clear();
  const auto take = [&](int dof, double& value) {
    if (value != 0.0) row.push_back({dof, value});
    value = 0.0;
  };
  const int diag = A.off[I + 1] - 1;
  for (int k = A.off[I]; k < diag; ++k)
    for (int j = 0; j < D; ++j) take(A.col[k] * D + j, A.val[(static_cast<size_t>(k) * D + i) * D + j]);
  double* own = &A.val[static_cast<size_t>(diag) * D * D];
  for (int j = 0; j < i; ++j) take(I * D + j, own[i * D + j]);
  for (int j = i + 1; j < D; ++j) take(I * D + j, own[j * D + i]);
  for (int q = below.off[I]; q < below.off[I + 1]; q += 2) {
    const int k = below.item[q], R = below.item[q + 1];
    for (int j = 0; j < D; ++j) take(R * D + j, A.val[(static_cast<size_t>(k) * D + j) * D + i]);
  }
  const double dd = own[i * D + i];
  own[i * D + i] = 0.0;
  return dd;
}

// blocks below the diagonal in the columns of rows with dependent dofs: pairs of k and row
ListTable blocks_below(const Dofs& s)
{
  std::vector<char> wanted(s.rows.nrow, 0);
  for (int d : s.bound.tie.dof) wanted[d / s.rows.dim] = 1;
  const SysMatrix& A = s.pattern.A;
  ListTable below;
  below.off.assign(s.rows.nrow + 1, 0);
  const auto each = [&](auto use) {
    for (int R = 0; R < s.rows.nrow; ++R)
      for (int k = A.off[R]; k < A.off[R + 1] - 1; ++k)
        if (wanted[A.col[k]]) use(A.col[k], k, R);
  };
  each([&](int I, int, int) { below.off[I + 1] += 2; });
  for (int I = 0; I < s.rows.nrow; ++I) below.off[I + 1] += below.off[I];
  below.item.resize(below.off.back());
  IntVec next(below.off.begin(), below.off.end() - 1);
  each([&](int I, int k, int R) {
    below.item[next[I]++] = k;
    below.item[next[I]++] = R;
  });
  return below;
}

Ties make_ties(const Model& m, const Step& step, const DofRows& rows)
{
  std::vector<EquationSolved> solved;
  int bad = -1;
  MPFE_CHECK(equations_resolve(m, step.equation, solved, bad), "an equation depends on itself");
  Ties t;
  for (const EquationSolved& e : solved) {
    t.dof.push_back(rows.row_of_node[e.node] * rows.dim + e.dof);
    for (const EquationMaster& a : e.master) {
      t.master.item.push_back(rows.row_of_node[a.node] * rows.dim + a.dof);
      t.coef.push_back(a.coef);
    }
    t.master.off.push_back(static_cast<int>(t.master.item.size()));
  }
  rigid_ties(m, step, rows, t);
  t.gap.assign(t.dof.size(), 0.0);
  t.list = step.equation;
  t.row  = rows.row_of_node;
  return t;
}

}  // namespace

bool dof_tie(const Model& m, const Step& step, const RealVec& u, Dofs& s)
{
  if (m.equation.empty() && !m.part.tied) return false;
  Ties& old = s.bound.tie;
  const bool known = old.list == step.equation && old.row == s.rows.row_of_node &&
      old.rigid.empty() == (m.rigid.empty() || !step.explicit_steps() || !step.nlgeom);
  bool same = known;
  if (!known) {
    Ties t = make_ties(m, step, s.rows);
    same = t.dof == old.dof && t.coef == old.coef && t.master.off == old.master.off &&
        t.master.item == old.master.item;
    old = std::move(t);
  }
  rigid_arms(m, u, old);
  old.any = !old.dof.empty();
  if (m.part.tied) old.any = comm_allreduce_max(static_cast<int>(old.any)) > 0;
  return !same;
}

void tie_extend(const Dofs& s, ListTable& lists)
{
  if (s.bound.tie.dof.empty()) return;
  IntVec first(s.rows.nrow + 1, 0), order(s.bound.tie.dof.size());        // ties of each row
  for (int d : s.bound.tie.dof) ++first[d / s.rows.dim + 1];
  for (int r = 0; r < s.rows.nrow; ++r) first[r + 1] += first[r];
  IntVec next(first.begin(), first.end() - 1);
  for (size_t k = 0; k < s.bound.tie.dof.size(); ++k)
    order[next[s.bound.tie.dof[k] / s.rows.dim]++] = static_cast<int>(k);
  const ListTable& master = s.bound.tie.master;
  ListTable longer;
  IntVec row;
  for (int l = 0; l < lists.size(); ++l) {
    row.assign(lists.begin(l), lists.begin(l) + lists.count(l));
    const size_t before = row.size();
    for (size_t a = 0; a < before; ++a)
      for (int k = first[row[a]]; k < first[row[a] + 1]; ++k)
        for (int q = master.off[order[k]]; q < master.off[order[k] + 1]; ++q)
          row.push_back(master.item[q] / s.rows.dim);
    if (row.size() > before) sort_once(row);
    longer.item.insert(longer.item.end(), row.begin(), row.end());
    longer.off.push_back(static_cast<int>(longer.item.size()));
  }
  lists = longer;
}

void tie_follow(const Dofs& s, bool gap, RealVec& x)
{
  const Ties& t = s.bound.tie;
  for (size_t k = 0; k < t.dof.size(); ++k) {
    double sum = gap ? t.gap[k] : 0.0;
    for (int q = t.master.off[k]; q < t.master.off[k + 1]; ++q) sum += t.coef[q] * x[t.master.item[q]];
    x[t.dof[k]] = sum;
  }
}

void tie_force(const Dofs& s, RealVec& f)
{
  const Ties& t = s.bound.tie;
  for (size_t k = 0; k < t.dof.size(); ++k) {
    const double force = f[t.dof[k]];
    for (int q = t.master.off[k]; q < t.master.off[k + 1]; ++q) f[t.master.item[q]] += t.coef[q] * force;
    f[t.dof[k]] = 0.0;
  }
}

void tie_matrix(Dofs& s)
{
  const Ties& t = s.bound.tie;
  if (t.dof.empty()) return;
  const ListTable below = blocks_below(s);
  std::vector<Coupling> row;
  for (size_t k = 0; k < t.dof.size(); ++k) {
    const double dd = take_row(s.pattern.A, below, t.dof[k], row);
    for (int q = t.master.off[k]; q < t.master.off[k + 1]; ++q) {
      const int m    = t.master.item[q];
      const double c = t.coef[q];
      for (const Coupling& w : row) add_entry(s.pattern.A, m, w.dof, (w.dof == m ? 2.0 : 1.0) * c * w.value);
      if (dd == 0.0) continue;
      for (int r = t.master.off[k]; r <= q; ++r)
        add_entry(s.pattern.A, m, t.master.item[r], c * t.coef[r] * dd);
    }
  }
}
