"""From a recipe to matrices and their spectrum."""
from dataclasses import dataclass, field

import numpy as np

import polynomials
from recipe import Unsuitable
from spectrum import rated_spectrum


@dataclass
class Problem:
    """Matrices of doubles, and rows (real part, imaginary part, tolerance) of the spectrum: all finite eigenvalues
    with their multiplicities, both of a pair, zeros once for each independent motion that nothing holds. With losses
    none below the real axis."""
    matrices: dict
    spectrum: np.ndarray
    command: list = field(default_factory=list)

    @property
    def in_pairs(self):
        """Whether a mode above the real axis stands for its conjugate too, as without losses."""
        return "L" not in self.matrices


def assemble(recipe):
    """The problem that a recipe makes, or Unsuitable."""
    if not recipe.blocks:
        raise Unsuitable("no modes")
    if polynomials.rank(recipe.combinations) < len(recipe.removed):
        raise Unsuitable("unknowns that constraints should remove are left")
    mixed, constraints, right, left = mix(recipe)
    numbers = {name: matrix.astype(float) / denominator(recipe) for name, matrix in mixed.items()}
    spectrum = rated_spectrum(recipe, numbers, constraints.astype(float), right, left)
    if not len(spectrum):
        raise Unsuitable("no modes")
    spectrum *= 2.0**recipe.time_exponent
    order = list(recipe.order) or list(range(recipe.size))
    units, row_units = (np.array([chosen[i] if chosen else 0 for i in order])
                        for chosen in (recipe.units, recipe.row_units or recipe.units))
    if recipe.combinations and (row_units - units)[(constraints[:, order] != 0).any(axis=0)].any():
        raise Unsuitable("constraints in two units")
    scales = row_units[:, None] + units[None, :] + recipe.mass_exponent - denominator(recipe).bit_length() + 1
    matrices = {}
    for power, name in ((0, "M"), (1, "R"), (2, "K"), (2, "L")):
        if {"R": recipe.damped, "L": recipe.lossy}.get(name, True):
            matrices[name] = exact_doubles(mixed[name][np.ix_(order, order)], scales + power * recipe.time_exponent)
    if not matrices["M"].any() and not recipe.sharp:
        raise Unsuitable("no mass")
    if recipe.combinations:
        rows = np.array(recipe.combinations, dtype=object) @ constraints
        exponents = np.array(recipe.row_exponents or [0] * len(rows))
        matrices["Cq"] = exact_doubles(rows[:, order], exponents[:, None] + units[None, :])
    return Problem(matrices, spectrum, recipe.command)


def mix(recipe):
    """The matrices M, R, K and L (H) after all steps, whole numbers by a common denominator; one constraint for each removed
    unknown; and the matrices that take right and left vectors of the blocks to those of the mixed problem."""
    size, common = recipe.size, denominator(recipe)
    mixed = {name: np.full((size, size), 0, dtype=object) for name in "MRKL"}
    first = 0
    for piece in recipe.blocks + recipe.removed:
        there = slice(first, first + piece.size)
        for name, matrix in zip("MRKL", piece.matrices):
            mixed[name][there, there] = np.array([[int(a * common) for a in row] for row in matrix], dtype=object)
        first += piece.size
    constraints = np.array([[int(j == recipe.kept + i) for j in range(size)] for i in range(len(recipe.removed))],
                           dtype=object).reshape(len(recipe.removed), size)
    right, left = np.eye(size), np.eye(size)
    for i, j, factor in recipe.row_steps:
        for matrix in mixed.values():
            matrix[i] += factor * matrix[j]
        left[j] -= factor * left[i]
    for i, j, factor in recipe.column_steps:
        for matrix in mixed.values():
            matrix[:, i] += factor * matrix[:, j]
        right[j] -= factor * right[i]
    for i, j, factor in recipe.steps:
        for matrix in mixed.values():
            matrix[:, i] += factor * matrix[:, j]
            matrix[i] += factor * matrix[j]
        constraints[:, i] += factor * constraints[:, j]
        right[j] -= factor * right[i]
        left[j] -= factor * left[i]
    return mixed, constraints, right, left


def denominator(recipe):
    """The power of two that makes all entries whole."""
    return max(entry.denominator for piece in recipe.blocks + recipe.removed
               for matrix in piece.matrices for row in matrix for entry in row)


def exact_doubles(entries, exponents):
    """Integers times powers of two."""
    numbers = entries.astype(float)
    if any(int(number) != entry for number, entry in zip(numbers.flat, entries.flat)):
        raise Unsuitable("an entry is no double")
    return np.ldexp(numbers, exponents)
