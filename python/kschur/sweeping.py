"""Modes over a parameter, followed from point to point."""
from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from ctypes import byref, c_int64, c_void_p
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import table
from ._callbacks import Callbacks, Family
from ._library import Handle
from ._options import new_options
from ._problem import new_problem
from ._stored import Stored
from .errors import UsageError
from .geometry import Geometry
from .result import Result

_KINDS = ("crossing", "veering", "unsure")


class Event(NamedTuple):
    """Two branches cross, veer, or it is unsure which mode is which from here on; branches count from 0, -1 is none."""
    kind: str
    first: int
    second: int
    value: float


class Onset(NamedTuple):
    """A branch is unstable from a value on, in the order of the points, or stable again. The value lies in a bracket that is
    `within` wide: a thousandth of it, or more where the mode was lost between two points."""
    branch: int
    unstable: bool
    value: float
    within: float


class Sweep(Stored):
    """Branches of modes over a parameter. Arrays are points x branches, NaN where a branch is not.

    parameter, unit : its name and unit, empty where not given.
    values : of the parameter.
    eigenvalues : lambda (1/s), Im >= 0.
    frequency_hz, damping_ratio : natural frequencies (Hz) and damping ratios.
    share : what each mode shares with the one of its branch at the point before.
    events : crossings, veerings, and where it is unsure which mode is which.
    onsets : where branches become unstable, or stable again.
    results : the modes of points, by the place of the point, where the sweep was given a geometry, or was read from a file that
        keeps them: of `save`, or of `kschur sweep --shapes`.
    """

    def __init__(self, handle: Handle, parameter: str = "", unit: str = "") -> None:
        self._handle = handle
        self.parameter, self.unit = parameter, unit
        self.results: dict[int, Result] = {}
        branches, points, events, onsets = c_int64(), c_int64(), c_int64(), c_int64()
        handle.call("get_size", byref(branches), byref(points), byref(events))
        handle.call("get_onsets", byref(onsets))

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
        branch, unstable, value, within = (numbers(f"onset_{name}", onsets.value)
                                           for name in ("branch", "unstable", "value", "within"))
        self.onsets = [Onset(int(b), bool(u), float(v), float(w)) for b, u, v, w in zip(branch, unstable, value, within)]

    def save(self, path: Any) -> None:
        """Writes an HDF5 file with the sweep and its `results`, which `kschur.load`, `kschur view --point` and `kschur-campbell`
        read. Raises FileError."""
        words = self.parameter.encode(), self.unit.encode(), str(path).encode()
        if self.results:
            kept = (self.results[point].address if point in self.results else None for point in range(len(self.values)))
            self._handle.call("write_hdf5_results", *words, (c_void_p * len(self.values))(*kept))
        else:
            self._handle.call("write_hdf5", *words)

    @classmethod
    def read(cls, path: Any) -> Sweep:
        """The sweep that `save` or `kschur sweep --output` wrote. Raises FileError or InputError."""
        handle = Handle("sweep")
        handle.call("read_hdf5", str(path).encode())
        found = cls(handle, handle.text("get_parameter"), handle.text("get_unit"))
        kept = np.empty(len(found.values))
        handle.call("get_numbers", b"kept", kept.ctypes.data, kept.size)
        for point in np.flatnonzero(kept).tolist():
            found.results[point] = Result.read_point(path, point)
        return found

    def campbell(self, **options: Any) -> Any:
        """Draws the Campbell diagram: see `kschur.diagram.campbell`."""
        from .diagram import campbell
        return campbell(self, **options)

    def view(self, orders: Sequence[float] = (), points: Any = None) -> Any:
        """A page of the Campbell diagram, with lines of orders, and the root locus, and of the shapes at the points of `results`, all
        or some: see `kschur.pages.sweep.SweepPage`. A notebook shows it; `save` writes it."""
        from .pages.sweep import SweepPage
        return SweepPage(self, orders, points)

    def __repr__(self) -> str:
        return table.sweep_as_text(self)

    def _repr_html_(self) -> str:
        return table.sweep_as_html(self)


def sweep(matrices: Callable[[float], Any] | Sequence[Any], values: Iterable[float], modes: int | None = None,
          target: complex | None = None, *, parameter: str = "", unit: str = "", symmetric: str | None = None,
          geometry: Geometry | Callable[[float], Geometry] | None = None,
          progress: Callable[[int, int, int, float], Any] | None = None, **more: Any) -> Sweep:
    """The modes nearest to a target at each value of a parameter, followed from point to point.

    matrices : called with a value; gives (M, K), (M, K, R), (M, K, R, Cq) or (M, K, R, Cq, loss), as for `kschur.solve`. It is
        called between the values as well, where it is not clear which mode is which, where two cross and where one becomes unstable. Or a sequence of
        such tuples, one for each value: then matrices between are interpolated.
    values : of the parameter, rising or falling.
    modes, target, symmetric, more : as for `kschur.solve`; with left=True modes of unsymmetric problems are followed by left vectors.
    parameter, unit : what it is called, and "rpm", "Hz", ..., for tables and diagrams.
    geometry : where the unknowns stand, or a function that says it of a value; the sweep keeps the modes of its points then, `Sweep.view`
        shows shapes, and `Sweep.save` writes them.
    progress : as for `kschur.solve`; the sweep ends with the points before where it returns True.
    """
    points = np.asarray(list(values), float)
    if len(points) < 1 or not (np.all(np.diff(points) > 0) or np.all(np.diff(points) < 0)):
        raise UsageError("the values must rise or fall, one or more")
    if not callable(matrices) and len(matrices) != len(points):
        raise UsageError(f"there are matrices for {len(matrices)} of {len(points)} values")
    options = new_options({"modes": modes, "target": target, **more})
    callbacks = Callbacks(options, progress, None)
    handle = Handle("sweep")
    results: dict[int, Result] = {}
    if callable(matrices):
        family = Family(callbacks, matrices, symmetric)
        handle.call("set_problem", family.callback, None)
    for done, value in enumerate(points, 1):
        given = matrices(float(value)) if callable(matrices) else matrices[done - 1]
        where = geometry(float(value)) if callable(geometry) else geometry
        problem = new_problem(*given, geometry=where, symmetric=symmetric)
        with callbacks:
            status = handle.status("add", float(value), problem.address, options.address)
        handle.check(status)
        if _points(handle) < done:
            break
        if geometry is not None:
            last = Handle("result")
            handle.call("get_result", last.address)
            results[done - 1] = Result(last)
    found = Sweep(handle, parameter, unit)
    found.results.update(results)
    return found


def _points(handle: Handle) -> int:
    points = c_int64()
    handle.call("get_size", None, byref(points), None)
    return points.value
