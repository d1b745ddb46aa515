// ---------------------------------------------------------------------------
// state_io.h : writes and reads the state: one list of fields a struct
//
// of_nodes, of_elems, of_gauss, of_points, of_corners, of_bonds, DividedLists: a divided model stores the
// part of this rank, the file the whole. Indices of elements, nodes, points, corners or faces are not
// converted here: releasing is by out_restart, others by state_to_deck, state_for_file and state_find_faces.
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_STATE_IO_H
#define MPFE_MODEL_STATE_IO_H

#include "model/model_io.h"
#include "model/state_window.h"

// faces are copied as bytes, since arrays of them are divided
template <>
inline constexpr bool is_plain<SkinFace> = true;
static_assert(sizeof(SkinFace) == 3 * sizeof(int), "a gap between the fields would be saved");

// Lists of points or corners, and the kind of their items
struct DividedLists {
  ListTable& x;
  ArchiveKind of, kind;
  bool skip = false;
};

inline void io(Archive& f, const DividedLists& d)
{
  IntVec count;
  for (int i = 0; i < d.x.size(); ++i) count.push_back(d.x.count(i));
  io(f, Divided<int>{count, d.of, d.skip});
  io(f, Divided<int>{d.x.item, d.kind, d.skip});
  if (!f.reading || d.skip) return;
  d.x.off.assign(1, 0);
  for (int n : count) d.x.off.push_back(d.x.off.back() + n);
}

// Points are not saved before the first conversion: point_fill makes them from the deck. First the data by
// which a rank of a window selects its points, and their corners; boundary and surface are rebuilt
inline void io_outline(Archive& f, Points& x)
{
  bool filled = x.of_elem.empty();
  io(f, filled);
  if (filled) return;
  if (state_takes(f)) return state_read_outline(f, x);
  io_all(f, x.npoint, x.ncorner, of_points(x.parent), DividedLists{x.conn, PER_POINT, PER_CONN});
}

// Numbers of domains, point after point, as in files
struct DomainNumbers { RealVec w, G, mc; };

inline DomainNumbers domain_lists(const Points& x)
{
  DomainNumbers d;
  for (int p = 0; p < x.conn.size(); ++p) {
    const int n = x.conn.count(p);
    d.w.insert(d.w.end(), x.w(p), x.G(p));
    d.G.insert(d.G.end(), x.G(p), x.mc(p));
    d.mc.insert(d.mc.end(), x.mc(p), x.mc(p) + n * (n + 1) / 2);
  }
  return d;
}

// Reading: kinds from such lists. G_alone: w and mc are not read but zero, since conversion computes them.
// Inconsistent lists: no kinds, which state_fits rejects
inline void domains_from_lists(const DomainNumbers& d, bool G_alone, Points& x)
{
  const std::size_t items = x.conn.item.size();
  const int dim = items ? static_cast<int>(d.G.size() / items) : 0;
  std::size_t pairs = 0, all = 0;
  x.kind.clear();
  x.kinds = DomainKinds();
  for (int p = 0; p < x.conn.size(); ++p) {
    const std::size_t n = x.conn.count(p);
    if (n < 1 || n > 8) return;
    pairs += n * (n + 1) / 2;
    all += n;
  }
  if (all != items || d.G.size() != items * dim || (dim != 2 && dim != 3) ||
      (!G_alone && (d.w.size() != items || d.mc.size() != pairs)))
    return;
  pairs = 0;
  for (int p = 0; p < x.conn.size(); ++p) {
    const int n = x.conn.count(p), k = x.conn.off[p];
    double number[domain_numbers(8, 3)] = {};
    std::copy_n(&d.G[static_cast<std::size_t>(k) * dim], n * dim, number + n);
    if (!G_alone) std::copy_n(&d.w[k], n, number);
    if (!G_alone) std::copy_n(&d.mc[pairs], n * (n + 1) / 2, number + n * (1 + dim));
    pairs += static_cast<std::size_t>(n) * (n + 1) / 2;
    x.kind.push_back(domain_kind(n, dim, number, x.kinds));
  }
}

