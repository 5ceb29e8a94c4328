"""Modes, how good they are, how they were found."""
from __future__ import annotations

import ctypes
from ctypes import c_int
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from . import table
from ._library import Handle, Part, name_of
from ._stored import Stored
from .errors import InputError
from .geometry import Geometry

if TYPE_CHECKING:
    from numpy.typing import NDArray

_COUNTS = ("operator_applications", "restarts", "factorizations", "wanted_after")
_SECONDS = ("total", "analyze", "factorize", "solve", "orthogonalize", "examine", "place", "iterate", "recover", "judge", "left")


class Result(Stored):
    """The modes of a problem, nearest to the target first, of a band by frequency. Arrays have a place for each mode, from 0 on.

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

    def __init__(self, handle: Handle) -> None:
        self._handle = handle
        array, number = handle.array, handle.number
        self.unknowns, self.constraints = number("n"), number("m")
        self._modes, self.modes_asked = number("modes"), number("modes_asked")
        self.eigenvalues: NDArray[np.complex128] = array("eigenvalues").view(np.complex128)
        self.frequency_hz: NDArray[np.float64] = array("frequency_hz")
        self.damped_frequency_hz: NDArray[np.float64] = array("damped_frequency_hz")
        self.damping_ratio: NDArray[np.float64] = array("damping_ratio")
        self.backward_error: NDArray[np.float64] = array("backward_error")
        self.error: NDArray[np.float64] = array("error")
        self._has_losses = len(array("loss_factor")) > 0
        self.kind: list[str] = [name_of("kind", kind) for kind in array("kind")]
        self.reason: str = self._text("reason")
        self.certified: bool | None = (None, True, False)[number("certified")]
        self.missing: int | None = number("missing") if number("missing") >= 0 else None
        self.notes: list[str] = self._text("notes").splitlines()
        self.method: str = self._text("method")
        self.formulation: str = self._text("formulation")
        self.decision: str = self._text("decision")
        self.inner: str = self._text("inner")
        self.target, self.shift = complex(*array("target")), complex(*array("shift"))
        self.redundant_constraints: int = number("redundant_constraints")
        self.counts: dict[str, int] = {name: number(name) for name in _COUNTS}
        self.seconds: dict[str, float] = {name: float(array(f"seconds_{name}")[0]) for name in _SECONDS}
        self.geometry: Geometry | None = Geometry.of_result(handle)

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

    @property
    def loss_factor(self) -> NDArray[np.float64]:
        """Im(-lambda^2)/Re(-lambda^2): eta of lambda^2 = -omega^2 (1 + i eta), twice a small damping ratio; NaN where the
        real part is not positive."""
        square = -self.eigenvalues**2
        return np.divide(square.imag, square.real, out=np.full(len(self), np.nan), where=square.real > 0)

    @property
    def has_losses(self) -> bool:
        """Whether the problem had a loss matrix."""
        return self._has_losses

    @cached_property
    def shapes(self) -> NDArray[Any]:
        """Mode shapes phi, n x modes, of unit Euclidean norm, the largest entry real and positive; of real numbers where
        all are real."""
        return self._columns("eigenvectors")

    def shape(self, mode: int, unknowns: Any = None) -> NDArray[Any]:
        """One of them, or some of its unknowns, without a copy of the others."""
        return self._columns("eigenvectors", range(self._modes)[mode], 1, unknowns)[:, 0]

    @cached_property
    def multipliers(self) -> NDArray[Any]:
        """Lagrange multipliers xi of the constraints, m x modes."""
        return self._columns("multipliers")

    @cached_property
    def left_shapes(self) -> NDArray[Any]:
        """Left vectors psi, psi^* P(lambda) + eta^* Cq = 0, n x modes; NaN where none was found. Needs `left=True`."""
        return self._columns("left_eigenvectors")

    @cached_property
    def left_multipliers(self) -> NDArray[Any]:
        """Multipliers eta of the left vectors, m x modes. Needs `left=True`."""
        return self._columns("left_multipliers")

    @cached_property
    def condition_number(self) -> NDArray[np.float64]:
        """Condition numbers of the eigenvalues; infinite for a zero and for a defective one. Needs `left=True`."""
        return self._handle.array("condition_number")

    @cached_property
    def generalised_mass(self) -> NDArray[np.float64]:
        """phi^* M phi. This and the following need `properties=True`."""
        return self._handle.array("generalised_mass")

    @cached_property
    def generalised_damping(self) -> NDArray[np.float64]:
        """phi^* R phi."""
        return self._handle.array("generalised_damping")

    @cached_property
    def generalised_stiffness(self) -> NDArray[np.float64]:
        """phi^* K phi."""
        return self._handle.array("generalised_stiffness")

    @cached_property
    def modal_a(self) -> NDArray[np.complex128]:
        """psi^* (2 lambda M + R) phi; modal b is -lambda a."""
        return self._handle.array("modal_a").view(np.complex128)

    @cached_property
    def directions(self) -> list[str]:
        """Their names: those of a geometry are x, y, z and rx, ry, rz, the rotations about the axes through the origin."""
        return self._text("directions").split()

    @cached_property
    def participation_factors(self) -> NDArray[np.complex128]:
        """modes x directions: a direction that the constraints allow is the sum of Re(factor phi) over all modes there are."""
        return self._handle.array("participation_factors").view(np.complex128).reshape(-1, self._modes).T

    @cached_property
    def effective_mass(self) -> NDArray[np.float64]:
        """modes x directions; over all modes there are they add up to the total."""
        return self._handle.array("effective_mass").reshape(-1, self._modes).T

    @cached_property
    def total_mass(self) -> NDArray[np.float64]:
        """d^T M d of each direction."""
        return self._handle.array("total_mass")

    def save(self, path: Any) -> None:
        """Writes an HDF5 file, which `kschur.load` and `kschur info` read. Raises FileError."""
        self._handle.call("write_hdf5", str(path).encode())

    @classmethod
    def read(cls, path: Any) -> Result:
        """The result that `save` or `kschur solve --output` wrote. Raises FileError or InputError."""
        handle = Handle("result")
        handle.call("read_hdf5", str(path).encode())
        return cls(handle)

    @classmethod
    def read_point(cls, path: Any, point: int) -> Result:
        """The modes of a point, from 0, of a sweep whose file keeps them. Raises FileError or InputError."""
        handle = Handle("result")
        handle.call("read_hdf5_point", str(path).encode(), point)
        return cls(handle)

    @property
    def address(self) -> Any:
        """Of the result of the C library."""
        return self._handle.address.value

    def plot_shape(self, mode: int = 0, **options: Any) -> Any:
        """Draws a mode on the geometry: see `kschur.plotting.plot_shape`."""
        from .plotting import plot_shape
        if self.geometry is None:
            raise InputError("a shape is drawn on a geometry: give solve one, as geometry=kschur.Geometry(coordinates)")
        return plot_shape(self.geometry, self.shape(mode), title=table.caption(self, mode), **options)

    def view(self, modes: Any = None, *, stiffness: Any = None, constraints: Any = None) -> Any:
        """A page of modes in motion, all or some, counted from 0: see `kschur.pages.modes.ModesPage`. A notebook shows it; `save` writes it.
        With the stiffness matrix K nodes may be coloured by strain energy, with Cq constraints are drawn."""
        from .pages.modes import ModesPage
        return ModesPage(self, modes, stiffness, constraints)

    def __repr__(self) -> str:
        return table.as_text(self)

    def _repr_html_(self) -> str:
        return table.as_html(self)

    def _text(self, name: str) -> str:
        return self._handle.text("get_text", name.encode())

    def _columns(self, name: str, first: int = 0, count: int | None = None, rows: Any = None) -> NDArray[Any]:
        count = self._modes - first if count is None else count
        place = np.arange(self.unknowns if name.endswith("vectors") else self.constraints, dtype=np.int64)
        if rows is not None:
            place = np.ascontiguousarray(place[rows])
        real = all(self._is_real(name, mode) for mode in range(first, first + count))
        columns = np.empty((count, place.size), np.float64 if real else np.complex128)
        part = Part(first, count, place.ctypes.data, place.size, real)
        if count > 0:
            self._handle.call("get_part", name.encode(), ctypes.byref(part), columns.ctypes.data, columns.nbytes // 8)
        return columns.T

    def _is_real(self, name: str, mode: int) -> bool:
        real = c_int()
        self._handle.call("is_real", name.encode(), mode, ctypes.byref(real))
        return bool(real)
