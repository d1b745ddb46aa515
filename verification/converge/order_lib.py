"""What the sweeps of this folder share: run a deck, read its .chk or .his, fit orders, print judged lines, draw.

MPFE names the program (default bin/mpfe), MPFE_RESULTS the folder of the results (default results/converge).
"""
import os
import sys

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.path.insert(0, os.path.join(TOP, "tools", "lib"))
from mpfe_files import np, read_table      # starts again under /usr/bin/python3 when numpy is missing
import mpfe_sweep

RESULTS = os.environ.get("MPFE_RESULTS", os.path.join(TOP, "results", "converge"))


def run(deck, define):
    """Runs a deck of verification/ with -D definitions; returns the name of its files without ending."""
    job = os.path.splitext(os.path.basename(deck))[0]
    folder = os.path.join(RESULTS, "_".join([job] + [d.replace("=", "") for d in define]))
    done = mpfe_sweep.call(os.path.join("verification", deck), folder, dict(d.split("=", 1) for d in define))
    if done.code not in (0, 1):                # 1: a check of the deck failed; the sweep judges for itself
        sys.stdout.write(done.words)
        print("FAIL  %s exit code %d" % (os.path.basename(folder), done.code))
        sys.exit(1)
    return done.job


def run_errors(deck, define):
    """{check: difference} of the .chk of a run: field_U2 for L2(U2)@end, centre_S22 for L2centre(S22)@end, TOP for TOP@end; of two of a name the first."""
    out = {}
    for name, _, difference in mpfe_sweep.checks(run(deck, define)):
        name = name.split("@")[0].replace("L2centre(", "centre_").replace("L2(", "field_").rstrip(")")
        out.setdefault(name, difference)
    return out


def run_history(deck, define):
    return read_table(run(deck, define) + ".his")


def fit(h, error):
    """Slope of log error over log h."""
    return float(np.polyfit(np.log(h), np.log(error), 1)[0])


class Report:
    """Lines PASS/FAIL name value target difference tolerance source, as in a .chk."""

    def __init__(self, title):
        self.failed = 0
        print("# %s" % title)
        print("# name value target difference tolerance source")

    def line(self, good, name, value, target, tolerance, source):
        self.failed += not good
        print("%-4s  %-34s %14.6e %14.6e %12.4e %12.4e  %s" %
              ("PASS" if good else "FAIL", name, value, target, value - target, tolerance, source))
        sys.stdout.flush()

    def least(self, name, value, bound, source="ANALYTIC"):
        self.line(value >= bound, name, value, bound, 0.0, source + " (at least)")

    def most(self, name, value, bound, source="ANALYTIC"):
        self.line(value <= bound, name, value, bound, 0.0, source + " (at most)")

    def near(self, name, value, target, tolerance, source="ANALYTIC"):
        self.line(abs(value - target) <= tolerance, name, value, target, tolerance, source)

    def table(self, name, sizes, columns):
        print("# %-24s %s" % (name, " ".join("%12s" % c for c in columns)))
        for i, n in enumerate(sizes):
            print("#   %-22s %s" % (n, " ".join("%12.4e" % columns[c][i] for c in columns)))


def plot_orders(path, curves, xlabel, ylabel, title, slopes=(1, 2)):
    """Errors over h, both logarithmic, with lines of the slopes; drawn into the folder of the results."""
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    plt.rcParams.update({"font.size": 9, "axes.grid": True, "grid.alpha": 0.25, "axes.spines.top": False,
                         "axes.spines.right": False, "legend.frameon": False, "figure.dpi": 150, "savefig.bbox": "tight"})
    fig, ax = plt.subplots(figsize=(7.5, 4.6))
    marks = "os^vDx+*<>ph"
    for i, (name, h, error) in enumerate(curves):
        ax.loglog(h, error, marker=marks[i % len(marks)], markersize=4, linewidth=1.1, label=name)
    hs = np.array(sorted({x for _, h, _ in curves for x in h}))
    top = max(max(e) for _, _, e in curves)
    for s in slopes:
        ax.loglog(hs, top * (hs / hs[-1]) ** s, color="0.6", linewidth=0.8, linestyle=":")
        ax.annotate("order %d" % s, (hs[0], top * (hs[0] / hs[-1]) ** s), color="0.4", fontsize=8)
    ax.set(xlabel=xlabel, ylabel=ylabel, title=title)
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8)
    os.makedirs(RESULTS, exist_ok=True)
    fig.savefig(os.path.join(RESULTS, path))
    plt.close(fig)
