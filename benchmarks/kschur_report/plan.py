"""What is run: studies of scenes, methods, tolerances and values of an option."""

import os
from dataclasses import dataclass, replace

from .methods import METHODS, OURS, PEER_NAMES

ACCURACY, SCALING, CONSTRAINT_SCALING, DAMPERS = "accuracy", "scaling", "constraint-scaling", "dampers"
BLOCKS, THREADS, SOLIDS = "blocks", "threads", "solids"


@dataclass(frozen=True)
class Scene:
    """A problem: arguments of `kschur scene`, or the file of a user."""

    label: str
    arguments: tuple = ()
    file: str = ""
    dampers: int = 0


@dataclass(frozen=True)
class Study:
    """Every method on every problem, at every tolerance and every value of one option of kschur.

    `repeats` are the most that are made of one run; it is not repeated beyond `seconds` in all. A run longer than
    `patience` (seconds) is stopped, and in a study of growing problems the method is not asked further once it
    needed a quarter of that.
    """

    name: str
    scenes: tuple
    methods: tuple
    modes: int
    tolerances: tuple = (1e-10,)
    option: str = ""
    values: tuple = ("",)
    repeats: int = 5
    seconds: float = 10.0
    patience: float = 60.0
    grows: bool = False
    reference_order: int = 0  # largest n + m for which a reference is computed


def grid(cells):
    return Scene(f"grid {cells}", ("grid", "--cells", cells))


def damped_grid(cells, dampers):
    return Scene(
        f"grid {cells}, {dampers} {'dashpot' if dampers == 1 else 'dashpots'}", ("grid", "--cells", cells, "--dashpots", str(dampers)), dampers=dampers
    )


def cantilever(elements, tip_mass):
    return Scene(f"cantilever, {tip_mass:g} kg", ("cantilever", "--elements", str(elements), "--tip-mass", f"{tip_mass:g}"))


def turbine(speed):
    return Scene(f"turbine, {speed:g} rpm", ("turbine", "--speed", f"{speed:g}"))


def cube(cells, damping, label):
    return Scene(f"cube {cells}^3, {label}", ("block", "--cells", str(cells), "--damping", damping))


CRANK = Scene("crank", ("crank",))
FINE_CRANK = Scene("crank, fine", ("crank", "--density", "8"))

# The ratio of the paper's grids, 10 to 7.
GRIDS = tuple(
    grid(cells) for cells in ("6x4", "10x7", "20x14", "30x21", "40x28", "60x42", "90x63", "130x90", "180x125", "220x150")
)
# The default takes low-rank and dense where they pay; on large problems dense would take minutes.
ALL = tuple(name for name in OURS if name not in ("low-rank", "dense")) + PEER_NAMES
STRUCTURED = ("auto", "quadratic")
GROWING = ("auto", "quadratic", "pencil", "arpack-fair", "slepc-toar-unscaled", "slepc-symmetric")
BY_DAMPERS = ("auto", "low-rank", "quadratic", "slepc-toar-unscaled")
# One thread, two, and so on to all cores.
TEAMS = tuple(str(2**k) for k in range(max(2, os.cpu_count() or 1).bit_length()))
TOLERANCES = (1e-6, 1e-8, 1e-10, 1e-12)


def quick():
    """Minutes on two cores."""
    methods = tuple(name for name in ALL if name != "pencil-zero")
    return (
        Study(ACCURACY, (grid("20x14"),), methods, 56, TOLERANCES[::2] + TOLERANCES[-1:], seconds=6, reference_order=20000),
        Study(ACCURACY, (cantilever(100, 4000), turbine(12.1)), methods, 20, TOLERANCES, seconds=1, reference_order=20000),
        Study(
            CONSTRAINT_SCALING,
            (cantilever(100, 1e9), turbine(12.1)),
            ("pencil",),
            20,
            repeats=1,
            option="--constraint-scaling", values=("row", "scalar", "none"),
        ),
        Study(
            SCALING,
            GRIDS[:6],
            GROWING,
            56,
            repeats=5,
            seconds=4,
            patience=40,
            grows=True,
        ),
        *solids((6, 10, 14), 4),
        dampers("20x14", (1, 2, 4, 8, 16, 24, 32), 2),
        *blocks_and_threads((grid("20x14"), grid("60x42")), 56, 4),
    )


def dampers(cells, counts, seconds, methods=BY_DAMPERS):
    """A proportional model with more and more dampers."""
    return Study(DAMPERS, tuple(damped_grid(cells, count) for count in counts), methods, 56, seconds=seconds, patience=300)


