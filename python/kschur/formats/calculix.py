"""CalculiX, *FREQUENCY, SOLVER=MATRIXSTORAGE: job.sti and job.mas hold one triangle each, job.dof the unknowns as node.direction."""
from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sparse

from .halves import completed

NAMES = {".sti": "K", ".mas": "M"}


def read(path: Path) -> tuple[dict[str, Any], list[str] | None]:
    """One matrix, by whichever of its two files, and the names of job.dof, which gives its order."""
    labels = path.with_suffix(".dof").read_text().split()
    row, column, value = np.array(path.read_text().split(), float).reshape(-1, 3).T
    # Every unknown has its diagonal entry in the file; a file that was cut has lost some.
    if np.count_nonzero(row == column) != len(labels):
        raise ValueError(f"it has not one diagonal entry for each of {len(labels)} unknowns of the .dof file")
    matrix = sparse.coo_matrix((value, (row.astype(int) - 1, column.astype(int) - 1)), shape=(len(labels),) * 2)
    return {NAMES[path.suffix.lower()]: completed(matrix)}, labels
