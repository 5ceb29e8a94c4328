"""Time against accuracy: a curve per method, a point per tolerance."""

import math

from ..plan import ACCURACY
from .picture import Picture, drawn, in_order, legend_below, panels, style_of, tidy_logarithms

MEASURES = (
    ("worst_backward_error", "backward", "worst backward error (-)", "Time against worst backward error"),
    (
        "worst_damping_error",
        "damping",
        "worst relative error of damping (-)",
        "Time against worst error of damping",
    ),
)
CAPTIONS = {
    "backward": "Left and down is better. A curve joins the tolerances of one method, loosest first. The backward error is computed by "
    "this report from the modes and the matrices as given, for every method by the same code.",
    "damping": "Against eigenvalues in extended precision by Newton's method, in code that shares nothing with the solvers. "
    "Of oscillations the ratio, of real eigenvalues the rate; zeros and multiple eigenvalues have no reference. An error below "
    "what the reference is good for is drawn as that.",
}
NAME, TITLE = "work_precision_backward", "Time against worst backward error"
MARKS = " Bars: shortest and longest repetition. White inside: not all of the modes."


def draw(campaign):
    """Two pictures, the second where a reference exists."""
    return [picture for measure in MEASURES for picture in draw_measure(campaign.study(ACCURACY), *measure)]


def draw_measure(runs, attribute, name, label, title):
    runs = [run for run in runs if not math.isnan(getattr(run, attribute))]
    problems = list(dict.fromkeys(run.problem for run in runs))
    if not problems:
        return []
    figure, axes = panels(len(problems), height=4.4, columns=3 if len(problems) > 2 else 2)
    rows = []
    for axis, problem in zip(axes, problems):
        for method in in_order(run.method for run in runs):
            points = sorted(
                (run for run in runs if run.problem == problem and run.method == method), key=lambda run: -run.tolerance
            )
            axis.errorbar(
                [drawn(getattr(run, attribute)) for run in points],
                [run.median_seconds for run in points],
                yerr=spreads(points),
                elinewidth=0.9,
                capsize=2,
                **style_of(method),
            )
            incomplete = [run for run in points if run.found < run.expected]
            axis.plot(
                [drawn(getattr(run, attribute)) for run in incomplete],
                [run.median_seconds for run in incomplete],
                style_of(method)["marker"],
                markerfacecolor="white",
                markeredgecolor=style_of(method)["color"],
                zorder=3,
            )
            rows += [
                [problem, method, run.tolerance, run.median_seconds, run.seconds.min(), run.seconds.max(), len(run.seconds)]
                + [getattr(run, attribute)]
                for run in points
            ]
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.set_xlabel(label)
        axis.set_ylabel("time (s)")
        axis.set_title(problem)
        tidy_logarithms(axis)
    legend_below(figure, axes)
    return [
        Picture(
            f"work_precision_{name}",
            title,
            CAPTIONS[name] + MARKS,
            figure,
            ["problem", "method", "tolerance", "seconds", "shortest", "longest", "repetitions", attribute],
            rows,
        )
    ]


def spreads(runs):
    """Of each run how far its shortest and its longest repetition are from the median, as error bars want it."""
    return [
        [run.median_seconds - run.seconds.min() for run in runs],
        [run.seconds.max() - run.median_seconds for run in runs],
    ]
