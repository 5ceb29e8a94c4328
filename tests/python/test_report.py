"""The program kschur-report: test_report.py PATH_OF_KSCHUR_REPORT PATH_OF_KSCHUR.

Prints each check, then `N passed, N failed`; fails where a check does.
"""

import csv
import html.parser
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree

import h5py
import numpy as np
import scipy.sparse as sp

REPORT, KSCHUR = sys.argv[1], sys.argv[2]
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "benchmarks"))

from kschur_report.accuracy import BLOCKS, count_found, damping_measure, eigenvalue_counts, forward_errors, residuals  # noqa: E402
from kschur_report.advice import is_as_fast  # noqa: E402
from kschur_report.fit import fit_line, growth_exponent  # noqa: E402
from kschur_report.hard_cases import read_line  # noqa: E402
from kschur_report.methods import METHODS, PEER_NAMES, Question, command, missing, shift_for_peers  # noqa: E402
from kschur_report.problem import Problem, read_problem  # noqa: E402
from kschur_report.reference import refine_modes, simple  # noqa: E402
from kschur_report.result import Result, one_of_each_pair, read_result  # noqa: E402
from kschur_report.runs import Run, read_campaign  # noqa: E402
from checks import check, finish

# The first set of Anscombe's quartet (1973); slope, intercept and R^2 are in every textbook.
ANSCOMBE_X = [10, 8, 13, 9, 11, 14, 6, 4, 12, 7, 5]
ANSCOMBE_Y = [8.04, 6.95, 7.58, 8.81, 8.33, 9.96, 7.24, 4.26, 10.84, 4.82, 5.68]
FIGURES = {
    "work_precision_backward",
    "work_precision_damping",
    "time_against_unknowns",
    "memory_against_unknowns",
    "time_of_solids",
    "time_against_dampers",
    "time_against_block",
    "time_against_threads",
    "where_the_time_goes",
    "error_by_mode",
    "residual_by_mode",
    "residual_by_row",
    "constraint_scaling",
    "stability_map",
}


def report(*words):
    return subprocess.run([REPORT, "--kschur", KSCHUR, *map(str, words)], capture_output=True, text=True)


def chain(n, alpha, beta):
    """A chain of unit masses and springs between walls, and its eigenvalues by formula in extended precision."""
    stiffness = sp.diags([-np.ones(n - 1), 2 * np.ones(n), -np.ones(n - 1)], [-1, 0, 1], format="csr")
    mass = sp.identity(n, format="csr")
    problem = Problem(mass, (alpha * mass + beta * stiffness).tocsr(), stiffness, sp.csr_matrix((0, n)))
    pi = np.longdouble("3.14159265358979323846264338327950288")
    squares = 4 * np.sin(np.arange(1, n + 1) * pi / (2 * (n + 1))) ** 2
    half = (np.longdouble(alpha) + np.longdouble(beta) * squares) / 2
    shapes = np.sin(np.outer(np.arange(1, n + 1), np.arange(1, n + 1)) * np.pi / (n + 1))
    return problem, -half + 1j * np.sqrt(squares - half**2), shapes


def test_fit():
    line = fit_line(ANSCOMBE_X, ANSCOMBE_Y)
    check(
        "fit: slope, intercept and R^2 of Anscombe's first set",
        abs(line.slope - 0.50009) < 1e-5 and abs(line.intercept - 3.00009) < 1e-5 and abs(line.r_squared - 0.66654) < 1e-5,
        line,
    )
    check("fit: a straight line has R^2 = 1", abs(fit_line([1, 2, 5], [3, 5, 11]).r_squared - 1) < 1e-14)
    check("fit: two points are no fit", fit_line([1, 2], [1, 2]) is None)
    check(
        "fit: the exponent of y = 7 x^1.5",
        abs(growth_exponent([1, 4, 9, 100], 7 * np.array([1, 8, 27, 1000])) - 1.5) < 1e-12,
    )


