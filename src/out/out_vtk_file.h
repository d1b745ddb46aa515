// ---------------------------------------------------------------------------
// out_vtk_file.h : one VTK file, an unstructured grid: legacy (version 3.0), or XML (.vtu)
//
// Order of the calls: open, mesh, then point_data and cell_data, each followed by its scalars, labels and
// vectors; close. Numbers are written in parts, without a copy of the array.
// ---------------------------------------------------------------------------
#ifndef MPFE_OUT_OUT_VTK_FILE_H
#define MPFE_OUT_OUT_VTK_FILE_H

#include <cstdio>
#include <string>

#include "base/types.h"

enum VtkFormat { VTK_BINARY, VTK_ASCII, VTK_XML };     // legacy, legacy as text, .vtu

struct VtkFile {
  std::FILE* file = nullptr;
  std::string path;
  VtkFormat format = VTK_BINARY;       // legacy binary is big-endian, as the format requires
  const char* section = "";    // XML: PointData or CellData, open
  std::string fields[2];       // XML: declarations of the arrays of points and of cells for a .pvtu
};

// vtk_open : header and the time as field data; stops the program with EXIT_RESOURCE if it cannot write
void vtk_open(VtkFile& f, const std::string& path, const std::string& title, double time,
              VtkFormat format);
void vtk_close(VtkFile& f);

// vtk_parallel : a .pvtu, the frame that consists of the files piece; they have the arrays of f, one of them,
// which is already closed
void vtk_parallel(const VtkFile& f, const std::string& path, const std::vector<std::string>& piece);

// vtk_mesh : positions x [n*dim], in 2D the third coordinate is 0; cells conn on these, type [conn.size()]:
// their VTK cell types
void vtk_mesh(VtkFile& f, const RealVec& x, int dim, const ListTable& conn, const IntVec& type);

void vtk_point_data(VtkFile& f, int n);
void vtk_cell_data(VtkFile& f, int n);
void vtk_scalars(VtkFile& f, const char* name, const RealVec& value);            // [n]
void vtk_labels(VtkFile& f, const char* name, const IntVec& value);              // [n]
void vtk_vectors(VtkFile& f, const char* name, const RealVec& value, int dim);   // [n*dim]

#endif
