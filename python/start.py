#!python
"""Starts the program of this name in the package kschur, whose scripts run with the Python of this one."""
import importlib.util
import os
import sys
from pathlib import Path

# The package is not imported: the program needs nothing of it.
package = importlib.util.find_spec("kschur")
program = Path(package.origin).with_name("bin") / Path(__file__).name
os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)])
os.execv(program, [str(program), *sys.argv[1:]])
