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
        shapes, blocks = _shapes(sweep, points)
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
                 "shapes": shapes}
        super().__init__("sweep", ("charts.js", "sweep.js"), facts, blocks)


def _shapes(sweep: Sweep, points: Any) -> tuple[list[list[int | None]], dict[str, str]]:
    """For each branch the number of its shape at each point, None where there is none, and the blocks of the page."""
    branches = sweep.eigenvalues.shape[1]
    shapes: list[list[int | None]] = [[None] * len(sweep.values) for _ in range(branches)]
    wanted = range(len(sweep.values)) if points is None else [range(len(sweep.values))[point] for point in points]
    there = [point for point in wanted if point in sweep.results]
    # That of the first point: the page shows one model.
    geometry = sweep.results[there[0]].geometry if there else None
    if geometry is None:
        return shapes, {}
    space, number = Space(geometry), 0
    for point in there:
        result = sweep.results[point]
        for branch, mode in _modes_of_branches(sweep.eigenvalues[point], result.eigenvalues):
            space.add(number, result.shape(mode))
            shapes[branch][point] = number
            number += 1
    return shapes, space.blocks


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
