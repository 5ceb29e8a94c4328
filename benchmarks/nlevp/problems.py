"""Quadratic problems of the NLEVP collection with real matrices, rebuilt from their published definitions.

T. Betcke, N. J. Higham, V. Mehrmann, C. Schroeder, F. Tisseur: NLEVP: a collection of nonlinear eigenvalue problems,
ACM Trans. Math. Software 39(2), 2013, doi 10.1145/2427023.2427024; N. J. Higham, G. M. Negri Porzio, F. Tisseur: an updated
set of nonlinear eigenvalue problems, MIMS EPrint 2019.5. Each function returns M, R, K of lambda^2 M + lambda R + K.

Where a definition draws random numbers, ours are NumPy's: the construction is the same, the numbers are not. Three are the
real members of complex families: the acoustic waves are real in 2 pi i lambda, power_plant has no hysteretic damping,
pdde_stability has the phase 0.
"""

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from scipy.signal import convolve

FORMULAS = {}


def formula(build):
    FORMULAS[build.__name__] = build
    return build


def tridiagonal(below, diagonal, above, n):
    return sp.diags([below, diagonal, above], [-1, 0, 1], shape=(n, n))


def orthogonal(n, random):
    q, r = la.qr(random.standard_normal((n, n)))
    return q * np.sign(np.diag(r))


@formula
def acoustic_wave_1d(n=10):
    last = np.zeros(n)
    last[-1] = 1
    stiffness = n * (tridiagonal(-1.0, 2.0, -1.0, n) - sp.diags(last))
    return sp.diags(1 - last / 2) / n, sp.diags(last), stiffness


@formula
def acoustic_wave_2d(n=6):
    last = np.zeros(n)
    last[-1] = 1
    many, half = sp.identity(n - 1), sp.diags(1 - last / 2)
    stiffness = sp.kron(many, tridiagonal(-1.0, 4.0, -1.0, n) - 2 * sp.diags(last)) - sp.kron(
        tridiagonal(1.0, 0.0, 1.0, n - 1), half
    )
    return sp.kron(many, half) / n**2, sp.kron(many, sp.diags(last)) / n, stiffness


@formula
def bcc_traffic(n=32):
    random = np.random.default_rng(1)
    first = np.isin(np.arange(n), random.permutation(n)[: n // 2])
    large, small = random.uniform(0.3, 0.5, (2, n)), random.uniform(0.05, 0.15, (2, n))
    chain = tridiagonal(-1.0, np.append(np.full(n - 1, 2.0), 1.0), -1.0, n)
    return (
        sp.identity(n),
        sp.diags(np.where(first, large[0], small[0])) @ chain,
        sp.diags(np.where(first, small[1], large[1])) @ chain,
    )


@formula
def bicycle(speed=5.0):
    mass = [[80.81722, 2.31941332208709], [2.31941332208709, 0.29784188199686]]
    gravity = np.array([[-80.95, -2.59951685249872], [-2.59951685249872, -0.80329488458618]])
    centrifugal = np.array([[0, 76.59734589573222], [0, 2.65431523794604]])
    gyroscopic = np.array([[0, 33.86641391492494], [-0.85035641456978, 1.68540397397560]])
    return mass, speed * gyroscopic, 9.81 * gravity + speed**2 * centrifugal


@formula
def bilby(beta=0.5, g=0.2):
    births, deaths = np.array([1, 0.4, 0.25, 0.1, 0]), np.array([0, 0.5, 0.55, 0.8, 1])

    def transitions(x):
        a = np.diag((1 - g) * x[:4], 1)
        a[:, 0] += g * x
        a[4, 4] += (1 - g) * x[4]
        return beta * a.T

    return transitions(deaths), transitions(1 - births - deaths) - np.eye(5), transitions(births)


@formula
def closed_loop(alpha=1.0):
    return np.eye(2), [[0, 1 + alpha], [1, 0]], np.diag([0.5, 0.25])


@formula
def damped_beam(elements=100, dashpot=5.0):
    h, bending, line_mass = 1 / elements, 7e10 * 0.05 * 0.005**3 / 12, 0.674
    stiffness = np.array(
        [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h**2, -6 * h, 2 * h**2],
         [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h**2, -6 * h, 4 * h**2]]
    )  # fmt: skip
    mass = np.array(
        [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h**2, 13 * h, -3 * h**2],
         [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h**2, -22 * h, 4 * h**2]]
    )  # fmt: skip
    m, k = np.zeros((2, 2 * elements + 2, 2 * elements + 2))
    for e in range(elements):
        m[2 * e : 2 * e + 4, 2 * e : 2 * e + 4] += line_mass * h / 420 * mass
        k[2 * e : 2 * e + 4, 2 * e : 2 * e + 4] += bending / h**3 * stiffness
    supported = [i for i in range(2 * elements + 2) if i not in (0, 2 * elements)]
    r = np.zeros_like(m)
    r[elements, elements] = dashpot
    return tuple(a[np.ix_(supported, supported)] for a in (m, r, k))


