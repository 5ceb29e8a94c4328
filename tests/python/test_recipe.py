#!/usr/bin/python3
"""A recipe of examples/recipes runs, and says what the other code says: test_recipe.py RECIPE PACKAGE LARGEST

Exit status 77, skipped, where the package, a module of this Python or the program ccx, is not installed. LARGEST is the largest relative
difference to the code's own answers that passes, of each line that tells one.
"""
import importlib.util
import os
import re
import shutil
import subprocess
import sys

recipe, package, largest = sys.argv[1:]
if not (shutil.which(package) or importlib.util.find_spec(package)):
    print(f"SKIPPED: {package} is not installed for {sys.executable}; docs/recipes.md says how")
    sys.exit(77)
run = subprocess.run([sys.executable, recipe], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                     env=dict(os.environ, MPLBACKEND="Agg"))
print(run.stdout)
differences = [float(number) for number in re.findall(r"largest difference (\S+)", run.stdout)]
if run.returncode or not differences or not max(differences) < float(largest):
    sys.exit(f"FAILS {recipe}: exit status {run.returncode}, differences {differences}, {largest} is allowed")
