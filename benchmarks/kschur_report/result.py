"""Results in the small form that `kschur solve --output` and the peers write."""

from dataclasses import dataclass, field

import h5py
import numpy as np


@dataclass
class Result:
    """Eigenvalues, their vectors (modes x n) and multipliers (modes x m), and facts as scalars."""

    eigenvalues: np.ndarray
    eigenvectors: np.ndarray
    multipliers: np.ndarray
    facts: dict = field(default_factory=dict)
    backward_error: np.ndarray = None
    condition: np.ndarray = None


def read_result(path):
    """The result in a file of `kschur solve` or of a peer."""
    with h5py.File(path, "r") as file:
        facts = {name: value.item() if hasattr(value, "item") else value for name, value in file.attrs.items()}
        reported, condition = (file[name][:] if name in file else None for name in ("backward_error", "condition_number"))
        return Result(file["eigenvalues"][:], file["eigenvectors"][:], file["multipliers"][:], facts, reported, condition)


def write_result(path, result):
    """What a peer found."""
    with h5py.File(path, "w") as file:
        for name in ("eigenvalues", "eigenvectors", "multipliers"):
            file[name] = getattr(result, name)
        file.attrs.update(result.facts)


def one_of_each_pair(result, count):
    """The modes among the `count` eigenvalues nearest to zero: of a conjugate pair that with Im >= 0.

    A complex solver returns both values of a pair, and values that should be real with imaginary
    parts of rounding; those of no partner stay whatever their sign is.
    """
    nearest = np.argsort(abs(result.eigenvalues), kind="stable")[:count]
    values = result.eigenvalues[nearest]
    scale = np.max(abs(values), initial=0.0)
    keep = []
    partners = list(range(len(values)))
    for i, value in enumerate(values):
        if i not in partners:
            continue
        partners.remove(i)
        distance = [abs(values[j] - value.conjugate()) for j in partners]
        if distance and abs(value.imag) > 1e-9 * scale and min(distance) <= 1e-6 * abs(value):
            j = partners.pop(int(np.argmin(distance)))
            keep.append(i if value.imag > 0 else j)
        else:
            keep.append(i)
    chosen = nearest[keep]
    eigenvalues, eigenvectors, multipliers = (
        a[chosen] for a in (result.eigenvalues, result.eigenvectors, result.multipliers)
    )
    flipped = eigenvalues.imag < 0
    return Result(
        np.where(flipped, eigenvalues.conj(), eigenvalues),
        np.where(flipped[:, None], eigenvectors.conj(), eigenvectors),
        np.where(flipped[:, None], multipliers.conj(), multipliers),
        result.facts,
    )
