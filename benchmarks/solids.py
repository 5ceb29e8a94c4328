#!/usr/bin/env python3
"""solids.py PROGRAM: kschur and SLEPc on solids, in turns, each run a process of its own.

By default cubes of bricks, clamped at a face (docs/scenes.md); --scene names any other scene. SLEPc is run as who knows it
runs it: real arithmetic, the shift that kschur chose, MUMPS with its own ordering; where the damping is none or proportional
the symmetric problem K phi = omega^2 M phi (EPS, Krylov-Schur, Cholesky), else the quadratic one with its scaling (PEP, TOAR),
Cholesky where the matrices are symmetric, LU where they are not. One line a problem and program: medians of seconds, from the
matrices in memory to the modes in memory, with how far they lie apart; in them the analysis and factorisations; the most memory
a run held beyond what it held before it read the problem; eigenvalues found, of those that kschur has at 1e-12, both of a pair;
the worst backward error, by one piece of code (kschur_report/accuracy.py). What follows `--` goes to kschur."""
import argparse
import itertools
import pathlib
import statistics
import subprocess
import sys
import tempfile


def parse():
    """Its own words, and those for kschur."""
    words = sys.argv[1:]
    more = words[words.index("--") + 1:] if "--" in words else []
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", metavar="PROGRAM")
    parser.add_argument("--cells", default="20,28", help="along an edge, with commas, as all of these (%(default)s)")
    parser.add_argument("--element", default="hex8", help="hex8, tet10 (%(default)s)")
    parser.add_argument("--supports", default="clamped", help="clamped, free, hinged (%(default)s)")
    parser.add_argument("--damping", default="rayleigh,dashpot,general", help="none too (%(default)s)")
    parser.add_argument("--speed", default="0", help="rpm (%(default)s)")
    parser.add_argument("--scene", action="append", metavar="LINE", help='another scene in the place of these, "crank --density 8"; '
                        "may be repeated")
    parser.add_argument("--modes", default="20", help="with commas (%(default)s)")
    parser.add_argument("--threads", type=int, default=1, help="of both programs (%(default)s)")
    parser.add_argument("--repeat", type=int, default=3, help="runs of each (%(default)s)")
    parser.add_argument("--tolerance", type=float, default=1e-10, help="of both programs (%(default)s)")
    parser.add_argument("--ours", action="store_true", help="without SLEPc")
    return parser.parse_args(words[:words.index("--")] if "--" in words else words), more


# Before the imports: help takes Python alone.
ARGUMENTS = parse() if __name__ == "__main__" else None

from kschur_report import accuracy  # noqa: E402
from kschur_report.campaign import Failure, Runner, execute  # noqa: E402
from kschur_report.methods import METHODS, REFERENCE_TOLERANCE, Question, command, missing, shift_for_peers  # noqa: E402
from kschur_report.problem import read_problem  # noqa: E402
from kschur_report.result import one_of_each_pair  # noqa: E402
from kschur_report.runs import Campaign  # noqa: E402

# What applies is taken: the first two want damping that is none or proportional, the first constraints that only tie unknowns.
PEERS = ("slepc-symmetric", "slepc-saddle", "slepc-toar-cholesky", "slepc-toar-scaled")
PATIENCE = 3600  # seconds
HEADER = ("problem", "n", "m", "modes", "program", "time (s)", "spread", "set-up (s)", "factorisations", "applications", "memory (MB)",
          "backward error", "eigenvalues", "certified", "SLEPc / kschur")


def scenes_of(arguments):
    """The lines of the scenes that are asked for."""
    if arguments.scene:
        return arguments.scene
    lists = (arguments.cells, arguments.element, arguments.supports, arguments.damping, arguments.speed)
    return ["block --cells {} --element {} --supports {} --damping {} --speed {}".format(*words)
            for words in itertools.product(*(words.split(",") for words in lists))]


