"""Runs decks for sweeps: one call a run, results as numbers; verdict lines as in JOB.chk."""
import os
import resource
import subprocess
import sys

from mpfe_files import np, read_table

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
MPFE = os.path.abspath(os.environ.get("MPFE", os.path.join(TOP, "bin", "mpfe")))
failures = 0


def results_dir(name):
    """Folder of a sweep's results: $MPFE_RESULTS, or results/name."""
    path = os.environ.get("MPFE_RESULTS", os.path.join(TOP, "results", name))
    os.makedirs(path, exist_ok=True)
    return path


def run(deck, out, may_fail=False, **define):
    """Runs a deck; returns None when it stopped and may_fail is set, else {"check": {name: value}, "his": columns, "cpu": seconds, "code": exit code}."""
    os.makedirs(out, exist_ok=True)
    args = [MPFE, os.path.join(TOP, deck), "-o", out]
    for name, value in define.items():
        args += ["-D", "%s=%.17g" % (name, value)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(args, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode not in (0, 1):
        if may_fail:
            return None
        sys.exit("%s\n%s" % (" ".join(args), done.stdout))
    job = os.path.join(out, os.path.splitext(os.path.basename(deck))[0])
    check = {}
    if os.path.exists(job + ".chk"):
        for line in open(job + ".chk"):
            word = line.split()
            if word and word[0] in ("PASS", "FAIL"):
                check[word[1]] = float(word[2])
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {"check": check, "his": read_table(job + ".his"), "cpu": cpu, "code": done.returncode, "job": job}


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
