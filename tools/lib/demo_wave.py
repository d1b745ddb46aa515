#!/usr/bin/env python3
"""Draws the demonstration: velocity along the bar at 25 us against d'Alembert, and the stress field.

  tools/lib/demo_wave.py FOLDER SECONDS      FOLDER holds what decks/bar_coupled.inp wrote; called by tools/demo
"""
import glob
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from mpfe_files import np, read_vtk

import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.collections import PolyCollection

E0, RHO, P0, TP, TIME = 40e9, 2400.0, 50e6, 10e-6, 25e-6      # as in the deck
C = np.sqrt(E0 / RHO)


def exact(x):
    s = TIME - x / C
    return P0 / (RHO * C) * np.where((s > 0) & (s < TP), np.sin(np.pi * s / TP) ** 2, 0.0)


def frame_at(kind, time):
    for path in sorted(glob.glob(os.path.join(sys.argv[1], "bar_coupled_%s_*.vtk" % kind))):
        grid = read_vtk(path)
        if abs(grid["time"] - time) < 1e-9:
            return grid
    sys.exit("FAIL  no frame of bar_coupled at %g s in %s" % (time, sys.argv[1]))


def centres(grid, values):
    return np.array([values[c].mean(axis=0) for c in grid["cells"]])


fe, mp = frame_at("fe", TIME), frame_at("mp", TIME)
# places at t = 0 and velocities: nodes of the elements, centres of the points' domains
x_fe, v_fe = (fe["points"] - fe["point"]["displacement"])[:, 0], fe["point"]["velocity"]
x_mp, v_mp = centres(mp, mp["points"] - mp["point"]["displacement"])[:, 0], mp["cell"]["velocity"]
v = np.vstack([v_fe, v_mp])
line = np.linspace(0.0, 0.15, 1501)
halves = ((x_fe, v_fe), (x_mp, v_mp))                          # of equal weight, whatever the number of points
L2 = np.sqrt(sum(((w[:, 0] - exact(x)) ** 2).mean() for x, w in halves) / sum((exact(x) ** 2).mean() for x, w in halves))
across = np.abs(v[:, 1]).max() / exact(line).max()

fig, (top, low) = plt.subplots(2, 1, figsize=(8, 6.4), dpi=150, gridspec_kw={"height_ratios": [1.5, 1]})
top.plot(1e3 * line, exact(line), color="0.55", lw=3, label="exact (d'Alembert)")
top.plot(1e3 * x_mp, v_mp[:, 0], ".", color="tab:blue", ms=4, label="material points")
top.plot(1e3 * x_fe, v_fe[:, 0], "x", color="tab:red", ms=4, label="finite elements")
top.axvline(75, color="0.7", lw=0.8)
top.set(xlim=(-3, 153), ylabel="velocity $v_1$ in m/s", title="Stress wave crossing from material points into finite elements, 25 $\\mu$s")
top.legend(frameon=False)
for grid, edge in ((mp, "none"), (fe, "0.4")):
    shape = PolyCollection([1e3 * grid["points"][c, :2] for c in grid["cells"]], cmap="RdBu_r", edgecolor=edge, linewidth=0.15)
    shape.set_array(grid["cell"]["S11"] / 1e6)
    shape.set_clim(-50, 50)
    low.add_collection(shape)
low.axvline(75, color="0.7", lw=0.8)
low.set(xlim=(-3, 153), ylim=(-3, 53), xlabel="x in mm", ylabel="y in mm")
low.set_aspect("equal")
fig.colorbar(shape, ax=[top, low], label="stress S11 in MPa", shrink=0.4, anchor=(0.0, 0.0))
picture = os.path.join(sys.argv[1], "wave.png")
fig.savefig(picture, bbox_inches="tight")

print("""
  bar of 150 x 50 mm at 25 us: left half %d material points, right half %d finite elements
  largest velocity, computed      %8.4f m/s
  largest velocity, exact         %8.4f m/s
  error of the velocity (L2)      %8.3f %%   of the exact wave
  transverse velocity, largest    %8.1e     of the exact wave; exact: 0
  run time                        %8.1f s
  picture                         %s""" % (len(x_mp), len(fe["cells"]), v[:, 0].max(), exact(line).max(), 100 * L2, across,
                                          float(sys.argv[2]), picture))
good = across < 1e-3
print("%s  transverse velocity below 0.1 %% of the wave" % ("PASS" if good else "FAIL"))
sys.exit(0 if good else 1)
