// ---------------------------------------------------------------------------
// frac.h : eigenfracture: which elements break, and how they become material points (doc/theory.md 7)
// ---------------------------------------------------------------------------
#ifndef MPFE_FRAC_FRAC_H
#define MPFE_FRAC_FRAC_H

#include <algorithm>
#include <cmath>

#include "bond/bond.h"
#include "elem/elem.h"
#include "model/model_cut.h"
#include "point/point.h"

// Part of Gc/h below which psi+ of an element neither breaks it nor is followed; an element at a tip holds
// 0.1
const double FRAC_MIN_DRIVE = 0.01;

// In sizes of an element: default radius of the ball by FORCE and by BALL; radius of the ball around a notch
// in which BALL asks for J as well; default spacing in motion
const double FRAC_RADIUS_FORCE = 5.0, FRAC_RADIUS_BALL = 2.0, FRAC_NOTCH = 5.0, FRAC_SPACING = 2.0;
// what a kink looks at around an element, in its sizes
const double FRAC_KINK = 6.0;
// the same from the corner of the square in which a sharp crack is looked at                       (7.38)
const double FRAC_SHARP = 11.0;

// What fracture and conversion need to know of the mesh at t = 0; made once
struct FracMesh {
  bool on = false;             // something can break or change its form
  IntVec def;                  // [nelem] index into Model::fracture, -1: cannot break
  IntVec conv;                 // [nelem] index into Model::conversion, -1: stays an element
  RealVec gc;                  // [nelem] toughness, with its scatter               force/length
  RealVec release;             // [nelem] dynamics: time in which psi+ of a broken element falls to c   time
  RealVec average;             // [nelem] dynamics: time over which the criterion averages psi+        time
  RealVec centre;              // [nelem*3]
  RealVec volume;              // [nelem] area x thickness in the plane
  RealVec thickness;           // [nelem] 1 in three dimensions
  // [nelem] h: edge of the square or cube that the element is a part of     length
  RealVec size;
  RealVec local;               // [nelem] h, mean with the neighbours
  IntVec across, across_face;  // [nelem*6] element behind a face and its face there, -1: none
  ListTable of_node;           // [nnode] elements of a node
  // nodes between materials, ascending; [3] normal of the interface there, 0 where it turns sharply   (7.36)
  IntVec between;
  RealVec between_normal;
  // [nelem] radius of the ball in which the end of a notch was looked for, negative: there is one; 0: not yet
  mutable RealVec notch;
  double lo[3] = {0, 0, 0}, bin = 1.0;     // bins of centres
  int nbin[3] = {1, 1, 1};
  ListTable in_bin;            // [bins] elements
};

// One element that breaks
struct Erosion {
  int elem = -1;               // divided model: index here, -1: it is not here
  double value = 0.0;          // criterion over toughness, >= 1
  double rank  = 0.0;          // what the order goes by
  double J[3]  = {0, 0, 0};    // direction of growth times G, 0: not known
  double time  = 0.0;          // when the criterion was met, by frac_when
  int number = -1, label = 0;  // in the mesh of the deck
  int def = -1;                // index into Model::fracture
  double X[3] = {0, 0, 0};     // centre at t = 0
  double gain = 1.0;           // value over the estimate of the element by which its front is judged
};

// The element whose criterion is exceeded most among those that may break now
struct FirstBreak {
  int elem = -1;               // divided model: index here, -1: it is not here
  int number = -1, label = 0;  // in the mesh of the deck; -1: there is none
  int def = -1;                // index into Model::fracture
  double value = 0.0;          // criterion over the value at which it breaks, >= 1
  double part  = 0.0;          // FALLBACK: part of Gc h; 0: by the criterion of its definition
  double gain  = 1.0;          // of a kink over the estimate of elem
};

// frac_mesh : topology, sizes, toughness. Returns the number of errors (messages in the log).
int frac_mesh(const Model& m, const Elements& el, FracMesh& fm);

// frac_outer : [ranks] elements of others that the estimates, gates and crack areas of those of a rank look
// at, and those at a node of what it then has, ascending; of a model that breaks  (7.1) - (7.8), (7.17)
//   in   rank    that works on an element                 [nelem]
//   out  notch   MeshPart::notch                          [nelem]
std::vector<IntVec> frac_outer(const Model& m, const IntVec& rank, int ranks, std::vector<char>& notch);

