"""Harwell-Boeing, as ANSYS writes with HBMAT: one assembled real matrix; where it is symmetric, one half."""
from __future__ import annotations

from pathlib import Path
from typing import Any

from scipy.io import hb_read

from .halves import completed


def read(path: Path) -> tuple[dict[str, Any], list[str] | None]:
    """One matrix, named as its file."""
    with path.open() as file:
        kind = [next(file) for _ in range(3)][2][:3].upper()
    if kind not in ("RUA", "RSA"):
        raise ValueError(f"its matrix is of the kind {kind.strip()!r}, neither RUA nor RSA")
    if kind == "RUA":
        return {path.stem: hb_read(str(path))}, None
    return {path.stem: completed(_half(path))}, None


# SciPy reads a symmetric file only where it is told that the half in it is a matrix of its own.
def _half(path: Path) -> Any:
    import io
    lines = path.read_text().splitlines(keepends=True)
    lines[2] = "RUA" + lines[2][3:]
    return hb_read(io.StringIO("".join(lines)))
