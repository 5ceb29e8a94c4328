"""Where the time goes."""

import numpy as np

from ..methods import METHODS
from ..runs import PHASES
from .picture import Picture, in_order, legend_below, panels
from .residuals import tightest

COLOURS = ("#999999", "#E69F00", "#0072B2", "#009E73", "#CC79A7", "#8C6BB1", "#56B4E9", "#D55E00", "#F0E442", "#DDDDDD")
NAMES = (
    "order and analyze",
    "factorize",
    "solve",
    "orthogonalize",
    "examine",
    "place the shift",
    "products, projections",
    "recover shapes",
    "judge",
    "other",
)


def draw(campaign):
    """Bars, one a method, for each problem at the smallest tolerance."""
    runs = tightest(campaign)
    problems = list(dict.fromkeys(run.problem for run in runs))
    if not problems:
        return []
    methods = in_order(run.method for run in runs)
    figure, axes = panels(len(problems), height=1.4 + 0.36 * len(methods), columns=1)
    rows = []
    for axis, problem in zip(axes, problems):
        here = {run.method: run for run in runs if run.problem == problem}
        names = [name for name in methods if name in here][::-1]
        shares = np.array([seconds_by_phase(here[name]) for name in names])
        left = np.zeros(len(names))
        for part, colour, label in zip(shares.T, COLOURS, NAMES):
            axis.barh(
                [METHODS[name].label for name in names],
                part,
                left=left,
                color=colour,
                label=label,
                edgecolor="white",
                linewidth=0.5,
            )
            left = left + part
        axis.set_xlabel("time (s)")
        axis.set_title(problem)
        axis.grid(axis="y", visible=False)
        rows += [[problem, name, *share] for name, share in zip(names, shares)]
    legend_below(figure, axes, columns=5)
    return [
        Picture(
            "where_the_time_goes",
            "Where the time goes",
            'At the smallest tolerance, of the repetition with the median time. "Examine" is presolve, constraints and rigid '
            'motions, "judge" backward errors, error bounds, refinement and proofs. Phases that a method does not report are in '
            '"other".',
            figure,
            ["problem", "method", *(f"seconds_{phase}" for phase in PHASES), "seconds_other"],
            rows,
        )
    ]


def seconds_by_phase(run):
    """The phases and what is left, of the repetition whose time is the (lower) median."""
    at = np.argsort(run.seconds)[(len(run.seconds) - 1) // 2]
    phases = np.nan_to_num(run.phases[at])
    return [*phases, max(run.seconds[at] - phases.sum(), 0.0)]
