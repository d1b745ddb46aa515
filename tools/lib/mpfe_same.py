"""How much two runs of one deck differ: histories, tables, fragments, frames. Each routine gives the largest difference over the scale of
what is compared, inf where rows, labels or columns differ, and where it is.
"""
import os
import re

from mpfe_case import text_of
from mpfe_files import as_array, np, read_dat, read_frame, read_table

ENERGIES = ("kinetic", "strain", "bond", "external", "balance", "ECONV", "EFRAC", "TAKEN")
KINDS = (("volume",), ("mass",), ("x", "y", "z", "xmin", "ymin", "zmin", "xmax", "ymax", "zmax"), ("vx", "vy", "vz"),
         ("px", "py", "pz"), ("lx", "ly", "lz"), ("wx", "wy", "wz"), ("kinetic", "translation", "rotation", "rest"),
         ("i11", "i22", "i33", "i12", "i23", "i31", "p1", "p2", "p3"))      # columns of JOB.frag of one kind
AT_REST = 1e-3          # least scale of accelerations and of fields that are zero


def largest(values):
    values = np.abs(values[~np.isnan(values)])
    return values.max() if values.size else 0.0


def gap(a, b, scale):
    """The largest |a - b| over scale; equal values and a nan on both sides are the same, without a scale all others differ."""
    if a.shape != b.shape:
        return np.inf
    differ = ~((a == b) | (np.isnan(a) & np.isnan(b)))
    if not differ.any():
        return 0.0
    d = np.abs(a[differ] - b[differ]) / scale if scale > 0.0 else np.array([np.inf])
    return np.inf if np.isnan(d).any() else float(d.max())


def scales(folder, name, his):
    """Least scales of columns of a history: energies by the largest energy, momenta by sqrt(2 mass kinetic energy), for angular ones times
    the size of the model, vectors by their largest component."""
    text = text_of(folder, name, "lst")
    mass = sum(float(x) for x in re.findall(r"^  (?:section|body) .* mass ([^\s,]+)(?:,.*)?$", text, re.M))
    size = max([abs(float(b) - float(a)) for a, b in re.findall(r"[xyz] (\S+) \.\.\. ([^\s,]+)", text)] or [1.0])
    energy, momentum = max(largest(his[e]) for e in ENERGIES if e in his), np.sqrt(2.0 * mass * largest(his["kinetic"]))
    scale = dict.fromkeys(ENERGIES, energy)
    scale.update({"p" + i: momentum for i in "xyz"})
    scale.update({"l" + i: momentum * size for i in "xyz"})
    for column in his:
        if column[-1] in "123" and column[-2:-1] in "UVAX":
            scale[column] = max(largest(his[column[:-1] + i]) for i in "123" if column[:-1] + i in his)
    return scale


def histories_differ(folder, other, name, left_out=()):
    """JOB.his of another run against that in folder; the number of iterations may differ."""
    a, b = (read_table(os.path.join(f, name + ".his")) for f in (other, folder))
    scale, worst = scales(folder, name, b), (0.0, "-")
    for column in b:
        if column == "iter" or column in left_out:
            continue
        d = gap(a[column], b[column], max(scale.get(column, 0.0), largest(b[column]))) if column in a else np.inf
        worst = max(worst, (d, column))
    return worst[0], "%d rows, %s" % (len(b["time"]), worst[1])


def tables_differ(folder, other, name):
    """JOB.dat: the same tables, labels and order; numbers over the largest of their table."""
    a, b = (read_dat(os.path.join(f, name + ".dat")) for f in (other, folder))
    heads = [[(t["what"], t["set"], t["time"], np.array(t["labels"]).tolist()) for t in tables] for tables in (a, b)]
    if heads[0] != heads[1]:
        return np.inf, "heads or labels"
    return max([gap(x["values"], y["values"], largest(y["values"])) for x, y in zip(a, b)] or [0.0]), "%d tables" % len(b)


def fragments_differ(folder, other, name):
    """JOB.frag: the same pieces under the same numbers; measures over the largest of their kind."""
    a, b = (read_table(os.path.join(f, name + ".frag")) for f in (other, folder))
    if any(not np.array_equal(a[key], b[key]) for key in ("time", "fragment", "elements", "points")):
        return np.inf, "pieces"
    worst = max((gap(a[key], b[key], max(largest(b[k]) for k in kind)), key) for kind in KINDS for key in kind)
    return worst[0], "%d rows, %s" % (len(b["time"]), worst[1])


def fields_of(frame):
    """Fields in the order of the labels of nodes and cells; corners of points, which have no label, as the middle of their cell."""
    cell, label = np.argsort(frame["cell"]["label"]), frame["point"].get("node_label")
    fields = {"cell " + key: value[cell] for key, value in frame["cell"].items()}
    if label is None:
        fields["middle"] = np.array([frame["points"][frame["cells"][c]].mean(axis=0) for c in cell])
        return fields
    node = np.argsort(label)
    fields.update({"types": frame["types"][cell], "points": frame["points"][node],
                   "nodes": np.concatenate([label[frame["cells"][c]] for c in cell])})
    fields.update({"point " + key: value[node] for key, value in frame["point"].items()})
    return fields


def frames_differ(path, other):
    """Two frames of elements or points: the same mesh, fields over their largest value, stresses over the largest stress."""
    a, b = fields_of(read_frame(path)), fields_of(read_frame(other))
    if sorted(a) != sorted(b) or any(a[key].shape != b[key].shape for key in a):
        return np.inf, "other fields or sizes"
    stress, worst = max([largest(a[key]) for key in a if key.startswith("cell S")] or [0.0]), (0.0, "-")
    for key in a:
        scale = max(largest(a[key].astype(float)), stress if key.startswith("cell S") else 0.0)
        if key.startswith("point acceleration") or scale == 0.0:
            scale = max(scale, AT_REST)
        worst = max(worst, (gap(b[key].astype(float), a[key].astype(float), scale), key))
    return worst
