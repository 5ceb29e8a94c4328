"""A sweep as a page: its Campbell diagram and root locus, and shapes where results of its points were kept."""
from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import table
from ..branches import height_at, hertz, is_unstable, lying_on, slopes
from ..sweeping import Sweep
from .page import Page, rounded
from .space import STEPS, Space


class SweepPage(Page):
    """A page of a sweep, with lines of orders, and of the shapes at some points, all that have any by default."""

    def __init__(self, sweep: Sweep, orders: Sequence[float] = (), points: Any = None) -> None:
        of_shapes, blocks = _shapes(sweep, points)
        frequency, unstable = hertz(sweep), is_unstable(sweep.eigenvalues)
        facts = {"parameter": table.name_of(sweep), "name": sweep.parameter or "value", "unit": sweep.unit, "steps": STEPS,
                 "message": f"{frequency.shape[1]} branches over {len(sweep.values)} points", "values": sweep.values.tolist(),
                 "branches": [{"re": rounded(eigenvalues.real), "hertz": rounded(f), "natural": rounded(n), "damping": rounded(d),
                               "unstable": u.tolist(), "on": under}
                              for eigenvalues, f, n, d, u, under in zip(sweep.eigenvalues.T, frequency.T, sweep.frequency_hz.T,
                                                                        sweep.damping_ratio.T, unstable.T, lying_on(frequency))],
                 "events": [{"kind": e.kind, "first": e.first, "second": e.second, "value": e.value, "hertz": _height(sweep, e)}
                            for e in sweep.events],
                 "onsets": [{"branch": o.branch, "unstable": o.unstable, "value": o.value,
                             "hertz": height_at(sweep, o.branch, o.value)} for o in sweep.onsets],
                 "orders": [{"order": order, "slope": slope} for order, slope in zip(orders, slopes(sweep, orders))],
                 **of_shapes}
        super().__init__("sweep", ("charts.js", "sweep.js"), facts, blocks)


def _shapes(sweep: Sweep, points: Any) -> tuple[dict[str, Any], dict[str, str]]:
    """Facts and blocks of the shapes. For each branch the number of its shape at each point, None where there is none; the model of
    each point, which points of the same nodes and cells share; a box around all of them."""
    size = len(sweep.values)
    shapes: list[list[int | None]] = [[None] * size for _ in range(sweep.eigenvalues.shape[1])]
    models: list[int | None] = [None] * size
    spaces: list[Space] = []
    number = 0
    for point in range(size) if points is None else [range(size)[point] for point in points]:
        result = sweep.results.get(point)
        geometry = result.geometry if result else None
        if result is None or geometry is None:
            continue
        space = next((space for space in spaces if space.shows(geometry)), None)
        if space is None:
            space = Space(geometry, len(spaces))
            spaces.append(space)
        models[point] = space.place
        for branch, mode in _modes_of_branches(sweep.eigenvalues[point], result.eigenvalues):
            space.add(number, result.shape(mode), geometry)
            shapes[branch][point] = number
            number += 1
    low, high = ([space.box[end] for space in spaces] for end in (0, 1))
    box = [np.min(low, axis=0).tolist(), np.max(high, axis=0).tolist()] if spaces else None
    return ({"shapes": shapes, "models": models, "box": box},
            {name: block for space in spaces for name, block in space.blocks.items()})


def _modes_of_branches(branches: NDArray[np.complex128], modes: NDArray[np.complex128]) -> Iterator[tuple[int, int]]:
    """Which mode of a point is which branch; those of equal eigenvalues in any order."""
    left = list(range(len(modes)))
    for branch in np.flatnonzero(~np.isnan(branches)):
        nearest = min(left, key=lambda mode: abs(modes[mode] - branches[branch]))
        left.remove(nearest)
        yield int(branch), nearest


def _height(sweep: Sweep, event: Any) -> float | None:
    if event.kind == "unsure":
        return None
    return float(np.mean([height_at(sweep, branch, event.value) for branch in (event.first, event.second)]))
