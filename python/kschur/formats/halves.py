"""Symmetric matrices of which a file holds one half."""
from __future__ import annotations

from typing import Any

import scipy.sparse as sparse


def completed(matrix: Any) -> Any:
    """The whole symmetric matrix; raises ValueError where both triangles hold entries that do not mirror each other."""
    matrix = sparse.csr_matrix(matrix)
    lower, upper = sparse.tril(matrix, -1), sparse.triu(matrix, 1)
    if lower.count_nonzero() and upper.count_nonzero():
        if (lower != upper.T).nnz:
            raise ValueError("it says that it is symmetric, but its triangles differ")
        return matrix
    return matrix + (lower + upper).T