def plane(n, gyration, damping):
    side = int(np.ceil(np.sqrt(n)))
    one = sp.identity(side)

    def both(x, y, a):
        return x * sp.kron(one, a) + y * sp.kron(a, one)

    mass = both(1, 1.3, tridiagonal(1, 4, 1, side) / 6)
    gyroscopic = both(*gyration, tridiagonal(1, 0, -1, side))
    return (
        mass,
        gyroscopic + damping * both(1.05, 0.9, tridiagonal(1, 2, 1, side)),
        both(1, 1.2, tridiagonal(1, -2, 1, side)),
    )


@formula
def damped_gyro(n=36):
    return plane(n, (0.1, 1.2), 1e-4)


@formula
def elastic_deform(n=36):
    return plane(n, (0.1, 1.2), 0)


@formula
def dirac(n=80, alpha=-0.5, kappa=-1):
    h = n // 2
    j, k = np.ogrid[:h, :h]
    sign = (-1.0) ** (j + k)
    p = np.cumprod(np.append(1.0, 1 + 1 / (2.0 * np.arange(1, h))))
    q = np.sqrt(p)
    r2 = -4 / np.sqrt(np.pi) * sign * (j - k) / ((2 * (j - k) - 1) * (2 * (j - k) + 1)) * np.outer(q, q)
    sums = np.cumsum((p / (2 * np.arange(h) + 1))[:, None] / (2 * (j - k) - 1), axis=0)
    r3 = -2 / np.sqrt(np.pi) * sign * sums * np.outer(1 / q, q)
    i = np.arange(1, h)
    r4 = tridiagonal(-np.sqrt((2 * i + 1) * 2 * i) / 2, (4 * np.arange(h) + 3) / 2, -np.sqrt((2 * i + 1) * 2 * i) / 2, h)
    above = np.triu(2 * sign * np.outer(q, 1 / q), 1)
    r5, r6, one = above + np.eye(h), above + above.T + 2 * np.eye(h), np.eye(h)
    first = np.block([[one + alpha * r3, r2 + kappa * r3], [-r2 + kappa * r3, -one + alpha * r3]])
    both, skew = r4 + (alpha**2 + kappa**2) * r6, kappa * (r5 + r5.T)
    coupling = -r2 - r2.T + alpha * (r5 - r5.T) + 2 * alpha * kappa * r6
    second = np.block(
        [[one + 2 * alpha * r3 + both + skew, coupling], [coupling.T, one - 2 * alpha * r3 + both - skew]]
    )
    return np.eye(n), -(first + first.T), (second + second.T) / 2


@formula
def gen_hyper2(n=15):
    random = np.random.default_rng(2)
    vectors = orthogonal(n, random)
    other = vectors @ orthogonal(n, random)
    values = np.sort(n * random.standard_normal(2 * n))
    moment = [
        (vectors * values[n:] ** i) @ vectors.T - (other * values[:n] ** i) @ other.T for i in range(4)
    ]
    mass = la.inv(moment[1])
    damping = -mass @ moment[2] @ mass
    stiffness = -mass @ moment[3] @ mass + damping @ moment[1] @ damping
    return tuple((a + a.T) / 2 for a in (mass, damping, stiffness))


