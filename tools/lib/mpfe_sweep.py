"""Runs decks for the scripts of verification/ and tools/: one call a run, results as numbers; verdict lines as in JOB.chk."""
import collections
import os
import resource
import subprocess
import sys

from mpfe_files import np, read_chk, read_table

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
MPFE = os.path.abspath(os.environ.get("MPFE", os.path.join(TOP, "bin", "mpfe")))
Call = collections.namedtuple("Call", "job code words cpu")      # base of the files, exit code, what it said, CPU seconds
failures = 0


def results_dir(name):
    """Folder of a sweep's results: $MPFE_RESULTS, or results/name."""
    path = os.environ.get("MPFE_RESULTS", os.path.join(TOP, "results", name))
    os.makedirs(path, exist_ok=True)
    return path


def call(deck, out, define):
    """Runs a deck, a path from the top folder, with the definitions {name: value} into the folder out."""
    os.makedirs(out, exist_ok=True)
    args = [MPFE, os.path.join(TOP, deck), "-o", out]
    for name, value in define.items():
        args += ["-D", "%s=%s" % (name, value if isinstance(value, str) else "%.17g" % value)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(args, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Call(os.path.join(out, os.path.splitext(os.path.basename(deck))[0]), done.returncode, done.stdout, cpu)


def checks(job):
    """[(name, value, difference)] of the .chk of a run."""
    if not os.path.exists(job + ".chk"):
        return []
    return [(c["name"], c["value"], c["difference"]) for c in read_chk(job + ".chk")]


def run(deck, out, may_fail=False, **define):
    """Runs a deck; returns None when it stopped and may_fail is set, else {"check": {name: value}, "his": columns, "cpu": seconds, "code": exit code}."""
    done = call(deck, out, define)
    if done.code not in (0, 1):
        if may_fail:
            return None
        sys.exit("%s %s\n%s" % (deck, define, done.words))
    check = {name: value for name, value, _ in checks(done.job)}
    return {"check": check, "his": read_table(done.job + ".his"), "cpu": done.cpu, "code": done.code, "job": done.job}


def order(size, error):
    """Slope of log(error) over log(size), last two points."""
    return float(np.log(error[-1] / error[-2]) / np.log(size[-1] / size[-2]))


def verdict(name, value, target, tolerance, source, good=None):
    """Prints one line in the layout of JOB.chk; good overrides |value - target| <= tolerance."""
    global failures
    if good is None:
        good = abs(value - target) <= tolerance
    failures += not good
    print("%-4s  %-24s %18.10e %18.10e %12.4e %12.4e  %s"
          % ("PASS" if good else "FAIL", name, value, target, value - target, tolerance, source))
    sys.stdout.flush()


def at_least(name, value, bound, source):
    verdict(name + ">=", value, bound, 0.0, source, value >= bound)


def at_most(name, value, bound, source):
    verdict(name + "<=", value, bound, 0.0, source, value <= bound)


def finish():
    sys.exit(1 if failures else 0)
