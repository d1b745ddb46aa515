"""Drawing of the sketches of problems: meshes, material points, bonds, supports, loads, measures.

A Sketch is one picture of one or more panels; each panel has the coordinates of its problem.
Lengths that do not belong to the problem (hatching, distance of text) are in inches of paper.
"""
import io

from mpfe_files import np
import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.collections import LineCollection, PolyCollection
from PIL import Image

FILL, EDGE = "#d3e5f5", "#5b8db8"        # finite elements
POINT = "#d9772b"                        # material points
BOND = "#c00000"
RIGID = "#e3e3e3"
BROKEN = "#8f8f8f"
LOAD = "#a01515"
LINE = "#404040"


class Panel:
    def __init__(self, axes, box, unit):
        self.axes, self.unit = axes, unit          # unit: an inch of paper in coordinates of the problem
        axes.set(xlim=box[:2], ylim=box[2:], aspect="equal")
        axes.axis("off")

    # ---- bodies: x and y are the lines of the mesh, shape maps (x, y) to the place of a node
    def quads(self, x, y, shape=None):
        X, Y = np.meshgrid(np.asarray(x, float), np.asarray(y, float), indexing="ij")
        if shape:
            X, Y = shape(X, Y)
        P = np.stack([X, Y], -1)
        return [[P[i, j], P[i + 1, j], P[i + 1, j + 1], P[i, j + 1]] for i in range(len(x) - 1)
                for j in range(len(y) - 1)]

    def block(self, x0, y0, x1, y1, nx=1, ny=1, shape=None, fill=FILL, edge=EDGE, cut=False, skip=None):
        """Elements; cut: each one into two triangles; skip(x, y): elements with this centre are left out."""
        cells = self.quads(np.linspace(x0, x1, nx + 1), np.linspace(y0, y1, ny + 1), shape)
        cells = [c for c in cells if not (skip and skip(*np.mean(c, 0)))]
        if cut:
            cells = [t for c in cells for t in ([c[0], c[1], c[2]], [c[0], c[2], c[3]])]
        self.axes.add_collection(PolyCollection(cells, facecolor=fill, edgecolor=edge, linewidth=0.6))

    def polygon(self, corners, fill=FILL, edge=EDGE, width=0.8, order=1):
        self.axes.add_collection(PolyCollection([np.asarray(corners, float)], facecolor=fill, edgecolor=edge,
                                                linewidth=width, zorder=order))

    def points(self, x0, y0, x1, y1, nx, ny, m=2, shape=None, size=2.2, rim=True):
        """Body of material points: m x m in each of nx x ny cells."""
        f = lambda a, b, n: a + (b - a) * (np.arange(n * m) + 0.5) / (n * m)
        X, Y = np.meshgrid(f(x0, x1, nx), f(y0, y1, ny))
        B = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], float)
        B = np.concatenate([np.linspace(B[i], B[(i + 1) % 4], 9)[:-1] for i in range(4)])
        if shape:
            X, Y = shape(X, Y)
            B = np.stack(shape(B[:, 0], B[:, 1]), -1)
        if rim:
            self.polygon(B, "#fdf0e4", "#e8b98f", 0.6, order=0.5)
        self.axes.plot(X.ravel(), Y.ravel(), ".", color=POINT, ms=size, mew=0)

    def grid(self, x0, y0, x1, y1, h):
        lines = [[(x, y0), (x, y1)] for x in np.arange(x0, x1 + 0.01 * h, h)]
        lines += [[(x0, y), (x1, y)] for y in np.arange(y0, y1 + 0.01 * h, h)]
        self.axes.add_collection(LineCollection(lines, color="0.75", linewidth=0.5, zorder=0.8))

    def nodes(self, places, colour="black", size=2.6):
        P = np.asarray(places, float)
        self.axes.plot(P[:, 0], P[:, 1], "o", color=colour, ms=size, mew=0, zorder=5)

    def bonds(self, x0, y0, x1, y1, n):
        t = np.linspace(0, 1, n)[:, None]
        self.nodes((1 - t) * np.array([x0, y0]) + t * np.array([x1, y1]), BOND, 3.0)

    def disc(self, x, y, r, fill=FILL, edge=EDGE, first=0, last=360):
        a = np.radians(np.linspace(first, last, 90))
        self.polygon(np.stack([x + r * np.cos(a), y + r * np.sin(a)], -1), fill, edge)

    def bricks(self, a, b, n=(1, 1, 1), fill=FILL, edge=EDGE, turn=(0.45, 0.30)):
        """Box from corner a to b in space, x to the right, y to the back, z up; returns the projection."""
        def at(x, y, z):
            return x + turn[0] * y, z + turn[1] * y
        (x0, y0, z0), (x1, y1, z1) = a, b
        front = [[at(x, y0, z) for x, z in q] for q in self.quads(np.linspace(x0, x1, n[0] + 1),
                                                                  np.linspace(z0, z1, n[2] + 1))]
        top = [[at(x, y, z1) for x, y in q] for q in self.quads(np.linspace(x0, x1, n[0] + 1),
                                                                np.linspace(y0, y1, n[1] + 1))]
        side = [[at(x1, y, z) for y, z in q] for q in self.quads(np.linspace(y0, y1, n[1] + 1),
                                                                 np.linspace(z0, z1, n[2] + 1))]
        self.axes.add_collection(PolyCollection(front + top + side, facecolor=fill, edgecolor=edge,
                                                linewidth=0.6))
        return at

    # ---- lines
    def line(self, places, colour=LINE, width=0.9, style="-"):
        P = np.asarray(places, float)
        self.axes.plot(P[:, 0], P[:, 1], style, color=colour, lw=width, solid_capstyle="round")

    def crack(self, x0, y0, x1, y1, width=2.2):
        self.line([(x0, y0), (x1, y1)], "black", width)

    def wave(self, x, y, f, colour=LOAD):
        """A curve y + f(x)."""
        self.axes.plot(x, y + f, color=colour, lw=1.2)

    # ---- supports: on the right hand of the way from (x0, y0) to (x1, y1)
    def wall(self, x0, y0, x1, y1, depth=0.08):
        a, b = np.array([x0, y0], float), np.array([x1, y1], float)
        length = np.hypot(*(b - a))
        t, d = (b - a) / length, depth * self.unit
        out = np.array([t[1], -t[0]])
        n = max(3, int(round(length / d)))
        lines = [[p, p + d * (out - t)] for p in (a + t * (k + 0.5) * length / n for k in range(n))]
        self.axes.add_collection(LineCollection(lines, color=LINE, linewidth=0.6))
        self.line([a, b], LINE, 1.1)

    def rollers(self, x0, y0, x1, y1, n=4):
        """Free along the line, held across it."""
        a, b = np.array([x0, y0], float), np.array([x1, y1], float)
        t = (b - a) / np.hypot(*(b - a))
        out, r = np.array([t[1], -t[0]]), 0.035 * self.unit
        for k in range(n):
            p = a + (b - a) * ((k + 0.5) / n) + r * out
            self.axes.add_patch(plt.Circle(p, r, fill=False, ec=LINE, lw=0.7))
        self.wall(*(a + 2 * r * out), *(b + 2 * r * out), depth=0.05)

    def support(self, x, y, roller=False):
        s = 0.1 * self.unit
        self.polygon([(x, y), (x - 0.6 * s, y - s), (x + 0.6 * s, y - s)], "white", LINE)
        low = y - s - (0.03 * self.unit if roller else 0)
        self.wall(x - 0.9 * s, low, x + 0.9 * s, low, 0.04)

    # ---- loads, motion, measures
    def pointer(self, a, b, style, colour, width):
        """Line from a to b with heads, whose size is in points."""
        look = dict(arrowstyle=style, color=colour, lw=width, shrinkA=0, shrinkB=0)
        self.axes.annotate("", b, a, arrowprops=look)

    def beside(self, p, direction, text, colour):
        """Text that begins at p and goes on in a direction."""
        x, y = direction
        self.text(*p, text, colour, ha="left" if x > 0.5 else "right" if x < -0.5 else "center",
                  va="bottom" if y > 0.5 else "top" if y < -0.5 else "center")

    def arrow(self, x, y, dx, dy, text="", colour=LOAD, both=False, width=1.1):
        """Arrow from (x, y) by (dx, dy), text at its head."""
        a, d = np.array([x, y], float), np.array([dx, dy], float)
        style = "<|-|>" if both else "-|>"
        self.pointer(a, a + d, style + ",head_width=0.16,head_length=0.3", colour, width)
        if text:
            t = d / np.hypot(*d)
            self.beside(a + d + 0.05 * self.unit * t, t, text, colour)

    def loads(self, x0, y0, x1, y1, dx, dy, n=6, push=False):
        """Arrows along a line; push: their heads are on it."""
        for k in range(n):
            s = (k + 0.5) / n
            x, y = x0 + s * (x1 - x0), y0 + s * (y1 - y0)
            self.arrow(x - dx if push else x, y - dy if push else y, dx, dy, width=0.8)

    def measure(self, x0, y0, x1, y1, text, side=0.16):
        """Measured length beside a line, side inches to its right hand (negative: left hand)."""
        a, b = np.array([x0, y0], float), np.array([x1, y1], float)
        t = (b - a) / np.hypot(*(b - a))
        out = np.array([t[1], -t[0]])
        d = side * self.unit * out
        for p in (a, b):
            self.line([p + 0.25 * d, p + 1.2 * d], "0.55", 0.5)
        self.pointer(a + d, b + d, "<->,head_width=0.12,head_length=0.2", "0.35", 0.6)
        s = np.sign(side) * out
        self.beside(0.5 * (a + b) + d + 0.03 * self.unit * s, s, text, "0.2")

    def turn(self, x, y, r, first=20, last=320, colour=LOAD):
        """Arrow along a circle, angles in degrees."""
        a = np.radians(np.linspace(first, last, 40))
        P = np.stack([x + r * np.cos(a), y + r * np.sin(a)], -1)
        self.line(P, colour, 1.1)
        self.pointer(P[-3], P[-1], "-|>,head_width=0.16,head_length=0.3", colour, 1.1)

    def text(self, x, y, text, colour="black", ha="center", va="center", size=8):
        self.axes.text(x, y, text, color=colour, ha=ha, va=va, fontsize=size, linespacing=1.15,
                       bbox=dict(facecolor="white", edgecolor="none", pad=0.6, alpha=0.8))


class Sketch:
    """boxes: x0, x1, y0, y1 of each panel; height in inches, the widths follow."""

    def __init__(self, *boxes, height=1.6, most=7.6):
        widths = [height * (b[1] - b[0]) / (b[3] - b[2]) for b in boxes]
        scale = min(1.0, most / sum(widths))
        widths, height = [w * scale for w in widths], height * scale
        total = sum(widths)
        self.figure = plt.figure(figsize=(total, height))
        self.panels, left = [], 0.0
        for b, w in zip(boxes, widths):
            self.panels.append(Panel(self.figure.add_axes([left / total, 0, w / total, 1]), b,
                                     (b[1] - b[0]) / w))
            left += w

    def save(self, path):
        """PNG of 48 colours, the same bytes for the same drawing."""
        memory = io.BytesIO()
        self.figure.savefig(memory, format="png", dpi=110)
        plt.close(self.figure)
        Image.open(memory).convert("RGB").quantize(48, dither=Image.Dither.NONE).save(path, optimize=True)
