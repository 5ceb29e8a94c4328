"""Kinds of problems at the edges: what differs by many decades, and what hardly differs."""
from fractions import Fraction

from blocks import block
from kinds import (POSITIVE, Draft, add_spring, fill, identity, indefinite, positive, semidefinite, skew, small_factor,
                   total, zeros)


def many_copies(random, unknowns):
    """One block as often as there is room, and one other."""
    n = random.randint(1, 2)
    damping = random.choice([None, positive, semidefinite, skew])
    one, other = (block(positive(random, n), damping and total((small_factor(random), damping(random, n))),
                        positive(random, n)) for _ in range(2))
    return Draft([one] * max(1, unknowns // n - 1) + [other], symmetric=damping is not skew, damped=damping is not None)


def clusters(random, unknowns):
    """Eigenvalues that differ in the seventh digit or so."""
    damping = random.choice([None, positive, skew])

    def draw(n):
        apart = Fraction(1, 2**random.choice([12, 16, 20, 22]))
        mass, stiffness = random.choice(POSITIVE), random.choice(POSITIVE)
        r = damping and total((small_factor(random), damping(random, n)))
        return block(identity(n, mass), r, [[stiffness * (1 + i * apart) * (i == j) for j in range(n)] for i in range(n)])
    return Draft(fill(random, unknowns, draw), symmetric=damping is not skew, damped=damping is not None)


def light_masses(random, unknowns):
    """Masses that differ by up to nine decades."""
    damping = random.choice([None, semidefinite])

    def draw(n):
        mass = identity(n)
        for i in range(n):
            mass[i][i] = Fraction(1, 2**random.choice([0, 0, 10, 20, 30]))
        return block(mass, damping and total((Fraction(1, 2**10), damping(random, n))), positive(random, n))
    return Draft(fill(random, unknowns, draw, largest=3), damped=damping is not None, mixed=random.random() < 0.5)


def chain(random, n):
    """Mass, no damping and stiffness of a chain that stands on the ground."""
    mass, damping, stiffness = identity(n), zeros(n), zeros(n)
    for i in range(n - 1):
        add_spring(stiffness, i, i + 1, random.choice(POSITIVE))
    stiffness[0][0] += random.choice(POSITIVE)
    return mass, damping, stiffness


def strong_dampers(random, unknowns):
    """A dashpot that is nothing beside the chain it stands in, or holds it as a wall does."""
    def draw(n):
        mass, damping, stiffness = chain(random, n)
        if random.random() < 0.5:
            where = random.randrange(n)
            damping[where][where] += Fraction(2) ** random.choice([-30, -20, 4, 10, 20, 30])
        return block(mass, damping, stiffness)
    return Draft(fill(random, unknowns, draw, largest=6), mixed=random.random() < 0.5)


def massless_dampers(random, unknowns):
    """Chains in which dashpots stand at unknowns without mass."""
    def draw(n):
        mass, damping, stiffness = chain(random, n)
        where = random.randrange(n)
        mass[where][where] = Fraction(random.choice([0, 0, 1]))
        damping[where][where] += Fraction(2) ** random.choice([-10, 0, 10])
        return block(mass, damping, stiffness)
    return Draft(fill(random, unknowns, draw, largest=5), mixed=random.random() < 0.5)


def nearly_critical(random, unknowns):
    """Oscillators within a millionth of critical damping, on both sides."""
    def draw(n):
        mass, root = random.choice(POSITIVE), random.choice([1, 2, Fraction(1, 2)])
        near = 1 + random.choice([-1, 0, 1]) * Fraction(1, 2**random.choice([8, 14, 20]))
        return block(identity(n, mass), identity(n, 2 * root * mass), identity(n, root * root * mass * near))
    return Draft(fill(random, unknowns, draw, largest=1))


def saddles(random, unknowns):
    """Gyroscopic forces that hold what an indefinite stiffness lets go."""
    def draw(n):
        damping = total((random.choice([1, 4, 16]), skew(random, n)))
        return block(positive(random, n), damping, indefinite(random, n))
    return Draft(fill(random, unknowns, draw), symmetric=False)


def stiff_springs(random, unknowns):
    """Bodies, each free but for some springs that are as good as rigid."""
    damped = random.random() < 0.5

    def draw(n):
        mass, damping, stiffness = chain(random, n)
        stiffness[0][0] += Fraction(2) ** random.choice([20, 30])
        for i in range(n):
            damping[i][i] += small_factor(random)
        return block(mass, damping if damped else None, stiffness)
    return Draft(fill(random, unknowns, draw, largest=5), damped=damped)


EXTREMES = [many_copies, clusters, light_masses, strong_dampers, massless_dampers, nearly_critical, saddles, stiff_springs]
