"""A deck of the catalogue that a test runs with cards around it: the command, the files of results, their bytes."""
import glob
import os
import subprocess
import sys

from mpfe_limit import run_limited
from mpfe_ranks import launcher

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
MPFE = os.path.abspath(os.environ.get("MPFE", os.path.join(TOP, "bin", "mpfe")))
RESULTS_OF_A_RUN = ("his", "dat", "ero", "frag", "chk", "vtk", "vtk.series")
failures = 0


def report(name, good, text=""):
    """A line for tools/verify; main ends with failures()."""
    global failures
    failures += not good
    print("%s  %s%s" % ("PASS" if good else "FAIL", name, ": " + text if text else ""))
    sys.stdout.flush()


def command(folder, name, deck, before="", after="", define=None):
    """Writes folder/name.inp, which includes the deck (a path relative to verification/) between two texts; how it runs on one rank."""
    os.makedirs(folder, exist_ok=True)
    path = os.path.join(folder, name + ".inp")
    with open(path, "w") as f:
        f.write("%s*INCLUDE, INPUT=%s\n%s" % (before, os.path.normpath(os.path.join(TOP, "verification", deck)), after))
    return [MPFE, path, "-o", folder] + ["-D%s=%s" % pair for pair in (define or {}).items()]


def run(words, ranks=1, limit=1800, **variables):
    """Runs a command; variables are added to the environment."""
    return run_limited(launcher(ranks) + words, limit, env=dict(os.environ, **variables), stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                       universal_newlines=True, errors="replace")


def text_of(folder, name, ending):
    """JOB.ending; '' when there is no such file."""
    path = os.path.join(folder, "%s.%s" % (name, ending))
    if not os.path.exists(path):
        return ""
    with open(path, errors="replace") as f:
        return f.read()


def same_file(a, b):
    """Do both exist, with the same bytes?"""
    if not (os.path.exists(a) and os.path.exists(b)):
        return False
    with open(a, "rb") as f, open(b, "rb") as g:
        return f.read() == g.read()


def files_differ(a, b, name, endings=RESULTS_OF_A_RUN):
    """Files of a job in two folders whose bytes differ, or that one has alone; how many there are."""
    files = sorted({os.path.basename(f) for folder in (a, b) for e in endings for f in glob.glob(os.path.join(folder, "%s*.%s" % (name, e)))})
    return [f for f in files if not same_file(os.path.join(a, f), os.path.join(b, f))], len(files)
