"""How good modes are, judged by one piece of code for every method, in extended precision."""

from dataclasses import dataclass

import numpy as np

from .problem import infinity_norm

BLOCKS = 240  # of rows of the state vector, in a picture


@dataclass
class Residuals:
    """Of each mode; in `motion_rows` and `constraint_rows` the largest of any mode in each of BLOCKS parts of the rows."""

    backward_error: np.ndarray
    motion: np.ndarray
    constraint: np.ndarray
    motion_rows: np.ndarray
    constraint_rows: np.ndarray


def extended(matrix):
    """The matrix in extended precision, so that rounding of the residual does not count as an error."""
    return matrix.astype(np.longdouble)


def residuals(problem, result):
    """The backward error of each mode of a result.

    The larger of ||P(lambda) phi + Cq^T xi|| / ((|lambda|^2 ||M|| + |lambda| ||R|| + ||K||) ||phi||) and
    ||Cq phi|| / (||Cq|| ||phi||): 2-norms of vectors, infinity norms of the matrices as given.
    """
    mass, damping, stiffness, constraints = (
        extended(a) for a in (problem.mass, problem.damping, problem.stiffness, problem.constraints)
    )
    transposed = constraints.T.tocsr()
    norms = [infinity_norm(a) for a in (problem.mass, problem.damping, problem.stiffness)]
    constraint_norm = infinity_norm(problem.constraints)
    motion, violation = [], []
    motion_rows, constraint_rows = np.zeros(BLOCKS), np.zeros(BLOCKS)
    for value, shape, multiplier in zip(result.eigenvalues, result.eigenvectors, result.multipliers):
        value, x, xi = np.clongdouble(value), shape.astype(np.clongdouble), multiplier.astype(np.clongdouble)
        length = np.linalg.norm(shape)
        size = np.polyval(norms, abs(complex(value))) * length
        rows = abs(value**2 * (mass @ x) + value * (damping @ x) + stiffness @ x + transposed @ xi) / size
        motion.append(two_norm(rows))
        motion_rows = np.maximum(motion_rows, largest_by_block(rows))
        rows = abs(constraints @ x) / (constraint_norm * length) if len(xi) else np.zeros(0)
        violation.append(two_norm(rows))
        constraint_rows = np.maximum(constraint_rows, largest_by_block(rows))
    motion, violation = np.array(motion, dtype=float), np.array(violation, dtype=float)
    return Residuals(np.maximum(motion, violation), motion, violation, motion_rows, constraint_rows)


def two_norm(x):
    return float(np.sqrt(np.sum(x**2)))


def largest_by_block(rows):
    """The largest of the rows in each of BLOCKS equal parts; where there are fewer rows, some parts repeat one."""
    if len(rows) == 0:
        return np.zeros(BLOCKS)
    edges = np.linspace(0, len(rows), BLOCKS + 1).astype(int)
    first = np.minimum(edges[:-1], len(rows) - 1)
    return np.array([rows[i : max(j, i + 1)].max() for i, j in zip(first, edges[1:])], dtype=float)


def damping_measure(eigenvalues):
    """The damping ratio -Re lambda / |lambda|; of a real eigenvalue, whose ratio is 1 whatever it is, the rate -Re lambda."""
    real = abs(eigenvalues.imag) <= 1e-3 * abs(eigenvalues)
    return np.where(real, -eigenvalues.real, -eigenvalues.real / abs(eigenvalues))


def forward_errors(eigenvalues, reference, tolerance=1e-4):
    """Relative errors of frequency and of damping of the modes that stand for those of a reference, NaN where none does.

    Each reference eigenvalue gets the nearest that is left, if it is off by less than `tolerance`. Both hold a conjugate pair
    once. An error below what the reference is good for is given as that. Damping is compared where it is not zero.
    """
    count = len(reference.eigenvalues)
    frequency, damping = np.full(count, np.nan), np.full(count, np.nan)
    for k, value in enumerate(nearest_left(eigenvalues, reference.eigenvalues, tolerance)):
        if value is None:
            continue
        expected = reference.eigenvalues[k]
        frequency[k] = max(abs(abs(value) - abs(expected)) / abs(expected), reference.frequency_uncertainty[k])
        if expected.real != 0:
            both = damping_measure(np.array([value, expected]))
            damping[k] = max(abs(both[0] - both[1]) / abs(both[1]), reference.damping_uncertainty[k])
    return frequency, damping


def nearest_left(eigenvalues, expected, tolerance):
    """For each expected value the nearest that no other has taken; None where that is off by more than `tolerance`."""
    left = list(eigenvalues)
    chosen = []
    for value in expected:
        at = int(np.argmin(abs(np.array(left) - value))) if left else None
        near = at is not None and abs(left[at] - value) <= tolerance * abs(value)
        chosen.append(left.pop(at) if near else None)
    return chosen


def eigenvalue_counts(eigenvalues, damped):
    """How many eigenvalues each mode is: two for a pair, and for an exact zero on which no damping acts."""
    return 1 + ((eigenvalues.imag > 0) | ((abs(eigenvalues) == 0) & (not damped))).astype(int)


def count_found(eigenvalues, expected, damped, tolerance=1e-4):
    """How many of the eigenvalues of `expected` another method has.

    One by one, but for those nearer to zero than half of the slowest oscillation, of which only the number counts:
    what should be a multiple zero comes out of other methods as a ring around it.
    """
    weights, weights_expected = eigenvalue_counts(eigenvalues, damped), eigenvalue_counts(expected, damped)
    oscillations = abs(expected[expected.imag > 1e-3 * abs(expected)])
    slow = 0.5 * oscillations.min(initial=np.inf)
    is_slow, is_slow_expected = abs(eigenvalues) < slow, abs(expected) < slow
    matched = nearest_left(eigenvalues[~is_slow], expected[~is_slow_expected], tolerance)
    found = sum(weight for weight, value in zip(weights_expected[~is_slow_expected], matched) if value is not None)
    return int(found + min(weights[is_slow].sum(), weights_expected[is_slow_expected].sum()))
