"""Keywords as options of the C library, by their names there."""
from __future__ import annotations

from typing import Any

import numpy as np

from ._library import Handle
from .errors import UsageError


def new_options(given: dict[str, Any]) -> Handle:
    """Options that differ from the defaults in what is given; None is not given. Raises UsageError."""
    options = Handle("options")
    for name, value in given.items():
        if value is not None:
            options.call("set", name.encode(), _text_of(name, value).encode())
    return options


def _text_of(name: str, value: Any) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, (bool, np.bool_)):
        return "on" if value else "off"
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    if isinstance(value, (complex, np.complexfloating)):
        return f"{float(value.real)!r},{float(value.imag)!r}"
    raise UsageError(f"the option {name} cannot be {value!r}")
