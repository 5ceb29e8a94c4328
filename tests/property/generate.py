"""From a seed to a problem: a kind, blocks, steps that mix them, constraints, units, and what to ask."""
import random as random_numbers
from dataclasses import replace
from fractions import Fraction

from assemble import assemble, mix
from blocks import block
from kinds import KINDS, POSITIVE
from recipe import Recipe, Unsuitable


def generate(seed, kinds=KINDS):
    """The first recipe of this seed that makes a meaningful problem of one of these kinds, and the problem."""
    random = random_numbers.Random(seed)
    kind = random.choice(kinds)
    while True:
        try:
            recipe = random_recipe(random, kind)
            return recipe, assemble(recipe)
        except Unsuitable:
            pass


def random_recipe(random, kind):
    unknowns = random.randint(*random.choice([(1, 6), (1, 6), (7, 30), (20, 100)]))
    draft = kind(random, unknowns)
    recipe = Recipe(blocks=tuple(draft.blocks), damped=draft.damped, sharp=draft.sharp, kind=kind.__name__,
                    row_steps=draft.row_steps, column_steps=draft.column_steps)
    chance = random.random() < 0.4
    if chance if draft.constrained is None else draft.constrained:
        recipe = constrained(random, draft, recipe)
    if draft.mixed or recipe.removed:
        recipe = mixed(random, draft, recipe)
    order = list(range(recipe.size))
    random.shuffle(order)
    recipe = replace(recipe, order=tuple(order))
    if random.random() < 0.2:
        recipe = replace(recipe, units=random_units(random, recipe.size))
    if draft.unlike_units and random.random() < 0.5:
        recipe = replace(recipe, row_units=unlike_units(random, recipe))
    if random.random() < 0.3:
        recipe = replace(recipe, time_exponent=random.randint(-20, 20), mass_exponent=random.randint(-30, 30))
    return asked(random, draft, recipe)


