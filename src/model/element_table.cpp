#include "model/element_table.h"

const ShapeInfo shape_info[SHAPES] = {
  // dim nen ngp nface  nfnode              face (local nodes)                          vtk linear
  {2, 3, 1, 3, {2, 2, 2, 0, 0, 0}, {{0, 1}, {1, 2}, {2, 0}}, 5, SHAPE_TRI3},
  {2, 4, 4, 4, {2, 2, 2, 2, 0, 0}, {{0, 1}, {1, 2}, {2, 3}, {3, 0}}, 9, SHAPE_QUAD4},
  {3, 4, 1, 4, {3, 3, 3, 3, 0, 0}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}, 10, SHAPE_TET4},
  {3, 6, 6, 5, {3, 3, 4, 4, 4, 0}, {{0, 2, 1}, {3, 4, 5}, {0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}}, 13,
   SHAPE_WEDGE6},
  {3, 8, 8, 6, {4, 4, 4, 4, 4, 4},
   {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}, 12, SHAPE_HEX8},
  {2, 6, 3, 3, {3, 3, 3, 0, 0, 0}, {{0, 1, 3}, {1, 2, 4}, {2, 0, 5}}, 22, SHAPE_TRI3},
  {2, 8, 9, 4, {3, 3, 3, 3, 0, 0}, {{0, 1, 4}, {1, 2, 5}, {2, 3, 6}, {3, 0, 7}}, 23, SHAPE_QUAD4},
  {2, 8, 4, 4, {3, 3, 3, 3, 0, 0}, {{0, 1, 4}, {1, 2, 5}, {2, 3, 6}, {3, 0, 7}}, 23, SHAPE_QUAD4},
  {3, 10, 4, 4, {6, 6, 6, 6, 0, 0},
   {{0, 2, 1, 6, 5, 4}, {0, 1, 3, 4, 8, 7}, {1, 2, 3, 5, 9, 8}, {0, 3, 2, 7, 9, 6}}, 24, SHAPE_TET4},
  {3, 15, 9, 5, {6, 6, 8, 8, 8, 0},
   {{0, 2, 1, 8, 7, 6}, {3, 4, 5, 9, 10, 11}, {0, 1, 4, 3, 6, 13, 9, 12}, {1, 2, 5, 4, 7, 14, 10, 13},
    {2, 0, 3, 5, 8, 12, 11, 14}}, 26, SHAPE_WEDGE6},
  {3, 20, 27, 6, {8, 8, 8, 8, 8, 8},
   {{0, 3, 2, 1, 11, 10, 9, 8}, {4, 5, 6, 7, 12, 13, 14, 15}, {0, 1, 5, 4, 8, 17, 12, 16},
    {1, 2, 6, 5, 9, 18, 13, 17}, {2, 3, 7, 6, 10, 19, 14, 18}, {3, 0, 4, 7, 11, 16, 15, 19}},
   25, SHAPE_HEX8},
  {3, 20, 8, 6, {8, 8, 8, 8, 8, 8},
   {{0, 3, 2, 1, 11, 10, 9, 8}, {4, 5, 6, 7, 12, 13, 14, 15}, {0, 1, 5, 4, 8, 17, 12, 16},
    {1, 2, 6, 5, 9, 18, 13, 17}, {2, 3, 7, 6, 10, 19, 14, 18}, {3, 0, 4, 7, 11, 16, 15, 19}},
   25, SHAPE_HEX8},
};

const ElemType elem_table[ELEM_TYPES] = {
  {"CPE3", SHAPE_TRI3, PLANE_STRAIN, false},
  {"CPS3", SHAPE_TRI3, PLANE_STRESS, false},
  {"CPE4", SHAPE_QUAD4, PLANE_STRAIN, false},
  {"CPS4", SHAPE_QUAD4, PLANE_STRESS, false},
  {"C3D4", SHAPE_TET4, PLANE_NONE, false},
  {"C3D6", SHAPE_WEDGE6, PLANE_NONE, false},
  {"C3D8", SHAPE_HEX8, PLANE_NONE, false},
  {"CPE4I", SHAPE_QUAD4, PLANE_STRAIN, true},
  {"CPS4I", SHAPE_QUAD4, PLANE_STRESS, true},
  {"C3D8I", SHAPE_HEX8, PLANE_NONE, true},
  {"CPE6", SHAPE_TRI6, PLANE_STRAIN, false},
  {"CPS6", SHAPE_TRI6, PLANE_STRESS, false},
  {"CPE8", SHAPE_QUAD8, PLANE_STRAIN, false},
  {"CPS8", SHAPE_QUAD8, PLANE_STRESS, false},
  {"CPE8R", SHAPE_QUAD8R, PLANE_STRAIN, false},
  {"CPS8R", SHAPE_QUAD8R, PLANE_STRESS, false},
  {"C3D10", SHAPE_TET10, PLANE_NONE, false},
  {"C3D15", SHAPE_WEDGE15, PLANE_NONE, false},
  {"C3D20", SHAPE_HEX20, PLANE_NONE, false},
  {"C3D20R", SHAPE_HEX20R, PLANE_NONE, false},
};

void shape_edge(Shape s, int a, int corner[2])
{
  const ShapeInfo& info = shape_info[s];
  for (int f = 0; f < info.nface; ++f) {
    const int n = face_corners(info, f);
    for (int k = n; k < info.nfnode[f]; ++k) {
      if (info.face[f][k] != a) continue;
      corner[0] = info.face[f][k - n];
      corner[1] = info.face[f][(k - n + 1) % n];
    }
  }
}

int elem_type_find(const std::string& name)
{
  for (int i = 0; i < ELEM_TYPES; ++i)
    if (name == elem_table[i].name) return i;
  return -1;
}
