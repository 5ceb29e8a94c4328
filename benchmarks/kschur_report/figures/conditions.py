"""The error of each eigenvalue beside what rounding of the matrices may move it by."""

import numpy as np

from .picture import Picture, drawn, in_order, legend_below, panels, style_of, tidy_logarithms
from .residuals import tightest

ROUNDING = np.finfo(float).eps


def draw(campaign):
    """One panel a problem that has references."""
    runs = [run for run in tightest(campaign) if len(run.frequency_error)]
    problems = list(dict.fromkeys(run.problem for run in runs))
    if not problems:
        return []
    figure, axes = panels(len(problems), height=5.0)
    rows = []
    for axis, problem in zip(axes, problems):
        here = {run.method: run for run in runs if run.problem == problem}
        for method in in_order(here):
            run = here[method]
            errors = np.fmax(run.frequency_error, run.damping_error)
            modes = np.arange(1, len(errors) + 1)
            axis.semilogy(modes, [drawn(e) for e in errors], **{**style_of(method), "linewidth": 0.8, "markersize": 4})
            rows += [[problem, method, run.tolerance, *row] for row in zip(modes, run.frequency_error, run.damping_error, run.condition)]
        limit = ROUNDING * next(iter(here.values())).condition
        axis.semilogy(np.arange(1, len(limit) + 1), limit, color="#222222", linestyle="--", label="condition number times 2e-16")
        axis.set_xlabel("mode with a reference, lowest first (-)")
        axis.xaxis.get_major_locator().set_params(integer=True)
        axis.set_ylabel("relative error of frequency or damping (-)")
        axis.set_title(problem)
        tidy_logarithms(axis)
    legend_below(figure, axes)
    return [
        Picture(
            "error_by_mode",
            "Error of each mode, and its condition",
            "At the smallest tolerance, the larger of the relative errors of frequency and damping. The dashed line is how far "
            "a change of the matrices by rounding, relative to their norms, may move an eigenvalue: no method that takes the "
            "matrices in double precision can promise less; where matrices are scaled or structured, less is often reached.",
            figure,
            ["problem", "method", "tolerance", "mode", "frequency_error", "damping_error", "condition_number"],
            rows,
        )
    ]
