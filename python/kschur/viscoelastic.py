"""Modes of structures whose materials are stiffer and lose more or less at other frequencies: tables of storage and loss moduli."""
from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy.sparse as sparse

from .errors import UsageError
from .solving import solve

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Material:
    """A complex modulus over the frequency, as measured: straight lines between the points on logarithmic axes, and what the first
    and the last point say beyond them.

    frequency_hz : where it was measured (Hz), rising, above 0.
    storage, loss : the parts of the modulus there, above 0; the loss may be 0 everywhere.
    """

    def __init__(self, frequency_hz: Any, storage: Any, loss: Any) -> None:
        columns = [np.atleast_1d(np.asarray(column, float)) for column in (frequency_hz, storage, loss)]
        self.frequency_hz, self.storage, self.loss = columns
        if len({column.shape for column in columns}) != 1 or columns[0].ndim != 1 or columns[0].size == 0:
            raise UsageError("a material wants as many storage and loss moduli as frequencies, one or more")
        if not (np.all(self.frequency_hz > 0) and np.all(np.diff(self.frequency_hz) > 0)):
            raise UsageError("the frequencies of a material must rise, from above 0")
        if not (np.all(self.storage > 0) and np.all(np.isfinite(columns[1:]))):
            raise UsageError("the storage moduli of a material must be above 0, and all moduli finite")
        if not (np.all(self.loss > 0) or np.all(self.loss == 0)):
            raise UsageError("the loss moduli of a material must be above 0, or all of them 0")

    def modulus(self, frequency_hz: float) -> complex:
        """Storage + i loss at a frequency (Hz)."""
        place = np.log(max(frequency_hz, self.frequency_hz[0]))
        known = np.log(self.frequency_hz)
        storage = np.exp(np.interp(place, known, np.log(self.storage)))
        loss = np.exp(np.interp(place, known, np.log(self.loss))) if self.loss[0] > 0 else 0.0
        return complex(storage, loss)

    def covers(self, frequency_hz: float) -> bool:
        """Whether it was measured on both sides of a frequency, or at it."""
        return bool(self.frequency_hz[0] <= frequency_hz <= self.frequency_hz[-1])


class ViscoelasticModes(NamedTuple):
    """Modes each of which has the matrices of its own frequency. Arrays have a place for each mode, lowest frequency first.

    eigenvalues : lambda (1/s), Im >= 0.
    shapes : n x modes, of unit Euclidean norm.
    frequency_hz : |Im lambda| / 2 pi (Hz), where the materials were taken.
    loss_factor : Im(-lambda^2)/Re(-lambda^2).
    backward_error : of the last solve, with the materials of the frequency before.
    change : |lambda - lambda before|/|lambda| of the last step.
    converged : whether that is below the tolerance, and the mode is not one of those before.
    covered : whether every material was measured on both sides of the frequency.
    steps : solves.
    """
    eigenvalues: NDArray[np.complex128]
    shapes: NDArray[np.complex128]
    frequency_hz: NDArray[np.float64]
    loss_factor: NDArray[np.float64]
    backward_error: NDArray[np.float64]
    change: NDArray[np.float64]
    converged: NDArray[np.bool_]
    covered: NDArray[np.bool_]
    steps: NDArray[np.int64]


