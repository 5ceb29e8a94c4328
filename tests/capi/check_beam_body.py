"""The C example of the beam with a body prints the digits of the program: check_beam_body.py EXAMPLE KSCHUR."""
import csv
import os
import subprocess
import sys
import tempfile

example, kschur = sys.argv[1:]


def run(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


with tempfile.TemporaryDirectory() as folder:
    problem = os.path.join(folder, "problem.h5")
    run(kschur, "scene", "beam-body", "--damping", "rayleigh", "--output", problem)
    table = run(kschur, "solve", problem, "--modes", "6", "--format", "csv").splitlines()
columns = ("eigenvalue_re", "eigenvalue_im", "frequency_hz", "damping_ratio")
expected = [[f"{float(row[name]):.7e}" for name in columns] for row in csv.DictReader(table)]
found = [line.split() for line in run(example).splitlines()[1:]]
if found != expected or len(found) != 6:
    sys.exit(f"the example printed {found}, the program {expected}")
