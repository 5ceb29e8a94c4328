"""Runs a plan: every run a process of its own, the methods in turn so that a busy moment hits all of them."""

import pathlib
import subprocess
import sys
import tempfile

import numpy as np

from . import accuracy
from .methods import METHODS, REFERENCE_TOLERANCE, Question, command, missing, shift_for_peers
from .problem import read_problem
from .reference import refine_modes
from .result import one_of_each_pair, read_result
from .runs import PHASES, Run


def progress(line):
    """One line on standard error."""
    print(line, file=sys.stderr, flush=True)


class Failure(Exception):
    """A run that gave no result; the message says why."""


def last_line(text):
    lines = [line for line in text.strip().splitlines() if line.strip()]
    return lines[-1].strip() if lines else "no message"


def execute(words, environment, output, patience):
    """Runs one process and reads its result."""
    try:
        run = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=patience)
    except subprocess.TimeoutExpired:
        raise Failure(f"stopped after {patience:g} s") from None
    except OSError as wrong:
        raise Failure(f"cannot be run: {wrong.strerror}") from None
    if not output.exists():
        raise Failure(last_line(run.stderr))
    result = read_result(output)
    output.unlink()
    return result


class Judge:
    """Gives runs on one problem their errors, by the code that is the same for all methods."""

    def __init__(self, problem, expected):
        self.problem = problem
        self.expected = expected
        self.reference = None

    def examine(self, run, result):
        residuals = accuracy.residuals(self.problem, result)
        for name in ("backward_error", "motion", "constraint", "motion_rows", "constraint_rows"):
            setattr(run, name, getattr(residuals, name))
        run.eigenvalues = result.eigenvalues
        if result.backward_error is not None:
            run.reported_backward_error = result.backward_error
        damped = self.problem.is_damped
        run.expected = int(accuracy.eigenvalue_counts(self.expected, damped).sum())
        run.found = accuracy.count_found(result.eigenvalues, self.expected, damped)
        if self.reference is not None:
            run.frequency_error, run.damping_error = accuracy.forward_errors(result.eigenvalues, self.reference)
            run.condition = self.reference.condition
            run.reference_uncertainty = self.reference.worst_uncertainty


