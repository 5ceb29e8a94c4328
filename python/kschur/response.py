"""What harmonic forces do."""
from __future__ import annotations

from ctypes import byref, c_int64
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sparse
from numpy.typing import NDArray

from ._callbacks import Callbacks
from ._library import Handle
from ._options import new_options
from ._problem import new_problem
from .errors import UsageError
from .geometry import Geometry


class Response(NamedTuple):
    """frequency_hz : the frequencies.
    displacement : x at each of them, frequencies x n, or frequencies x forces x n.
    multipliers : xi of the constraints, likewise.
    """
    frequency_hz: NDArray[np.float64]
    displacement: NDArray[np.complex128]
    multipliers: NDArray[np.complex128]

    def view(self, unknowns: Any, geometry: Geometry | None = None) -> Any:
        """A page of Bode and Nyquist plots of some unknowns, counted from 0, of one force, and of the deformed structure at each frequency
        where all unknowns were kept and a geometry is given: see `kschur.pages.response.ResponsePage`. A notebook shows it; `save`
        writes it."""
        from .pages.response import ResponsePage
        if self.displacement.ndim != 2:
            raise UsageError("a page shows the response to one force: give Response one, as displacement[:, force]")
        return ResponsePage(self.frequency_hz, self.displacement, np.atleast_1d(unknowns).tolist(),
                            None if geometry is None else geometry.of_unknowns(self.displacement.shape[1]))


def frequency_response(M: Any, K: Any, R: Any = None, Cq: Any = None, *, frequencies: Any, forces: Any,
                       symmetric: str | None = None, loss: Any = None, unknowns: Any = None, threads: int | None = None) -> Response:
    """x of (lambda^2 M + lambda R + K) x + Cq^T xi = f, Cq x = 0 at lambda = 2 pi i frequency.

    M, K, R, Cq, symmetric, loss : as for `kschur.solve`; H adds i H to K at positive frequencies, -i H at negative ones. Each of the
        matrices may depend on the frequency: a function of it (Hz), or a list with one for each frequency.
    frequencies : one or more (Hz).
    forces : f, n entries, or n x forces; real or complex.
    unknowns : those whose displacement is kept, by default all n.
    threads : as for `kschur.solve`.

    Ctrl-C ends it before its next factorisation. Raises SingularError where a mode without damping has one of the frequencies.
    """
    hz = np.ascontiguousarray(np.atleast_1d(frequencies), float)
    if hz.ndim != 1:
        raise UsageError(f"the frequencies must be numbers, not {' x '.join(map(str, hz.shape))}")
    given = np.asarray(forces, complex)
    options = new_options({"threads": threads})
    matrices = {"M": M, "K": K, "R": R, "Cq": Cq, "loss": loss}
    for name, matrix in matrices.items():
        if _varies(matrix) and not callable(matrix) and len(matrix) != len(hz):
            raise UsageError(f"there are {len(matrix)} of {name} for {len(hz)} frequencies")
    # With one pattern and one analysis, where the matrices are the same at all frequencies.
    parts = [hz] if not any(map(_varies, matrices.values())) else list(hz[:, None])
    found = []
    for first, part in enumerate(parts):
        problem = new_problem(*(_at(matrix, first, part[0]) for matrix in matrices.values()), symmetric=symmetric)
        found.append(_respond(problem, part, given, options, unknowns))
    x, xi = (np.concatenate(arrays) for arrays in zip(*found))
    return Response(hz, *((x[:, 0], xi[:, 0]) if given.ndim == 1 else (x, xi)))


def _is_list_of_matrices(matrix: Any) -> bool:
    return all(sparse.issparse(entry) or np.ndim(entry) == 2 for entry in matrix)


def _varies(matrix: Any) -> bool:
    return callable(matrix) or isinstance(matrix, (list, tuple)) and _is_list_of_matrices(matrix) \
        or isinstance(matrix, np.ndarray) and matrix.ndim == 3


def _at(matrix: Any, place: int, hz: float) -> Any:
    if callable(matrix):
        return matrix(float(hz))
    return matrix[place] if _varies(matrix) else matrix


def _respond(problem: Handle, hz: NDArray[np.float64], given: NDArray[np.complex128], options: Handle, unknowns: Any) -> Any:
    n, m = c_int64(), c_int64()
    problem.call("get_size", byref(n), byref(m))
    if given.ndim not in (1, 2) or given.shape[0] != n.value:
        raise UsageError(f"the forces must be {n.value} or {n.value} x forces, not {' x '.join(map(str, given.shape))}")
    f = np.ascontiguousarray(given.reshape(n.value, -1).T)
    x, xi = (np.empty((len(hz), len(f), length), complex) for length in (n.value, m.value))
    with Callbacks(options, None, None):
        problem.call("get_response", hz.ctypes.data, len(hz), f.ctypes.data, len(f), options.address, x.ctypes.data,
                     xi.ctypes.data, None)
    return (x if unknowns is None else x[:, :, np.asarray(unknowns)]), xi
