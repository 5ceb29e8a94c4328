"""The residual of each mode, and where in the state vector it sits (the paper's Figures 3b and 6)."""

import numpy as np

from ..plan import ACCURACY
from .picture import SMALLEST, Picture, drawn, in_order, legend_below, panels, style_of, tidy_logarithms

BLOCKS = (("motion_rows", "equations of motion"), ("constraint_rows", "constraints"))


def tightest(campaign):
    """For each problem and method the run at the smallest tolerance."""
    chosen = {}
    for run in campaign.study(ACCURACY):
        key = run.problem, run.method
        if key not in chosen or run.tolerance < chosen[key].tolerance:
            chosen[key] = run
    return list(chosen.values())


def draw(campaign):
    """By mode, and by row."""
    runs = tightest(campaign)
    problems = list(dict.fromkeys(run.problem for run in runs))
    return [draw_modes(runs, problems), draw_rows(runs, problems)] if runs else []


def draw_modes(runs, problems):
    figure, axes = panels(len(problems), height=5.0)
    rows = []
    for axis, problem in zip(axes, problems):
        for method in in_order(run.method for run in runs):
            for run in (r for r in runs if r.problem == problem and r.method == method):
                order = np.argsort(abs(run.eigenvalues), kind="stable")
                errors = run.backward_error[order]
                axis.semilogy(
                    np.arange(1, len(errors) + 1),
                    [drawn(e) for e in errors],
                    **{**style_of(method), "linewidth": 0.8, "markersize": 4},
                )
                frequencies = abs(run.eigenvalues[order]) / (2 * np.pi)
                rows += [
                    [
                        problem,
                        method,
                        run.tolerance,
                        k + 1,
                        frequencies[k],
                        errors[k],
                        run.motion[order[k]],
                        run.constraint[order[k]],
                    ]
                    for k in range(len(errors))
                ]
        axis.set_xlabel("mode, lowest first (-)")
        axis.xaxis.get_major_locator().set_params(integer=True)
        axis.set_ylabel("backward error (-)")
        axis.set_title(problem)
        tidy_logarithms(axis)
    legend_below(figure, axes)
    return Picture(
        "residual_by_mode",
        "Backward error of each mode",
        "At the smallest tolerance. The first modes of a free structure are its rigid motions.",
        figure,
        ["problem", "method", "tolerance", "mode", "frequency_hz", "backward_error", "motion", "constraint"],
        rows,
    )


def draw_rows(runs, problems):
    figure, axes = panels(2 * len(problems), height=4.2)
    rows = []
    for position, problem in enumerate(problems):
        for axis, (block, label) in zip(axes[2 * position :], BLOCKS):
            for method in in_order(run.method for run in runs):
                for run in (r for r in runs if r.problem == problem and r.method == method):
                    values = getattr(run, block)
                    places = (np.arange(len(values)) + 0.5) / len(values)
                    axis.semilogy(
                        places,
                        [drawn(v) for v in values],
                        color=style_of(method)["color"],
                        label=style_of(method)["label"],
                        linewidth=0.9,
                    )
                    rows += [[problem, method, block.split("_")[0], place, value] for place, value in zip(places, values)]
            axis.set_xlabel(f"place among the {label} (0 to 1)")
            axis.set_ylabel("largest residual of a mode (-)")
            axis.set_title(problem)
            tidy_logarithms(axis)
    legend_below(figure, axes)
    return Picture(
        "residual_by_row",
        "Where the residual sits",
        "The largest residual of any mode in each of 240 parts of the rows, relative as the backward error. "
        f"A residual below {SMALLEST:g} is drawn as that: where ties are eliminated, those of constraints are zero. "
        "The velocities of the paper's state vector are lambda phi in all results: their rows have no residual.",
        figure,
        ["problem", "method", "block", "place", "residual"],
        rows,
    )
