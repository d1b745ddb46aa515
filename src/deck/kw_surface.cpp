#include <algorithm>
#include <iterator>
#include <set>

#include "deck/card.h"

namespace {

struct FaceLine {              // elset|element, S1
  Field elem, face;
  int number = 0;              // 0-based number of the face; -1: all free faces
};

bool is_defined(const Model& m, const Field& f)
{
  int label = 0;
  return target_label(f.text, label) || model_find_elset(m, text_upper(f.text)) >= 0;
}

// adds the listed faces to a surface, each once: a duplicate would be loaded twice
void add_faces(Deck& d, const Model& model, const std::vector<FaceLine>& lines, Surface& s)
{
  const int before = d.messages.errors;
  std::set<std::pair<int, int>> listed;
  for (const FaceLine& l : lines) {
    IntVec elem;
    if (!target_elems(d, model, l.elem, elem)) continue;
    int duplicates = 0, first = -1;
    if (l.number < 0) {
      std::sort(elem.begin(), elem.end());
      for (const Face& f : mesh_free_faces(d, model))
        if (std::binary_search(elem.begin(), elem.end(), f.elem) && listed.insert({f.elem, f.face}).second)
          s.face.push_back(f);
      continue;
    }
    for (int e : elem) {
      if (l.number < shape_info[elem_table[model.mesh.elem_type[e]].shape].nface) {
        if (listed.insert({e, l.number}).second) s.face.push_back(Face{e, l.number});
        else if (duplicates++ == 0) first = e;
        continue;
      }
      deck_error(d, l.face,
                 text_format("element %d is a %s and has no face S%d", model.mesh.elem_label[e],
                             elem_table[model.mesh.elem_type[e]].name, l.number + 1));
      break;
    }
    if (duplicates > 0)
      deck_warn(
          d, l.elem,
          text_format("%d face%s of this line %s in the surface already, the first is S%d of element %d; "
                      "a face counts once",
                      duplicates, duplicates > 1 ? "s" : "", duplicates > 1 ? "are" : "is", l.number + 1,
                      model.mesh.elem_label[first]));
  }
  if (d.messages.errors == before && s.face.empty())
    deck_error(d, deck_field(d, s.deck_line, "SURFACE"),
               "surface " + s.name + " is empty: no free face is selected");
}

void read_faces(Card& card, const Model& model, std::vector<FaceLine>& lines)
{
  while (card_line(card)) {
    FaceLine l;
    l.elem   = card_field(card, "element or element set");
    if (card.field.size() < 2 || card.field[1].empty()) {      // Abaqus: the free faces of the set
      card.next = card.field.size();
      l.number  = -1;
      if (card_good(card)) lines.push_back(l);
      continue;
    }
    l.number = card_word(card, "face", model.dim == 3 ? "S1|S2|S3|S4|S5|S6" : "S1|S2|S3|S4");
    if (!card_good(card)) continue;
    l.face = card.field[1];
    lines.push_back(l);
  }
}

// adds free faces of the elements, with where != 0 at all their nodes
void find_faces(Card& card, const Model& model, const IntVec& elem, const Expr* where, Surface& s)
{
  const Mesh& mesh = model.mesh;
  std::vector<char> inside(mesh.nelem(), 0);
  for (int e : elem) inside[e] = 1;
  for (const Face& f : mesh_free_faces(*card.deck, model)) {
    if (!inside[f.elem]) continue;
    const ShapeInfo& info = shape_info[elem_table[mesh.elem_type[f.elem]].shape];
    bool take = true;
    for (int a = 0; where && a < info.nfnode[f.face]; ++a) {
      const int n = mesh.conn.begin(f.elem)[info.face[f.face][a]];
      const double* X = &mesh.X[3 * static_cast<std::size_t>(n)];
      take = take && card_where(card, *where, X, model.dim, text_format("node %d", mesh.node_label[n]));
    }
    if (take) s.face.push_back(f);
  }
}

// nset|node[, area] : a node set of the name of the surface
void read_nodes(Card& card, Model& model, const Surface& s)
{
  IntVec node;
  while (card_line(card)) {
    const Field target = card_field(card, "node set or node");
    if (card_more(card)) card.next = card.field.size();        // an area, of no use here
    if (card_good(card)) target_nodes(*card.deck, model, target, node);
  }
  if (!s.name.empty() && !node.empty()) set_merge(model.nset, s.name, node, s.deck_line);
}

}  // namespace

// ---------------------------------------------------------------------------
// *SURFACE, NAME= : lines elset|element, S1; or ELSET=[, WHERE=]; or TYPE=BODY, BODY=[, WHERE=];
//                  TYPE=NODE, lines nset|node: a node set
// ---------------------------------------------------------------------------
void kw_surface(Card& card, Model& model)
{
  Surface s;
  s.name  = card_param_name(card, "NAME");
  s.deck_line = card_deck_line(card);
  const int type = card_param_word(card, "TYPE", "ELEMENT|BODY|NODE", 0);
  card_flag(card, "INTERNAL");
  if (type == 2) return read_nodes(card, model, s);
  const bool of_body = type == 1;
  Expr where;
  const bool selects = card_param_where(card, where);
  const Field elset = card_param_field(card, "ELSET"), body = card_param_field(card, "BODY");

  if (of_body && body.empty()) card_error(card, card.head.at, "TYPE=BODY needs BODY=name");
  if (!of_body && !body.empty()) card_error(card, body, "BODY= requires TYPE=BODY");
  if (of_body && !elset.empty()) card_error(card, elset, "ELSET= cannot be combined with TYPE=BODY");
  if (!of_body && elset.empty() && selects)
    card_error(card, card.head.at, "WHERE needs ELSET=name (or TYPE=BODY, BODY=name)");
  IntVec elem;
  std::vector<FaceLine> lines;
  if (!of_body && elset.empty()) read_faces(card, model, lines);
  else if (!of_body && target_elems(*card.deck, model, elset, elem))
    find_faces(card, model, elem, selects ? &where : nullptr, s);

  if (s.name.empty()) return;
  if (model_find_surface(model, s.name) >= 0)
    card_error(card, card.head.at, "surface " + s.name + " is defined already");
  const bool good     = card.deck->messages.errors == card.errors_before;
  const auto defined  = [&](const FaceLine& l) { return is_defined(model, l.elem); };
  const bool later    = !std::all_of(lines.begin(), lines.end(), defined);
  if (good && !later && !lines.empty()) add_faces(*card.deck, model, lines, s);
  if (good && !of_body && lines.empty() && s.face.empty())
    card_error(card, card.head.at, "surface " + s.name + " is empty: no free face is selected");
  if (of_body && selects) s.where = where;
  const std::size_t i = model.surface.size();
  model.surface.push_back(s);
  if (good && later)           // refers to a set defined later
    card_later(card, STAGE_STEP, [=](Deck& d, Model& m) { add_faces(d, m, lines, m.surface[i]); });
  if (of_body && !body.empty())
    card_later(card, STAGE_STEP, [=](Deck& d, Model& m) { m.surface[i].body = target_body(d, m, body); });
}