class Case:
    """One scene, one number of modes: a question, and what each program answered."""

    def __init__(self, arguments, more, path, modes, baseline):
        self.arguments, self.more, self.path, self.modes, self.baseline = arguments, more, path, modes, baseline
        self.output = path.with_name("result.h5")
        self.problem = read_problem(path)
        first = self.run("auto", Question(modes), REFERENCE_TOLERANCE)
        self.expected = first.eigenvalues
        self.damped = self.problem.is_damped
        self.question = Question(modes, int(accuracy.eigenvalue_counts(self.expected, self.damped).sum()), shift_for_peers(first))

    def run(self, method, question, tolerance):
        threads = str(self.arguments.threads)
        ours = not METHODS[method].is_peer
        words, environment = command(METHODS[method], self.arguments.program, self.path, question, tolerance, self.output,
                                     ("--threads", threads, *self.more) if ours else ())
        environment.update(OMP_NUM_THREADS=threads, OPENBLAS_NUM_THREADS="1" if ours else threads)
        result = execute(words, environment, self.output, PATIENCE)
        result.facts.setdefault("baseline_memory_bytes", self.baseline)
        return result

    def measure(self):
        """The runs of each method that applies, in turns."""
        runs = {"auto": []}
        if not self.arguments.ours:
            for method in PEERS:
                try:
                    # That it applies is known before it is timed, as is what it finds.
                    self.run(method, self.question, self.arguments.tolerance)
                    runs[method] = []
                    break
                except Failure as failure:
                    if "does not apply" not in str(failure):
                        print(f"{METHODS[method].label}: {failure}", file=sys.stderr, flush=True)
        for _ in range(self.arguments.repeat):
            for method, of_method in runs.items():
                of_method.append(self.run(method, self.question, self.arguments.tolerance))
        return runs

    def row(self, method, runs, ours):
        """What a line of the table says."""
        facts = runs[0].facts
        result = one_of_each_pair(runs[0], self.question.eigenvalues) if METHODS[method].is_peer else runs[0]
        seconds = [run.facts["seconds_total"] for run in runs]
        set_up = statistics.median(run.facts["seconds_analyze"] + run.facts["seconds_factorize"] for run in runs)
        memory = statistics.median(run.facts["peak_memory_bytes"] - run.facts["baseline_memory_bytes"] for run in runs)
        time = statistics.median(seconds)
        found = accuracy.count_found(result.eigenvalues, self.expected, self.damped)
        label = f"kschur ({facts['formulation']})" if method == "auto" else METHODS[method].label
        return [
            str(self.problem.unknowns), str(self.problem.constraints.shape[0]), str(self.modes), label, f"{time:.3g}",
            f"{(max(seconds) - min(seconds)) / time:.0%}", f"{set_up:.3g}", str(facts.get("factorizations", 1)),
            str(facts["operator_applications"]), f"{memory / 1e6:.0f}",
            f"{accuracy.residuals(self.problem, result).backward_error.max():.1e}", f"{found}/{self.question.eigenvalues}",
            facts.get("certified", ""),
            f"{time / statistics.median(run.facts['seconds_total'] for run in ours):.2f}" if METHODS[method].is_peer else "",
        ]


def main(arguments, more):
    lacking = missing(METHODS[PEERS[0]])
    if lacking and not arguments.ours:
        sys.exit(f"{lacking}, or ask for --ours")
    baseline = Runner(arguments.program, Campaign("", "", {})).memory_baseline
    print("| " + " | ".join(HEADER) + " |\n" + "|---" * len(HEADER) + "|", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "problem.h5"
        for scene in scenes_of(arguments):
            subprocess.run([arguments.program, "scene", *scene.split(), "--output", path], check=True, stdout=subprocess.DEVNULL)
            for modes in map(int, arguments.modes.split(",")):
                try:
                    case = Case(arguments, more, path, modes, baseline)
                    runs = case.measure()
                except Failure as failure:
                    print(f"{scene}: {failure}", file=sys.stderr, flush=True)
                    continue
                for method, of_method in runs.items():
                    print(f"| {scene} | " + " | ".join(case.row(method, of_method, runs["auto"])) + " |", flush=True)
            path.unlink()


if __name__ == "__main__":
    main(*ARGUMENTS)
