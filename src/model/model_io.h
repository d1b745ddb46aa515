// ---------------------------------------------------------------------------
// model_io.h : writes and reads the model: one list of fields a struct
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_MODEL_IO_H
#define MPFE_MODEL_MODEL_IO_H

#include "base/archive.h"
#include "base/log.h"
#include "model/model.h"

// A function is compiled again from its text. Shared values are shared again.
inline void io(Archive& f, Expr& x)
{
  auto& [value, text, code] = x;
  io_all(f, value, text);
  if (archive_share(f, code)) return;
  ParamMap constants = expr_constants(x);
  io(f, constants);
  if (!f.reading || !f.good) return;
  std::string error;
  int position = 0;
  MPFE_CHECK(expr_compile(text, constants, x, error, position), "an expression could not be compiled again");
  f.shared.push_back(code);
}

inline void io(Archive& f, ListTable& x)
{
  auto& [off, item] = x;
  io_fields<ListTable>(f, off, item);
}

inline void io(Archive& f, Halo& x)
{
  auto& [common, shared, owner] = x;
  io_fields<Halo>(f, common, shared, owner);
}

inline void io(Archive& f, DeckLine& x)
{
  auto& [file, line] = x;
  io_fields<DeckLine>(f, file, line);
}

inline void io(Archive& f, Mesh& x)
{
  auto& [node_label, X, elem_label, elem_type, elem_section, conn] = x;
  io_fields<Mesh>(f, node_label, X, elem_label, elem_type, elem_section, conn);
}

inline void io(Archive& f, UncoupledPair& x)
{
  auto& [body, other, section, reported] = x;
  io_fields<UncoupledPair>(f, body, other, section, reported);
}

inline void io(Archive& f, OriginalPoint& x)
{
  auto& [point, rank] = x;
  io_fields<OriginalPoint>(f, point, rank);
}

inline void io(Archive& f, MeshPart& x)
{
  auto& [on, points, window, nnode, nelem, node, elem, deck, rank, halo, around, with_points,
         around_points, near_point, notch, joined, tied, uncoupled, skin] = x;
  io_fields<MeshPart>(f, on, points, window, nnode, nelem, node, elem, deck, rank, halo, around, with_points,
                      around_points, near_point, notch, joined, tied, uncoupled, skin);
}

inline void io(Archive& f, Set& x)
{
  auto& [name, item, deck_line] = x;
  io_fields<Set>(f, name, item, deck_line);
}

inline void io(Archive& f, Face& x)
{
  auto& [elem, face] = x;
  io_fields<Face>(f, elem, face);
}

inline void io(Archive& f, Surface& x)
{
  auto& [name, face, member, body, where, deck_line] = x;
  io_fields<Surface>(f, name, face, member, body, where, deck_line);
}

inline void io(Archive& f, Material& x)
{
  auto& [name, law, young, poisson, density, alpha, beta, elastic, yield, plastic_strain, friction, exponent,
         dilation, gap, hardening, has_elastic, has_damping, used, hyper, breaks, prestressed, initial,
         deck_line] = x;
  io_fields<Material>(f, name, law, young, poisson, density, alpha, beta, elastic, yield, plastic_strain,
                      friction, exponent, dilation, gap, hardening, has_elastic, has_damping, used, hyper,
                      breaks, prestressed, initial, deck_line);
}

inline void io(Archive& f, Section& x)
{
  auto& [elset, material, thickness, deck_line, lumped] = x;
  io_fields<Section>(f, elset, material, thickness, deck_line, lumped);
}

inline void io(Archive& f, Amplitude& x)
{
  auto& [name, kind, total_time, t, y, expr, deck_line] = x;
  io_fields<Amplitude>(f, name, kind, total_time, t, y, expr, deck_line);
}

inline void io(Archive& f, CellRanks& x)
{
  auto& [first, rank] = x;
  io_fields<CellRanks>(f, first, rank);
}

inline void io(Archive& f, Body& x)
{
  auto& [name, fill, lo, hi, cells, per_cell, elset, where, material, plane, thickness, field, reshape, hang,
         fracture, rank, deck_line] = x;
  io_fields<Body>(f, name, fill, lo, hi, cells, per_cell, elset, where, material, plane, thickness, field,
                  reshape, hang, fracture, rank, deck_line);
}

