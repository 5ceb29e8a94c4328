"""Small modal problems, each of a few unknowns, and what is exactly known of them."""
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import mpmath
import numpy as np

import polynomials


@dataclass(frozen=True)
class Eigenvalue:
    """One that is not zero: its value to many digits, its multiplicity, the order of the pole that the inverse of
    P(s) has there and the leading coefficient of that pole. The order is 1 unless the eigenvalue is defective;
    the coefficient says how far rounding can move it."""
    value: mpmath.mpc
    multiplicity: int
    order: int
    coefficient: np.ndarray


@dataclass(frozen=True)
class Block:
    """lambda^2 mass + lambda damping + stiffness: square tuples of tuples of Fractions of one size."""
    mass: tuple
    damping: tuple
    stiffness: tuple

    @property
    def size(self):
        return len(self.mass)

    @cached_property
    def polynomial(self):
        """The determinant, empty where it vanishes for every lambda."""
        return polynomials.determinant_polynomial([self.stiffness, self.damping, self.mass])

    @cached_property
    def zeros(self):
        """Linearly independent motions that nothing holds: the zeros that a solver lists."""
        return self.size - polynomials.rank(self.stiffness)

    @cached_property
    def null_vectors(self):
        """An orthonormal basis of them."""
        return np.linalg.svd(np.array(self.stiffness, float))[2][self.size - self.zeros:].T

    @cached_property
    def zero_multiplicity(self):
        return next(k for k, a in enumerate(self.polynomial) if a)

    @cached_property
    def zero_order(self):
        """The order of the pole at zero: 1 where damping acts, 2 for a body that is free, more is no mechanics."""
        return pole(self, mpmath.mpc(0))[0] if self.zeros else 0

    @cached_property
    def eigenvalues(self):
        """All that are finite and not zero; of a complex pair the one above the real axis."""
        found = []
        for value, multiplicity in polynomials.roots(self.polynomial[self.zero_multiplicity:]):
            if value.imag >= 0:
                order, coefficient = simple_pole(self, value) if multiplicity == 1 else pole(self, value)
                found.append(Eigenvalue(value, multiplicity, order, coefficient))
        return found

    @cached_property
    def spread(self):
        """The largest entry by the smallest that is not zero."""
        sizes = [abs(a) for matrix in (self.mass, self.damping, self.stiffness) for row in matrix for a in row if a]
        return max(sizes, default=1) / min(sizes, default=1)

    def at(self, value):
        """P(value) with many digits."""
        terms = zip(self.mass, self.damping, self.stiffness)
        return mpmath.matrix([[value * (value * number(m) + number(r)) + number(k) for m, r, k in zip(*rows)]
                              for rows in terms])


def block(mass, damping, stiffness):
    """From anything that converts to Fractions; None for no damping."""
    size = len(mass)
    damping = [[0] * size for _ in range(size)] if damping is None else damping
    return Block(*(tuple(tuple(Fraction(a) for a in row) for row in matrix) for matrix in (mass, damping, stiffness)))


def number(fraction):
    return mpmath.mpf(fraction.numerator) / fraction.denominator


# Where entries differ by more than this factor, doubles do not tell null vectors.
WIDE = 2**20


def simple_pole(problem, value):
    """Order and residue at a simple eigenvalue, from its left and right vectors, or from the inverse right beside it."""
    if problem.spread > WIDE:
        with mpmath.workdps(2 * polynomials.DIGITS):
            step = value * mpmath.mpf(10)**-30
            return 1, doubles(problem.at(value + step) ** -1 * step)
    with mpmath.workdps(polynomials.DIGITS):
        u, _, vh = np.linalg.svd(doubles(problem.at(value)))
    value = complex(value)
    slope = 2 * value * np.array(problem.mass, float) + np.array(problem.damping, float)
    left, right = u[:, -1].conj(), vh[-1].conj()
    return 1, np.outer(right, left) / (left @ slope @ right)


def pole(problem, value):
    """Order and leading coefficient at an eigenvalue, from the inverse right beside it."""
    with mpmath.workdps(3 * polynomials.DIGITS):
        steps = [(abs(value) or 1) * mpmath.mpf(10) ** -digits for digits in (15, 17)]
        inverses = [problem.at(value + step) ** -1 for step in steps]
        growth = mpmath.mnorm(inverses[1], 'f') / mpmath.mnorm(inverses[0], 'f')
        order = int(mpmath.nint(mpmath.log10(growth) / 2))
        return order, doubles(inverses[1] * steps[1] ** order)


def doubles(matrix):
    return np.array(matrix.tolist(), dtype=complex)
