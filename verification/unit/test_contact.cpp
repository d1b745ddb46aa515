// General contact: tree of boxes, outer faces, near faces, projection on distorted faces.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "base/box_tree.h"
#include "bond/bond.h"
#include "contact/contact.h"
#include "contact/contact_meet.h"
#include "contact/contact_scene.h"
#include "shape/face.h"

namespace {

using Random = std::mt19937;

double number(Random& random, double lo, double hi)
{
  return std::uniform_real_distribution<double>(lo, hi)(random);
}

// adds a unit cube of n^3 bricks, its lower side at z0
void add_cube(Model& m, int n, double z0)
{
  Mesh& mesh = m.mesh;
  const int first = mesh.nnode(), row = n + 1, layer = row * row;
  for (int k = 0; k <= n; ++k)
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= n; ++i) {
        mesh.X.insert(mesh.X.end(), {double(i) / n, double(j) / n, z0 + double(k) / n});
        mesh.node_label.push_back(mesh.nnode() + 1);
      }
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const int a = first + i + row * j + layer * k;
        for (int up : {a, a + layer})
          mesh.conn.item.insert(mesh.conn.item.end(), {up, up + 1, up + 1 + row, up + row});
        mesh.conn.off.push_back(static_cast<int>(mesh.conn.item.size()));
        mesh.elem_label.push_back(mesh.nelem());
        mesh.elem_type.push_back(ELEM_C3D8);
        mesh.elem_section.push_back(0);
      }
}

// one section, *CONTACT of all with all
Model contact_model()
{
  Model m;
  m.dim = 3;
  Material mat;
  mat.young = mat.density = 1.0;
  m.material.push_back(mat);
  m.section.push_back(Section{0, 0, 1.0, {}});
  BondDef d;
  d.kind    = BOND_CONTACT;
  d.contact.general = true;
  d.contact.include.resize(1);
  m.bond.push_back(d);
  return m;
}

// two cubes of bricks on each other that share no node
Model two_cubes(int below, int above)
{
  Model m = contact_model();
  add_cube(m, below, 0.0);
  add_cube(m, above, 1.0);
  return m;
}

struct Scene {
  Model m;
  Points pts;
  Bonds bonds;
  RealVec u, uc;
  ContactScene near;
};

ContactPairs search(Scene& s, ContactScene& scene)
{
  RealVec xb;
  ContactPairs pairs;
  bond_places(s.m, s.pts, s.bonds, s.u, s.uc, xb);
  scene_update(s.m, s.pts, s.bonds, s.u, s.uc, true, 0.0, scene);
  Level l;
  l.u  = s.u;
  l.uc = s.uc;
  l.slip.assign(static_cast<std::size_t>(s.bonds.nbond) * s.m.dim, 0.0);
  contact_search(s.m, s.pts, s.bonds, l, xb, scene, pairs);
  return pairs;
}

void shake(Random& random, double size, RealVec& u)
{
  for (double& x : u) x += number(random, -size, size);
}

}  // namespace

TEST(Contact, TreeFindsWhatAllPairsFind)
{
  Random random(1);
  for (int n : {0, 1, 8, 9, 500}) {
    std::vector<BoundingBox> box(n);
    for (BoundingBox& b : box)
      for (int i = 0; i < 3; ++i) {
        b.lo[i] = number(random, 0.0, 1.0);
        b.hi[i] = b.lo[i] + number(random, 0.0, 0.2);
      }
    if (n > 9) box[7] = box[9] = box[100];             // at the same place
    const BoxTree tree(box);
    for (int k = 0; k < n; ++k) {
      IntVec found, all;
      tree.overlap(box[k], found);
      std::sort(found.begin(), found.end());
      for (int j = 0; j < n; ++j) {
        bool apart = false;
        for (int i = 0; i < 3; ++i)
          apart = apart || box[k].lo[i] > box[j].hi[i] || box[j].lo[i] > box[k].hi[i];
        if (!apart) all.push_back(j);
      }
      EXPECT_EQ(all, found);
    }
  }
}

