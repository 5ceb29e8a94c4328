"""Problems as `kschur scene` and users write them: CSR groups in an HDF5 file."""

from dataclasses import dataclass

import h5py
import numpy as np
import scipy.sparse as sp


class InputError(Exception):
    """A file that cannot be used; the message names it and what is wrong."""


@dataclass
class Problem:
    """(lambda^2 M + lambda R + K) phi + Cq^T xi = 0, Cq phi = 0; absent matrices are zero."""

    mass: sp.csr_matrix
    damping: sp.csr_matrix
    stiffness: sp.csr_matrix
    constraints: sp.csr_matrix

    @property
    def unknowns(self):
        return self.mass.shape[0]

    @property
    def is_damped(self):
        return self.damping.count_nonzero() > 0


def read_matrix(file, name, shape=None):
    """One CSR matrix of an open HDF5 file; zero, of `shape`, where it is absent and a shape is given."""
    if name not in file:
        if shape is None:
            raise InputError(f"there is no group /{name}")
        return sp.csr_matrix(shape)
    try:
        group = file[name]
        rows, columns = (int(size) for size in group.attrs["shape"])
        matrix = sp.csr_matrix((group["data"][:], group["indices"][:], group["indptr"][:]), shape=(rows, columns))
    except (KeyError, ValueError, TypeError) as wrong:
        raise InputError(f"/{name} is not a CSR matrix: {wrong}") from wrong
    if shape is not None and matrix.shape[1] != shape[1]:
        raise InputError(f"/{name} has {matrix.shape[1]} columns, /mass {shape[1]}")
    return matrix


def read_problem(path):
    """The problem in an HDF5 file; an InputError names the file and what is wrong."""
    try:
        with h5py.File(path, "r") as file:
            mass = read_matrix(file, "mass")
            n = mass.shape[1]
            return Problem(
                mass,
                read_matrix(file, "damping", (n, n)),
                read_matrix(file, "stiffness", (n, n)),
                read_matrix(file, "constraints", (0, n)),
            )
    except OSError as wrong:
        raise InputError(f"{path}: {wrong}") from wrong
    except InputError as wrong:
        raise InputError(f"{path}: {wrong}") from wrong


def infinity_norm(matrix):
    """Largest sum of absolute values in a row; 0 for a matrix without rows."""
    return float(np.max(np.asarray(abs(matrix).sum(axis=1)), initial=0.0))
