"""What A14 and A15 share: a plate of glass with a notch under a step load, its deck, the exact motion of the tip (Freund 1990, 6.4)."""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "..", "tools", "lib"))
from mpfe_files import np, read_table
import a14_mesh
import mpfe_sweep as sweep

HERE = os.path.dirname(os.path.realpath(__file__))
ENERGY_MOMENTUM, NEWMARK, EXPLICIT = "SCHEME=ENERGY-MOMENTUM", "SCHEME=NEWMARK", "EXPLICIT"


class Glass:
    """E, nu, rho, traction sig: speeds of waves, and the exact motion of a half-infinite crack between two plane waves."""

    def __init__(self, nu=0.2, E=32e9, rho=2450.0, sig=1e6):
        self.E, self.nu, self.rho, self.sig = E, nu, rho, sig
        lam, mu = E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))
        self.cd, self.cs = np.sqrt((lam + 2 * mu) / rho), np.sqrt(mu / rho)
        lo, hi = 0.8 * self.cs, 0.999 * self.cs
        for _ in range(80):
            mid = 0.5 * (lo + hi)
            lo, hi = (lo, mid) if self.rayleigh(lo) * self.rayleigh(mid) <= 0 else (mid, hi)
        self.cr = lo

    def rayleigh(self, v):
        a, b = (v / self.cd) ** 2, (v / self.cs) ** 2
        return 4 * np.sqrt((1 - a) * (1 - b)) - (2 - b) ** 2

    def per_time(self):
        """G(t, 0) over the time since the wave has reached the crack: (1 - nu^2) K^2/E, K = 4 sig/(1 - nu) sqrt(cd t (1 - 2 nu)/pi)."""
        nu = self.nu
        return 16 * self.sig ** 2 * (1 + nu) * (1 - 2 * nu) * self.cd / (np.pi * self.E * (1 - nu))

    def tau0(self, Gc):
        return Gc / self.per_time()

    def advance(self, tau, tau0):
        tau = np.maximum(tau, tau0)
        return self.cr * ((tau - tau0) - tau0 * np.log(tau / tau0))


def write_deck(folder, tag, glass, kind="aligned", rows=2, h=0.5e-3, dt=None, T=15.7e-6, Gc=3.0, mass="", scheme="",
               shift=None, W=0.1, H=0.04, T0=1.0, breaks="MAYBREAK", ft=None, fine=None, seed=1):
    """The deck of a run; mass: empty, the default; shift: broken elements become points on a grid shifted by so many cells.

    ft: CRITERION=COHESIVE with this strength; fine, seed: of a14_mesh."""
    a, dt = 0.5 * W, dt or 2e-4 * h
    mesh = os.path.join(folder, "mesh_%s_%d_%g_%g%s.inc" % (kind, rows, h * 1e3, W * 1e3, "" if seed == 1 else "_seed%d" % seed))
    if not os.path.exists(mesh):
        a14_mesh.write(mesh, kind, W, H, a, h, rows, fine, seed)
    values = dict(h=h, T=T, dt=dt, T0=T0, Gc=Gc, E=glass.E, nu=glass.nu, rho=glass.rho, sig=glass.sig, W=W, H=H)
    text = "*PARAMETER\n" + "".join("%s = %.12g\n" % p for p in values.items())
    text += "*INCLUDE, INPUT=%s\n*INCLUDE, INPUT=%s/a14_plate.inc\n" % (mesh, HERE)
    text += "*SOLID SECTION, ELSET=PLATE, MATERIAL=GLASS%s\n" % (", MASS=" + mass if mass else "")
    text += "*EIGENFRACTURE, ELSET=%s%s\n" % (breaks, "\n<Gc>" if ft is None else ", CRITERION=COHESIVE\n<Gc>, %.12g" % ft)
    if kind == "slab":
        text += "*BOUNDARY\nSIDES, 3\n"
    if shift is not None:
        cell = h if kind not in ("triangles", "quads") else 0.57 * h           # at most three times the smallest edge
        lo, hi = (-0.1 * W, -0.55 * H), (1.1 * W, 0.55 * H)
        n = [np.ceil((hi[i] - lo[i]) / cell) for i in (0, 1)]
        at = [lo[i] + shift[i] * cell for i in (0, 1)]
        text += "*GRID\n%.12g, %.12g, %.12g, %.12g\n%.12g, %.12g\n*CONVERSION, ELSET=%s\n" % (
            at[0], at[1], at[0] + n[0] * cell, at[1] + n[1] * cell, cell, cell, breaks)
    words = ", EXPLICIT\n, <T>" if scheme == EXPLICIT else ", DIRECT%s\n<dt>, <T>" % (", " + scheme if scheme else "")
    text += "*STEP, NLGEOM, INC=1000000\n*DYNAMIC%s\n*INCLUDE, INPUT=%s/a14_run.inc\n" % (words, HERE)
    path = os.path.join(folder, tag + ".inp")
    with open(path, "w") as f:
        f.write(text)
    return path


def crack(job, h, a):
    """Times of breaking, front of the crack from the notch at a on (front edge of the foremost element), history."""
    ero = read_table(job + ".ero")
    his = {name.lower(): v for name, v in read_table(job + ".his").items()}
    return np.atleast_1d(ero["time"]), np.maximum.accumulate(np.atleast_1d(ero["x"])) + 0.5 * h - a, his

def fit(glass, time, front, ta, tau0, first, last):
    """Gc*/Gc and x0 of the exact motion that is nearest to the front of a crack between two times (least squares)."""
    s = np.linspace(first, last, 400)
    k = np.searchsorted(time, s, side="right") - 1
    tip = np.where(k >= 0, front[np.maximum(k, 0)], 0.0)
    best = None
    for ratio in np.linspace(0.3, 2.0, 1701):
        exact = glass.advance(s - ta, ratio * tau0)
        x0 = np.mean(tip - exact)
        miss = np.sum((tip - exact - x0) ** 2)
        if best is None or miss < best[0]:
            best = (miss, ratio, x0)
    return best[1:]
