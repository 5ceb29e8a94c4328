"""Time against the number of dampers, and where the choice of a formulation changes over."""

from ..methods import METHODS
from ..plan import DAMPERS
from .picture import Picture, in_order, legend_below, panels, style_of, tidy_logarithms


def method_of(run):
    """The method whose formulation a run took, so that what was chosen lies on the line of what can be asked for."""
    for method in METHODS.values():
        if run.method == "auto" and method.formulation == run.formulation:
            return method.name
    return run.method


def draw(campaign):
    """One picture, a line a method; rings mark what is chosen."""
    runs = campaign.study(DAMPERS)
    if not runs:
        return []
    figure, (axis,) = panels(1, height=4.6)
    rows = []
    for method in in_order(method_of(run) for run in runs):
        line = sorted((run for run in runs if method_of(run) == method), key=lambda run: run.dampers)
        axis.loglog([run.dampers for run in line], [run.median_seconds for run in line], **style_of(method))
        rows += [
            [method, run.dampers, run.median_seconds, run.worst_backward_error, run.method == "auto"] for run in line
        ]
    chosen = [run for run in runs if run.method == "auto"]
    axis.loglog(
        [run.dampers for run in chosen],
        [run.median_seconds for run in chosen],
        "o",
        markersize=13,
        markerfacecolor="none",
        markeredgecolor="#222222",
        label="chosen by kschur",
    )
    axis.set_xlabel("dampers (-)")
    axis.set_ylabel("time (s)")
    axis.set_title(f"{runs[0].problem.split(',')[0]}, proportional but for dashpots")
    tidy_logarithms(axis)
    legend_below(figure, (axis,))
    caption = "The same grid and number of modes with more and more dashpots to the ground. " + change_over(chosen)
    return [
        Picture(
            "time_against_dampers",
            "Time against the number of dampers",
            caption,
            figure,
            ["method", "dampers", "time_s", "backward_error", "chosen"],
            rows,
        )
    ]


def change_over(chosen):
    """Between which numbers of dampers the choice changes."""
    local = [run.dampers for run in chosen if run.formulation == "low-rank"]
    other = [run.dampers for run in chosen if run.formulation != "low-rank"]
    if not local or not other:
        return "Rings mark what kschur chooses."
    return f"Rings mark what kschur chooses: low-rank up to {max(local)} dashpots, another form from {min(other)} on."
