"""The readers of mpfe.py for the tools and tests of mpfe: an interpreter without numpy starts the script again under /usr/bin/python3, and
a file that cannot be read ends it with a line.
"""
import os
import sys

try:
    import numpy as np
except ImportError:
    SYSTEM_PYTHON = "/usr/bin/python3"
    if os.environ.get("MPFE_PYTHON_TRIED") or not os.path.exists(SYSTEM_PYTHON):
        sys.exit("this tool needs python3 with numpy and matplotlib (Debian: python3-numpy python3-matplotlib)")
    os.environ["MPFE_PYTHON_TRIED"] = "1"
    os.execv(SYSTEM_PYTHON, [SYSTEM_PYTHON] + sys.argv)
os.environ.pop("MPFE_PYTHON_TRIED", None)      # a script started from here looks for itself

from mpfe import FileError, as_array, compare, frames, read_chk, read_dat, read_frame, read_sta, read_table, read_vtk      # noqa: E402,F401


def end_with_line(kind, error, trace):
    if not issubclass(kind, FileError):
        return sys.__excepthook__(kind, error, trace)
    print(error, file=sys.stderr)


sys.excepthook = end_with_line
