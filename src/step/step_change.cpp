// Elements that a step removes or adds, and the strains at which the run begins.

#include <algorithm>
#include <cmath>

#include "base/log.h"
#include "elem/elem_share.h"
#include "mat/law.h"
#include "step/step.h"

namespace {

// ---- initial stress -----------------------------------------------------------------------------------

// where an integration point of a line of the deck lies
struct StressPlace {
  std::string name;
  const double* X;             // [3] at t = 0
};

// initial strain E [6] of one integration point. false: an error, which is reported
bool initial_strain(const Model& m, const InitialStress& s, const MatLaw& law, bool finite,
                    const StressPlace& at, double* E)
{
  const double rest[MAX_HISTORY] = {0};
  double S[6];
  for (int k = 0; k < 6; ++k) {
    S[k] = expr_eval(s.value[k], at.X, 0.0);
    if (std::isfinite(S[k])) continue;
    log_error(
        "%s",
        value_text(m, "INITIAL CONDITIONS", s.deck_line, s.value[k], -1, at.name, at.X, 0.0).c_str());
    return false;
  }
  if (law_initial(law, finite, S, rest, E)) return true;
  log_error("%s line %d, *INITIAL CONDITIONS: %s cannot have the stress %g %g %g %g %g %g (11 22 33 12 13 "
            "23): material %s would yield or crack, or has no such stress; give a smaller one",
            s.deck_line.file.c_str(), s.deck_line.line, at.name.c_str(), S[0], S[1], S[2], S[3], S[5], S[4],
            law.material->name.c_str());
  return false;
}

bool start_element(Problem& p, const InitialStress& s, int e, bool finite)
{
  const Elements& el = p.d.el;
  if (el.initial_block[e] < 0) return true;
  const ElemBlock& b = el.block[el.initial_block[e]];
  const MatLaw law   = el.broken(e) >= 0 ? b.law : elem_law(p.m, el, b, el.slot_of[e], 1.0);
  for (int k = el.gauss_of[e], g = 0; k < el.gauss_of[e + 1]; ++k, ++g) {
    if (s.point >= 0 && s.point != g) continue;
    double X[3], N[MAX_NODES];
    elem_gauss_position(p.m, el, e, g, X, N);
    const StressPlace at{"element " + std::to_string(p.m.mesh.elem_label[e]), X};
    if (!initial_strain(p.m, s, law, finite, at, history_at(p.st.n.he, el.history, k) + law.initial))
      return false;
  }
  return true;
}

bool start_body(Problem& p, const InitialStress& s)
{
  Points& pts      = p.st.points;
  const MatLaw law = p.d.point_law.body[s.body];
  for (int q = 0; q < pts.npoint; ++q) {
    if (pts.body[q] != s.body) continue;
    double X[3] = {0, 0, 0};
    point_centre(pts, p.m.dim, q, X);
    const StressPlace at{"material point " + std::to_string(pts.label[q]), X};
    MatLaw of = law;
    if (law_opens(of.kind)) point_crack(p.m, pts, p.st.n, q, CRACK_TANGENT, of);
    if (!initial_strain(p.m, s, of, true, at, history_at(p.st.n.hp, p.d.point_law.history, q) + law.initial))
      return false;
  }
  return true;
}

}  // namespace

int step_initial_stress(Problem& p)
{
  int errors = 0;              // lines
  const bool finite = p.m.step.empty() || p.m.step.front().nlgeom;
  for (const InitialStress& s : p.m.initial_stress) {
    bool good = s.body < 0 || start_body(p, s);
    for (size_t k = 0; k < s.elem.size() && good; ++k) good = start_element(p, s, s.elem[k], finite);
    errors += !good;
  }
  return errors;
}

