"""Pictures of mode shapes, by Matplotlib."""
from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .geometry import Geometry

MOST_PATHS = 40


def plot_shape(geometry: Geometry, shape: NDArray[Any], *, scale: float | None = None, phase: float = 0.0,
               view: tuple[float, float] | None = None, paths: bool = False, title: str = "", ax: Any = None) -> Any:
    """Draws a shape of n unknowns, and in gray the structure at rest; returns the axes.

    scale : what the shape is multiplied by; by default the largest displacement is a tenth of the structure.
    phase : angle of the oscillation in radians; 0 is the real part of the shape.
    view : azimuth and elevation in degrees, from which what is not flat is drawn in parallel on plane axes; by default in space.
    paths : whether the paths are drawn that nodes run through in a period.
    ax : axes to draw on, with projection="3d" for what is drawn in space; by default new ones.
    """
    from matplotlib import colormaps
    from matplotlib import pyplot as plt
    from matplotlib.collections import LineCollection, PolyCollection
    from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

    rest = geometry.coordinates
    complex_moved = geometry.displacements(shape) * np.exp(1j * phase)
    moved = complex_moved.real
    amplitude = np.linalg.norm(moved, axis=1)
    if scale is None:
        scale = float(0.1 * np.linalg.norm(np.ptp(rest, axis=0)) / (amplitude.max() or 1.0)) or 1.0
    axes = _axes_of(rest, complex_moved)
    depth = None
    if view is not None and len(axes) == 3:
        seen = _seen_from(*view)
        rest, complex_moved, axes = rest @ seen, complex_moved @ seen, [0, 1]
        moved = complex_moved.real
        depth = rest[:, 2] + scale * moved[:, 2]
    now = rest + scale * moved
    lines, polygons = (LineCollection, PolyCollection) if len(axes) == 2 else (Line3DCollection, Poly3DCollection)
    if ax is None:
        ax = plt.figure().add_subplot(projection=None if len(axes) == 2 else "3d")
    # The order of drawing: at rest, then moved.
    ax.computed_zorder = False
    ax.add_collection(lines(rest[:, axes][geometry.lines()], colors="gray", linewidths=0.5, alpha=0.4, zorder=1))
    for loops in geometry.faces():
        if depth is not None:
            loops = loops[np.argsort(depth[loops].mean(axis=1))]
        colors = colormaps["viridis"](amplitude[loops].mean(axis=1) / (amplitude.max() or 1.0))
        corners = now[:, axes][loops]
        ax.add_collection(lines(corners, colors=colors, linewidths=1.5, zorder=2) if loops.shape[1] == 2
                          else polygons(corners, facecolors=colors, edgecolors="black", linewidths=0.1, zorder=2))
    if not geometry.faces():
        ax.scatter(*now[:, axes].T)
    drawn = [rest, now]
    if paths:
        turns = np.exp(1j * np.linspace(0, 2 * np.pi, 49))[:, None]
        chosen = np.unique(np.linspace(0, len(rest) - 1, MOST_PATHS).round().astype(int))
        runs = [rest[node] + scale * (turns * complex_moved[node]).real for node in chosen]
        ax.add_collection(lines([run[:, axes] for run in runs], colors="gray", linewidths=0.6, alpha=0.7, zorder=1.5))
        drawn.extend(runs)
    _frame(ax, np.vstack(drawn)[:, axes], ["xyz"[axis] if depth is None else "" for axis in axes])
    ax.set_title(title)
    return ax


def view_of(rest: NDArray[Any], moved: NDArray[Any], view: tuple[float, float]) -> NDArray[np.float64]:
    """Directions to the right, up, and towards who looks, as columns, of what `plot_shape` draws."""
    axes = _axes_of(rest, moved)
    if len(axes) == 3:
        return _seen_from(*view)
    return np.eye(3)[:, [*axes, 3 - sum(axes)]]


def _axes_of(rest: NDArray[Any], moved: NDArray[Any]) -> list[int]:
    """Those of a plane where nothing stands or moves outside it, else all three."""
    for left_out in (2, 1, 0):
        if not (np.ptp(rest[:, left_out]) or moved[:, left_out].any()):
            return [axis for axis in range(3) if axis != left_out]
    return [0, 1, 2]


def _seen_from(azimuth: float, elevation: float) -> NDArray[Any]:
    """Columns are the directions to the right, up, and towards who looks."""
    a, e = np.radians([azimuth, elevation])
    return np.array([[-np.sin(a), -np.sin(e) * np.cos(a), np.cos(e) * np.cos(a)],
                     [np.cos(a), -np.sin(e) * np.sin(a), np.cos(e) * np.sin(a)],
                     [0.0, np.cos(e), np.sin(e)]])


def _frame(ax: Any, points: NDArray[Any], names: list[str]) -> None:
    """Limits about all points, of equal units on all axes, and their names, none where it is seen from a direction."""
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.05 * (high - low).max() or 1.0
    for place, name, first, last in zip("xyz", names, low - margin, high + margin):
        getattr(ax, f"set_{place}lim")(first, last)
        getattr(ax, f"set_{place}label")(name)
    if len(names) == 3:
        ax.set_box_aspect(high - low + 2 * margin)
    else:
        ax.set_aspect("equal")
