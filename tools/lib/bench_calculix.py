"""The cantilever of verification/speed in CalculiX: writes the deck from the same mesh, runs ccx, reads the tip."""
import os
import re
import shutil
import subprocess
import sys


def have():
    """Is ccx there? As root on Debian or Ubuntu it is fetched."""
    if not shutil.which("ccx") and os.geteuid() == 0 and shutil.which("apt-get"):
        subprocess.run(["apt-get", "install", "-y", "-q", "calculix-ccx"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return shutil.which("ccx") is not None


def cantilever(job, nx, ny, load=80.0, increments=5):
    """Writes JOB.inp: 5 x 2, nx x ny CPE4, clamped at x = 0, dead load downwards at x = 5. Returns (job, label of the tip)."""
    label = lambda i, j: j * (nx + 1) + i + 1
    with open(job + ".inp", "w") as f:
        f.write("*NODE, NSET=ALL\n")
        for j in range(ny + 1):
            for i in range(nx + 1):
                f.write("%d, %.15g, %.15g, 0\n" % (label(i, j), 5.0 * i / nx, 2.0 * j / ny))
        f.write("*ELEMENT, TYPE=CPE4, ELSET=BEAM\n")
        for j in range(ny):
            for i in range(nx):
                f.write("%d, %d, %d, %d, %d\n" % (j * nx + i + 1, label(i, j), label(i + 1, j), label(i + 1, j + 1), label(i, j + 1)))
        f.write("*NSET, NSET=CLAMP\n" + "".join("%d,\n" % label(0, j) for j in range(ny + 1)))
        f.write("*NSET, NSET=TIP\n%d\n" % label(nx, ny // 2))
        f.write("*MATERIAL, NAME=M\n*ELASTIC\n1e4, 0.2\n*SOLID SECTION, ELSET=BEAM, MATERIAL=M\n1.0\n*BOUNDARY\nCLAMP, 1, 2\n")
        f.write("*STEP, NLGEOM, INC=100\n*STATIC, DIRECT\n%g, 1.0\n*CLOAD\n" % (1.0 / increments))
        for j in range(ny + 1):
            f.write("%d, 2, %.15g\n" % (label(nx, j), -load / ny * (0.5 if j in (0, ny) else 1.0)))
        f.write("*NODE PRINT, NSET=TIP, FREQUENCY=%d\nU\n*END STEP\n" % increments)
    return job, label(nx, ny // 2)


def run(case):
    """CPU seconds, memory peak in MB and displacement of the tip of one run of ccx."""
    job, tip = case
    log = open(job + ".log", "w")
    child = subprocess.Popen(["ccx", os.path.basename(job)], cwd=os.path.dirname(job), stdout=log, stderr=subprocess.STDOUT,
                             env=dict(os.environ, OMP_NUM_THREADS="1", CCX_NPROC_EQUATION_SOLVER="1"))
    _, status, use = os.wait4(child.pid, 0)
    rows = re.findall(r"^ +%d +(\S+) +(\S+) +(\S+)" % tip, open(job + ".dat").read(), re.M) if status == 0 else []
    if not rows:
        sys.exit("ccx stopped: see %s.log" % job)
    return {"cpu": use.ru_utime + use.ru_stime, "memory": use.ru_maxrss / 1024.0, "tip": [float(x) for x in rows[-1]]}
