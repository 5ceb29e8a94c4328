"""How a problem is made of small blocks whose spectra are known, in steps that keep the spectrum.

The blocks stand on the diagonal, and behind them the unknowns that constraints remove. Adding multiples of rows and
columns to others mixes them; with the rows and the columns alike where the problem has constraints or is symmetric.
Constraints are combined and scaled, the unknowns and time get other units. All numbers stay exact doubles."""
from dataclasses import dataclass, replace


class Unsuitable(Exception):
    """The recipe makes no problem with a meaningful, exactly representable answer."""


@dataclass(frozen=True)
class Recipe:
    blocks: tuple
    # Blocks of one unknown each that constraints take away.
    removed: tuple = ()
    # Whether the problem has a damping matrix at all.
    damped: bool = True
    # (i, j, factor): row j times factor is added to row i, column j to column i. Not with symmetric problems.
    row_steps: tuple = ()
    column_steps: tuple = ()
    # (i, j, factor): column j is added to column i, then row j to row i.
    steps: tuple = ()
    # The unknowns in the order in which they are written; empty for the order of the blocks.
    order: tuple = ()
    # Each row of the constraint matrix, as factors of the constraints `removed unknown = 0`, and its power of two.
    combinations: tuple = ()
    row_exponents: tuple = ()
    # Powers of two that the unknowns are scaled by.
    units: tuple = ()
    # Those of the rows where they differ; alike at unknowns that constraints touch.
    row_units: tuple = ()
    # lambda is larger than that of the blocks by this power of two, all matrices by that one.
    time_exponent: int = 0
    mass_exponent: int = 0
    modes: int = 1
    target: complex = 0
    options: tuple = ()
    # Whether rounding of single entries, and not of whole matrices, says how well eigenvalues are known.
    sharp: bool = False
    # The name of the function in kinds.py.
    kind: str = ""

    @property
    def lossy(self):
        return any(block.loss for block in self.blocks)

    @property
    def kept(self):
        return sum(block.size for block in self.blocks)

    @property
    def size(self):
        return self.kept + len(self.removed)

    @property
    def command(self):
        """What the program is asked, as words."""
        target = complex(self.target)
        # Triangular matrices are meant as they are.
        return ["--modes", str(self.modes), f"--target={target.real!r},{target.imag!r}", "--symmetric", "no", *self.options]


def without(recipe, unknowns):
    """The recipe with these unknowns left out: whole blocks or removed unknowns."""
    unknowns = set(unknowns)
    places = {old: new for new, old in enumerate(i for i in range(recipe.size) if i not in unknowns)}
    blocks, removed, kept_constraints, first = [], [], [], 0
    for position, piece in enumerate(recipe.blocks + recipe.removed):
        if first in places:
            if position < len(recipe.blocks):
                blocks.append(piece)
            else:
                removed.append(piece)
                kept_constraints.append(position - len(recipe.blocks))
        first += piece.size

    def moved(steps):
        return tuple((places[i], places[j], factor) for i, j, factor in steps if i in places and j in places)

    rows = [tuple(row[k] for k in kept_constraints) for row in recipe.combinations]
    stay = [k for k, row in enumerate(rows) if any(row)]
    return replace(
        recipe, blocks=tuple(blocks), removed=tuple(removed), row_steps=moved(recipe.row_steps),
        column_steps=moved(recipe.column_steps), steps=moved(recipe.steps),
        order=tuple(places[i] for i in recipe.order if i in places),
        combinations=tuple(rows[k] for k in stay),
        row_exponents=tuple(recipe.row_exponents[k] for k in stay) if recipe.row_exponents else (),
        units=tuple(u for i, u in enumerate(recipe.units) if i in places),
        row_units=tuple(u for i, u in enumerate(recipe.row_units) if i in places))
