"""The eigenvalues nearest a target, by code that shares nothing with the solver, and how well each is determined.

Up to n = 20 the whole spectrum in 120 digits (mpmath), up to 600 dense, above by ARPACK about two shifts. Every method
works on the reverse of P(s + t), divided by P(s), whose largest eigenvalues 1/t are wanted: infinite ones are zeros there.
What is not exact is corrected by a Galerkin step on the left and right vectors of each cluster, with residuals in
extended precision.
"""

import warnings
from dataclasses import dataclass

import mpmath as mp
import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from scipy.optimize import linear_sum_assignment
from scipy.sparse.linalg import LinearOperator, eigs, splu

EXACT, DENSE = 20, 600
DIGITS = 120
EPS = np.finfo(float).eps
BACKWARD = 1e-13  # what the solver promises of a mode: more is refined
SAME = 1e-3  # relative distance up to which values found about two shifts may be one
CLUSTER = 1e-6  # relative distance of eigenvalues that are treated together
DEFECTIVE = 1e10  # scaled condition number from which vectors say nothing about the eigenvalue


@dataclass
class Eigenvalue:
    """A finite eigenvalue, and how far a perturbation of BACKWARD of the norms of M, R, K moves it."""

    value: complex
    tolerance: float
    condition: float = np.inf

    @property
    def is_determined(self):
        """Not so, for instance, where rounding makes a finite eigenvalue of an infinite one."""
        return self.value == 0 or self.tolerance < abs(self.value)


class SingularProblem(Exception):
    """P(s) has no inverse for any s."""


class Quadratic:
    """P(lambda) = lambda^2 M + lambda R + K."""

    def __init__(self, mass, damping, stiffness):
        self.matrices = [sp.csc_matrix(a, dtype=float) for a in (mass, damping, stiffness)]
        self.n = self.matrices[0].shape[0]
        self.norms = np.array([abs(a).sum(axis=1).max() for a in self.matrices])
        self.longer = [a.tocsr().astype(np.longdouble) for a in self.matrices]

    def powers(self, value):
        return np.array([value * value, value, value**0])

    def at(self, value, matrices=None):
        return sum(p * a for p, a in zip(self.powers(value), matrices or self.matrices))

    def weight(self, value):
        """|lambda|^2 ||M|| + |lambda| ||R|| + ||K||, the measure of backward errors."""
        return self.powers(abs(value)) @ self.norms

    def scaled(self, value):
        """Powers of two d, e for which diag(d) P diag(e) has rows and columns of like size at this |lambda|."""
        sizes = self.at(abs(value), [abs(a) for a in self.matrices]).tocsc()
        rows, columns = np.ones((2, self.n))
        for _ in range(5):
            now = (sp.diags(rows) @ sizes @ sp.diags(columns)).tocsc()
            for scale, axis in ((rows, 1), (columns, 0)):
                largest = now.max(axis=axis).toarray().ravel()
                scale *= 2.0 ** np.round(-np.log2(np.where(largest > 0, largest, 1)) / 2)
        return rows, columns

    def solver(self, value):
        """x -> P(value)^-1 x and x -> P(value)^-H x."""
        rows, columns = self.scaled(value)
        p = (sp.diags(rows) @ self.at(complex(value)) @ sp.diags(columns)).tocsc()
        if self.n <= DENSE:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", la.LinAlgWarning)
                lu, exchanges = la.lu_factor(p.toarray())
            zeros = np.flatnonzero(abs(np.diag(lu)) < EPS)
            lu[zeros, zeros] = EPS
            factors = lu, exchanges
            forward, adjoint = lambda b: la.lu_solve(factors, b), lambda b: la.lu_solve(factors, b, trans=2)
        else:
            lu = splu(p)
            forward, adjoint = lu.solve, lambda b: lu.solve(b, "H")
        return (
            lambda b: columns[:, None] * forward(rows[:, None] * b),
            lambda b: rows[:, None] * adjoint(columns[:, None] * b),
        )

    def backward_error(self, value):
        """The smallest change of M, R, K, relative to their norms, of which this is an eigenvalue."""
        try:
            solve, adjoint = self.solver(value)
        except RuntimeError:
            return 0.0
        x = np.random.default_rng(1).standard_normal((self.n, 2)) + 0j
        for _ in range(6):
            x = la.qr(x, mode="economic")[0]
            x = adjoint(solve(x))
        smallest = 1 / np.sqrt(la.norm(x, 2))
        return smallest / self.weight(value)