// frac_around : [ranks] elements of others within so many rows of its own, where elements become points
std::vector<IntVec> frac_around(const Model& m, const IntVec& rank, int ranks, int rows);

// rows of elements around those that a rank works on: whether corners of a converted element hang on nodes
// depends on the elements at its nodes, and on whether nodes of these have an element  (7.14)
const int FRAC_ROWS = 2;

// frac_other_material : are the energies of two elements with a section at equal strain different?
bool frac_other_material(const Elements& el, int a, int b);

// frac_of_node : elements of each node                   [nnode]
ListTable frac_of_node(const Mesh& mesh);


// frac_share : a number of each element [nelem], found by the ranks each for theirs, for all that look at it.
// Collective.
void frac_share(const MeshPart& part, RealVec& x);

// ---- divided model (5.1)
// frac_gather : elements of this rank, from place first on, become those of all ranks, by time of breaking
// and number in the mesh of the deck, which the list holds then; a whole model has them already, in another
// order. Collective.
void frac_gather(const Model& m, const Fracture& fr, IntVec& elem, size_t first);

// frac_releasing : elements under release of all ranks, numbers in the mesh of the deck, in the order of
// breaking. Collective.
IntVec frac_releasing(const Model& m, const Fracture& fr);

// frac_reload : a state as a restart file has it, with indices that are numbers in the mesh of the deck,
// becomes that of here; begin: points at t = 0. False: points or bonds do not fit the model. Collective.
bool frac_reload(const Points& begin, State& st, Model& m, const FracMesh& fm);

// frac_take : divided model: points and bonds of the elements of here from a state that was read
// (state_find_corners, state_read_bonds), with elements and nodes of here (-1: not here); begin: points
// at t = 0. False: it does not fit the model
bool frac_take(const Model& m, const FracMesh& fm, const Points& begin, State& st);

// frac_gone : [nelem] 1: no element any more
IntVec frac_gone(const Fracture& fr);

// frac_begin : nothing is broken yet, but for pre-cracks, which become points after the first increment;
// l: the degradation factors. Collective.
void frac_begin(const Model& m, const FracMesh& fm, Fracture& fr, Level& l);

// frac_near : calls use(element, distance) for all elements whose centre lies within radius of x
template <class Use>
void frac_in_ball(const FracMesh& fm, const double* x, double radius, Use use)
{
  int a[3], b[3];
  for (int i = 0; i < 3; ++i) {
    a[i] = std::max(0, static_cast<int>(std::floor((x[i] - radius - fm.lo[i]) / fm.bin)));
    b[i] = std::min(fm.nbin[i] - 1, static_cast<int>(std::floor((x[i] + radius - fm.lo[i]) / fm.bin)));
  }
  for (int k = a[2]; k <= b[2]; ++k)
    for (int j = a[1]; j <= b[1]; ++j)
      for (int i = a[0]; i <= b[0]; ++i) {
        const int cell = (k * fm.nbin[1] + j) * fm.nbin[0] + i;
        for (int q = fm.in_bin.off[cell]; q < fm.in_bin.off[cell + 1]; ++q) {
          const int e = fm.in_bin.item[q];
          const double* c = &fm.centre[3 * e];
          const double d[3] = {c[0] - x[0], c[1] - x[1], c[2] - x[2]};
          const double r2   = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
          if (r2 < radius * radius) use(e, std::sqrt(r2));
        }
      }
}

// frac_drive : psi+ / volume of an intact element by a law, at the displacements of l              
// force/length^2
double frac_drive(const Model& m, const Step& s, const Elements& el, const FracMesh& fm, const Level& l,
                  int e, Split split);

// frac_average : dynamics: psi+ and its average over time at the converged level l                  (7.26).
// Collective.
//   in   energy    strain energy of intact elements at l, those of this rank  [nelem]
void frac_average(const Model& m, const Step& s, const Elements& el, const FracMesh& fm, const Level& l,
                  const RealVec& energy, Fracture& fr);

