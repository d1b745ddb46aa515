#include "out/out_vtk_file.h"

#include <cfloat>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "out/out.h"

namespace {

bool is_little()
{
  const std::uint16_t probe = 1;
  return *reinterpret_cast<const unsigned char*>(&probe) == 1;
}

void append_bytes(std::string& bytes, const void* value, int size)
{
  const char* b = static_cast<const char*>(value);
  const bool little = is_little();
  for (int i = 0; i < size; ++i) bytes += little ? b[size - 1 - i] : b[i];
}

// readers fail on denormal numbers in text
float single_of(double value)
{
  return std::fabs(value) < FLT_MIN ? 0.0f : static_cast<float>(value);
}

// bytes of the buffer after which it is written; a multiple of 3, for base64  (test: stress/vtk_formats)
const std::size_t PART = 3 << 12;

// writes the buffer to the file when it exceeds its limit
void put_waiting(std::FILE* file, std::string& bytes, std::size_t most)
{
  if (bytes.size() <= most) return;
  std::fwrite(bytes.data(), 1, bytes.size(), file);
  bytes.clear();
}

// Views of arrays without a copy: positions x [n*dim] as three components, and in single precision
struct Padded {
  const RealVec& x;
  int dim;
  std::size_t size() const { return x.size() / dim * 3; }
  double operator[](std::size_t i) const
  {
    const int k = static_cast<int>(i % 3);
    return k < dim ? x[i / 3 * dim + k] : 0.0;
  }
};

template <class List>
struct Singles {
  const List& x;
  std::size_t size() const { return x.size(); }
  float operator[](std::size_t i) const { return single_of(x[i]); }
};

// numbers of one block, [n] values, `row` of them in a line of an ASCII file
template <class List>
void put_reals(VtkFile& f, const List& value, int row, bool as_double)
{
  std::string bytes;
  for (std::size_t i = 0, n = value.size(); i < n; ++i) {
    const double whole = value[i];
    const float single = single_of(whole);
    if (f.format == VTK_ASCII)
      std::fprintf(f.file, as_double ? "%.16g%c" : "%.8g%c", as_double ? whole : single,
                   (i + 1) % row == 0 ? '\n' : ' ');
    else if (as_double)
      append_bytes(bytes, &whole, 8);
    else
      append_bytes(bytes, &single, 4);
    put_waiting(f.file, bytes, PART);
  }
  if (f.format == VTK_ASCII) return;
  bytes += '\n';
  put_waiting(f.file, bytes, 0);
}

void put_int(VtkFile& f, int value, std::string& bytes)
{
  if (f.format == VTK_ASCII) std::fprintf(f.file, "%d\n", value);
  else append_bytes(bytes, &value, 4);
  put_waiting(f.file, bytes, PART);
}

void end_ints(VtkFile& f, std::string& bytes)
{
  if (f.format == VTK_ASCII) return;
  bytes += '\n';
  put_waiting(f.file, bytes, 0);
}

void put_ints(VtkFile& f, const IntVec& value)
{
  std::string bytes;
  for (int v : value) put_int(f, v, bytes);
  end_ints(f, bytes);
}

// ---- XML: arrays in base64, preceded by the length in 8 bytes -------------------

// writes bytes in base64, in groups of three; a remainder is kept until the end
void put_base64(std::FILE* file, std::string& bytes, bool end)
{
  const char* const letter = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const std::size_t size = end ? bytes.size() : bytes.size() / 3 * 3;
  std::string text;
  text.reserve(size / 3 * 4 + 4);
  for (std::size_t i = 0; i < size; i += 3) {
    unsigned three = 0;
    for (std::size_t k = i; k < i + 3; ++k)
      three = three << 8 | (k < size ? static_cast<unsigned char>(bytes[k]) : 0u);
    for (int k = 0; k < 4; ++k) text += i + k > size ? '=' : letter[three >> (18 - 6 * k) & 63];
  }
  std::fwrite(text.data(), 1, text.size(), file);
  bytes.erase(0, size);
}

template <class Number, class List>
void put_array(VtkFile& f, const char* type, const char* name, int components, const List& value)
{
  const std::uint64_t size = value.size() * sizeof(Number);
  const std::string what = "DataArray type=\"" + std::string(type) + "\" Name=\"" + name + "\"" +
      (components > 1 ? " NumberOfComponents=\"" + std::to_string(components) + "\"" : std::string());
  if (*f.section) f.fields[f.section[0] == 'C'] += "<P" + what + "/>\n";
  std::fprintf(f.file, "<%s format=\"binary\">\n", what.c_str());
  std::string bytes(reinterpret_cast<const char*>(&size), sizeof size);
  for (std::size_t i = 0, n = value.size(); i < n; ++i) {
    const Number one = static_cast<Number>(value[i]);
    bytes.append(reinterpret_cast<const char*>(&one), sizeof one);
    if (bytes.size() > PART) put_base64(f.file, bytes, false);
  }
  put_base64(f.file, bytes, true);
  std::fputs("\n</DataArray>\n", f.file);
}

void open_section(VtkFile& f, const char* section)
{
  if (*f.section) std::fprintf(f.file, "</%s>\n", f.section);
  if (*section) std::fprintf(f.file, "<%s>\n", section);
  f.section = section;
}

// the type occurs twice: UnstructuredGrid, PUnstructuredGrid
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

// the ends of the lists of conn
struct Ends {
  const ListTable& conn;
  std::size_t size() const { return conn.off.size() - 1; }
  int operator[](std::size_t i) const { return conn.off[i + 1]; }
};

void put_xml_mesh(VtkFile& f, const Padded& x, const ListTable& conn, const IntVec& type)
{
  std::fprintf(f.file, "<Piece NumberOfPoints=\"%zu\" NumberOfCells=\"%d\">\n<Points>\n", x.size() / 3,
               conn.size());
  put_array<double>(f, "Float64", "Points", 3, x);
  std::fputs("</Points>\n<Cells>\n", f.file);
  put_array<int>(f, "Int32", "connectivity", 1, conn.item);
  put_array<int>(f, "Int32", "offsets", 1, Ends{conn});
  put_array<std::uint8_t>(f, "UInt8", "types", 1, type);
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
  put_reals(f, RealVec{time}, 1, true);
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

void vtk_mesh(VtkFile& f, const RealVec& x, int dim, const ListTable& conn, const IntVec& type)
{
  if (f.format == VTK_XML) return put_xml_mesh(f, {x, dim}, conn, type);
  std::fprintf(f.file, "POINTS %zu double\n", x.size() / dim);
  put_reals(f, Padded{x, dim}, 3, true);
  std::fprintf(f.file, "CELLS %d %zu\n", conn.size(), conn.item.size() + conn.size());
  std::string bytes;
  for (int c = 0; c < conn.size(); ++c) {
    put_int(f, conn.count(c), bytes);
    for (int k = conn.off[c]; k < conn.off[c + 1]; ++k) put_int(f, conn.item[k], bytes);
  }
  end_ints(f, bytes);
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
  if (f.format == VTK_XML) return put_array<float>(f, "Float32", name, 1, Singles<RealVec>{value});
  std::fprintf(f.file, "SCALARS %s float 1\nLOOKUP_TABLE default\n", name);
  put_reals(f, value, 1, false);
}

void vtk_labels(VtkFile& f, const char* name, const IntVec& value)
{
  if (f.format == VTK_XML) return put_array<int>(f, "Int32", name, 1, value);
  std::fprintf(f.file, "SCALARS %s int 1\nLOOKUP_TABLE default\n", name);
  put_ints(f, value);
}

void vtk_vectors(VtkFile& f, const char* name, const RealVec& value, int dim)
{
  const Padded all{value, dim};
  if (f.format == VTK_XML) return put_array<float>(f, "Float32", name, 3, Singles<Padded>{all});
  std::fprintf(f.file, "VECTORS %s float\n", name);
  put_reals(f, all, 3, false);
}