TEST(Contact, SkinIsWhatHasOneOwnerAndIsNotTied)
{
  Model m = contact_model();
  Fracture fr;
  Points pts;
  add_cube(m, 3, 0.0);
  EXPECT_EQ(54u, contact_skin(m, fr, pts, {}).size());
  // the brick in the middle is lost: six faces inside; one at a corner: three go, three come
  fr.phase.assign(27, AS_ELEMENT);
  fr.phase[13] = AS_NOTHING;
  EXPECT_EQ(60u, contact_skin(m, fr, pts, {}).size());
  fr.phase[13] = AS_ELEMENT;
  fr.phase[0]  = AS_NOTHING;
  EXPECT_EQ(54u, contact_skin(m, fr, pts, {}).size());
  fr.phase.clear();
  // without a section it is no finite element
  m.mesh.elem_section[13] = -1;
  EXPECT_EQ(60u, contact_skin(m, fr, pts, {}).size());
  m.mesh.elem_section[13] = 0;
  // tied by conversion, tied by *BOND
  const std::vector<SkinFace> all = contact_skin(m, fr, pts, {});
  const std::vector<SkinFace> one = contact_skin(m, fr, pts, {{all[5].elem, all[5].face}});
  EXPECT_EQ(53u, one.size());
  EXPECT_EQ(one.end(), std::find(one.begin(), one.end(), all[5]));
  m.surface.resize(1);
  m.surface[0].face = {{all[0].elem, all[0].face}, {all[1].elem, all[1].face}};
  BondDef tie;
  tie.surface = 0;
  m.bond.push_back(tie);
  EXPECT_EQ(52u, contact_skin(m, fr, pts, {}).size());
  m.bond.erase(m.bond.begin());                        // no *CONTACT, no skin
  EXPECT_TRUE(contact_skin(m, fr, pts, {}).empty());
}

// near faces are kept while motions are small: what is met is what a new list gives
TEST(Contact, NearFacesHoldForSmallMotions)
{
  Random random(2);
  Scene s;
  s.m = two_cubes(3, 4);
  s.u.assign(s.m.mesh.X.size(), 0.0);
  const std::vector<SkinFace> skin = contact_skin(s.m, Fracture(), s.pts, {});
  bond_skin(s.m, s.pts, skin, s.bonds);
  EXPECT_EQ(6u * (9 + 16), skin.size());
  EXPECT_EQ(16 * 6 * (9 + 16), s.bonds.nbond);
  search(s, s.near);
  const double margin = s.near.margin;
  for (int k = 0; k < 20; ++k) {
    shake(random, 0.02 * margin, s.u);
    ContactScene fresh;
    const ContactPairs kept = search(s, s.near), anew = search(s, fresh);
    EXPECT_GT(kept.near, 16 * 16);
    EXPECT_EQ(anew.master.off, kept.master.off);
    EXPECT_EQ(anew.master.item, kept.master.item);
    EXPECT_EQ(anew.gap, kept.gap);
    EXPECT_EQ(anew.face, kept.face);
  }
  EXPECT_EQ(1, s.near.built);
  // a large motion: another list, as if made from nothing
  for (size_t n = 0; n < s.m.mesh.X.size() / 3; ++n)
    if (s.m.mesh.X[3 * n + 2] > 1.5) s.u[3 * n] += margin;
  ContactScene fresh;
  search(s, s.near);
  search(s, fresh);
  EXPECT_EQ(2, s.near.built);
  EXPECT_EQ(fresh.near.off, s.near.near.off);
  EXPECT_EQ(fresh.near.item, s.near.near.item);
}

