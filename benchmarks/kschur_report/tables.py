"""The numbers of the page as tables, which page and Markdown both write."""

import math
from dataclasses import dataclass

from .advice import first_of_others, is_as_fast, problems_of, runs_by_problem, where_not_first
from .methods import METHODS, REFERENCE_TOLERANCE
from .plan import ACCURACY, BLOCKS, CONSTRAINT_SCALING, DAMPERS, SCALING, SOLIDS, THREADS
from .runs import median, worst

PLAIN = "arpack-plain"  # gets most of the hard cases wrong
METHODS_NOTE = (
    "Peers get the same matrices, number of eigenvalues and shift as kschur, and constraints scaled to the stiffness by one factor, as "
    "in the paper: most are more accurate by orders of magnitude than with a shift next to zero and constraints as given."
)


@dataclass
class Table:
    """Cells are words already; `note` stands above."""

    title: str
    note: str
    header: list
    rows: list


def error(value):
    return "" if math.isnan(value) else f"{value:.1e}"


def seconds(values):
    """A column of times in one format, in which the smallest has two digits at least."""
    smallest = min((value for value in values if value > 0), default=1.0)
    decimals = max(0, 1 - math.floor(math.log10(smallest)))
    return [f"{value:.{decimals}f}" for value in values]


def per_cent(value):
    return "" if math.isnan(value) else f"{100 * value:.0f} %"


def megabytes(value):
    return "" if math.isnan(value) else f"{value / 1e6:.0f}"


def tables(campaign):
    """Those that have rows."""
    every = [
        not_first_table(campaign),
        *accuracy_tables(campaign),
        growth_table(
            campaign.study(SCALING),
            "unknowns",
            "Growth with the number of unknowns",
            "The grid of beams of the paper's Figure 5 in growing sizes.",
        ),
        solids_table(campaign),
        growth_table(
            campaign.study(DAMPERS),
            "dampers",
            "Growth with the number of dampers",
            "A grid of beams with proportional damping and more and more dashpots to the ground.",
        ),
        constraint_table(campaign),
        option_table(campaign.study(BLOCKS), "block", "Vectors at a time", "The same modes from blocks of more vectors."),
        option_table(campaign.study(THREADS), "threads", "Threads", "The same modes, on more threads."),
        *hard_tables(campaign),
        method_table(campaign),
        note_table(campaign),
        machine_table(campaign),
    ]
    return [table for table in every if table.rows]


def headline_table(campaign):
    """A row a problem: ours, and the fastest of the other eigensolvers that is as accurate."""
    rows = []
    for problem, runs in runs_by_problem(campaign).items():
        mine, other = first_of_others(runs)
        times = [f"{run.median_seconds:.2g}" if run else "-" for run in (mine, other)]
        rows.append([problem, f"{runs[0].unknowns:,}", times[0], METHODS[other.method].label if other else "none", times[1],
                     ratio_of(mine, other)])
    return Table(
        "Time to a backward error of 1e-12",
        "All modes, one thread, at the loosest tolerance that gives it.",
        ["problem", "unknowns", "kschur (s)", "fastest of the others", "its time (s)", "ratio"],
        rows,
    )


def ratio_of(mine, other):
    """How many times longer the other takes; about 1 where their repetitions overlap."""
    if not (mine and other):
        return "-"
    if is_as_fast(mine, other) and is_as_fast(other, mine):
        return "about 1"
    return f"{other.median_seconds / mine.median_seconds:.1f}"


def accuracy_tables(campaign):
    """One a problem."""
    runs = sorted(campaign.study(ACCURACY), key=lambda run: (list(METHODS).index(run.method), -run.tolerance))
    return [
        accuracy_table(problem, [run for run in runs if run.problem == problem])
        for problem in problems_of(campaign.study(ACCURACY))
    ]


def accuracy_table(problem, runs):
    rows = [
        [
            METHODS[run.method].label,
            run.formulation,
            f"{run.tolerance:.0e}",
            time,
            str(len(run.seconds)),
            per_cent(run.spread),
            str(run.operator_applications),
            megabytes(run.median_memory),
            error(run.worst_backward_error),
            error(run.worst_frequency_error),
            error(run.worst_damping_error),
            found(run),
            run.certified,
        ]
        for run, time in zip(runs, seconds([run.median_seconds for run in runs]))
    ]
    return Table(
        f"Speed against accuracy: {problem}",
        f"{runs[0].unknowns:,} unknowns, {runs[0].constraints:,} constraints, {runs[0].modes_asked} lowest modes. "
        "Times are medians, of one thread, from the matrices in memory to the modes in memory. Eigenvalues are counted, both of a pair, among those that "
        f"kschur has at a tolerance of {REFERENCE_TOLERANCE:g}. The spread is from the shortest to the longest repetition. "
        + about_errors(runs),
        [
            "method",
            "formulation",
            "tolerance",
            "time (s)",
            "runs",
            "spread",
            "applications",
            "memory (MB)",
            "backward error",
            "frequency",
            "damping",
            "eigenvalues",
            "certified",
        ],
        rows,
    )


def about_errors(runs):
    """What the errors of a table are errors of, and how far the data alone let eigenvalues move."""
    compared = max(len(run.frequency_error) for run in runs)
    if not compared:
        return "Errors are the worst of all modes; there is no reference for frequency and damping."
    condition = worst(runs[0].condition)
    return (
        "Errors are the worst of all modes, of frequency and damping the worst relative ones of the "
        f"{compared} modes that have a reference, which is good to {runs[0].reference_uncertainty:.0e} or better: zeros and multiple "
        "eigenvalues have none. Damping is the ratio of an oscillation, the rate of a real eigenvalue."
        + (
            f" The largest condition number of these eigenvalues is {condition:.0e}: rounding of the matrices alone, of "
            f"1e-16, may move it by {1e-16 * condition:.0e} of itself."
            if math.isfinite(condition)
            else ""
        )
    )


