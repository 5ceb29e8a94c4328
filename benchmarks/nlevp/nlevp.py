"""kschur on the quadratic problems of the NLEVP collection that have real matrices: a table, and docs/nlevp.md.

    python3 benchmarks/nlevp/nlevp.py                         # the problems given by formulas
    python3 benchmarks/nlevp/nlevp.py --data FOLDER           # those with data as well; FOLDER holds the collection's .mat files
    python3 benchmarks/nlevp/nlevp.py spring wing             # some
    python3 benchmarks/nlevp/nlevp.py --data FOLDER --page docs/nlevp.md

Needs NumPy, SciPy and mpmath. Exit status 1 if a run is wrong without saying so.
"""

import argparse
import datetime
import json
import os
import pathlib
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field

import numpy as np
import scipy.io

from data import WITH_DATA
from judge import Verdict, judge
from problems import FORMULAS
from reference import (
    BACKWARD, DENSE, DIGITS, EXACT, Quadratic, SingularProblem, dense_spectrum, exact_spectrum, nearest,
)  # fmt: skip

ROOT = pathlib.Path(__file__).resolve().parents[2]
SINGULAR = "qep5"
INACCURATE = 1e-8  # kschur's limit
TARGETS = {  # where they are not taken from the spectrum, and with them
    "circular_piston": (0, -1000, -2000 + 20000j),
    "concrete": (0, 100j, -50 + 300j),
    "foundation": (0, 200j, -20 + 1000j),
    "schrodinger": (0, 0.5, 1 + 0.1j),
    "shaft": (0, -1.365e6, 3000j),
    "speaker_box": (0, -2784 + 9280j, -3000),
    "qep3": (1,),
    "omnicam1": (0.5, -0.3),
}
# Why a mode may be missing that rounding of the matrices takes anywhere: by problem.
EXCUSES = {
    "intersection": "generically infinite, rounding of the coefficients makes them finite",
    "qep3": "0 and 1e-8 are a double zero within rounding, which is one mode",
}


@dataclass
class Row:
    name: str
    n: int
    target: complex
    asked: int
    exit: int
    reason: str = ""
    certified: object = None
    verdict: Verdict = field(default_factory=Verdict)
    backward: float = 0.0
    expected: int = 0
    fewer_are_right: bool = False  # where a double real eigenvalue may be a pair, or an eigenvalue is undetermined
    message: str = ""

    @property
    def right(self):
        return self.verdict.right and self.status_fits

    @property
    def status_fits(self):
        return self.exit == self.expected or (self.exit == 3 and self.fewer_are_right)

    @property
    def honest(self):
        """Not all that was asked, but what is listed is right, and the exit status says so."""
        return self.exit in (3, 4) and not self.verdict.spurious and self.verdict.accurate

    @property
    def remark(self):
        words = []
        if self.verdict.missing:
            words.append("missing " + some(self.verdict.missing))
        if self.verdict.spurious:
            words.append("no eigenvalue: " + some(self.verdict.spurious))
        if not self.verdict.accurate:
            words.append("inaccurate")
        if not self.status_fits:
            words.append(f"exit status {self.expected} expected" + (f" ({self.message})" if self.message else ""))
        if self.certified and (self.verdict.missing or self.verdict.spurious):
            words.append("certified all the same")
        if self.verdict.tolerance > 1e-3:
            words.append(f"condition number {self.verdict.condition:.0e}")
        if self.verdict.zeros:
            words.append(f"0 listed as {some(self.verdict.zeros)}")
        if self.verdict.undetermined:
            excuse = EXCUSES.get(self.name, "rounding may take it anywhere")
            words.append(f"without {some(self.verdict.undetermined)}: {excuse}")
        return "; ".join(words)


def some(values):
    return ", ".join(text(v) for v in values[:2]) + (f" and {len(values) - 2} more" if len(values) > 2 else "")


def text(value):
    value = complex(value)
    return f"{value.real:.5g}" + (f"{value.imag:+.5g}i" if value.imag else "")


def rounded(value):
    def digits(x):
        return float(f"{x:.2g}")

    return complex(digits(value.real), digits(value.imag))


