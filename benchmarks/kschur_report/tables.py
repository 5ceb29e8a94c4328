"""The numbers of the page as tables, which page and Markdown both write."""
import math
from dataclasses import dataclass

from .advice import problems_of, where_not_first
from .methods import METHODS
from .plan import ACCURACY, CONSTRAINT_SCALING, SCALING


@dataclass
class Table:
    """Cells are words already; `note` stands above."""

    title: str
    note: str
    header: list
    rows: list


def error(value):
    return "" if math.isnan(value) else f"{value:.1e}"


def seconds(value):
    return f"{value:.3g}"


def megabytes(value):
    return "" if math.isnan(value) else f"{value / 1e6:.0f}"


def tables(campaign):
    """Those that have rows."""
    every = [not_first_table(campaign), *accuracy_tables(campaign), scaling_table(campaign), constraint_table(campaign),
             hard_table(campaign), method_table(campaign), note_table(campaign), machine_table(campaign)]
    return [table for table in every if table.rows]


def accuracy_tables(campaign):
    """One a problem."""
    runs = sorted(campaign.study(ACCURACY), key=lambda run: (list(METHODS).index(run.method), -run.tolerance))
    return [accuracy_table(problem, [run for run in runs if run.problem == problem]) for problem in problems_of(campaign.study(ACCURACY))]


def accuracy_table(problem, runs):
    rows = [[METHODS[run.method].label, run.formulation, f"{run.tolerance:g}", seconds(run.median_seconds), str(len(run.seconds)),
             str(run.operator_applications), megabytes(run.median_memory), error(run.worst_backward_error),
             error(run.worst_frequency_error), error(run.worst_damping_error), found(run), run.certified] for run in runs]
    compared = max(len(run.frequency_error) for run in runs)
    return Table(f"Speed against accuracy: {problem}",
                 f"{runs[0].unknowns:,} unknowns, {runs[0].constraints:,} constraints, {runs[0].modes_asked} lowest modes. Times are medians, of one "
                 "thread, from the matrices in memory to the modes in memory. Errors are the worst of all modes"
                 + (f", of frequency and damping ratio the worst relative ones of {compared} oscillating modes." if compared else
                    "; there is no reference for frequency and damping ratio."),
                 ["method", "formulation", "tolerance", "time (s)", "runs", "applications", "memory (MB)", "backward error",
                  "frequency", "damping ratio", "eigenvalues", "certified"], rows)


def found(run):
    """Eigenvalues found of those asked; both of a pair count."""
    return f"{run.found}/{run.expected}"


def scaling_table(campaign):
    rows = [[str(run.unknowns), METHODS[run.method].label, run.formulation, seconds(run.median_seconds), str(len(run.seconds)),
             megabytes(run.median_memory), error(run.worst_backward_error), found(run)]
            for run in sorted(campaign.study(SCALING), key=lambda run: (run.unknowns, list(METHODS).index(run.method)))]
    return Table("Growth with the number of unknowns", "The grid of beams of the paper's Figure 5 in growing sizes.",
                 ["unknowns", "method", "formulation", "time (s)", "runs", "memory (MB)", "backward error", "eigenvalues"], rows)


def constraint_table(campaign):
    rows = [[run.problem, METHODS[run.method].label, run.scaling, error(run.worst_backward_error), found(run)]
            for run in campaign.study(CONSTRAINT_SCALING)]
    return Table("Constraint scaling", "Worst backward error with each scaling of the constraints.",
                 ["problem", "method", "scaling", "backward error", "eigenvalues"], rows)


def hard_table(campaign):
    rows = [[case.name, METHODS[case.method].label, f"{case.found}/{case.expected}", error(case.backward_error), error(case.eigenvalue_error),
             case.message] for case in campaign.hard_cases if not case.good]
    return Table("Hard cases that a method gets wrong", f"Of {len(campaign.hard_cases)} runs.",
                 ["case", "method", "modes", "backward error", "eigenvalue error", "message"], rows)


def not_first_table(campaign):
    rows = [[study, problem, measure, best, f"{value:.3g}", f"{ours:.3g}", f"{ratio:.2f}"]
            for study, problem, measure, best, value, ours, ratio in where_not_first(campaign)]
    return Table("Where kschur is not the best", "The best value of the default at any tolerance against the best of any method "
                 "that found all modes.", ["study", "problem", "measure", "best method", "its value", "kschur", "ratio"], rows)


def method_table(campaign):
    used = {run.method for run in campaign.runs}
    libraries = {run.method: run.library for run in campaign.runs if run.library}
    rows = [[method.label, method.settings, libraries.get(name, "")] for name, method in METHODS.items() if name in used]
    return Table("Methods and their settings", "Peers get the matrices from the same file, the number of eigenvalues that our modes "
                 "stand for, and the shift that kschur chose, which makes them more accurate than a shift next to zero.",
                 ["method", "settings", "library"], rows)


def note_table(campaign):
    return Table("Left out", "What did not run, and why.", ["note"], [[note] for note in campaign.notes])


def machine_table(campaign):
    return Table("Machine, versions and settings", "", ["what", "value"],
                 [[name, str(value)] for name, value in sorted({**campaign.machine, **campaign.settings}.items(), key=lambda item: item[0].lower())])