// frac_test : elements that break now, strongest first; l: a converged level. doc/theory.md (7.1) - (7.8).
// Collective.
//   in   energy    strain energy of intact elements at l, those of this rank  [nelem]
//   out  first     by how much the criterion is exceeded
void frac_test(const Model& m, const Step& s, const Elements& el, const FracMesh& fm, const Fracture& fr,
               const Level& l, const RealVec& energy, std::vector<Erosion>& out, FirstBreak& first);

// frac_value : what first.value is at another level; first.elem is intact there. Collective.
double frac_value(const Model& m, const Step& s, const Elements& el, const FracMesh& fm, const Fracture& fr,
                  const Level& l, const FirstBreak& first);

// frac_estimate : G of element e by the estimate of its definition, whatever the gates say; J [3]: FORCE: its
// direction
double frac_estimate(const Model& m, const Step& s, const Elements& el, const FracMesh& fm,
                     const Fracture& fr, const Level& l, int e, double J[3]);

// frac_erode : elements break, one after the other: normal, time, counts, in statics or without gradual
// release the degradation factor. Collective.
//   out  released   strain energy of each at fixed displacement
void frac_erode(const Model& m, const Step& s, const Elements& el, const FracMesh& fm,
                const std::vector<Erosion>& all, Fracture& fr, Level& l, RealVec& released);

// frac_when : time at which the criterion of each was met, between l0 and l1, where its value is taken as
// linear (7.15); l0 if it was met there; l1 in statics, with FALLBACK and for elements that drop their stress
// at once. Collective.
//   in   fr      before they break
void frac_when(const Model& m, const Step& s, const Elements& el, const FracMesh& fm, const Fracture& fr,
               const Level& l0, const Level& l1, std::vector<Erosion>& all);

// frac_degrade : degradation factors at the end l1 of an increment dt that begins at l0; statics: c at
// once  (7.15)
void frac_degrade(const Model& m, const Step& s, const FracMesh& fm, const Fracture& fr, const Level& l0,
                  double dt, Level& l1);

// frac_degraded : energy that the degradation between l0 and l1 gives up  (7.16). Collective.
double frac_degraded(const Model& m, const Step& s, const Elements& el, const Points& pts, const Fracture& fr,
                     const Level& l0, const Level& l1);

// frac_count_releasing : Fracture::nreleasing of all ranks. Collective.
void frac_count_releasing(const Model& m, Fracture& fr);

// frac_open : elements whose release is over leave the list; those to become points then are added to
// convert (numbers in the mesh of the deck). Collective.
void frac_open(const Model& m, const FracMesh& fm, const Level& l, Fracture& fr, IntVec& convert);

// frac_due : elements that a distortion or a time turns into points now (numbers in the mesh of the deck).
// Collective.
void frac_due(const Model& m, const Elements& el, const FracMesh& fm, const Fracture& fr, const Level& l,
              IntVec& out);

// frac_convert : elements become material points: corners at the lattice of the element, bonds on the new
// interface.
// Writes form, points, bonds and the level n; velocities and displacements of new corners are those of the
// element. Collective.
//   in   number   in the mesh of the deck, of all ranks; those that are here become points here
void frac_convert(const Model& m, Elements& el, const FracMesh& fm, const IntVec& number, CornerShare& share,
                  State& st);

// frac_torn : broken points whose largest stretch is above RELEASE, or whose volume is below 1/RELEASE of
// that at t = 0: those to be released from their neighbours, and released ones whose shape is to be made
// anew; numbers among the points of all ranks, ascending (7.12). Collective.
void frac_to_release(const Model& m, const FracMesh& fm, const Fracture& fr, const Points& pts, const Level& l,
               IntVec& out);

// frac_release : torn points are released: corners and unknowns of their own, the shape of t = 0 turned, and
// a rigid motion with their mass, linear and, if it needs no energy, angular momentum; the bonds of their
// elements go  (7.13). Collective.
//   in   number   of frac_torn; those that are here are released here
//        last     no frac_convert follows, which forms the interfaces
void frac_release(const Model& m, const FracMesh& fm, const IntVec& number, bool last, State& st);

