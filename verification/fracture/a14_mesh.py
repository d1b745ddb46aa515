"""Meshes of the plate of A14 and A15, W x H with a notch along y = 0 from the left edge to x = a, as a file that a deck includes.

write(path, kind, W, H, a, h, rows, fine, seed): the notch is `rows` rows of elements high. Kinds:
  aligned      squares; rows = 1: a row of them lies on y = 0, rows = 2: a line of nodes does
  graded       the same; edges grow by 5 % from one to the next, up to 3 h, beyond 0.05 W around and 0.1 W ahead of the tip;
               fine = (around, ahead, largest edge): other lengths
  jitter       the same as aligned, inner nodes moved by up to 0.2 h, but for those of the notch
  turned       the same, the squares around the tip turned by 30 degrees: nodes within 0.12 H are turned about it by that angle,
               beyond 0.4 H not at all
  slab         graded, and as bricks: LAYERS of edge h; SIDES: nodes of its two faces
  triangles    Delaunay triangles of scattered nodes, two triangles to h^2
  quads        Delaunay triangles of scattered nodes, each cut into three quadrilaterals, one to h^2
Sets: PLATE, SLOT, MAYBREAK (0.05 H away from the loaded edges), ROW (ahead of the notch within half its height).
"""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "..", "tools", "lib"))
from mpfe_files import np
from mpfe_mesh import three_quads, triangulate, write_mesh

KINDS = ["aligned", "graded", "slab", "jitter", "turned", "triangles", "quads"]
LAYERS = 3


def squares(W, H, h, rows):
    ny = 2 * int(round(0.5 * H / h)) + rows % 2
    nx = int(round(W / h))
    return lattice(W * np.arange(nx + 1) / nx, H * (np.arange(ny + 1) / ny - 0.5))


def lattice(x, y):
    """Nodes and quadrilaterals between the lines x and y."""
    nx, ny = len(x) - 1, len(y) - 1
    x, y = np.meshgrid(x, y)
    i, j = np.meshgrid(np.arange(nx), np.arange(ny))
    k = (j * (nx + 1) + i).ravel()
    return np.column_stack([x.ravel(), y.ravel()]), np.column_stack([k, k + 1, k + nx + 2, k + nx + 1])


def growing(length, fine, h, largest):
    """Places from 0 to length: edges of h up to fine, then growing by 5 % up to the largest."""
    place = list(h * np.arange(int(round(fine / h)) + 1))
    edge = h
    while place[-1] < length - 1e-9 * h:
        edge = min(1.05 * edge, largest)
        place.append(place[-1] + edge)
    place = np.array(place)
    outer = place > fine
    return np.where(outer, fine + (place - fine) * (length - fine) / (place[-1] - fine), place)


def graded(W, H, a, h, fine):
    """One row of elements on y = 0."""
    around, ahead, largest = fine or (0.05 * W, 0.1 * W, 3 * h)
    up = 0.5 * h + growing(0.5 * (H - h), around, h, largest)
    y = np.concatenate([-up[::-1], up])
    x = np.concatenate([a - growing(a, around, h, largest)[:0:-1], a + growing(W - a, ahead, h, largest)])
    return y, x


def bricks(X, conn, h, layers):
    """A plane mesh as layers of bricks."""
    z = h * np.arange(layers + 1)
    place = np.column_stack([np.tile(X, (layers + 1, 1)), np.repeat(z, len(X))])
    return place, np.vstack([np.hstack([conn + k * len(X), conn + (k + 1) * len(X)]) for k in range(layers)])


def scattered(W, H, h, seed=1):
    nx, ny = int(round(W / h)), int(round(H / h))
    rng = np.random.RandomState(seed)
    edge = [(W * i / nx, y) for i in range(nx + 1) for y in (-0.5 * H, 0.5 * H)]
    edge += [(x, H * (j / ny - 0.5)) for j in range(1, ny) for x in (0.0, W)]
    i, j = np.meshgrid(np.arange(nx - 1) + 0.5, np.arange(ny - 1) + 0.5)
    X = np.column_stack([i.ravel(), j.ravel()]) + rng.rand(i.size, 2)
    return triangulate(edge, X * [W / nx, H / ny] + [0.0, -0.5 * H], 1e-3 * h * h)


def mesh(kind, W, H, a, h, rows, fine, seed=1):
    if kind == "triangles":
        return scattered(W, H, h, seed)
    if kind == "quads":
        return three_quads(*scattered(W, H, np.sqrt(6.0) * h, seed))
    if kind in ("graded", "slab"):
        y, x = graded(W, H, a, h, fine)
        plane = lattice(x, y)
        return plane if kind == "graded" else bricks(*plane, h, LAYERS)
    X, conn = squares(W, H, h, rows)
    if kind == "jitter":
        inner = (abs(X[:, 1]) < 0.5 * H - 0.5 * h) & (X[:, 0] > 0.5 * h) & (X[:, 0] < W - 0.5 * h)
        inner &= (abs(X[:, 1]) > (0.5 * rows + 0.5) * h) | (X[:, 0] > a + 0.5 * h)
        X = X + inner[:, None] * 0.2 * h * (2 * np.random.RandomState(1).rand(*X.shape) - 1)
    if kind == "turned":
        d = X - [a, 0.0]
        r = np.hypot(d[:, 0], d[:, 1]) / H
        t = np.clip((0.4 - r) / 0.28, 0.0, 1.0)
        angle = np.pi / 6 * t * t * (3 - 2 * t)
        c, s = np.cos(angle), np.sin(angle)
        X = np.column_stack([c * d[:, 0] - s * d[:, 1], s * d[:, 0] + c * d[:, 1]]) + [a, 0.0]
    return X, conn


def write(path, kind, W, H, a, h, rows, fine=None, seed=1):
    """Writes the mesh with its sets and surfaces; returns h, the root of the mean area of a square."""
    X, conn = mesh(kind, W, H, a, h, rows, fine, seed)
    corners = X[conn]
    lo, hi = corners.min(1), corners.max(1)
    centre = corners.mean(1)
    if kind in ("triangles", "quads"):                      # what the line of the notch cuts
        slot = (lo[:, 1] <= 0) & (hi[:, 1] >= 0) & (lo[:, 0] < a - 0.5 * h)
    else:
        slot = (abs(centre[:, 1]) < 0.5 * rows * h) & (centre[:, 0] < a)
    row = (abs(centre[:, 1]) < 0.5 * rows * h) & ~slot
    elsets = [("SLOT", slot), ("MAYBREAK", (abs(centre[:, 1]) < 0.45 * H) & ~slot), ("ROW", row)]
    if kind == "slab":
        write_mesh(path, X, conn, "C3D", "PLATE", elsets, [("SIDES", (X[:, 2] == 0.0) | (X[:, 2] == X[:, 2].max()))])
    else:
        write_mesh(path, X, conn, "CPE", "PLATE", elsets)
    return h
