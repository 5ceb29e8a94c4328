"""The numbers of the page as tables, which page and Markdown both write."""
import math
from dataclasses import dataclass

from .advice import where_not_first
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
    every = [accuracy_table(campaign), scaling_table(campaign), constraint_table(campaign), hard_table(campaign),
             not_first_table(campaign), method_table(campaign), note_table(campaign), machine_table(campaign)]
    return [table for table in every if table.rows]


def accuracy_table(campaign):
    rows = [[run.problem, METHODS[run.method].label, run.formulation, f"{run.tolerance:g}", seconds(run.median_seconds), str(len(run.seconds)),
             str(run.operator_applications), megabytes(run.median_memory), error(run.worst_backward_error),
             error(run.worst_frequency_error), error(run.worst_damping_error), modes_found(run), run.certified]
            for run in sorted(campaign.study(ACCURACY), key=lambda run: (run.problem, list(METHODS).index(run.method), -run.tolerance))]
    return Table("Speed against accuracy", "Times are medians of the number of runs given, of one thread, from the matrices in memory to "
                 "the modes in memory. Backward errors are the worst of all modes; frequency and damping ratio errors the worst of "
                 "the oscillating modes of the reference.",
                 ["problem", "method", "formulation", "tolerance", "time (s)", "runs", "operator applications", "memory (MB)",
                  "backward error", "frequency error", "damping-ratio error", "modes", "certified"], rows)


def modes_found(run):
    """All modes returned of those asked; of the reference's where there is one."""
    words = f"{len(run.eigenvalues)} of {run.modes_asked}"
    return words + (f", reference {run.found} of {run.expected}" if run.expected else "")


def scaling_table(campaign):
    rows = [[str(run.unknowns), METHODS[run.method].label, run.formulation, seconds(run.median_seconds), str(len(run.seconds)),
             megabytes(run.median_memory), error(run.worst_backward_error), modes_found(run)]
            for run in sorted(campaign.study(SCALING), key=lambda run: (run.unknowns, list(METHODS).index(run.method)))]
    return Table("Growth with the number of unknowns", "The grid of beams of the paper's Figure 5 in growing sizes.",
                 ["unknowns", "method", "formulation", "time (s)", "runs", "memory (MB)", "backward error", "modes"], rows)


def constraint_table(campaign):
    rows = [[run.problem, METHODS[run.method].label, run.scaling, error(run.worst_backward_error), modes_found(run)]
            for run in campaign.study(CONSTRAINT_SCALING)]
    return Table("Constraint scaling", "Worst backward error with each scaling of the constraints.",
                 ["problem", "method", "scaling", "backward error", "modes"], rows)


def hard_table(campaign):
    rows = [[case.name, case.method, f"{case.found} of {case.expected}", error(case.backward_error), error(case.eigenvalue_error),
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
                 [[name, str(value)] for name, value in {**campaign.machine, **campaign.settings}.items()])
