"""What was saved."""
from __future__ import annotations

from typing import Any

from ._library import library
from .result import Result
from .sweeping import Sweep


def load(path: Any) -> Any:
    """The `Result` that `Result.save` or `kschur solve --output` wrote, or the `Sweep` of `Sweep.save` or `kschur sweep --output`.
    Raises FileError or InputError."""
    return (Sweep if library.kschur_is_sweep(str(path).encode()) else Result).read(path)
