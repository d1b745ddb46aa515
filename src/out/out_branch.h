// ---------------------------------------------------------------------------
// out_branch.h : results of the time before a restart file, where a run goes on from it
//
// Tables and frames are in the folder of the results, or beside the restart file: then the run branches off
// into another folder, or under another name, and they are copied. A warning names what is in neither.
// ---------------------------------------------------------------------------
#ifndef MPFE_OUT_BRANCH_H
#define MPFE_OUT_BRANCH_H

#include "out/out.h"

// branch_table : the table goes on behind the lines of the time before the restart file
//   in   ending  of its name: "dat"
//        length  of these lines, -1: there was no table yet
//   out  file    open behind them; null: it begins anew
void branch_table(const Model& m, const Output& out, const char* ending, long length, std::FILE*& file);

// branch_frames : frames of the series come into the folder of the results; those that are nowhere leave it
void branch_frames(const Model& m, Output& out);

#endif
