"""Campbell diagrams and root loci of sweeps, by Matplotlib."""
from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import table
from .branches import height_at, hertz, is_unstable, lying_on, numbers_of_orders, slopes
from .saving import check_ending, save_figure

# Red is for what is unstable, gray for orders.
_COLORS = ("tab:blue", "tab:orange", "tab:green", "tab:purple", "tab:brown", "tab:pink", "tab:olive", "tab:cyan")
_STYLES = ("-", "--", ":", "-.")
# One within the other, where branches lie on each other.
_MARKERS = (".", "o", "s", "D", "v", "^")
_ROWS = 20


def campbell(sweep: table.Branches, *, parameter: str = "", orders: Sequence[float] = (), first: int = 0,
             ax: Any = None) -> Any:
    """Draws damped frequencies of all branches; returns the axes. Unstable points are red crosses, onsets red triangles with their
    value, and green ones where a branch is stable again; crossings squares, veerings diamonds; dotted lines stand where it is unsure which mode is which. Of branches that lie on
    each other each has a larger marker than the one below it, and the legend says so.

    parameter : what to call it; by default its name and unit in the sweep.
    orders : multiples of the frequency of rotation that are drawn as lines, where the unit of the sweep is rpm, 1/min, Hz, 1/s or rad/s.
    first : the number of the first branch.
    ax : axes to draw on; by default new ones.
    """
    from matplotlib import pyplot as plt

    ax = ax or plt.figure().add_subplot()
    frequency = hertz(sweep)
    below = lying_on(frequency)
    for branch, values in enumerate(frequency.T):
        under = below[branch]
        name = str(first + branch) if under is None else f"{first + branch} (on {first + under})"
        ax.plot(sweep.values, values, label=name, **_style(branch, below))
        unstable = is_unstable(sweep.eigenvalues[:, branch])
        ax.plot(sweep.values[unstable], values[unstable], "x", color="red", zorder=4)
    for event in sweep.events:
        if event.kind == "unsure":
            ax.axvline(event.value, color="gray", linestyle=":")
            continue
        height = np.mean([height_at(sweep, branch, event.value) for branch in (event.first, event.second)])
        ax.plot(event.value, height, "s" if event.kind == "crossing" else "D", markersize=9, markerfacecolor="none", color="black")
    for onset in sweep.onsets:
        height = height_at(sweep, onset.branch, onset.value)
        color, marker = ("red", "^") if onset.unstable else ("green", "v")
        ax.plot(onset.value, height, marker, color=color, markersize=8, zorder=5)
        ax.annotate(f"{onset.value:.5g}", (onset.value, height), xytext=(0, 7), textcoords="offset points", color=color,
                    fontsize="small", ha="center")
    _draw_orders(ax, sweep, frequency, orders)
    ax.set(xlabel=parameter or table.name_of(sweep), ylabel="damped frequency (Hz)")
    _legend(ax, frequency.shape[1])
    return ax


def roots(sweep: table.Branches, *, ax: Any = None) -> Any:
    """Draws the roots of all branches over the complex plane, circles where the sweep begins; the unstable side is red."""
    from matplotlib import pyplot as plt

    ax = ax or plt.figure().add_subplot()
    frequency = hertz(sweep)
    below: list[int | None] = [None] * frequency.shape[1]
    for branch, values in enumerate(frequency.T):
        growth = sweep.eigenvalues[:, branch].real
        ax.plot(growth, values, **_style(branch, below))
        start = np.flatnonzero(~np.isnan(values))[:1]
        ax.plot(growth[start], values[start], "o", color=_style(branch, below)["color"])
    left, right = ax.get_xlim()
    right = max(right, 0.02 * (right - left))
    ax.axvspan(0, right, color="red", alpha=0.1)
    ax.set_xlim(left, right)
    ax.axvline(0, color="black", linewidth=0.8)
    ax.set(xlabel="real part (1/s); the unstable side is red", ylabel="damped frequency (Hz)")
    return ax


def draw(sweep: table.Branches, orders: Sequence[float] = ()) -> Any:
    """A figure of both, with branches from 1, as the program counts them."""
    from matplotlib import pyplot as plt

    columns = _columns(sweep.eigenvalues.shape[1])
    figure, axes = plt.subplots(1, 2, figsize=(11 + columns, 5), layout="constrained")
    campbell(sweep, orders=orders, first=1, ax=axes[0]).set_title("squares: crossings, diamonds: veerings, red: unstable", fontsize="medium")
    unit = f" {sweep.unit}" if sweep.unit else ""
    roots(sweep, ax=axes[1]).set_title(f"roots, circles at {sweep.parameter} {sweep.values[0]:g}{unit}", fontsize="medium")
    return figure


def main(words: list[str], program: Path, usage: str) -> None:
    """What kschur-campbell does: words are a sweep, or those of one, and a picture, and --orders where that is wanted."""
    try:
        words, orders = _take_orders(words)
        if len(words) < 2 or words[-1].startswith("-"):
            sys.exit(usage)
        import matplotlib
        matplotlib.use("Agg")
        *words, picture = words
        check_ending(picture)
        if len(words) == 1:
            _draw_file(words[0], picture, orders)
            return
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "sweep.h5")
            run = subprocess.run([program, "sweep", *words, "--output", path])
            if run.returncode in (0, 3):
                _draw_file(path, picture, orders)
        sys.exit(run.returncode)
    except Exception as error:
        sys.exit(f"kschur-campbell: {error}")


def _draw_file(path: str, picture: str, orders: list[float]) -> None:
    from .sweeping import Sweep
    figure = draw(Sweep.read(path), orders)
    save_figure(figure, picture, dpi=120)


def _take_orders(words: list[str]) -> tuple[list[str], list[float]]:
    if "--orders" not in words:
        return words, []
    place = words.index("--orders")
    return words[:place] + words[place + 2:], numbers_of_orders("".join(words[place + 1:place + 2]))


def _style(branch: int, below: Sequence[int | None]) -> dict[str, Any]:
    level, under = 0, below[branch]
    while under is not None:
        level, under = level + 1, below[under]
    return {"color": _COLORS[branch % len(_COLORS)], "linestyle": _STYLES[branch // len(_COLORS) % len(_STYLES)], "linewidth": 1,
            "marker": _MARKERS[min(level, len(_MARKERS) - 1)], "markersize": 5 + 2 * level, "markerfacecolor": None if level == 0 else "none"}


def _draw_orders(ax: Any, sweep: table.Branches, frequency: NDArray[np.float64], orders: Sequence[float]) -> None:
    if not len(orders):
        return
    top = 1.05 * np.nanmax(frequency)
    first, last = min(sweep.values.min(), 0.0), sweep.values.max()
    for order, slope in zip(orders, slopes(sweep, orders)):
        end = min(last, top / slope) if slope > 0 else last
        ax.plot([first, end], [slope * first, slope * end], color="gray", linestyle="--", linewidth=0.8, zorder=1)
        # Within the frame, on the line.
        ax.annotate(f"{order:g}P", (end, slope * end), xytext=(-6, -6), textcoords="offset points", color="gray", fontsize="small",
                    ha="center", va="center", bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5}, zorder=1.5)
    ax.set_ylim(0.0, top)


def _columns(branches: int) -> int:
    return -(-branches // _ROWS)


def _legend(ax: Any, branches: int) -> None:
    ax.legend(title="branch", fontsize="small", loc="upper left", bbox_to_anchor=(1.01, 1), borderaxespad=0,
              ncol=_columns(branches))
