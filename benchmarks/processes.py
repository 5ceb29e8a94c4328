"""What more processes bring: processes.py KSCHUR_MPI [PROBLEM.h5 [--band F1,F2] [--modes N] [--inner NAME]] [--processes 1,2,4] [--repeats R].

Solves a problem on each number of processes in turns, one thread each, matrices of any size distributed (a band: in groups),
and prints the least seconds of each phase, the most memory that factors take in a process, and the most that a process held.
Without a problem: the fine crank and a band of 2,092 modes of a grid, with the ratios that they are to reach. To be run on
a machine that does nothing else.
"""
import argparse
import json
import os
import pathlib
import subprocess
import tempfile
import time

PHASES = ("total", "analyze", "factorize", "solve", "orthogonalize", "examine", "place", "iterate", "recover", "judge", "other")
DISTRIBUTED = ["--distribute", "1"]


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
    """Seconds, modes and memory of one solve."""
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
        if job.returncode != 0:
            raise SystemExit(f"{processes} processes: the solve failed")
        answer = json.loads(output.read())
    return dict(seconds=answer["seconds"], modes=len(answer["modes"]), factors=answer["factor_memory_bytes"] or 0,
                most=max(held.values(), default=0), together=sum(held.values()))


def measure(program, words, numbers, repeats):
    """The best of several runs on each number of processes, which take turns."""
    best = {}
    for _ in range(repeats):
        for number in numbers:
            new = run(program, number, words)
            if number in best:
                new["seconds"] = {phase: min(new["seconds"][phase], best[number]["seconds"][phase]) for phase in PHASES}
            best[number] = new
    return best


def show(title, best):
    print(f"{title}\nprocesses  modes  " + "  ".join(f"{phase:>13}" for phase in PHASES)
          + "  factors of one  most of one  all together")
    for number, run_of in best.items():
        print(f"{number:9}  {run_of['modes']:5}  " + "  ".join(f"{run_of['seconds'][phase]:11.3f} s" for phase in PHASES)
              + f"  {run_of['factors'] / 1e6:11.0f} MB  {run_of['most'] / 1e6:8.0f} MB  {run_of['together'] / 1e6:9.0f} MB")


def show_targets(program, folder, repeats):
    """Each ratio beside what it is to be."""
    crank, grid = folder / "crank.h5", folder / "grid.h5"
    for words in (["crank", "--density", "8", "--output", crank], ["grid", "--cells", "20x14", "--output", grid]):
        subprocess.run([program, "scene", *map(str, words)], check=True, stdout=subprocess.DEVNULL)
    factored = measure(program, [str(crank), "--modes", "10", *DISTRIBUTED], [1, 2, 4], repeats)
    show("fine crank, 10 modes", factored)
    band = measure(program, [str(grid), "--band", "0,45"], [1, 2], repeats)
    show("grid of 20 x 14 cells, 0 to 45 Hz", band)

    def faster(best, phase):
        return best[1]["seconds"][phase] / best[2]["seconds"][phase]

    print(f"factorisations on two processes: {faster(factored, 'factorize'):.2f} times faster, to be 1.5 at least\n"
          f"factors of one of two processes: {factored[2]['factors'] / factored[1]['factors']:.0%}, to be 75% at most\n"
          f"factors of one of four processes: {factored[4]['factors'] / factored[1]['factors']:.0%}, to be 45% at most\n"
          f"a band on two processes: {faster(band, 'total'):.2f} times faster, to be 1.7 at least")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program")
    parser.add_argument("problem", nargs="?")
    parser.add_argument("--band")
    parser.add_argument("--modes", default="10")
    parser.add_argument("--inner", default="auto")
    parser.add_argument("--processes", default="1,2,4")
    parser.add_argument("--repeats", type=int, default=3)
    arguments = parser.parse_args()
    program = os.path.realpath(arguments.program)
    if arguments.problem is None:
        with tempfile.TemporaryDirectory() as folder:
            show_targets(program, pathlib.Path(folder), arguments.repeats)
        return
    words = ["--band", arguments.band] if arguments.band else ["--modes", arguments.modes, "--inner", arguments.inner, *DISTRIBUTED]
    numbers = [int(word) for word in arguments.processes.split(",")]
    show(arguments.problem, measure(program, [arguments.problem, *words], numbers, arguments.repeats))


if __name__ == "__main__":
    main()
