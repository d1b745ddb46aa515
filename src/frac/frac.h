// ---------------------------------------------------------------------------
// frac.h : eigenfracture: breaking of elements, and conversion to material points (doc/theory.md 7)
// ---------------------------------------------------------------------------
#ifndef MPFE_FRAC_FRAC_H
#define MPFE_FRAC_FRAC_H

#include <algorithm>
#include <cmath>

#include "bond/bond.h"
#include "elem/elem.h"
#include "model/model_cut.h"
#include "point/point.h"

// Fraction of Gc/h: with less psi+ an element is not tested or averaged (7.26); an element at a tip has 0.1
// (no test)
const double FRAC_MIN_DRIVE = 0.01;

// In element sizes: default radius of the ball by FORCE and by BALL; radius of the ball around a notch in
// which BALL also evaluates J; default spacing in dynamics (theory 7.1)
// (test: fracture/a10_sweep, fracture/start_plate_slit.inp, fracture/a14_motion)
const double FRAC_RADIUS_FORCE = 5.0, FRAC_RADIUS_BALL = 2.0, FRAC_NOTCH = 5.0, FRAC_SPACING = 2.0;
// radius of the region read for a kink, in element sizes  (test: fracture/kink_motion.inp)
const double FRAC_KINK = 6.0;
// the same for the square around a sharp crack                                                     (7.38)
// No case with an interface is divided among ranks  (no test)
const double FRAC_SHARP = 11.0;

// Data of the mesh at t = 0 for fracture and conversion; computed once
struct FracMesh {
  bool on = false;             // elements can break or be converted
  IntVec def;                  // [nelem] index into Model::fracture, -1: cannot break
  IntVec conv;                 // [nelem] index into Model::conversion, -1: stays an element
  RealVec gc;                  // [nelem] toughness, with scatter                   force/length
  RealVec release;             // [nelem] dynamics: time in which psi+ of a broken element falls to c   time
  RealVec average;             // [nelem] dynamics: time over which the criterion averages psi+        time
  RealVec centre;              // [nelem*3]
  RealVec volume;              // [nelem] area x thickness in the plane
  RealVec thickness;           // [nelem] 1 in three dimensions
  // [nelem] h: edge of the square or cube that the element is a part of     length
  RealVec size;
  RealVec local;               // [nelem] h, mean with the neighbours
  IntVec across, across_face;  // [nelem*6] adjacent element at a face, and its face, -1: none
  ListTable of_node;           // [nnode] elements of a node
  // nodes between materials, ascending; [3] normal of the interface there, 0 at a sharp bend         (7.36)
  IntVec between;
  RealVec between_normal;
  // [nelem] radius of the ball searched for the end of a notch, negative: found; 0: not yet searched
  mutable RealVec notch;
  double lo[3] = {0, 0, 0}, bin = 1.0;     // bins of centres
  int nbin[3] = {1, 1, 1};
  ListTable in_bin;            // [bins] elements
};

// One element that breaks
struct Erosion {
  int elem = -1;               // divided model: index here, -1: it is not here
  double value = 0.0;          // criterion over toughness, >= 1
  double rank  = 0.0;          // value by which elements are ordered
  double J[3]  = {0, 0, 0};    // direction of growth times G, 0: unknown
  double time  = 0.0;          // when the criterion was met, by frac_when
  int number = -1, label = 0;  // in the mesh of the deck
  int def = -1;                // index into Model::fracture
  double X[3] = {0, 0, 0};     // centre at t = 0
  double gain = 1.0;           // value over the estimate of the element that represents the front
  double N[3] = {0, 0, 0};     // normal of the crack, 0: from the strain
  double twist = 0.0;          // in space: share of K_III in G
};

// The element with the largest excess of its criterion
struct FirstBreak {
  int elem = -1;               // divided model: index here, -1: it is not here
  int number = -1, label = 0;  // in the mesh of the deck; -1: there is none
  int def = -1;                // index into Model::fracture
  double value = 0.0;          // criterion over the value at which it breaks, >= 1
  double part  = 0.0;          // FALLBACK: fraction of Gc h; 0: by the criterion of its definition
  double gain  = 1.0;          // of a kink over the estimate of elem
};

// frac_mesh : topology, sizes, toughness. Returns the number of errors (messages in the log).
int frac_mesh(const Model& m, const Elements& el, FracMesh& fm);

