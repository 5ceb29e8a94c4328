"""From matrices to modes."""
from __future__ import annotations

import math
from collections.abc import Callable
from ctypes import byref, c_int64
from typing import Any

import numpy as np

from ._callbacks import Callbacks
from ._library import Handle, library
from ._options import new_options
from ._problem import new_problem
from .errors import UsageError
from .geometry import Geometry
from .result import Result


def solve(M: Any, K: Any, R: Any = None, Cq: Any = None, modes: int | None = None, target: complex | None = None, *,
          frequency: float | None = None, band: tuple[float, float] | None = None, shift: complex | None = None,
          left: bool = False, certify: bool | str = False, properties: bool = False, directions: Any = None, geometry: Geometry | None = None,
          symmetric: str | None = None, progress: Callable[[int, int, int, float], Any] | None = None,
          linear_solver: Callable[..., Any] | None = None, loss: Any = None, **more: Any) -> Result:
    """The modes of (lambda^2 M + lambda R + K) phi + Cq^T xi = 0, Cq phi = 0 nearest to a target, or all of a band.

    M, K, R : real n x n matrices, sparse (SciPy, any format) or dense: mass, stiffness, damping (none where absent).
    Cq : real m x n constraint Jacobian (none where absent).
    modes : how many; a complex-conjugate pair is one, multiplicities count (10).
    target : the modes nearest to this lambda (1/s) are wanted (0: the lowest).
    frequency : the same in Hz: target = 2 pi i frequency.
    band : two frequencies (Hz): all modes between them. Excludes the three above and `shift`.
    shift : where to factor (1/s); chosen at the scale of the modes where absent.
    left : whether to compute left vectors and condition numbers as well.
    certify : whether to count eigenvalues where nothing else proves that no mode is missing; "off": not even where one
        factorisation is enough.
    properties : whether to compute generalised masses, modal a and b, participation factors and effective masses as well.
    directions : motions of all unknowns, n x directions, for participation and effective masses; by default the rigid
        motions of the geometry, if there is one: see `Result.directions`.
    geometry : where the unknowns stand in space, for `Result.plot_shape` and files.
    loss : the real n x n loss matrix H of structural damping: the modes are those above the real axis with K + i H in the place
        of K. A number g stands for H = g K. A complex K is the same: its imaginary part is H.
    symmetric : "lower" or "upper" where M, R and K hold this half of symmetric matrices; "no" where they are meant as they are.
        Absent, "check": the same, but an InputError where a matrix looks like a half.
    progress : called as progress(restart, converged, wanted, residual); the solve ends with what has converged where it
        returns True. An exception in it ends the solve and is raised here.
    linear_solver : called as linear_solver(A) with a matrix in CSC to factor, in the place of the library's solvers;
        what it returns has solve(b, trans) with trans "N", "T" or "H": scipy.sparse.linalg.splu is one. It raises
        numpy.linalg.LinAlgError where A is singular.
    more : method, arpack, formulation, inner, constraint_scaling, normalisation ("length", "mass", "displacement"), presolve,
        subspace, block, tolerance, max_restarts, threads, seed, memory, checkpoint,
        resume: as the options of the program, with _ for -.

    Fewer modes than asked for are no exception: see `Result.reason`. What is wrong is raised as one of
    `kschur.errors`: UsageError for options, InputError for matrices, and so on.
    """
    if frequency is not None:
        if target is not None:
            raise UsageError("target and frequency exclude each other")
        if not frequency >= 0:
            raise UsageError(f"the frequency must not be {frequency}")
        target = 2j * math.pi * frequency
    if band is not None and not (modes is None and target is None and shift is None):
        raise UsageError("band excludes modes, target, frequency and shift")
    problem = new_problem(M, K, R, Cq, loss, geometry=geometry, symmetric=symmetric)
    options = new_options({"modes": modes, "target": target, "shift": shift, "left": left, "certify": certify or None, **more})
    directions = _columns(directions, problem)
    result = Handle("result")
    with Callbacks(options, progress, linear_solver):
        if band is None:
            status = library.kschur_solve(problem.address, options.address, result.address)
        else:
            status = library.kschur_solve_band(problem.address, *_two_frequencies(band), options.address, result.address)
    result.check(status)
    found = Result(result)
    if properties:
        columns = np.zeros((found.unknowns, 0)) if directions is None else np.asfortranarray(directions)
        result.call("find_properties", problem.address, columns.ctypes.data, columns.shape[1])
    return found


def _columns(directions: Any, problem: Handle) -> Any:
    if directions is None:
        return None
    n = c_int64()
    problem.call("get_size", byref(n), None)
    columns = np.asarray(directions, float)
    if columns.ndim == 1:
        columns = columns[:, None]
    if columns.ndim != 2 or columns.shape[0] != n.value:
        raise UsageError(f"the directions must be {n.value} x directions, not {' x '.join(map(str, columns.shape))}")
    return columns


def _two_frequencies(band: Any) -> tuple[float, float]:
    try:
        first, last = map(float, band)
    except (TypeError, ValueError):
        raise UsageError(f"the band must be two frequencies in Hz, not {band!r}") from None
    return first, last
