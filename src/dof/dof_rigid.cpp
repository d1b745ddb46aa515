// *RIGID BODY in explicit steps with NLGEOM: the nodes turn as one by finite angles. Their ties have the arms
// of now as coefficients: doc/theory.md (6.41)

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "base/turn.h"
#include "dof/dof.h"

namespace {

using Vec = Eigen::Vector3d;

// from one node to another in the motion u [nnode*dim]
Vec arm_of(const Model& m, const RealVec& u, int from, int to)
{
  Vec r = Vec::Zero();
  for (int i = 0; i < m.dim; ++i)
    r(i) = m.mesh.X[3 * to + i] + u[to * m.dim + i] - m.mesh.X[3 * from + i] - u[from * m.dim + i];
  return r;
}

// the rotation of a node without elements, in the plane about z
Vec turn_of(const Dofs& s, int node, const RealVec& x)
{
  const int row = s.rows.row_of_node[node], dim = s.rows.dim;
  if (dim == 2) return Vec(0.0, 0.0, x[row * dim]);
  return Vec(x[row * dim], x[row * dim + 1], x[row * dim + 2]);
}

// exp of a rotation vector times r: Rodrigues
Vec turned(const Vec& t, const Vec& r)
{
  const double angle = t.norm(), half = 0.5 * angle;
  const double a = angle > 1e-8 ? std::sin(angle) / angle : 1.0;
  const double b = angle > 1e-8 ? 0.5 * std::sin(half) * std::sin(half) / (half * half) : 0.5;
  return r + a * t.cross(r) + b * t.cross(t.cross(r));
}

// calls use(tie, node, direction) for the ties of body b
template <class Use>
void each_tie(const Model& m, const Ties& t, size_t b, Use use)
{
  int k = t.rigid[b];
  for (int n : m.rigid[b].node)
    for (int i = 0; i < m.dim; ++i) use(k++, n, i);
}

}  // namespace

void rigid_ties(const Model& m, const Step& step, const DofRows& rows, Ties& t)
{
  t.rigid.clear();
  if (!step.explicit_steps() || !step.nlgeom) return;
  for (const RigidBody& b : m.rigid) {
    const int ref = rows.row_of_node[b.ref] * m.dim, turn = rows.row_of_node[b.turn] * m.dim;
    t.rigid.push_back(static_cast<int>(t.dof.size()));
    for (int n : b.node)
      for (int i = 0; i < m.dim; ++i) {
        t.dof.push_back(rows.row_of_node[n] * m.dim + i);
        t.master.item.push_back(ref + i);
        if (m.dim == 2) t.master.item.push_back(turn);
        for (int j = 0; j < 3 && m.dim == 3; ++j)
          if (j != i) t.master.item.push_back(turn + j);
        t.master.off.push_back(static_cast<int>(t.master.item.size()));
      }
  }
  t.coef.resize(t.master.item.size(), 1.0);
}

void rigid_arms(const Model& m, const RealVec& u, Ties& t)
{
  for (size_t b = 0; b < t.rigid.size(); ++b)
    each_tie(m, t, b, [&](int k, int n, int i) {
      const Vec r = arm_of(m, u, m.rigid[b].ref, n);
      double* coef = &t.coef[t.master.off[k]];
      coef[0] = 1.0;
      if (m.dim == 2) coef[1] = turn_coef(2, r.data(), i, 0);
      for (int j = 0, at = 1; j < 3 && m.dim == 3; ++j)
        if (j != i) coef[at++] = turn_coef(3, r.data(), i, j);
    });
}

void rigid_leap(const Model& m, const RealVec& u, const Dofs& s, RealVec& du)
{
  const Ties& t = s.bound.tie;
  for (size_t b = 0; b < t.rigid.size(); ++b) {
    const Vec angle = turn_of(s, m.rigid[b].turn, du);
    const int ref   = s.rows.row_of_node[m.rigid[b].ref] * m.dim;
    each_tie(m, t, b, [&](int k, int n, int i) {
      const Vec r  = arm_of(m, u, m.rigid[b].ref, n);
      du[t.dof[k]] = du[ref + i] + turned(angle, r)(i) - r(i);
    });
  }
}

void rigid_centripetal(const Model& m, const RealVec& u, const Dofs& s, const RealVec& v, RealVec& acc)
{
  const Ties& t = s.bound.tie;
  for (size_t b = 0; b < t.rigid.size(); ++b) {
    const Vec w = turn_of(s, m.rigid[b].turn, v);
    each_tie(m, t, b, [&](int k, int n, int i) {
      acc[t.dof[k]] += w.cross(w.cross(arm_of(m, u, m.rigid[b].ref, n)))(i);
    });
  }
}

// the motion of a body that fits the velocities of its nodes best; the nodes then have those of the body
void rigid_start(const Model& m, const RealVec& u, RealVec& v)
{
  const int dim = m.dim;
  for (const RigidBody& b : m.rigid) {
    const auto of = [&](int n) { return Vec(v[n * dim], v[n * dim + 1], dim == 3 ? v[n * dim + 2] : 0.0); };
    Vec r0 = Vec::Zero(), v0 = Vec::Zero(), L = Vec::Zero(), w = Vec::Zero();
    Eigen::Matrix3d J = Eigen::Matrix3d::Zero();
    const double part = 1.0 / static_cast<double>(b.node.size());
    for (int n : b.node) {
      r0 += part * arm_of(m, u, b.ref, n);
      v0 += part * of(n);
    }
    for (int n : b.node) {
      const Vec r = arm_of(m, u, b.ref, n) - r0;
      L += part * r.cross(of(n) - v0);
      J += part * (r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose());
    }
    if (dim == 2) w.z() = L.z() / J(2, 2);
    else w = J.llt().solve(L);
    const Vec vr = v0 - w.cross(r0);
    for (int i = 0; i < dim; ++i) {
      v[b.ref * dim + i]  = vr(i);
      v[b.turn * dim + i] = dim == 3 ? w(i) : i == 0 ? w.z() : 0.0;
    }
    for (int n : b.node) {
      const Vec x = vr + w.cross(arm_of(m, u, b.ref, n));
      for (int i = 0; i < dim; ++i) v[n * dim + i] = x(i);
    }
  }
}
