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
    if (f.format == VTK_ASCII)
      std::fprintf(f.file, as_double ? "%.16g%c" : "%.8g%c", as_double ? value[i] : single,
                   (i + 1) % row == 0 ? '\n' : ' ');
    else if (as_double)
      append_bytes(bytes, &value[i], 8);
    else
      append_bytes(bytes, &single, 4);
  }
  if (f.format == VTK_ASCII) return;
  std::fwrite(bytes.data(), 1, bytes.size(), f.file);
  std::fputc('\n', f.file);
}

void put_ints(VtkFile& f, const IntVec& value)
{
  std::string bytes;
  for (int v : value) {
    if (f.format == VTK_ASCII)
      std::fprintf(f.file, "%d\n", v);
    else
      append_bytes(bytes, &v, 4);
  }
  if (f.format == VTK_ASCII) return;
  std::fwrite(bytes.data(), 1, bytes.size(), f.file);
  std::fputc('\n', f.file);
}

RealVec padded(const RealVec& x, int dim)
{
  if (dim == 3) return x;
  RealVec out;
  out.reserve(x.size() / 2 * 3);
  for (std::size_t i = 0; i + 1 < x.size(); i += 2) out.insert(out.end(), {x[i], x[i + 1], 0.0});
  return out;
}

// ---- XML: arrays in base64, a length in 8 bytes in front ------------------------

bool is_little()
{
  const std::uint16_t probe = 1;
  return *reinterpret_cast<const unsigned char*>(&probe) == 1;
}

void put_base64(std::FILE* file, const std::string& bytes)
{
  const char* const letter = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve(bytes.size() / 3 * 4 + 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned three = 0;
    for (std::size_t k = i; k < i + 3; ++k)
      three = three << 8 | (k < bytes.size() ? static_cast<unsigned char>(bytes[k]) : 0u);
    for (int k = 0; k < 4; ++k)
      text += i + k > bytes.size() ? '=' : letter[three >> (18 - 6 * k) & 63];
  }
  std::fwrite(text.data(), 1, text.size(), file);
}

template <class Number>
void put_array(VtkFile& f, const char* type, const char* name, int components,
               const std::vector<Number>& value)
{
  const std::uint64_t size = value.size() * sizeof(Number);
  std::string bytes(reinterpret_cast<const char*>(&size), sizeof size);
  bytes.append(reinterpret_cast<const char*>(value.data()), size);
  const std::string what = "DataArray type=\"" + std::string(type) + "\" Name=\"" + name + "\"" +
      (components > 1 ? " NumberOfComponents=\"" + std::to_string(components) + "\"" : std::string());
  if (*f.section) f.fields[f.section[0] == 'C'] += "<P" + what + "/>\n";
  std::fprintf(f.file, "<%s format=\"binary\">\n", what.c_str());
  put_base64(f.file, bytes);
  std::fputs("\n</DataArray>\n", f.file);
}

std::vector<float> singles(const RealVec& value)
{
  std::vector<float> out;
  for (double v : value) out.push_back(single_of(v));
  return out;
}

void open_section(VtkFile& f, const char* section)
{
  if (*f.section) std::fprintf(f.file, "</%s>\n", f.section);
  if (*section) std::fprintf(f.file, "<%s>\n", section);
  f.section = section;
}

// the type stands twice: UnstructuredGrid, PUnstructuredGrid
void put_head(std::FILE* file, const char* type, const char* more)
{
  std::fprintf(file,
               "<?xml version=\"1.0\"?>\n<VTKFile type=\"%s\" version=\"1.0\" "
               "byte_order=\"%s\" header_type=\"UInt64\">\n<%s%s>\n",
               type, is_little() ? "LittleEndian" : "BigEndian", type, more);
}

void open_xml(VtkFile& f, double time)
{
  put_head(f.file, "UnstructuredGrid", "");
  std::fprintf(f.file, "<FieldData>\n<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" "
               "format=\"ascii\">\n%.16g\n</DataArray>\n</FieldData>\n", time);
}