def from_even(n, seed, signs, vectors, parity):
    """A palindromic problem with eigenvalues on the unit circle, as the Cayley transform of an even one."""
    random = np.random.default_rng(seed)
    beta = np.tan(random.uniform(1e-4, np.pi - 1e-4, n) / 2)
    j = la.block_diag(*[[[0, b], [-b, 0]] for b in beta])
    s, x = signs(n), vectors(n, random)
    moment = [x @ np.linalg.matrix_power(j, i) @ s @ x.T for i in (1, 2, 3)]

    def part(a, sign):
        return (a + sign * a.T) / 2

    a2 = part(la.inv(moment[0]), parity)
    a1 = part(-a2 @ moment[1] @ a2, -parity)
    a0 = part(-a2 @ (moment[1] @ a1 + moment[2] @ a2), parity)
    a = a2 + a1 + a0
    return a, part(2 * (a0 - a2), parity), parity * a.T


@formula
def gen_tantipal2(n=16):
    def signs(n):
        return np.diag(np.repeat([1.0, -1.0], n))

    def vectors(n, random):
        x = orthogonal(n, random)
        return np.hstack([x, x @ orthogonal(n, random)])

    return from_even(n, 3, signs, vectors, -1)


@formula
def gen_tpal2(n=16):
    def signs(n):
        return la.block_diag(*[[[0, 1], [-1, 0]]] * n)

    def vectors(n, random):
        return np.repeat(orthogonal(n, random), 2, axis=1)

    return from_even(n, 4, signs, vectors, 1)


@formula
def intersection():
    """Macaulay's matrix of a cylinder, a sphere and a plane; lambda is x, the columns are monomials of y and z."""
    c, s, a = 1.6e-3, 5.3e-4, 1e-4
    k, r, m = np.zeros((3, 10, 10))
    for row, column, value in [
        (1, 1, c), (4, 1, s), (2, 2, c), (5, 2, s), (7, 2, a), (3, 3, c), (6, 3, s), (8, 3, a), (4, 4, s), (7, 4, 1),
        (5, 5, s), (6, 6, s), (9, 6, 1), (7, 7, -3.4e-3), (8, 7, 1), (9, 7, a), (1, 8, -1), (4, 8, -1), (8, 8, -3.4e-3),
        (10, 8, a), (2, 9, -1), (5, 9, -1), (9, 9, -3.4e-3), (10, 9, 1), (3, 10, -1), (6, 10, -1), (10, 10, -3.4e-3),
    ]:  # fmt: skip
        k[row - 1, column - 1] = value
    for row, column in [(7, 7), (8, 8), (9, 9), (10, 10)]:
        r[row - 1, column - 1] = -1.4e-4
    for row, column, cylinder in [(4, 8, 1), (5, 9, 2), (6, 10, 3)]:
        r[row - 1, column - 1] = 0.027
        m[row - 1, column - 1], m[cylinder - 1, column - 1] = s, c
    return m, r, k


@formula
def metal_strip():
    a0 = 100 * np.array([[-7.0, 1, 2], [3, -9, 0], [1, 2, -6]])
    a1 = 100 * np.array([[1, 0, -3], [-0.5, -0.5, -1], [-0.5, -1.5, 0]])
    d0, d1 = np.eye(3), -np.array([[-1, 5, 2], [4, 0, 3], [-2, 4, 1]]) / 72
    mass = np.kron(d0, a1) + np.kron(a0, d1)
    damping = np.kron(d0, a0) + np.kron(a0, d0) + np.kron(d1, a1) + np.kron(a1, d1)
    swapped = np.arange(9).reshape(3, 3).T.ravel()
    return mass, damping, mass[np.ix_(swapped, swapped)]


@formula
def mobile_manipulator():
    mass = [[18.7532, -7.94493, 7.94494], [-7.94493, 31.8182, -26.8182], [7.94494, -26.8182, 26.8182]]
    damping = [[-1.52143, -1.55168, 1.55168], [3.22064, 3.28467, -3.28467], [-3.22064, -3.28467, 3.28467]]
    stiffness = [[67.4894, 69.2393, -69.2393], [69.8124, 1.68624, -1.68617], [-69.8123, -1.68617, -68.2707]]
    contact, none = np.array([[1, 0, 0], [0, 0, 1]]), np.zeros((2, 2))
    bordered = np.block([[np.array(stiffness), -contact.T], [contact, none]])
    return la.block_diag(mass, none), la.block_diag(damping, none), bordered


