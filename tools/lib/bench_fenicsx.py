"""The cantilever and the cube of verification/speed in FEniCSx: finds a python with dolfinx, runs verification/speed/fenicsx_solid."""
import json
import os
import subprocess
import sys

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
SCRIPT = os.path.join(TOP, "verification", "speed", "fenicsx_solid")
MISSING = "skipped: python3-dolfinx not installed"


def python():
    """An interpreter that has dolfinx, or None; Debian's package belongs to /usr/bin/python3."""
    for name in (sys.executable, "/usr/bin/python3"):
        if os.path.exists(name) and subprocess.run([name, "-c", "import dolfinx"], stderr=subprocess.DEVNULL).returncode == 0:
            return name
    return None


def run(interpreter, problem, cells, way):
    """What the script prints, with CPU seconds of the whole process; a small run before it compiles the forms."""
    small = ",".join("2" for _ in cells)
    for size in (small, ",".join(str(n) for n in cells)):
        child = subprocess.Popen([interpreter, SCRIPT, problem, size, way], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        words = child.stdout.read()
        _, status, use = os.wait4(child.pid, 0)
        if status != 0:
            sys.exit("FEniCSx stopped: %s %s %s %s %s" % (interpreter, SCRIPT, problem, size, way))
    return dict(json.loads(words), cpu=use.ru_utime + use.ru_stime)
