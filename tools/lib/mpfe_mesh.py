"""Unstructured meshes in the plane for verification: scattered nodes, Delaunay triangles, quadrilaterals."""
from mpfe_files import np
from matplotlib.tri import Triangulation


def areas(X, conn):
    return 0.5 * np.cross(X[conn[:, 1]] - X[conn[:, 0]], X[conn[:, 2]] - X[conn[:, 0]])


def triangulate(edge, inner, small, inside=None):
    """Delaunay triangles of the nodes edge [.][2], which stay, and inner [.][2], which are evened out a little.
    Triangles below the area small, and those whose centre is not inside(x, y), are left out."""
    X = np.vstack([edge, inner])
    for _ in range(4):
        tri = Triangulation(X[:, 0], X[:, 1])
        count, total = np.zeros(len(X)), np.zeros((len(X), 2))
        for a, b in ((0, 1), (1, 0)):
            np.add.at(count, tri.edges[:, a], 1.0)
            np.add.at(total, tri.edges[:, a], X[tri.edges[:, b]])
        X[len(edge):] = (total / count[:, None])[len(edge):]
    conn = Triangulation(X[:, 0], X[:, 1]).triangles
    keep = areas(X, conn) > small
    if inside:
        keep &= inside(*X[conn].mean(1).T)
    return X, conn[keep]


def three_quads(X, conn):
    """Cuts every triangle into three quadrilaterals."""
    pairs = np.sort(np.vstack([conn[:, [0, 1]], conn[:, [1, 2]], conn[:, [2, 0]]]), 1)
    pairs, back = np.unique(pairs, axis=0, return_inverse=True)
    mid = len(X) + back.reshape(3, -1)
    centre = len(X) + len(pairs) + np.arange(len(conn))
    X = np.vstack([X, X[pairs].mean(1), X[conn].mean(1)])
    return X, np.vstack([np.column_stack([conn[:, i], mid[i], centre, mid[i - 1]]) for i in range(3)])


def write_mesh(path, X, conn, kind, elset, elsets=(), nsets=()):
    """A file that a deck includes: kind (CPE, CPS or C3D), pairs of name and mask for the sets."""
    with open(path, "w") as f:
        f.write("*NODE\n")
        f.writelines("%d, %s\n" % (i + 1, ", ".join("%.15g" % a for a in x)) for i, x in enumerate(X))
        f.write("*ELEMENT, TYPE=%s%d, ELSET=%s\n" % (kind, conn.shape[1], elset))
        f.writelines(", ".join(map(str, [i + 1] + [int(a) + 1 for a in e])) + "\n" for i, e in enumerate(conn))
        for word, group in (("ELSET", elsets), ("NSET", nsets)):
            for name, mask in group:
                f.write("*%s, %s=%s\n" % (word, word, name))
                f.writelines("%d\n" % (i + 1) for i in np.flatnonzero(mask))