inline void io(Archive& f, Grid& x)
{
  auto& [given, lo, h, n, weak, keep, deck_line, ghost_stiffness, ghost_mass, ghost_place] = x;
  io_fields<Grid>(f, given, lo, h, n, weak, keep, deck_line, ghost_stiffness, ghost_mass, ghost_place);
}

inline void io(Archive& f, ViscousBoundary& x)
{
  auto& [surface, a, b, deck_line] = x;
  io_fields<ViscousBoundary>(f, surface, a, b, deck_line);
}

inline void io(Archive& f, GridBc& x)
{
  auto& [axis, position, first, last, value, amplitude, friction, side, deck_line] = x;
  io_fields<GridBc>(f, axis, position, first, last, value, amplitude, friction, side, deck_line);
}

inline void io(Archive& f, ContactSide& x)
{
  auto& [surface, elset, body, elem] = x;
  io_fields<ContactSide>(f, surface, elset, body, elem);
}

inline void io(Archive& f, ContactRule& x)
{
  auto& [a, b, friction, stick, penalty] = x;
  io_fields<ContactRule>(f, a, b, friction, stick, penalty);
}

inline void io(Archive& f, ContactDef& x)
{
  auto& [master, friction, overlap, adjust, by_face, stick, general, present, stiff, include, exclude,
         property] = x;
  io_fields<ContactDef>(f, master, friction, overlap, adjust, by_face, stick, general, present, stiff,
                        include, exclude, property);
}

inline void io(Archive& f, BondDef& x)
{
  auto& [name, kind, surface, body, intermediate, penalty, alpha, normal_only, direction, motion, amplitude,
         augment, contact, deck_line] = x;
  io_fields<BondDef>(f, name, kind, surface, body, intermediate, penalty, alpha, normal_only, direction,
                     motion, amplitude, augment, contact, deck_line);
}

inline void io(Archive& f, InitialValue& x)
{
  auto& [displacement, node, body, dof, value, deck_line] = x;
  io_fields<InitialValue>(f, displacement, node, body, dof, value, deck_line);
}

inline void io(Archive& f, InitialStress& x)
{
  auto& [elem, body, point, value, deck_line] = x;
  io_fields<InitialStress>(f, elem, body, point, value, deck_line);
}

inline void io(Archive& f, ModelChange& x)
{
  auto& [elem, add, deck_line] = x;
  io_fields<ModelChange>(f, elem, add, deck_line);
}

inline void io(Archive& f, Member& x)
{
  auto& [elem, at] = x;
  io_fields<Member>(f, elem, at);
}

inline void io(Archive& f, FractureDef& x)
{
  auto& [elset, body, criterion, estimate, drive, residual, friction, order, gc, weibull, seed, epsilon,
         spacing, interval, stiffness, release, average, tolerance, fallback, start, ft, softening, track,
         member, deck_line] = x;
  io_fields<FractureDef>(f, elset, body, criterion, estimate, drive, residual, friction, order, gc, weibull,
                         seed, epsilon, spacing, interval, stiffness, release, average, tolerance, fallback,
                         start, ft, softening, track, member, deck_line);
}

inline void io(Archive& f, ConversionDef& x)
{
  auto& [elset, trigger, limit, per_elem, field, release, bonded, bond, body_name, elem, body, bond_of,
         deck_line] = x;
  io_fields<ConversionDef>(f, elset, trigger, limit, per_elem, field, release, bonded, bond, body_name, elem,
                           body, bond_of, deck_line);
}

inline void io(Archive& f, EquationTerm& x)
{
  auto& [node, dof, coef] = x;
  io_fields<EquationTerm>(f, node, dof, coef);
}

inline void io(Archive& f, Equation& x)
{
  auto& [term, deck_line, of] = x;
  io_fields<Equation>(f, term, deck_line, of);
}

inline void io(Archive& f, RigidBody& x)
{
  auto& [node, ref, turn, deck_line] = x;
  io_fields<RigidBody>(f, node, ref, turn, deck_line);
}

inline void io(Archive& f, Frame& x)
{
  auto& [node, twin, equation, axis, deck_line] = x;
  io_fields<Frame>(f, node, twin, equation, axis, deck_line);
}

inline void io(Archive& f, BrokenDef& x)
{
  auto& [elem, remove, normal, deck_line] = x;
  io_fields<BrokenDef>(f, elem, remove, normal, deck_line);
}

inline void io(Archive& f, Load& x)
{
  auto& [kind, keyword, key, node, face, surface, except, only, elem, body, per_mass, dof, dir, value,
         amplitude, factor, of_position, ramp, hold, deck_line] = x;
  io_fields<Load>(f, kind, keyword, key, node, face, surface, except, only, elem, body, per_mass, dof, dir,
                  value, amplitude, factor, of_position, ramp, hold, deck_line);
}

