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
# What computes for ever is told by the seconds of its own that it takes, whoever else wants the cores; what sleeps by the clock.
CPU_SECONDS = 120
SECONDS = 1800
# Below this the loader of shared libraries, or OpenBLAS while it is loaded, may refuse: the program has not begun.
LOADER_MEGABYTES = 128
failures = []


def run(words, megabytes=None):
    def limit():
        resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS))
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


def walk(words, limits, folder, output=None, timed=False):
    """`output`: what is written, in place of what is printed; `timed`: seconds stand among what is printed."""
    if output is None:
        status, out, errors = run(words)
        if status != 0:
            failures.append(words)
            print(f"FAILS {words}: {status} {errors}")
            return
        expected = None if timed else numbers(out)
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
            if words[0] != "view" and run(("info", output))[0] != 0:
                wrong.append(f"{megabytes} MB: what was written is not whole")
            subprocess.run(["rm", "-r", str(output)], check=True)
    print(("FAILS " if wrong else "ok    ") + " ".join(map(str, words)).replace(str(folder) + "/", ""), *wrong, sep="\n        ")
    if wrong:
        failures.append(words)


def check_estimate(problem, folder, *words):
    """What info says of a solve is 0.8 to 1.5 of what it takes; a limit below that, and below that of factors in single
    precision, is refused, with both numbers."""
    facts = json.loads(run(("info", problem, "--format", "json", *words))[1])["memory_bytes"]
    taken = json.loads(run(("solve", problem, "--format", "json", "--threads", "1", *words))[1])["peak_memory_bytes"]
    wrong = [] if 0.8 <= facts["total"]/taken <= 1.5 else [f"{facts['total']} bytes are told, {taken} taken"]
    megabytes = facts["total"]//10**6
    least = facts.get("in_single_precision", facts["total"])//10**6
    status, out, errors = run(("solve", problem, *words, "--output", folder/"refused.h5", "--memory", f"{least}M"))
    expected = f"kschur: the solve is estimated to take {megabytes + 1} MB, and the limit of memory is "
    expected += f"{least} MB: raise it, or ask for fewer modes\n"
    if (status, out, errors) != (4, "", expected) or (folder/"refused.h5").exists():
        wrong.append(f"below the estimate: {status} {errors}")
    if run(("solve", problem, *words, "--memory", f"{megabytes + 1}M"))[0] != 0:
        wrong.append("refused above the estimate")
    print(("FAILS " if wrong else "ok    ") + f"estimate of {problem.name} {' '.join(words)}:", *wrong,
          f"{facts['total']/taken:.2f} of {taken/1e6:.0f} MB")
    if wrong:
        failures.append(("estimate", problem, *words))


def check_single(problem, *words):
    """Between the estimates factors in single precision are taken, said so: less memory, the same modes as sure."""
    facts = json.loads(run(("info", problem, "--format", "json", *words))[1])["memory_bytes"]
    limit = (facts["in_single_precision"] + facts["total"])//2
    double, single = (json.loads(run(("solve", problem, "--format", "json", "--threads", "1", *words, *more))[1])
                      for more in ((), ("--memory", str(limit))))
    wrong = []
    if not 0.8 <= facts["in_single_precision"]/single["peak_memory_bytes"] <= 1.5:
        wrong.append(f"{facts['in_single_precision']} bytes are told, {single['peak_memory_bytes']} taken")
    if single["peak_memory_bytes"] >= double["peak_memory_bytes"] or 2*single["factor_memory_bytes"] != double["factor_memory_bytes"]:
        wrong.append("no less memory")
    values = [[complex(*mode["eigenvalue"]) for mode in result["modes"]] for result in (double, single)]
    if len(values[0]) != len(values[1]) or any(abs(a - b) > 1e-12*abs(a) for a, b in zip(*values)):
        wrong.append("other modes")
    if any(mode["backward_error"] > 1e-12 for mode in single["modes"]) or not single["certified"] or not double["certified"]:
        wrong.append("not as sure")
    if "the factors are in single precision" not in run(("solve", problem, *words, "--memory", str(limit)))[1]:
        wrong.append("not said")
    print(("FAILS " if wrong else "ok    ") + f"single precision of {problem.name} {' '.join(words)}:", *wrong,
          f"{single['peak_memory_bytes']/1e6:.0f} of {double['peak_memory_bytes']/1e6:.0f} MB")
    if wrong:
        failures.append(("single", problem, *words))