namespace {

// ---- *MODEL CHANGE ------------------------------------------------------------------------------------

// loads at the end of step k, in rows
RealVec loads_of(Problem& p, int k)
{
  RealVec f(p.dofs.rows.neq(), 0.0);
  if (k < 0) return f;
  const Step& s = p.m.step[k];
  if (!assem_loads(p.m, p.d, p.dofs, p.st, s, {s.period, p.st.n.time, 1.0}, p.warned, f).ok())
    f.assign(p.dofs.rows.neq(), 0.0);
  return f;
}

// takes the forces of elements that are to be removed from f, in rows
void take_forces(Problem& p, const Step& s, RealVec& f)
{
  const Elements& el = p.d.el;
  const int dim      = p.m.dim;
  KernelMode mode    = step_mode(s);
  mode.mid = false;
  RealVec own(f.size(), 0.0);
  double re[3 * MAX_NODES];
  for (const ModelChange& c : s.change)
    for (int e : c.elem) {
      if (c.add || el.block_of[e] < 0) continue;
      const ElemBlock& b = el.block[el.block_of[e]];
      if (elem_form_one(p.m, el, mode, b, el.slot_of[e], elem_form(b), p.st.n, p.st.np1, re, nullptr) !=
          STATUS_OK)
        continue;
      for (int a = 0; a < p.m.mesh.conn.count(e); ++a) {
        const int r = p.dofs.rows.row_of_node[p.m.mesh.conn.begin(e)[a]];
        for (int i = 0; i < dim; ++i) own[r * dim + i] -= re[a * dim + i];
      }
    }
  sys_sum(p.dofs.pattern.A, own);
  for (size_t i = 0; i < f.size(); ++i) f[i] += own[i];
}

// Nodes without an element stand where they are, on all ranks; what comes back to them is at rest
void stop_lone_nodes(Problem& p)
{
  const Model& m = p.m;
  RealVec lives(m.mesh.nnode(), 0.0);
  for (int e = 0; e < m.mesh.nelem(); ++e)
    for (int a = 0; a < m.mesh.conn.count(e) && p.d.el.block_of[e] >= 0; ++a)
      lives[m.mesh.conn.begin(e)[a]] = 1.0;
  if (m.part.on) {
    halo_sum(m.part.halo, 1, lives);
    for (RealVec* x : {&p.st.n.u, &p.st.n.v, &p.st.n.a}) halo_copy(m.part.halo, m.dim, *x);
  }
  for (int n = 0; n < m.mesh.nnode(); ++n)
    for (int k = n * m.dim; k < (n + 1) * m.dim && lives[n] == 0.0; ++k) p.st.n.v[k] = p.st.n.a[k] = 0.0;
}

void change_elements(Problem& p, const Step& s, bool add)
{
  State& st = p.st;
  for (const ModelChange& c : s.change)
    for (int e : c.add == add ? c.elem : IntVec()) {
      st.frac.phase[e] = add ? AS_ELEMENT : AS_NOTHING;
      if (add && !st.frac.tracked.empty() && st.frac.broken[e] < 0) st.frac.tracked[e] = 0;
      if (add && p.d.el.initial_block[e] >= 0) elem_forget_strain(p.m, p.d.el, e, s.nlgeom, st.n);
    }
  elem_refresh(p.d.el);
  if (s.change.empty()) return;
  elem_share_end(p.d.el);
  p.stable.crossing = 0.0;
}

}  // namespace

// ---------------------------------------------------------------------------
// step_change : elements go and come back when step k begins                        doc/theory.md (6.43)
//
// The forces of removed elements on their nodes stay, and a static step takes them away over its time; in
// motion they are gone at once. Elements that come back have no stress as they are then.
// ---------------------------------------------------------------------------
Failure step_change(Problem& p, int k)
{
  const Step& s = p.m.step[k];
  State& st     = p.st;
  st.left_by_removed.clear();
  if (s.change.empty()) return Failure();
  Failure failure = step_prepare(p, s);
  if (!failure.ok()) return failure;
  const Ledger before = st.ledger;
  ledger_update(p.m, p.d.el, p.dofs, st.n, s.nlgeom, st);
  const Ledger whole = st.ledger;
  // 1. forces of what goes, and of the loads on it
  RealVec f;
  if (s.proc == PROC_STATIC) {
    st.np1 = st.n;
    f = loads_of(p, k - 1);
    take_forces(p, s, f);
  }
  // 2. elements
  stop_lone_nodes(p);
  change_elements(p, s, false);
  stop_lone_nodes(p);
  if (s.proc == PROC_STATIC) {
    const RealVec rest = loads_of(p, k - 1);
    const int dim      = p.m.dim;
    st.left_by_removed.assign(st.n.u.size(), 0.0);
    for (int i = 0; i < p.dofs.rows.nfe * dim; ++i)
      st.left_by_removed[p.dofs.rows.node_of_row[i / dim] * dim + i % dim] = f[i] - rest[i];
  }
  change_elements(p, s, true);
  // 3. rows and energies
  if (p.m.part.on) model_owners(frac_gone(st.frac), p.piece);
  p.dofs.rows.numbered = false;
  st.laid = GridLaid();
  p.ready = false;
  failure = step_prepare(p, s);
  if (!failure.ok()) return failure;
  ledger_update(p.m, p.d.el, p.dofs, st.n, s.nlgeom, st);
  const Ledger now = st.ledger;
  st.ledger = before;
  st.ledger.kinetic += now.kinetic - whole.kinetic;
  st.ledger.strain += now.strain - whole.strain;
  st.ledger.plastic += now.plastic - whole.plastic;
  st.ledger.cohesive += now.cohesive - whole.cohesive;
  st.ledger.removed += ledger_energy(whole) - ledger_energy(now);
  return failure;
}
