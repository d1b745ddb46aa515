"""Unstructured mesh of the L-shaped panel (P7): quadrilaterals or triangles of edge h on scattered nodes, for decks to include."""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "..", "tools", "lib"))
from mpfe_files import np
from mpfe_mesh import three_quads, triangulate, write_mesh

CORNERS = [(0, 0), (250, 0), (250, 250), (470, 250), (500, 250), (500, 500), (0, 500)]      # the load acts at 470, 250


def inside(x, y):
    return (x < 250) | (y > 250)


def write(path, h, quads=True, seed=1):
    """h: edge of the elements, one quadrilateral or two triangles to h^2. Returns their number."""
    edge_h = np.sqrt(6.0) * h if quads else h
    edge = []
    for a, b in zip(np.array(CORNERS, float), np.array(CORNERS[1:] + CORNERS[:1], float)):
        n = int(round(np.hypot(*(b - a)) / edge_h))
        edge += [a + (b - a) * i / n for i in range(n)]
    n = int(round(500 / edge_h))
    i, j = np.meshgrid(np.arange(n), np.arange(n))
    X = (np.column_stack([i.ravel(), j.ravel()]) + 0.1 + 0.8 * np.random.RandomState(seed).rand(i.size, 2)) * 500 / n
    x, y = X.T
    far = 0.7 * edge_h
    X = X[inside(x + far, y - far) & (x > far) & (y > far) & (x < 500 - far) & (y < 500 - far)]
    X, conn = triangulate(edge, X, 1e-3 * h * h, inside)
    if quads:
        X, conn = three_quads(X, conn)
    write_mesh(path, X, conn, "CPS", "PANEL")
    return len(conn)
