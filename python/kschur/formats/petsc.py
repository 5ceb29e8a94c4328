"""PETSc, MatView on a binary viewer, in its default form: big-endian integers of 32 bits and reals of 64."""
from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sparse

MATRIX = 1211216


def read(path: Path) -> tuple[dict[str, Any], list[str] | None]:
    """All matrices of the file, named as it where it is one, else M, K, R, Cq in this order."""
    content, matrices, place = path.read_bytes(), [], 0
    while place < len(content):
        kind, rows, columns, entries = np.frombuffer(content, ">i4", 4, place).tolist()
        if kind != MATRIX or min(rows, columns, entries) < 0:
            raise ValueError("it does not hold sparse matrices")
        lengths = np.frombuffer(content, ">i4", rows, place + 16)
        index = np.frombuffer(content, ">i4", entries, place + 16 + 4 * rows)
        place += 16 + 4 * (rows + entries)
        data = np.frombuffer(content, ">f8", entries, place)
        place += 8 * entries
        matrix = sparse.csr_matrix((data.astype(float), index.astype(np.int32), np.concatenate([[0], np.cumsum(lengths)])),
                                   shape=(rows, columns))
        matrix.check_format()
        matrices.append(matrix)
    if not 0 < len(matrices) <= 4:
        raise ValueError(f"it holds {len(matrices)} matrices")
    return dict(zip([path.stem] if len(matrices) == 1 else ["M", "K", "R", "Cq"], matrices)), None
