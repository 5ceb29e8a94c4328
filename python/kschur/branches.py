"""What is drawn of the branches of a sweep."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from . import table
from .errors import UsageError

# Revolutions per second of what a speed is given in.
_TURNS = {"rpm": 1 / 60, "1/min": 1 / 60, "Hz": 1.0, "1/s": 1.0, "rad/s": 1 / (2 * np.pi)}


def hertz(sweep: table.Branches) -> NDArray[np.float64]:
    """Damped frequencies, points x branches."""
    frequency: NDArray[np.float64] = np.abs(sweep.eigenvalues.imag) / (2 * np.pi)
    return frequency


def is_unstable(eigenvalue: NDArray[np.complex128]) -> NDArray[np.bool_]:
    """Whether it grows, beyond rounding."""
    unstable: NDArray[np.bool_] = eigenvalue.real > 1e-11 * np.abs(eigenvalue)
    return unstable


def lying_on(frequency: NDArray[np.float64]) -> list[int | None]:
    """For each branch the one before it on which it lies wherever both are, within a line's width; None where there is none."""
    width = 0.005 * (np.nanmax(frequency) - np.nanmin(frequency)) if np.any(~np.isnan(frequency)) else 0.0
    below: list[int | None] = []
    for branch, values in enumerate(frequency.T):
        apart = np.abs(frequency[:, :branch] - values[:, None])
        on = np.all(np.isnan(apart) | (apart <= width), axis=0) & np.any(~np.isnan(apart), axis=0)
        below.append(int(np.flatnonzero(on)[-1]) if on.any() else None)
    return below


def height_at(sweep: table.Branches, branch: int, value: float) -> float:
    """The damped frequency of a branch at a value between its points."""
    frequency = hertz(sweep)
    there = np.flatnonzero(~np.isnan(frequency[:, branch]))
    rising = there[np.argsort(sweep.values[there])]
    return float(np.interp(value, sweep.values[rising], frequency[rising, branch]))


def slopes(sweep: table.Branches, orders: Sequence[float]) -> list[float]:
    """Of the lines of orders: Hz for each unit of the parameter, which is a speed of rotation."""
    if len(orders) and sweep.unit not in _TURNS:
        raise UsageError(f"orders are of a speed in {', '.join(_TURNS)}, but the unit of the sweep is '{sweep.unit}': say --unit rpm")
    return [order * _TURNS[sweep.unit] for order in orders]


def numbers_of_orders(listed: str) -> list[float]:
    """Those of --orders N1,N2,..."""
    try:
        return [float(word) for word in listed.split(",")]
    except ValueError:
        raise UsageError(f"--orders wants numbers, N1,N2,..., not '{listed}'") from None
