#include "model/element_table.h"

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
