"""What the scripts of the paper's cases share: running a deck, reading what it wrote, verdict lines.

The program is $MPFE (default bin/mpfe), the folder of the results $MPFE_RESULTS (default results/CASE).
"""
import glob
import os
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.realpath(__file__))
TOP = os.path.dirname(os.path.dirname(HERE))
sys.path.insert(0, os.path.join(TOP, "tools", "lib"))
from mpfe_files import as_array, np, read_table, read_vtk   # noqa: F401  (np first: it may start the script again)
import mpfe_sweep

import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt

plt.rcParams.update({"font.size": 10, "axes.grid": True, "grid.alpha": 0.25, "axes.spines.top": False,
                     "axes.spines.right": False, "legend.frameon": False, "lines.linewidth": 1.4,
                     "figure.dpi": 150, "savefig.bbox": "tight"})

failed = 0


def results(case):
    folder = os.environ.get("MPFE_RESULTS") or os.path.join(TOP, "results", case)
    os.makedirs(folder, exist_ok=True)
    return folder


def tell_checks(lines, name, quiet):
    """Verdicts of the checks of a run, from its words or its .chk."""
    for line in lines:
        if line.startswith("FAIL") or (line.startswith("PASS") and not quiet):
            verdict(line.startswith("PASS"), "%s %s" % (name, line[6:].strip()))


def run(deck, folder, tag, quiet=False, **parameters):
    """Runs verification/paper/DECK with -D name=value; the base of its files: folder/tag/DECK. quiet: no lines of what passes.
    With --judge on the command line nothing runs: the files are those of an earlier call."""
    out, name = os.path.join(folder, tag), os.path.splitext(os.path.basename(deck))[0]
    if "--judge" in sys.argv[1:]:
        with open(os.path.join(out, name + ".chk")) as f:
            tell_checks(f, name, quiet)
        return os.path.join(out, name)
    for old in glob.glob(os.path.join(out, "*.vtk")):
        os.remove(old)
    start = time.time()
    done = mpfe_sweep.call(os.path.join("verification", "paper", deck), out, parameters)
    words = " ".join(["%s=%g" % p for p in parameters.items()])
    if not quiet:
        print("      %s %s: %.1f s" % (os.path.basename(deck), words, time.time() - start))
    tell_checks(done.words.splitlines(), name, quiet)
    if done.code not in (0, 1):
        print(done.words[-2000:])
        verdict(False, "%s ended with exit code %d" % (name, done.code))
        sys.exit(1)
    return done.job


def history(base, *names):
    table = read_table(base + ".his")
    return [table[name] for name in names]


def frame(base, kind, which=-1):
    """A frame of a kind (fe, mp, bond, grid); the last one by default."""
    return read_vtk(sorted(glob.glob("%s_%s_*.vtk" % (base, kind)))[which])


def verdict(good, text):
    global failed
    failed += not good
    print("%s  %s" % ("PASS" if good else "FAIL", text))
    sys.stdout.flush()


def below(name, value, limit):
    verdict(bool(value <= limit), "%-58s %11.4g  at most  %g" % (name, value, limit))


def above(name, value, limit):
    verdict(bool(value >= limit), "%-58s %11.4g  at least %g" % (name, value, limit))


def save(fig, path):
    fig.savefig(path)
    plt.close(fig)
    print("      picture %s" % os.path.relpath(path, TOP))


def plot_tool(arguments):
    """tools/plot: the pictures of fields."""
    subprocess.run([sys.executable, os.path.join(TOP, "tools", "plot")] + arguments, check=True, stdout=subprocess.DEVNULL)
    print("      picture %s" % os.path.relpath(arguments[arguments.index("-o") + 1], TOP))
