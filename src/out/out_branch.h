// ---------------------------------------------------------------------------
// out_branch.h : earlier results for a run that continues from a restart file
//
// Tables and frames are in the folder of the results, or in that of the restart file: then the run branches
// off into another folder or name, and they are copied. A warning names those found in neither folder.
// ---------------------------------------------------------------------------
#ifndef MPFE_OUT_BRANCH_H
#define MPFE_OUT_BRANCH_H

#include "out/out.h"

// branch_table : continues a table after the lines written before the restart file
//   in   ending  of its name: "dat"
//        length  of these lines in bytes, -1: there was no table yet
//   out  file    open after these lines; null: begins anew
void branch_table(const Model& m, const Output& out, const char* ending, long length, std::FILE*& file);

// branch_frames : copies frames of the series to the folder of the results; missing ones leave the series
void branch_frames(const Model& m, Output& out);

#endif
