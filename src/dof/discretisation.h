// ---------------------------------------------------------------------------
// discretisation.h : what model and state become for a step: elements, laws, grid, pairs
//
// Nothing here is saved: step_open makes it, conversion and step_prepare renew it.
// ---------------------------------------------------------------------------
#ifndef MPFE_DOF_DISCRETISATION_H
#define MPFE_DOF_DISCRETISATION_H

#include "bond/bond.h"
#include "contact/contact.h"
#include "contact/contact_near.h"
#include "contact/contact_scene.h"
#include "contact/overlap.h"
#include "elem/elem.h"
#include "frac/frac.h"
#include "point/point.h"

struct Discretisation {
  Elements el;
  PointLaws point_law;
  GridShare mine;              // what the grid has lists for
  ActiveGrid grid;
  ContactPairs pairs;
  ContactScene scene;          // general contact: faces that are near
  MasterWatch masters;         // contact pairs of a divided model
  OverlapWatch watch;          // parts that nothing keeps apart
  FracMesh fm;
  CornerShare share;           // corners that conversion has made
  IntVec follow;               // corners that go on for nodes without elements, see frac_follow
};

#endif
