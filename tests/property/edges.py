"""Kinds of problems at the edges of decisions: what nearly follows, what nearly vanishes, what crowds."""
from dataclasses import replace
from fractions import Fraction

from blocks import block
from extremes import chain
from kinds import (POSITIVE, Draft, fill, general_damping, gyroscopic, identity, positive, proportional, rigid_motions,
                   semidefinite, singular_mass, skew, small_factor, total, undamped, zeros)


def power(random, least, most):
    return Fraction(2) ** random.randint(least, most)


def nearly_redundant(random, unknowns):
    """Constraints at small angles to each other or to combinations of others."""
    base = random.choice([undamped, proportional, general_damping, gyroscopic, singular_mass, rigid_motions])
    return replace(base(random, unknowns), sharp=True, constrained=True, nearly_redundant=True)


def cascades(random, unknowns):
    """Oscillators that drive others and are not driven by them, some strongly."""
    def draw(n):
        mass, damping, stiffness = identity(n), zeros(n), zeros(n)
        for i in range(n):
            mass[i][i] = Fraction(random.choice(POSITIVE))
            damping[i][i] = small_factor(random) * random.choice([0, 1])
            stiffness[i][i] = Fraction(random.choice(POSITIVE) * random.choice([1, 1, 3, 5, 7]))
            for j in range(i):
                if random.random() < 0.6:
                    matrix = random.choice([damping, stiffness, stiffness])
                    matrix[i][j] = random.choice([-1, 1]) * power(random, 0, random.choice([4, 20, 40]))
        return block(mass, damping, stiffness)
    return Draft(fill(random, unknowns, draw), symmetric=False, sharp=True, mixed=random.random() < 0.2,
                 unlike_units=True, constrained=None if random.random() < 0.5 else False)


def one_way(random, unknowns):
    """Small systems, each of which drives later ones through all its matrices."""
    damped = random.random() < 0.7

    def draw(n):
        damping = total((small_factor(random), random.choice([positive, skew])(random, n))) if damped else None
        return block(positive(random, n), damping, total((random.choice(POSITIVE), positive(random, n))))
    blocks, places, first = fill(random, unknowns, draw), [], 0
    for one in blocks:
        places.append(range(first, first + one.size))
        first += one.size
    steps = []
    for _ in range(len(blocks) if len(blocks) > 1 else 0):
        from_one, to_other = sorted(random.sample(range(len(blocks)), 2))
        factor = random.choice([-1, 1]) * 2**random.randint(0, random.choice([4, 20, 40]))
        steps.append((random.choice(places[to_other]), random.choice(places[from_one]), factor))
    rows = random.choice([True, False])
    return Draft(blocks, symmetric=False, damped=damped, sharp=True, mixed=False, unlike_units=True, constrained=False,
                 row_steps=tuple(steps) if rows else (), column_steps=() if rows else tuple(steps))


def companions(random, unknowns):
    """Polynomials in lambda or its square, each written with as many unknowns as their degree needs."""
    def coefficients(n):
        return [random.choice([-1, 1, 1]) * random.choice([1, 1, 3, 5]) * power(random, *random.choice([(0, 0), (-20, 20)]))
                for _ in range(n)]

    def draw(n):
        mass, damping, stiffness = identity(n), zeros(n), zeros(n)
        for i in range(n - 1):
            stiffness[i][i + 1] = -power(random, 0, random.choice([0, 6]))
        stiffness[-1] = coefficients(n)
        if random.random() < 0.5:
            damping[-1] = coefficients(n)
        if random.random() < 0.3:
            # First order: lambda times an unknown is the next one.
            mass, damping = zeros(n), identity(n)
        return block(mass, damping, stiffness)
    return Draft(fill(random, unknowns, draw, largest=5), symmetric=False, sharp=True, mixed=random.random() < 0.2,
                 unlike_units=True, constrained=None if random.random() < 0.5 else False)


def unlike_rows(random, unknowns):
    """Rows in other units than columns."""
    base = random.choice([undamped, general_damping, gyroscopic, singular_mass])
    return replace(base(random, unknowns), symmetric=False, sharp=True, unlike_units=True)