@formula
def pdde_stability(m=15):
    x = np.arange(1, m + 1) * np.pi / (m + 1)
    h = np.pi / (m + 1)
    a0 = tridiagonal(1, -2, 1, m) / h**2 + sp.diags(2 + 0.3 * np.sin(x))
    a1 = sp.diags(-2 + 0.2 * x * (1 - np.exp(x - np.pi)))
    a2 = sp.diags(-2 - 0.3 * x * (np.pi - x))
    one = sp.identity(m)
    return sp.kron(one, a2), sp.kron(one, a0 - a1) + sp.kron(a0 + a1, one), sp.kron(a2, one)


@formula
def power_plant():
    mass = np.diag([5.4, 1.68e6, 55.2, 8.711e7, 57.8, 2.35e8, 16, 2.14e7])
    damping = np.diag([9.99, 1.045e7, 548, 4.329e9, 6178, 4.343e10, 30, 3.473e8])
    stiffness = np.diag([1.16e4, 1.522e10, 5.296e5, 9.461e12, 6.862e5, 9.953e12, 6170, 2.893e11])
    couplings = [
        (1, 2, -7492, -8.7e6), (1, 3, -9.99, -1.16e4), (1, 4, 9790, 1.137e7), (2, 3, 7492, 8.7e6),
        (2, 4, -1.221e7, -1.723e10), (3, 4, -9.674e5, -9.334e8), (3, 5, -538, -5.18e5),
        (3, 6, -5.38e5, -5.18e8), (4, 5, 9.576e5, 9.22e8),
        (4, 6, -1.652e9, -6.878e12), (5, 6, -5.042e6, 3.633e8), (5, 7, -300, -6170), (5, 8, 5.7e4, 1.172e7),
        (6, 7, -3e4, -6.17e6), (6, 8, -1.82e8, -2.553e11), (7, 8, -5.7e4, -1.172e7),
    ]  # fmt: skip
    for i, j, viscous, elastic in couplings:
        damping[i - 1, j - 1] = damping[j - 1, i - 1] = viscous
        stiffness[i - 1, j - 1] = stiffness[j - 1, i - 1] = elastic
    return mass, damping, stiffness


@formula
def qep1():
    return [[0, 6, 0], [0, 6, 0], [0, 0, 1]], [[1, -6, 0], [2, -7, 0], [0, 0, 0]], np.eye(3)


@formula
def qep2():
    """As in the article (eigenvalues -1, 1, 1, 1, infinity twice)."""
    return np.diag([1, 1, 0]), [[-2, 0, 1], [0, 0, 0], [0, 0, 0]], np.diag([1, -1, 1])


@formula
def qep2_toolbox():
    """As in the toolbox, with M = I: i and -i in the place of infinity."""
    return np.eye(3), [[-2, 0, 1], [0, 0, 0], [0, 0, 0]], np.diag([1, -1, 1])


@formula
def qep3(e=np.sqrt(np.finfo(float).eps / 2) - 1):
    return (
        [[1, -1, -1], [0, 1, 0], [0, 0, 0]],
        [[-3, 1, 0], [0, -1 - e, 0], [0, 0, 1]],
        [[2, 0, 9], [0, 0, 0], [0, 0, -3]],
    )


@formula
def qep5():
    """Singular at every lambda: there is nothing to find, and that is the answer."""
    return [[1, 4, 2], [0, 0, 0], [1, 4, 2]], [[1, 3, 0], [1, 4, 2], [0, -1, -2]], [[1, 2, -2], [0, -1, -2], [0, 0, 0]]


