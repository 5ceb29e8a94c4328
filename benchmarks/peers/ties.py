"""What a careful user does by hand before a symmetric solver: tied unknowns out, damping fitted."""

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components


class NotApplicable(Exception):
    """The message says why."""


def tied_unknowns(constraints):
    """T with Cq T = 0, one column a group of unknowns that rows c (x_i - x_j) = 0 tie together."""
    n = constraints.shape[1]
    counts = np.diff(constraints.indptr)
    if not (counts == 2).all() or np.any(constraints.data.reshape(-1, 2).sum(axis=1) != 0):
        raise NotApplicable("its constraints are more than pairs of unknowns tied together")
    ends = constraints.indices.reshape(-1, 2)
    graph = sp.coo_matrix((np.ones(len(ends)), ends.T), shape=(n, n))
    groups, group = connected_components(graph, directed=False)
    return sp.csr_matrix((np.ones(n), (np.arange(n), group)), shape=(n, groups))


def damping_coefficients(problem):
    """alpha, beta of R = alpha M + beta K, fitted to the entries."""
    union = sorted_entries(problem)
    damping, mass, stiffness = union
    columns = np.stack([mass, stiffness], axis=1)
    sizes = np.linalg.norm(columns, axis=0)
    coefficients = np.linalg.lstsq(columns / sizes, damping, rcond=None)[0] / sizes
    if np.linalg.norm(columns @ coefficients - damping) > 1e-12 * max(np.linalg.norm(damping), 1e-300):
        raise NotApplicable("its damping is not a combination of mass and stiffness")
    return coefficients


def sorted_entries(problem):
    """The entries of R, M and K on the union of their patterns."""
    pattern = abs(problem.damping) + abs(problem.mass) + abs(problem.stiffness)
    pattern.data[:] = 1
    rows, columns = pattern.nonzero()
    return [np.asarray(matrix[rows, columns]).ravel() for matrix in (problem.damping, problem.mass, problem.stiffness)]
