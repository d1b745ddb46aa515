// ---------------------------------------------------------------------------
// deck_state.h : data shared by the keyword readers: files, position, parameters,
// messages, the open material and step, deferred look-ups
// ---------------------------------------------------------------------------
#ifndef MPFE_DECK_DECK_STATE_H
#define MPFE_DECK_DECK_STATE_H

#include <functional>
#include <map>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "base/box_tree.h"
#include "base/hash.h"
#include "model/model.h"

struct Field {                 // a word of the deck with its position
  std::string text;            // trimmed, without quotes, <...> replaced by its value
  int file = 0, line = 0;      // index into Deck::file, 1-based line; 0: the whole file
  int column = 0, length = 0;  // in the original line, 0-based
  int number = 0;              // 1-based field of a data line; 0: not in a data line
  bool quoted = false;
  bool bad = false;            // an <expression> in it is wrong and has been reported
  bool empty() const { return text.empty() && !quoted; }
};

struct HeadParam {             // NAME or NAME=value of a keyword line
  std::string name;            // upper case, without blanks
  Field key, value;
  bool has_value = false;
};

struct Head {                  // a keyword line
  std::string word;            // upper case, single blanks, without the star
  Field at;
  std::vector<HeadParam> param;
};

struct DeckFile {
  std::string path, text;
  std::vector<std::size_t> start;    // offset of each line
  IntVec origin;               // 1-based line in the user's file; empty: same (deck_parts.cpp)
};

struct Reading {               // an open file: the deck or an include
  int file = 0;
  int line = 0;                // lines already taken
  std::vector<std::pair<std::string, std::string>> type;   // element types: name in the file, name here
};

struct Facet {                 // an element of a lower dimension than the model
  int n = 0, corners = 0;
  int node[MAX_FACE_NODES];
};

struct Absent {                // a type of *ELEMENT that is not available
  std::string type, remedy;
  Field at;                    // first occurrence
  long count = 0;              // number of elements
};

struct Message {
  bool warning = false;
  int file = 0, line = 0;
  std::string text;
  std::string kind;            // keyword and text without numbers
};

struct Spot { int file = 0, line = 0; };

struct LabelIndex {            // label -> index
  IntVec dense;                // [label] -1: undefined, or in sparse
  std::unordered_map<int, int> sparse;     // labels much larger than their count, or negative
  int find(int label) const;   // -1: undefined
  void add(int label, int index);
};

struct Interaction {           // *SURFACE INTERACTION; contact pairs copy it into their BondDef
  std::string name;
  double friction = 0.0, stick = 0.0, penalty = 0.0;   // 0: default of the pair
  bool has_behavior = false, has_friction = false;
};

struct TieDef {                // *TIE, imposed by equations (deck_tie.cpp)
  std::string name;
  int slave = -1, master = -1; // surfaces
  double tolerance = 0.0;      // max. distance of a slave node; 0: default            length
  bool adjust = true;          // slave nodes are moved onto the master faces at t = 0
  DeckLine deck_line;
};

enum CouplingKind { COUPLING_OPEN, COUPLING_KINEMATIC, COUPLING_DISTRIBUTING, COUPLING_RIGID };

struct CouplingDef {           // *COUPLING, *RIGID BODY, imposed by equations (deck_coupling.cpp)
  std::string name;
  CouplingKind kind = COUPLING_OPEN;
  Field ref_at;
  int ref = -1, turn = -1;     // reference node; node without elements whose displacements are its rotation
  int surface = -1, elset = -1;
  bool coupled[6] = {true, true, true, true, true, true};  // directions
  DeckLine deck_line;
};

struct Removes {               // OP=NEW in a step
  bool cload = false, dload = false, boundary = false;
};

enum Stage { STAGE_STEP, STAGE_END };   // at the first *STEP; after the last line

struct Deck;
struct Later {
  std::string word;
  std::function<void(Deck&, Model&)> run;
};

// *BULK VISCOSITY: default coefficients of Abaqus/Explicit (6.35); NOT_GIVEN is replaced by deck_resolve
// (test: strength/spall_compare)
const double BULK_LINEAR = 0.06, BULK_QUADRATIC = 1.2, NOT_GIVEN = -1.0;

struct Messages {
  std::vector<Message> first;                      // the first few of each kind
  std::unordered_map<std::string, int> of_kind;    // number of different messages of a kind
  std::set<std::size_t> texts;                     // hashes of the texts
  int errors = 0, warnings = 0;
};

struct Parameters {
  ParamMap value;
  ParamMap define;             // -D
  std::unordered_map<std::string, Spot> spot;      // line of *PARAMETER
  std::set<std::string> used;  // names used in expressions
};

struct Dimension {             // of the first elements or grid; their name and line
  int first = 0;               // 0: none yet
  std::string name;
  Spot spot;
};

struct OpenCards {             // that later cards belong to
  int material = -1, interaction = -1;             // *MATERIAL, *SURFACE INTERACTION
  bool step = false, procedure = false, prints_node = false, prints_elem = false;
  Field step_at;
};

