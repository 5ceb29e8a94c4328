"""What more processes bring: processes.py KSCHUR_MPI PROBLEM.h5 [--band F1,F2] [--modes N] [--processes 1,2,4] [--repeats R].

Solves a problem on each number of processes in turns, one thread each, matrices of any size distributed (a band: not), and
prints the least seconds of each phase and the most memory that a process held. To be run on a machine that does nothing else.
"""
import argparse
import json
import os
import pathlib
import subprocess
import tempfile
import time

PHASES = ("total", "analyze", "factorize", "solve", "orthogonalize", "other")


def peaks(program, parent):
    """The most memory so far of each process of this program that a parent has started, by its number (bytes)."""
    held = {}
    for status in pathlib.Path("/proc").glob("[0-9]*/status"):
        try:
            if os.readlink(status.parent / "exe") != program:
                continue
            fields = dict(line.split(":", 1) for line in status.read_text().splitlines())
            if int(fields["PPid"]) == parent:
                held[int(status.parent.name)] = 1024 * int(fields["VmHWM"].split()[0])
        except (OSError, KeyError):
            pass
    return held


def run(program, processes, words):
    environment = dict(os.environ, OPENBLAS_NUM_THREADS="1", OMP_WAIT_POLICY="PASSIVE", OMPI_ALLOW_RUN_AS_ROOT="1",
                       OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
    command = ["mpirun", "--oversubscribe", "-np", str(processes), program, "solve", *words, "--threads", "1", "--format", "json"]
    held = {}
    with tempfile.TemporaryFile("w+") as output:
        job = subprocess.Popen(command, stdout=output, env=environment)
        while job.poll() is None:
            held |= peaks(program, job.pid)
            time.sleep(0.1)
        output.seek(0)
        answer = json.loads(output.read()) if job.returncode == 0 else None
    return answer, max(held.values(), default=0), sum(held.values())


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program")
    parser.add_argument("problem")
    parser.add_argument("--band")
    parser.add_argument("--modes", default="10")
    parser.add_argument("--processes", default="1,2,4")
    parser.add_argument("--repeats", type=int, default=3)
    arguments = parser.parse_args()
    program = os.path.realpath(arguments.program)
    words = [arguments.problem]
    words += ["--band", arguments.band] if arguments.band else ["--modes", arguments.modes, "--distribute", "1", "--inner", "mumps"]
    numbers = [int(word) for word in arguments.processes.split(",")]
    best = {}
    for _ in range(arguments.repeats):
        for number in numbers:
            answer, most, together = run(program, number, words)
            if answer is None:
                raise SystemExit(f"{number} processes: the solve failed")
            seconds = answer["seconds"]
            before = best.get(number, ({phase: float("inf") for phase in PHASES}, 0, 0, 0))
            best[number] = ({phase: min(before[0][phase], seconds[phase]) for phase in PHASES}, most, together, len(answer["modes"]))
    print("processes  modes  " + "  ".join(f"{phase:>13}" for phase in PHASES) + "  most of one  all together")
    for number in numbers:
        seconds, most, together, modes = best[number]
        print(f"{number:9}  {modes:5}  " + "  ".join(f"{seconds[phase]:11.3f} s" for phase in PHASES)
              + f"  {most / 1e6:8.0f} MB  {together / 1e6:9.0f} MB")


if __name__ == "__main__":
    main()
