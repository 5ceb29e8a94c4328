"""Eigenvalues to more than double precision, by code that shares nothing with the solvers.

Newton's method on (P(lambda) phi + Cq^T xi, Cq phi, c^H phi - 1) = 0: residuals in extended precision, corrections
by SuperLU in double precision, so that the fixed point is that of the residual (iterative refinement).
"""

import warnings
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import MatrixRankWarning, splu

from .accuracy import damping_measure, extended

STEPS, LAST = 6, 3
WORST = 1e-9  # relative; what moves more between the last steps is not a reference
NEXT = 1e-6  # relative; nearer eigenvalues are one that is multiple, as far as Newton's method can tell


@dataclass
class Reference:
    """Modes in extended precision, by how much the last steps still moved them, relatively, and their condition numbers."""

    eigenvalues: np.ndarray
    frequency_uncertainty: np.ndarray
    damping_uncertainty: np.ndarray
    condition: np.ndarray

    @property
    def worst_uncertainty(self):
        """What the steps still moved, or what rounding of the residuals may hide from them, whichever is more."""
        rounding = np.finfo(np.longdouble).eps * self.condition / np.fmin(1, abs(damping_measure(self.eigenvalues)))
        return float(np.nanmax(np.concatenate([self.frequency_uncertainty, self.damping_uncertainty, rounding]), initial=0.0))


def refine_modes(problem, result):
    """The modes of a result, but for zeros and multiple eigenvalues, on which Newton's method settles."""
    newton = Newton(problem)
    refined = {
        i: newton.refine(result.eigenvalues[i], result.eigenvectors[i], result.multipliers[i])
        for i in np.flatnonzero(simple(result.eigenvalues))
    }
    settled = {i: steps for i, steps in refined.items() if steps is not None and spread(abs(steps)) < WORST}
    condition = np.full(len(result.eigenvalues), np.nan) if result.condition is None else result.condition
    return Reference(
        np.array([steps[-1] for steps in settled.values()], dtype=np.clongdouble),
        np.array([spread(abs(steps)) for steps in settled.values()]),
        np.array([spread(damping_measure(steps)) for steps in settled.values()]),
        condition[list(settled)],
    )


def simple(eigenvalues):
    """Which are neither zero nor next to another one, so that they have a shape of their own."""
    distances = abs(eigenvalues[:, None] - eigenvalues[None, :]) + np.diag(np.full(len(eigenvalues), np.inf))
    return (abs(eigenvalues) > 0) & (distances.min(axis=1) > NEXT * abs(eigenvalues))


def spread(values):
    """Largest relative distance from the last of them."""
    if values[-1] == 0:
        return 0.0
    return float(max(abs(values - values[-1])) / abs(values[-1]))


class Newton:
    """Keeps the matrices of a problem in both precisions."""

    def __init__(self, problem):
        self.problem = problem
        self.extended = [extended(a) for a in (problem.mass, problem.damping, problem.stiffness, problem.constraints)]
        self.transposed = self.extended[3].T.tocsr()
        # Multipliers in units that make the bordered matrix well scaled.
        self.scale = abs(problem.stiffness).max() or 1.0

    def refine(self, value, x, xi):
        """The eigenvalue after each of the last steps from the one given; None where the matrix is singular."""
        mass, damping, stiffness, constraints = self.extended
        c = np.conj(x) / np.vdot(x, x).real
        factors = self.factorize(value, x, c)
        if factors is None:
            return None
        n, m = len(x), len(xi)
        value, x, xi = np.clongdouble(value), x.astype(np.clongdouble), xi.astype(np.clongdouble)
        values = []
        for _ in range(STEPS):
            residual = np.concatenate(
                [
                    value**2 * (mass @ x) + value * (damping @ x) + stiffness @ x + self.transposed @ xi,
                    self.scale * (constraints @ x),
                    [c @ x - 1],
                ]
            )
            step = factors.solve(-residual.astype(complex)).astype(np.clongdouble)
            x, xi, value = x + step[:n], xi + self.scale * step[n : n + m], value + step[-1]
            values.append(value)
        return np.array(values[-LAST:]) if np.isfinite(complex(value)) else None

    def factorize(self, value, x, c):
        """[P Cq^T P'phi; Cq 0 0; c^H 0 0] at the start; all steps use it."""
        p = self.problem
        polynomial = value**2 * p.mass + value * p.damping + p.stiffness
        derivative = 2 * value * (p.mass @ x) + p.damping @ x
        border = self.scale * p.constraints
        rows = [[polynomial, border.T, derivative[:, None]], [border, None, None], [c[None, :], None, None]]
        if border.shape[0] == 0:
            rows = [[polynomial, derivative[:, None]], [c[None, :], None]]
        with warnings.catch_warnings():
            warnings.simplefilter("error", MatrixRankWarning)
            try:
                return splu(sp.bmat(rows, format="csc"))
            except (RuntimeError, MatrixRankWarning):
                return None