struct Labels {
  LabelIndex node, elem;
  std::vector<Spot> node_spot, elem_spot;          // definition of each node and element
};

struct Facets {                // elements of a lower dimension (deck_facet.cpp)
  std::vector<Facet> list;
  std::unordered_map<int, int> index;              // label -> index
  std::vector<Set> set;        // indices into list
};

// unavailable element types; labels and sets of their elements and of those with a misspelt type, whose
// use is not reported again
struct AbsentTypes {
  std::vector<Absent> type;
  std::set<int> elem;
  std::set<std::string> set;
};

struct FreeFaces {             // faces of one element only
  std::vector<Face> face;
  int nelem = -1;              // number of elements at that time
};

struct Deck {
  std::vector<DeckFile> file;
  std::vector<Reading> reading;
  int includes = 0;

  Messages messages;
  std::string word;            // keyword being read or checked, for messages
  std::map<std::string, int> passed;               // ignored keywords and their counts
  std::string parts;           // instances of *PART, for the listing
  std::set<int> tracked;       // *EIGENFRACTURE with TRACK=

  std::uint64_t hash[2] = {hash_start, hash_start};  // of the lines read so far: outside steps, in steps
  bool hashing = false;        // the open card enters the hash
  bool hash_step = false;      // that of the steps

  Parameters params;
  Dimension dimension;
  OpenCards open;
  std::vector<Interaction> interaction;
  Controls controls;           // *NEWTON before the first step
  std::vector<Later> later[2];

  std::vector<std::string> column;                 // columns of *HISTORY
  Labels labels;
  std::unordered_map<int, IntVec> split;           // label of a split element -> its parts
  Facets facets;
  AbsentTypes absent;
  FreeFaces free;

  std::map<std::string, std::array<double, 9>> orientation;          // *ORIENTATION: axes 1, 2, 3
  std::unordered_map<int, int> frame_of;           // node -> index into Model::frame
  std::vector<TieDef> tie;
  std::vector<CouplingDef> coupling;
  std::vector<Prescribed> base;                    // *BOUNDARY outside steps
  std::vector<Removes> removes;                    // [steps]
};

// ---- orthotropic constants (deck_ortho.cpp) ---------------------------------
bool ortho_matrix(const double* constants, RealVec& D);
RealVec ortho_turn(const RealVec& D, const std::array<double, 9>& axis);
void ortho_isotropic(const RealVec& D, double& young, double& poisson);

// ---- messages (deck_error.cpp) ---------------------------------------------
std::string text_format(const char* format, ...) __attribute__((format(printf, 1, 2)));
std::string text_show(const std::string& word);            // clipped, printable
std::string text_number(double value);                     // shortest of 12 digits
std::string text_upper(const std::string& word);
std::string text_squeeze(const std::string& word);         // upper case without blanks
std::string text_keyword(const std::string& word);         // upper case with single blanks
// "" when none is similar
std::string text_nearest(const std::string& word, const std::vector<std::string>& valid);
// "; did you mean X?" or the list
std::string text_suggest(const std::string& word, const std::vector<std::string>& valid);
void deck_error(Deck& d, const Field& at, const std::string& text);
void deck_warn(Deck& d, const Field& at, const std::string& text);
// at a line read before, at word where the line has it
void fault(Deck& d, const std::string& keyword, const DeckLine& deck_line, const std::string& word,
           const std::string& text);
void warn(Deck& d, const std::string& keyword, const DeckLine& deck_line, const std::string& word,
          const std::string& text);
void deck_print_messages(const Deck& d);
DeckLine deck_line_of(const Deck& d, const Field& at);
std::string spot_text(const Deck& d, const Spot& s);       // "FILE line N"
Field deck_field(const Deck& d, const DeckLine& deck_line, const std::string& word);   // position of the word

// ---- lines (deck_lines.cpp) ------------------------------------------------
bool deck_open(Deck& d, const std::string& path, const Field* from);
std::string deck_line_text(const Deck& d, int file, int line);
bool deck_peek(Deck& d, bool& keyword);                    // true: there is a next line; opens includes
void deck_head(Deck& d, Head& head);                       // reads the keyword line with its continuation
void deck_fields(Deck& d, bool substitute, std::vector<Field>& field, Field& whole, bool& comma);

// ---- parts and instances (deck_parts.cpp)
bool deck_has_parts(const DeckFile& f);
void deck_flatten(Deck& d, int file);                      // rewrites the file without parts
int deck_line_number(const Deck& d, int file, int line);   // line number in the user's file

void deck_hash(Deck& d, const std::string& line);          // adds the line to the hash

// ---- expressions (deck_expr.cpp) -------------------------------------------
bool deck_scalar(Deck& d, const Field& at, int offset, const std::string& text, double& value);
bool deck_function(Deck& d, const Field& at, const std::string& text, Expr& out);
bool deck_function_of_t(Deck& d, const Field& at, const std::string& text, Expr& out);
std::string deck_parameter_name_fault(const std::string& name);   // "" when the name is allowed

