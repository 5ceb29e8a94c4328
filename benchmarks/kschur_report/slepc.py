"""Where Debian keeps SLEPc's Python modules, one set for real and one for complex arithmetic."""

import glob
import os

ROOTS = ("/usr/lib/petscdir/petsc*", "/usr/lib/slepcdir/slepc*")


def environment(arithmetic):
    """PYTHONPATH for "real" or "complex" SLEPc, or None where it is not installed."""
    folders = [
        folder
        for root in ROOTS
        for folder in sorted(glob.glob(f"{root}/*-linux-gnu*-{arithmetic}/lib/python3/dist-packages"))[-1:]
    ]
    if len(folders) < len(ROOTS) or not all(os.path.isdir(folder) for folder in folders):
        return None
    return {"PYTHONPATH": os.pathsep.join(folders)}