class Runner:
    """Runs studies with one `kschur` program; collects runs and notes."""

    def __init__(self, kschur, campaign):
        self.kschur = kschur
        self.campaign = campaign
        self.memory_baseline = self.measure_baseline()
        self.slow = set()

    def measure_baseline(self):
        """Memory of the program before it solves anything: of a problem of two unknowns."""
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            for name, stiffness in (("M", 1.0), ("K", 2.0)):
                (folder / f"{name}.mtx").write_text(
                    f"%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 {stiffness}\n2 2 {2 * stiffness}\n"
                )
            output = folder / "result.h5"
            words, environment = command(METHODS["auto"], self.kschur, folder, Question(1), REFERENCE_TOLERANCE, output)
            return execute(words, environment, output, 60).facts["peak_memory_bytes"]

    def note(self, line):
        if line not in self.campaign.notes:
            self.campaign.notes.append(line)

    def run_plan(self, studies, after_each):
        """Calls `after_each` after each problem, so that what was measured can be kept."""
        for study in studies:
            for scene in study.scenes:
                with tempfile.TemporaryDirectory() as folder:
                    self.run_scene(study, scene, pathlib.Path(folder))
                after_each()

    def run_scene(self, study, scene, folder):
        path = pathlib.Path(scene.file) if scene.file else folder / "problem.h5"
        if not scene.file:
            written = subprocess.run(
                [str(self.kschur), "scene", *scene.arguments, "--output", str(path)], capture_output=True, text=True
            )
            if written.returncode != 0:
                self.note(f"{scene.label}: left out. {last_line(written.stderr)}")
                return
        problem = read_problem(path)
        runs = [
            Run(
                study.name,
                scene.label,
                name,
                tolerance,
                value,
                unknowns=problem.unknowns,
                constraints=problem.constraints.shape[0],
                dampers=scene.dampers,
            )
            for tolerance in study.tolerances
            for value in study.values
            for name in self.available(study, scene)
        ]
        if not runs:
            return
        progress(f"{study.name}: {scene.label}, {problem.unknowns} unknowns, {len(runs)} combinations")
        output = folder / "result.h5"
        referred = sum(problem.constraints.shape) <= study.reference_order
        extra = ("--left",) if referred else ()
        try:
            words, environment = command(
                METHODS["auto"], self.kschur, path, Question(study.modes), REFERENCE_TOLERANCE, output, extra
            )
            first = execute(words, environment, output, study.patience)
        except Failure as failure:
            self.note(f"{study.name}, {scene.label}: left out, kschur itself fails: {failure}")
            return
        question = Question(
            study.modes,
            int(accuracy.eigenvalue_counts(first.eigenvalues, problem.is_damped).sum()),
            shift_for_peers(first),
        )
        judge = Judge(problem, first.eigenvalues)
        if any(run.method == "auto" for run in runs):
            for run in [run for run in runs if METHODS[run.method].formulation == first.facts["formulation"]]:
                runs.remove(run)
                self.note(
                    f"{METHODS[run.method].label} on {scene.label}: it is what {METHODS['auto'].label} chooses, not run twice."
                )
        if referred:
            judge.reference = refine_modes(problem, first)
        for repetition in range(study.repeats):
            for run in runs:
                if run.failure or (repetition > 0 and run.seconds.sum() + run.median_seconds > study.seconds):
                    continue
                self.repeat(run, study, question, path, output, judge)
        self.campaign.add(runs)
        self.look_for_slow(study, runs)

    def available(self, study, scene):
        """The methods of a study that can run; the page says which cannot."""
        names = []
        for name in study.methods:
            reason = missing(METHODS[name])
            if reason:
                self.note(f"{METHODS[name].label}: left out. {reason}")
            elif not (study.grows and name in self.slow):
                names.append(name)
        return names

    def look_for_slow(self, study, runs):
        """A method that needs a long time, or fails, is not asked for larger problems of the same study."""
        if not study.grows:
            return
        for run in runs:
            if run.failure or run.seconds.max() > study.patience / 4:
                self.slow.add(run.method)
                self.note(
                    f"{METHODS[run.method].label}: not run on grids larger than {run.problem} "
                    f"({run.failure or f'{run.seconds.max():.1f} s there'})."
                )

    def repeat(self, run, study, question, path, output, judge):
        """One repetition; the first also keeps the modes and judges them."""
        method = METHODS[run.method]
        extra = (study.option, run.value) if study.option else ()
        words, environment = command(method, self.kschur, path, question, run.tolerance, output, extra)
        try:
            result = execute(words, environment, output, study.patience)
        except Failure as failure:
            run.failure = str(failure)
            self.note(f"{method.label} on {run.problem}: {failure}")
            return
        facts = result.facts
        run.seconds = np.append(run.seconds, facts["seconds_total"])
        run.phases = np.vstack([run.phases, [facts.get("seconds_" + phase, np.nan) for phase in PHASES]])
        baseline = facts.get("baseline_memory_bytes", self.memory_baseline)
        run.memory_bytes = np.append(run.memory_bytes, facts["peak_memory_bytes"] - baseline)
        if len(run.seconds) == 1:
            if method.is_peer:
                result = one_of_each_pair(result, question.eigenvalues)
            keep_facts(run, facts, question)
            judge.examine(run, result)
        progress(
            f"   {method.label:28s} {run.tolerance:g} {run.value:7s} {run.seconds[-1]:9.3f} s  "
            f"{run.worst_backward_error:.1e}"
        )


def keep_facts(run, facts, question):
    run.modes_asked = question.modes
    run.operator_applications = facts.get("operator_applications", 0)
    run.formulation = facts.get("formulation", "")
    run.reason = facts.get("reason", "")
    run.certified = facts.get("certified", "")
    run.library = facts.get("library", "")
    run.shift = abs(facts.get("shift", question.shift))
