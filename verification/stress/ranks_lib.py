"""Histories of one deck on several numbers of ranks, compared (s6_ranks, divided)."""
import math
import os
import re

ENERGIES = ("kinetic", "strain", "bond", "external", "balance", "ECONV", "EFRAC", "TAKEN")


def history(folder, name):
    with open(os.path.join(folder, name + ".his")) as f:
        lines = f.read().splitlines()
    rows = [[float(x) for x in line.split()] for line in lines[1:]]
    return dict(zip(lines[0].lstrip("# ").split(), zip(*rows)))


def scales(folder, name, his):
    """What differences are divided by, at least."""
    with open(os.path.join(folder, name + ".lst")) as f:
        text = f.read()
    mass = sum(float(x) for x in re.findall(r"^  (?:section|body) .* mass ([^\s,]+)(?:,.*)?$", text, re.M))
    lengths = [abs(float(b) - float(a)) for a, b in re.findall(r"[xyz] (\S+) \.\.\. ([^\s,]+)", text)]
    energy = max(abs(x) for e in ENERGIES if e in his for x in his[e])
    momentum = math.sqrt(2.0 * mass * max(his["kinetic"]))
    size = max(lengths) if lengths else 1.0
    scale = {column: energy for column in ENERGIES}
    scale.update({"p" + i: momentum for i in "xyz"})
    scale.update({"l" + i: momentum * size for i in "xyz"})
    for column in his:
        if column[-1] in "123" and column[-2:-1] in "UVAX":
            scale[column] = max(abs(x) for i in "123" for x in his.get(column[:-1] + i, [0.0]) if not math.isnan(x))
    return scale


def difference(a, b, scale, left_out=()):
    """The largest relative difference of two histories, and its column."""
    worst, where = 0.0, "-"
    for column in b:
        if column == "iter" or column in left_out:
            continue
        if column not in a or len(a[column]) != len(b[column]):
            return math.inf, column
        largest = max([scale.get(column, 0.0)] + [abs(x) for x in b[column] if not math.isnan(x)])
        for x, y in zip(a[column], b[column]):
            d = 0.0 if x == y or (math.isnan(x) and math.isnan(y)) else abs(x - y) / largest if largest > 0.0 else math.inf
            if not d <= worst:
                worst, where = d, column
    return worst, where