@formula
def relative_pose_6pt():
    """Two views of six points, the focal length unknown.

    2 F Q F^T Q F = tr(F Q F^T Q) F and det F = 0 with Q = diag(1, 1, lambda); the columns are monomials of x and y in
    F = x F1 + y F2 + F3, whose F1 to F3 span what the six points leave.
    """
    left = np.array(
        [[0.98546290800037, -1.97451815082977, -4.74852466853571, -0.08015690576328, -2.60498296435867, 1.82921772080851],
         [0.68369049573664, -8.06356113591952, -1.67723551191802, -0.81102548799456, -4.12124589320883, -3.16952237236666],
         [1.0] * 6]
    )  # fmt: skip
    right = np.array(
        [[2.70596068011403, -0.10212743701718, -2.39185334180910, 1.42400401680915, -0.62500033043145, 3.05926578381682],
         [4.18287782226932, -3.54681903112052, 0.76294387477984, 2.08968858056361, -0.81578650651845, 0.21660652322887],
         [1.0] * 6]
    )  # fmt: skip
    null = la.null_space(np.einsum("ip,jp->pij", right, left).reshape(6, 9)).reshape(3, 3, 3)
    f = np.zeros((3, 3, 2, 2, 1))  # a matrix of polynomials in x, y and lambda
    f[..., 1, 0, 0], f[..., 0, 1, 0], f[..., 0, 0, 0] = np.moveaxis(null, 2, 0)
    q = np.zeros((3, 3, 1, 1, 2))
    q[0, 0, 0, 0, 0] = q[1, 1, 0, 0, 0] = q[2, 2, 0, 0, 1] = 1

    def times(a, b):
        return np.array([[sum(convolve(a[i, k], b[k, j]) for k in range(3)) for j in range(3)] for i in range(3)])

    qfq = times(times(f, q), times(f.transpose(1, 0, 2, 3, 4), q))
    trace = qfq[0, 0] + qfq[1, 1] + qfq[2, 2]
    traces = np.array([[convolve(trace, f[i, j]) for j in range(3)] for i in range(3)])
    equations = list((2 * times(qfq, f) - traces).reshape(9, 4, 4, 3))
    minors = [(0, 1, 2, 1), (1, 2, 0, 1), (2, 0, 1, 1), (0, 2, 1, -1), (1, 0, 2, -1), (2, 1, 0, -1)]
    determinant = sum(s * convolve(convolve(f[0, i], f[1, j]), f[2, k]) for i, j, k, s in minors)
    equations.append(np.pad(determinant, ((0, 0), (0, 0), (0, 2))))
    monomials = [(i, j) for i in range(4) for j in range(4 - i)]
    return tuple(np.array([[e[i, j, power] for i, j in monomials] for e in equations]) for power in (2, 1, 0))


@formula
def sleeper(n=10):
    ring = la.circulant([-2.0, 1] + [0] * (n - 3) + [1])
    one = np.eye(n)
    return one, one + ring @ ring, one + ring + ring @ ring


@formula
def spring(n=5):
    chain = tridiagonal(-1.0, 3.0, -1.0, n)
    return sp.identity(n), 10 * chain, 5 * chain


@formula
def spring_dashpot(n=10, density=7850.0):
    random = np.random.default_rng(5)
    elements = n // 2 - 1
    k, m = (a @ a.T for a in random.random((2, 2, 2)))
    e, eta = random.random((2, elements))
    arrow = np.diag(np.append(e.sum(), e))
    arrow[0, 1:] = arrow[1:, 0] = eta
    mass = la.block_diag(density * m, np.zeros((2 * elements, 2 * elements)))
    return mass, np.kron(np.diag(np.append(0, eta)), k), np.kron(arrow, k)


@formula
def wing():
    return (
        [[17.6, 1.28, 2.89], [1.28, 0.824, 0.413], [2.89, 0.413, 0.725]],
        [[7.66, 2.45, 2.1], [0.23, 1.04, 0.223], [0.6, 0.756, 0.658]],
        [[121, 18.9, 15.9], [0, 2.7, 0.145], [11.9, 3.64, 15.5]],
    )


@formula
def wiresaw1(n=10, speed=0.01):
    j, k = np.ogrid[1 : n + 1, 1 : n + 1]
    odd = (j + k) % 2 == 1
    gyroscopic = np.where(odd, 4 * j * k * speed / np.where(odd, j**2 - k**2, 1), 0)
    return np.eye(n) / 2, gyroscopic, np.diag(np.arange(1.0, n + 1) ** 2 * np.pi**2 * (1 - speed**2) / 2)


@formula
def wiresaw2(n=10, speed=0.01, eta=0.8):
    mass, gyroscopic, stiffness = wiresaw1(n, speed)
    return mass, gyroscopic + eta * np.eye(n), stiffness + eta * gyroscopic
