"""What harmonic forces do."""
from __future__ import annotations

from ctypes import byref, c_int64
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._callbacks import Callbacks
from ._options import new_options
from ._problem import new_problem
from .errors import UsageError


class Response(NamedTuple):
    """frequency_hz : the frequencies.
    displacement : x at each of them, frequencies x n, or frequencies x forces x n.
    multipliers : xi of the constraints, likewise.
    """
    frequency_hz: NDArray[np.float64]
    displacement: NDArray[np.complex128]
    multipliers: NDArray[np.complex128]


def frequency_response(M: Any, K: Any, R: Any = None, Cq: Any = None, *, frequencies: Any, forces: Any,
                       symmetric: str | None = None, loss: Any = None) -> Response:
    """x of (lambda^2 M + lambda R + K) x + Cq^T xi = f, Cq x = 0 at lambda = 2 pi i frequency.

    M, K, R, Cq, symmetric, loss : as for `kschur.solve`; H adds i H to K at positive frequencies, -i H at negative ones.
    frequencies : one or more (Hz).
    forces : f, n entries, or n x forces; real or complex.

    Ctrl-C ends it before its next factorisation. Raises SingularError where a mode without damping has one of the frequencies.
    """
    problem = new_problem(M, K, R, Cq, loss, symmetric=symmetric)
    n, m = c_int64(), c_int64()
    problem.call("get_size", byref(n), byref(m))
    hz = np.ascontiguousarray(np.atleast_1d(frequencies), float)
    given = np.asarray(forces, complex)
    if hz.ndim != 1 or given.ndim not in (1, 2) or given.shape[0] != n.value:
        raise UsageError(f"the forces must be {n.value} or {n.value} x forces, and the frequencies numbers, not "
                         f"{' x '.join(map(str, given.shape))} and {' x '.join(map(str, hz.shape))}")
    f = np.ascontiguousarray(given.reshape(n.value, -1).T)
    x, xi = (np.empty((len(hz), len(f), length), complex) for length in (n.value, m.value))
    options = new_options({})
    with Callbacks(options, None, None):
        problem.call("get_response", hz.ctypes.data, len(hz), f.ctypes.data, len(f), options.address, x.ctypes.data,
                     xi.ctypes.data, None)
    return Response(hz, *((x[:, 0], xi[:, 0]) if given.ndim == 1 else (x, xi)))
