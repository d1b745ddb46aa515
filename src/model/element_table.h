// ---------------------------------------------------------------------------
// element_table.h : the element types, their nodes and faces
//
// Names, node order and face numbers are those of Abaqus and CalculiX.
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_ELEMENT_TABLE_H
#define MPFE_MODEL_ELEMENT_TABLE_H

#include <string>

enum Shape { SHAPE_TRI3, SHAPE_QUAD4, SHAPE_TET4, SHAPE_WEDGE6, SHAPE_HEX8 };
enum Plane { PLANE_STRAIN, PLANE_STRESS, PLANE_NONE };   // PLANE_NONE: three dimensions

struct ShapeInfo {
  int dim;            // 2 or 3
  int nen;            // nodes
  int ngp;            // Gauss points of the full rule
  int nface;          // edges in 2D, faces in 3D
  int nfnode[6];      // nodes of each face
  int face[6][4];     // local nodes of each face; outward by the right-hand rule, in 2D counter-clockwise
  int vtk;            // cell type of legacy VTK
};

struct ElemType {
  const char* name;
  Shape shape;
  Plane plane;
  // enhanced strains against locking in bending (doc/theory.md 1, enhanced strains)
  bool enhanced;
};

enum { ELEM_CPE3, ELEM_CPS3, ELEM_CPE4, ELEM_CPS4, ELEM_C3D4, ELEM_C3D6, ELEM_C3D8,
       ELEM_CPE4I, ELEM_CPS4I, ELEM_C3D8I, ELEM_TYPES };

extern const ShapeInfo shape_info[5];
extern const ElemType elem_table[ELEM_TYPES];

// elem_type_find : index into elem_table, -1 when the name (upper case) is unknown
int elem_type_find(const std::string& name);

#endif
