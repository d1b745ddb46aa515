// ---------------------------------------------------------------------------
// element_table.h : the element types, their nodes and faces
//
// Names, node order and face numbers are those of Abaqus and CalculiX.
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_ELEMENT_TABLE_H
#define MPFE_MODEL_ELEMENT_TABLE_H

#include <string>

// The quadratic shapes, after the linear ones, have a node on each edge; R: reduced integration
enum Shape {
  SHAPE_TRI3, SHAPE_QUAD4, SHAPE_TET4, SHAPE_WEDGE6, SHAPE_HEX8, SHAPE_PYR5,
  SHAPE_TRI6, SHAPE_QUAD8, SHAPE_QUAD8R, SHAPE_TET10, SHAPE_WEDGE15, SHAPE_HEX20, SHAPE_HEX20R,
  SHAPES
};
const int MAX_NODES = 20, MAX_GAUSS = 27, MAX_FACE_NODES = 8;      // of an element, of a face
const int MAX_CORNERS = 8;                                         // of a linear shape
enum Plane { PLANE_STRAIN, PLANE_STRESS, PLANE_NONE };   // PLANE_NONE: three dimensions

struct ShapeInfo {
  Shape shape;        // the row is of this one
  int dim;            // 2 or 3
  int nen;            // nodes
  int ngp;            // Gauss points of the stiffness
  int nface;          // edges in 2D, faces in 3D
  int nfnode[6];      // nodes of each face
  // local nodes of each face; outward by the right-hand rule, in 2D counter-clockwise; corners, then mid-edge
  int face[6][MAX_FACE_NODES];
  int vtk;            // cell type of legacy VTK
  Shape linear;       // the shape of its corners, which are its first nodes
  // linear shapes alone:
  int cube_parts = 0; // number that fills a square or a cube of the element size              (7.2)
  int around = 0;     // elements around an inner node
  // end nodes of the three edges of each corner (plane: two), right-handed; node order of the mirrored shape
  int edge[MAX_CORNERS][3] = {}, mirror[MAX_CORNERS] = {};
};

struct ElemType {
  int type;           // ELEM_..., the row is of this one
  const char* name;
  Shape shape;
  Plane plane;
  // enhanced strains against locking in bending (doc/theory.md 1, enhanced strains)
  bool enhanced;
};

enum { ELEM_CPE3, ELEM_CPS3, ELEM_CPE4, ELEM_CPS4, ELEM_C3D4, ELEM_C3D5, ELEM_C3D6, ELEM_C3D8,
       ELEM_CPE4I, ELEM_CPS4I, ELEM_C3D8I, ELEM_CPE6, ELEM_CPS6, ELEM_CPE8, ELEM_CPS8, ELEM_CPE8R,
       ELEM_CPS8R, ELEM_C3D10, ELEM_C3D15, ELEM_C3D20, ELEM_C3D20R, ELEM_TYPES };

