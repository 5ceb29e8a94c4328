#!/usr/bin/env python3
"""blocks.py PROGRAM PROBLEM [PROBLEM ...]: what blocks of vectors cost and bring on problem files.

One line a block: vectors that the operator was applied to, seconds in solves, orthogonalisation and in total (of the run
with the least total), memory. Runs of different blocks take turns. What follows `--` goes to the program."""
import argparse
import json
import os
import subprocess
import sys

COLUMNS = ["vectors", "restarts", "solve", "orthogonalize", "total"]


def solve(program, problem, block, more):
    run = subprocess.run([program, "solve", problem, "--block", block, "--format", "json", "--quiet", *more],
                         capture_output=True, text=True, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"})
    if run.returncode not in (0, 3):
        sys.exit(f"{problem}, block {block}: {run.stderr.strip()}")
    result = json.loads(run.stdout)
    return {"vectors": result["counts"]["operator_applications"], "restarts": result["counts"]["restarts"],
            **result["seconds"], "memory": result["peak_memory_bytes"], "missing": run.returncode != 0}


def main():
    words = sys.argv[1:]
    more = words[words.index("--") + 1:] if "--" in words else []
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", metavar="PROGRAM")
    parser.add_argument("problems", nargs="+", metavar="PROBLEM")
    parser.add_argument("--blocks", default="1,2,4,8,auto", help="blocks, with commas (%(default)s)")
    parser.add_argument("--repeat", type=int, default=3, help="runs of each (%(default)s)")
    arguments = parser.parse_args(words[:words.index("--")] if "--" in words else words)
    blocks = arguments.blocks.split(",")
    print("| problem | block | " + " | ".join(COLUMNS) + " | MB |")
    print("|---" * (len(COLUMNS) + 3) + "|")
    for problem in arguments.problems:
        runs = {block: [] for block in blocks}
        for _ in range(arguments.repeat):
            for block in blocks:
                runs[block].append(solve(arguments.program, problem, block, more))
        for block in blocks:
            best = min(runs[block], key=lambda run: run["total"])
            print(f"| {os.path.basename(problem)} | {block}{' (not all modes)' if best['missing'] else ''} | "
                  + " | ".join(f"{best[column]:.4g}" for column in COLUMNS) + f" | {best['memory']/1e6:.0f} |", flush=True)


if __name__ == "__main__":
    main()