// ---- two or three dimensions (deck_dimension.cpp) --------------------------
int deck_dimension(const Deck& d, const std::string& path);     // scans the whole deck before it is read
bool deck_same_dimension(Deck& d, const Field& at, const std::string& what, int dim);

// ---- mesh, sets, targets (deck_mesh.cpp) -----------------------------------
int mesh_add_node(Deck& d, Model& m, int label, double x, double y, double z, const Field& at);
int mesh_add_elem(Deck& d, Model& m, int label, int type, const int* node, const Field& at);
std::string element_type_words();                          // allowed values of TYPE
int mesh_max_label(const IntVec& label);
void mesh_centroid(const Mesh& mesh, int e, double x[3]);
const std::vector<Face>& mesh_free_faces(Deck& d, const Model& m);
int set_merge(std::vector<Set>& sets, const std::string& name, IntVec& item, const DeckLine& deck_line);
std::string element_type_here(const Deck& d, const std::string& type);   // its meaning in the open file
// facet_nodes : number of nodes of a lower-dimensional type, and of its corners; 0: not such a type
int facet_nodes(const std::string& type, int dim, int& corners);
void facet_add(Deck& d, int label, const Facet& f);
// facet_set_merge : adds facets to the set of this name, and their nodes to the node set
void facet_set_merge(Deck& d, Model& m, const std::string& name, IntVec& item, const DeckLine& deck_line);
void facet_surfaces(Deck& d, Model& m);                    // once the mesh is complete (deck_facet.cpp)
void absent_report(Deck& d);                   // reports unavailable types (deck_facet.cpp)
bool target_label(const std::string& text, int& label);
bool target_nodes(Deck& d, const Model& m, const Field& at, IntVec& node);     // node set or label
bool target_elems(Deck& d, const Model& m, const Field& at, IntVec& elem);     // element set or label
int target_nset(Deck& d, Model& m, const Field& at);       // index; a label creates a set of one
int target_elset(Deck& d, Model& m, const Field& at);
int target_material(Deck& d, const Model& m, const Field& at);
int target_surface(Deck& d, const Model& m, const Field& at);
int target_body(Deck& d, const Model& m, const Field& at);
int target_amplitude(Deck& d, const Model& m, const Field& at);

// columns of every history file (deck_column.cpp)
bool column_built_in(const std::string& name, std::string& column);

// ---- nodes with local directions (deck_frame.cpp) ---------------------------
// frame_node : the node with the local displacements of this node; without *TRANSFORM the node itself
int frame_node(Deck& d, Model& m, int node);
void frame_nodes(Deck& d, Model& m, IntVec& node);
void frame_resolve(Deck& d, Model& m);

// ---- quadratic elements that need to be linear (deck_split.cpp)
void deck_split(Deck& d, Model& m);

// ---- tied surfaces (deck_tie.cpp)
void tie_resolve(Deck& d, Model& m);

// ---- nodes coupled to a reference node (deck_coupling.cpp)
// coupling_turn : finds the reference node of a coupling; creates the node with its rotation
void coupling_turn(Deck& d, Model& m, CouplingDef& c);
int coupling_turn_of(Deck& d, Model& m, int node);         // rotation node of a reference node; -1: not one
void coupling_resolve(Deck& d, Model& m);

// ---- loads from step to step (deck_inherit.cpp) ------------------------------
// deck_same_value : do both prescribe the same value, at any nodes and directions?
bool deck_same_value(const Prescribed& a, const Prescribed& b);
bool deck_same_value(const InitialValue& a, const InitialValue& b);
// deck_load : adds a load to the open step; deck_inherit : adds the loads and supports of earlier steps
void deck_load(Deck& d, Model& m, const char* keyword, const std::string& key, const Field& at, Load load);
void deck_inherit(Deck& d, Model& m);

// ---- after reading ---------------------------------------------------------
void deck_run_later(Deck& d, Model& m, Stage stage);
void deck_resolve(Deck& d, Model& m);                      // sections, schemes, loads on bodies
void deck_box_element(BoundingBox& b, const Mesh& mesh, int e);      // enlarges b (deck_check_mesh.cpp)
void deck_joints(Deck& d, Model& m);                       // initial cracks that touch only by nodes
// creates bodies and bonds of *CONVERSION (deck_fracture.cpp)
void deck_fracture(Deck& d, Model& m);
void deck_check(Deck& d, Model& m);
// initial stress, *MODEL CHANGE in steps; body: created from an element, -1            [nelem]
void deck_changes(Deck& d, Model& m, const IntVec& body);
// equation_given : dofs given in a step by supports and equations (deck_equation.cpp)
using DofSet = std::set<std::pair<int, int>>;                // node, 0-based direction
DofSet equation_given(const Model& m, const Step& s);
void check_equations(Deck& d, const Model& m);             // deck_equation.cpp

#endif