// elements leave and return: lists and contact points are those made from nothing, and points of faces that
// stay keep their state
TEST(Contact, ChangedFacesRenewTheirListsAndPointsAlone)
{
  Random random(3);
  Scene s;
  s.m = two_cubes(3, 4);
  s.u.assign(s.m.mesh.X.size(), 0.0);
  Fracture fr;
  fr.phase.assign(s.m.mesh.nelem(), AS_ELEMENT);
  bond_skin(s.m, s.pts, contact_skin(s.m, fr, s.pts, {}), s.bonds);
  search(s, s.near);
  const IntVec lost(s.m.mesh.nnode(), 0);
  for (int k = 0; k < 8; ++k) {
    const std::vector<SkinFace> before = s.bonds.contact.skin;
    const IntVec skin_of = s.bonds.contact.skin_of;
    int& phase = fr.phase[(13 * k) % s.m.mesh.nelem()];
    phase      = phase == AS_ELEMENT && k != 6 ? AS_NOTHING : AS_ELEMENT;
    if (k == 6) std::fill(fr.phase.begin(), fr.phase.end(), AS_ELEMENT);
    Level l;
    for (int q = 0; q < s.bonds.nbond; ++q) {        // state: the name of the point
      const SkinFace& f = before[skin_of[q]];
      l.slip.insert(l.slip.end(), 3, -1.0 - 100.0 * f.elem - f.face);
    }
    l.lambda = l.slip;
    l.lambda_n.assign(s.bonds.nbond, -1.0);
    const IntVec fresh = bond_rebuild(s.m, s.pts, {}, lost, contact_skin(s.m, fr, s.pts, {}), s.bonds, l);
    Bonds anew;
    bond_skin(s.m, s.pts, s.bonds.contact.skin, anew);
    EXPECT_EQ(anew.nbond, s.bonds.nbond);
    EXPECT_EQ(anew.a.off, s.bonds.a.off);
    EXPECT_EQ(anew.a.item, s.bonds.a.item);
    EXPECT_EQ(anew.a_w, s.bonds.a_w);
    EXPECT_EQ(anew.X, s.bonds.X);
    EXPECT_EQ(anew.area, s.bonds.area);
    EXPECT_EQ(anew.normal, s.bonds.normal);
    EXPECT_EQ(anew.contact.skin_of, s.bonds.contact.skin_of);
    EXPECT_EQ(anew.contact.skin_penalty, s.bonds.contact.skin_penalty);
    EXPECT_GT(fresh.size(), 0u);
    for (int q = 0; q < s.bonds.nbond; ++q) {
      const SkinFace& f = s.bonds.contact.skin[s.bonds.contact.skin_of[q]];
      const bool was    = std::find(before.begin(), before.end(), f) != before.end();
      EXPECT_EQ(was ? -1.0 - 100.0 * f.elem - f.face : 0.0, l.slip[3 * q]);
      EXPECT_EQ(was ? -1.0 : 0.0, l.lambda_n[q]);
      EXPECT_EQ(!was, std::find(fresh.begin(), fresh.end(), q) != fresh.end());
    }
    shake(random, 0.01 * s.near.margin, s.u);
    ContactScene none;
    const ContactPairs kept = search(s, s.near), met = search(s, none);
    EXPECT_GT(met.near, 0);
    EXPECT_EQ(met.master.off, kept.master.off);
    EXPECT_EQ(met.master.item, kept.master.item);
    EXPECT_EQ(met.gap, kept.gap);
    EXPECT_EQ(met.face, kept.face);
    EXPECT_EQ(none.alone, s.near.alone);
    EXPECT_EQ(none.X, s.near.X);
  }
  EXPECT_EQ(0.0, s.near.u[0]);           // renewed eight times, never made anew
}

// far from a distorted face Newton's method need not converge: it must not end on the face by chance
TEST(Contact, NoPlaceFarFromADistortedFaceMeetsIt)
{
  Random random(3);
  for (int k = 0; k < 20000; ++k) {
    const double X[8] = {-1, -1, 1, -1, 1, 1, -1, 1};
    MasterFace f;
    f.n = f.all = f.kind = 4;
    f.size = 2.0;
    for (int n = 0; n < 4; ++n)
      for (int i = 0; i < 3; ++i) {
        f.x[3 * n + i] = i < 2 ? X[2 * n + i] + number(random, -0.4, 0.4) : 0.0;
        f.lo[i] = -1.4;
        f.hi[i] = 1.4;
      }
    const double angle = number(random, 0.0, 7.0), far = number(random, 2.1, 4.0);
    const double p[3] = {far * std::cos(angle), far * std::sin(angle), 0.01};
    Hit hit;
    EXPECT_EQ(PROJ_NONE, contact_meet(f, p, 4.0, hit));
  }
}