// frac_outer : [ranks] halo elements that the estimates, gates and crack areas of a rank read, and elements
// at their nodes, ascending; of a model that breaks (7.1) - (7.8), (7.17)
//   in   rank    owner of an element                      [nelem]
//   out  notch   MeshPart::notch                          [nelem]
std::vector<IntVec> frac_outer(const Model& m, const IntVec& rank, int ranks, std::vector<char>& notch);

// frac_around : [ranks] elements of other ranks within this many rows of the own ones, if there is conversion
std::vector<IntVec> frac_around(const Model& m, const IntVec& rank, int ranks, int rows);

// rows of halo elements: whether corners of a converted element hang on nodes depends on the elements at its
// nodes, and on whether their nodes have an element  (7.14)  (test: ranks/compare)
const int FRAC_ROWS = 2;

// frac_other_material : are the energies of two elements with a section at equal strain different?
bool frac_other_material(const Elements& el, int a, int b);

// frac_of_node : elements of each node                   [nnode]
ListTable frac_of_node(const Mesh& mesh);

// frac_share : copies a value of each element [nelem] from its owner to the ranks with it as halo element.
// Collective.
void frac_share(const MeshPart& part, RealVec& x);

// ---- divided model (5.1)
// frac_gather : replaces the elements of this rank, from index first on, by those of all ranks: numbers in
// the mesh of the deck, by time of breaking and number. A model that is not divided has them in another
// order. Collective.
void frac_gather(const Model& m, const Fracture& fr, IntVec& elem, size_t first);

// frac_releasing : elements in release of all ranks, numbers in the mesh of the deck, in the order of
// breaking. Collective.
IntVec frac_releasing(const Model& m, const Fracture& fr);

// frac_reload : converts a state of a restart file, with numbers in the mesh of the deck, to local indices;
// begin: points at t = 0. False: points or bonds do not fit the model. Collective.
bool frac_reload(const Points& begin, State& st, Model& m, const FracMesh& fm);

// frac_take : divided model: extracts points and bonds of the elements of this rank from a state that was
// read (state_find_corners, state_read_bonds), with local elements and nodes (-1: not here); begin: points at
// t = 0. False: it does not fit the model
bool frac_take(const Model& m, const FracMesh& fm, const Points& begin, State& st);

// frac_gone : [nelem] 1: no longer an element
IntVec frac_gone(const Fracture& fr);

// frac_begin : initial state: only pre-cracks are broken, and are converted after the first increment; l: the
// degradation factors. Collective.
void frac_begin(const Model& m, const FracMesh& fm, Fracture& fr, Level& l);

// frac_in_ball : calls use(element, distance) for all elements with a centre within radius of x
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

// frac_drive : psi+ / volume of an intact element by a law, at the displacements of l        force/length^2
double frac_drive(const Model& m, const Step& s, const Elements& el, const FracMesh& fm, const Level& l,
                  int e, Split split);

// frac_uses_energy : is there a criterion of energy? A strength needs none
bool frac_uses_energy(const Model& m);

// frac_average : dynamics: psi+ and its average over time at the converged level l                  (7.26).
// Collective.
//   in   energy    strain energy of owned intact elements at l [nelem]; read if frac_uses_energy
void frac_average(const Model& m, const Step& s, const Elements& el, const FracMesh& fm, const Level& l,
                  const RealVec& energy, Fracture& fr);

// frac_test : elements that break now, highest rank first; l: a converged level. doc/theory.md (7.1) - (7.8).
// Collective.
//   in   start     total time at which the step has begun
//        energy    strain energy of owned intact elements at l [nelem]; read if frac_uses_energy
//   out  first     the element with the largest excess
void frac_test(const Model& m, const Step& s, const Elements& el, const FracMesh& fm, const Fracture& fr,
               const Level& l, double start, const RealVec& energy, std::vector<Erosion>& out,
               FirstBreak& first);

// frac_value : first.value at another level, at which first.elem is intact. Collective.
double frac_value(const Model& m, const Step& s, const Elements& el, const FracMesh& fm, const Fracture& fr,
                  const Level& l, double start, const FirstBreak& first);

// frac_estimate : G of element e by the estimate of its definition, without the gates; J [3]: FORCE: its
// direction
double frac_estimate(const Model& m, const Step& s, const Elements& el, const FracMesh& fm,
                     const Fracture& fr, const Level& l, double start, int e, double J[3]);

// frac_erode : breaks elements, in order: normal, time, counts; in statics or without gradual release also
// the degradation factor. Collective.
//   out  released   strain energy of each at fixed displacement
void frac_erode(const Model& m, const Step& s, const Elements& el, const FracMesh& fm,
                const std::vector<Erosion>& all, Fracture& fr, Level& l, RealVec& released);

