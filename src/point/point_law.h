// ---------------------------------------------------------------------------
// point_law.h : the law of one point, and the gradient of its displacements
// ---------------------------------------------------------------------------
#ifndef MPFE_POINT_POINT_LAW_H
#define MPFE_POINT_POINT_LAW_H

#include "point/point.h"

// point_law_of : law of the intact points of a body
MatLaw point_law_of(const Model& m, const Body& body);

// point_law_now : law of point p, from the law of its body: intact, or broken with degradation factor c
//   in   l   cohesive: t(n)
MatLaw point_law_now(const Model& m, const Points& pts, const MatLaw& of_body, const Level& l,
                     CrackTangent tangent, int p, double c);

// point_volume_penalty : stiffness of theta - thetabar of a point, of a law with plastic flow         (1.14a)
//   force/length^2
double point_volume_penalty(const MatLaw& law);

// point_dudX : displacement gradient of point p: sum_c u_c (x) G_c                              (3.5)
template <int D>
inline void point_dudX(const Points& pts, const RealVec& uc, int p, double* H)
{
  for (int k = 0; k < D * D; ++k) H[k] = 0.0;
  const double* G = pts.G(p);
  for (int a = 0; a < pts.conn.count(p); ++a) {
    const int c = pts.conn.begin(p)[a];
    for (int i = 0; i < D; ++i) {
      const double u = uc[c * D + i];
      for (int j = 0; j < D; ++j) H[i * D + j] += u * G[a * D + j];
    }
  }
}

#endif
