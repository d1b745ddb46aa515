#include <algorithm>
#include <cstdio>

#include "base/comm.h"
#include "base/log.h"
#include "bond/bond.h"
#include "contact/contact.h"
#include "point/point.h"

namespace {

struct Overlap {               // of one definition at the start
  int count = 0;               // contact points that overlap
  double gap = 0.0, x[3] = {0, 0, 0};  // of the deepest point, the first of equals
  long name = 0;
};

Overlap find_overlap(const Model& m, const Bonds& bonds, const ContactPairs& pairs, const RealVec& xb,
                     int def)
{
  Overlap o;
  for (int b = 0; b < bonds.nbond; ++b) {
    if (bonds.def[b] != def || !pairs.master.count(b) || pairs.gap[b] >= -contact_touch(pairs, b)) continue;
    if (!bonds.counts(b)) continue;
    ++o.count;
    if (pairs.gap[b] >= o.gap) continue;
    o.gap = pairs.gap[b];
    if (bonds.halo.on()) o.name = bonds.name[b];
    std::copy_n(&xb[b * m.dim], m.dim, o.x);
  }
  if (!bonds.halo.on()) return o;
  std::vector<Overlap> all(1, o);
  comm_allgatherv(all);
  o = Overlap();
  for (const Overlap& r : all) {
    const int count = o.count + r.count;
    if (r.gap < o.gap || (r.gap == o.gap && r.name < o.name)) o = r;
    o.count = count;
  }
  return o;
}

// stores gaps that count as zero from now on: overlaps, and clearances up to the value of the deck
void take_offsets(const Model& m, Bonds& bonds, const ContactPairs& pairs, int def)
{
  int count = 0;
  double range[2] = {0.0, 0.0};          // the maximum, and minus the minimum
  for (int b = 0; b < bonds.nbond; ++b) {
    const double gap = pairs.gap[b];
    if (bonds.def[b] != def || !pairs.master.count(b)) continue;
    if (gap > m.bond[def].contact.adjust || gap == 0.0) continue;
    bonds.contact.offset[b] = gap;
    if (!bonds.counts(b)) continue;
    range[0] = std::max(range[0], gap);
    range[1] = std::max(range[1], -gap);
    ++count;
  }
  if (bonds.halo.on()) {
    double sum = count;
    comm_sum(&sum, 1);
    comm_max(range, 2);
    count = static_cast<int>(sum);
  }
  log_note("  adjusted: %d contact points, offsets from %g to %g", count, -range[1], range[0]);
}

}  // namespace

int contact_start(const Model& m, Bonds& bonds, const ContactPairs& pairs, const RealVec& xb)
{
  int errors = 0;
  for (size_t d = 0; d < m.bond.size(); ++d) {
    const BondDef& def = m.bond[d];
    if (def.kind != BOND_CONTACT) continue;
    const Overlap o = find_overlap(m, bonds, pairs, xb, static_cast<int>(d));
    char text[400] = "";
    if (o.count)
      std::snprintf(text, sizeof text,
                    "contact %.80s (%.160s line %d): the surfaces overlap initially by up to %g, at "
                    "(%g, %g, %g); %d contact points in all",
                    def.name.c_str(), def.deck_line.file.c_str(), def.deck_line.line, -o.gap, o.x[0], o.x[1],
                    o.x[2], o.count);
    if (def.contact.overlap == OVERLAP_REFUSE && o.count) {
      log_error("%s: separate the surfaces, or use OVERLAP=ADJUST", text);
      ++errors;
    } else if (def.contact.overlap == OVERLAP_ADJUST) {
      log_note("%s%s", o.count ? text : "contact ", o.count ? ": taken as zero gap" : def.name.c_str());
      take_offsets(m, bonds, pairs, static_cast<int>(d));
    } else if (o.count) {
      log_warn("%s; contact forces will separate them (other treatments: OVERLAP=ADJUST, OVERLAP=REFUSE)",
               text);
    }
  }
  return errors;
}

void contact_displacements(const Model& m, const Points& pts, RealVec& u, RealVec& uc)
{
  const int dim = m.dim;
  u.assign(static_cast<size_t>(m.mesh.nnode()) * dim, 0.0);
  uc.assign(pts.Xc.size(), 0.0);
  bool any = false;
  for (const InitialValue& iv : m.initial) {
    if (!iv.displacement || iv.dof >= dim) continue;
    any = true;
    for (int n : iv.node) u[n * dim + iv.dof] = expr_eval(iv.value, &m.mesh.X[3 * n], 0.0);
    for (int k = 0; iv.body >= 0 && k < pts.conn.off.back(); ++k) {
      const int c = pts.conn.item[k];
      const int q = static_cast<int>(std::upper_bound(pts.conn.off.begin(), pts.conn.off.end(), k) -
                                     pts.conn.off.begin()) -
                    1;
      double X[3] = {0, 0, 0};
      std::copy_n(&pts.Xc[c * dim], dim, X);
      if (pts.body[q] == iv.body) uc[c * dim + iv.dof] = expr_eval(iv.value, X, 0.0);
    }
  }
  for (int q = 0; any && q < pts.npoint; ++q) {
    const int e = pts.parent[q];
    double N[8];
    for (int k = pts.conn.off[q]; e >= 0 && k < pts.conn.off[q + 1]; ++k) {
      const int c = pts.conn.item[k];
      if (!point_corner_in_element(m, pts, e, c, N)) continue;
      for (int i = 0; i < dim; ++i) {
        uc[c * dim + i] = 0.0;
        for (int a = 0; a < m.mesh.conn.count(e); ++a)
          uc[c * dim + i] += N[a] * u[m.mesh.conn.begin(e)[a] * dim + i];
      }
    }
  }
}

void contact_offsets(const Model& m, const Points& pts, const IntVec& added, Bonds& bonds)
{
  int any = 0;
  for (int b : added) any = any || m.bond[bonds.def[b]].contact.overlap == OVERLAP_ADJUST;
  const auto adjusts = [](const BondDef& d) { return d.contact.overlap == OVERLAP_ADJUST; };
  if (m.part.on && std::any_of(m.bond.begin(), m.bond.end(), adjusts)) any = comm_allreduce_max(any);
  if (!any) return;
  RealVec u, uc, xb;
  ContactPairs pairs;
  contact_displacements(m, pts, u, uc);
  bond_places(m, pts, bonds, u, uc, xb);
  contact_search_start(m, pts, bonds, u, uc, xb, pairs);
  for (int b : added) {
    const BondDef& def = m.bond[bonds.def[b]];
    if (def.contact.overlap == OVERLAP_ADJUST && pairs.master.count(b) && pairs.gap[b] <= def.contact.adjust)
      bonds.contact.offset[b] = pairs.gap[b];
  }
}