def exact_spectrum(problem):
    """All finite eigenvalues, zeros once per null vector of K; mpmath's complex numbers."""
    n = problem.n
    with mp.workdps(DIGITS):
        m, r, k = (mp.matrix(a.toarray().tolist()) for a in problem.matrices)
        s = mp.mpf(2) ** int(np.round(np.log2((problem.norms[2] / problem.norms[0]) ** 0.5))) * mp.mpf("0.7390851")
        p = s * s * m + s * r + k
        if nullity(p) > 0:
            raise SingularProblem
        inverse = p**-1
        companion = mp.zeros(2 * n)
        companion[:n, :n], companion[:n, n:] = -s * inverse * (2 * s * m + r), -s * s * inverse * m
        for i in range(n):
            companion[n + i, i] = 1
        reciprocals = mp.eig(companion, left=False, right=False)
        values = [s + s / v for v in reciprocals if abs(v) > mp.mpf(10) ** -18]
        scale = mp.mpf(10) ** -20 * s
        return [complex(mp.chop(v, abs(v) * mp.mpf(10) ** -18)) for v in values if abs(v) > scale] + [0j] * nullity(k)


def nullity(a):
    """Of a matrix of more than double precision, by complete pivoting."""
    a, rank = a.copy(), 0
    scale = max(abs(x) for x in a)
    while rank < a.rows:
        size, i, j = max((abs(a[i, j]), i, j) for i in range(rank, a.rows) for j in range(rank, a.cols))
        if size <= scale * mp.mpf(10) ** (-DIGITS // 2):
            break
        for c in range(a.cols):
            a[rank, c], a[i, c] = a[i, c], a[rank, c]
        for c in range(a.rows):
            a[c, rank], a[c, j] = a[c, j], a[c, rank]
        for c in range(rank + 1, a.rows):
            factor = a[c, rank] / a[rank, rank]
            for d in range(rank, a.cols):
                a[c, d] -= factor * a[rank, d]
        rank += 1
    return a.rows - rank


def dense_spectrum(problem, target):
    """All eigenvalues, best near the target; the far ones are rounding where M is singular."""
    n = problem.n
    m, r, k = (a.toarray() for a in problem.matrices)
    unit = max(abs(target), 1e-3 * np.sqrt(problem.norms[2] / problem.norms[0]))
    for _ in range(2):
        s = target + unit * (0.0137 + 0.0071j)
        solve, _ = problem.solver(s)
        top = np.hstack([-solve(unit * (2 * s * m + r)), -solve(unit * unit * m)])
        reciprocals = la.eigvals(np.vstack([top, np.eye(n, 2 * n)]))
        reciprocals = reciprocals[abs(reciprocals) > 1e-9 * abs(reciprocals).max()]
        values = s + unit / reciprocals
        unit = np.sort(abs(values - s))[min(40, len(values) - 1)]
    return values


def sparse_spectrum(problem, target, wanted):
    """The `wanted` eigenvalues nearest two shifts by the target, together."""
    n, count = problem.n, 3 * wanted
    m, r, _ = problem.matrices
    unit = max(abs(target), 1e-3 * np.sqrt(problem.norms[2] / problem.norms[0]))
    found = []
    for seed, step in enumerate((0.0137 + 0.0071j, -0.0093 + 0.0151j)):
        s = target + unit * step
        solve, _ = problem.solver(s)

        def apply(v, s=s, solve=solve):
            t = -solve((unit * (2 * s * (m @ v[:n]) + r @ v[:n]) + unit * unit * (m @ v[n:]))[:, None])[:, 0]
            return np.concatenate([t, v[:n]])

        start = np.random.default_rng(seed).standard_normal(2 * n) + 0j
        operator = LinearOperator((2 * n, 2 * n), apply, dtype=complex)
        reciprocals = eigs(operator, count, ncv=2 * count + 20, v0=apply(apply(start)), return_eigenvectors=False)
        values = s + unit / reciprocals
        reach = np.sort(abs(values - target))[min(len(values) - 1, 2 * wanted)]
        found.append(values[abs(values - target) <= reach])
    first, second = found
    gap = abs(first[:, None] - second[None, :])
    pairs = zip(*linear_sum_assignment(np.minimum(gap, SAME * abs(second))))
    lost = set(range(len(second))) - {j for i, j in pairs if gap[i, j] < SAME * abs(second[j])}
    return np.append(first, second[sorted(lost)])  # copies that the first missed


def clusters(values):
    """Groups of indices of values that are close to each other."""
    left, groups = set(range(len(values))), []
    while left:
        group, new = set(), {left.pop()}
        while new:
            group |= new
            new = {j for j in left if min(abs(values[j] - values[i]) for i in new) <= CLUSTER * abs(values[j])}
            left -= new
        groups.append(sorted(group))
    return groups


def orthonormal(scale, x):
    """A basis of the columns of x, orthonormal after division by the scale."""
    return scale[:, None] * la.qr(x / scale[:, None], mode="economic")[0]


def corrected(problem, group, are_exact):
    """The eigenvalues of a cluster, corrected unless they are exact or nearly defective, with their tolerances."""
    group = np.array(group)
    size, random = len(group), np.random.default_rng(2)
    x, y = random.standard_normal((2, problem.n, size)) + 0j
    for step in range(1 if are_exact else 2):
        centre = group.mean()
        rows, columns = problem.scaled(centre)
        if not (step == 0 and not are_exact and centre == 0):
            at = centre * (1 + 1e-15) if centre else 1e-14 * np.sqrt(problem.norms[2] / problem.norms[0])
            solve, adjoint = problem.solver(at)
            for _ in range(3):
                x, y = orthonormal(columns, solve(x)), orthonormal(rows, adjoint(y))
        exact = np.clongdouble(centre)
        products = [a @ x.astype(np.clongdouble) for a in problem.longer]
        residual = (y.conj().T @ sum(p * b for p, b in zip(problem.powers(exact), products))).astype(complex)
        slope = (y.conj().T @ (2 * exact * products[0] + products[1])).astype(complex)
        steps, left, right = la.eig(-residual, slope, left=True)
        u, v = x @ right, y @ left
        slopes = abs(np.einsum("ij,ij->j", left.conj(), slope @ right))
        scaled_weight = (abs(v).T @ problem.at(abs(centre), [abs(a) for a in problem.matrices]) @ abs(u)).diagonal()
        defective = np.any(scaled_weight > DEFECTIVE * abs(centre) * slopes) if centre else False
        moves = not are_exact and not defective and np.all(abs(steps) < 0.1 * abs(centre))
        if moves:
            group = centre + steps
    slopes = np.maximum(slopes, 1e-300)
    first_order = problem.weight(centre) * la.norm(u, axis=0) * la.norm(v, axis=0) / slopes
    if not moves:  # which vector belongs to which value is not known
        first_order = np.full(size, first_order.max())
    return [
        Eigenvalue(complex(value), BACKWARD * order, order / abs(value) if value else np.inf)
        for value, order in zip(group, first_order)
    ]


def limited(eigenvalues):
    """First-order bounds are too large where eigenvalues nearly meet: c of them move by the c-th root at most.

    The root is relative to the eigenvalue, or where it is next to zero to its distance from those that are not.
    """
    values = np.array([e.value for e in eigenvalues])
    for e in eigenvalues:
        gaps = np.sort(abs(values - e.value))
        for c in range(2, min(7, len(gaps))):
            others = gaps[gaps > 1e-6 * gaps[-1]]
            scale = abs(e.value) if abs(e.value) > 10 * BACKWARD**0.5 * others[0] else others[0]
            root = 10 * scale * BACKWARD ** (1 / c)
            if gaps[c - 1] <= root:
                e.tolerance = max(min(e.tolerance, root), BACKWARD * abs(e.value))
                break
    return eigenvalues


def conjugate(values):
    """Next to the real axis rounding leaves reals and pairs that are none: what has no partner there is real."""
    values = list(values)
    for i in sorted(range(len(values)), key=lambda i: -abs(values[i].imag)):
        v = values[i]
        if 0 < abs(v.imag) < SAME * abs(v):
            others = [j for j in range(len(values)) if j != i and values[j].imag * v.imag < 0]
            partner = min(others, key=lambda j: abs(values[j] - np.conj(v)), default=None)
            if partner is not None and abs(values[partner] - np.conj(v)) < abs(v.imag):
                values[partner] = np.conj(v)
            else:
                values[i] = complex(v.real)
    return np.array(values)


def with_zeros(problem, values):
    """Zeros once per null vector of K in the place of what rounding makes of them; how far from zero a double one may be."""
    left, sizes, right = la.svd(problem.matrices[2].toarray())
    null = sizes <= problem.n * EPS * sizes[0]
    if not null.any():
        return values, 0.0
    inertia = la.norm(left[:, null].T @ problem.matrices[0] @ right[null].T, 2)
    radius = np.sqrt(problem.n * BACKWARD * sizes[0] / max(inertia, EPS * problem.norms[0]))
    return np.append(values[abs(values) > radius], np.zeros(null.sum())), radius


def nearest(problem, target, wanted, spectrum=None):
    """The finite eigenvalues around the target, more than `wanted`, by distance; `spectrum` is an exact one."""
    radius = 0.0
    if spectrum is not None:
        values, radius = np.array(spectrum), with_zeros(problem, np.zeros(0))[1] if 0 in spectrum else 0.0
    elif problem.n <= DENSE:
        values, radius = with_zeros(problem, dense_spectrum(problem, target))
    else:
        values = sparse_spectrum(problem, target, wanted)

    def distance(value):
        return min(abs(value - target), abs(np.conj(value) - target))

    values = np.array(sorted(values, key=distance))
    if spectrum is None:
        values = conjugate(values[: 2 * wanted + 10])
    result = []
    for group in clusters(values):
        result += corrected(problem, values[group], spectrum is not None)
    if spectrum is None:
        for e, value in zip(result, conjugate([e.value for e in result])):
            e.value = value
    result = limited(result)
    for e in result:
        if e.value == 0 and radius > 0:
            e.tolerance = radius
    return sorted(result, key=lambda e: distance(e.value))