inline constexpr ShapeInfo shape_info[] = {
  // shape dim nen ngp nface nfnode face (local nodes) vtk linear cube_parts around edge mirror
  {SHAPE_TRI3, 2, 3, 1, 3, {2, 2, 2, 0, 0, 0}, {{0, 1}, {1, 2}, {2, 0}}, 5, SHAPE_TRI3, 2, 5,
   {{1, 2}, {2, 0}, {0, 1}}, {0, 2, 1}},
  {SHAPE_QUAD4, 2, 4, 4, 4, {2, 2, 2, 2, 0, 0}, {{0, 1}, {1, 2}, {2, 3}, {3, 0}}, 9, SHAPE_QUAD4, 1, 4,
   {{1, 3}, {2, 0}, {3, 1}, {0, 2}}, {0, 3, 2, 1}},
  {SHAPE_TET4, 3, 4, 1, 4, {3, 3, 3, 3, 0, 0}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}, 10, SHAPE_TET4,
   6, 18, {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}, {0, 2, 1, 3}},
  {SHAPE_WEDGE6, 3, 6, 6, 5, {3, 3, 4, 4, 4, 0},
   {{0, 2, 1}, {3, 4, 5}, {0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}}, 13, SHAPE_WEDGE6, 2, 9,
   {{1, 2, 3}, {2, 0, 4}, {0, 1, 5}, {5, 4, 0}, {3, 5, 1}, {4, 3, 2}}, {3, 4, 5, 0, 1, 2}},
  {SHAPE_HEX8, 3, 8, 8, 6, {4, 4, 4, 4, 4, 4},
   {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}, 12, SHAPE_HEX8, 1,
   8, {{1, 3, 4}, {2, 0, 5}, {3, 1, 6}, {0, 2, 7}, {7, 5, 0}, {4, 6, 1}, {5, 7, 2}, {6, 4, 3}},
   {4, 5, 6, 7, 0, 1, 2, 3}},
  {SHAPE_PYR5, 3, 5, 4, 5, {4, 3, 3, 3, 3, 0},
   {{0, 3, 2, 1}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}}, 14, SHAPE_PYR5, 6, 13,
   {{1, 3, 4}, {2, 0, 4}, {3, 1, 4}, {0, 2, 4}, {1, 0, 2}}, {0, 3, 2, 1, 4}},
  {SHAPE_TRI6, 2, 6, 3, 3, {3, 3, 3, 0, 0, 0}, {{0, 1, 3}, {1, 2, 4}, {2, 0, 5}}, 22, SHAPE_TRI3},
  {SHAPE_QUAD8, 2, 8, 9, 4, {3, 3, 3, 3, 0, 0}, {{0, 1, 4}, {1, 2, 5}, {2, 3, 6}, {3, 0, 7}}, 23,
   SHAPE_QUAD4},
  {SHAPE_QUAD8R, 2, 8, 4, 4, {3, 3, 3, 3, 0, 0}, {{0, 1, 4}, {1, 2, 5}, {2, 3, 6}, {3, 0, 7}}, 23,
   SHAPE_QUAD4},
  {SHAPE_TET10, 3, 10, 4, 4, {6, 6, 6, 6, 0, 0},
   {{0, 2, 1, 6, 5, 4}, {0, 1, 3, 4, 8, 7}, {1, 2, 3, 5, 9, 8}, {0, 3, 2, 7, 9, 6}}, 24, SHAPE_TET4},
  {SHAPE_WEDGE15, 3, 15, 9, 5, {6, 6, 8, 8, 8, 0},
   {{0, 2, 1, 8, 7, 6}, {3, 4, 5, 9, 10, 11}, {0, 1, 4, 3, 6, 13, 9, 12}, {1, 2, 5, 4, 7, 14, 10, 13},
    {2, 0, 3, 5, 8, 12, 11, 14}}, 26, SHAPE_WEDGE6},
  {SHAPE_HEX20, 3, 20, 27, 6, {8, 8, 8, 8, 8, 8},
   {{0, 3, 2, 1, 11, 10, 9, 8}, {4, 5, 6, 7, 12, 13, 14, 15}, {0, 1, 5, 4, 8, 17, 12, 16},
    {1, 2, 6, 5, 9, 18, 13, 17}, {2, 3, 7, 6, 10, 19, 14, 18}, {3, 0, 4, 7, 11, 16, 15, 19}},
   25, SHAPE_HEX8},
  {SHAPE_HEX20R, 3, 20, 8, 6, {8, 8, 8, 8, 8, 8},
   {{0, 3, 2, 1, 11, 10, 9, 8}, {4, 5, 6, 7, 12, 13, 14, 15}, {0, 1, 5, 4, 8, 17, 12, 16},
    {1, 2, 6, 5, 9, 18, 13, 17}, {2, 3, 7, 6, 10, 19, 14, 18}, {3, 0, 4, 7, 11, 16, 15, 19}},
   25, SHAPE_HEX8},
};

