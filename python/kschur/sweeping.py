"""Modes over a parameter, followed from point to point."""
from __future__ import annotations

from collections.abc import Callable, Iterable
from ctypes import byref, c_int64
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._callbacks import Callbacks
from ._library import Handle
from ._options import new_options
from ._problem import new_problem
from .errors import UsageError

_KINDS = ("crossing", "veering", "unsure")


class Event(NamedTuple):
    """Two branches cross, veer, or it is unsure which mode is which from here on; branches count from 0, -1 is none."""
    kind: str
    first: int
    second: int
    value: float


class Sweep:
    """Branches of modes over a parameter. Arrays are points x branches, NaN where a branch is not.

    values : of the parameter.
    eigenvalues : lambda (1/s), Im >= 0.
    frequency_hz, damping_ratio : natural frequencies (Hz) and damping ratios.
    share : what each mode shares with the one of its branch at the point before.
    events : crossings, veerings, and where it is unsure which mode is which.
    """

    def __init__(self, handle: Handle) -> None:
        branches, points, events = c_int64(), c_int64(), c_int64()
        handle.call("get_size", byref(branches), byref(points), byref(events))

        def numbers(name: str, *shape: int) -> NDArray[np.float64]:
            values = np.empty(shape)
            handle.call("get_numbers", name.encode(), values.ctypes.data, values.size)
            return values

        size = points.value, branches.value
        self.values: NDArray[np.float64] = numbers("values", points.value)
        self.eigenvalues: NDArray[np.complex128] = numbers("eigenvalues", *size, 2).view(np.complex128)[:, :, 0]
        self.frequency_hz: NDArray[np.float64] = numbers("frequency_hz", *size)
        self.damping_ratio: NDArray[np.float64] = numbers("damping_ratio", *size)
        self.share: NDArray[np.float64] = numbers("share", *size)
        kind, first, second, value = (numbers(f"event_{name}", events.value) for name in ("kind", "first", "second", "value"))
        self.events = [Event(_KINDS[int(k)], int(i), int(j), float(v)) for k, i, j, v in zip(kind, first, second, value)]

    def campbell(self, **options: Any) -> Any:
        """Draws the Campbell diagram: see `kschur.plotting.campbell`."""
        from .plotting import campbell
        return campbell(self, **options)


def sweep(matrices: Callable[[float], Any], values: Iterable[float], modes: int | None = None,
          target: complex | None = None, *, symmetric: str | None = None,
          progress: Callable[[int, int, int, float], Any] | None = None, **more: Any) -> Sweep:
    """The modes nearest to a target at each value of a parameter, followed from point to point.

    matrices : called with a value; gives (M, K), (M, K, R) or (M, K, R, Cq), as for `kschur.solve`.
    values : of the parameter, rising or falling.
    modes, target, symmetric, more : as for `kschur.solve`; with left=True modes of unsymmetric problems are followed by left vectors.
    progress : as for `kschur.solve`; the sweep ends with the points before where it returns True.
    """
    points = np.asarray(list(values), float)
    if len(points) < 1 or not (np.all(np.diff(points) > 0) or np.all(np.diff(points) < 0)):
        raise UsageError("the values must rise or fall, one or more")
    options = new_options({"modes": modes, "target": target, **more})
    callbacks = Callbacks(options, progress, None)
    handle = Handle("sweep")
    for done, value in enumerate(points, 1):
        problem = new_problem(*matrices(float(value)), symmetric=symmetric)
        with callbacks:
            handle.call("add", float(value), problem.address, options.address)
        if _points(handle) < done:
            break
    return Sweep(handle)


def _points(handle: Handle) -> int:
    points = c_int64()
    handle.call("get_size", None, byref(points), None)
    return points.value
