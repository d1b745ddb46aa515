"""How far plane bodies lie in each other: the elements and points of frames (legacy VTK), pair by pair."""
import glob
import os
import sys

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.path.insert(0, os.path.join(TOP, "tools", "lib"))
from mpfe_files import np, read_table, read_vtk


def clip(subject, clipper):
    """The part of a polygon inside a convex, counter-clockwise one (Sutherland and Hodgman)."""
    for a, b in zip(clipper, np.roll(clipper, -1, axis=0)):
        side = [(b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) for p in subject]
        out = []
        for i, p in enumerate(subject):
            s, t, q = side[i - 1], side[i], subject[i - 1]
            if (s < 0.0) != (t < 0.0):
                out.append(q + (p - q) * (s / (s - t)))
            if t >= 0.0:
                out.append(p)
        subject = out
        if not subject:
            break
    return subject


def area(polygon):
    if len(polygon) < 3:
        return 0.0
    x, y = np.array(polygon).T
    return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def cells_of(job, frame):
    cells = []
    for kind in ("fe", "mp"):
        path = "%s_%s_%06d.vtk" % (job, kind, frame)
        if os.path.exists(path):
            v = read_vtk(path)
            cells += [v["points"][c][:, :2] for c in v["cells"]]
    return cells


def overlap(cells):
    """Largest area that two cells share, of the smaller of them; cells with common corners only touch."""
    lo = np.array([c.min(axis=0) for c in cells])
    hi = np.array([c.max(axis=0) for c in cells])
    size = np.array([area(c) for c in cells])
    order, worst = np.argsort(lo[:, 0]), 0.0
    for k, i in enumerate(order):
        for j in order[k + 1:]:
            if lo[j, 0] > hi[i, 0]:
                break
            if lo[j, 1] > hi[i, 1] or lo[i, 1] > hi[j, 1] or min(size[i], size[j]) <= 0.0:
                continue
            worst = max(worst, area(clip(list(cells[i]), cells[j])) / min(size[i], size[j]))
    return worst


def depth(a, b):
    """How far convex a must move to leave convex b; 0: they are apart."""
    least = np.inf
    for p in (a, b):
        edge = np.roll(p, -1, axis=0) - p
        for n in np.stack([edge[:, 1], -edge[:, 0]], axis=1) / np.hypot(*edge.T)[:, None]:
            least = min(least, (a @ n).max() - (b @ n).min(), (b @ n).max() - (a @ n).min())
    return max(least, 0.0)


def of_debris(job, frame):
    """Deepest overlap of a released point with an element or a released point, deepest one of two points on the
    grid, and F/C: the largest penetration of contact, all in one frame."""
    cells, kind = [], []
    for part in ("fe", "mp"):
        path = "%s_%s_%06d.vtk" % (job, part, frame)
        if not os.path.exists(path):
            continue
        v = read_vtk(path)
        cells += [v["points"][c][:, :2] for c in v["cells"]]
        kind += list(v["cell"]["released"] if part == "mp" else 2 * np.ones(len(v["cells"])))
    kind = np.array(kind)
    lo, hi = (np.array([f(c, axis=0) for c in cells]) for f in (np.min, np.max))
    order, debris, grid = np.argsort(lo[:, 0]), 0.0, 0.0
    for k, i in enumerate(order):
        for j in order[k + 1:]:
            if lo[j, 0] > hi[i, 0]:
                break
            if lo[j, 1] > hi[i, 1] or lo[i, 1] > hi[j, 1]:
                continue
            if min(kind[i], kind[j]) > 0 and kind[i] + kind[j] < 4:
                debris = max(debris, depth(cells[i], cells[j]))
            elif kind[i] == kind[j] == 0:
                grid = max(grid, depth(cells[i], cells[j]))
    path, contact = "%s_bond_%06d.vtk" % (job, frame), 0.0
    if os.path.exists(path):
        v = read_vtk(path)
        closed = v["point"]["kind"] == 3
        contact = float(np.linalg.norm(v["point"]["slip"][closed], axis=1).max()) if closed.any() else 0.0
    return debris, grid, contact


def frames(job):
    return sorted(int(p[-10:-4]) for p in glob.glob(job + "_fe_*.vtk"))


def of_job(job):
    """Largest overlap over all frames of a run, of the smaller cell, and the frame."""
    return max((overlap(cells_of(job, f)), f) for f in frames(job))
