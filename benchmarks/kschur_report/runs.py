"""What a campaign measured, and its HDF5 file."""

from dataclasses import asdict, dataclass, field, fields

import h5py
import numpy as np

PHASES = ("analyze", "factorize", "solve", "orthogonalize", "examine", "place", "iterate", "recover", "judge")


def nothing():
    return field(default_factory=lambda: np.zeros(0))


@dataclass
class Run:
    """One combination of problem, method, tolerance and value of the option of its study.

    Seconds and memory are of each repetition, the rest is of the first. NaN and empty arrays where not known. `expected` and
    `found` count eigenvalues, two for a conjugate pair: those of kschur at a tight tolerance, and which of them a method has.
    Errors of frequency and damping and condition numbers are of the modes that have a reference, in one order for all methods.
    """

    study: str
    problem: str
    method: str
    tolerance: float
    value: str = ""
    failure: str = ""
    unknowns: int = 0
    constraints: int = 0
    dampers: int = 0
    modes_asked: int = 0
    shift: float = 0.0
    formulation: str = ""
    reason: str = ""
    certified: str = ""
    library: str = ""
    operator_applications: int = 0
    expected: int = 0
    found: int = 0
    reference_uncertainty: float = float("nan")
    seconds: np.ndarray = nothing()
    phases: np.ndarray = field(default_factory=lambda: np.zeros((0, len(PHASES))))
    memory_bytes: np.ndarray = nothing()
    eigenvalues: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=complex))
    reported_backward_error: np.ndarray = nothing()
    backward_error: np.ndarray = nothing()
    motion: np.ndarray = nothing()
    constraint: np.ndarray = nothing()
    motion_rows: np.ndarray = nothing()
    constraint_rows: np.ndarray = nothing()
    frequency_error: np.ndarray = nothing()
    damping_error: np.ndarray = nothing()
    condition: np.ndarray = nothing()

    @property
    def is_good(self):
        return not self.failure and len(self.backward_error) > 0

    @property
    def median_seconds(self):
        return median(self.seconds)

    @property
    def spread(self):
        """How far the repetitions lie apart, relative to their median; NaN of a single one."""
        return (self.seconds.max() - self.seconds.min()) / self.median_seconds if len(self.seconds) > 1 else float("nan")

    @property
    def median_memory(self):
        return median(self.memory_bytes)

    @property
    def worst_backward_error(self):
        return worst(self.backward_error)

    @property
    def worst_damping_error(self):
        return worst(self.damping_error)

    @property
    def worst_frequency_error(self):
        return worst(self.frequency_error)


def median(values):
    return float(np.median(values)) if len(values) else float("nan")


def worst(values):
    known = values[~np.isnan(values)]
    return float(np.max(known)) if len(known) else float("nan")


@dataclass
class HardCase:
    """One line of benchmark_hard_cases."""

    name: str
    method: str
    found: int
    expected: int
    backward_error: float
    eigenvalue_error: float
    good: bool
    message: str = ""


@dataclass
class Campaign:
    """All that the page shows."""

    title: str
    preset: str
    machine: dict
    settings: dict = field(default_factory=dict)
    notes: list = field(default_factory=list)
    runs: list = field(default_factory=list)
    hard_cases: list = field(default_factory=list)

    def study(self, name):
        """The runs of one study that gave modes."""
        return [run for run in self.runs if run.study == name and run.is_good]

    def add(self, runs):
        """Those of one study and problem, in place of what was measured of it before."""
        measured = {(run.study, run.problem) for run in runs}
        self.runs = [run for run in self.runs if (run.study, run.problem) not in measured] + runs


def write_campaign(path, campaign):
    """One group a run: scalars as attributes, arrays as datasets. Takes the place of an older file when it is complete."""
    growing = path.with_suffix(".part")
    with h5py.File(growing, "w") as file:
        file.attrs.update(title=campaign.title, preset=campaign.preset)
        file.create_group("machine").attrs.update(campaign.machine)
        file.create_group("settings").attrs.update(campaign.settings)
        file["notes"] = np.array(campaign.notes, dtype=h5py.string_dtype())
        for folder, items in (("runs", campaign.runs), ("hard_cases", campaign.hard_cases)):
            for number, item in enumerate(items):
                group = file.create_group(f"{folder}/{number:04d}")
                for name, value in asdict(item).items():
                    if isinstance(value, np.ndarray):
                        group[name] = value
                    else:
                        group.attrs[name] = value
    growing.replace(path)


def read_campaign(path):
    """What `write_campaign` wrote."""
    with h5py.File(path, "r") as file:
        campaign = Campaign(
            file.attrs["title"],
            file.attrs["preset"],
            plain(file["machine"].attrs),
            plain(file["settings"].attrs),
            [note.decode() for note in file["notes"][:]],
        )
        for folder, kind, items in (("runs", Run, campaign.runs), ("hard_cases", HardCase, campaign.hard_cases)):
            for group in file.get(folder, {}).values():
                known = {f.name for f in fields(kind)}
                values = {**plain(group.attrs), **{name: data[()] for name, data in group.items()}}
                items.append(kind(**{name: value for name, value in values.items() if name in known}))
    return campaign


def plain(attributes):
    """Attributes as the types of Python."""
    return {name: value.item() if hasattr(value, "item") else value for name, value in attributes.items()}
