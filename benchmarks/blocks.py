#!/usr/bin/env python3
"""blocks.py PROGRAM [PROBLEM ...]: what blocks of vectors cost and bring, on problem files or on the models of docs/performance.md.

One line a block: vectors that the operator was applied to, seconds in solves, orthogonalisation and in total (of the run
with the least total), memory. Runs of different blocks take turns. What follows `--` goes to the program."""
import argparse
import json
import os
import subprocess
import sys
import tempfile

# The scene, and what follows `--` of each: a grid without proportional damping everywhere is the quadratic form.
MODELS = {
    "grid 60x42": ("grid --cells 60x42", "--modes 56"),
    "grid 60x42, 16 dashpots": ("grid --cells 60x42 --dashpots 16", "--modes 56"),
    "grid 60x42, quadratic": ("grid --cells 60x42", "--modes 56 --formulation quadratic"),
    "fine crank": ("crank --density 8", "--modes 20"),
    "solid of 1e5": ("crank --density 9", "--modes 20"),
    "grid 220x150": ("grid --cells 220x150", "--modes 56"),
    "grid 220x150, 16 dashpots": ("grid --cells 220x150 --dashpots 16", "--modes 56"),
    "grid 220x150, quadratic": ("grid --cells 220x150", "--modes 56 --formulation quadratic"),
}
COLUMNS = ["vectors", "restarts", "solve", "orthogonalize", "total"]


def solve(program, problem, block, more):
    run = subprocess.run([program, "solve", problem, "--block", block, "--format", "json", "--quiet", *more],
                         capture_output=True, text=True, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"})
    if run.returncode not in (0, 3):
        sys.exit(f"{problem}, block {block}: {run.stderr.strip()}")
    result = json.loads(run.stdout)
    return {"vectors": result["counts"]["operator_applications"], "restarts": result["counts"]["restarts"],
            **result["seconds"], "memory": result["peak_memory_bytes"], "missing": run.returncode != 0}


def measure(name, path, arguments, more):
    """The rows of one problem."""
    blocks = arguments.blocks.split(",")
    runs = {block: [] for block in blocks}
    for _ in range(arguments.repeat):
        for block in blocks:
            runs[block].append(solve(arguments.program, path, block, more))
    for block in blocks:
        best = min(runs[block], key=lambda run: run["total"])
        print(f"| {name} | {block}{' (not all modes)' if best['missing'] else ''} | "
              + " | ".join(f"{best[column]:.4g}" for column in COLUMNS) + f" | {best['memory']/1e6:.0f} |", flush=True)


def main():
    words = sys.argv[1:]
    more = words[words.index("--") + 1:] if "--" in words else []
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", metavar="PROGRAM")
    parser.add_argument("problems", nargs="*", metavar="PROBLEM")
    parser.add_argument("--models", default=";".join(MODELS), help="where no problem is named, with semicolons (%(default)s)")
    parser.add_argument("--blocks", default="1,2,4,8,auto", help="blocks, with commas (%(default)s)")
    parser.add_argument("--repeat", type=int, default=3, help="runs of each (%(default)s)")
    arguments = parser.parse_args(words[:words.index("--")] if "--" in words else words)
    print("| problem | block | " + " | ".join(COLUMNS) + " | MB |")
    print("|---" * (len(COLUMNS) + 3) + "|")
    for path in arguments.problems:
        measure(os.path.basename(path), path, arguments, more)
    if arguments.problems:
        return
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "model.h5")
        for name in arguments.models.split(";"):
            scene, options = MODELS[name]
            subprocess.run([arguments.program, "scene", *scene.split(), "--output", path], check=True, stdout=subprocess.DEVNULL)
            measure(name, path, arguments, options.split() + more)
            os.remove(path)


if __name__ == "__main__":
    main()
