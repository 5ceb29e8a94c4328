"""The kinds of problems: random small blocks that have something in common.

Each kind is a function of a source of random numbers and a number of unknowns, and returns a Draft."""
from dataclasses import dataclass
from fractions import Fraction

from blocks import block

POSITIVE = [1, 1, 2, 3, 4, 5, 7, 8, Fraction(1, 2), Fraction(3, 4), Fraction(1, 4), Fraction(1, 8), 16, 100]


@dataclass
class Draft:
    """Blocks, and what may be done with them."""
    blocks: list
    symmetric: bool = True
    damped: bool = True
    # (a, b) where damping is a times mass plus b times stiffness, also that of the unknowns that constraints remove.
    rayleigh: tuple = None
    # g where loss is g times stiffness, also that of the unknowns that constraints remove.
    loss_factor: Fraction = None
    # Whether rows and columns may be combined.
    mixed: bool = True
    # Whether rounding of single entries, and not of whole matrices, says how well eigenvalues are known.
    sharp: bool = False
    # Whether there are constraints, None where chance decides; whether some of them nearly follow from others.
    constrained: bool = None
    nearly_redundant: bool = False
    # Whether rows may have other units than columns.
    unlike_units: bool = False
    # Steps (i, j, factor) in one direction that stay as they are.
    row_steps: tuple = ()
    column_steps: tuple = ()
    # Whether about so many modes are asked for as oscillate.
    oscillating: bool = False


# Matrices as lists of lists of Fractions.

def congruent(random, diagonal):
    """L^T diag L with a random unit lower triangle L of small integers."""
    size = len(diagonal)
    lower = [[1 if i == j else random.choice([-1, 0, 0, 1, 2]) if i > j else 0 for j in range(size)] for i in range(size)]
    return [[sum(lower[k][i] * Fraction(diagonal[k]) * lower[k][j] for k in range(size)) for j in range(size)]
            for i in range(size)]


def positive(random, size):
    return congruent(random, [random.choice(POSITIVE) for _ in range(size)])


def semidefinite(random, size, nullity=1):
    diagonal = [random.choice(POSITIVE) for _ in range(size - nullity)] + [0] * nullity
    random.shuffle(diagonal)
    return congruent(random, diagonal)


def indefinite(random, size):
    return congruent(random, [random.choice([-1, 1]) * random.choice(POSITIVE) for _ in range(size)])


def skew(random, size):
    result = zeros(size)
    for i in range(size):
        for j in range(i):
            result[i][j] = Fraction(random.choice([-3, -2, -1, 1, 2, 4]), random.choice([1, 1, 2, 8]))
            result[j][i] = -result[i][j]
    return result


def unsymmetric(random, size):
    return [[Fraction(random.randint(-4, 4), random.choice([1, 1, 1, 4])) for _ in range(size)] for _ in range(size)]


def zeros(size):
    return [[Fraction(0)] * size for _ in range(size)]


def identity(size, factor=1):
    return [[Fraction(factor) if i == j else Fraction(0) for j in range(size)] for i in range(size)]


def total(*terms):
    """Of pairs (factor, matrix)."""
    size = len(terms[0][1])
    return [[sum(Fraction(a) * matrix[i][j] for a, matrix in terms) for j in range(size)] for i in range(size)]


def small_factor(random):
    return Fraction(random.choice([1, 1, 3, 5]), 2**random.choice([0, 1, 3, 6, 10]))


def rayleigh(random):
    a, b = random.choice([(1, 0), (0, 1), (1, 1), (1, 1)])
    return a * small_factor(random), b * small_factor(random)


