"""Meshes of the clamped strip 0 < x < L, -H < y < H for A10, with the slot along y = 0, as a file that a deck includes.

write(path, kind, n): n elements of edge h = H/n over half the height. Kinds:
  aligned      squares, a row of them on y = 0 (2n + 1 over the height)
  jitter       the same, inner nodes moved by up to 0.2 h
  14 26.6 45   squares turned by that angle; the nodes that stick out of the strip are held like its sides
  split        aligned, every square cut into two triangles
  triangles    Delaunay triangles of scattered nodes, two triangles to h^2
  quads        Delaunay triangles of scattered nodes, each cut into three quadrilaterals, one to h^2
Sets: STRIP, SLOT (elements that the line y = 0, x < A0 cuts), MAYBREAK, FAR (ahead of all cracks), TOP, BOT, END.
"""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "..", "tools", "lib"))
from mpfe_files import np
from mpfe_mesh import three_quads, triangulate, write_mesh

H, L, A0, RUN = 1.0, 9.0, 3.0, 3.0
KINDS = ["aligned", "jitter", "14", "26.6", "45", "split", "triangles", "quads"]
ANGLE = {"14": np.arctan(0.25), "26.6": np.arctan(0.5), "45": np.pi / 4}


def lattice(nx, ny, x0, y0, h):
    """Nodes and squares of a lattice."""
    x, y = np.meshgrid(x0 + h * np.arange(nx + 1), y0 + h * np.arange(ny + 1))
    i, j = np.meshgrid(np.arange(nx), np.arange(ny))
    a = (j * (nx + 1) + i).ravel()
    return np.column_stack([x.ravel(), y.ravel()]), np.column_stack([a, a + 1, a + nx + 2, a + nx + 1])


def aligned(n):
    h = 2 * H / (2 * n + 1)
    return lattice(int(round(L / h)), 2 * n + 1, 0.0, -H, h)


def turned(n, angle):
    """The squares of a turned lattice that lie in the strip at least in part."""
    h = H / n
    c, s = np.cos(angle), np.sin(angle)
    m = int((L + 2 * H) / h) + 2
    X, conn = lattice(2 * m, 2 * m, -m * h, -m * h, h)
    X = X @ np.array([[c, s], [-s, c]]) + [0.0, 0.31 * h]
    inside = (abs(X[:, 1]) < H - 1e-6 * h) & (X[:, 0] > -1e-6 * h) & (X[:, 0] < L + 1e-6 * h)
    conn = conn[inside[conn].any(1)]
    used, conn = np.unique(conn, return_inverse=True)
    return X[used], conn.reshape(-1, 4)


def scattered(h, seed=1):
    """Delaunay triangles of nodes thrown into the cells of a lattice and evened out a little."""
    nx, ny = int(round(L / h)), int(round(2 * H / h))
    rng = np.random.RandomState(seed)
    edge = [(L * i / nx, y) for i in range(nx + 1) for y in (-H, H)] + [(x, -H + 2 * H * j / ny) for j in range(1, ny) for x in (0.0, L)]
    i, j = np.meshgrid(np.arange(nx - 1) + 0.5, np.arange(ny - 1) + 0.5)
    X = np.column_stack([i.ravel(), j.ravel()]) + rng.rand(i.size, 2)
    return triangulate(edge, X * [L / nx, 2 * H / ny] + [0.0, -H], 1e-3 * h * h)


def mesh(kind, n):
    """Nodes [.][2], elements [.][3 or 4], edge h."""
    h = H / n
    if kind in ANGLE:
        return turned(n, ANGLE[kind]) + (h,)
    if kind == "triangles":
        return scattered(h) + (h,)
    if kind == "quads":
        return three_quads(*scattered(np.sqrt(6.0) * h)) + (h,)
    X, conn = aligned(n)
    h = 2 * H / (2 * n + 1)
    if kind == "jitter":
        inner = (abs(X[:, 1]) < H - 0.5 * h) & (X[:, 0] > 0.5 * h) & (X[:, 0] < X[:, 0].max() - 0.5 * h)
        X = X + inner[:, None] * 0.2 * h * (2 * np.random.RandomState(1).rand(*X.shape) - 1)
    if kind == "split":
        conn = np.vstack([conn[:, [0, 1, 2]], conn[:, [0, 2, 3]]])
    return X, conn, h


def write(path, kind, n):
    """Writes the mesh with its sets; returns h."""
    X, conn, h = mesh(kind, n)
    centre, y = X[conn].mean(1), X[conn][:, :, 1]
    tiny = 1e-6 * h
    sets = [("SLOT", (y.min(1) < -tiny) & (y.max(1) > tiny) & (centre[:, 0] < A0)),
            ("MAYBREAK", (abs(centre[:, 1]) < 0.75 * H) & (centre[:, 0] > A0 - H) & (centre[:, 0] < A0 + RUN)),
            ("FAR", (abs(centre[:, 1]) < 0.5 * H) & (abs(centre[:, 0] - L + H) < 0.5 * H))]
    nodes = [("TOP", X[:, 1] > H - tiny), ("BOT", X[:, 1] < -H + tiny), ("END", X[:, 0] > min(L, X[:, 0].max()) - tiny)]
    write_mesh(path, X, conn, "CPE", "STRIP", sets, nodes)
    return h
