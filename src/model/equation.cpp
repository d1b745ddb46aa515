#include <map>

#include "model/model.h"

namespace {

long key_of(int node, int dof) { return 3L * node + dof; }

// the dependent dof of an equation as a sum of the others
void isolate(const Equation& e, std::map<long, double>& sum)
{
  for (const EquationTerm& t : e.term) sum[key_of(t.node, t.dof)] += t.coef;
  const long own     = key_of(e.term[0].node, e.term[0].dof);
  const double first = sum[own];
  sum.erase(own);
  for (auto& s : sum) s.second /= -first;
}

}  // namespace

// ---------------------------------------------------------------------------
// equations_resolve : chains of equations end in masters that no equation has as its dependent dof  (5.6)
//
//   in   list   indices into Model::equation, no two with the same dependent dof
//   out  out    in the order of list
//        bad    index into Model::equation of one that depends on itself, when false is returned
// ---------------------------------------------------------------------------
bool equations_resolve(const Model& m, const IntVec& list, std::vector<EquationSolved>& out, int& bad)
{
  const int n = static_cast<int>(list.size());
  std::map<long, int> dependent;
  for (int k = 0; k < n; ++k) {
    const EquationTerm& t = m.equation[list[k]].term[0];
    dependent[key_of(t.node, t.dof)] = k;
  }
  std::vector<std::map<long, double>> sum(n);
  IntVec stage(n, 0), stack;                         // 0 not begun, 1 waits for others, 2 done
  for (int k = 0; k < n; ++k) {
    stack.assign(1, k);
    while (!stack.empty()) {
      const int now = stack.back();
      if (stage[now] == 2) { stack.pop_back(); continue; }
      const bool first = stage[now] == 0;
      if (first) isolate(m.equation[list[now]], sum[now]);
      stage[now] = 1;
      bool waits = false;
      for (const auto& s : sum[now]) {
        const auto other = dependent.find(s.first);
        if (other == dependent.end() || stage[other->second] == 2) continue;
        bad = list[now];
        if (stage[other->second] == 1) return false;
        stack.push_back(other->second);
        waits = true;
      }
      if (waits) continue;
      std::map<long, double> whole;
      for (const auto& s : sum[now]) {
        const auto other = dependent.find(s.first);
        if (other == dependent.end()) whole[s.first] += s.second;
        else for (const auto& t : sum[other->second]) whole[t.first] += s.second * t.second;
      }
      sum[now].swap(whole);
      stage[now] = 2;
      stack.pop_back();
    }
  }
  out.resize(n);
  for (int k = 0; k < n; ++k) {
    const EquationTerm& d = m.equation[list[k]].term[0];
    out[k].node = d.node;
    out[k].dof  = d.dof;
    out[k].master.clear();
    for (const auto& s : sum[k]) {
      const int node = static_cast<int>(s.first / 3), dof = static_cast<int>(s.first % 3);
      if (s.second != 0.0) out[k].master.push_back({node, dof, s.second});
    }
  }
  return true;
}
