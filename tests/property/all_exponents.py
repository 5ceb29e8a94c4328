#!/usr/bin/python3
"""Problems whose entries have any exponent of a double: all_exponents.py KSCHUR [--draws N] [--seed S] [--keep FOLDER].

Two masses and springs without damping, or one mass with damping: the eigenvalues are roots of quadratic polynomials, here in
a thousand digits. A problem may be refused, and modes be flagged (exit status 3) or told to have an infinite condition number, which
leaves them without an error bound; all others are eigenvalues within their bounds, and where they are certified none is missing.
"""
import argparse
import collections
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import mpmath

mpmath.mp.dps = 1000
ENVIRONMENT = dict(os.environ, OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1")
# Of a solve of two unknowns.
SECONDS = 60
# Exponents of two: of all doubles, of those that are computed with, beside which most are ones.
RANGES = ((-1074, 1023), (-249, 249), (-60, 60))


def number(draw, extent):
    return draw.uniform(1, 2)*2.0**max(min(draw.randint(*extent), 1023), -1074)


def make(seed, index):
    """The matrices by name."""
    draw = random.Random(f"exponents {seed} {index}")
    extent = draw.choice(RANGES)
    share = draw.choice((0.25, 1))

    def entry():
        return number(draw, extent) if draw.random() < share else float(draw.choice((1, 2, 3)))

    if draw.random() < 0.3:
        return {"M": [[entry()]], "K": [[entry()]], "R": [[entry()]]}
    stiffness = [[entry(), 0.0], [0.0, entry()]]
    kind = draw.randrange(3)
    if kind > 0:
        stiffness[0][1] = entry()*draw.choice((-1, 1))
        stiffness[1][0] = stiffness[0][1] if kind == 1 else entry()
    return {"M": [[entry(), 0.0], [0.0, entry()]], "K": stiffness}


def roots(a, b, c):
    """Of a x^2 + b x + c."""
    if a == 0:
        return [-c/b] if b else []
    root = mpmath.sqrt(b*b - 4*a*c)
    q = -(b + (root if mpmath.re(mpmath.conj(b)*root) >= 0 else -root))/2
    return [q/a, c/q] if q else [mpmath.mpf(0)]*2


def spectrum(matrices):
    m, k = ([[mpmath.mpf(x) for x in row] for row in matrices[name]] for name in "MK")
    if "R" in matrices:
        return roots(m[0][0], mpmath.mpf(matrices["R"][0][0]), k[0][0])
    squares = roots(m[0][0]*m[1][1], m[0][0]*k[1][1] + m[1][1]*k[0][0], k[0][0]*k[1][1] - k[0][1]*k[1][0])
    return [sign*mpmath.sqrt(square) for square in squares for sign in (1, -1)]


def write(folder, matrices):
    for name, rows in matrices.items():
        lines = [f"{i + 1} {j + 1} {x!r}" for i, row in enumerate(rows) for j, x in enumerate(row) if x]
        (folder/f"{name}.mtx").write_text("%%MatrixMarket matrix coordinate real general\n"
                                          f"{len(rows)} {len(rows)} {len(lines)}\n" + "".join(line + "\n" for line in lines))


def judge(kschur, folder, matrices):
    """A class, and what is wrong; that is empty where nothing is."""
    exact = spectrum(matrices)
    # One of a conjugate pair is a mode.
    count = sum(mpmath.im(value) >= 0 for value in exact)
    command = [kschur, "solve", str(folder), "--modes", str(max(count, 1)), "--symmetric", "no", "--left", "--format", "json"]
    try:
        run = subprocess.run(command, capture_output=True, text=True, env=ENVIRONMENT, timeout=SECONDS)
    except subprocess.TimeoutExpired:
        return "failed", "no end"
    if run.returncode in (2, 4) and run.stderr.count("\n") == 1:
        return "refused" if "can be computed with" in run.stderr else "given up", ""
    if run.returncode not in (0, 3):
        return "failed", f"exit status {run.returncode}: {run.stderr}"
    result = json.loads(run.stdout)
    if run.returncode == 3:
        return "flagged", ""
    modes = [(mpmath.mpc(*mode["eigenvalue"]), mode["error"]) for mode in result["modes"]]
    if any(error is None for _, error in modes):
        return "unbounded", ""
    for value, error in modes:
        off = min(abs(value - other) for other in exact)
        if off > max(10*error, mpmath.mpf(2)**-1074, mpmath.mpf("1e-13")*abs(value)):
            return "failed", f"{mpmath.nstr(value)} is off by {mpmath.nstr(off)}, and its bound is {error}"
    for other in exact if result["certified"] is True else []:
        if all(min(abs(value - other), abs(value - mpmath.conj(other))) > max(10*error, mpmath.mpf("1e-6")*abs(other))
               for value, error in modes):
            return "failed", f"{mpmath.nstr(other)} is missing, and the result certified"
    return "solved", ""


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("kschur", type=os.path.abspath)
    parser.add_argument("--draws", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path)
    arguments = parser.parse_args()
    counts, began = collections.Counter(), time.monotonic()
    for index in range(arguments.draws):
        matrices = make(arguments.seed, index)
        with tempfile.TemporaryDirectory() as name:
            write(Path(name), matrices)
            verdict, wrong = judge(arguments.kschur, Path(name), matrices)
        counts[verdict] += 1
        if wrong:
            print(f"FAILS {arguments.seed} {index}: {wrong}  {matrices}", flush=True)
            if arguments.keep:
                (arguments.keep/f"{arguments.seed}-{index}").mkdir(parents=True)
                write(arguments.keep/f"{arguments.seed}-{index}", matrices)
    print(f"{arguments.draws} draws: " + ", ".join(f"{count} {name}" for name, count in sorted(counts.items())) +
          f", {time.monotonic() - began:.0f} s")
    sys.exit(counts["failed"] > 0)


main()
