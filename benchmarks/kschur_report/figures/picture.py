"""What a figure is, and what all of them look like."""

from dataclasses import dataclass, field

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot as plt  # noqa: E402
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter  # noqa: E402

from ..methods import METHODS  # noqa: E402

WIDTH = 9.0  # inches
GOOD_COLOUR, BAD_COLOUR = "#0072B2", "#D55E00"  # blue and vermilion, told apart by all readers
LEGEND_LINE = 0.22  # inches
SMALLEST = 1e-17  # a logarithmic axis has no zero: errors below are drawn here

plt.rcParams.update(
    {
        "font.size": 10,
        "font.family": "DejaVu Sans",
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": True,
        "grid.color": "#dddddd",
        "grid.linewidth": 0.6,
        "axes.axisbelow": True,
        "axes.titlesize": 11,
        "axes.titlelocation": "left",
        "legend.frameon": False,
        "legend.fontsize": 9,
        "lines.linewidth": 1.6,
        "lines.markersize": 7,
        "svg.fonttype": "path",
        "figure.constrained_layout.use": True,
        "figure.facecolor": "white",
    }
)


@dataclass
class Picture:
    """A figure and the numbers in it."""

    name: str
    title: str
    caption: str
    figure: plt.Figure
    header: list
    rows: list = field(default_factory=list)


def panels(count, height=4.2, columns=2):
    """A figure with that many panels, and the panels."""
    columns = min(columns, count)
    rows = -(-count // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(WIDTH, height * rows), squeeze=False)
    axes = list(axes.flat)
    for empty in axes[count:]:
        empty.remove()
    return figure, axes[:count]


def style_of(method):
    """Colour, marker and label of a method, for `plot`."""
    known = METHODS[method]
    return {
        "color": known.colour,
        "marker": known.marker,
        "label": known.label,
        "markeredgecolor": "white",
        "markeredgewidth": 0.6,
    }


def in_order(methods):
    """Each method once, in the order of METHODS."""
    present = set(methods)
    return [name for name in METHODS if name in present]


def legend_below(figure, axes, columns=3):
    """One legend for all panels, under them."""
    entries = {}
    for axis in axes:
        for handle, label in zip(*axis.get_legend_handles_labels()):
            entries.setdefault(label, handle)
    if not entries:
        return
    height = (0.2 + LEGEND_LINE * -(-len(entries) // columns)) / figure.get_figheight()
    figure.get_layout_engine().set(rect=(0, height, 1, 1 - height))
    figure.legend(entries.values(), entries.keys(), loc="lower center", ncols=columns)


def tidy_logarithms(axis):
    """Ticks of the logarithmic axes: decades, and 2 and 5 as well where there are few of them."""
    for target in (axis.xaxis, axis.yaxis):
        if target.get_scale() != "log":
            continue
        low, high = target.get_view_interval()
        if high < 100 * low:
            target.set_major_locator(LogLocator(subs=(1, 2, 5)))
            target.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        else:
            target.set_major_locator(LogLocator(numticks=7))
        target.set_minor_formatter(NullFormatter())


def drawn(value):
    """A value as a logarithmic axis shows it."""
    return max(value, SMALLEST)
