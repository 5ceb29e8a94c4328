"""Python functions that the C library calls back while it solves. An exception must not pass through it: the first one is
kept, the solve ends, and it is raised again behind the call."""
from __future__ import annotations

import itertools
import signal
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.sparse as sparse

from ._library import FACTORIZE, PROBLEM, PROGRESS, RELEASE, SOLVE, STOP, Handle
from ._problem import fill

_SINGULAR = 5
_FAILED = 24


class Callbacks:
    """What is called back in a solve, which stands in `with`: behind it what was raised is raised again."""

    def __init__(self, options: Handle, progress: Callable[..., Any] | None, linear_solver: Callable[..., Any] | None) -> None:
        self.raised: BaseException | None = None
        self._progress = progress
        self._handler: Any = None
        self._factors: dict[int, Any] = {}
        self._keys = itertools.count(1)
        self._kept: list[Any] = [PROGRESS(self._report), STOP(self._stop)]
        options.call("set_progress", self._kept[0], None)
        options.call("set_stop", self._kept[1], None)
        if linear_solver is None:
            return
        release = RELEASE(self._release)
        for kind, scalar in (("real", np.float64), ("complex", np.complex128)):
            functions = FACTORIZE(self._factorize_as(scalar, linear_solver)), SOLVE(self._solve_as(scalar)), release
            options.call(f"set_{kind}_solver", *functions, None)
            self._kept.extend(functions)

    def __enter__(self) -> Callbacks:
        # Python runs the handler of an interrupt where a callback begins, before its first line: an exception would be lost.
        self._handler = None
        if threading.current_thread() is threading.main_thread():
            handler = signal.getsignal(signal.SIGINT)
            if callable(handler):
                self._handler = handler
                signal.signal(signal.SIGINT, self._interrupted)
        return self

    def __exit__(self, *_: object) -> None:
        if self._handler is not None:
            signal.signal(signal.SIGINT, self._handler)
        if self.raised is not None:
            raise self.raised

    def _interrupted(self, number: int, frame: Any) -> None:
        try:
            self._handler(number, frame)
        except BaseException as error:
            self.raised = self.raised or error

    def _report(self, _context: Any, restart: int, converged: int, wanted: int, residual: float) -> int:
        if self.raised is not None:
            return 1
        try:
            return int(self._progress is not None and self._progress(restart, converged, wanted, residual) is True)
        except BaseException as error:
            self.raised = self.raised or error
            return 1

    def _stop(self, _context: Any) -> int:
        return int(self.raised is not None)

    def _factorize_as(self, scalar: Any, linear_solver: Callable[..., Any]) -> Callable[..., int]:
        def factorize(_context: Any, n: int, entries: int, row_start: Any, column: Any, value: Any, _symmetric: int,
                      factors: Any) -> int:
            try:
                values = np.ctypeslib.as_array(value, (entries * (np.dtype(scalar).itemsize // 8),)).view(scalar)
                matrix = sparse.csr_matrix((values, np.ctypeslib.as_array(column, (entries,)),
                                            np.ctypeslib.as_array(row_start, (n + 1,))), shape=(n, n)).tocsc()
                key = next(self._keys)
                self._factors[key] = linear_solver(matrix)
                factors[0] = key
                return 0
            except BaseException as error:
                return self._status_of(error)
        return factorize

    def _solve_as(self, scalar: Any) -> Callable[..., int]:
        transposed = "T" if scalar is np.float64 else "H"

        def solve(_context: Any, key: int, adjoint: int, n: int, vectors: int, x: Any) -> int:
            try:
                columns = np.ctypeslib.as_array(x, (vectors, n * (np.dtype(scalar).itemsize // 8))).view(scalar).T
                columns[...] = self._factors[key].solve(np.array(columns, order="F"), transposed if adjoint else "N")
                return 0
            except BaseException as error:
                self.raised = self.raised or error
                return _FAILED
        return solve

    def _release(self, _context: Any, key: int) -> None:
        self._factors.pop(key, None)

    def _status_of(self, error: BaseException) -> int:
        # SciPy's splu says it in words.
        if isinstance(error, np.linalg.LinAlgError) or (isinstance(error, RuntimeError) and "singular" in str(error)):
            return _SINGULAR
        self.raised = self.raised or error
        return _FAILED


class Family:
    """Matrices that depend on a parameter, as a callback of a sweep; what they raise is raised behind `callbacks`."""

    def __init__(self, callbacks: Callbacks, matrices: Callable[[float], Any], symmetric: str | None) -> None:
        self._callbacks = callbacks
        self._matrices = matrices
        self._symmetric = symmetric
        self.callback = PROBLEM(self._fill)

    def _fill(self, _context: Any, value: float, address: int) -> int:
        try:
            fill(Handle("problem", address), *self._matrices(value), symmetric=self._symmetric)
            return 0
        except BaseException as error:
            self._callbacks.raised = self._callbacks.raised or error
            return _FAILED
