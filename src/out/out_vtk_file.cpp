#include "out/out_vtk_file.h"

#include <cfloat>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "out/out.h"

namespace {

void append_bytes(std::string& bytes, const void* value, int size)
{
  const char* b = static_cast<const char*>(value);
  const std::uint16_t probe = 1;
  const bool little = *reinterpret_cast<const unsigned char*>(&probe) == 1;
  for (int i = 0; i < size; ++i) bytes += little ? b[size - 1 - i] : b[i];
}

// readers stumble over denormal numbers in text
float single_of(double value)
{
  return std::fabs(value) < FLT_MIN ? 0.0f : static_cast<float>(value);
}

// numbers of one block, [n] values, `row` of them in a line of an ASCII file
void put_reals(VtkFile& f, const RealVec& value, int row, bool as_double)
{
  std::string bytes;
  for (std::size_t i = 0; i < value.size(); ++i) {
    const float single = single_of(value[i]);
    if (f.ascii)
      std::fprintf(f.file, as_double ? "%.16g%c" : "%.8g%c", as_double ? value[i] : single,
                   (i + 1) % row == 0 ? '\n' : ' ');
    else if (as_double)
      append_bytes(bytes, &value[i], 8);
    else
      append_bytes(bytes, &single, 4);
  }
  if (!f.ascii) std::fwrite(bytes.data(), 1, bytes.size(), f.file);
  if (!f.ascii) std::fputc('\n', f.file);
}

void put_ints(VtkFile& f, const IntVec& value)
{
  std::string bytes;
  for (int v : value) {
    if (f.ascii)
      std::fprintf(f.file, "%d\n", v);
    else
      append_bytes(bytes, &v, 4);
  }
  if (!f.ascii) std::fwrite(bytes.data(), 1, bytes.size(), f.file);
  if (!f.ascii) std::fputc('\n', f.file);
}

RealVec padded(const RealVec& x, int dim)
{
  if (dim == 3) return x;
  RealVec out;
  out.reserve(x.size() / 2 * 3);
  for (std::size_t i = 0; i + 1 < x.size(); i += 2) out.insert(out.end(), {x[i], x[i + 1], 0.0});
  return out;
}

}  // namespace

void vtk_open(VtkFile& f, const std::string& path, const std::string& title, double time, bool ascii)
{
  f.path  = path;
  f.ascii = ascii;
  f.file  = out_file_open(path);
  std::fprintf(f.file, "# vtk DataFile Version 3.0\n%.200s\n%s\nDATASET UNSTRUCTURED_GRID\n",
               title.c_str(), ascii ? "ASCII" : "BINARY");
  std::fprintf(f.file, "FIELD FieldData 1\nTIME 1 1 double\n");
  put_reals(f, {time}, 1, true);
}

void vtk_close(VtkFile& f) { out_file_close(f.file, f.path); }

void vtk_points(VtkFile& f, const RealVec& x, int dim)
{
  std::fprintf(f.file, "POINTS %zu double\n", x.size() / dim);
  put_reals(f, padded(x, dim), 3, true);
}

void vtk_cells(VtkFile& f, const ListTable& conn, const IntVec& type)
{
  std::fprintf(f.file, "CELLS %d %zu\n", conn.size(), conn.item.size() + conn.size());
  IntVec list;
  for (int c = 0; c < conn.size(); ++c) {
    list.push_back(conn.count(c));
    list.insert(list.end(), conn.begin(c), conn.begin(c) + conn.count(c));
  }
  put_ints(f, list);
  std::fprintf(f.file, "CELL_TYPES %d\n", conn.size());
  put_ints(f, type);
}

void vtk_point_data(VtkFile& f, int n) { std::fprintf(f.file, "POINT_DATA %d\n", n); }
void vtk_cell_data(VtkFile& f, int n) { std::fprintf(f.file, "CELL_DATA %d\n", n); }

void vtk_scalars(VtkFile& f, const char* name, const RealVec& value)
{
  std::fprintf(f.file, "SCALARS %s float 1\nLOOKUP_TABLE default\n", name);
  put_reals(f, value, 1, false);
}

void vtk_labels(VtkFile& f, const char* name, const IntVec& value)
{
  std::fprintf(f.file, "SCALARS %s int 1\nLOOKUP_TABLE default\n", name);
  put_ints(f, value);
}

void vtk_vectors(VtkFile& f, const char* name, const RealVec& value, int dim)
{
  std::fprintf(f.file, "VECTORS %s float\n", name);
  put_reals(f, padded(value, dim), 3, false);
}