// Points as they were filled: only the rings of which RESHAPE has taken points, on one rank
inline void io_rings(Archive& f, Points& x)
{
  const bool divided = f.part || x.part.on || x.part.window;
  bool apart = false;
  for (std::size_t p = 0; p < x.next.size() && !divided && !f.reading; ++p)
    apart = apart || x.next[p] == static_cast<int>(p);
  io(f, apart);
  if (!apart) return;
  IntVec next = x.next;
  io(f, next);
  if (f.reading && !divided) x.next = next;
}

inline void io(Archive& f, Points& x)
{
  bool filled = x.of_elem.empty();
  io(f, filled);
  if (filled) return io_rings(f, x);
  const bool skip = state_takes(f);    // conversion computes them again
  auto& [npoint, ncorner, Xc, shape, conn, kind, kinds, sampled, V0, mass, body, label, of_elem, parent, next,
         broken, normal, released, field, first_copy, hang, hang_w, hangs, unshared_since, boundary, surface,
         part] = x;
  if (!f.reading && !f.part) unshared_since.resize(ncorner, 0);
  DomainNumbers d;
  if (!f.reading) d = domain_lists(x);
  io_all(f, of_corners(Xc), of_points(shape, skip), Divided<double>{d.w, PER_CONN, skip},
         Divided<double>{d.G, PER_CONN}, of_points(sampled), Divided<double>{d.mc, PER_PAIR, skip},
         of_points(V0), of_points(mass, skip), of_points(body, skip), of_points(label), of_elems(of_elem),
         of_points(next, skip), of_points(broken), of_points(normal), of_points(released, skip),
         of_corners(field, skip), of_corners(first_copy, skip),
         DividedLists{hang, PER_CORNER, PER_HANG, skip},
         Divided<double>{hang_w, PER_HANG, skip}, of_corners(hangs),
         of_corners(unshared_since));
  if (f.reading) domains_from_lists(d, skip, x);
}

// Side A of bonds as numbers: the last one of each list is -1 - item
inline IntVec list_numbers(const ListTable& x)
{
  IntVec number = x.item;
  for (int i = 0; i < x.size(); ++i)
    if (x.count(i) > 0) number[x.off[i + 1] - 1] = -1 - number[x.off[i + 1] - 1];
  return number;
}

inline void number_lists(IntVec& number, ListTable& x)
{
  x.off.assign(1, 0);
  x.item.swap(number);
  for (std::size_t i = 0; i < x.item.size(); ++i) {
    if (x.item[i] >= 0) continue;
    x.item[i] = -1 - x.item[i];
    x.off.push_back(static_cast<int>(i) + 1);
  }
}

// First the data by which a rank of a divided model selects its bonds: their items, faces of general contact
inline void io_outline(Archive& f, const Points& p, Bonds& x)
{
  io_all(f, x.nbond, x.nfixed);
  if (f.reading && f.part) return state_read_bonds(f, p, x);
  IntVec side = list_numbers(x.a);
  io_all(f, Divided<SkinFace>{x.contact.skin, PER_SKIN}, Divided<int>{side, PER_SIDE});
  if (f.reading) number_lists(side, x.a);
}

inline void io(Archive& f, Bonds& x)
{
  auto& [nbond, nfixed, a, a_w, def, side, field, area, X, normal, cn, ct, intermediate, contact, rank, name,
         halo, nall] = x;
  auto& [offset, initial_penetration, deep, friction, skin, skin_penalty, skin_of, met, wall] = contact;
  io_all(f, Divided<double>{a_w, PER_SIDE}, of_bonds(def), of_bonds(side), of_bonds(field), of_bonds(area),
         of_bonds(X), of_bonds(normal), of_bonds(cn), of_bonds(ct), of_bonds(offset),
         of_bonds(initial_penetration), of_bonds(deep), of_bonds(intermediate), of_bonds(friction),
         of_bonds(skin_of), of_bonds(met), of_bonds(wall), Divided<double>{skin_penalty, PER_SKIN});
  if (f.reading && f.part) state_find_faces(f, x);
}