// A crack that starts at a re-entrant corner of the surface
struct TrackStart {
  int root = -1;               // element that has opened there
  int node = -1;               // the corner
  // into the material, halfway between both faces; direction of the crack
  double into[2] = {0, 0}, d[2] = {0, 0};
};

// What an increment did to cracks on lines
struct TrackResult {
  // the largest advance of a tip, or opening of a new crack, relative to the largest in one increment
  double advance = 0.0;
  int lost = -1;               // element in which a line ends before what cannot break; -1: none
  std::vector<TrackStart> start;
};

// frac_track : TRACK: after a converged increment: moves the tips of cohesive cracks through the
// elements that have begun to crack, turns them (2.36d), and marks which elements may begin next:  (2.36c)
// those on the lines from the tips, and none beside a crack. Writes the marks to level n.
// Cracks that start at a corner are not added: the increment is to be repeated after frac_start. Collective.
void frac_track(const Model& m, const Step& s, const Elements& el, const FracMesh& fm, State& st,
                TrackResult& result);

// frac_start : adds the tips of such cracks at the start of the increment; result: lines without room, at the
// first marks. Collective.
void frac_start(const Model& m, const Step& s, const Elements& el, const FracMesh& fm,
                const std::vector<TrackStart>& start, State& st, TrackResult& result);

// frac_when : time of the criterion of each on the line through its values at l0 and l1, which may lie before
// l0 (7.15); l1 in statics, with FALLBACK, COHESIVE and for elements with sudden release. Collective.
//   in   fr      before they break, with averages of l0
void frac_when(const Model& m, const Step& s, const Elements& el, const FracMesh& fm, const Fracture& fr,
               const Level& l0, double start, const Level& l1, std::vector<Erosion>& all);

// frac_degrade : degradation factors at the end l1 of an increment dt from l0; statics: c at once  (7.15)
void frac_degrade(const Model& m, const Step& s, const FracMesh& fm, const Fracture& fr, const Level& l0,
                  double dt, Level& l1);

// frac_degraded : energy of owned elements released by degradation between l0 and l1              (7.16)
double frac_degraded(const Model& m, const Step& s, const Elements& el, const Points& pts, const Fracture& fr,
                     const Level& l0, const Level& l1);

// frac_forces : adds sign times the internal forces of the owned elements of all, before or after they break,
// in level l without viscosity to f [nnode*dim]
void frac_forces(const Model& m, const Step& s, const Elements& el, const std::vector<Erosion>& all,
                 const Level& l, double sign, RealVec& f);

// frac_count_releasing : Fracture::nreleasing of all ranks. Collective.
void frac_count_releasing(const Model& m, Fracture& fr);

// frac_open : removes elements after their release from the list; those to be converted are added to convert
// (numbers in the mesh of the deck). Collective.
void frac_open(const Model& m, const FracMesh& fm, const Level& l, Fracture& fr, IntVec& convert);

// frac_due : elements to be converted now by distortion or time (numbers in the mesh of the deck).
// Collective.
void frac_due(const Model& m, const Elements& el, const FracMesh& fm, const Fracture& fr, const Level& l,
              IntVec& out);

// frac_convert : converts elements to material points: corners on the lattice of the element, bonds on the
// new interface. Writes phase, points, bonds and the level n; new corners have velocities and displacements
// of the element. Collective.
//   in   number   in the mesh of the deck, of all ranks
void frac_convert(const Model& m, Elements& el, const FracMesh& fm, const IntVec& number, CornerShare& share,
                  State& st);

// frac_to_release : broken points with a largest stretch above RELEASE, or a volume ratio below 1/RELEASE: to
// be released from their neighbours, or, if released already, reshaped; numbers among the points of all
// ranks, ascending (7.12). Collective.
void frac_to_release(const Model& m, const FracMesh& fm, const Fracture& fr, const Points& pts,
                     const Level& l, IntVec& out);

// frac_release : releases points: they get corners and unknowns of their own, the rotated shape of t = 0, and
// a rigid motion that conserves mass, linear momentum and, unless energy would increase, angular momentum;
// the bonds of their elements are deleted (7.13). Collective.
//   in   number   from frac_to_release
//        last     form the interfaces: no frac_convert follows
void frac_release(const Model& m, const FracMesh& fm, const IntVec& number, bool last, State& st);

