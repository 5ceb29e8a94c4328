"""Pages of files, as kschur-picture makes them."""
from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from ..geometry import Geometry
from ..result import Result
from ..sweeping import Sweep
from .modes import ModesPage
from .page import Page
from .response import ResponsePage
from .sweep import SweepPage


def main(words: list[str]) -> None:
    """Words are what is made a page, its file, the page, and numbers; of modes also --problem and a file."""
    kind, path, page, *numbers = words
    problem = numbers.pop() if numbers[-2:-1] == ["--problem"] else None
    numbers = [number for number in numbers if number != "--problem"]
    try:
        made = {"--html": _modes, "--sweep": _sweep, "--response": _response}[kind](path, [float(number) for number in numbers],
                                                                                *([problem] if problem else []))
        made.save(page)
    except Exception as error:
        sys.exit(f"kschur-picture: {error}")


def _modes(path: str, numbers: list[float], problem: str | None = None) -> Page:
    return ModesPage(Result.read(path), [int(number) - 1 for number in numbers], *(_matrices(problem) if problem else ()))


def _matrices(problem: str) -> list[Any]:
    """K and Cq of an HDF5 file, None where it has none."""
    import h5py

    with h5py.File(problem) as file:
        return [_matrix(file, name) for name in ("stiffness", "constraints")]


def _sweep(folder: str, orders: list[float]) -> Page:
    sweep = Sweep.read(Path(folder, "sweep.h5"))
    for point in range(len(sweep.values)):
        of_point = Path(folder, f"point_{point + 1}.h5")
        if of_point.exists():
            sweep.results[point] = Result.read(of_point)
    return SweepPage(sweep, orders)


def _matrix(file: Any, name: str) -> Any:
    """None if it is not in the file."""
    from scipy.sparse import csr_matrix

    if name not in file:
        return None
    group = file[name]
    return csr_matrix(tuple(group[part][()] for part in ("data", "indices", "indptr")), tuple(group.attrs["shape"]))


def _response(path: str, numbers: list[float]) -> Page:
    import h5py

    with h5py.File(path) as file:
        geometry = Geometry.of_arrays(*(file[name][()] if name in file else None for name in (
            "coordinates", "unknown_node", "unknown_component", "cells/offsets", "cells/connectivity", "cells/types")),
            transformation=_matrix(file, "transformation")) if "coordinates" in file else None
        return ResponsePage(file["frequency_hz"][()], file["response"][()], [int(number) - 1 for number in numbers], geometry)
