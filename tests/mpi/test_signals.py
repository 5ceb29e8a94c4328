#!/usr/bin/python3
"""Signals to the processes of kschur-mpi: test_signals.py KSCHUR_MPI MPIRUN [--signals N] [--load N] [--seed N].

On two and on three processes, to each of them so many SIGTERMs at random times of a solve, one a run, while so many other
programs want the cores; by hand --signals 200 --load 3. Each run has to end in one of these ways, with its exit status:

  interrupted   3: modes that have converged are printed and written, the reason says so, one line on standard error
  whole         0: it was as good as ready, or another process than the first was told
  ended         that of a signal: it had not read the problem, nothing is written

Prints how often each came; exit status 0: no run ended otherwise.
"""
import argparse
import collections
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import h5py

parser = argparse.ArgumentParser()
parser.add_argument("kschur")
parser.add_argument("mpirun")
parser.add_argument("--signals", type=int, default=4, help="to each process")
parser.add_argument("--load", type=int, default=0, help="other programs that want the cores")
parser.add_argument("--seed", type=int, default=0)
arguments = parser.parse_args()
KSCHUR = os.path.abspath(arguments.kschur)
# A run that goes on for so long after a signal hangs.
LONGEST = 120


def start(processes, problem, output):
    words = [KSCHUR, "solve", problem, "--modes", "20", "--formulation", "quadratic", "--distribute", "1", "--threads", "1", "--format", "json", "--output", output]
    return subprocess.Popen([arguments.mpirun, "--oversubscribe", "-np", str(processes), *map(str, words)], stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True, start_new_session=True,
                            env=dict(os.environ, OMPI_MCA_mpi_yield_when_idle="1"))


def find_process(run, rank):
    """The identifier of a process of a run, when the program itself is there."""
    while run.poll() is None:
        children = Path(f"/proc/{run.pid}/task/{run.pid}/children").read_text().split()
        for child in children:
            try:
                environment = Path(f"/proc/{child}/environ").read_bytes().split(b"\0")
                if f"OMPI_COMM_WORLD_RANK={rank}".encode() in environment and os.readlink(f"/proc/{child}/exe") == os.path.realpath(KSCHUR):
                    return int(child)
            except OSError:
                pass
        time.sleep(0.002)
    return None


def judge(run, out, errors, output):
    """How it ended: one of the ways above, or what is wrong."""
    if run.returncode in (0, 3):
        result = json.loads(out)
        with h5py.File(output) as file:
            written = len(file["eigenvalues"])
        if written != len(result["modes"]):
            return f"{written} modes written, {len(result['modes'])} printed"
        if run.returncode == 0:
            return "whole" if len(result["modes"]) == 20 else f"{len(result['modes'])} modes with exit status 0"
        lines = [line for line in errors.splitlines() if line.startswith("kschur: ")]
        return "interrupted" if result["reason"] == "interrupted" and len(lines) == 1 else f"exit status 3: {errors}"
    if list(output.parent.iterdir()):
        return f"left behind: {list(output.parent.iterdir())}"
    if run.returncode == 128 + signal.SIGTERM and not out:
        return "ended"
    return f"exit status {run.returncode}: {errors}"


def send(processes, rank, problem, folder, seconds, draw):
    output = folder / "modes.h5"
    output.unlink(missing_ok=True)
    run = start(processes, problem, output)
    target = find_process(run, rank)
    time.sleep(draw.uniform(0, seconds))
    try:
        os.kill(target, signal.SIGTERM)
    except (TypeError, ProcessLookupError):
        pass
    try:
        out, errors = run.communicate(timeout=LONGEST)
    except subprocess.TimeoutExpired:
        os.killpg(run.pid, signal.SIGKILL)
        run.communicate()
        return "it hangs"
    return judge(run, out, errors, output)


def main():
    draw = random.Random(arguments.seed)
    load = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(arguments.load)]
    failed = 0
    try:
        with tempfile.TemporaryDirectory() as name:
            problem, folder = Path(name) / "grid.h5", Path(name) / "output"
            folder.mkdir()
            subprocess.run([KSCHUR, "scene", "grid", "--cells", "6x4", "--output", str(problem)], check=True, stdout=subprocess.DEVNULL)
            for processes in (2, 3):
                began = time.monotonic()
                run = start(processes, problem, folder / "modes.h5")
                find_process(run, 0)
                before = time.monotonic()
                run.communicate()
                seconds = time.monotonic() - before
                for rank in range(processes):
                    ends = collections.Counter(send(processes, rank, problem, folder, seconds, draw) for _ in range(arguments.signals))
                    failed += sum(number for end, number in ends.items() if end not in ("interrupted", "whole", "ended"))
                    print(f"process {rank} of {processes}, {seconds:.1f} s: " + ", ".join(f"{number} {end}" for end, number in ends.items()),
                          flush=True)
    finally:
        for other in load:
            other.kill()
            other.wait()
    print(f"{failed} failed")
    return failed > 0


if __name__ == "__main__":
    sys.exit(main())