namespace {

// the face with its nodes turned round by k
MasterFace turned(const MasterFace& f, int k)
{
  MasterFace out = f;
  for (int n = 0; n < f.n; ++n) std::copy_n(f.x + 3 * ((n + k) % f.n), 3, out.x + 3 * n);
  return out;
}

// squared distance of p from the nearest of many places of the face
double least_of_many(const MasterFace& f, const double* p)
{
  const int many = 60;
  double least   = 1e300;
  for (int i = 0; i <= many; ++i)
    for (int j = 0; j <= (f.n == 3 ? many - i : many); ++j) {
      const double a = double(i) / many, b = double(j) / many;
      const double N[2][4] = {{1 - a - b, a, b, 0}, {(1 - a) * (1 - b), a * (1 - b), a * b, (1 - a) * b}};
      double distance2 = 0.0;
      for (int c = 0; c < 3; ++c) {
        double r = p[c];
        for (int n = 0; n < f.n; ++n) r -= N[f.n - 3][n] * f.x[3 * n + c];
        distance2 += r * r;
      }
      least = std::min(least, distance2);
    }
  return least;
}

}  // namespace

// over the face, beside its edges and its corners; whichever node comes first
TEST(Contact, TheNearestPlaceOfAFaceIsTheNearest)
{
  Random random(4);
  for (int k = 0; k < 4000; ++k) {
    const double X[2][8] = {{-1, -1, 1, -1, 0, 1}, {-1, -1, 1, -1, 1, 1, -1, 1}};
    MasterFace f;
    f.n = f.all = f.kind = 3 + k % 2;
    f.size = 3.0;
    for (int n = 0; n < f.n; ++n)
      for (int i = 0; i < 3; ++i)
        f.x[3 * n + i] = i < 2 ? X[f.n - 3][2 * n + i] + number(random, -0.4, 0.4) : 0.0;
    const double p[3] = {number(random, -2, 2), number(random, -2, 2), number(random, -0.5, 0.5)};
    Hit hit, other;
    bool over;
    contact_nearest(f, p, over, hit);
    const double least = std::sqrt(least_of_many(f, p)), found = std::hypot(hit.r[0], hit.r[1], hit.r[2]);
    EXPECT_LE(found, least + 1e-12);
    EXPECT_GE(found, least - 0.1);                   // half a piece
    for (int turn = 1; turn < f.n; ++turn) {
      contact_nearest(turned(f, turn), p, over, other);
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(hit.r[i], other.r[i], 1e-12);
      for (int n = 0; n < f.n; ++n) EXPECT_NEAR(hit.N[(n + turn) % f.n], other.N[n], 1e-10);
    }
  }
}

// on bent faces of quadratic elements the vector to the point is square to the face, and a point of the face
// itself is found
TEST(Contact, TheProjectionOnABentFaceIsSquareToIt)
{
  Random random(5);
  const double X[2][16] = {{0, 0, 1, 0, 0, 1, 0.5, 0, 0.5, 0.5, 0, 0.5},
                           {-1, -1, 1, -1, 1, 1, -1, 1, 0, -1, 1, 0, 0, 1, -1, 0}};
  for (int k = 0; k < 400; ++k) {
    MasterFace f;
    f.n    = 3 + k % 2;
    f.all  = f.kind = 2 * f.n;
    f.size = 2.0;
    for (int n = 0; n < f.all; ++n)
      for (int i = 0; i < 3; ++i)
        f.x[3 * n + i] = (i < 2 ? X[f.n - 3][2 * n + i] : 0.0) + number(random, -0.05, 0.05);
    const double xi[2] = {number(random, 0.2, 0.4), number(random, 0.2, 0.4)};
    double N[MAX_FACE_NODES], dN[2 * MAX_FACE_NODES], n[3], p[3];
    const double norm = face_area(f.kind, f.x, xi, n), up = number(random, -0.2, 0.2);
    face_eval(f.kind, xi, N, dN);
    for (int i = 0; i < 3; ++i) {
      p[i] = up * n[i] / norm;
      for (int a = 0; a < f.all; ++a) p[i] += N[a] * f.x[3 * a + i];
    }
    Hit hit;
    bool over;
    contact_nearest(f, p, over, hit);
    EXPECT_TRUE(over);
    EXPECT_NEAR(hit.gap, up, 1e-10);
    for (int a = 0; a < f.all; ++a) EXPECT_NEAR(hit.N[a], N[a], 1e-9);
  }
}

