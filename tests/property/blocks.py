"""Small modal problems, each of a few unknowns, and what is exactly known of them."""
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import mpmath
import numpy as np

import polynomials
from recipe import Unsuitable


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
    """lambda^2 mass + lambda damping + stiffness + i loss: square tuples of tuples of Fractions of one size."""
    mass: tuple
    damping: tuple
    stiffness: tuple
    # None: the problem has none.
    loss: tuple = None

    @property
    def size(self):
        return len(self.mass)

    @cached_property
    def polynomial(self):
        """The determinant, empty where it vanishes for every lambda."""
        coefficients = [self.stiffness, self.damping, self.mass]
        if self.loss:
            return polynomials.lossy_determinant_polynomial(coefficients, self.loss)
        return polynomials.determinant_polynomial(coefficients)

    @property
    def matrices(self):
        return (self.mass, self.damping, self.stiffness) + ((self.loss,) if self.loss else ())

    @cached_property
    def held(self):
        """What holds motions: stiffness and loss, one above the other."""
        if not self.loss:
            return self.stiffness
        both = [[*k, *(-h for h in g)] for k, g in zip(self.stiffness, self.loss)]
        both += [[*g, *k] for k, g in zip(self.stiffness, self.loss)]
        if polynomials.rank(both) != 2 * polynomials.rank(self.stiffness + self.loss):
            raise Unsuitable("stiffness and loss that hold a motion alone and not together")
        return self.stiffness + self.loss

    @cached_property
    def zeros(self):
        """Linearly independent motions that nothing holds: the zeros that a solver lists."""
        return self.size - polynomials.rank(self.held)

    @cached_property
    def null_vectors(self):
        """An orthonormal basis of them."""
        return np.linalg.svd(np.array(self.held, float))[2][self.size - self.zeros:].T

    @cached_property
    def zero_multiplicity(self):
        return next(k for k, a in enumerate(self.polynomial) if a)

    @cached_property
    def zero_order(self):
        """The order of the pole at zero: 1 where damping acts, 2 for a body that is free, more is no mechanics."""
        return pole(self, mpmath.mpc(0))[0] if self.zeros else 0

    @cached_property
    def eigenvalues(self):
        """All that are finite and not zero; of a complex pair, and with losses of all, those above the real axis and on it."""
        found = []
        if self.loss:
            roots = polynomials.simple_roots(self.polynomial[self.zero_multiplicity:])
            if roots is None:
                raise Unsuitable("a block with an eigenvalue twice")
            if any(0 < abs(value.imag) < BESIDE_AXIS * abs(value) for value, _ in roots):
                raise Unsuitable("an eigenvalue just beside the real axis")
        else:
            roots = polynomials.roots(self.polynomial[self.zero_multiplicity:])
        for value, multiplicity in roots:
            if value.imag >= 0:
                order, coefficient = simple_pole(self, value) if multiplicity == 1 else pole(self, value)
                found.append(Eigenvalue(value, multiplicity, order, coefficient))
        return found

    @cached_property
    def spread(self):
        """The largest entry by the smallest that is not zero."""
        sizes = [abs(a) for matrix in self.matrices for row in matrix for a in row if a]
        return max(sizes, default=1) / min(sizes, default=1)

    def at(self, value):
        """P(value) with many digits."""
        terms = zip(self.mass, self.damping, self.stiffness, self.loss or [[0] * self.size] * self.size)
        return mpmath.matrix([[value * (value * number(m) + number(r)) + mpmath.mpc(number(k), number(h))
                               for m, r, k, h in zip(*rows)] for rows in terms])


def block(mass, damping, stiffness, loss=None):
    """From anything that converts to Fractions; None for no damping, or no loss."""
    size = len(mass)
    damping = [[0] * size for _ in range(size)] if damping is None else damping
    matrices = (mass, damping, stiffness) if loss is None else (mass, damping, stiffness, loss)
    return Block(*(tuple(tuple(Fraction(a) for a in row) for row in matrix) for matrix in matrices))


def number(fraction):
    return mpmath.mpf(fraction.numerator) / fraction.denominator


# What is nearer to the real axis than this part of itself may be above or below it.
BESIDE_AXIS = 1e-8
# Where entries differ by more than this factor, doubles do not tell null vectors; a sum below this part of its terms is rounding.
WIDE, CANCELLED = 2**20, 1e-6


def simple_pole(problem, value):
    """Order and residue at a simple eigenvalue, from its left and right vectors, or from the inverse right beside it."""
    if problem.spread <= WIDE:
        with mpmath.workdps(polynomials.DIGITS):
            u, _, vh = np.linalg.svd(doubles(problem.at(value)))
        left, right = u[:, -1].conj(), vh[-1].conj()
        slope = 2 * complex(value) * np.array(problem.mass, float) + np.array(problem.damping, float)
        if abs(left @ slope @ right) > CANCELLED * abs(left) @ abs(slope) @ abs(right):
            return 1, np.outer(right, left) / (left @ slope @ right)
    with mpmath.workdps(2 * polynomials.DIGITS):
        step = value * mpmath.mpf(10)**-30
        return 1, doubles(problem.at(value + step) ** -1 * step)


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
