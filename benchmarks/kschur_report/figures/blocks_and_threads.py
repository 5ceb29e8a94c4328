"""Time against the vectors that are taken at a time, and against threads."""

from ..plan import BLOCKS, THREADS
from .picture import Picture, legend_below, panels, tidy_logarithms

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
MARKERS = ("o", "s", "^", "D")


def draw(campaign):
    """A picture a study, a line a problem."""
    return [
        picture
        for study, name, what in (
            (BLOCKS, "time_against_block", "block of vectors"),
            (THREADS, "time_against_threads", "threads"),
        )
        for picture in draw_study(campaign.study(study), name, what)
    ]


def draw_study(runs, name, what):
    """Seconds against the numbers that an option was given."""
    if not runs:
        return []
    figure, (axis,) = panels(1, height=4.6)
    problems = list(dict.fromkeys(run.problem for run in runs))
    gains = []
    for number, problem in enumerate(problems):
        line = sorted((run for run in runs if run.problem == problem), key=lambda run: int(run.value))
        axis.loglog(
            [int(run.value) for run in line],
            [run.median_seconds for run in line],
            color=COLOURS[number % len(COLOURS)],
            marker=MARKERS[number % len(MARKERS)],
            label=f"{problem}, {line[0].unknowns} unknowns",
        )
        best = min(line, key=lambda run: run.median_seconds)
        gains.append(f"{problem} {best.value} ({line[0].median_seconds / best.median_seconds:.2f} times as fast as {line[0].value})")
    axis.set_xlabel(f"{what} (-)")
    axis.set_ylabel("time (s)")
    tidy_logarithms(axis)
    axis.set_xticks(sorted({int(run.value) for run in runs}), labels=sorted({run.value for run in runs}, key=int))
    legend_below(figure, (axis,))
    return [
        Picture(
            name,
            f"Time against {what}",
            "The same modes each time. The fastest: " + "; ".join(gains) + ".",
            figure,
            ["problem", what.replace(" ", "_"), "vectors", "time_s", "memory_bytes"],
            [[run.problem, run.value, run.operator_applications, run.median_seconds, run.median_memory] for run in runs],
        )
    ]