def found(run):
    """Eigenvalues found of those asked; both of a pair count."""
    return f"{run.found}/{run.expected}"


MEASURED = ["time (s)", "runs", "spread", "memory (MB)", "backward error", "eigenvalues"]


def measurements(runs):
    """The columns MEASURED of some runs, times with the digits that suit them all."""
    return [
        [time, str(len(run.seconds)), per_cent(run.spread), megabytes(run.median_memory), error(run.worst_backward_error), found(run)]
        for run, time in zip(runs, seconds([run.median_seconds for run in runs]))
    ]


def growth_table(runs, what, title, note):
    """`what` is the number of a run that grows."""
    runs = sorted(runs, key=lambda run: (getattr(run, what), list(METHODS).index(run.method)))
    rows = [
        [
            str(getattr(run, what)),
            METHODS[run.method].label,
            run.formulation,
            *measured,
        ]
        for run, measured in zip(runs, measurements(runs))
    ]
    return Table(
        title,
        note,
        [what, "method", "formulation", *MEASURED],
        rows,
    )


def solids_table(campaign):
    """A row a problem and method."""
    runs = campaign.study(SOLIDS)
    rows = [
        [run.problem, f"{run.unknowns:,}", METHODS[run.method].label, run.formulation, str(run.operator_applications), *measured]
        for run, measured in zip(runs, measurements(runs))
    ]
    return Table(
        "Solids",
        "Cubes of eight-node bricks, clamped at a face, their 20 lowest modes.",
        ["problem", "unknowns", "method", "formulation", "applications", *MEASURED],
        rows,
    )


def constraint_table(campaign):
    rows = [
        [run.problem, METHODS[run.method].label, run.value, error(run.worst_backward_error), found(run)]
        for run in campaign.study(CONSTRAINT_SCALING)
    ]
    return Table(
        "Constraint scaling",
        "Worst backward error with each scaling of the constraints.",
        ["problem", "method", "scaling", "backward error", "eigenvalues"],
        rows,
    )


def option_table(runs, what, title, note):
    """A row a value of the option that is called `what`."""
    rows = [
        [
            run.problem,
            run.value,
            str(run.operator_applications),
            *measured,
        ]
        for run, measured in zip(runs, measurements(runs))
    ]
    return Table(
        title,
        note,
        ["problem", what, "vectors", *MEASURED],
        rows,
    )


def hard_tables(campaign):
    """How many each method gets right, and which those of ours and ARPACK's fair use get wrong."""
    cases = campaign.hard_cases
    methods = [name for name in METHODS if name in {case.method for case in cases}]
    counts = []
    for name in methods:
        mine = [case for case in cases if case.method == name]
        counts.append(
            [
                METHODS[name].label,
                str(sum(case.good for case in mine)),
                str(sum(not case.good for case in mine)),
                error(
                    median(
                        [
                            max(case.backward_error, case.eigenvalue_error)
                            for case in mine
                            if not math.isnan(case.backward_error)
                        ]
                    )
                ),
            ]
        )
    rows = [
        [
            case.name,
            METHODS[case.method].label,
            f"{case.found}/{case.expected}",
            error(case.backward_error),
            error(case.eigenvalue_error),
            case.message,
        ]
        for case in cases
        if not case.good and case.method != PLAIN
    ]
    return [
        Table(
            "Hard cases",
            "Error: the larger of backward error and relative error of an eigenvalue.",
            ["method", "right", "wrong", "median error"],
            counts,
        ),
        Table(
            "Hard cases that a method gets wrong",
            f"Without {METHODS[PLAIN].label}, whose are in the figure and its data.",
            ["case", "method", "modes", "backward error", "eigenvalue error", "message"],
            rows,
        ),
    ]


def not_first_table(campaign):
    rows = [
        [
            study,
            problem,
            measure,
            METHODS[best.method].label,
            f"{value:.3g}",
            f"{ours:.3g}",
            f"{ours / value:.2f}",
            error(best.worst_backward_error),
        ]
        for study, problem, measure, best, value, ours in where_not_first(campaign)
    ]
    return Table(
        "Where kschur is not the best",
        "The default at its best tolerance against the best method that found all eigenvalues, however accurate (last column). "
        "Errors next to rounding are not compared.",
        ["study", "problem", "measure", "best method", "its value", "kschur", "ratio", "its backward error"],
        rows,
    )


def method_table(campaign):
    used = {run.method for run in campaign.runs}
    libraries = {run.method: run.library for run in campaign.runs if run.library}
    rows = [[method.label, method.settings, libraries.get(name, "")] for name, method in METHODS.items() if name in used]
    return Table(
        "Methods and their settings",
        METHODS_NOTE,
        ["method", "settings", "library"],
        rows,
    )


def note_table(campaign):
    return Table("Left out", "What did not run, and why.", ["note"], [[note] for note in campaign.notes])


def machine_table(campaign):
    return Table(
        "Machine, versions and settings",
        "",
        ["what", "value"],
        [
            [name, str(value)]
            for name, value in sorted({**campaign.machine, **campaign.settings}.items(), key=lambda item: item[0].lower())
        ],
    )
