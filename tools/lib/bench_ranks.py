"""Runs of one deck on several ranks for tools/bench: seconds, what a rank works without its waiting, memory of each rank."""
import os
import re
import subprocess
import sys

from mpfe_ranks import launcher, possible
from mpfe_sweep import MPFE, TOP

# so few elements that they count for nothing, and enough to be divided among four ranks: what the program, MPI and the
# libraries that divide a mesh take
EMPTY = """*BLOCK, TYPE=CPE4, ELSET=E
0, 0, 2, 1
16, 8
*MATERIAL, NAME=M
*ELASTIC
1, 0.2
*SOLID SECTION, ELSET=E, MATERIAL=M
*BOUNDARY
E_XMIN, 1, 2
*STEP
*STATIC, DIRECT
1, 1
*END STEP
"""


def possible_here():
    return possible(MPFE)


def words_before(ranks):
    """As a user starts it where there is a core for each rank. One rank is the child of a small process: the largest memory of
    a process is at least that of the one that it was a copy of."""
    if ranks == 1:
        return ["sh", "-c", '"$@"; exit $?', "sh"]
    if "MPFE_MPIRUN" in os.environ or ranks > os.cpu_count():
        return launcher(ranks)
    return ["mpirun", "-np", str(ranks)] + (["--allow-run-as-root"] if os.geteuid() == 0 else [])


def started(ranks, deck, out, define):
    args = [MPFE, os.path.join(TOP, "verification", deck), "-o", out]
    for name, value in define.items():
        args += ["-D", "%s=%.17g" % (name, value)]
    os.makedirs(out, exist_ok=True)
    return subprocess.Popen(words_before(ranks) + args, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def ended(child, deck, out):
    words, _ = child.communicate()
    if child.returncode not in (0, 1):
        sys.exit("%s\n%s" % (deck, words))
    job = os.path.join(out, os.path.splitext(os.path.basename(deck))[0])
    return numbers(open(job + ".lst", errors="replace").read())


def numbers(text):
    """Of a listing. work: CPU seconds of the rank that waits least, without its waiting."""
    tail = text[text.rindex("\nTIME"):]
    pair = lambda name: [float(x) for x in re.findall(r"^  %s +(?:\d+ +)?([\d.]+) +([\d.]+)" % name, tail, re.M)[-1]]
    wall, cpu = pair("whole run")
    table = re.findall(r"^ +\d+ +\d+ +\d+ +\d+ +[\d.]+ +([\d.]+) +([\d.]+)$", tail, re.M)
    work = cpu
    if table:
        waits, waits_cpu = pair("between ranks")
        work = cpu - waits_cpu + waits - min(float(between) for between, _ in table)
    memory = [float(mb) for _, mb in table] or [float(re.findall(r"memory peak +([\d.]+)", tail)[-1])]
    return {"wall": wall, "work": work, "memory": max(memory), "equations": float(re.findall(r"(\d+) equations, balance", text)[-1]),
            "steps": len(re.findall(r"^  increment \d+ done", text, re.M))}


def run(ranks, deck, out, define):
    return ended(started(ranks, deck, out, define), deck, out)


def least(runs):
    return {key: min(r[key] for r in runs) for key in runs[0]}


def in_turns(rounds, ranks, deck, out, define):
    """The least of some runs on each of these numbers of ranks, which take turns."""
    runs = {n: [] for n in ranks}
    for _ in range(rounds):
        for n in ranks:
            runs[n].append(run(n, deck, out, define))
    return [least(runs[n]) for n in ranks]


def copies(number, deck, out, define):
    """That many runs of one rank at once."""
    folders = [os.path.join(out, "copy%d" % k) for k in range(number)]
    children = [started(1, deck, folder, define) for folder in folders]
    return [ended(c, deck, folder) for c, folder in zip(children, folders)]


def disturbance(number, deck, out, define):
    """Seconds of that many runs of one rank at once, over those of one alone: 1 where cores do not disturb each other."""
    alone = least([run(1, deck, out, define) for _ in range(2)])["wall"]
    return max(r["wall"] for r in copies(number, deck, out, define)) / alone


def increment_seconds(runs, deck, out, define):
    """CPU seconds of the work of a rank in an increment, the least of some: runs(deck, out, define) gives the runs of a deck with
    the parameter steps; input and the start of MPI are in none of them."""
    few, many = 20, 120
    mean = lambda steps: min(sum(r["work"] for r in list_) / len(list_) for list_ in
                             (runs(deck, out, dict(define, steps=steps)) for _ in range(4)))
    return (mean(many) - mean(few)) / (many - few)


def empty(out):
    """A deck with next to nothing in it; its path."""
    os.makedirs(out, exist_ok=True)
    path = os.path.join(out, "empty.inp")
    with open(path, "w") as f:
        f.write(EMPTY)
    return os.path.relpath(path, os.path.join(TOP, "verification"))
