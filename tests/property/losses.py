"""Kinds of problems with a loss matrix H: what other kinds have, and i H besides."""
from dataclasses import replace
from fractions import Fraction

from blocks import Block
from kinds import (POSITIVE, any_matrices, circulatory, copies, follower_forces, fill, general_damping,
                   gyroscopic, indefinite, positive, proportional, rigid_motions, rotors, semidefinite, singular_mass, total,
                   undamped, unsymmetric, wide, zeros)


def with_loss(draft, loss_of, **changes):
    """With loss_of(block) as the loss of each block; copies of a block stay copies."""
    found = {}
    for one in draft.blocks:
        if id(one) not in found:
            loss = tuple(tuple(Fraction(a) for a in row) for row in loss_of(one))
            found[id(one)] = Block(one.mass, one.damping, one.stiffness, loss)
    return replace(draft, blocks=[found[id(one)] for one in draft.blocks], **changes)


def times(factor, matrix):
    return total((factor, [list(row) for row in matrix]))


def factor(random):
    """A loss factor, from steel to rubber."""
    return Fraction(random.choice([1, 1, 3, 5, 7]), 2**random.choice([0, 1, 2, 3, 6, 10]))


def one_material(random, unknowns):
    """H = g K, without damping and with."""
    g = factor(random)
    base = random.choice([undamped, proportional, general_damping, rigid_motions])
    return with_loss(base(random, unknowns), lambda one: times(g, one.stiffness), loss_factor=g)


def by_part(random, unknowns):
    """Each block of another material."""
    base = random.choice([undamped, proportional, general_damping, rigid_motions, gyroscopic])
    return with_loss(base(random, unknowns), lambda one: times(factor(random), one.stiffness))


def in_few_parts(random, unknowns):
    """H = g K, and more in one or two unknowns."""
    g = random.choice([0, factor(random)])
    base = random.choice([undamped, proportional])(random, unknowns)
    chosen = random.sample(range(len(base.blocks)), min(len(base.blocks), random.randint(1, 2)))
    lossy = {id(base.blocks[i]) for i in chosen}

    def loss_of(one):
        loss = times(g, one.stiffness)
        if id(one) in lossy:
            i = random.randrange(one.size)
            loss[i][i] += random.choice(POSITIVE) * factor(random)
        return loss
    return with_loss(base, loss_of)


def semidefinite_loss(random, unknowns):
    """Any H that takes energy or none, beside positive and singular matrices."""
    base = random.choice([undamped, proportional, general_damping, singular_mass, rigid_motions, copies])
    return with_loss(base(random, unknowns), lambda one: times(
        factor(random), random.choice([positive, semidefinite])(random, one.size)))


def heavily_damped(random, unknowns):
    """Decays without losses that these turn off the real axis, up and down."""
    base = general_damping(random, unknowns)
    return with_loss(base, lambda one: times(factor(random), random.choice([positive, semidefinite])(random, one.size)))


def lossy_rotors(random, unknowns):
    base = random.choice([rotors, gyroscopic, circulatory, follower_forces])
    return with_loss(base(random, unknowns), lambda one: times(factor(random), semidefinite(random, one.size)))


def gains(random, unknowns):
    """H that feeds energy here and there."""
    base = random.choice([undamped, proportional, general_damping])
    return with_loss(base(random, unknowns), lambda one: times(factor(random), indefinite(random, one.size)))


def unsymmetric_loss(random, unknowns):
    base = random.choice([undamped, general_damping, any_matrices, gyroscopic])
    return with_loss(base(random, unknowns), lambda one: unsymmetric(random, one.size), symmetric=False)


def wide_losses(random, unknowns):
    """Stiff and soft parts, each of another material."""
    return with_loss(wide(random, unknowns), lambda one: times(factor(random), one.stiffness))


LOSSES = [one_material, by_part, in_few_parts, semidefinite_loss, heavily_damped, lossy_rotors, gains, unsymmetric_loss,
          wide_losses]