def solve(problem, *words):
    return "solve", problem, "--modes", "12", "--format", "json", *words


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        grid, small, turbine, crank = (folder/f"{scene}.h5" for scene in ("grid", "small", "turbine", "crank"))
        for words in (("grid", "--cells", "20x14", "--output", grid), ("grid", "--cells", "10x7", "--output", small), ("turbine", "--output", turbine),
                      ("crank", "--output", crank)):
            if run(("scene", *words))[0] != 0:
                sys.exit(f"no scene {words}")
        for words in ((), ("--inner", "mumps"), ("--formulation", "quadratic")):
            check_estimate(grid, folder, *words)
            check_estimate(crank, folder, *words)
        check_estimate(grid, folder, "--modes", "50")
        block = folder/"block.h5"
        if run(("scene", "block", "--cells", "16", "--output", block))[0] != 0:
            sys.exit("no scene block")
        check_estimate(block, folder)
        check_single(block)
        # Long lists, and bases of low rank.
        for cells, dashpots, modes in (("30x21", "0", "300"), ("30x21", "4", "100"), ("60x42", "4", "10")):
            large = folder/f"grid_{cells}_{dashpots}.h5"
            subprocess.run([KSCHUR, "scene", "grid", "--cells", cells, "--dashpots", dashpots, "--output", large], capture_output=True, check=True)
            check_estimate(large, folder, "--modes", modes)
        if not ALL:
            limits = (96, 200, 272, 288, 304, 320, 352, 500)
            walk(solve(grid), limits, folder)
            walk(solve(turbine, "--inner", "mumps", "--left"), limits, folder)
            walk(("scene", "grid", "--cells", "30x20"), (96, 112, 128, 160), folder, folder/"new.h5")
            walk(("info", grid), (96, 112, 128), folder)
        else:
            limits = range(64, 2049, 32)
            for words in ((), ("--inner", "mumps"), ("--left",), ("--band", "0,1"), ("--method", "arpack"),
                          ("--formulation", "damped-constrained"), ("--formulation", "quadratic"),
                          ("--formulation", "low-rank"), ("--formulation", "proportional", "--inner", "ldl"), ("--block", "4")):
                if "--band" in words:
                    words = ("solve", grid, "--format", "json", *words)
                else:
                    words = solve(grid, *words)
                walk(words, limits, folder)
            walk(solve(small, "--inner", "iterative"), limits, folder)
            for words in ((), ("--inner", "mumps"), ("--inner", "iterative"), ("--left",), ("--certify",),
                          ("--formulation", "damped-constrained-zero"), ("--formulation", "damped-constrained")):
                walk(solve(turbine, *words), limits, folder)
            walk(solve(crank), limits, folder)
            walk(("scene", "grid", "--cells", "40x30"), limits, folder, folder/"new.h5")
            walk(("scene", "grid", "--cells", "40x30"), limits, folder, folder/"new")
            walk(("info", grid), limits, folder)
            walk(("solve", grid, "--format", "json"), limits, folder, folder/"modes.h5")
            modes = folder/"kept.h5"
            if run(("solve", grid, "--quiet", "--output", modes))[0] != 0:
                sys.exit("no modes")
            walk(("info", modes, "--format", "csv"), limits, folder)
            walk(("mac", modes, modes, "--format", "csv"), limits, folder)
            walk(("compare", turbine, "--modes", "6"), limits, folder, timed=True)
            walk(("sensitivity", grid, grid, "--format", "csv", "--quiet"), limits, folder)
            walk(("response", grid, "--frequencies", "0.01:0.1:5", "--input", "100", "--format", "csv"), limits, folder)
            walk(("sweep", "turbine", "--vary", "speed=0:2:3", "--format", "csv", "--quiet"), limits, folder)
            walk(("view", modes, "--modes", "8"), limits, folder, folder/"shapes")
    sys.exit(bool(failures))


main()
