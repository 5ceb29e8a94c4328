"""Modes, how good they are, how they were found."""
from __future__ import annotations

from ctypes import c_double, c_int, c_int64, c_void_p
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from . import table
from ._library import Handle, name_of
from .errors import InputError
from .geometry import Geometry

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Result:
    """The modes of a problem, nearest to the target first. Arrays have a place for each mode; modes count from 0.

    eigenvalues : lambda (1/s), Im >= 0: a conjugate pair stands once.
    frequency_hz, damped_frequency_hz : |lambda| / 2 pi and |Im lambda| / 2 pi (Hz).
    damping_ratio : NaN where undefined, as for a rigid-body mode.
    kind : "rigid", "undamped", "underdamped", "overdamped", "unstable" or "real".
    backward_error : normwise backward errors.
    error : bounds of the errors of the eigenvalues (1/s); NaN where not known.
    reason : "converged", "max_restarts", "fewer_modes", "cancelled", "inaccurate" or "interrupted".
    certified : True where a count of eigenvalues proves that no mode is missing, False where it differs, else None.
    missing : eigenvalues that are missing; None where not known.
    notes : sentences that a user must know beyond the reason.
    method, formulation, decision, inner : how the modes were found, and why so.
    target, shift : those that were used (1/s).
    counts, seconds : what it took.
    geometry : where the unknowns stand; None where not given.
    """

    def __init__(self, handle: Handle, geometry: Geometry | None = None) -> None:
        self._handle = handle
        self.geometry = geometry
        found, self.modes_asked = handle.numbers("get_modes", c_int64, c_int64)
        self.unknowns, self.constraints = handle.numbers("get_size", c_int64, c_int64)
        self._modes = found
        self.eigenvalues: NDArray[np.complex128] = self._array("eigenvalues", np.complex128)
        self.frequency_hz: NDArray[np.float64] = self._array("frequencies_hz")
        self.damped_frequency_hz: NDArray[np.float64] = self._array("damped_frequencies_hz")
        self.damping_ratio: NDArray[np.float64] = self._array("damping_ratios")
        self.backward_error: NDArray[np.float64] = self._array("backward_errors")
        self.error: NDArray[np.float64] = self._array("errors")
        self.kind: list[str] = [name_of("kind", kind) for kind in self._array("kinds", np.intc)]
        self.reason: str = name_of("reason", handle.numbers("get_reason", c_int)[0])
        self.certified: bool | None = (None, True, False)[handle.numbers("get_certified", c_int)[0]]
        missing = handle.numbers("get_missing", c_int64)[0]
        self.missing: int | None = None if missing < 0 else missing
        notes = handle.numbers("get_note_count", c_int64)[0]
        self.notes: list[str] = [handle.text("get_note", c_int64(k)) for k in range(notes)]
        self.method: str = handle.text("get_method")
        self.formulation: str = handle.text("get_formulation")
        self.decision: str = handle.text("get_decision")
        self.inner: str = handle.text("get_inner")
        self.target = complex(*handle.numbers("get_target", c_double, c_double))
        self.shift = complex(*handle.numbers("get_shift", c_double, c_double))
        self.redundant_constraints: int = handle.numbers("get_redundant_constraints", c_int64)[0]
        self.counts: dict[str, int] = dict(zip(("operator_applications", "restarts", "factorizations"),
                                               handle.numbers("get_counts", *[c_int64] * 3)))
        self.seconds: dict[str, float] = dict(zip(("total", "analyze", "factorize", "solve", "orthogonalize"),
                                                  handle.numbers("get_seconds", *[c_double] * 5)))

    def __len__(self) -> int:
        return self._modes

    @property
    def converged(self) -> bool:
        """Whether all that was asked for is here."""
        return self.reason == "converged" and len(self) >= self.modes_asked

    @property
    def message(self) -> str:
        """In a sentence how the solve ended."""
        proof = {None: "", True: ", certified: no mode is missing", False: ", but a count says that modes are missing"}
        return f"{len(self)} of {self.modes_asked} modes, {self.reason.replace('_', ' ')}{proof[self.certified]}"

    @cached_property
    def shapes(self) -> NDArray[Any]:
        """Mode shapes phi, n x modes, of unit Euclidean norm, the largest entry real and positive; of real numbers where
        all are real."""
        return self._columns("eigenvectors", self.unknowns)

    @cached_property
    def multipliers(self) -> NDArray[Any]:
        """Lagrange multipliers xi of the constraints, m x modes."""
        return self._columns("multipliers", self.constraints)

    @cached_property
    def left_shapes(self) -> NDArray[Any]:
        """Left vectors psi, psi^* P(lambda) + eta^* Cq = 0, n x modes; NaN where none was found. Needs `left=True`."""
        return self._columns("left_eigenvectors", self.unknowns)

    @cached_property
    def left_multipliers(self) -> NDArray[Any]:
        """Multipliers eta of the left vectors, m x modes. Needs `left=True`."""
        return self._columns("left_multipliers", self.constraints)

    @cached_property
    def condition_number(self) -> NDArray[np.float64]:
        """Condition numbers of the eigenvalues; infinite for a zero and for a defective one. Needs `left=True`."""
        return self._array("condition_numbers")

    def save(self, path: Any) -> None:
        """Writes an HDF5 file, which `kschur.load` and `kschur info` read. Raises FileError."""
        self._handle.call("write_hdf5", str(path).encode())

    def plot_shape(self, mode: int = 0, **options: Any) -> Any:
        """Draws a mode on the geometry: see `kschur.plotting.plot_shape`."""
        from .plotting import plot_shape
        if self.geometry is None:
            raise InputError("a shape is drawn on a geometry: give solve one, as geometry=kschur.Geometry(coordinates)")
        return plot_shape(self.geometry, self.shapes[:, mode], title=table.caption(self, mode), **options)

    def __repr__(self) -> str:
        return table.as_text(self)

    def _repr_html_(self) -> str:
        return table.as_html(self)

    def _array(self, name: str, dtype: Any = np.float64, length: int | None = None) -> NDArray[Any]:
        values = np.empty(self._modes if length is None else length, dtype)
        doubles = values.size * (2 if np.issubdtype(dtype, np.complexfloating) else 1)
        self._handle.call(f"get_{name}", c_void_p(values.ctypes.data), c_int64(doubles))
        return values

    def _columns(self, name: str, rows: int) -> NDArray[Any]:
        columns = self._array(name, np.complex128, rows * self._modes).reshape(self._modes, rows).T
        return columns if columns.imag.any() else columns.real.copy(order="F")