inline void io(Archive& f, Fracture& x)
{
  auto& [phase, broken, normal, time, releasing, converted, released, released_at, left, renewed, next_test,
         drive, mean, drive_time, neroded, nreleasing, nconverted, nreleased, area, least, most, tracked, tip,
         tip_elem] = x;
  io_all(f, of_elems(phase), of_elems(broken), of_elems(normal), of_elems(time), releasing, converted,
         released, released_at, left, renewed, next_test, of_elems(drive), of_elems(mean), drive_time,
         neroded, nreleasing, nconverted, nreleased, area, least, most, of_elems(tracked), tip, tip_elem);
}

inline void io(Archive& f, Level& x)
{
  auto& [time, u, v, a, uc, vc, slip, lambda, lambda_n, he, hp, degr, cracked, q] = x;
  io_all(f, time, of_nodes(u), of_nodes(v), of_nodes(a), of_corners(uc), of_corners(vc),
         of_bonds(slip), of_bonds(lambda), of_bonds(lambda_n), of_gauss(he), of_points(hp), of_elems(degr),
         of_elems(cracked), of_elems(q));
}

IO_FIELDS(Ledger, kinetic, strain, bond, external, friction, plastic, fracture, cohesive, ghost, viscous,
          renewal, overlap, released, sudden, stopped, conversion, removed, total0, balance, scale, rounding,
          balance0, external0, step_scale, leap, leap_grid, beta_power, off, momentum, angular, slip_max,
          slip_rms)
IO_FIELDS(ContactLog, force, gap, area, peak, work)
IO_FIELDS(StepClock, start, t, dt, nominal, easy, most, aim, impulse, square, energy, cuts, stable, system,
          broke, measured, xi, stage, stage_least, load, load_most, ended)

// the ranks of points follow after the points: io_point_ranks
inline void io(Archive& f, Division& x)
{
  auto& [ranks, pieces, elem, point, excess, made, handed] = x;
  io_all(f, ranks, pieces, of_elems(elem), excess, made, handed);
}

// with pieces: points that were not transferred belong to the owner of their element
inline void io_point_ranks(Archive& f, Division& x)
{
  if (!x.pieces || x.handed) io(f, of_points(x.point));
}

IO_FIELDS(WorkShare, events, excess, now, lost)
IO_FIELDS(StepLog, step, inc, inc_total, iterations, cuts, dt, t_step, residual, scale, half, half_limit,
          grid_nodes, grid_cells, weak_nodes, equations, contact_searched, contact_skipped, begin)
IO_FIELDS(ErosionLog, elem, label, time, value, released, X)

inline void io(Archive& f, GridLaid& x)
{
  io_all(f, of_corners(x.uc), of_bonds(x.xb), x.inc);
}

// between increments level n+1 equals n. First the division, which rank 0 reads alone to divide the model in
// the same way
inline void io(Archive& f, State& x)
{
  auto& [n, np1, points, bonds, frac, rf, contact, grid_rf, left_by_removed, rate, ledger, eroded, clock,
         laid, division, work, log] = x;
  io(f, division);
  io_outline(f, points);
  io(f, frac);
  if (state_takes(f)) state_find_corners(f, x);
  io_outline(f, points, bonds);
  io_all(f, points, n, bonds, of_nodes(rf), contact, grid_rf, of_nodes(left_by_removed), of_nodes(rate),
         ledger, eroded, clock, laid, work, log);
  io_point_ranks(f, division);
  if (f.reading) np1 = n;
}

#endif
