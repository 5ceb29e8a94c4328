"""Several modes of a result in one picture: a grid that fills the page, two views of those that whirl."""
from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import table
from .errors import InputError
from .marks import draw_key, draw_scale, draw_triad
from .plotting import plot_shape, view_of
from .result import Result
from .saving import save_figure

VIEW = (-60.0, 30.0)
# Where nodes enclose more of the circles that they could run through, a mode whirls.
WHIRLING = 0.2
# Of a page, and of one mode: slender ones get room for their words.
PAGE_ASPECT, LEAST_ASPECT, MOST_ASPECT = 1.5, 0.7, 2.6
PAGE_WIDTH, LEAST_WIDTH = 11.0, 3.2


def draw(result: Result, modes: list[int]) -> Any:
    """A Matplotlib figure of modes, which count from 0. One that whirls is seen along the axis about which it does as well, with the
    paths of its nodes."""
    from matplotlib import pyplot as plt

    if result.geometry is None:
        raise InputError("modes are drawn on a geometry: give solve one, as geometry=kschur.Geometry(coordinates)")
    figure = plt.figure(layout="constrained")
    cells = [_draw_mode(figure, result, mode) for mode in modes]
    drawn = [ax for cell in cells for ax in cell]
    aspect = float(np.median([np.ptp(ax.get_xlim()) / np.ptp(ax.get_ylim()) for ax in drawn]))
    # Both views of a mode stand in one row where all have two.
    together = min(map(len, cells))
    columns = together * columns_that_fill(-(-len(drawn) // together), together * aspect)
    rows = -(-len(drawn) // columns)
    grid = figure.add_gridspec(rows, columns)
    for place, ax in enumerate(drawn):
        ax.set_subplotspec(grid[divmod(place, columns)])
    width = max(PAGE_WIDTH, LEAST_WIDTH * columns)
    # A line of words above each.
    figure.set_size_inches(width, rows * (width / columns / aspect + 0.35))
    draw_key(figure, drawn)
    return figure


def columns_that_fill(count: int, aspect: float) -> int:
    """Of a grid of cells of this width by height: near the aspect of a page, with few places empty."""
    def badness(columns: int) -> float:
        rows = -(-count // columns)
        return abs(math.log(columns * aspect / rows / PAGE_ASPECT)) + 6 * (1 - count / (columns * rows))
    return min(range(1, count + 1), key=badness)


def axis_of_whirl(moved: NDArray[Any]) -> NDArray[np.float64] | None:
    """The unit vector about which nodes circle, of displacements, nodes x 3; None where they go to and fro."""
    areas = np.cross(moved.real, -moved.imag)
    about = areas.sum(axis=0)
    if 2 * np.linalg.norm(areas, axis=1).sum() <= WHIRLING * (np.abs(moved)**2).sum():
        return None
    # Where halves of it circle against each other the sum is nothing: the largest has the axis.
    if np.linalg.norm(about) < 0.1 * np.linalg.norm(areas, axis=1).sum():
        about = areas[np.linalg.norm(areas, axis=1).argmax()]
    unit: NDArray[np.float64] = about / np.linalg.norm(about)
    return unit


def _draw_mode(figure: Any, result: Result, mode: int) -> list[Any]:
    """Its views: axes that have no place yet."""
    assert result.geometry is not None
    shape = result.shape(mode)
    moved = result.geometry.displacements(shape)
    views = [(VIEW, f"mode {mode + 1}: {table.caption(result, mode)}")]
    axis = axis_of_whirl(moved)
    if axis is not None:
        views.append((_along(axis), f"mode {mode + 1} along the axis of its whirl"))
    drawn = []
    for place, (view, title) in enumerate(views):
        ax = figure.add_subplot(label=f"{mode}.{place}")
        plot_shape(result.geometry, shape, view=view, ax=ax, paths=axis is not None)
        ax.set_axis_off()
        ax.set_title(title, fontsize=9)
        _make_room(ax)
        draw_triad(ax, view_of(result.geometry.coordinates, moved, view))
        draw_scale(ax)
        drawn.append(ax)
    return drawn


def _along(axis: NDArray[np.float64]) -> tuple[float, float]:
    """Azimuth and elevation of who looks against it, from the side of the other view."""
    azimuth, elevation = np.radians(VIEW)
    seen_from = [math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation)]
    if axis @ seen_from < 0:
        axis = -axis
    return math.degrees(math.atan2(axis[1], axis[0])), math.degrees(math.asin(max(-1.0, min(1.0, axis[2]))))


def _make_room(ax: Any) -> None:
    """Below the shape for what stands there, and beside it where it is too slender."""
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    bottom -= 0.3 * max(top - bottom, (right - left) / MOST_ASPECT)
    wide, high = (max(0.0, more) / 2 for more in (LEAST_ASPECT * (top - bottom) - (right - left), (right - left) / MOST_ASPECT - (top - bottom)))
    ax.set_xlim(left - wide, right + wide)
    ax.set_ylim(bottom - high, top + high)


def main(words: list[str]) -> None:
    """What kschur-picture does: words are a result, a picture, and numbers of modes from 1."""
    path, picture, *numbers = words
    try:
        import matplotlib
        matplotlib.use("Agg")
        figure = draw(Result.read(path), [int(number) - 1 for number in numbers])
        save_figure(figure, picture, dpi=150, bbox_inches="tight", pad_inches=0.1)
    except Exception as error:
        sys.exit(f"kschur-picture: {error}")
