// ---------------------------------------------------------------------------
// point_body.h : the domain of one point as a body: corners, their motion, pairs of its consistent mass
// ---------------------------------------------------------------------------
#ifndef MPFE_POINT_POINT_BODY_H
#define MPFE_POINT_POINT_BODY_H

#include <Eigen/Dense>

#include "point/point.h"

// Positions at t = 0 and now, and velocities of the corners; 0 beyond the dimension of the model
struct DomainBody {
  int n = 0;
  Eigen::Vector3d X[8], x[8], v[8];
  double m[8][8], mc[8], mass = 0.0;   // pairs of the mass, their rows, all
};

// point_gradient : from + sum_c value_c (x) G_c over the corners of point p: F of displacements         (3.5)
//   in   value   [ncorner*dim]
Eigen::Matrix3d point_gradient(const Points& pts, int dim, const RealVec& value, int p,
                               const Eigen::Matrix3d& from = Eigen::Matrix3d::Identity());

// point_body : of point p at level l
DomainBody point_body(const Points& pts, int dim, const Level& l, int p);

// body_mean : mean of values of the corners by their masses
Eigen::Vector3d body_mean(const DomainBody& g, const Eigen::Vector3d* value);

// body_momentum, body_energy : angular momentum of the velocities w of the corners at r, kinetic energy
Eigen::Vector3d body_momentum(const DomainBody& g, const Eigen::Vector3d* r, const Eigen::Vector3d* w);
double body_energy(const DomainBody& g, const Eigen::Vector3d* w);

// body_spin : angular velocity that gives the body with corners at r from its centre the angular momentum L;
// in the plane about axis 3
Eigen::Vector3d body_spin(const DomainBody& g, int dim, const Eigen::Vector3d* r, const Eigen::Vector3d& L);

#endif
