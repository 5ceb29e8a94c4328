"""Abaqus, *MATRIX OUTPUT: lines of node, direction, node, direction, value (FORMAT=MATRIX INPUT), or of row, column, value
(FORMAT=COORDINATE); lines that begin with * are keywords and comments. TYPE=SYMMETRIC, the default, may hold one half. Held unknowns
have 1e36 on the diagonal of the stiffness, beside which error bounds say nothing: they become constraints."""
from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sparse

from .halves import completed

# Nothing that is meant as a stiffness is so large.
PENALTY = 1e35


def read(path: Path) -> tuple[dict[str, Any], list[str] | None]:
    """One matrix, named as its file: job_STIF1 and job_MASS1 are known as K and M; and a row of `held` for each held unknown."""
    lines = path.read_text().splitlines()
    if lines and lines[0].startswith("%%MatrixMarket"):
        raise ValueError("it is a Matrix Market file, which kschur reads itself, in a folder of M.mtx and K.mtx")
    keywords = "".join(line.upper().replace(" ", "") for line in lines if line.startswith("*") and not line.startswith("**"))
    entries = [line.replace(",", " ").replace("D", "E").split() for line in lines if line.strip() and not line.startswith("*")]
    table = np.array(entries, dtype=float)
    labels = None
    if table.ndim == 2 and table.shape[1] == 5:
        unknowns, place = np.unique(table[:, :4].astype(int).reshape(-1, 2), axis=0, return_inverse=True)
        row, column = place.reshape(-1, 2).T
        labels = [f"{node}.{direction}" for node, direction in unknowns]
    elif table.ndim == 2 and table.shape[1] == 3:
        row, column = table[:, :2].astype(int).T - 1
    else:
        raise ValueError("its lines have neither 5 numbers nor 3")
    size = max(row.max(), column.max()) + 1
    penalty = (row == column) & (table[:, -1] >= PENALTY)
    held = np.unique(row[penalty])
    matrix = sparse.coo_matrix((np.where(penalty, 0.0, table[:, -1]), (row, column)), shape=(size, size))
    unsymmetric = "TYPE=UNSYMMETRIC" in keywords
    matrices = {path.stem: sparse.csr_matrix(matrix) if unsymmetric else completed(matrix)}
    if len(held):
        matrices["held"] = sparse.csr_matrix((np.ones(len(held)), (np.arange(len(held)), held)), shape=(len(held), size))
    return matrices, labels
