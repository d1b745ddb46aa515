#include <algorithm>
#include <iterator>
#include <set>

#include "deck/card.h"

namespace {

// lines elset|element, S1; a face that is listed again would carry each load again
void read_faces(Card& card, const Model& model, Surface& s)
{
  std::set<std::pair<int, int>> known;
  while (card_line(card)) {
    const Field f = card_field(card, "element or element set");
    const int face = card_word(card, "face", model.dim == 3 ? "S1|S2|S3|S4|S5|S6" : "S1|S2|S3|S4");
    IntVec elem;
    if (!card_good(card) || !target_elems(*card.deck, model, f, elem)) continue;
    int again = 0, first = -1;
    for (int e : elem) {
      if (face < shape_info[elem_table[model.mesh.elem_type[e]].shape].nface) {
        if (known.insert({e, face}).second) s.face.push_back(Face{e, face});
        else if (again++ == 0) first = e;
        continue;
      }
      card_error(card, card.field[1],
                 text_format("element %d is a %s and has no face S%d", model.mesh.elem_label[e],
                             elem_table[model.mesh.elem_type[e]].name, face + 1));
      break;
    }
    if (again > 0)
      card_warn(
          card, f,
          text_format("%d face%s of this line %s in the surface already, the first is S%d of element %d; "
                      "a face counts once",
                      again, again > 1 ? "s" : "", again > 1 ? "are" : "is", face + 1,
                      model.mesh.elem_label[first]));
  }
}

// free faces of the elements all of whose nodes satisfy where
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

}  // namespace

// ---------------------------------------------------------------------------
// *SURFACE, NAME= : lines elset|element, S1; or ELSET=[, WHERE=]; or TYPE=BODY, BODY=[, WHERE=]
// ---------------------------------------------------------------------------
void kw_surface(Card& card, Model& model)
{
  Surface s;
  s.name  = card_param_name(card, "NAME");
  s.place = card_place(card);
  const bool of_body = card_param_word(card, "TYPE", "ELEMENT|BODY", 0) == 1;
  Expr where;
  const bool selects = card_param_expr(card, "WHERE", where);
  const Field elset = card_param_field(card, "ELSET"), body = card_param_field(card, "BODY");

  if (of_body && body.empty()) card_error(card, card.head.at, "TYPE=BODY needs BODY=name");
  if (!of_body && !body.empty()) card_error(card, body, "BODY= goes with TYPE=BODY only");
  if (of_body && !elset.empty()) card_error(card, elset, "ELSET= does not go with TYPE=BODY");
  if (!of_body && elset.empty() && selects)
    card_error(card, card.head.at, "WHERE needs ELSET=name (or TYPE=BODY, BODY=name)");
  IntVec elem;
  if (!of_body && elset.empty()) read_faces(card, model, s);
  else if (!of_body && target_elems(*card.deck, model, elset, elem))
    find_faces(card, model, elem, selects ? &where : nullptr, s);

  if (s.name.empty()) return;
  if (model_find_surface(model, s.name) >= 0)
    card_error(card, card.head.at, "surface " + s.name + " is defined already");
  const bool good = card.deck->errors == card.errors_before;
  if (good && !of_body && s.face.empty())
    card_error(card, card.head.at, "surface " + s.name + " is empty: no free face fits");
  if (of_body && selects) s.where = where;
  const std::size_t i = model.surface.size();
  model.surface.push_back(s);
  if (of_body && !body.empty())
    card_later(card, STAGE_STEP, [=](Deck& d, Model& m) { m.surface[i].body = target_body(d, m, body); });
}
