"""Exact polynomials: coefficients are Fractions, the constant one first."""
from fractions import Fraction
from math import prod
from typing import NamedTuple

import mpmath

DIGITS = 60


def determinant(rows):
    """Of a square matrix of integers, by Bareiss' elimination without fractions."""
    rows, sign, previous = [list(row) for row in rows], 1, 1
    for k in range(len(rows) - 1):
        pivot = next((i for i in range(k, len(rows)) if rows[i][k]), None)
        if pivot is None:
            return 0
        if pivot != k:
            rows[k], rows[pivot], sign = rows[pivot], rows[k], -sign
        for i in range(k + 1, len(rows)):
            for j in range(k + 1, len(rows)):
                rows[i][j] = (rows[i][j] * rows[k][k] - rows[i][k] * rows[k][j]) // previous
        previous = rows[k][k]
    return sign * rows[-1][-1] if rows else 1


def rank(rows):
    """Of a matrix of Fractions or integers."""
    rows, found = [[Fraction(entry) for entry in row] for row in rows], 0
    for column in range(len(rows[0]) if rows else 0):
        pivot = next((i for i in range(found, len(rows)) if rows[i][column]), None)
        if pivot is None:
            continue
        rows[found], rows[pivot] = rows[pivot], rows[found]
        for i in range(found + 1, len(rows)):
            factor = rows[i][column] / rows[found][column]
            if factor:
                rows[i] = [a - factor * b for a, b in zip(rows[i], rows[found])]
        found += 1
    return found


def determinant_polynomial(coefficients):
    """Of the matrix polynomial with these square matrices of Fractions: interpolated between integers."""
    size, degree = len(coefficients[0]), (len(coefficients) - 1) * len(coefficients[0])
    common = 1
    for matrix in coefficients:
        for row in matrix:
            for entry in row:
                common = max(common, Fraction(entry).denominator)
    whole = [[[int(entry * common) for entry in row] for row in matrix] for matrix in coefficients]
    points = [(i + 1) // 2 * (-1) ** i for i in range(degree + 1)]
    values = []
    for point in points:
        at = [[sum(matrix[i][j] * point**k for k, matrix in enumerate(whole)) for j in range(size)] for i in range(size)]
        values.append(Fraction(determinant(at), common**size))
    for step in range(1, degree + 1):
        for i in range(degree, step - 1, -1):
            values[i] = (values[i] - values[i - 1]) / (points[i] - points[i - step])
    result = [Fraction(0)]
    for value, point in zip(reversed(values), reversed(points)):
        result = add(multiply(result, [Fraction(-point), Fraction(1)]), [value])
    return trimmed(result)


class Gaussian(NamedTuple):
    """A complex number of two Fractions."""
    real: Fraction
    imag: Fraction

    def __bool__(self):
        return bool(self.real or self.imag)

    def times(self, real, imag):
        return Gaussian(self.real * real - self.imag * imag, self.real * imag + self.imag * real)


def lossy_determinant_polynomial(coefficients, loss):
    """As determinant_polynomial, with i times another matrix of Fractions added to the constant coefficient. The
    determinant is a polynomial in the factor of that matrix, too: interpolated between integers, taken at i."""
    size = len(loss)
    points = range(size + 1)
    result = [Gaussian(Fraction(0), Fraction(0))] * (2 * size + 1)
    for point in points:
        constant = [[a + point * b for a, b in zip(*rows)] for rows in zip(coefficients[0], loss)]
        weight = Gaussian(Fraction(1, prod(point - other for other in points if other != point)), Fraction(0))
        for other in points:
            if other != point:
                weight = weight.times(-other, 1)
        for k, a in enumerate(determinant_polynomial([constant, *coefficients[1:]])):
            result[k] = Gaussian(result[k].real + a * weight.real, result[k].imag + a * weight.imag)
    return trimmed(result)


def trimmed(p):
    while p and not p[-1]:
        p = p[:-1]
    return p


def add(p, q):
    length = max(len(p), len(q))
    return trimmed([(p[i] if i < len(p) else 0) + (q[i] if i < len(q) else 0) for i in range(length)])


def multiply(p, q):
    result = [Fraction(0)] * max(len(p) + len(q) - 1, 0)
    for i, a in enumerate(p):
        for j, b in enumerate(q):
            result[i + j] += a * b
    return trimmed(result)


def monic(p):
    return [a / p[-1] for a in p]


def divide(p, q):
    """Quotient and remainder."""
    quotient, rest = [Fraction(0)] * max(len(p) - len(q) + 1, 0), list(p)
    for k in range(len(quotient) - 1, -1, -1):
        quotient[k] = rest[k + len(q) - 1] / q[-1]
        for j, b in enumerate(q):
            rest[k + j] -= quotient[k] * b
    return trimmed(quotient), trimmed(rest)


def common_divisor(p, q):
    while q:
        p, q = q, divide(p, q)[1]
        q = monic(q) if q else q
    return monic(p)


def derivative(p):
    return trimmed([k * a for k, a in enumerate(p)][1:])


def square_free_factors(p):
    """Pairs (factor, multiplicity) of a polynomial that is not constant, by Yun's algorithm."""
    factors, multiplicity, slope = [], 0, derivative(p)
    repeated = common_divisor(p, slope)
    rest, slope = divide(p, repeated)[0], divide(slope, repeated)[0]
    while len(rest) > 1:
        slope = add(slope, [-a for a in derivative(rest)])
        factor = common_divisor(rest, slope) if slope else monic(rest)
        multiplicity += 1
        if len(factor) > 1:
            factors.append((factor, multiplicity))
        rest, slope = divide(rest, factor)[0], divide(slope, factor)[0] if slope else []
    return factors


def roots(p):
    """Pairs (root, multiplicity) to DIGITS digits. Real roots are real, imaginary ones imaginary."""
    found = []
    with mpmath.workdps(DIGITS + 20):
        for factor, multiplicity in square_free_factors(p) if len(p) > 1 else []:
            numbers = [mpmath.mpf(a.numerator) / a.denominator for a in reversed(factor)]
            for root in mpmath.polyroots(numbers, maxsteps=500, extraprec=400):
                root = mpmath.mpc(root)
                near = abs(root) * mpmath.mpf(10) ** -DIGITS
                real = 0 if abs(root.real) <= near else root.real
                found.append((mpmath.mpc(real, 0 if abs(root.imag) <= near else root.imag), multiplicity))
    return found


def simple_roots(p):
    """As roots, of coefficients that are Gaussians; None where roots are not simple to a third of the digits."""
    with mpmath.workdps(DIGITS + 20):
        numbers = [mpmath.mpc(*(mpmath.mpf(part.numerator) / part.denominator for part in a)) for a in reversed(p)]
        try:
            found = mpmath.polyroots(numbers, maxsteps=500, extraprec=400)
        except mpmath.libmp.NoConvergence:
            return None
        found = [mpmath.mpc(root) for root in found]
        apart = mpmath.mpf(10) ** (-DIGITS // 3)
        if any(abs(a - b) <= apart * abs(a) for i, a in enumerate(found) for b in found[:i]):
            return None
        near = mpmath.mpf(10) ** -DIGITS
        return [(mpmath.mpc(root.real, 0 if abs(root.imag) <= near * abs(root) else root.imag), 1) for root in found]
