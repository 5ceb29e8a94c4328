"""NumPy: .npz of scipy.sparse.save_npz, one matrix named as its file, or of numpy.savez, dense ones by name."""
from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sparse


def read(path: Path) -> tuple[dict[str, Any], list[str] | None]:
    """The matrices of the file."""
    with np.load(path, allow_pickle=False) as archive:
        if "format" not in archive:
            return {name: archive[name] for name in archive.files if archive[name].ndim == 2}, None
    return {path.stem: sparse.load_npz(path)}, None
