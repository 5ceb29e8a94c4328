"""The program of a test, named by its first argument: runs of it, what they print, and problems for it."""
import json
import os
import subprocess
import sys

import numpy as np

from checks import check

KSCHUR = os.path.abspath(sys.argv[1])


def kschur(*words, **options):
    return subprocess.run([KSCHUR, *map(str, words)], capture_output=True, text=True, timeout=300, **options)


def solve(*words, status=0):
    """The JSON object of `kschur solve`, and what else went where."""
    run = kschur("solve", *words, "--format", "json")
    name = "solve " + " ".join(os.path.basename(str(w)) for w in words)
    check(f"{name}: exit status {status}", run.returncode == status, (run.returncode, run.stderr))
    try:
        return json.loads(run.stdout, parse_constant=lambda word: 1 / 0), run
    except (ValueError, ZeroDivisionError):
        check(f"{name}: prints JSON", False, run.stdout[:200])
        return {"modes": []}, run


def eigenvalues(result):
    return np.array([complex(*mode["eigenvalue"]) for mode in result["modes"]])


def check_values(name, found, expected, relative=1e-7, zero=1e-10):
    found, expected = np.asarray(found), np.asarray(expected)
    if check_size := len(found) == len(expected):
        error = np.abs(found - expected) / np.where(expected == 0, zero / relative, np.abs(expected))
        check(name, (error <= relative).all(), f"largest relative error {error.max():.2e}")
    else:
        check(name, check_size, f"{len(found)} instead of {len(expected)}")


def check_refused(name, status, run, *words):
    """One line on standard error with these words, nothing on standard output, this exit status."""
    check(f"{name}: exit status {status}", run.returncode == status, (run.returncode, run.stderr))
    lines = run.stderr.splitlines()
    check(f"{name}: one line on standard error", len(lines) == 1 and lines[0].startswith("kschur: "), run.stderr)
    check(f"{name}: nothing on standard output", run.stdout == "", run.stdout)
    for word in words:
        check(f"{name}: names '{word}'", str(word) in run.stderr, run.stderr)


def write_matrix(path, matrix, extra=""):
    rows, columns = matrix.shape
    entries = [f"{i + 1} {j + 1} {float(matrix[i, j])!r}\n" for i in range(rows) for j in range(columns) if matrix[i, j]]
    count = len(entries) + bool(extra)
    path.write_text(f"%%MatrixMarket matrix coordinate real general\n{rows} {columns} {count}\n" + "".join(entries) + extra)


def write_problem(folder, **matrices):
    folder.mkdir()
    for name, matrix in matrices.items():
        write_matrix(folder / f"{name}.mtx", np.asarray(matrix, dtype=float))
    return folder


def read_dense(group):
    dense = np.zeros(group.attrs["shape"])
    for i, (first, last) in enumerate(zip(group["indptr"][:-1], group["indptr"][1:])):
        np.add.at(dense[i], group["indices"][first:last], group["data"][first:last])
    return dense
