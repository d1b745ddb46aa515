// ---------------------------------------------------------------------------
// discretisation.h : elements, laws, grid and contact pairs of a step, derived from model and state
//
// Nothing here is saved: step_open creates it, conversion and step_prepare update it.
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
  GridShare owned;             // points, corners and bonds with lists of the grid
  ActiveGrid grid;
  ContactPairs pairs;
  ContactScene scene;          // general contact: neighbouring faces
  MasterWatch masters;         // contact pairs of a divided model
  OverlapWatch watch;          // pairs of parts without bonds or contact
  FracMesh fm;
  CornerShare share;           // corners created by conversion
  IntVec follow;               // corners that replace nodes without elements, see frac_follow
};

#endif