def fill(random, unknowns, draw, largest=4):
    """Blocks from draw(size) until there are that many unknowns; each stands there once, or several times."""
    found, left = [], unknowns
    while left > 0:
        one = draw(min(random.randint(1, largest), left))
        if one.polynomial:
            copies = random.choice([1, 1, 1, 2, 3, random.randint(4, 20)])
            copies = max(1, min(copies, left // one.size))
            found += [one] * copies
            left -= copies * one.size
    return found


def either_stiffness(random, size):
    """Mostly definite; sometimes with a motion that nothing holds."""
    return semidefinite(random, size) if random.random() < 0.25 else positive(random, size)


def undamped(random, unknowns):
    return Draft(fill(random, unknowns, lambda n: block(positive(random, n), None, either_stiffness(random, n))), damped=False)


def proportional(random, unknowns):
    a, b = rayleigh(random)

    def draw(n):
        mass, stiffness = positive(random, n), either_stiffness(random, n)
        return block(mass, total((a, mass), (b, stiffness)), stiffness)
    return Draft(fill(random, unknowns, draw), rayleigh=(a, b))


def all_like_mass(random, unknowns):
    """R = d M and K = c M: all modes are one."""
    c, d = random.choice(POSITIVE) * small_factor(random), small_factor(random)

    def draw(n):
        mass = positive(random, n)
        return block(mass, total((d, mass)), total((c, mass)))
    return Draft(fill(random, unknowns, draw))


def unit_mass(random, unknowns):
    """M = I, nothing mixed."""
    damping = random.choice([None, positive, semidefinite, skew])

    def draw(n):
        return block(identity(n), damping and damping(random, n), either_stiffness(random, n))
    return Draft(fill(random, unknowns, draw), symmetric=damping is not skew, damped=damping is not None, mixed=False)


def no_stiffness(random, unknowns):
    damping = random.choice([None, positive, semidefinite, skew, unsymmetric])

    def draw(n):
        return block(positive(random, n), damping and damping(random, n), zeros(n))
    return Draft(fill(random, unknowns, draw), symmetric=damping not in (skew, unsymmetric), damped=damping is not None)


def general_damping(random, unknowns):
    def draw(n):
        damping = total((small_factor(random), random.choice([positive, positive, semidefinite])(random, n)))
        return block(positive(random, n), damping, either_stiffness(random, n))
    return Draft(fill(random, unknowns, draw))


def dashpots(random, unknowns):
    """Chains of masses and springs, some free, a dashpot at an end or between two masses; undamped blocks besides."""
    def draw(n):
        mass, damping, stiffness = identity(n), zeros(n), zeros(n)
        k = random.choice(POSITIVE)
        for i in range(n):
            mass[i][i] = Fraction(random.choice([1, 1, 2]))
        for i in range(n - 1):
            add_spring(stiffness, i, i + 1, k)
        if random.random() < 0.6:
            stiffness[0][0] += Fraction(k)
        where = random.randrange(n)
        if random.random() < 0.7:
            damping[where][where] += small_factor(random)
        elif where:
            add_spring(damping, where - 1, where, small_factor(random))
        return block(mass, damping, stiffness)
    return Draft(fill(random, unknowns, draw, largest=7))


def add_spring(matrix, i, j, k):
    k = Fraction(k)
    matrix[i][i] += k
    matrix[j][j] += k
    matrix[i][j] -= k
    matrix[j][i] -= k


def gyroscopic(random, unknowns):
    def draw(n):
        damping = total((small_factor(random), skew(random, n)))
        if random.random() < 0.4:
            damping = total((1, damping), (small_factor(random), random.choice([positive, semidefinite])(random, n)))
        stiffness = random.choice([positive, positive, either_stiffness, indefinite])(random, n)
        return block(positive(random, n), damping, stiffness)
    return Draft(fill(random, unknowns, draw), symmetric=False)


def rotors(random, unknowns):
    """Discs on isotropic or orthotropic bearings, with outer and inner damping, that turn about a shaft which is
    free, slowed down, or held."""
    c, inner = (random.choice([0, small_factor(random)]) for _ in range(2))

    def draw(n):
        if n == 1:
            return block([[random.choice(POSITIVE)]], [[random.choice([0, small_factor(random)])]],
                         [[random.choice([0, 0, 1])]])
        speed, k = random.choice([1, 2, 3, Fraction(1, 4)]), random.choice(POSITIVE)
        damping = [[c + inner, speed], [-speed, c + inner]]
        stiffness = [[k, inner * speed], [-inner * speed, k * random.choice([1, 1, 2])]]
        return block(identity(2, random.choice(POSITIVE)), damping, stiffness)
    return Draft(fill(random, unknowns, draw, largest=2), symmetric=False)


def follower_forces(random, unknowns):
    """No damping, an unsymmetric stiffness matrix."""
    def draw(n):
        return block(positive(random, n), None, total((1, either_stiffness(random, n)), (1, skew(random, n))))
    return Draft(fill(random, unknowns, draw), symmetric=False, damped=False)


def circulatory(random, unknowns):
    def draw(n):
        stiffness = total((1, either_stiffness(random, n)), (1, skew(random, n)))
        return block(positive(random, n), total((small_factor(random), unsymmetric(random, n))), stiffness)
    return Draft(fill(random, unknowns, draw), symmetric=False)


def any_matrices(random, unknowns):
    damped = random.random() < 0.7

    def draw(n):
        return block(unsymmetric(random, n), unsymmetric(random, n) if damped else None, unsymmetric(random, n))
    return Draft(fill(random, unknowns, draw, largest=3), symmetric=False, damped=damped)


def indefinite_stiffness(random, unknowns):
    damped = random.random() < 0.5

    def draw(n):
        return block(positive(random, n), positive(random, n) if damped else None, indefinite(random, n))
    return Draft(fill(random, unknowns, draw), damped=damped)


def indefinite_mass(random, unknowns):
    damped = random.random() < 0.5

    def draw(n):
        return block(indefinite(random, n), semidefinite(random, n) if damped else None, either_stiffness(random, n))
    return Draft(fill(random, unknowns, draw), damped=damped)


def singular_mass(random, unknowns):
    """Motions without mass: rows of zeros until they are mixed."""
    damping = random.choice([None, None, rayleigh, positive, semidefinite, skew])
    a, b = rayleigh(random)

    def draw(n):
        if random.random() < 0.5:
            mass = positive(random, n)
        else:
            mass = semidefinite(random, n, random.randint(1, n))
        stiffness = random.choice([positive, positive, either_stiffness])(random, n)
        if damping is rayleigh:
            return block(mass, total((a, mass), (b, stiffness)), stiffness)
        return block(mass, damping and damping(random, n), stiffness)
    return Draft(fill(random, unknowns, draw), symmetric=damping is not skew, damped=damping is not None,
                 rayleigh=(a, b) if damping is rayleigh else None)


def rigid_motions(random, unknowns):
    """Bodies that are free, that only damping holds, or springs hold partly; the stiffness symmetric or not."""
    damping = random.choice([None, None, rayleigh, semidefinite, positive, skew])
    follower = random.random() < 0.3
    a, b = rayleigh(random)

    def draw(n):
        mass, stiffness = positive(random, n), semidefinite(random, n, random.randint(1, n))
        if follower and n > 1:
            # Columns still have the null space of a semidefinite matrix, rows have another one.
            factor = total((1, identity(n)), (Fraction(1, 2), skew(random, n)))
            stiffness = [[sum(factor[i][k] * stiffness[k][j] for k in range(n)) for j in range(n)] for i in range(n)]
        if damping is rayleigh:
            return block(mass, total((a, mass), (b, stiffness)), stiffness)
        return block(mass, damping and damping(random, n), stiffness)
    return Draft(fill(random, unknowns, draw), symmetric=not (follower or damping is skew), damped=damping is not None,
                 rayleigh=(a, b) if damping is rayleigh else None)


def copies(random, unknowns):
    """One or two blocks, each as often as there is room."""
    damping = random.choice([None, rayleigh, positive, semidefinite, skew])
    a, b = rayleigh(random)
    found = []
    for _ in range(random.randint(1, 2)):
        n = random.randint(1, 3)
        mass, stiffness = positive(random, n), either_stiffness(random, n)
        r = total((a, mass), (b, stiffness)) if damping is rayleigh else damping and damping(random, n)
        one = block(mass, r, stiffness)
        if one.polynomial:
            found += [one] * max(1, min(20, unknowns // n))
    return Draft(found, symmetric=damping is not skew, damped=damping is not None,
                 rayleigh=(a, b) if damping is rayleigh else None)


def defective(random, unknowns):
    """Critical damping and stiffness matrices in Jordan form; blocks that are not defective besides."""
    jordan = random.random() < 0.5

    def draw(n):
        if random.random() < 0.4:
            return block(positive(random, n), semidefinite(random, n), positive(random, n))
        root, mass = random.choice([1, 2, 3, Fraction(1, 2)]), random.choice(POSITIVE)
        if not jordan or n == 1:
            return block([[mass]], [[2 * root * mass]], [[root * root * mass]])
        stiffness = [[Fraction(mass) * root, mass], [0, Fraction(mass) * root]]
        return block(identity(2, mass), random.choice([zeros(2), identity(2, Fraction(1, 8))]), stiffness)
    return Draft(fill(random, unknowns, draw, largest=2), symmetric=not jordan)


def wide(random, unknowns):
    """Stiff and soft parts: six decades of frequencies."""
    a, b = rayleigh(random)
    damping = random.choice([None, rayleigh, positive])

    def draw(n):
        scale = Fraction(2) ** random.randint(-10, 10)
        mass, stiffness = positive(random, n), total((scale, either_stiffness(random, n)))
        if damping is rayleigh:
            return block(mass, total((a, mass), (b, stiffness)), stiffness)
        return block(mass, damping and total((scale, positive(random, n))), stiffness)
    return Draft(fill(random, unknowns, draw), damped=damping is not None, rayleigh=(a, b) if damping is rayleigh else None)


KINDS = [undamped, proportional, all_like_mass, unit_mass, no_stiffness, general_damping, dashpots, gyroscopic, rotors,
         follower_forces, circulatory, any_matrices, indefinite_stiffness, indefinite_mass, singular_mass, rigid_motions,
         copies, defective, wide]
