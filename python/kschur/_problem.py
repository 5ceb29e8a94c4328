"""Matrices of SciPy and NumPy as a problem of the C library."""
from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sparse

from ._library import Handle
from .errors import InputError, UsageError
from .geometry import Geometry

NAMES = ("mass matrix M", "stiffness matrix K", "damping matrix R", "constraint Jacobian Cq", "loss matrix H")


def new_problem(M: Any, K: Any, R: Any = None, Cq: Any = None, loss: Any = None, *, geometry: Geometry | None = None,
                symmetric: str | None = None) -> Handle:
    """A problem of M, K, R, Cq and H: sparse or dense, real; the last three may be None. The loss may be a number g, of H = g K,
    or the imaginary part of a complex K. Raises InputError, UsageError."""
    problem = Handle("problem")
    fill(problem, M, K, R, Cq, loss, geometry=geometry, symmetric=symmetric)
    return problem


def fill(problem: Handle, M: Any, K: Any, R: Any = None, Cq: Any = None, loss: Any = None, *, geometry: Geometry | None = None,
         symmetric: str | None = None) -> None:
    """Sets what a problem consists of that is empty."""
    K, loss = _take_apart(K, loss)
    if symmetric is not None:
        if not isinstance(symmetric, str):
            raise UsageError(f"symmetric must be \"lower\", \"upper\", \"no\" or \"check\", not {symmetric!r}")
        problem.call("set_symmetric", symmetric.encode())
    for number, (matrix, name) in enumerate(zip((M, K, R, Cq, loss), NAMES)):
        if matrix is not None:
            _set_matrix(problem, number, matrix, name)
    if geometry is not None:
        geometry.give(problem)
    problem.call("get_size", None, None)


def _take_apart(K: Any, loss: Any) -> tuple[Any, Any]:
    """The stiffness K and the loss matrix H."""
    if not sparse.issparse(K):
        K = np.asarray(K)
    if np.issubdtype(K.dtype, np.complexfloating):
        if loss is not None:
            raise UsageError("the stiffness matrix K is complex: its imaginary part is the loss matrix H, leave out loss")
        return K.real, K.imag
    if loss is not None and not sparse.issparse(loss) and np.ndim(loss) == 0:
        return K, _factor(loss) * K
    return K, loss


def _factor(loss: Any) -> float:
    try:
        return float(loss)
    except (TypeError, ValueError):
        raise UsageError(f"the loss must be a matrix H or a number g, of H = g K, not {loss!r}") from None


def _set_matrix(problem: Handle, number: int, matrix: Any, name: str) -> None:
    rows = _compressed_rows(matrix, name)
    index = np.int64 if rows.indices.dtype == np.int64 else np.int32
    start, column, value = (np.ascontiguousarray(array, dtype) for array, dtype in
                            ((rows.indptr, index), (rows.indices, index), (rows.data, np.float64)))
    problem.call("set_csr64" if index == np.int64 else "set_csr", number, *rows.shape, len(value), 0,
                 start.ctypes.data, column.ctypes.data, value.ctypes.data)


def _compressed_rows(matrix: Any, name: str) -> sparse.csr_matrix:
    if not sparse.issparse(matrix):
        matrix = np.asarray(matrix)
        if matrix.ndim != 2:
            raise InputError(f"the {name} has {matrix.ndim} dimensions but must have 2")
    if not (np.issubdtype(matrix.dtype, np.number) or matrix.dtype == bool):
        raise InputError(f"the {name} holds {matrix.dtype} but must hold real numbers")
    if np.issubdtype(matrix.dtype, np.complexfloating):
        raise InputError(f"the {name} is complex but must be real")
    return sparse.csr_matrix(matrix)