def solve_viscoelastic(M: Any, K: Any, parts: Sequence[tuple[Any, Material]], R: Any = None, Cq: Any = None, modes: int = 10, *,
                       start_hz: float | None = None, tolerance: float = 1e-9, most_steps: int = 50,
                       progress: Callable[[int, int, float], Any] | None = None, **more: Any) -> ViscoelasticModes:
    """The lowest modes of K + sum of E_p(f) K_p over the parts p, the moduli E_p taken at the frequency f of each mode itself.

    Each mode is a fixed point: solved with the materials of a frequency it has another one, with those of that again another. The
    modes of the first solve are each followed so, by their shapes, until they change no more. A mode that goes round between two
    shapes or frequencies does not converge, and is said so.

    M, R, Cq : as for `kschur.solve`.
    K : the stiffness of what is elastic; None where nothing is.
    parts : stiffnesses K_p for a modulus of 1, each with its Material.
    modes : how many of the first solve are followed.
    start_hz : the frequency of the materials in the first solve; the lowest that was measured where absent.
    tolerance : |lambda - lambda before| below this part of |lambda| is converged.
    most_steps : no mode is solved for more often.
    progress : called as progress(mode, step, change).
    more : as for `kschur.solve`, but target, frequency, band and shift.
    """
    if not parts:
        raise UsageError("there are no parts with a material: kschur.solve finds the modes")
    if {"target", "frequency", "band", "shift", "loss"} & set(more):
        raise UsageError("viscoelastic modes are the lowest ones: leave out target, frequency, band, shift and loss")
    stiffnesses = [sparse.csr_matrix(stiffness) for stiffness, _ in parts]
    materials = [material for _, material in parts]
    elastic = sparse.csr_matrix(stiffnesses[0].shape) if K is None else sparse.csr_matrix(K)

    mass, damping = sparse.csr_matrix(M), None if R is None else sparse.csr_matrix(R)

    def modes_at(hertz: float, count: int, shape: Any = None) -> Any:
        moduli = [material.modulus(hertz) for material in materials]
        storage = elastic + sum(modulus.real * stiffness for modulus, stiffness in zip(moduli, stiffnesses))
        loss = sum(modulus.imag * stiffness for modulus, stiffness in zip(moduli, stiffnesses))
        target = 0 if shape is None else _functional(shape, mass, damping, storage + 1j * loss)
        return solve(M, storage, R, Cq, modes=count, target=target, loss=loss if loss.nnz else None, **more)

    if start_hz is None:
        start_hz = min(material.frequency_hz[0] for material in materials)
    first = modes_at(start_hz, modes)
    found = [_settle(first, j, modes_at, tolerance, most_steps, progress) for j in range(len(first))]
    found.sort(key=lambda mode: abs(mode[0].imag))
    settled = [mode[3] <= tolerance and not any(_same(mode, other) for other in found[:j]) for j, mode in enumerate(found)]
    values = np.array([mode[0] for mode in found], complex)
    hertz = np.abs(values.imag) / (2 * np.pi)
    square = -values**2
    changes = np.array([mode[3] for mode in found], float)
    return ViscoelasticModes(
        values, np.array([mode[1] for mode in found], complex).reshape(len(found), -1).T, hertz,
        np.divide(square.imag, square.real, out=np.full(len(found), np.nan), where=square.real > 0),
        np.array([mode[2] for mode in found], float), changes, np.array(settled, bool),
        np.array([all(material.covers(f) for material in materials) for f in hertz], bool),
        np.array([mode[4] for mode in found], int))


def _settle(first: Any, j: int, modes_at: Callable[..., Any], tolerance: float, most_steps: int,
            progress: Callable[[int, int, float], Any] | None) -> tuple[complex, Any, float, float, int]:
    """Eigenvalue, shape, backward error, change and steps of a mode, followed from the first solve on."""
    # Of the modes next to one, so many are compared with it.
    neighbours = 4
    value, shape, error, change, step = first.eigenvalues[j], first.shapes[:, j], first.backward_error[j], np.inf, 1
    while change > tolerance and step < most_steps and value != 0:
        result = modes_at(abs(value.imag) / (2 * np.pi), min(neighbours, shape.size), shape)
        if len(result) == 0:
            break
        images = [_image(shape, result, k) for k in range(len(result))]
        k = int(np.argmax([np.linalg.norm(image) for image in images]))
        change = abs(result.eigenvalues[k] - value) / abs(result.eigenvalues[k])
        value, shape, error, step = result.eigenvalues[k], images[k] / np.linalg.norm(images[k]), result.backward_error[k], step + 1
        if progress is not None:
            progress(j, step, change)
    return complex(value), shape, float(error), float(change if value != 0 else 0.0), step


def _same(mode: Any, other: Any) -> bool:
    """Whether two modes have ended as one: with one eigenvalue, and one shape but for its phase."""
    return abs(mode[0] - other[0]) <= 1e-6 * abs(mode[0]) and abs(np.vdot(mode[1], other[1])) > 0.9


def _functional(shape: Any, mass: Any, damping: Any, stiffness: Any) -> complex:
    """Rayleigh's: the root above the axis of shape^T P(lambda) shape, next to the eigenvalue of what has nearly this shape."""
    m, r, k = (0 if matrix is None else complex(shape @ (matrix @ shape)) for matrix in (mass, damping, stiffness))
    roots = np.roots([m, r, k]) if m != 0 else np.array([-k / r if r != 0 else 0])
    return complex(roots[np.argmax(roots.imag)])


def _image(shape: Any, result: Any, k: int) -> Any:
    """What a shape is of the modes that have the eigenvalue of mode k: equal ones have any shapes."""
    equal = np.abs(result.eigenvalues - result.eigenvalues[k]) <= 1e-8 * abs(result.eigenvalues[k])
    space = result.shapes[:, equal]
    return space @ np.linalg.lstsq(space, shape, rcond=None)[0]