def blocks_and_threads(scenes, modes, seconds, methods=("auto",)):
    """The same problems with more vectors at a time, and with more threads."""
    return (
        Study(BLOCKS, scenes, methods, modes, seconds=seconds, patience=300, option="--block", values=("1", "2", "4", "8")),
        Study(THREADS, scenes, methods, modes, seconds=seconds, patience=300, option="--threads", values=TEAMS),
    )


def solids(sizes, seconds, repeats=5):
    """Cubes of bricks, each damping with the form of SLEPc that suits it."""
    proportional, *others = (
        tuple(cube(cells, damping, label) for cells in sizes)
        for damping, label in (("rayleigh", "proportional"), ("dashpot", "one dashpot"), ("general", "general"))
    )
    return (
        Study(SOLIDS, proportional, ("auto", "slepc-symmetric"), 20, seconds=seconds, repeats=repeats, patience=600),
        Study(SOLIDS, sum(others, ()), ("auto", "slepc-toar-cholesky"), 20, seconds=seconds, repeats=repeats, patience=600),
    )


def full():
    """About an hour on two cores, up to a million unknowns."""
    lowest = (cantilever(100, 4000), turbine(12.1), CRANK)
    return (
        Study(ACCURACY, (grid("20x14"),), ALL, 56, TOLERANCES, seconds=5, patience=120, reference_order=20000),
        Study(ACCURACY, lowest, ALL, 20, TOLERANCES, seconds=2, patience=120, reference_order=20000),
        Study(SCALING, GRIDS[1:], GROWING, 56, seconds=20, patience=320, grows=True),
        Study(
            CONSTRAINT_SCALING,
            (grid("20x14"), cantilever(100, 1e9), turbine(12.1)),
            ("pencil", "pencil-zero"),
            20,
            repeats=1,
            option="--constraint-scaling", values=("row", "scalar", "none"),
        ),
        Study(ACCURACY, (grid("60x42"),), ALL, 56, seconds=5, patience=300),
        *solids((10, 14, 20, 28), 120, repeats=3),
        dampers("60x42", (1, 2, 4, 8, 16, 32, 64), 20),
        *blocks_and_threads((grid("60x42"), grid("220x150")), 56, 120),
        *blocks_and_threads((FINE_CRANK,), 20, 60),
        Study(ACCURACY, (FINE_CRANK,), ("auto", "quadratic", "arpack-fair", "slepc-toar"), 20, seconds=30, patience=300),
    )


def tiny():
    """Seconds: for the test of this program."""
    methods = ("auto", "quadratic", "pencil", "arpack-fair")
    return (
        Study(ACCURACY, (grid("6x4"),), methods, 20, (1e-8, 1e-12), repeats=2, reference_order=20000),
        Study(CONSTRAINT_SCALING, (cantilever(10, 4000),), ("pencil",), 8, repeats=1, option="--constraint-scaling", values=("row", "scalar", "none")),
        Study(SCALING, tuple(grid(cells) for cells in ("3x2", "6x4", "9x6")), STRUCTURED, 20, repeats=2, grows=True),
        *solids((2, 3), 0),
        dampers("6x4", (1, 4, 16), 0, ("auto", "low-rank", "quadratic")),
        *blocks_and_threads((grid("3x2"), grid("6x4")), 20, 0),
    )


PRESETS = {"quick": quick, "full": full, "tiny": tiny}


def of_problem(file, label, modes, constrained, preset):
    """The studies that apply to a user's own problem."""
    seconds, patience = {"tiny": (0, 60), "quick": (20, 120), "full": (1e9, 3600)}[preset]
    scene = (Scene(label, file=file),)
    studies = (Study(ACCURACY, scene, ALL, modes, TOLERANCES, seconds=seconds, patience=patience, reference_order=20000),)
    if constrained:
        studies += (
            Study(
                CONSTRAINT_SCALING,
                scene,
                ("pencil",),
                modes,
                repeats=1,
                patience=patience,
                option="--constraint-scaling", values=("row", "scalar", "none"),
            ),
        )
    return studies


def without_peers(studies):
    """The same with our methods only."""
    kept = (replace(study, methods=tuple(name for name in study.methods if not METHODS[name].is_peer)) for study in studies)
    return tuple(study for study in kept if study.methods)


# The groups of hard cases of a preset; all where none is named.
HARD_GROUPS = {"tiny": ("brakes",)}
