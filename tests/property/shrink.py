"""A smaller recipe that fails in the same way."""
from dataclasses import replace

from recipe import without


def shrink(recipe, fails, trials=400):
    """The recipe, made simpler step by step while `fails(recipe)` holds. At most so many recipes are tried."""
    while True:
        for candidate in simpler(recipe):
            if trials == 0:
                return recipe
            trials -= 1
            if fails(candidate):
                recipe = candidate
                break
        else:
            return recipe


def simpler(recipe):
    """Recipes with something left out, much before little."""
    for some in chunks(pieces(recipe)):
        fewer = without(recipe, [unknown for _, unknowns in some for unknown in unknowns])
        modes = recipe.modes - sum(mode_count(block) for block, unknowns in some if unknowns[0] < recipe.kept)
        if 0 < modes < recipe.modes:
            yield replace(fewer, modes=modes)
        yield fewer
    for name in ("steps", "row_steps", "column_steps"):
        for some in chunks(getattr(recipe, name)):
            yield replace(recipe, **{name: tuple(step for step in getattr(recipe, name) if step not in some)})
    for name, simple in (("units", ()), ("row_units", ()), ("row_exponents", ()), ("order", ()), ("time_exponent", 0),
                         ("mass_exponent", 0)):
        if getattr(recipe, name) != simple:
            yield replace(recipe, **{name: simple})
    for k in range(len(recipe.combinations)):
        yield replace(recipe, combinations=left_out(recipe.combinations, k),
                      row_exponents=left_out(recipe.row_exponents, k))
    for name in (word for word in recipe.options if word.startswith("--")):
        k = recipe.options.index(name)
        values = next((i for i, word in enumerate(recipe.options[k + 1:]) if word.startswith("--")), len(recipe.options))
        yield replace(recipe, options=recipe.options[:k] + recipe.options[k + 1 + values:])
    for modes in sorted({1, recipe.modes // 2, recipe.modes - 1}):
        if 0 < modes < recipe.modes:
            yield replace(recipe, modes=modes)
    for target in (0, round_number(recipe.target, 1), round_number(recipe.target, 3)):
        if len(repr(target)) < len(repr(recipe.target)):
            yield replace(recipe, target=target)


def pieces(recipe):
    """Each block with its unknowns, also those that constraints remove."""
    found, first = [], 0
    for block in recipe.blocks + recipe.removed:
        found.append((block, range(first, first + block.size)))
        first += block.size
    return found


def mode_count(block):
    return block.zeros + sum(eigenvalue.multiplicity for eigenvalue in block.eigenvalues)


def chunks(items):
    """All items, then halves of them, quarters, and so on to single ones."""
    size = len(items)
    while size > 0:
        for first in range(0, len(items), size):
            yield items[first:first + size]
        size //= 2


def left_out(items, k):
    return items[:k] + items[k + 1:]


def round_number(number, digits):
    number = complex(number)
    return complex(float(f"{number.real:.{digits}g}"), float(f"{number.imag:.{digits}g}"))
