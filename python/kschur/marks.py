"""What stands beside a shape in a picture: axes, a scale, the key of the colours."""
from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

_COLORS = ("#c0392b", "#1e8449", "#1f5fbf")


def draw_triad(ax: Any, seen: NDArray[np.float64]) -> None:
    """The axes x, y, z in the lower left corner; the columns of `seen` are the directions to the right, up, and towards who looks."""
    from matplotlib.lines import Line2D
    from matplotlib.offsetbox import AnchoredOffsetbox, DrawingArea
    from matplotlib.text import Text

    area = DrawingArea(52, 52)
    for axis in np.argsort(seen[:, 2]):
        u, v = seen[axis, :2]
        area.add_artist(Line2D([26, 26 + 16 * u], [26, 26 + 16 * v], color=_COLORS[axis], linewidth=1.4))
        # One that points at who looks has no room for its name.
        if math.hypot(u, v) > 0.1:
            area.add_artist(Text(26 + 22 * u, 26 + 22 * v, "xyz"[axis], color=_COLORS[axis], fontsize=8, ha="center", va="center"))
    ax.add_artist(AnchoredOffsetbox("lower left", child=area, pad=0, borderpad=0, frameon=False))


def draw_scale(ax: Any) -> None:
    """A round length in the units of the coordinates, below the middle."""
    from mpl_toolkits.axes_grid1.anchored_artists import AnchoredSizeBar

    width = np.ptp(ax.get_xlim())
    length = round_length(width / 3)
    ax.add_artist(AnchoredSizeBar(ax.transData, length, f"{length:g}", "lower center", pad=0, borderpad=0.3, sep=2, frameon=False,
                                  size_vertical=0.004 * min(width, np.ptp(ax.get_ylim())), fontproperties={"size": 8}))


def round_length(most: float) -> float:
    """The largest of 1, 2, 5, 10, ... that is not above it."""
    decade = 10.0**math.floor(math.log10(most))
    return max(step * decade for step in (1, 2, 5) if step * decade <= most * (1 + 1e-12))


def draw_key(figure: Any, axes: Sequence[Any]) -> None:
    """What the colours of shapes mean, beside all of them."""
    from matplotlib.cm import ScalarMappable

    key = figure.colorbar(ScalarMappable(cmap="viridis"), ax=axes, shrink=0.6, aspect=30, pad=0.01, ticks=[0, 0.5, 1])
    key.set_label("displacement, largest 1", fontsize=8)
    key.ax.tick_params(labelsize=8)