// of equally near faces around a sharp corner the first counts, whichever is nearer by rounding; before it one
// that the place lies over, when it lies beside the other
TEST(Contact, EquallyNearFacesKeepTheirOrder)
{
  for (const double beside : {0.0, 0.1})
    for (const double more : {-1e-17, 1e-17}) {
      MasterFace face[2];
      Projection kind = PROJ_NONE;
      std::vector<Hit> best;
      for (int k = 0; k < 2; ++k) {
        face[k].size = 1.0;
        Hit hit;
        hit.face = &face[k];
        hit.gap  = -0.5 + k * more;
        const double n[3] = {k ? -0.6 : 0.6, 0.8, 0.0}, across[3] = {0.0, 0.0, k ? 0.0 : beside};
        for (int i = 0; i < 3; ++i) {
          hit.n[i] = n[i];
          hit.r[i] = hit.gap * n[i] + across[i];
        }
        contact_nearer(hit, PROJ_OVER, kind, best);
      }
      contact_equal(best);
      ASSERT_EQ(1u, best.size());
      EXPECT_EQ(&face[beside > 0.0], best[0].face);
    }
}

// a penetration of rounding is not kept, a small one is; the force is that of the penetration
TEST(Contact, RoundingIsNoPenetration)
{
  Model m;
  Bonds bonds;
  ContactPairs pairs;
  KernelMode mode;
  m.dim = 2;
  bonds.cn = bonds.ct = {1.0};
  bonds.contact.deep = {0.0};
  pairs.normal = {0.0, 1.0};
  pairs.size   = {10.0};
  pairs.rounding = {1e-11};
  for (const double friction : {0.0, 0.3})
    for (const double gap : {-1e-10, -1e-12, 0.0, 1e-12}) {
      const double s[2] = {0.0, 0.0}, t0[2] = {0.0, 0.0};
      double f[2], t1[2], slipped;
      bonds.contact.friction = {friction};
      pairs.gap      = {gap};
      EXPECT_EQ(gap == -1e-12 ? 0.0 : gap,
                contact_force(m, bonds, pairs, 0, mode, s, t0, 0.0, f, nullptr, t1, &slipped));
      EXPECT_EQ(std::min(gap, 0.0), f[1]);
    }
}

// what pushes keeps its stiffness and takes the friction of the face on which it slides
TEST(Contact, FrictionIsOfTheFaceThatIsMet)
{
  Bonds bonds;
  ContactPairs pairs;
  Level l;
  bonds.nbond = 2;
  bonds.area = bonds.cn = bonds.ct = {2.0, 2.0};
  bonds.contact.friction = bonds.contact.deep = {0.1, 0.1};
  bonds.contact.skin.resize(1);
  bonds.contact.skin_of  = {0, 0};
  pairs.penalty  = {30.0, 30.0};
  pairs.friction = {0.5, 0.5};
  pairs.stick    = {0.0, 7.0};
  pairs.master.item = {0, 0};
  pairs.master.off  = {0, 1, 2};
  l.slip = {-1e-3, 0.0, 0.0, 0.0};
  contact_stiffness(l, 2, false, pairs, bonds);
  EXPECT_EQ((RealVec{2.0, 60.0}), bonds.cn);
  EXPECT_EQ((RealVec{2.0, 14.0}), bonds.ct);
  EXPECT_EQ((RealVec{0.5, 0.5}), bonds.contact.friction);
}

// held across and not along: inside the body whose half is computed. Held in all directions: a floor
TEST(Contact, PlanesOfSymmetryAreNoOuterFaces)
{
  Model m = two_cubes(2, 2);
  Points pts;
  Prescribed across, along;
  for (int n = 0; n < m.mesh.nnode(); ++n)
    if (m.mesh.X[3 * n] == 0.0) across.node.push_back(n);
  across.first = across.last = 0;
  along = across;
  along.last = 2;
  m.step.resize(2);
  for (Step& step : m.step) step.prescribed = {across};
  EXPECT_EQ(2u * (24 - 4), contact_skin(m, Fracture(), pts, {}).size());
  m.step[1].prescribed = {along};
  EXPECT_EQ(2u * (24 - 4), contact_skin(m, Fracture(), pts, {}).size());
  m.step[0].prescribed = {along};
  EXPECT_EQ(2u * 24, contact_skin(m, Fracture(), pts, {}).size());
  m.step[0].prescribed.clear();
  EXPECT_EQ(2u * 24, contact_skin(m, Fracture(), pts, {}).size());
  m.step[0].prescribed = {across};
  m.step[0].prescribed[0].value.value = 0.1;
  EXPECT_EQ(2u * 24, contact_skin(m, Fracture(), pts, {}).size());
}
