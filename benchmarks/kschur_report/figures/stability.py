"""The hard cases: which method gets which right."""

import math

from ..methods import METHODS
from .picture import BAD_COLOUR, GOOD_COLOUR, WIDTH, Picture, in_order, plt

ROW = 0.25  # inches


def draw(campaign):
    """A cell per case and method; cases in two columns of the page."""
    cases = campaign.hard_cases
    if not cases:
        return []
    names = list(dict.fromkeys(case.name for case in cases))
    by_place = {(case.name, case.method): case for case in cases}
    columns = [(method, METHODS[method].label.replace(" (", "\n(")) for method in in_order(case.method for case in cases)]
    half = -(-len(names) // 2)
    figure, axes = plt.subplots(1, 2, figsize=(1.6 * WIDTH, 1.2 + ROW * half))
    for axis, part in zip(axes, (names[:half], names[half:])):
        draw_cells(axis, part, columns, by_place, half)
    rows = [
        [
            case.name,
            case.method,
            "good" if case.good else "bad",
            case.found,
            case.expected,
            case.backward_error,
            case.eigenvalue_error,
            case.message,
        ]
        for case in cases
    ]
    return [
        Picture(
            "stability_map",
            "Stability map: hard cases",
            "Each case has an answer that this library did not compute: a closed form, quadruple precision or dense LAPACK. "
            "Blue with a tick: all modes found, backward error and eigenvalues as good as the case demands. Vermilion with "
            "a cross: not. The number is the larger of worst backward error and worst relative error of an eigenvalue, "
            "or the modes found of those expected. "
            "An empty cell: the method is the default's choice and was run as that.",
            figure,
            ["case", "method", "verdict", "found", "expected", "backward_error", "eigenvalue_error", "message"],
            rows,
        )
    ]


def draw_cells(axis, names, columns, by_place, height):
    axis.set_xlim(0, len(columns))
    axis.set_ylim(height, 0)
    axis.grid(False)
    for spine in axis.spines.values():
        spine.set_visible(False)
    axis.set_xticks([i + 0.5 for i in range(len(columns))], [label for _, label in columns], fontsize=9)
    axis.xaxis.tick_top()
    axis.set_yticks([j + 0.5 for j in range(len(names))], names, fontsize=9)
    axis.tick_params(length=0)
    for j, name in enumerate(names):
        for i, (method, _) in enumerate(columns):
            case = by_place.get((name, method))
            if case is None:
                continue
            colour = GOOD_COLOUR if case.good else BAD_COLOUR
            axis.add_patch(
                plt.Rectangle((i + 0.03, j + 0.06), 0.94, 0.88, facecolor=colour, alpha=0.22 if case.good else 0.4)
            )
            axis.text(i + 0.5, j + 0.52, words(case), ha="center", va="center", fontsize=9)


def words(case):
    """Tick or cross, and the number."""
    symbol = "✓" if case.good else "✗"
    error = max(case.backward_error, case.eigenvalue_error)
    if math.isnan(error):
        return f"{symbol} error"
    if case.found != case.expected:
        return f"{symbol} {case.found}/{case.expected}"
    return f"{symbol} {error:.0e}"
