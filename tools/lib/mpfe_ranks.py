"""How to start the program on several ranks."""
import functools
import os
import shlex
import shutil
import subprocess


@functools.lru_cache(maxsize=None)
def mpi_version():
    return subprocess.run(["mpirun", "--version"], stdout=subprocess.PIPE, universal_newlines=True).stdout


def launcher(ranks):
    """Words in front of the program; [] for one rank. MPFE_MPIRUN replaces all of them but the number ("srun -n")."""
    if ranks == 1:
        return []
    if "MPFE_MPIRUN" in os.environ:
        return shlex.split(os.environ["MPFE_MPIRUN"]) + [str(ranks)]
    words = ["mpirun", "-np", str(ranks)]
    if "Open MPI" in mpi_version():        # more ranks than cores, other runs beside this one
        words += ["--oversubscribe", "--bind-to", "none", "--mca", "mpi_yield_when_idle", "1"]
        words += ["--allow-run-as-root"] if os.geteuid() == 0 else []
    return words


def possible(program):
    """Can this program run on several ranks here?"""
    return not program.endswith("-serial") and ("MPFE_MPIRUN" in os.environ or shutil.which("mpirun") is not None)
