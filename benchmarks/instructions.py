"""Instructions that solves of small scenes take, beside those kept in docs/performance.md: no clock, no noise.

    python3 benchmarks/instructions.py build/release/bin/kschur             # the cases of the page
    python3 benchmarks/instructions.py build/release/bin/kschur turbine     # some

Needs valgrind. Counts what happens in solve_modes, on one thread: not the loader, nor reading and printing.
"""

import argparse
import os
import pathlib
import re
import subprocess
import sys
import tempfile

PAGE = pathlib.Path(__file__).resolve().parent.parent / "docs" / "performance.md"
ROW = re.compile(r"^\| (?P<scene>[\w -]+) \| `(?P<options>[^`]*)` \|(?P<counts>[\d, |]+)\|$", re.MULTILINE)
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


def kept():
    """(scene with its options, options of solve, counts) of each row of the page."""
    for row in ROW.finditer(PAGE.read_text()):
        counts = [int(cell.replace(",", "")) for cell in row["counts"].split("|")]
        yield row["scene"], row["options"].split(), counts


def run(command):
    done = subprocess.run(command, env=dict(os.environ, **ONE_THREAD), capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(command)} failed: {done.stderr.strip()}")
    return done


def count(program, scene, options, folder):
    """Instructions of one solve."""
    # Matrix Market: an HDF5 file is tried in a process with bounded time, which valgrind would use up.
    problem = f"{folder}/{scene.replace(' ', '')}"
    run([program, "scene", *scene.split(), "--output", problem])
    valgrind = ["valgrind", "--tool=callgrind", "--toggle-collect=__kschur_solver_MOD_solve_shared"]
    done = run([*valgrind, "--callgrind-out-file=/dev/null", program, "solve", problem, *options, "--quiet"])
    return int(re.search(r"Collected : (\d+)", done.stderr)[1])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="the program kschur, of a release build")
    parser.add_argument("scenes", nargs="*", help="which ones (all)")
    arguments = parser.parse_args()
    print(f"{'':40s} {'kept':>15s} {'now':>15s}  ratio")
    with tempfile.TemporaryDirectory() as folder:
        for scene, options, counts in kept():
            if arguments.scenes and scene.split()[0] not in arguments.scenes:
                continue
            now = count(arguments.program, scene, options, folder)
            print(f"{' '.join([scene, *options]):40.40s} {counts[-1]:15,} {now:15,}  {now / counts[-1]:.3f}", flush=True)


if __name__ == "__main__":
    main()
