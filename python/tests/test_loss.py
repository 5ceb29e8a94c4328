"""Structural damping: modes with a loss matrix H against LAPACK's QZ of another linearisation, and closed forms."""
from __future__ import annotations

import itertools
import os

import numpy as np
import pytest
import scipy.linalg as linalg
import scipy.sparse as sparse

import kschur
from kschur.errors import UsageError

SEEDS = range(*map(int, os.environ.get("KSCHUR_LOSS_SEEDS", "0:60").split(":")))


def semidefinite(random, n, rank):
    factor = random.standard_normal((n, rank))
    return factor @ factor.T


def without_rounding(matrix):
    return np.where(np.abs(matrix) > 1e-14 * np.abs(matrix).max(), matrix, 0.0)


class Problem:
    """A random problem with losses."""

    def __init__(self, seed):
        random = np.random.default_rng(seed)
        self.symmetric = random.random() < 0.6
        self.n = n = int(random.integers(2, 13)) if random.random() < 0.9 else 45
        self.m = int(random.integers(0, n // 2 + 1)) if random.random() < 0.5 else 0
        self.free = random.random() < 0.25 and n - self.m > 2
        self.proportional = random.random() < 0.3
        mass = semidefinite(random, n, n) + n * np.eye(n)
        stiffness = semidefinite(random, n, n) + 0.1 * np.eye(n)
        losses = semidefinite(random, n, int(random.integers(1, n + 1))) * 10 ** random.uniform(-3, 0)
        damping = [np.zeros((n, n)), 0.02 * mass + 0.01 * stiffness, semidefinite(random, n, n) * 0.05][int(random.integers(3))]
        if not self.symmetric:
            skew = random.standard_normal((2, n, n))
            stiffness = stiffness + 0.3 * (skew[0] - skew[0].T)
            damping = damping + 0.3 * (skew[1] - skew[1].T)
            losses = losses + 0.05 * random.standard_normal((n, n))
        self.Cq = random.standard_normal((self.m, n))
        if random.random() < 0.5:
            # Clamps and ties.
            for row in self.Cq:
                row[random.permutation(n)[int(random.integers(1, 3)):]] = 0
        self.rigid = 0
        if self.free:
            # A motion that the constraints allow, without stiffness, and with or without losses.
            motion = linalg.null_space(self.Cq)[:, 0] if self.m else linalg.orth(random.standard_normal((n, 1)))[:, 0]
            projector = np.eye(n) - np.outer(motion, motion)
            stiffness = without_rounding(projector @ stiffness @ projector)
            self.rigid = 1
            if random.random() < 0.7 or self.proportional:
                losses = without_rounding(projector @ losses @ projector)
            else:
                self.rigid = 0
        if self.proportional:
            losses = 0.05 * stiffness
        if random.random() < 0.1 and not self.free and n - self.m > 2:
            # An unknown without mass and damping: there are two eigenvalues less.
            mass[0], mass[:, 0], damping[0], damping[:, 0] = 0, 0, 0, 0
            mass[0, 0] = 0
        elif random.random() < 0.15 and n < 13:
            mass, damping, stiffness, losses = (np.kron(np.eye(2), a) for a in (mass, damping, stiffness, losses))
            self.Cq, self.n, self.m, self.rigid = np.kron(np.eye(2), self.Cq), 2 * n, 2 * self.m, 2 * self.rigid
        # Units.
        rate, size = 10 ** random.uniform(-3, 5), 10 ** random.uniform(-6, 6)
        self.M, self.R, self.K, self.H = size * mass, size * rate * damping, size * rate**2 * stiffness, size * rate**2 * losses
        self.rate = rate

    def eigenvalues(self):
        """Above the real axis, and those at and on it, by QZ on the motions that the constraints allow."""
        basis = linalg.null_space(self.Cq) if self.m else np.eye(self.n)
        mass, damping, stiffness, losses = (basis.T @ a @ basis for a in (self.M, self.R, self.K, self.H))
        rate, size = self.rate, np.linalg.norm(mass)
        mass, damping, stiffness = mass / size, damping / size / rate, (stiffness + 1j * losses) / size / rate**2
        zero, one = np.zeros_like(mass), np.eye(len(mass))
        alpha, beta = linalg.eigvals(np.block([[zero, one], [-stiffness, -damping]]), np.block([[one, zero], [zero, mass]]),
                                     homogeneous_eigvals=True)
        finite = np.abs(beta) > 1e-6 * np.abs(alpha)
        return rate * alpha[finite] / beta[finite]


def compare(problem, result, modes):
    """What is wrong with it: a sentence, or nothing."""
    expected = problem.eigenvalues()
    scale = np.abs(expected).max()
    # A zero without losses is double, and blurred to the root of rounding.
    near_zero = np.abs(expected) < 1e-5 * scale
    upper = expected[~near_zero & (expected.imag > 0)]
    found = np.asarray(result.eigenvalues)
    if result.reason not in ("converged", "fewer_modes"):
        return f"flagged {result.reason}"
    zeros = found[np.abs(found) < 1e-5 * scale]
    if problem.rigid and result.reason == "converged" and np.abs(zeros).min(initial=np.inf) > 0:
        return f"the rigid motion is not an exact zero: {zeros}"
    above = found[np.abs(found) >= 1e-5 * scale]
    for value in above:
        if np.abs(expected - value).min() > 1e-7 * max(abs(value), 1e-3 * scale):
            return f"{value} is no eigenvalue"
    reach = np.abs(above).max(initial=0) if result.reason == "converged" else np.inf
    for value in upper:
        near = 1e-6 * abs(value)
        if abs(value) < reach * (1 - 1e-6) and (np.abs(above - value) < near).sum() != (np.abs(upper - value) < near).sum():
            return f"{value} is missing, or there too often"
    if (np.asarray(result.backward_error) > 1e-10).any():
        return f"backward errors {result.backward_error}"
    return ""


@pytest.mark.parametrize("seed", SEEDS)
def test_random_problem_has_the_eigenvalues_of_another_linearisation(seed):
    problem = Problem(seed)
    modes = int(np.random.default_rng(seed + 10**6).integers(1, problem.n + 2))
    for formulation in ("auto", "dense", "quadratic"):
        if formulation == "quadratic":
            # Of more modes than there are an iteration asked for by name finds all, but does not know that they are all.
            modes = min(modes, problem.n - problem.m - 1) or 1
        result = kschur.solve(problem.M, problem.K, problem.R, problem.Cq if problem.m else None, modes=modes, loss=problem.H,
                              formulation=formulation, certify=formulation == "quadratic")
        assert compare(problem, result, modes) == "", formulation
        assert result.certified is not False, formulation


@pytest.mark.parametrize("seed", SEEDS)
def test_pencils_and_arpack_find_the_same(seed):
    problem = Problem(seed)
    modes = min(int(np.random.default_rng(seed + 10**6).integers(1, problem.n + 2)), problem.n - problem.m - 1) or 1
    ways = [{"formulation": "damped-constrained"}, {"formulation": "damped-constrained-zero"}, {"method": "arpack"},
            {"method": "arpack", "formulation": "damped-constrained"}]
    if problem.m == 0:
        ways.append({"formulation": "damped"})
    if not problem.R.any():
        ways += [{"formulation": "undamped-constrained"}, {"formulation": "undamped-constrained-zero"}]
        if problem.m == 0:
            ways += [{"formulation": "undamped"}, {"formulation": "undamped-negative"}]
    for way in ways:
        result = kschur.solve(problem.M, problem.K, problem.R, problem.Cq if problem.m else None, modes=modes, loss=problem.H, **way)
        assert compare(problem, result, modes) == "", way


def test_unstable_modes_of_lossy_pencils_on_the_axis():
    # Two masses apart: one held by a negative spring without losses, of both real roots, and one by a spring with losses.
    M, K, H = np.eye(2), np.diag([-4.0, 9.0]), np.diag([0.0, 1.8])
    expected = [-2.0, 2.0, 1j * np.sqrt(9.0 + 1.8j)]
    for formulation in ("undamped", "undamped-negative", "undamped-constrained", "damped", "quadratic", "dense"):
        found = kschur.solve(M, K, modes=3, loss=H, formulation=formulation).eigenvalues
        np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(expected), rtol=1e-13, atol=1e-13, err_msg=formulation)


def rod(elements, length=1.0, modulus=2.0e11, density=7800.0):
    """Consistent mass and stiffness of a clamped-free bar."""
    h = length / elements
    ones = np.ones(elements)
    ones[-1] = 0.5
    stiffness = modulus / h * sparse.diags([-np.ones(elements - 1), 2 * ones, -np.ones(elements - 1)], [-1, 0, 1])
    mass = density * h / 6 * sparse.diags([np.ones(elements - 1), 4 * ones, np.ones(elements - 1)], [-1, 0, 1])
    return sparse.csr_matrix(mass), sparse.csr_matrix(stiffness)


def test_bar_of_complex_modulus():
    eta, elements = 0.08, 400
    M, K = rod(elements)
    result = kschur.solve(M, K, modes=5, loss=eta)
    # Of linear elements: omega^2 = 6 E/(rho h^2) (1 - cos k h)/(2 + cos k h), k = (2 j - 1) pi/(2 L).
    phase = (2 * np.arange(1, 6) - 1) * np.pi / 2 / elements
    omega = np.sqrt(6 * 2.0e11 / 7800 * elements**2 * (1 - np.cos(phase)) / (2 + np.cos(phase)))
    np.testing.assert_allclose(result.eigenvalues, 1j * omega * np.sqrt(1 + 1j * eta), rtol=1e-11)
    np.testing.assert_allclose(result.loss_factor, eta, rtol=1e-11)
    assert result.formulation == "proportional" and result.certified is True


def sandwich(elements, span, bending, axial, shear, mass):
    """A three-layer beam on two supports: Hermite cubics for the deflection w, quadratics for the displacements u and v of the
    faces along the beam. The energies are 1/2 bending w''^2, 1/2 axial (u'^2 + v'^2) and 1/2 shear (u - v + w')^2, with lengths
    in units of the distance of the middles of the faces. Returns M, K of the faces and of the core."""
    h = span / elements
    points, weights = np.polynomial.legendre.leggauss(5)
    per_node = 2 * (elements + 1)
    faces = 2 * elements + 1
    order = per_node + 2 * faces
    M, faces_K, core_K = (np.zeros((order, order)) for _ in range(3))
    for e in range(elements):
        w = np.arange(2 * e, 2 * e + 4)
        u = per_node + np.arange(2 * e, 2 * e + 3)
        v = u + faces
        for point, weight in zip((points + 1) / 2, weights * h / 2):
            s = point
            deflection = np.array([1 - 3 * s**2 + 2 * s**3, h * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, h * (s**3 - s**2)])
            slope = np.array([6 * s**2 - 6 * s, h * (1 - 4 * s + 3 * s**2), 6 * s - 6 * s**2, h * (3 * s**2 - 2 * s)]) / h
            curvature = np.array([12 * s - 6, h * (6 * s - 4), 6 - 12 * s, h * (6 * s - 2)]) / h**2
            along = np.array([(1 - s) * (1 - 2 * s), 4 * s * (1 - s), s * (2 * s - 1)])
            strain = np.array([4 * s - 3, 4 - 8 * s, 4 * s - 1]) / h
            M[np.ix_(w, w)] += weight * mass * np.outer(deflection, deflection)
            faces_K[np.ix_(w, w)] += weight * bending * np.outer(curvature, curvature)
            faces_K[np.ix_(u, u)] += weight * axial * np.outer(strain, strain)
            faces_K[np.ix_(v, v)] += weight * axial * np.outer(strain, strain)
            sheared, unknowns = np.concatenate([slope, along, -along]), np.concatenate([w, u, v])
            core_K[np.ix_(unknowns, unknowns)] += weight * shear * np.outer(sheared, sheared)
    # Both faces without mass: one end holds them along the beam.
    supports = np.zeros((3, order))
    supports[0, 0] = supports[1, per_node - 2] = supports[2, per_node] = 1
    return M, faces_K, core_K, supports


def test_sandwich_of_ross_kerwin_and_ungar():
    # D. Ross, E. E. Ungar, E. M. Kerwin (1959): on two supports shapes are sines of wave number k, and the bending stiffness is
    # D = D_faces + (axial/2) g/(1 + g), g = 2 shear (1 + i eta)/(axial k^2).
    span, bending, axial, shear, mass, eta = 1.0, 2.0e-3, 3.0, 9.0, 1.0e-3, 0.7
    M, faces, core, supports = sandwich(40, span, bending, axial, shear, mass)
    result = kschur.solve(M, faces + core, Cq=supports, loss=eta * core, modes=4)
    k = np.arange(1, 5) * np.pi / span
    g = 2 * shear * (1 + 1j * eta) / (axial * k**2)
    expected = 1j * k**2 * np.sqrt((bending + axial / 2 * g / (1 + g)) / mass)
    np.testing.assert_allclose(result.eigenvalues, expected, rtol=2e-6)
    np.testing.assert_allclose(result.loss_factor, (expected**2).imag / (expected**2).real, rtol=2e-6)


def test_chain_of_two_materials():
    mpmath = pytest.importorskip("mpmath")
    n, losses = 12, (0.02, 0.6)
    springs = np.ones(n + 1)
    etas = np.where(np.arange(n + 1) < n // 2, *losses)

    def chain(k):
        return np.diag(k[:-1] + k[1:]) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)
    K, H = chain(springs), chain(springs * etas)
    with mpmath.workdps(30):
        squares = mpmath.eig(mpmath.matrix((K + 1j * H).tolist()), left=False, right=False)
        roots = [complex(1j * mpmath.sqrt(square)) for square in squares]
    expected = np.array(sorted(roots, key=abs))
    for formulation in ("auto", "dense", "quadratic"):
        result = kschur.solve(np.eye(n), K, loss=H, modes=n - 2, formulation=formulation)
        np.testing.assert_allclose(result.eigenvalues, expected[:n - 2], rtol=1e-13)


def test_complex_stiffness_is_taken_apart():
    M, K = rod(50)
    whole = kschur.solve(M, K * (1 + 0.05j), modes=4)
    apart = kschur.solve(M, K, modes=4, loss=0.05 * K)
    np.testing.assert_allclose(whole.eigenvalues, apart.eigenvalues, rtol=1e-13)
    with pytest.raises(UsageError, match="complex"):
        kschur.solve(M, K * (1 + 0.05j), loss=0.1)


def test_proportional_damping_beside_losses():
    M, K = rod(60)
    alpha, beta, eta = 40.0, 2e-6, 0.1
    result = kschur.solve(M, K, alpha * M + beta * K, modes=4, loss=eta)
    square = linalg.eigh(K.toarray(), M.toarray(), eigvals_only=True)[:4]
    half = (alpha + beta * square) / 2
    root = np.sqrt(half**2 - square * (1 + 1j * eta) + 0j)
    expected = np.where((-half + root).imag > 0, -half + root, -half - root)
    np.testing.assert_allclose(result.eigenvalues, expected, rtol=1e-9)
    assert result.formulation in ("proportional", "dense")


def test_response_is_that_of_the_complex_stiffness():
    M, K = rod(30)
    H = sparse.csr_matrix(K.multiply(0.1))
    force = np.zeros(30)
    force[-1] = 1.0
    hz = [-900.0, 700.0, 1270.0]
    response = kschur.frequency_response(M, K, frequencies=hz, forces=force, loss=H)
    for f, x in zip(hz, response.displacement):
        w = 2 * np.pi * f
        expected = np.linalg.solve((K + 1j * np.sign(f) * H - w**2 * M).toarray(), force)
        np.testing.assert_allclose(x, expected, rtol=1e-9)
    still = kschur.frequency_response(M, K, frequencies=0.0, forces=force, loss=H).displacement[0]
    np.testing.assert_allclose(still, np.linalg.solve(K.toarray(), force), rtol=1e-9)


def test_left_vectors_of_losses():
    for seed, formulation in itertools.product((3, 4, 5, 6), ("auto", "damped", "undamped")):
        problem = Problem(seed)
        if problem.m or problem.free or (formulation == "undamped" and problem.R.any()):
            continue
        result = kschur.solve(problem.M, problem.K, problem.R, modes=3, loss=problem.H, left=True, formulation=formulation)
        for value, right, left in zip(result.eigenvalues, result.shapes.T, result.left_shapes.T):
            matrix = value**2 * problem.M + value * problem.R + problem.K + 1j * problem.H
            size = np.abs(value) ** 2 * np.linalg.norm(problem.M) + np.linalg.norm(problem.K)
            assert np.linalg.norm(matrix @ right) < 1e-11 * size
            assert np.linalg.norm(left.conj() @ matrix) < 1e-11 * size


def local_matrix(random, n, free, follower):
    """A few springs or dampers to ground or between two unknowns; of a follower the force is at another unknown."""
    matrix = np.zeros((n, n))
    for _ in range(int(random.integers(1, 3))):
        first, second = random.permutation(n)[:2]
        depends = np.zeros(n)
        depends[first] = 1.0
        if free or random.random() < 0.5:
            depends[second] = -1.0
        acts = depends if not follower or free else np.eye(n)[second]
        matrix += 0.5 * 10 ** random.uniform(-2, 1) * np.outer(acts, depends)
    return matrix


@pytest.mark.parametrize("seed", SEEDS)
def test_losses_of_few_unknowns_are_low_rank(seed):
    random = np.random.default_rng(seed)
    n = int(random.integers(20, 60))
    springs = random.uniform(0.5, 2.0, n + 1)
    free, follower = random.random() < 0.3, random.random() < 0.3
    if free:
        springs[[0, -1]] = 0.0
    K = np.diag(springs[:-1] + springs[1:]) - np.diag(springs[1:-1], 1) - np.diag(springs[1:-1], -1)
    M = np.diag(random.uniform(0.5, 2.0, n))
    alpha, beta = random.uniform(0.0, [0.1, 0.05]) * (random.random() < 0.5)
    g = 0.15 * (random.random() < 0.6)
    R, H = alpha * M + beta * K, g * K + local_matrix(random, n, free, follower)
    if random.random() < 0.5:
        R = R + local_matrix(random, n, free, follower)
    modes, rate = int(random.integers(1, 12)), 10 ** random.uniform(-3, 5)
    result = kschur.solve(M, rate**2 * K, rate * R, modes=modes, loss=rate**2 * H, formulation="low-rank", left=follower)
    assert result.reason == "converged"
    zero, one = np.zeros((n, n)), np.eye(n)
    expected = linalg.eigvals(np.block([[zero, one], [-K - 1j * H, -R]]), linalg.block_diag(one, M))
    found = np.asarray(result.eigenvalues) / rate
    if free:
        assert np.abs(found).min() == 0.0
        # A zero of QZ is double, and blurred.
        found, expected = found[np.abs(found) > 1e-6], expected[np.abs(expected) > 1e-6]
    for value in found:
        assert np.abs(expected - value).min() < 1e-10 * max(abs(value), 0.01)
    reach = np.abs(found).max(initial=0.0) * (1 - 1e-9)
    for value in expected[(expected.imag > 1e-9) & (np.abs(expected) < reach)]:
        assert np.abs(found - value).min() < 1e-10 * max(abs(value), 0.01)
    assert (np.asarray(result.backward_error) < 1e-12).all()


@pytest.mark.parametrize("options", [{"formulation": "symmetric"}, {"inner": "iterative"}])
def test_what_does_not_know_of_losses_says_so(options):
    M, K = rod(20)
    with pytest.raises(UsageError, match="loss matrix H|all modes"):
        kschur.solve(M, K, loss=0.1, **options)
