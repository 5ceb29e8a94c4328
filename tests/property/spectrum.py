"""The spectrum of a recipe, and how well rounding lets each eigenvalue be known."""
from fractions import Fraction

import mpmath
import numpy as np

from recipe import Unsuitable

# A careful solver's error in the data, relative to the matrices as they were before units were changed.
BACKWARD_ERROR = 1e-12
# The same relative to each entry by itself.
ENTRY_ERROR = 64 * np.finfo(float).eps
# What is asked of an eigenvalue however well it is conditioned.
RELATIVE_ERROR = 1e-9
# An eigenvalue known less well than this part of itself, or of its distance to the next, decides nothing.
MEANINGFUL, SEPARATE = 1e-3, 1e-1
# A motion is free where rounding of constraints holds it by no more than this part of the stiffness.
HELD = 1e-13
# Beside others that are known well, one may be known no better than this.
BLURRED = 1e-1


def rated_spectrum(recipe, matrices, rows, right, left):
    """Rows (real, imaginary, tolerance) of the spectrum of a recipe's matrices M, R, K and constraints, in the unit of
    time of the blocks. Right and left vectors of the blocks times `right` and `left` are those of the matrices."""
    combined, inverse = combined_rows(recipe, rows)
    norms = {name: np.linalg.norm(matrix, 2) for name, matrix in matrices.items()}
    multipliers, against = -inverse @ np.linalg.pinv(rows.T), np.linalg.pinv(rows)
    slack = ENTRY_ERROR * abs(inverse.T) @ abs(combined)
    rows = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    reactions = -np.linalg.pinv(rows.T)
    row_norm = np.linalg.norm(rows, 2) if len(rows) else 0.0
    found = []
    for value, members in grouped_eigenvalues(recipe):
        if value == 0:
            if max(order for _, order, _, _ in members) > 2:
                raise Unsuitable("a zero with a long chain")
            free = slack @ abs(np.hstack([right[:, there] @ null_vectors for there, _, _, null_vectors in members]))
            if recipe.sharp and any(sized_product(free, abs(against.T @ matrices[name] @ against), free) > HELD * norms[name]
                                    for name in "KL" if norms[name]):
                raise Unsuitable("a free motion that rounding of the constraints holds")
            found.append((0j, 0.0, sum(count for _, _, count, _ in members)))
            continue
        order = max(order for _, order, _, _ in members)
        leading = [(there, coefficient) for there, k, _, coefficient in members if k == order]
        x = np.hstack([right[:, there] @ coefficient for there, coefficient in leading])
        y = np.hstack([left[:, there] for there, _ in leading])
        at = value**2 * matrices["M"] + value * matrices["R"] + matrices["K"] + 1j * matrices["L"]
        xi, psi = reactions @ (at @ x), reactions @ (at.T @ y)
        error = BACKWARD_ERROR * (
            (abs(value)**2 * norms["M"] + abs(value) * norms["R"] + norms["K"] + norms["L"]) * product_norm(x, y)
            + row_norm * (product_norm(x, psi) + product_norm(xi, y)))
        if recipe.sharp:
            sizes = abs(value)**2 * abs(matrices["M"]) + abs(value) * abs(matrices["R"]) + abs(matrices["K"]) + abs(matrices["L"])
            part = sized_product(y, sizes, x)
            for one, other in ((at @ x, y), (at.T @ y, x)):
                part += sized_product(multipliers @ one, abs(combined), other)
            # Where constraints nearly follow from others, how far rounding lets them go counts with its square too.
            error = ENTRY_ERROR * part + sized_product(slack @ abs(y), abs(against.T @ at @ against), slack @ abs(x))
        tolerance = max(RELATIVE_ERROR * abs(value), error if order == 1 else 2 * error**(1 / order))
        count = sum(count for _, _, count, _ in members)
        found.append((value, tolerance, count))
        if recipe.lossy and 0 < value.imag < 2 * tolerance:
            raise Unsuitable("an eigenvalue that rounding may move below the real axis")
        if value.imag and not recipe.lossy:
            found.append((value.conjugate(), tolerance, count))
    check_separation(found, recipe.sharp)
    found.sort(key=lambda entry: abs(entry[0]))
    return np.array([(value.real, value.imag, tolerance) for value, tolerance, count in found for _ in range(count)])


def product_norm(x, y):
    """Frobenius norm of x y^T."""
    return np.sqrt(abs(np.sum((x.conj().T @ x) * (y.conj().T @ y))))


def sized_product(x, sizes, y):
    """Sum of |x_i| sizes_ij |y_j|."""
    return np.sum(abs(x) * (sizes @ abs(y)))


def combined_rows(recipe, rows):
    """The rows of the constraint matrix but for their units, and the matrix that takes multipliers of the constraints
    `removed unknown = 0` to theirs: those of rows that are chosen with complete pivoting, zero for the others."""
    combinations = [[Fraction(a) for a in row] for row in recipe.combinations]
    combinations = [[a / max(map(abs, row)) for a in row] for row in combinations]
    count, wanted = len(combinations), len(rows)
    rest, chosen, columns = [row[:] for row in combinations], [], []
    for _ in range(wanted):
        k, j = max(((k, j) for k in range(count) for j in range(wanted)), key=lambda place: abs(rest[place[0]][place[1]]))
        pivot = rest[k]
        rest = [[a - row[j] / pivot[j] * b if row[j] else a for a, b in zip(row, pivot)] for row in rest]
        chosen.append(k)
        columns.append(j)
    inverse = np.zeros((count, wanted))
    if wanted:
        with mpmath.workdps(60):
            square = mpmath.matrix([[mpmath.mpf(a.numerator) / a.denominator for a in combinations[k]] for k in chosen])
            inverse[chosen] = np.array((square.T ** -1).tolist(), dtype=float)
    return np.array(combinations, dtype=float).reshape(count, wanted) @ rows, inverse


def grouped_eigenvalues(recipe):
    """Pairs of a value and the blocks that have it, as (unknowns, order, multiplicity, coefficient)."""
    groups, first = [], 0
    for block in recipe.blocks:
        if not block.polynomial:
            raise Unsuitable("every number is an eigenvalue")
        there = slice(first, first + block.size)
        first += block.size
        entries = [(e.value, (there, e.order, e.multiplicity, e.coefficient)) for e in block.eigenvalues]
        if block.zeros:
            entries.append((mpmath.mpc(0), (there, block.zero_order, block.zeros, block.null_vectors)))
        for value, member in entries:
            for known, members in groups:
                if abs(known - value) <= abs(value) * mpmath.mpf(10)**-40:
                    members.append(member)
                    break
            else:
                groups.append((value, [member]))
    return [(complex(value), members) for value, members in groups]


def check_separation(found, some=False):
    """Whether all eigenvalues decide something, or `some` do."""
    values, tolerances = np.array([f[0] for f in found]), np.array([f[1] for f in found])
    bad = blurred(values, tolerances)
    if (some and all(bad)) or any(tolerances > (BLURRED if some else MEANINGFUL) * abs(values)):
        raise Unsuitable("an eigenvalue is conditioned too badly")
    gaps = abs(values[:, None] - values[None, :])
    np.fill_diagonal(gaps, np.inf)
    if any(tolerances > SEPARATE * gaps.min(axis=1, initial=np.inf)):
        raise Unsuitable("two eigenvalues are too close")


def blurred(values, tolerances):
    """Which eigenvalues are known too badly to decide anything."""
    return tolerances > MEANINGFUL * abs(values)