def test_backward_error():
    matrix = sp.csr_matrix
    problem = Problem(matrix(np.diag([1.0, 2.0])), matrix((2, 2)), matrix(np.diag([4.0, 3.0])), matrix([[0.0, 5.0]]))
    result = Result(
        np.array([2.1j, 2j, 2j]), np.array([[2, 0], [3, 4], [1, 0]], dtype=complex), np.array([[0], [0], [1]], dtype=complex)
    )
    found = residuals(problem, result)
    # First: residual |-4.41 + 4| 2 of (4.41 2 + 4) 2. Second: |-8 + 3| 4 of (8 + 4) 5, violation 5 4 of 5 5.
    # Third: only the reaction Cq^T xi = 5 is left.
    check(
        "backward error by hand: motion",
        np.allclose(found.motion, [0.41 / 12.82, 20 / 60, 5 / 12], rtol=1e-13, atol=0),
        found.motion,
    )
    check(
        "backward error by hand: constraint",
        np.allclose(found.constraint, [0, 20 / 25, 0], rtol=1e-13, atol=0),
        found.constraint,
    )
    check("backward error is the larger", np.array_equal(found.backward_error, np.maximum(found.motion, found.constraint)))
    check(
        "residual by row: the second row in the second half",
        np.isclose(found.motion_rows[BLOCKS // 2 :].max(), 5 / 12)
        and np.isclose(found.motion_rows[: BLOCKS // 2].max(), 0.41 / 12.82),
        found.motion_rows,
    )


def test_reference():
    problem, exact, shapes = chain(40, 1e-3, 1e-2)
    chosen = np.array([0, 3, 17, 39])
    disturbed = shapes[chosen] * (1 + 1e-9 * np.cos(np.arange(40)))
    result = Result(
        np.array(exact[chosen], dtype=complex) * (1 + 1e-9), disturbed.astype(complex), np.zeros((4, 0), dtype=complex)
    )
    reference = refine_modes(problem, result)
    off = abs(reference.eigenvalues - exact[chosen]) / abs(exact[chosen])
    # The damping ratio of the first is 0.007, so that this is more than double precision has of it.
    check(
        "reference: the closed form of a damped chain, better than double precision",
        len(off) == 4 and off.max() < 2e-17,
        off,
    )
    decays = np.array([-1e-3, -1e-3 * (1 + 1e-9), -2e-3, 0])
    check("reference: neither at zeros nor at multiple eigenvalues", list(simple(decays)) == [False, False, True, False])
    ratio, rate = damping_measure(np.array([-0.1 + 1j, -3 + 0j]))
    check("damping: the ratio of an oscillation, the rate of a real eigenvalue", np.isclose(ratio, 0.1 / abs(-0.1 + 1j)) and rate == 3)
    frequency, damping = forward_errors(result.eigenvalues, reference)
    check("forward error of frequency: the disturbance", np.allclose(frequency, 1e-9, rtol=1e-5), frequency)
    check("forward error of damping: the disturbance leaves the ratio", damping.max() < 1e-12, damping)
    frequency, damping = forward_errors(result.eigenvalues + 1e-6 * result.eigenvalues.real, reference)
    check("forward error of damping: that of the real part", np.allclose(damping, 1e-6, rtol=2e-2), damping)


def test_counts():
    expected = np.array([0, -1e-3, -0.1 + 2j, -0.1 + 3j, -50])
    check("eigenvalues found: all", count_found(expected, expected, True) == 7)
    check(
        "eigenvalues found: a ring in the place of 0 and -0.001",
        count_found(np.array([-5e-4 + 1e-4j, -0.1 + 2j, -0.1 + 3j, -50]), expected, True) == 7,
    )
    check(
        "eigenvalues found: one pair missing",
        count_found(np.array([0, -1e-3, -0.1 + 2j, -0.1 + 3.1j, -50]), expected, True) == 5,
    )
    check("eigenvalues found: one copy of two is one", count_found(np.array([1j, 2j]), np.array([1j, 1j]), True) == 2)
    check("eigenvalues found: an undamped zero counts twice", count_found(np.array([0j]), np.array([0j, 2j]), False) == 2)
    values = np.array([3 - 4j, -1, 3 + 4j, 1j, -2, -1j, -9])
    eye = np.eye(7, dtype=complex)
    modes = one_of_each_pair(Result(values, eye, eye), 6)
    check(
        "one of each pair: with Im >= 0, nearest first",
        sorted(modes.eigenvalues, key=lambda v: (v.real, v.imag)) == [-2, -1, 1j, 3 + 4j],
        modes.eigenvalues,
    )
    check(
        "one of each pair: vectors go with their values",
        all(values[np.argmax(abs(vector))] == value for vector, value in zip(modes.eigenvectors, modes.eigenvalues)),
    )


def test_hard_case_lines():
    good = read_line(
        f"{'20 identical springs, damped':48s}{'auto: proportional':28s}    20/20  4.0E-16  6.1E-15    0.01  ok"
    )
    check(
        "hard case: a good line",
        good and good.good and good.method == "auto" and good.found == 20 and good.eigenvalue_error == 6.1e-15,
        good,
    )
    bad = read_line(
        f"{'2 free bodies':48s}{'arpack plain':28s}    23/24  3.3E-08  1.0E+00    0.03  fails, reported"
    )
    check(
        "hard case: a bad line",
        bad and not bad.good and (bad.found, bad.expected) == (23, 24) and bad.method == "arpack-plain",
        bad,
    )
    failing = read_line(f"{'a chain':48s}{'arpack fair':28s}{'-':9s}{'':26s}  fails, reported: info = -9")
    check("hard case: an error", failing and not failing.good and failing.message == "info = -9", failing)
    check("hard case: the heading is none", read_line(f"{'case':48s}{'method':28s}    modes backward  off      seconds") is None)


def test_ranking():
    quick, slow = (Run("accuracy", "p", name, 1e-12) for name in ("auto", "quadratic"))
    quick.seconds, slow.seconds = np.array([1.0, 1.1, 1.9]), np.array([1.8, 2.0, 2.2])
    check("ranking: none where repetitions overlap", is_as_fast(slow, quick))
    slow.seconds = np.array([1.95, 2.0, 2.2])
    check("ranking: one where they do not", not is_as_fast(slow, quick) and is_as_fast(quick, slow))
    check("spread: of the repetitions, none of a single one", np.isclose(quick.spread, 0.9 / 1.1) and np.isnan(Run("", "", "", 0).spread))


class Page(html.parser.HTMLParser):
    """Ids, links and open elements of a page."""

    VOID = {"meta", "br", "use", "path", "rect"}

    def __init__(self, text):
        super().__init__()
        self.ids, self.links, self.outside = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name == "id":
                self.ids.append(value)
            if name in ("href", "xlink:href") and value.startswith("#"):
                self.links.append(value[1:])
            if name == "src" or tag in ("link", "script", "iframe") or (name == "href" and re.match("https?:", value)):
                self.outside.append((tag, name, value))


def test_page(folder):
    run = report("--preset", "tiny", "--no-peers", "--output", folder)
    check("report: exit status 0", run.returncode == 0, run.stderr)
    text = (folder / "index.html").read_text()
    page = Page(text)
    check("page: nothing from outside", not page.outside and "@import" not in text, page.outside)
    check("page: ids are unique", len(page.ids) == len(set(page.ids)), len(page.ids) - len(set(page.ids)))
    check("page: links inside it lead somewhere", set(page.links) <= set(page.ids), set(page.links) - set(page.ids))
    check(
        "page: says first what to use: the fastest of those that are accurate",
        text.index('class="advice"') < text.index("<figure>") and f"use {fastest(folder)}" in text,
        fastest(folder),
    )
    check(
        "figures: each as SVG and as CSV",
        {path.stem for path in folder.glob("*.svg")} == FIGURES == {path.stem for path in folder.glob("*.csv")},
        sorted(path.name for path in folder.iterdir()),
    )
    for name in sorted(FIGURES):
        check(f"{name}: on the page", f'id="{name}"' in text)
        check(f"{name}: SVG", xml.etree.ElementTree.parse(folder / f"{name}.svg").getroot().tag.endswith("svg"))
        rows = list(csv.reader(open(folder / f"{name}.csv")))
        check(
            f"{name}: a CSV with rows as wide as its head",
            len(rows) > 3 and {len(row) for row in rows} == {len(rows[0])},
            rows[:2],
        )
    check("results.md: the tables", (folder / "results.md").read_text().count("\n## ") >= 5)
    test_numbers(folder)
    before = text
    run = report("--redraw", "--output", folder)
    check(
        "redrawn from its data: the same page",
        run.returncode == 0 and (folder / "index.html").read_text() == before,
        run.stderr,
    )
    test_again(folder)


def test_again(folder):
    """One study once more: the others stay as they are."""
    before = read_campaign(folder / "data.h5")
    run = report("--again", "blocks", "--no-peers", "--output", folder)
    after = read_campaign(folder / "data.h5")
    check("again: exit status 0", run.returncode == 0, run.stderr)
    check("again: as many runs", len(after.runs) == len(before.runs), (len(after.runs), len(before.runs)))

    def seconds(campaign, chosen):
        return [tuple(run.seconds) for run in campaign.runs if (run.study == "blocks") == chosen]

    check("again: that study is another measurement", not set(seconds(before, True)) & set(seconds(after, True)))
    check("again: the others are kept", seconds(before, False) == seconds(after, False))
    check("again: the page says so", "(blocks again on " in (folder / "results.md").read_text())
    run = report("--again", "colours", "--output", folder)
    check("again: an unknown study is refused", run.returncode == 2 and "accuracy" in run.stderr, run.stderr)


def test_ended_early(folder):
    """What was measured before a run is ended is kept, and can be drawn."""
    words = [REPORT, "--kschur", KSCHUR, "--preset", "tiny", "--no-peers", "--output", str(folder)]
    with subprocess.Popen(words, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL) as run:
        while run.poll() is None and not (folder / "data.h5").exists():
            time.sleep(0.05)
        run.kill()
    kept = {run.study for run in read_campaign(folder / "data.h5").runs}
    check("ended early: the first study is kept", "accuracy" in kept and "scaling" not in kept, kept)
    run = report("--redraw", "--output", folder)
    check("ended early: its page can be drawn", run.returncode == 0 and (folder / "index.html").exists(), run.stderr)


def fastest(folder):
    """The name of the fastest method below a backward error of 1e-12."""
    rows = csv.DictReader(open(folder / "work_precision_backward.csv"))
    accurate = [row for row in rows if float(row["worst_backward_error"]) < 1e-12]
    return METHODS[min(accurate, key=lambda row: float(row["seconds"]))["method"]].label


def test_numbers(folder):
    campaign = read_campaign(folder / "data.h5")
    check(
        "data: no run failed",
        not [run.failure for run in campaign.runs if run.failure],
        [run.failure for run in campaign.runs],
    )
    runs = campaign.study("accuracy")
    check(
        "data: four methods at two tolerances, twice each",
        len(runs) == 8 and all(len(run.seconds) == 2 for run in runs),
        len(runs),
    )
    # Both are sums in extended precision; what differs is the rounding of norms and products.
    off = max(
        np.max(abs(run.backward_error - run.reported_backward_error) / (run.reported_backward_error + 1e-16)) for run in runs
    )
    check("backward errors: as kschur reports them", off < 0.2, off)
    check(
        "backward errors: small at tolerance 1e-12",
        all(run.worst_backward_error < 1e-13 for run in runs if run.tolerance == 1e-12),
    )
    check(
        "damping ratios: against the reference",
        all(len(run.damping_error) == 8 and run.worst_damping_error < 1e-9 for run in runs if run.tolerance == 1e-12),
    )
    check(
        "eigenvalues: every method has all 28",
        all(run.found == run.expected == 28 for run in runs),
        [(r.found, r.expected) for r in runs],
    )
    check(
        "phases: no longer than the whole",
        all((run.phases.sum(axis=1) <= 1.001 * run.seconds).all() and (run.phases >= 0).all() for run in runs),
    )
    check("memory: more than nothing", all((run.memory_bytes > 0).all() for run in runs))
    sizes = {run.unknowns for run in campaign.study("scaling")}
    check("scaling: three sizes", sizes == {300, 948, 1956}, sizes)
    cubes = campaign.study("solids")
    check(
        "solids: two cubes with each damping, all modes",
        sorted(run.problem for run in cubes)
        == [f"cube {cells}^3, {damping}" for cells in (2, 3) for damping in ("general", "one dashpot", "proportional")]
        and all(run.found == run.expected == 40 for run in cubes),
        [(run.problem, run.found) for run in cubes],
    )
    dampers = campaign.study("dampers")
    check(
        "dampers: each number by low-rank and by quadratic, one of them chosen, the same modes",
        sorted((run.dampers, run.formulation) for run in dampers)
        == [(count, form) for count in (1, 4, 16) for form in ("low-rank", "quadratic")]
        and all(run.found == run.expected for run in dampers)
        and len([run for run in dampers if run.method == "auto"]) == 3,
        [(run.dampers, run.method, run.formulation) for run in dampers],
    )
    blocks, threads = campaign.study("blocks"), campaign.study("threads")
    check(
        "blocks: all modes with each",
        [run.value for run in blocks] == 2 * ["1", "2", "4", "8"] and all(run.found == run.expected for run in blocks),
        [(run.value, run.found) for run in blocks],
    )
    check(
        "threads: the same digits with any number",
        {"1", "2"} <= {run.value for run in threads}
        and all(
            np.array_equal(run.eigenvalues, other.eigenvalues)
            for run in threads
            for other in threads
            if run.problem == other.problem
        ),
        [(run.problem, run.value) for run in threads],
    )
    check(
        "hard cases: ours are right, read from the program",
        campaign.hard_cases and all(case.good for case in campaign.hard_cases if case.method == "auto"),
    )
    check("machine: recorded", {"processor", "kschur", "system"} <= set(campaign.machine))


def write_chain(path):
    """An undamped, unconstrained problem, as a user may have it."""
    problem, _, _ = chain(30, 0, 0)
    with h5py.File(path, "w") as file:
        for name, matrix in (("mass", problem.mass), ("stiffness", problem.stiffness)):
            group = file.create_group(name)
            group.attrs["shape"] = matrix.shape
            for part in ("indptr", "indices", "data"):
                group[part] = getattr(matrix, part)


def test_own_problem(folder):
    write_chain(folder / "chain.h5")
    run = report(
        "--problem", folder / "chain.h5", "--modes", 5, "--no-peers", "--preset", "tiny", "--output", folder / "own"
    )
    check("own problem: exit status 0", run.returncode == 0, run.stderr)
    names = {path.stem for path in (folder / "own").glob("*.svg")}
    check(
        "own problem: the figures that apply",
        names
        == FIGURES
        - {
            "time_against_unknowns",
            "memory_against_unknowns",
            "time_of_solids",
            "time_against_dampers",
            "time_against_block",
            "time_against_threads",
            "constraint_scaling",
            "stability_map",
            "work_precision_damping",
        },
        names,
    )
    campaign = read_campaign(folder / "own" / "data.h5")
    expected = 2 * np.sin(np.arange(1, 6) * np.pi / 62)
    good = [run for run in campaign.study("accuracy") if np.allclose(abs(run.eigenvalues), expected, rtol=1e-9)]
    check(
        "own problem: the frequencies of the chain by each method that applies",
        len(good) == len(campaign.study("accuracy")) >= 4 and {"auto", "pencil"} <= {run.method for run in good},
        ({run.method for run in good}, campaign.notes),
    )


def test_peers(folder):
    """Those that are installed, on a problem with constraints; SciPy always is."""
    installed = [name for name in PEER_NAMES if not missing(METHODS[name])]
    check("peers: SciPy at least", "scipy" in installed)
    proportional = [name for name in installed if METHODS[name].argument in ("symmetric", "saddle")]
    check_peers(folder, ["cantilever"], [name for name in installed if name not in proportional], 8)
    check_peers(folder, ["grid", "--cells", "3x2"], proportional, 20)
    # More than ties.
    check_peers(folder, ["crank", "--density", "1"], [name for name in proportional if METHODS[name].argument == "saddle"], 8)


def check_peers(folder, scene, names, modes):
    path, output = folder / f"{scene[0]}.h5", folder / "peer.h5"
    subprocess.run([KSCHUR, "scene", *scene, "--output", path], check=True, stdout=subprocess.DEVNULL)
    problem = read_problem(path)
    subprocess.run(
        [KSCHUR, "solve", path, "--modes", str(modes), "--quiet", "--output", output], check=True, stdout=subprocess.DEVNULL
    )
    ours = read_result(output)
    question = Question(
        len(ours.eigenvalues), int(eigenvalue_counts(ours.eigenvalues, True).sum()), shift_for_peers(ours)
    )
    for method in (METHODS[name] for name in names):
        output.unlink(missing_ok=True)
        words, environment = command(method, KSCHUR, path, question, 1e-10, output)
        run = subprocess.run(words, env=environment, capture_output=True, text=True)
        check(f"{method.label}: writes a result", output.exists(), run.stderr[-300:])
        if not output.exists():
            continue
        peer = read_result(output)
        found_modes = one_of_each_pair(peer, question.eigenvalues)
        found = count_found(found_modes.eigenvalues, ours.eigenvalues, True)
        check(f"{method.label}: the same eigenvalues", found == question.eigenvalues > modes, (found, question))
        worst = residuals(problem, found_modes).backward_error.max()
        check(f"{method.label}: shapes and multipliers with them", worst < 1e-6, worst)
        check(
            f"{method.label}: what it cost",
            peer.facts["seconds_total"] > 0
            and peer.facts["operator_applications"] > 10
            and peer.facts["peak_memory_bytes"] > peer.facts["baseline_memory_bytes"] > 0,
            peer.facts,
        )


def test_refusals(folder):
    (folder / "empty.h5").write_bytes(b"")
    with h5py.File(folder / "other.h5", "w") as file:
        file["mass"] = np.eye(2)
    for name, status, words, said in (
        ("a missing file", 2, ["--problem", folder / "none.h5"], "none.h5"),
        ("no HDF5", 2, ["--problem", folder / "empty.h5"], "empty.h5"),
        ("no CSR group", 2, ["--problem", folder / "other.h5"], "/mass"),
        ("no modes", 1, ["--problem", folder / "chain.h5", "--modes", "0"], "--modes"),
        ("nothing to measure again", 2, ["--again", "accuracy", "--output", folder / "nowhere"], "data.h5"),
        ("nothing to redraw", 2, ["--redraw", "--output", folder / "nowhere"], "data.h5"),
        ("an unknown option", 1, ["--best"], "--best"),
    ):
        run = report(*words)
        check(
            f"{name}: exit status {status}, named",
            run.returncode == status and said in run.stderr and "Traceback" not in run.stderr,
            (run.returncode, run.stderr),
        )
    check("help: exit status 0", report("--help").returncode == 0)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        test_fit()
        test_backward_error()
        test_reference()
        test_counts()
        test_hard_case_lines()
        test_ranking()
        test_own_problem(pathlib.Path(name))
        test_peers(pathlib.Path(name))
        test_refusals(pathlib.Path(name))
        test_page(pathlib.Path(name) / "page")
        test_ended_early(pathlib.Path(name) / "early")
    finish()
