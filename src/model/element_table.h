// ---------------------------------------------------------------------------
// element_table.h : the element types, their nodes and faces
//
// Names, node order and face numbers are those of Abaqus and CalculiX.
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_ELEMENT_TABLE_H
#define MPFE_MODEL_ELEMENT_TABLE_H

#include <string>

// The quadratic shapes have a node on each edge; R: reduced integration
enum Shape {
  SHAPE_TRI3, SHAPE_QUAD4, SHAPE_TET4, SHAPE_WEDGE6, SHAPE_HEX8,
  SHAPE_TRI6, SHAPE_QUAD8, SHAPE_QUAD8R, SHAPE_TET10, SHAPE_WEDGE15, SHAPE_HEX20,
  SHAPE_HEX20R
};
const int SHAPES = SHAPE_HEX20R + 1;
const int MAX_NODES = 20, MAX_GAUSS = 27, MAX_FACE_NODES = 8;      // of an element, of a face
enum Plane { PLANE_STRAIN, PLANE_STRESS, PLANE_NONE };   // PLANE_NONE: three dimensions

struct ShapeInfo {
  int dim;            // 2 or 3
  int nen;            // nodes
  int ngp;            // Gauss points of the stiffness
  int nface;          // edges in 2D, faces in 3D
  int nfnode[6];      // nodes of each face
  // local nodes of each face; outward by the right-hand rule, in 2D counter-clockwise; corners, then middles
  int face[6][MAX_FACE_NODES];
  int vtk;            // cell type of legacy VTK
  Shape linear;       // the shape of its corners, which are its first nodes
};

struct ElemType {
  const char* name;
  Shape shape;
  Plane plane;
  // enhanced strains against locking in bending (doc/theory.md 1, enhanced strains)
  bool enhanced;
};

enum { ELEM_CPE3, ELEM_CPS3, ELEM_CPE4, ELEM_CPS4, ELEM_C3D4, ELEM_C3D6, ELEM_C3D8,
       ELEM_CPE4I, ELEM_CPS4I, ELEM_C3D8I, ELEM_CPE6, ELEM_CPS6, ELEM_CPE8, ELEM_CPS8, ELEM_CPE8R,
       ELEM_CPS8R, ELEM_C3D10, ELEM_C3D15, ELEM_C3D20, ELEM_C3D20R, ELEM_TYPES };

extern const ShapeInfo shape_info[SHAPES];
extern const ElemType elem_table[ELEM_TYPES];

inline bool shape_quadratic(Shape s) { return shape_info[s].linear != s; }
inline bool elem_quadratic(int type) { return shape_quadratic(elem_table[type].shape); }

// face_corners : corners of a face, which are its first nodes
inline int face_corners(const ShapeInfo& s, int face) { return shape_info[s.linear].nfnode[face]; }

// shape_edge : the two corners that node a of a quadratic shape lies between
void shape_edge(Shape s, int a, int corner[2]);

// elem_type_find : index into elem_table, -1 when the name (upper case) is unknown
int elem_type_find(const std::string& name);

#endif
