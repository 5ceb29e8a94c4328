"""MATLAB: .mat of version 5 to 7 by SciPy, of version 7.3, which is HDF5, by h5py."""
from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sparse


def read(path: Path) -> tuple[dict[str, Any], list[str] | None]:
    """All matrices of numbers, by the names of their variables."""
    # Version 7.3 says so in the text that it begins with; one that h5py wrote may have no such text.
    with path.open("rb") as file:
        head = file.read(20)
    if head.startswith((b"MATLAB 7.3", b"\x89HDF")):
        return _read_hdf5(path), None
    from scipy.io import loadmat
    variables = loadmat(str(path))
    return {name: value for name, value in variables.items() if not name.startswith("__") and _is_matrix(value)}, None


def _is_matrix(value: Any) -> bool:
    return sparse.issparse(value) or (isinstance(value, np.ndarray) and value.ndim == 2 and value.dtype.kind in "fiu")


def _read_hdf5(path: Path) -> dict[str, Any]:
    import h5py
    matrices: dict[str, Any] = {}
    with h5py.File(path, "r") as file:
        for name, item in file.items():
            if isinstance(item, h5py.Group) and "MATLAB_sparse" in item.attrs:
                rows, start = int(item.attrs["MATLAB_sparse"]), item["jc"][:].astype(int)
                # A matrix without entries has neither ir nor data.
                index = item["ir"][:].astype(int) if "ir" in item else np.zeros(0, int)
                data = item["data"][:] if "data" in item else np.zeros(0)
                matrix = sparse.csc_matrix((data, index, start), shape=(rows, len(start) - 1))
                matrix.check_format()
                matrices[name] = matrix
            elif isinstance(item, h5py.Dataset) and item.ndim == 2 and item.dtype.kind in "fiu":
                # MATLAB counts the other way.
                matrices[name] = item[:].T
    return matrices
