#!/usr/bin/python3
"""Short of memory the program says so, or is right: test_memory.py KSCHUR [--all]. Exit status 0: all is well.

Runs under limits of addresses (ulimit -v): each ends with the answer of a run without limit, or with exit status 4, one
line, and nothing written; none hangs, crashes or is cut short. --all: every command and every 32 MB from 64 MB to 2 GB.
"""
import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

KSCHUR = os.path.abspath(sys.argv[1])
ALL = "--all" in sys.argv[2:]
# A run that is slow is no hang: others may want the cores in an evening of runs.
SECONDS = 900 if ALL else 120
# Below this the loader of shared libraries, or OpenBLAS while it is loaded, may refuse: the program has not begun.
LOADER_MEGABYTES = 128
failures = []


def run(words, megabytes=None):
    def limit():
        if megabytes:
            resource.setrlimit(resource.RLIMIT_AS, (megabytes << 20, megabytes << 20))

    try:
        done = subprocess.run([KSCHUR, *map(str, words)], capture_output=True, text=True, timeout=SECONDS, preexec_fn=limit)
    except subprocess.TimeoutExpired:
        return "hangs", "", ""
    return done.returncode, done.stdout, done.stderr


def numbers(text):
    """What a run printed, without what it took."""
    if text.startswith("{"):
        result = json.loads(text)
        return [mode["eigenvalue"] for mode in result["modes"]]
    return text


def agree(first, second):
    if isinstance(first, str):
        return first == second
    scale = max(abs(complex(*value)) for value in first)
    return len(first) == len(second) and all(abs(complex(*a) - complex(*b)) <= 1e-6*scale for a, b in zip(first, second))


def judge(words, megabytes, expected, folder):
    """What is wrong with a run; none: nothing."""
    before = sorted(os.listdir(folder))
    status, out, errors = run(words, megabytes)
    after = sorted(os.listdir(folder))
    if megabytes < LOADER_MEGABYTES and status not in (0, 4) and not errors.startswith("kschur:"):
        return None if before == after else f"left {after}"
    if status == 0:
        return None if expected is None or agree(numbers(out), expected) else "another answer"
    if status != 4:
        return f"exit status {status}: {errors[:200]}"
    if errors.count("\n") != 1 or not errors.startswith("kschur: "):
        return f"more than a line: {errors[:200]}"
    return None if before == after and not out else f"left {set(after) - set(before)} {out[:60]}"


def walk(words, limits, folder, output=None):
    if output is None:
        status, out, errors = run(words)
        if status != 0:
            failures.append(words)
            print(f"FAILS {words}: {status} {errors}")
            return
        expected = numbers(out)
    else:
        expected = None
        words = (*words, "--output", output)
    wrong, done = [], 0
    for megabytes in limits:
        problem = judge(words, megabytes, expected, folder)
        if problem:
            wrong.append(f"{megabytes} MB: {problem}")
        if output is not None and output.exists():
            done += 1
            if run(("info", output))[0] != 0:
                wrong.append(f"{megabytes} MB: what was written is not whole")
            subprocess.run(["rm", "-r", str(output)], check=True)
    print(("FAILS " if wrong else "ok    ") + " ".join(map(str, words)).replace(str(folder) + "/", ""), *wrong, sep="\n        ")
    if wrong:
        failures.append(words)


def solve(problem, *words):
    return "solve", problem, "--modes", "12", "--format", "json", *words


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        grid, turbine, crank = folder/"grid.h5", folder/"turbine.h5", folder/"crank.h5"
        for words in (("grid", "--cells", "20x14", "--output", grid), ("turbine", "--output", turbine),
                      ("crank", "--output", crank)):
            if run(("scene", *words))[0] != 0:
                sys.exit(f"no scene {words}")
        if not ALL:
            limits = (96, 200, 272, 288, 304, 320, 352, 500)
            walk(solve(grid), limits, folder)
            walk(solve(turbine, "--inner", "mumps", "--left"), limits, folder)
            walk(("scene", "grid", "--cells", "30x20"), (96, 112, 128, 160), folder, folder/"new.h5")
            walk(("info", grid), (96, 112, 128), folder)
        else:
            limits = range(64, 2049, 32)
            for words in ((), ("--inner", "mumps"), ("--inner", "iterative"), ("--left",), ("--band", "0,1"), ("--method", "arpack"),
                          ("--formulation", "damped-constrained"), ("--formulation", "quadratic"),
                          ("--formulation", "low-rank"), ("--formulation", "proportional", "--inner", "ldl"), ("--block", "4")):
                if "--band" in words:
                    words = ("solve", grid, "--format", "json", *words)
                else:
                    words = solve(grid, *words)
                walk(words, limits, folder)
            for words in ((), ("--inner", "mumps"), ("--inner", "iterative"), ("--left",), ("--certify",),
                          ("--formulation", "damped-constrained-zero"), ("--formulation", "damped-constrained")):
                walk(solve(turbine, *words), limits, folder)
            walk(solve(crank), limits, folder)
            walk(("scene", "grid", "--cells", "40x30"), limits, folder, folder/"new.h5")
            walk(("scene", "grid", "--cells", "40x30"), limits, folder, folder/"new")
            walk(("info", grid), limits, folder)
            walk(("solve", grid, "--format", "json"), limits, folder, folder/"modes.h5")
    sys.exit(bool(failures))


main()