// Shape of a point after its release
struct ReleasedShape {
  int number = -1;             // of the point, of all ranks
  Shape shape = SHAPE_QUAD4;
  double scale = 1.0;          // about its centre
  double centre[3], corner[8][3];      // present positions, with scale 1
};

// frac_room : scales of the shapes, not below least, without overlap with elements or other points  (7.34).
// Collective.
//   in   st        before the release; the points of released are ignored there
//   inout released  shapes of all ranks, equal on all
void frac_room(const Model& m, const State& st, double least, std::vector<ReleasedShape>& released);

// frac_follow : corners of points that replace nodes whose last element has been converted; of several the
// first that is not released. Loads, supports and results of the node are transferred.   doc/theory.md (7.18)
//   out  corner   [nnode] >= 0: corner; FOLLOW_ELEMENT: the node has elements, or never had;
//                 FOLLOW_NONE: no corner at the node. Empty: no conversion yet
enum { FOLLOW_ELEMENT = -1, FOLLOW_NONE = -2 };
void frac_follow(const Model& m, const Fracture& fr, const Points& pts, IntVec& corner);

// frac_interfaces : surfaces of points and bonds of the interfaces, after conversion or release
void frac_interfaces(const Model& m, const FracMesh& fm, State& st);

// ---- fragments (doc/theory.md 7.5) --------------------------------------------

struct Fragment {              // a connected fragment; the first of Fragments: all debris
  int nelem = 0, npoint = 0;
  // smallest label of its elements and parent elements of its points; without any, of its points
  int label = 0;
  bool of_mesh = false;        // label of an element
  double volume = 0, mass = 0; // volume: at t = 0                                  length^3
  double centre[3] = {0, 0, 0}, velocity[3] = {0, 0, 0};
  double momentum[3] = {0, 0, 0};
  double angular[3] = {0, 0, 0};     // about the centre
  double spin[3] = {0, 0, 0};        // omega of I omega = angular                    1/time
  double kinetic = 0, translation = 0, rotation = 0, rest = 0;   // kinetic: sum of the other three
  double inertia[6] = {0, 0, 0, 0, 0, 0};   // about the centre: 11 22 33 12 23 31    mass length^2
  double principal[3] = {0, 0, 0};   // ascending
  double axis[9] = {0, 0, 0, 0, 0, 0, 0, 0, 0};   // row k: unit vector of principal[k]
  double lo[3] = {0, 0, 0}, hi[3] = {0, 0, 0};    // present bounding box
};

struct Fragments {
  std::vector<Fragment> item;  // 0: debris, then fragments by decreasing mass
  IntVec of_elem;              // [nelem] index into item, -1: no longer an element
  IntVec of_point;             // [npoint]
  int count() const { return static_cast<int>(item.size()) - 1; }
};

// frac_points_open : points of the deck whose cohesive crack opened between l0 and l1, of all ranks in the
// order of their labels; their number, crack area and position are added to fr. Collective
std::vector<ErosionLog> frac_points_open(const Model& m, const Points& pts, const Level& l0, const Level& l1,
                                         Fracture& fr);

// frac_connect : of_elem, of_point of f: 0 debris, 1 ... fragments in the order of their smallest node or
// corner. Returns the number of fragments, of all ranks.  doc/theory.md (7.30)
int frac_connect(const Model& m, const Elements& el, const State& st, Fragments& f);

// frac_measure : item of f from of_elem and of_point; n: fragments.  doc/theory.md (7.31), (7.32)
void frac_measure(const Model& m, const Elements& el, const State& st, int n, Fragments& f);

// frac_fragments : fragments at t(n), numbered by decreasing mass, with their data
void frac_fragments(const Model& m, const Elements& el, const State& st, Fragments& f);

// frac_repeat : repeats the conversions and releases of fr from the points of t = 0 (start); false: the
// points do not match
//   in   of       present points, of this rank or of all ranks, whose corners fr.left names
//   out  number   [ncorner of start] corner in of, except for corners left at a release
//        left     as Fracture::left, in corners of start
bool frac_repeat(const Model& m, const FracMesh& fm, const Fracture& fr, const Points& of, Points& start,
                 CornerShare& share, IntVec& number, ListTable& left);

// frac_replay : reconstructs the corners shared by conversion so far from the points of t = 0 (start), so
// that later conversions find the same numbers. False: the points of st do not match.
bool frac_replay(const Model& m, const FracMesh& fm, const State& st, Points start, CornerShare& share);

#endif
