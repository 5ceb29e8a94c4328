"""Keywords as options of the C library."""
from __future__ import annotations

from ctypes import c_char_p, c_double, c_int, c_int64
from typing import Any

from ._library import Handle
from .errors import UsageError

_WHOLE = ("modes", "subspace", "max_restarts", "block", "threads", "seed")
_REAL = ("tolerance",)
_COMPLEX = ("target", "shift")
_FLAGS = ("presolve", "left", "certify")
_NAMES = ("method", "arpack", "formulation", "inner", "constraint_scaling")


def new_options(given: dict[str, Any]) -> Handle:
    """Options that differ from the defaults in what is given; None is not given. Raises UsageError."""
    options = Handle("options")
    for name, value in given.items():
        if value is not None:
            options.call(f"set_{name}", *_arguments(name, value))
    return options


def _arguments(name: str, value: Any) -> list[Any]:
    try:
        if name in _WHOLE:
            if int(value) != value:
                raise ValueError
            return [c_int64(int(value))]
        if name in _REAL:
            return [c_double(float(value))]
        if name in _COMPLEX:
            return [c_double(complex(value).real), c_double(complex(value).imag)]
        if name in _FLAGS:
            return [c_int(bool(value))]
        if name in _NAMES:
            return [c_char_p(value.encode())]
    except (AttributeError, OverflowError, TypeError, ValueError):
        raise UsageError(f"the option {name} cannot be {value!r}") from None
    raise UsageError(f"there is no option {name}")