def targets(name, problem, spectrum):
    """Zero, a real one and a complex one in the middle of the spectrum, and those that have been named."""
    if name in TARGETS and problem.n > EXACT:
        return TARGETS[name]
    finite = np.array(spectrum if spectrum is not None else dense_spectrum(problem, 0))
    finite = finite[(finite != 0) & (abs(finite) < 1e6 * np.sqrt(problem.norms[2] / problem.norms[0]))]
    finite = finite[np.argsort(abs(finite))]
    middle = finite[len(finite) // 2]
    complex_ones = finite[finite.imag > 1e-6 * abs(finite)]
    oscillating = complex_ones[len(complex_ones) // 2] * 1.03 if len(complex_ones) else abs(middle) * (0.5 + 0.5j)
    sign = -1 if np.median(finite.real) <= 0 else 1
    return (0, rounded(sign * abs(middle)), rounded(oscillating), *TARGETS.get(name, ()))


def plan(name, problem, spectrum):
    """(target, modes asked) of each run."""
    where = targets(name, problem, spectrum)
    if spectrum is None:
        return [(complex(t), 10) for t in where]
    count = sum(v.imag >= 0 for v in spectrum)
    runs = [(0j, count), (0j, count + 1)] + [(complex(t), (count + 1) // 2) for t in where]
    return list(dict.fromkeys(runs))


def write_problem(folder, problem):
    for letter, matrix in zip("MRK", problem.matrices):
        if letter != "R" or matrix.nnz:
            scipy.io.mmwrite(folder / f"{letter}.mtx", matrix.tocoo(), precision=17, symmetry="general")


def run(program, folder, target, asked):
    """Exit status, the object that it printed (or an empty one), and its last line of complaint."""
    where = repr(target.real) + (f",{target.imag!r}" if target.imag else "")
    command = [program, "solve", folder, "--modes", asked, f"--target={where}", "--symmetric", "no"]
    command += ["--format", "json", "--quiet", "--threads", 1]
    one_thread = dict(os.environ, OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1")
    try:
        done = subprocess.run([str(c) for c in command], capture_output=True, text=True, env=one_thread, timeout=600)
    except subprocess.TimeoutExpired:
        return -1, {}, "no end after 600 s"
    try:
        printed = json.loads(done.stdout)
    except ValueError:
        printed = {}
    complaint = done.stderr.strip().splitlines()
    return done.returncode, printed, complaint[-1].replace(str(folder), "FOLDER") if complaint else ""


def solve(program, name, problem):
    """A row for each run on a problem."""
    rows = []
    try:
        spectrum = exact_spectrum(problem) if problem.n <= EXACT else None
    except SingularProblem:
        spectrum = None
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        write_problem(folder, problem)
        if name == SINGULAR:
            status, printed, message = run(program, folder, 0j, 1)
            spurious = [complex(*m["eigenvalue"]) for m in printed.get("modes", [])]
            refused = Row(name, problem.n, 0j, 1, status, "refused", expected=4, message=message)
            refused.verdict.spurious = spurious
            return [refused]
        for target, asked in plan(name, problem, spectrum):
            status, printed, message = run(program, folder, target, asked)
            modes = printed.get("modes", [])
            if printed.get("reason") == "inaccurate":  # it counts those above its limit as not found
                modes = [m for m in modes if m["backward_error"] <= INACCURATE]
            reported = [complex(*m["eigenvalue"]) for m in modes]
            reference = nearest(problem, target, asked, spectrum)
            verdict = judge(reported, reference, target, asked)
            there = sum(v.imag >= 0 for v in spectrum) if spectrum is not None else asked
            backward = max([m["backward_error"] for m in modes] + [problem.backward_error(v) for v in reported], default=0.0)
            fewer = spectrum is not None and verdict.found + len(verdict.undetermined) == there
            rows.append(
                Row(name, problem.n, target, asked, status, printed.get("reason", "none"), printed.get("certified"),
                    verdict, backward, 0 if asked <= there else 3, fewer, message)
            )  # fmt: skip
    return rows


HEADER = (
    "| problem | n | target | modes | exit | reason | certified | found / missing / spurious | worst error | tolerance"
    " | backward error | why not |\n|" + "---|" * 12
)


def line(row):
    v = row.verdict
    mark = "" if row.right else "**told:** " if row.honest else "**wrong:** "
    certified = {None: "-", True: "yes", False: "no"}[row.certified]
    cells = [
        row.name.replace("_", "\\_"), row.n, text(row.target), row.asked, row.exit, row.reason.replace("_", " "), certified,
        f"{v.found} / {len(v.missing)} / {len(v.spurious)}",
        *(f"{x:.1e}" if v.found else "-" for x in (v.error, v.tolerance, row.backward)), mark + row.remark,
    ]  # fmt: skip
    return "| " + " | ".join(str(c).strip() for c in cells) + " |"


def summary(rows):
    right, honest = sum(r.right for r in rows), sum(not r.right and r.honest for r in rows)
    return f"{len(rows)} runs: {right} right, {honest} that say what they miss, {len(rows) - right - honest} wrong."


PROBLEMS_HEADER = "| problem | n | runs | right | error / tolerance | backward error |\n|" + "---|" * 6


def problem_line(runs):
    """All runs on a problem; of the error the worst part of its tolerance."""
    judged = [run for run in runs if run.verdict.found]
    parts = [run.verdict.error / run.verdict.tolerance for run in judged]
    cells = [runs[0].name.replace("_", "\\_"), runs[0].n, len(runs), sum(run.right for run in runs)]
    cells += [f"{max(parts):.1e}", f"{max(run.backward for run in judged):.1e}"] if judged else ["refused", ""]
    return "| " + " | ".join(str(c) for c in cells) + " |"


def page(rows, version, left_out):
    without = f" Without the problems whose data were not at hand: {', '.join(left_out)}." if left_out else ""
    by_problem = {name: [r for r in rows if r.name == name] for name in dict.fromkeys(r.name for r in rows)}
    return f"""# The quadratic problems of NLEVP

The square quadratic problems with real matrices of the collection NLEVP (Betcke, Higham, Mehrmann, Schröder and Tisseur,
[2013](https://doi.org/10.1145/2427023.2427024), and later additions), rebuilt from their definitions or read from the
collection's data, which this project does not contain; disk_brake4669 is not among them. Acoustic waves are taken in
2 pi i lambda, where they are real; power_plant, foundation and concrete without hysteretic damping, pdde_stability at phase 0;
random problems have NumPy's random numbers.

kschur {version}, {datetime.date.today().isoformat()}: {summary(rows)}{without} Made by

    python3 benchmarks/nlevp/nlevp.py --data FOLDER --page docs/nlevp.md

which prints every run. Targets are zero, a real and a complex number; for n <= {EXACT} all modes are asked for as well, and one more, where
exit status 3 is right. Reference: for n <= {EXACT} the whole spectrum in {DIGITS} digits, for n <= {DENSE} dense, above by ARPACK about two
shifts, the latter two corrected with residuals in extended precision. The tolerance of an eigenvalue is {BACKWARD:g} times its
condition number (Tisseur 2000, in the norms of M, R and K), at most the c-th root where c eigenvalues nearly meet, and 1e-12
at least. "Backward error": the larger of what kschur prints and the smallest change of M, R and K, relative to their norms, of which
the eigenvalue is one. "Told": not all that was asked for, but what is listed is right, and the exit status says so.

## Runs with a remark

{HEADER}
{lines(r for r in rows if r.remark)}

## All problems

{PROBLEMS_HEADER}
{chr(10).join(problem_line(runs) for runs in by_problem.values())}
"""


def lines(rows):
    return "\n".join(line(r) for r in rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("problems", nargs="*", help="all, if none is named")
    parser.add_argument("--data", type=pathlib.Path, help="folder of the collection's .mat files")
    parser.add_argument("--kschur", type=pathlib.Path, default=ROOT / "build" / "release" / "bin" / "kschur")
    parser.add_argument("--page", type=pathlib.Path, help="write the table and how it was made to this file")
    options = parser.parse_args()
    unknown = set(options.problems) - set(FORMULAS) - set(WITH_DATA)
    if unknown:
        parser.error(f"no such problem: {', '.join(sorted(unknown))}")
    wanted = options.problems or sorted([*FORMULAS, *WITH_DATA])

    def data(name):
        return scipy.io.loadmat(options.data / f"{name}.mat")

    rows, left_out = [], []
    print(HEADER)
    for name in wanted:
        try:
            if name in WITH_DATA and options.data is None:
                raise FileNotFoundError
            matrices = WITH_DATA[name](data) if name in WITH_DATA else FORMULAS[name]()
        except FileNotFoundError:
            left_out.append(name)
            continue
        for row in solve(options.kschur, name, Quadratic(*matrices)):
            print(line(row), flush=True)
            rows.append(row)
    print(f"\n{summary(rows)}" + (f" Left out for want of data: {', '.join(left_out)}." if left_out else ""))
    if options.page:
        version = subprocess.run([options.kschur, "--version"], capture_output=True, text=True).stdout.split()[1]
        options.page.write_text(page(rows, version, left_out))
    return 0 if all(r.right or r.honest for r in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
