"""The C library: where it is, what its functions take, and the handles that they work on."""
from __future__ import annotations

import ctypes
import os
from ctypes import CFUNCTYPE, POINTER, c_char_p, c_double, c_int, c_int32, c_int64, c_void_p
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import OF_STATUS, Error

PROGRESS = CFUNCTYPE(c_int, c_void_p, c_int64, c_int64, c_int64, c_double)
STOP = CFUNCTYPE(c_int, c_void_p)
FACTORIZE = CFUNCTYPE(c_int, c_void_p, c_int64, c_int64, POINTER(c_int32), POINTER(c_int32), POINTER(c_double), c_int,
                      POINTER(c_void_p))
SOLVE = CFUNCTYPE(c_int, c_void_p, c_void_p, c_int, c_int64, c_int64, POINTER(c_double))
RELEASE = CFUNCTYPE(None, c_void_p, c_void_p)
PROBLEM = CFUNCTYPE(c_int, c_void_p, c_double, c_void_p)

class Part(ctypes.Structure):
    """kschur_part: some modes, and some rows of them."""
    _fields_ = [("first", c_int64), ("count", c_int64), ("rows", c_void_p), ("row_count", c_int64), ("real", c_int)]


# By hand only what C would convert: numbers that are not int, and callbacks.
_ARGUMENTS = {
    "kschur_problem_set_csr": [c_void_p, c_int, c_int64, c_int64, c_int64, c_int, c_void_p, c_void_p, c_void_p],
    "kschur_problem_set_csr64": [c_void_p, c_int, c_int64, c_int64, c_int64, c_int, c_void_p, c_void_p, c_void_p],
    "kschur_problem_set_symmetric": [c_void_p, c_char_p],
    "kschur_problem_set_nodes": [c_void_p, c_int64, c_void_p, c_int64, c_int, c_void_p, c_void_p],
    "kschur_problem_set_cells": [c_void_p, c_int64, c_int, c_void_p, c_void_p, c_void_p],
    "kschur_problem_get_response": [c_void_p, c_void_p, c_int64, c_void_p, c_int64, c_void_p, c_void_p, c_void_p, c_void_p],
    "kschur_sweep_add": [c_void_p, c_double, c_void_p, c_void_p],
    "kschur_sweep_set_problem": [c_void_p, PROBLEM, c_void_p],
    "kschur_result_read_hdf5_point": [c_void_p, c_char_p, c_int64],
    "kschur_sweep_get_numbers": [c_void_p, c_char_p, c_void_p, c_int64],
    "kschur_options_set_progress": [c_void_p, PROGRESS, c_void_p],
    "kschur_options_set_stop": [c_void_p, STOP, c_void_p],
    "kschur_options_set_real_solver": [c_void_p, FACTORIZE, SOLVE, RELEASE, c_void_p],
    "kschur_options_set_complex_solver": [c_void_p, FACTORIZE, SOLVE, RELEASE, c_void_p],
    "kschur_result_get_numbers": [c_void_p, c_char_p, c_void_p, c_int64],
    "kschur_result_find_properties": [c_void_p, c_void_p, c_void_p, c_int64],
    "kschur_result_get_part": [c_void_p, c_char_p, c_void_p, c_void_p, c_int64],
    "kschur_result_is_real": [c_void_p, c_char_p, c_int64, c_void_p],
    "kschur_solve": [c_void_p, c_void_p, c_void_p],
    "kschur_solve_band": [c_void_p, c_double, c_double, c_void_p, c_void_p],
}


# As the loader finds it: the shared library ends in the two numbers that its interface changes with.
INSTALLED = "libkschur_capi.so.0.2"


def _load() -> ctypes.CDLL:
    """The library that KSCHUR_LIBRARY names, else the one in this package, else an installed one."""
    beside = Path(__file__).with_name("libkschur_capi.so")
    path = os.environ.get("KSCHUR_LIBRARY") or (str(beside) if beside.exists() else INSTALLED)
    try:
        loaded = ctypes.CDLL(path)
    except OSError as error:
        raise ImportError(f"the library of kschur cannot be loaded: {error}; pip install builds it into the package, "
                          "or KSCHUR_LIBRARY names one that is built") from error
    for name, arguments in _ARGUMENTS.items():
        getattr(loaded, name).argtypes = arguments
    return loaded


library = _load()


def version() -> str:
    """The version of the library that runs, as "0.2.0"."""
    parts = [c_int() for _ in range(3)]
    library.kschur_version(*map(ctypes.byref, parts))
    return ".".join(str(part.value) for part in parts)


def name_of(what: str, number: int) -> str:
    """The name of a kind or a reason."""
    buffer = ctypes.create_string_buffer(100)
    getattr(library, f"kschur_{what}_name")(int(number), buffer, c_int64(len(buffer)))
    return buffer.value.decode()


class Handle:
    """A kschur_problem, kschur_options, kschur_result or kschur_sweep, by its kind; ended with this object."""

    # Nothing to end where none was made.
    address: Any = None

    def __init__(self, kind: str, borrowed: int | None = None) -> None:
        """A new one, or the one at an address, which somebody else ends."""
        self.kind = kind
        self._is_ours = borrowed is None
        self.address = c_void_p(borrowed)
        if borrowed is not None:
            return
        status = self._function("create")(ctypes.byref(self.address))
        if status != 0:
            raise OF_STATUS[status](f"no {kind} could be made")

    def __del__(self) -> None:
        if self.address and self._is_ours:
            self._function("destroy")(ctypes.byref(self.address))

    def __reduce__(self) -> Any:
        raise TypeError(f"a {self.kind} of the library cannot be copied or pickled")

    def call(self, name: str, *arguments: Any) -> None:
        """Calls kschur_KIND_NAME on this handle; a failure is raised."""
        self.check(self.status(name, *arguments))

    def status(self, name: str, *arguments: Any) -> int:
        """The same, where a failure is looked at later: see `check`."""
        return int(self._function(name)(self.address, *arguments))

    def check(self, status: int) -> None:
        """Raises the failure that a status stands for, with the message of this handle."""
        if status != 0:
            raise OF_STATUS.get(status, Error)(self.text("get_message"))

    def text(self, name: str, *arguments: Any) -> str:
        """The text that kschur_KIND_NAME gives."""
        buffer = ctypes.create_string_buffer(4096)
        self._function(name)(self.address, *arguments, buffer, c_int64(len(buffer)))
        return buffer.value.decode(errors="replace")

    def array(self, name: str) -> NDArray[np.float64]:
        """The numbers of a result by their name in the C library."""
        length = c_int64()
        self.call("get_length", name.encode(), ctypes.byref(length))
        values = np.empty(length.value)
        self.call("get_numbers", name.encode(), values.ctypes.data, length.value)
        return values

    def number(self, name: str) -> int:
        """The only one of them, a whole number."""
        return int(self.array(name)[0])

    def _function(self, name: str) -> Any:
        return getattr(library, f"kschur_{self.kind}_{name}")