inline void io(Archive& f, Prescribed& x)
{
  auto& [node, first, last, value, velocity, amplitude, factor, ramp, deck_line] = x;
  io_fields<Prescribed>(f, node, first, last, value, velocity, amplitude, factor, ramp, deck_line);
}

inline void io(Archive& f, Controls& x)
{
  auto& [tol_force, tol_energy, max_iter, max_cut, line_search] = x;
  io_fields<Controls>(f, tol_force, tol_energy, max_iter, max_cut, line_search);
}

inline void io(Archive& f, PrintRequest& x)
{
  auto& [element, set, what, frequency, totals, global, only] = x;
  io_fields<PrintRequest>(f, element, set, what, frequency, totals, global, only);
}

inline void io(Archive& f, ArcControl& x)
{
  auto& [on, nset, direction, end] = x;
  io_fields<ArcControl>(f, on, nset, direction, end);
}

inline void io(Archive& f, Step& x)
{
  auto& [nlgeom, proc, period, dt, dt_min, dt_max, direct, arc, half_force, half_part, max_inc, scheme,
         scheme_given, beta, gamma, dissipation, alpha, safety, bulk_linear, bulk_quadratic, balance,
         extrapolate, ctl, load, prescribed, print, equation, change, deck_line, hash] = x;
  io_fields<Step>(f, nlgeom, proc, period, dt, dt_min, dt_max, direct, arc, half_force, half_part, max_inc,
                  scheme, scheme_given, beta, gamma, dissipation, alpha, safety, bulk_linear,
                  bulk_quadratic, balance, extrapolate, ctl, load, prescribed, print, equation, change,
                  deck_line, hash);
}

inline void io(Archive& f, HistoryDef& x)
{
  auto& [name, what, reduce, nset, elset, body, grid_bc, contact, at_point, X, deck_line] = x;
  io_fields<HistoryDef>(f, name, what, reduce, nset, elset, body, grid_bc, contact, at_point, X, deck_line);
}

inline void io(Archive& f, VtkDef& x)
{
  auto& [on, ascii, xml, frequency, interval] = x;
  io_fields<VtkDef>(f, on, ascii, xml, frequency, interval);
}

inline void io(Archive& f, FragmentsDef& x)
{
  auto& [on, frequency, interval, deck_line] = x;
  io_fields<FragmentsDef>(f, on, frequency, interval, deck_line);
}

inline void io(Archive& f, RestartDef& x)
{
  auto& [read, write, overlay, frequency, interval] = x;
  io_fields<RestartDef>(f, read, write, overlay, frequency, interval);
}

inline void io(Archive& f, Check& x)
{
  auto& [name, kind, column, what, exact, centre, scale, at, time, target, tolerance, source, deck_line] = x;
  io_fields<Check>(f, name, kind, column, what, exact, centre, scale, at, time, target, tolerance, source,
                   deck_line);
}

inline void io(Archive& f, SolverDef& x)
{
  auto& [kind, precond, reuse] = x;
  io_fields<SolverDef>(f, kind, precond, reuse);
}

inline void io(Archive& f, HistoryOutput& x)
{
  auto& [frequency] = x;
  io_fields<HistoryOutput>(f, frequency);
}

inline void io(Archive& f, OutputRequests& x)
{
  auto& [history, history_at, vtk, fragments, restart, check] = x;
  io_fields<OutputRequests>(f, history, history_at, vtk, fragments, restart, check);
}

inline void io(Archive& f, DeckNotes& x)
{
  auto& [heading, passed, tied, param] = x;
  io_fields<DeckNotes>(f, heading, passed, tied, param);
}

inline void io(Archive& f, Model& x)
{
  auto& [job, out_dir, deck, notes, dim, mesh, part, nset, elset, surface, material, section, amplitude,
         body, grid, grid_bc, viscous, bond, initial, initial_stress, fracture, conversion, broken, equation,
         frame, rigid, step, output, solver, hash] = x;
  io_fields<Model>(f, job, out_dir, deck, notes, dim, mesh, part, nset, elset, surface, material, section,
                   amplitude, body, grid, grid_bc, viscous, bond, initial, initial_stress, fracture,
                   conversion, broken, equation, frame, rigid, step, output, solver, hash);
}

#endif
