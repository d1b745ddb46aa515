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

IO_FIELDS(ListTable, off, item)
IO_FIELDS(Halo, common, shared, owner)
IO_FIELDS(DeckLine, file, line)
IO_FIELDS(Mesh, node_label, X, elem_label, elem_type, elem_section, conn)
IO_FIELDS(UncoupledPair, body, other, section, reported)
IO_FIELDS(OriginalPoint, point, rank)
IO_FIELDS(MeshPart, on, points, window, nnode, nelem, node, elem, deck, rank, halo, around, with_points,
          around_points, near_point, notch, joined, tied, uncoupled, skin)
IO_FIELDS(Set, name, item, deck_line)
IO_FIELDS(Face, elem, face)
IO_FIELDS(Surface, name, face, member, body, where, deck_line)
IO_FIELDS(Material, name, law, young, poisson, density, alpha, beta, elastic, yield, plastic_strain, friction,
          exponent, dilation, gap, hardening, has_elastic, has_damping, used, hyper, breaks, prestressed,
          initial, deck_line)
IO_FIELDS(Section, elset, material, thickness, deck_line, lumped)
IO_FIELDS(Amplitude, name, kind, total_time, t, y, expr, deck_line)
IO_FIELDS(CellRanks, first, rank)
IO_FIELDS(Body, name, fill, lo, hi, cells, per_cell, elset, where, material, plane, thickness, field, reshape,
          hang, fracture, rank, deck_line)
IO_FIELDS(Grid, given, lo, h, n, weak, keep, deck_line, ghost_stiffness, ghost_mass, ghost_place)
IO_FIELDS(ViscousBoundary, surface, a, b, deck_line)
IO_FIELDS(GridBc, axis, position, first, last, value, amplitude, friction, side, deck_line)
IO_FIELDS(ContactSide, surface, elset, body, elem)
IO_FIELDS(ContactRule, a, b, friction, stick, penalty)
IO_FIELDS(ContactDef, master, friction, overlap, adjust, by_face, stick, general, present, stiff, include,
          exclude, property)
IO_FIELDS(BondDef, name, kind, surface, body, intermediate, penalty, alpha, normal_only, direction, motion,
          amplitude, augment, contact, deck_line)
IO_FIELDS(InitialValue, displacement, node, body, dof, value, deck_line)
IO_FIELDS(InitialStress, elem, body, point, value, deck_line)
IO_FIELDS(ModelChange, elem, add, deck_line)
IO_FIELDS(Member, elem, at)
IO_FIELDS(FractureDef, elset, body, criterion, estimate, drive, residual, friction, order, gc, weibull, seed,
          epsilon, spacing, interval, stiffness, release, average, tolerance, fallback, start, ft, softening,
          track, member, deck_line)
IO_FIELDS(ConversionDef, elset, trigger, limit, per_elem, field, release, bonded, bond, body_name, elem, body,
          bond_of, deck_line)
IO_FIELDS(EquationTerm, node, dof, coef)
IO_FIELDS(Equation, term, deck_line, of)
IO_FIELDS(RigidBody, node, ref, turn, deck_line)
IO_FIELDS(Frame, node, twin, equation, axis, deck_line)
IO_FIELDS(BrokenDef, elem, remove, normal, deck_line)
IO_FIELDS(Load, kind, keyword, key, node, face, surface, except, only, elem, body, per_mass, dof, dir, value,
          amplitude, factor, of_position, ramp, hold, deck_line)
IO_FIELDS(Prescribed, node, first, last, value, velocity, amplitude, factor, ramp, deck_line)
IO_FIELDS(Controls, tol_force, tol_energy, max_iter, max_cut, line_search)
IO_FIELDS(PrintRequest, element, set, what, frequency, totals, global, only)
IO_FIELDS(ArcControl, on, nset, direction, end)
IO_FIELDS(Step, nlgeom, proc, period, dt, dt_min, dt_max, direct, arc, half_force, half_part, max_inc, scheme,
          scheme_given, beta, gamma, dissipation, alpha, safety, bulk_linear, bulk_quadratic, balance,
          extrapolate, ctl, load, prescribed, print, equation, change, deck_line, hash)
IO_FIELDS(HistoryDef, name, what, reduce, nset, elset, body, grid_bc, contact, at_point, X, deck_line)
IO_FIELDS(VtkDef, on, ascii, xml, frequency, interval)
IO_FIELDS(FragmentsDef, on, frequency, interval, deck_line)
IO_FIELDS(RestartDef, read, write, overlay, frequency, interval)
IO_FIELDS(Check, name, kind, column, what, exact, centre, scale, at, time, target, tolerance, source,
          deck_line)
IO_FIELDS(SolverDef, kind, precond, reuse)
IO_FIELDS(HistoryOutput, frequency)
IO_FIELDS(OutputRequests, history, history_at, vtk, fragments, restart, check)
IO_FIELDS(DeckNotes, heading, passed, tied, param)
IO_FIELDS(Model, job, out_dir, deck, notes, dim, mesh, part, nset, elset, surface, material, section,
          amplitude, body, grid, grid_bc, viscous, bond, initial, initial_stress, fracture, conversion,
          broken, equation, frame, rigid, step, output, solver, hash)

#endif