inline constexpr ElemType elem_table[] = {
  {ELEM_CPE3, "CPE3", SHAPE_TRI3, PLANE_STRAIN, false},
  {ELEM_CPS3, "CPS3", SHAPE_TRI3, PLANE_STRESS, false},
  {ELEM_CPE4, "CPE4", SHAPE_QUAD4, PLANE_STRAIN, false},
  {ELEM_CPS4, "CPS4", SHAPE_QUAD4, PLANE_STRESS, false},
  {ELEM_C3D4, "C3D4", SHAPE_TET4, PLANE_NONE, false},
  {ELEM_C3D5, "C3D5", SHAPE_PYR5, PLANE_NONE, false},
  {ELEM_C3D6, "C3D6", SHAPE_WEDGE6, PLANE_NONE, false},
  {ELEM_C3D8, "C3D8", SHAPE_HEX8, PLANE_NONE, false},
  {ELEM_CPE4I, "CPE4I", SHAPE_QUAD4, PLANE_STRAIN, true},
  {ELEM_CPS4I, "CPS4I", SHAPE_QUAD4, PLANE_STRESS, true},
  {ELEM_C3D8I, "C3D8I", SHAPE_HEX8, PLANE_NONE, true},
  {ELEM_CPE6, "CPE6", SHAPE_TRI6, PLANE_STRAIN, false},
  {ELEM_CPS6, "CPS6", SHAPE_TRI6, PLANE_STRESS, false},
  {ELEM_CPE8, "CPE8", SHAPE_QUAD8, PLANE_STRAIN, false},
  {ELEM_CPS8, "CPS8", SHAPE_QUAD8, PLANE_STRESS, false},
  {ELEM_CPE8R, "CPE8R", SHAPE_QUAD8R, PLANE_STRAIN, false},
  {ELEM_CPS8R, "CPS8R", SHAPE_QUAD8R, PLANE_STRESS, false},
  {ELEM_C3D10, "C3D10", SHAPE_TET10, PLANE_NONE, false},
  {ELEM_C3D15, "C3D15", SHAPE_WEDGE15, PLANE_NONE, false},
  {ELEM_C3D20, "C3D20", SHAPE_HEX20, PLANE_NONE, false},
  {ELEM_C3D20R, "C3D20R", SHAPE_HEX20R, PLANE_NONE, false},
};

// one row each, in the order of the enumerators; linear shapes have all constants
constexpr bool shape_rows_fit()
{
  for (int k = 0; k < SHAPES; ++k) {
    const ShapeInfo& s = shape_info[k];
    if (s.shape != k || s.nen > MAX_NODES || s.ngp > MAX_GAUSS) return false;
    const bool all = s.cube_parts > 0 && s.around > 0 && s.mirror[0] != s.mirror[1];
    if (s.linear == k && (s.nen > MAX_CORNERS || !all)) return false;
  }
  return true;
}
constexpr bool elem_rows_fit()
{
  for (int k = 0; k < ELEM_TYPES; ++k)
    if (elem_table[k].type != k) return false;
  return true;
}
static_assert(sizeof shape_info / sizeof *shape_info == SHAPES, "shape_info: a shape has no row");
static_assert(sizeof elem_table / sizeof *elem_table == ELEM_TYPES, "elem_table: a type has no row");
static_assert(shape_rows_fit(), "shape_info: a row in the wrong order, or without all constants");
static_assert(elem_rows_fit(), "elem_table: a row in the wrong order");

inline bool shape_quadratic(Shape s) { return shape_info[s].linear != s; }
inline bool elem_quadratic(int type) { return shape_quadratic(elem_table[type].shape); }

// face_corners : corners of a face, which are its first nodes
inline int face_corners(const ShapeInfo& s, int face) { return shape_info[s.linear].nfnode[face]; }

// shape_edge : the two corners next to mid-edge node a of a quadratic shape
void shape_edge(Shape s, int a, int corner[2]);

// elem_type_find : index into elem_table, -1 when the name (upper case) is unknown
int elem_type_find(const std::string& name);

#endif