def constrained(random, draft, recipe):
    """With unknowns that constraints take away; some constraints repeated, combined, scaled badly."""
    count = random.randint(1, max(1, min(20, recipe.kept // 2)))
    removed = []
    for _ in range(count):
        mass, stiffness = (random.choice([0, 1, random.choice(POSITIVE)]) for _ in range(2))
        damping = random.choice([0, 1, Fraction(1, 8)])
        if draft.rayleigh:
            damping = draft.rayleigh[0] * mass + draft.rayleigh[1] * stiffness
        loss = None
        if draft.blocks[0].loss:
            loss = [[random.choice([0, 1, Fraction(1, 8)]) if draft.loss_factor is None else draft.loss_factor * stiffness]]
        removed.append(block([[mass]], [[damping * draft.damped]], [[stiffness]], loss))
    if draft.nearly_redundant:
        rows, exponents = near_rows(random, count, recipe.kept + count)
        return replace(recipe, removed=tuple(removed), combinations=rows, row_exponents=exponents)
    rows = [[int(i == j) for j in range(count)] for i in range(count)]
    if random.random() < 0.4:
        for _ in range(random.randint(1, count)):
            source = random.choice(rows)
            if random.random() < 0.5:
                source = [random.choice([1, 1, -1, 2]) * a + random.choice([0, 1, -1]) * b
                          for a, b in zip(source, random.choice(rows))]
            if any(source):
                rows.append(list(source))
        random.shuffle(rows)
    exponents = [random.randint(-20, 20) for _ in rows] if random.random() < 0.3 else []
    return replace(recipe, removed=tuple(removed), combinations=tuple(map(tuple, rows)), row_exponents=tuple(exponents))


def near_rows(random, count, unknowns):
    """Rows that span all of so many unknowns, some at small angles to combinations of those before, some redundant;
    whole numbers and the powers of two they are to be scaled by."""
    rows, most = [], random.choice([20, 30, 45, 45])
    for k in range(count):
        row = [Fraction(random.choice([-1, 1, 1, 3])) * (j == k) for j in range(count)]
        if rows and random.random() < 0.7:
            others = rows[-1:] + random.sample(rows, random.randint(0, min(3, len(rows))))
            tiny = Fraction(1, 2**random.randint(8, most))
            row = combination([(random.choice([-1, 1, 1, 2]), other) for other in others] + [(tiny, row)])
        rows.append(row)
    if random.random() < 0.5:
        for _ in range(random.choice([1, random.randint(1, count), random.randint(1, count), unknowns + 1 - count])):
            rows.append(combination([(random.choice([-1, 1, 2]), random.choice(rows))
                                     for _ in range(random.randint(1, 2))]))
    rows = [row for row in rows if any(row)]
    random.shuffle(rows)
    exponents = [1 - max(a.denominator for a in row).bit_length() for row in rows]
    rows = [tuple(int(a * 2**-exponent) for a in row) for row, exponent in zip(rows, exponents)]
    if random.random() < 0.5:
        exponents = [exponent + random.randint(-20, 20) for exponent in exponents]
    return tuple(rows), tuple(exponents)


def combination(terms):
    """Sum of factors times rows."""
    return [sum(factor * row[j] for factor, row in terms) for j in range(len(terms[0][1]))]


def mixed(random, draft, recipe):
    """With rows and columns added to others: none, a few, or so many that every unknown moves in every mode."""
    count = int(recipe.size * random.choice([0, 0.5, 1, 2]))
    recipe = replace(recipe, steps=tuple(random_step(random, recipe.size) for _ in range(count)))
    if recipe.removed and recipe.size > 1:
        # Constraints that clamp single unknowns are only some of them.
        for i in range(recipe.kept, recipe.size):
            if random.random() < 0.8:
                step = (random.randrange(recipe.kept), i, random.choice([-1, 1]))
                recipe = replace(recipe, steps=recipe.steps + (step,))
    if not draft.symmetric and random.random() < 0.5:
        ways = [tuple(random_step(random, recipe.kept) for _ in range(int(recipe.kept * random.choice([0, 0.5, 1]))))
                for _ in range(2)] if recipe.kept > 1 else [(), ()]
        recipe = replace(recipe, row_steps=recipe.row_steps + ways[0], column_steps=recipe.column_steps + ways[1])
    return replace(recipe, steps=tuple(step for step in recipe.steps if step[0] != step[1]))


def random_step(random, size):
    i = random.randrange(size)
    j = random.choice([other for other in range(size) if other != i] or [i])
    return i, j, random.choice([-1, -1, 1, 1, 2])


def random_units(random, size):
    """Each unknown in a unit of its own, or two units."""
    if random.random() < 0.5:
        return tuple(random.randint(-20, 20) for _ in range(size))
    units = random.randint(-20, 20), random.randint(-20, 20)
    return tuple(random.choice(units) for _ in range(size))


def unlike_units(random, recipe):
    """Units of the rows, those of the columns where constraints touch."""
    touched = (mix(recipe)[1] != 0).any(axis=0)
    units = recipe.units or (0,) * recipe.size
    return tuple(unit if there else other for there, unit, other in
                 zip(touched, units, random_units(random, recipe.size)))


def asked(random, draft, recipe):
    """With a number of modes, a target and perhaps a formulation."""
    problem = assemble(recipe)
    values = [complex(re, im) for re, im, _ in problem.spectrum]
    count = sum(value.imag >= 0 for value in values)
    modes = random.randint(*random.choice([(1, 1), (1, min(count, 6)), (1, count), (count, count), (count + 1, count + 5)]))
    if draft.oscillating:
        modes = sum(value.imag > 0 for value in values) + random.randint(-3, 3)
        modes = min(max(modes, 1), count)
    options = []
    if random.random() < 0.15:
        options += ["--presolve", "off"]
    if random.random() < 0.1:
        options += ["--left"]
    if random.random() < 0.15 and not recipe.units and not recipe.time_exponent:
        options += ["--formulation", random.choice(formulations(draft, recipe))]
    target = random_target(random, values, 2.0**recipe.time_exponent)
    return replace(recipe, modes=modes, target=target, options=tuple(options))


def random_target(random, values, unit):
    sizes = [abs(value) for value in values if value] or [unit]
    size = random.choice(sizes) * random.uniform(0.2, 2)
    return random.choice([
        0, 0, 0,
        random.choice(values),
        random.choice(values) * (1 + random.uniform(-1e-3, 1e-3)),
        size, -size, 1j * size, -1j * size,
        complex(random.uniform(-1, 1), random.uniform(-1, 1)) * size,
        random.choice([1, -1, 1j]) * max(sizes) * 10**random.uniform(1, 6)])


def formulations(draft, recipe):
    """Names of the formulations that a problem of this kind can be given to."""
    if recipe.lossy:
        return ["quadratic", "damped-constrained" if recipe.removed else "damped"]
    if not recipe.damped:
        return ["quadratic"] + (["undamped-constrained"] if recipe.removed else ["undamped", "undamped-negative"])
    return ["quadratic", "damped-constrained" if recipe.removed else "damped"]
