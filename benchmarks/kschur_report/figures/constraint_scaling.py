"""What scaling of the constraints does (the paper's Figure 4a)."""

import numpy as np

from ..methods import METHODS
from ..plan import CONSTRAINT_SCALING
from .picture import Picture, drawn, legend_below, panels, tidy_logarithms

LOOKS = {
    "row": ("#0072B2", "o", "each row to the stiffness level"),
    "scalar": ("#E69F00", "s", "one factor for all, as the paper"),
    "none": ("#D55E00", "X", "as given"),
}


def draw(campaign):
    """One panel a problem and method."""
    runs = campaign.study(CONSTRAINT_SCALING)
    places = list(dict.fromkeys((run.problem, run.method) for run in runs))
    if not places:
        return []
    figure, axes = panels(len(places), height=4.4)
    rows = []
    for axis, (problem, method) in zip(axes, places):
        for run in (r for r in runs if (r.problem, r.method) == (problem, method)):
            colour, marker, label = LOOKS[run.value]
            errors = run.backward_error[np.argsort(abs(run.eigenvalues), kind="stable")]
            axis.semilogy(
                np.arange(1, len(errors) + 1),
                [drawn(e) for e in errors],
                color=colour,
                marker=marker,
                label=label,
                linewidth=0.8,
                markersize=5,
            )
            rows += [[problem, method, run.value, k + 1, error] for k, error in enumerate(errors)]
        axis.set_xlabel("mode, lowest first (-)")
        axis.xaxis.get_major_locator().set_params(integer=True)
        axis.set_ylabel("backward error (-)")
        axis.set_title(f"{problem}\n{METHODS[method].label}")
        tidy_logarithms(axis)
    legend_below(figure, axes)
    return [
        Picture(
            "constraint_scaling",
            "Effect of constraint scaling",
            "The paper's pencil, factored with its constraints scaled in three ways. Worst backward errors: "
            + "; ".join(worst_errors(runs, *place) for place in places)
            + ".",
            figure,
            ["problem", "method", "scaling", "mode", "backward_error"],
            rows,
        )
    ]


def worst_errors(runs, problem, method):
    """In words, for the caption."""
    return f"{problem}: " + ", ".join(
        f"{run.value} {run.worst_backward_error:.0e}" for run in runs if (run.problem, run.method) == (problem, method)
    )
