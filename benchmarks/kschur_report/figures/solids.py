"""Time against unknowns of solids, a panel for each damping."""

from ..plan import SOLIDS
from .picture import Picture, in_order, legend_below, panels, style_of, tidy_logarithms


def damping_of(run):
    """What the name of its problem says after the comma."""
    return run.problem.partition(", ")[2]


def draw(campaign):
    """One picture."""
    runs = campaign.study(SOLIDS)
    if not runs:
        return []
    dampings = list(dict.fromkeys(map(damping_of, runs)))
    figure, axes = panels(len(dampings), height=3.6, columns=3)
    rows = []
    for axis, damping in zip(axes, dampings):
        here = [run for run in runs if damping_of(run) == damping]
        for method in in_order(run.method for run in here):
            line = sorted((run for run in here if run.method == method), key=lambda run: run.unknowns)
            axis.loglog([run.unknowns for run in line], [run.median_seconds for run in line], **style_of(method))
            rows += [[damping, method, run.unknowns, run.median_seconds, run.worst_backward_error] for run in line]
        axis.set_title(damping)
        axis.set_xlabel("unknowns n (-)")
        axis.set_ylabel("time (s)")
        tidy_logarithms(axis)
    legend_below(figure, axes)
    return [
        Picture(
            "time_of_solids",
            "Time against unknowns of solids",
            f"Cubes of eight-node bricks, clamped at a face, {runs[0].modes_asked} modes, with three kinds of damping.",
            figure,
            ["damping", "method", "unknowns", "time_s", "backward_error"],
            rows,
        )
    ]
