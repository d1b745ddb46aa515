// Elements of a lower dimension than the model (facets), written by mesh generators for sides and edges:
// they become node sets and surfaces

#include <algorithm>
#include <array>
#include <map>

#include "deck/deck_state.h"

namespace {

struct FacetType { const char* name; int dim, nodes, corners; };

const FacetType facet_table[] = {
  {"T2D2", 1, 2, 2}, {"T3D2", 1, 2, 2}, {"B21", 1, 2, 2}, {"B31", 1, 2, 2},
  {"T2D3", 1, 3, 2}, {"T3D3", 1, 3, 2}, {"B22", 1, 3, 2}, {"B32", 1, 3, 2},
  {"CPS3", 2, 3, 3}, {"CPE3", 2, 3, 3}, {"S3", 2, 3, 3}, {"S3R", 2, 3, 3},
  {"STRI3", 2, 3, 3}, {"M3D3", 2, 3, 3},
  {"CPS4", 2, 4, 4}, {"CPE4", 2, 4, 4}, {"CPS4R", 2, 4, 4}, {"CPE4R", 2, 4, 4}, {"S4", 2, 4, 4},
  {"S4R", 2, 4, 4}, {"M3D4", 2, 4, 4}, {"M3D4R", 2, 4, 4},
  {"CPS6", 2, 6, 3}, {"CPE6", 2, 6, 3}, {"S6", 2, 6, 3}, {"STRI65", 2, 6, 3}, {"M3D6", 2, 6, 3},
  {"CPS8", 2, 8, 4}, {"CPE8", 2, 8, 4}, {"CPS8R", 2, 8, 4}, {"CPE8R", 2, 8, 4}, {"S8", 2, 8, 4},
  {"S8R", 2, 8, 4}, {"M3D8", 2, 8, 4}, {"M3D8R", 2, 8, 4},
};

using Corners = std::array<int, 4>;

Corners sorted(int n, const int* node)
{
  Corners c{{-1, -1, -1, -1}};
  std::copy(node, node + n, c.begin());
  std::sort(c.begin(), c.end());
  return c;
}

// outer faces of the mesh, keyed by their sorted corners
std::map<Corners, Face> outer_faces(Deck& d, const Model& m)
{
  std::map<Corners, Face> out;
  for (const Face& f : mesh_free_faces(d, m)) {
    const ShapeInfo& info = shape_info[elem_table[m.mesh.elem_type[f.elem]].shape];
    int node[4];
    const int n = face_corners(info, f.face);
    for (int a = 0; a < n; ++a) node[a] = m.mesh.conn.begin(f.elem)[info.face[f.face][a]];
    out[sorted(n, node)] = f;
  }
  return out;
}

}  // namespace

// element_type_here : element type of a name in the open file, translated by the pairs of *INCLUDE
std::string element_type_here(const Deck& d, const std::string& type)
{
  std::string name = text_upper(type);
  for (std::size_t i = d.reading.size(); i-- > 0;)
    for (const auto& t : d.reading[i].type)
      if (name == t.first) {
        name = t.second;
        break;
      }
  return name;
}

int facet_nodes(const std::string& type, int dim, int& corners)
{
  for (const FacetType& f : facet_table) {
    if (type != f.name || f.dim >= dim) continue;
    corners = f.corners;
    return f.nodes;
  }
  return 0;
}

void facet_add(Deck& d, int label, const Facet& f)
{
  d.facets.index[label] = static_cast<int>(d.facets.list.size());
  d.facets.list.push_back(f);
}

void facet_set_merge(Deck& d, Model& m, const std::string& name, IntVec& item, const DeckLine& deck_line)
{
  if (item.empty()) return;
  IntVec node;
  for (int i : item) {
    const Facet& facet = d.facets.list[i];
    node.insert(node.end(), facet.node, facet.node + facet.n);
  }
  set_merge(m.nset, name, node, deck_line);
  set_merge(d.facets.set, name, item, deck_line);
}

// ---------------------------------------------------------------------------
// facet_surfaces : makes a surface of each facet set, from the outer faces of the mesh that coincide with
// its facets
// ---------------------------------------------------------------------------
void facet_surfaces(Deck& d, Model& m)
{
  if (d.facets.set.empty() || !m.step.empty()) return;
  const std::map<Corners, Face> outer = outer_faces(d, m);
  d.word = "ELEMENT";
  for (const Set& set : d.facets.set) {
    Surface s;
    s.name  = set.name;
    s.deck_line = set.deck_line;
    for (int i : set.item) {
      const auto f = outer.find(sorted(d.facets.list[i].corners, d.facets.list[i].node));
      if (f != outer.end()) s.face.push_back(f->second);
    }
    if (s.face.empty()) continue;                    // edges in space, or inside the mesh: node set only
    if (model_find_surface(m, s.name) >= 0) continue;      // defined by *SURFACE
    if (s.face.size() < set.item.size() && d.absent.elem.empty())
      deck_warn(d, deck_field(d, set.deck_line, set.name),
                text_format("%zu of the %zu elements of ", set.item.size() - s.face.size(), set.item.size()) +
                    set.name + " are not outer faces of the mesh; surface " + set.name + " has the others");
    m.surface.push_back(s);
  }
}

void absent_report(Deck& d)
{
  d.word = "ELEMENT";
  for (const Absent& a : d.absent.type)
    deck_error(d, a.at, text_format("TYPE %s (%ld element%s): ", text_show(a.type).c_str(), a.count,
                                    a.count == 1 ? "" : "s") + a.remedy);
  d.absent.type.clear();
}