def crowds(random, unknowns):
    """Damping like stiffness: stiff motions decay at nearly one rate, soft ones oscillate."""
    alpha, beta = random.choice([0, 0, small_factor(random) / 64]), power(random, -6, 2)
    many = min(200, unknowns * random.choice([1, 2, 4]))

    def draw(n):
        soft, scale = random.random() < 0.15, 1 / beta**2
        mass, stiffness = identity(n, random.choice([1, 1, 2])), zeros(n)
        if n > 1 and random.random() < 0.5:
            stiffness = total((scale * 16, chain(random, n)[2]))
        else:
            for i in range(n):
                stiffness[i][i] = scale * (Fraction(random.randint(1, 200), 256) if soft else random.randint(5, 2000))
        return block(mass, total((alpha, mass), (beta, stiffness)), stiffness)
    return Draft(fill(random, many, draw), rayleigh=(alpha, beta), sharp=True, mixed=random.random() < 0.7,
                 oscillating=random.random() < 0.8)


def slow_decays(random, unknowns):
    """Dashpots that soft springs pull back slowly, beside oscillators."""
    slow = random.choice([(10, 23), (10, 14), (20, 23)])

    def draw(n):
        if random.random() < 0.5:
            return block(positive(random, n), total((small_factor(random), semidefinite(random, n))), positive(random, n))
        damping = positive(random, n)
        stiffness = total((power(random, -slow[1], -slow[0]), positive(random, n)))
        return block(random.choice([positive, semidefinite])(random, n), damping, stiffness)
    return Draft(fill(random, unknowns, draw), sharp=True)


def massless(random, unknowns):
    """M = 0: first order."""
    damping = random.choice([positive, positive, skew, semidefinite])

    def draw(n):
        stiffness = total((1, positive(random, n)), (random.choice([0, 0, 1]), skew(random, n)))
        return block(zeros(n), damping(random, n), stiffness)
    return Draft(fill(random, unknowns, draw), symmetric=False, sharp=True)


def nearly_singular_mass(random, unknowns):
    """Masses that are singular but for 2^-45 or so."""
    damping = random.choice([None, None, semidefinite])

    def draw(n):
        mass, tiny = semidefinite(random, n), power(random, -45, random.choice([-45, -35, -15]))
        where = random.randrange(n)
        mass[where][where] += tiny
        return block(mass, damping and total((Fraction(1, 64), damping(random, n))), positive(random, n))
    return Draft(fill(random, unknowns, draw), sharp=True, damped=damping is not None, mixed=random.random() < 0.3)


def tiny_damping(random, unknowns):
    """Hardly any damping and no stiffness, or hardly any damping beside springs."""
    free = random.random() < 0.5

    def draw(n):
        damping = total((power(random, -44, -36), random.choice([positive, semidefinite, skew])(random, n)))
        return block(positive(random, n), damping, zeros(n) if free else positive(random, n))
    return Draft(fill(random, unknowns, draw), symmetric=False, sharp=True)


def nearly_proportional(random, unknowns):
    """Damping that is a sum of mass and stiffness but for the last digits."""
    a, b = small_factor(random), small_factor(random)

    def draw(n):
        mass, stiffness = positive(random, n), positive(random, n)
        off = random.choice([positive, skew])(random, n)
        damping = total((a, mass), (b, stiffness), (power(random, -42, random.choice([-42, -38, -30])), off))
        return block(mass, damping, stiffness)
    return Draft(fill(random, unknowns, draw, largest=3), symmetric=False, sharp=True, mixed=random.random() < 0.3)


def penalties(random, unknowns):
    """Springs so stiff that they clamp."""
    damped = random.random() < 0.5

    def draw(n):
        mass, damping, stiffness = chain(random, n)
        for i in range(n):
            mass[i][i] = Fraction(random.choice([1, 1, 2]))
            damping[i][i] = small_factor(random) * random.choice([0, 0, 1])
        for where in random.sample(range(n), random.randint(0, max(1, n // 2))):
            stiffness[where][where] = power(random, 53, random.choice([60, 120]))
        return block(mass, damping if damped else None, stiffness)
    return Draft(fill(random, unknowns, draw, largest=6), sharp=True, damped=damped, mixed=False, constrained=False)


EDGES = [nearly_redundant, cascades, one_way, companions, unlike_rows, crowds, slow_decays, massless, nearly_singular_mass,
         tiny_damping, nearly_proportional, penalties]