// The shape that a point would be released with
struct ReleasedShape {
  int number = -1;             // of the point, of all ranks
  Shape shape = SHAPE_QUAD4;
  double scale = 1.0;          // about its centre
  double centre[3], corner[8][3];      // now, with scale 1
};

// frac_room : scales of the shapes with which they overlap no element and no other point, least at least
// (7.34). Collective.
//   in   st      before the release; points of grain do not count with the corners that they have there
//   inout grain  of all ranks, the same on all of them
void frac_room(const Model& m, const State& st, double least, std::vector<ReleasedShape>& released);

// frac_follow : corners of points that go on for nodes whose last element has become points; of several the
// first that is not released. Loads, supports and results of the node go on there.       doc/theory.md (7.18)
//   out  corner   [nnode] >= 0: corner; FOLLOW_ELEMENT: the node has elements, or never had;
//                 FOLLOW_NONE: no corner lies there. Empty: nothing has been converted
enum { FOLLOW_ELEMENT = -1, FOLLOW_NONE = -2 };
void frac_follow(const Model& m, const Fracture& fr, const Points& pts, IntVec& corner);

// frac_interfaces : surfaces of points and bonds of the interfaces, after elements or points have changed
// their form
void frac_interfaces(const Model& m, const FracMesh& fm, State& st);

// ---- fragments (doc/theory.md 7.5) --------------------------------------------

struct Fragment {              // a connected piece; the first of Fragments: all debris
  int nelem = 0, npoint = 0;
  // smallest label: of its elements and of the elements that its points were; of points alone theirs
  int label = 0;
  bool of_mesh = false;        // label is that of an element
  double volume = 0, mass = 0; // volume: at t = 0                                  length^3
  double centre[3] = {0, 0, 0}, velocity[3] = {0, 0, 0};
  double momentum[3] = {0, 0, 0};
  double angular[3] = {0, 0, 0};     // about the centre
  double spin[3] = {0, 0, 0};        // omega of I omega = angular                    1/time
  double kinetic = 0, translation = 0, rotation = 0, rest = 0;   // kinetic = the sum of the other three
  double inertia[6] = {0, 0, 0, 0, 0, 0};   // about the centre: 11 22 33 12 23 31    mass length^2
  double principal[3] = {0, 0, 0};   // ascending
  double axis[9] = {0, 0, 0, 0, 0, 0, 0, 0, 0};   // row k: unit vector that belongs to principal[k]
  double lo[3] = {0, 0, 0}, hi[3] = {0, 0, 0};    // bounding box now
};

struct Fragments {
  std::vector<Fragment> item;  // 0: debris, then fragments by falling mass
  IntVec of_elem;              // [nelem] index into item, -1: no longer an element
  IntVec of_point;             // [npoint]
  int count() const { return static_cast<int>(item.size()) - 1; }
};

// frac_connect : of_elem, of_point of f: 0 debris, 1 ... pieces in the order of their smallest node or
// corner. Returns the number of pieces, of all ranks.  doc/theory.md (7.30)
int frac_connect(const Model& m, const Elements& el, const State& st, Fragments& f);

// frac_measure : item of f from of_elem and of_point; n: pieces.  doc/theory.md (7.31), (7.32)
void frac_measure(const Model& m, const Elements& el, const State& st, int n, Fragments& f);

// frac_fragments : pieces at t(n), numbered by falling mass, and their measures
void frac_fragments(const Model& m, const Elements& el, const State& st, Fragments& f);

// frac_repeat : the conversions and releases of fr once more, of points that are as at t = 0; false: it has
// other ones
//   in   of       points that there are now, which fr.left has corners of: of here, or of all ranks
//   out  number   [ncorner of start] that corner of of, but for those that points were released with
//        left     as Fracture::left, in corners of start
bool frac_repeat(const Model& m, const FracMesh& fm, const Fracture& fr, const Points& of, Points& start,
                 CornerShare& share, IntVec& number, ListTable& left);

// frac_replay : the corners that conversion has shared so far, made again from the points of t = 0 (start):
// neighbours that convert later find the same numbers. False: the points of st are others than those made
// again.
bool frac_replay(const Model& m, const FracMesh& fm, const State& st, Points start, CornerShare& share);

#endif
