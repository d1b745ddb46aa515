#include "model/element_table.h"

const ShapeInfo shape_info[5] = {
  // dim nen ngp nface  nfnode              face (local nodes)                                 vtk
  {2, 3, 1, 3, {2, 2, 2, 0, 0, 0}, {{0, 1}, {1, 2}, {2, 0}}, 5},
  {2, 4, 4, 4, {2, 2, 2, 2, 0, 0}, {{0, 1}, {1, 2}, {2, 3}, {3, 0}}, 9},
  {3, 4, 1, 4, {3, 3, 3, 3, 0, 0}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}, 10},
  {3, 6, 6, 5, {3, 3, 4, 4, 4, 0}, {{0, 2, 1}, {3, 4, 5}, {0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}}, 13},
  {3, 8, 8, 6, {4, 4, 4, 4, 4, 4},
   {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}, 12},
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
};

int elem_type_find(const std::string& name)
{
  for (int i = 0; i < ELEM_TYPES; ++i)
    if (name == elem_table[i].name) return i;
  return -1;
}
