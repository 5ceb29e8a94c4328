"""The tables of results.md: of each method one run a problem, and times side by side. The page has every run."""

from .advice import ACCURATE, fastest, growth, is_complete, runs_by_problem
from .methods import METHODS
from .plan import ACCURACY, BLOCKS, CONSTRAINT_SCALING, DAMPERS, SCALING, SOLIDS, THREADS
from .tables import METHODS_NOTE, Table, error, found, hard_tables, megabytes, not_first_table

RUNNING = "seconds, MB"
NOT_VERSIONS = ("again", "command", "date")  # stand further up


def summary_tables(campaign):
    """Those that have rows."""
    every = [
        not_first_table(campaign),
        accuracy_table(campaign),
        side_by_side(campaign.study(SCALING), "unknowns", by_unknowns, by_method, "Growth with the number of unknowns",
                     " ".join([f"The grid of beams of the paper's Figure 5; {RUNNING}.", *growth(campaign)])),
        side_by_side(campaign.study(SOLIDS), "problem", by_problem, by_method, "Solids",
                     f"Cubes of eight-node bricks, clamped at a face, their 20 lowest modes; {RUNNING}."),
        side_by_side(campaign.study(DAMPERS), "dampers", by_dampers, by_form, "Growth with the number of dampers",
                     f"A grid of beams with proportional damping and dashpots to the ground; {RUNNING}; * what kschur takes by itself.",
                     marked_cost_of),
        side_by_side(campaign.study(CONSTRAINT_SCALING), "problem, method", by_problem_and_method, by_value,
                     "Constraint scaling", "Worst backward errors.", accuracy_of),
        side_by_side(campaign.study(BLOCKS), "problem", by_problem, by_value, "Vectors at a time",
                     f"Blocks of vectors; {RUNNING}."),
        side_by_side(campaign.study(THREADS), "problem", by_problem, by_value, "Threads",
                     f"By threads; {RUNNING}."),
        *hard_tables(campaign),
        method_table(campaign),
        note_table(campaign),
    ]  # fmt: skip
    return [table for table in every if table.rows]


def accuracy_table(campaign):
    """A row a method, a column a problem."""
    best = [run for runs in runs_by_problem(campaign).values() for run in best_of_each(runs)]
    table = side_by_side(
        sorted(best, key=lambda run: list(METHODS).index(run.method)),
        "method",
        by_method,
        by_problem,
        "Speed against accuracy",
        f"Of each method the fastest run with all modes to a backward error of {ACCURATE:.0e}, else the most accurate one: seconds (from "
        "matrices in memory to modes in memory), MB, worst backward error; in brackets the eigenvalues found, both of a pair, where some "
        "are missing.",
        lambda run: f"{cost_of(run)}, {error(run.worst_backward_error)}",
    )
    order = [table.header[0], *runs_by_problem(campaign)]
    places = [table.header.index(name) for name in order]
    return Table(table.title, table.note, order, [[row[place] for place in places] for row in table.rows])


def seconds(value):
    """Three digits, and all of those before the point."""
    return f"{value:.3g}" if value < 1000 else f"{value:.0f}"


def best_of_each(runs):
    """A run a method, fast and accurate ones first."""
    accurate = fastest(runs, ACCURATE)
    others = [name for name in METHODS if name in {run.method for run in runs} - {run.method for run in accurate}]
    return accurate + [min((run for run in runs if run.method == name), key=inaccuracy) for name in others]


def inaccuracy(run):
    """Of several runs the complete ones come first."""
    return not is_complete(run), run.worst_backward_error


def side_by_side(runs, what, row_of, column_of, title, note, cell_of=None):
    """A row each value of `row_of`, a column each of `column_of`."""
    cell_of = cell_of or cost_of
    columns = list(dict.fromkeys(column_of(run) for run in runs))
    rows = {}
    for run in sorted(runs, key=order_of) if row_of in (by_unknowns, by_dampers) else runs:
        rows.setdefault(row_of(run), {})[column_of(run)] = cell_of(run)
    return Table(title, note, [what, *columns], [[name, *(cells.get(column, "") for column in columns)] for name, cells in rows.items()])


def order_of(run):
    return run.unknowns, run.dampers


def by_unknowns(run):
    return f"{run.unknowns:,}"


def by_dampers(run):
    return str(run.dampers)


def by_problem(run):
    return run.problem


def by_problem_and_method(run):
    return f"{run.problem}, {METHODS[run.method].label}"


def by_value(run):
    return run.value


def by_method(run):
    return METHODS[run.method].label


def by_form(run):
    """The default by what it chooses, which the other rows have by name."""
    return run.formulation or METHODS[run.method].label


def cost_of(run):
    incomplete = "" if is_complete(run) else f" ({found(run)})"
    return f"{seconds(run.median_seconds)}, {megabytes(run.median_memory)}{incomplete}"


def marked_cost_of(run):
    return cost_of(run) + ("*" if run.method == "auto" else "")


def accuracy_of(run):
    return error(run.worst_backward_error)


def method_table(campaign):
    """Their settings, without the libraries, which stand with the versions."""
    used = {run.method for run in campaign.runs}
    rows = [[method.label, method.settings] for name, method in METHODS.items() if name in used]
    return Table("Methods and their settings", METHODS_NOTE, ["method", "settings"], rows)


def note_table(campaign):
    """What did not run, once for each method and reason, but for what only was not run twice."""
    problems = {}
    for note in campaign.notes:
        if not note.endswith("not run twice."):
            head, colon, reason = note.partition(": ")
            method, on, problem = head.partition(" on ")
            problems.setdefault((method + on, colon + reason), []).append(problem)
    return Table("Left out", "", ["note"], [[method + "; ".join(names) + reason] for (method, reason), names in problems.items()])


def versions(campaign):
    """The machine and what is installed there, in one paragraph."""
    facts = {**campaign.machine, **campaign.settings}
    names = sorted(set(facts) - set(NOT_VERSIONS), key=str.lower)
    words = [f"{facts[name]}" if str(facts[name]).startswith(name) else f"{name} {facts[name]}" for name in names]
    return "; ".join(dict.fromkeys([*words, *sorted({run.library for run in campaign.runs if run.library})])) + "."
