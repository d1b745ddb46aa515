#include "model/state_fits.h"

#include <algorithm>
#include <cmath>

#include "model/element_table.h"

namespace {

// in the units of the state: larger numbers overflow when squared
// (test: Archive.AStateThatDoesNotFitTheModelIsSeen)
const double FAR = 1e150;

template <class T>
bool has(const std::vector<T>& v, std::size_t n) { return v.size() == n; }

// n numbers, finite
bool real(const RealVec& v, std::size_t n)
{
  return v.size() == n && std::all_of(v.begin(), v.end(), [](double x) { return std::fabs(x) < FAR; });
}

bool index(const IntVec& v, int lo, int hi)
{
  return std::all_of(v.begin(), v.end(), [=](int i) { return i >= lo && i < hi; });
}

bool index(const IntVec& v, std::size_t n, int lo, int hi) { return v.size() == n && index(v, lo, hi); }

// no index twice
bool distinct(const IntVec& v, int n)
{
  std::vector<char> seen(n, 0);
  for (int i : v)
    if (seen[i]++) return false;
  return true;
}

bool lists(const ListTable& t, int n, int lo, int hi)
{
  if (n < 0 || !has(t.off, static_cast<std::size_t>(n) + 1) || t.off[0] != 0 ||
      t.off[n] != static_cast<int>(t.item.size()))
    return false;
  return std::is_sorted(t.off.begin(), t.off.end()) && index(t.item, lo, hi);
}

int fields(const Model& m)
{
  int n = 1;
  for (const Body& b : m.body) n = std::max(n, b.field + 1);
  return n;
}

bool faces(const std::vector<Face>& list, const Points& p)
{
  return std::all_of(list.begin(), list.end(), [&](const Face& f) {
    return f.elem >= 0 && f.elem < p.npoint && f.face >= 0 && f.face < shape_info[p.shape[f.elem]].nface;
  });
}

// supports of the corners of converted elements                                      (7.14)
bool hangs_fit(const Model& m, const Points& p)
{
  if (!lists(p.hang, p.ncorner, -p.ncorner, m.mesh.nnode()) || !real(p.hang_w, p.hang.item.size()))
    return false;
  const int n = static_cast<int>(p.hangs.size());
  if (n > p.ncorner || !index(p.hangs, HANG_GRID, HANG_OWN + 1)) return false;
  for (int c = 0; c < n; ++c) {
    const bool at_node = p.hang.count(c) == 1 && p.hang.begin(c)[0] >= 0;
    if (p.hangs[c] == HANG_NODE && !at_node) return false;
    if (p.hangs[c] == HANG_CORNERS &&
        std::any_of(p.hang.begin(c), p.hang.begin(c) + p.hang.count(c), [](int i) { return i >= 0; }))
      return false;
  }
  for (int c = n; c < p.ncorner && n > 0; ++c)
    if (p.field[c] != FIELD_OWN) return false;         // of points released after the last conversion
  return true;
}

bool points_fit(const Model& m, const Points& begin, const Points& p)
{
  const int nelem = m.mesh.nelem(), nbody = static_cast<int>(m.body.size()),
            nfrac = static_cast<int>(m.fracture.size());
  if (p.npoint < begin.npoint || p.ncorner < begin.ncorner) return false;
  const std::size_t n = p.npoint, c = p.ncorner, dim = m.dim;
  if (!index(p.shape, n, 0, SHAPE_TRI6) || !lists(p.conn, p.npoint, 0, p.ncorner)) return false;
  for (int q = 0; q < p.npoint; ++q) {
    const ShapeInfo& info = shape_info[p.shape[q]];
    if (info.dim != m.dim || p.conn.count(q) != info.nen) return false;
  }
  if (!real(p.Xc, c * dim) || !has(p.kind, n) || (n > 0 && p.kinds.dim != m.dim) ||
      !real(p.kinds.number, p.kinds.number.size()) || !index(p.sampled, n, 0, 2) || !real(p.V0, n) ||
      !real(p.mass, n))
    return false;
  if (!index(p.body, n, 0, nbody) || !has(p.label, n) || !index(p.parent, n, -1, nelem) ||
      !index(p.broken, n, -1, nfrac))
    return false;
  if (!index(p.next, n, 0, p.npoint) || !distinct(p.next, p.npoint)) return false;
  if (!(p.of_elem.empty() || index(p.of_elem, nelem, -1, p.npoint))) return false;
  if (!real(p.normal, 3 * n) || !has(p.released, n) || !index(p.field, c, FIELD_OWN, fields(m)) ||
      !index(p.first_copy, c, 0, p.ncorner) || !hangs_fit(m, p) || p.unshared_since.size() > c ||
      !index(p.unshared_since, 0, p.npoint_all() + 1))
    return false;
  // points of the deck have not changed, but for their corners
  const bool same = std::equal(begin.shape.begin(), begin.shape.end(), p.shape.begin()) &&
                    std::equal(begin.body.begin(), begin.body.end(), p.body.begin()) &&
                    std::equal(begin.label.begin(), begin.label.end(), p.label.begin()) &&
                    std::equal(begin.parent.begin(), begin.parent.end(), p.parent.begin());
  return same && faces(p.boundary, p) && p.surface.size() == begin.surface.size() &&
         std::all_of(p.surface.begin(), p.surface.end(),
                     [&](const std::vector<Face>& f) { return faces(f, p); });
}

bool skin_fits(const Model& m, const Points& p, const Bonds& b)
{
  for (const SkinFace& f : b.contact.skin) {
    if (f.elem < 0 || f.elem >= (f.points ? p.npoint : m.mesh.nelem())) return false;
    const Shape shape = f.points ? static_cast<Shape>(p.shape[f.elem])
                                 : elem_table[m.mesh.elem_type[f.elem]].shape;
    if (f.face < 0 || f.face >= shape_info[shape].nface) return false;
  }
  return true;
}

bool contact_fits(const Model& m, std::size_t n, const ContactState& c)
{
  const int faces = static_cast<int>(c.skin.size());
  return real(c.offset, n) && real(c.initial_penetration, n) && real(c.deep, n) && real(c.friction, n) &&
         real(c.skin_penalty, c.skin.size()) && index(c.skin_of, n, -1, faces) &&
         index(c.met, n, -1, faces) && index(c.wall, n, -1, static_cast<int>(m.grid_bc.size()));
}

bool bonds_fit(const Model& m, const Points& p, const Bonds& b)
{
  if (b.nbond < 0 || b.nfixed < 0 || b.nfixed > b.nbond) return false;
  const std::size_t n = b.nbond, dim = m.dim;
  if (!lists(b.a, b.nbond, 0, m.mesh.nnode() + p.ncorner) || !real(b.a_w, b.a.item.size())) return false;
  if (!index(b.def, n, 0, static_cast<int>(m.bond.size())) || !index(b.field, n, -1, fields(m)) ||
      !index(b.side, n, SIDE_GRID, SIDE_CONTACT + 1))
    return false;
  for (std::size_t q = 0; q < n; ++q)
    if ((b.side[q] == SIDE_GRID) != (b.field[q] >= 0)) return false;
  return real(b.area, n) && real(b.X, 3 * n) && real(b.normal, n * dim) && real(b.cn, n) && real(b.ct, n) &&
         index(b.intermediate, n, 0, 2) && contact_fits(m, n, b.contact) && skin_fits(m, p, b);
}

bool fracture_fits(const Model& m, const Points& p, const Fracture& f)
{
  const int nelem = m.mesh.nelem();
  const std::size_t n = f.empty() ? 0 : nelem;
  if (!index(f.phase, n, AS_ELEMENT, AS_NOTHING + 1) ||
      !index(f.broken, n, -1, static_cast<int>(m.fracture.size())))
    return false;
  if (!real(f.normal, 3 * n) || !real(f.time, n)) return false;
  if (f.drive.size() != f.mean.size() || (!f.drive.empty() && (!real(f.drive, n) || !real(f.mean, n))))
    return false;
  if (!f.tracked.empty() && !index(f.tracked, n, 0, 4)) return false;
  const std::size_t tips = f.tip_elem.size();
  if (!real(f.tip, 4 * tips) || !index(f.tip_elem, tips, -1, static_cast<int>(n))) return false;
  if (!index(f.releasing, 0, static_cast<int>(n)) || !distinct(f.releasing, nelem)) return false;
  for (int e : f.releasing)
    if (f.broken[e] < 0) return false;
  for (int q = 0; q < p.npoint; ++q)
    if (p.broken[q] >= 0 && (f.empty() || p.parent[q] < 0)) return false;
  if (!index(f.converted, 0, static_cast<int>(n)) || !distinct(f.converted, nelem)) return false;
  for (int e : f.converted)
    if (f.phase[e] != AS_POINTS || p.of_elem.empty() || p.of_elem[e] < 0 || m.mesh.elem_section[e] < 0)
      return false;
  long made = 0;
  for (int e = 0; e < static_cast<int>(n); ++e)
    made += f.phase[e] == AS_POINTS && m.part.stores_points(e);
  if (made != static_cast<long>(f.converted.size()) || f.nconverted < made) return false;
  if (!index(f.released, 0, p.npoint) || !distinct(f.released, p.npoint)) return false;
  const int n_released = static_cast<int>(f.released.size());
  if (f.nreleased < n_released || !lists(f.left, n_released, 0, p.ncorner)) return false;
  for (int k = 0; k < n_released; ++k) {
    const int q = f.released[k];
    if (p.parent[q] < 0 || !p.converted(p.parent[q]) || f.left.count(k) != p.conn.count(q)) return false;
  }
  return index(f.released_at, f.released.size(), 0, p.npoint_all() + 1) &&
         std::is_sorted(f.released_at.begin(), f.released_at.end());
}

// the gap of a contact point without a face is 1e300
bool finite(const RealVec& v, std::size_t n)
{
  return v.size() == n && std::all_of(v.begin(), v.end(), [](double x) { return std::isfinite(x); });
}

// history of the laws: the same length at each integration point
bool history_fits(const Model& m, const Points& p, const Level& l)
{
  size_t gauss = 0;
  for (int e = 0; e < m.mesh.nelem(); ++e)
    if (m.mesh.elem_section[e] >= 0) gauss += shape_info[elem_table[m.mesh.elem_type[e]].shape].ngp;
  const size_t n = l.he.empty() || gauss == 0 ? 0 : l.he.size() / gauss;
  const size_t k = l.hp.empty() || p.npoint == 0 ? 0 : l.hp.size() / p.npoint;
  return real(l.he, gauss * n) && real(l.hp, p.npoint * k);
}

bool level_fits(const Model& m, const State& s, const Level& l)
{
  const std::size_t dim = m.dim, nodal = m.mesh.nnode() * dim, corners = s.points.ncorner * dim,
                    bonds = s.bonds.nbond;
  const bool opens = std::any_of(m.fracture.begin(), m.fracture.end(),
                                 [](const FractureDef& f) { return f.criterion == CRITERION_COHESIVE; });
  return std::fabs(l.time) < FAR && real(l.u, nodal) && real(l.v, nodal) && real(l.a, nodal) &&
         real(l.uc, corners) && real(l.vc, corners) && real(l.degr, s.frac.empty() ? 0 : m.mesh.nelem()) &&
         (l.q.empty() || real(l.q, m.mesh.nelem())) &&
         has(l.cracked, opens ? m.mesh.nelem() : 0) &&
         history_fits(m, s.points, l) && finite(l.slip, bonds * dim) &&
         real(l.lambda, bonds * dim) && real(l.lambda_n, bonds);
}

bool rest_fits(const Model& m, const State& s)
{
  const std::size_t nodal = static_cast<std::size_t>(m.mesh.nnode()) * m.dim;
  if (!real(s.rf, nodal) || !(s.contact.empty() || has(s.contact, m.bond.size())) ||
      !real(s.grid_rf, m.grid_bc.size() * m.dim))
    return false;
  if (!s.rate.empty() && !real(s.rate, nodal)) return false;
  for (const ErosionLog& e : s.eroded)
    if (e.elem < 0 || e.elem >= (m.part.on ? m.part.nelem : m.mesh.nelem())) return false;
  return true;
}

bool grid_fits(const Model& m, const State& s)
{
  const GridLaid& g     = s.laid;
  const std::size_t dim = m.dim;
  return g.fits(s.points.ncorner * dim, s.bonds.nbond * dim) && real(g.uc, g.uc.size()) &&
         real(g.xb, g.xb.size());
}

bool clock_fits(const Model& m, const State& s)
{
  const StepClock& c = s.clock;
  if (s.log.step < 1 || s.log.step > static_cast<int>(m.step.size()) || s.log.inc < 0 || s.log.inc_total < 0)
    return false;
  const double period = m.step[s.log.step - 1].period;
  const bool arc      = m.step[s.log.step - 1].arc.on;
  if (!(std::fabs(c.start) < FAR) || !(c.t >= 0.0 && (arc || c.t <= period * (1.0 + 1e-6))) ||
      !(c.dt > 0.0 && c.dt < FAR))
    return false;
  if (c.nominal < 1 || c.easy < 0 || c.cuts < 0 || !(c.most >= 0.0 && c.most < FAR) ||
      !(c.aim >= 0.0 && c.aim < FAR))
    return false;
  const double goal = std::min(period, static_cast<double>(c.nominal) * m.step[s.log.step - 1].dt);
  return !m.step[s.log.step - 1].direct || goal > c.t || c.t >= period * (1.0 - 1e-10);
}

bool division_fits(const Model& m, const State& s)
{
  const Division& d = s.division;
  if (d.ranks < 1) return false;
  if (d.pieces) return d.point.empty() || index(d.point, s.points.npoint, 0, d.ranks);
  return d.ranks == 1 ||
         (index(d.elem, m.mesh.nelem(), -1, d.ranks) && index(d.point, s.points.npoint, -1, d.ranks));
}

}  // namespace

const char* state_fault(const Model& m, const Points& begin, const State& s)
{
  if (!points_fit(m, begin, s.points)) return "material points";
  if (!bonds_fit(m, s.points, s.bonds)) return "bonds";
  if (!fracture_fits(m, s.points, s.frac)) return "broken and converted elements";
  if (!level_fits(m, s, s.n)) return "displacements and velocities";
  if (!rest_fits(m, s)) return "reactions";
  if (!clock_fits(m, s)) return "times and increments";
  if (!grid_fits(m, s)) return "the active grid";
  return division_fits(m, s) ? nullptr : "division among ranks";
}