void put_mesh(VtkFile& f, const ListTable& conn, const IntVec& type)
{
  std::fprintf(f.file, "<Piece NumberOfPoints=\"%zu\" NumberOfCells=\"%d\">\n<Points>\n", f.x.size() / 3,
               conn.size());
  put_array(f, "Float64", "Points", 3, f.x);
  std::fputs("</Points>\n<Cells>\n", f.file);
  put_array(f, "Int32", "connectivity", 1, conn.item);
  put_array(f, "Int32", "offsets", 1, IntVec(conn.off.begin() + 1, conn.off.end()));
  put_array(f, "UInt8", "types", 1, std::vector<std::uint8_t>(type.begin(), type.end()));
  std::fputs("</Cells>\n", f.file);
}

}  // namespace

void vtk_open(VtkFile& f, const std::string& path, const std::string& title, double time, VtkFormat format)
{
  f.path   = path;
  f.format = format;
  f.file   = out_file_open(path);
  if (format == VTK_XML) return open_xml(f, time);
  std::fprintf(f.file, "# vtk DataFile Version 3.0\n%.200s\n%s\nDATASET UNSTRUCTURED_GRID\n",
               title.c_str(), format == VTK_ASCII ? "ASCII" : "BINARY");
  std::fprintf(f.file, "FIELD FieldData 1\nTIME 1 1 double\n");
  put_reals(f, {time}, 1, true);
}

void vtk_close(VtkFile& f)
{
  if (f.format == VTK_XML) {
    open_section(f, "");
    std::fputs("</Piece>\n</UnstructuredGrid>\n</VTKFile>\n", f.file);
  }
  out_file_close(f.file, f.path);
}

void vtk_parallel(const VtkFile& f, const std::string& path, const std::vector<std::string>& piece)
{
  std::FILE* file = out_file_open(path);
  put_head(file, "PUnstructuredGrid", " GhostLevel=\"0\"");
  std::fprintf(file, "<PPointData>\n%s</PPointData>\n<PCellData>\n%s</PCellData>\n", f.fields[0].c_str(),
               f.fields[1].c_str());
  std::fputs("<PPoints>\n<PDataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\"/>\n"
             "</PPoints>\n", file);
  for (const std::string& name : piece) std::fprintf(file, "<Piece Source=\"%s\"/>\n", name.c_str());
  std::fputs("</PUnstructuredGrid>\n</VTKFile>\n", file);
  out_file_close(file, path);
}

void vtk_points(VtkFile& f, const RealVec& x, int dim)
{
  if (f.format == VTK_XML) {
    f.x = padded(x, dim);
    return;
  }
  std::fprintf(f.file, "POINTS %zu double\n", x.size() / dim);
  put_reals(f, padded(x, dim), 3, true);
}

void vtk_cells(VtkFile& f, const ListTable& conn, const IntVec& type)
{
  if (f.format == VTK_XML) return put_mesh(f, conn, type);
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

void vtk_point_data(VtkFile& f, int n)
{
  if (f.format == VTK_XML) return open_section(f, "PointData");
  std::fprintf(f.file, "POINT_DATA %d\n", n);
}

void vtk_cell_data(VtkFile& f, int n)
{
  if (f.format == VTK_XML) return open_section(f, "CellData");
  std::fprintf(f.file, "CELL_DATA %d\n", n);
}

void vtk_scalars(VtkFile& f, const char* name, const RealVec& value)
{
  if (f.format == VTK_XML) return put_array(f, "Float32", name, 1, singles(value));
  std::fprintf(f.file, "SCALARS %s float 1\nLOOKUP_TABLE default\n", name);
  put_reals(f, value, 1, false);
}

void vtk_labels(VtkFile& f, const char* name, const IntVec& value)
{
  if (f.format == VTK_XML) return put_array(f, "Int32", name, 1, value);
  std::fprintf(f.file, "SCALARS %s int 1\nLOOKUP_TABLE default\n", name);
  put_ints(f, value);
}

void vtk_vectors(VtkFile& f, const char* name, const RealVec& value, int dim)
{
  if (f.format == VTK_XML) return put_array(f, "Float32", name, 3, singles(padded(value, dim)));
  std::fprintf(f.file, "VECTORS %s float\n", name);
  put_reals(f, padded(value, dim), 3, false);
}
