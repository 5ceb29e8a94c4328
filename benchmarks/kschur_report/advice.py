"""Which method to use when, in sentences that are computed from the runs."""

import math

from .figures.scaling import curves
from .fit import fit_line, growth_exponent
from .methods import METHODS
from .plan import ACCURACY, SCALING, SOLIDS

ACCURATE, ROUGH = 1e-12, 1e-6  # backward errors
MEASURES = (
    ("time (s)", "median_seconds", 0.0),
    ("memory (bytes)", "median_memory", 0.0),
    ("worst backward error", "worst_backward_error", 1e-14),
    ("worst damping-ratio error", "worst_damping_error", 1e-12),
)
ABOUT_EQUAL = 1.15  # ratio of values that differ no more than the next run might


def label(name):
    return METHODS[name].label


def is_complete(run):
    """Whether it has every eigenvalue that was asked for."""
    return run.found == run.expected


def fastest(runs, backward_error):
    """Of each method the fastest run that is complete and that accurate, fastest method first."""
    best = {}
    for run in runs:
        if is_complete(run) and run.worst_backward_error <= backward_error:
            if run.method not in best or run.median_seconds < best[run.method].median_seconds:
                best[run.method] = run
    return sorted(best.values(), key=lambda run: run.median_seconds)


def problems_of(runs):
    return list(dict.fromkeys(run.problem for run in runs))


def summary(campaign):
    """The one sentence that stands first; empty of a single problem."""
    return " ".join(in_short(runs_by_problem(campaign)))


def paragraphs(campaign):
    """Which method to use when: a paragraph a problem, then what all problems say together."""
    found = [about_problem(*item) for item in runs_by_problem(campaign).items()]
    return [" ".join(sentences) for sentences in found if sentences] + across(campaign)


def across(campaign):
    """A paragraph about size, one about solids, one about hard cases."""
    found = [about_size(campaign), about_solids(campaign), about_hard_cases(campaign)]
    return [" ".join(sentences) for sentences in found if sentences]


def runs_by_problem(campaign):
    runs = campaign.study(ACCURACY)
    return {problem: [run for run in runs if run.problem == problem] for problem in problems_of(runs)}


def first_of_others(runs):
    """The fastest accurate run of the default and of any other method, None where there is none."""
    accurate = fastest(runs, ACCURATE)
    mine = next((run for run in accurate if run.method == "auto"), None)
    return mine, next((run for run in accurate if METHODS[run.method].is_other), None)


def in_short(by_problem):
    """How often the default is the method to use."""
    if len(by_problem) < 2:
        return []
    first = [
        problem for problem, runs in by_problem.items() if "auto" in (run.method for run in as_fast(fastest(runs, ACCURATE)))
    ]
    right = [problem for problem, runs in by_problem.items() if "auto" in (run.method for run in fastest(runs, ACCURATE))]
    return [
        f"In short: of {len(by_problem)} problems {label('auto')} as it comes has all modes to a backward error of "
        f"{ACCURATE:.0e} on {len(right)}, and is the fastest to have them, or as fast, on {len(first)}."
    ]


def is_as_fast(run, other):
    """Whether a run is not slower than another one: about the same time, or repetitions that overlap."""
    return run.median_seconds <= ABOUT_EQUAL * other.median_seconds or run.seconds.min() <= other.seconds.max()


def as_fast(runs):
    """Those that take about the time of the first, of runs that are sorted by time."""
    return [run for run in runs if is_as_fast(run, runs[0])]


def about_problem(problem, runs):
    accurate, rough = fastest(runs, ACCURATE), fastest(runs, ROUGH)
    if not accurate:
        best = min(runs, key=lambda run: run.worst_backward_error)
        return [
            f"No method gets all modes of {problem} to a backward error of {ACCURATE:.0e}; the best is {label(best.method)} "
            f"with {best.worst_backward_error:.0e}."
        ]
    first = accurate[0]
    equal = as_fast(accurate)
    words = [
        f"On {problem} ({first.unknowns:,} unknowns, {first.constraints:,} constraints, {first.modes_asked} lowest modes), "
        f"to have all modes to a backward error of {ACCURATE:.0e}, use "
        + " or ".join(with_formulation(run) for run in equal)
        + f": {first.median_seconds:.2g} s"
        + (", about the same." if len(equal) > 1 else ".")
    ]
    slower = [run for run in accurate if not is_as_fast(run, first)]
    if slower:
        words.append(
            "As accurate but slower: "
            + "; ".join(f"{label(run.method)}, {run.median_seconds / first.median_seconds:.1f} times" for run in slower)
            + "."
        )
    if not is_as_fast(first, rough[0]):
        words.append(f"If {ROUGH:.0e} is enough, {label(rough[0].method)} is faster ({rough[0].median_seconds:.2g} s).")
    inaccurate = {run.method for run in runs} - {run.method for run in accurate}
    if inaccurate:
        words.append(
            "Less accurate or incomplete at every tolerance: "
            + "; ".join(
                f"{label(name)}, {what_is_wrong([run for run in runs if run.method == name])}"
                for name in METHODS
                if name in inaccurate
            )
            + "."
        )
    return words


def with_formulation(run):
    """The default with what it chooses."""
    return label(run.method) + (f" as it comes (formulation {run.formulation})" if run.method == "auto" else "")


def what_is_wrong(runs):
    run = min(runs, key=lambda run: run.worst_backward_error)
    if run.found < run.expected:
        return f"{run.found} of {run.expected} eigenvalues"
    return f"{run.worst_backward_error:.0e}"


def growth(campaign):
    """How the time of the default grows: a sentence, or none."""
    by_method = curves(campaign, "median_seconds")
    if "auto" not in by_method:
        return []
    unknowns, seconds = by_method["auto"]
    line = fit_line(unknowns, seconds)
    if not line:
        return []
    return [
        f"Up to {unknowns[-1]:,.0f} unknowns the time of {label('auto')} grows as n to the power "
        f"{growth_exponent(unknowns, seconds):.2f} (straight line: R² = {line.r_squared:.4f})."
    ]


def about_size(campaign):
    """How the time of the default grows, and whom it is ahead of on the largest grid that both solved."""
    by_method = curves(campaign, "median_seconds")
    if "auto" not in by_method:
        return []
    unknowns, seconds = by_method["auto"]
    words = growth(campaign)
    ratios = []
    for method, (sizes, times) in by_method.items():
        common = [n for n in sizes if n in unknowns]
        if method != "auto" and common:
            n = max(common)
            ratios.append(
                f"{label(method)}, {times[list(sizes).index(n)] / seconds[list(unknowns).index(n)]:.1f} times at {n:,.0f}"
            )
    return words + (
        [f"In units of its time, on the largest problem that both solved: {'; '.join(ratios)}."] if ratios else []
    )


def about_solids(campaign):
    """The time of the others in units of that of the default, on each solid."""
    runs = campaign.study(SOLIDS)
    mine = {run.problem: run for run in runs if run.method == "auto"}
    ratios = [
        f"{run.problem}, {label(run.method)}, {run.median_seconds / mine[run.problem].median_seconds:.1f}"
        for run in runs
        if run.method != "auto" and run.problem in mine
    ]
    return [f"On solids, in units of the time of {label('auto')}: {'; '.join(ratios)}."] if ratios else []


def about_hard_cases(campaign):
    totals = {}
    for case in campaign.hard_cases:
        good, count = totals.get(case.method, (0, 0))
        totals[case.method] = good + case.good, count + 1
    if not totals:
        return []
    return [
        "Right of the hard cases that each was given: "
        + "; ".join(f"{label(method)}, {good} of {count}" for method, (good, count) in totals.items())
        + "."
    ]


def where_not_first(campaign):
    """What the default is not the best at: rows of study, problem, measure, best run, its value, ours."""
    rows = []
    for study in (ACCURACY, SCALING, SOLIDS):
        runs = campaign.study(study)
        for problem in problems_of(runs):
            here = [run for run in runs if run.problem == problem and is_complete(run)]
            for measure, attribute, negligible in MEASURES:
                rows += [[study, problem, measure, *row] for row in compare_measure(here, attribute, negligible)]
    return rows


def compare_measure(runs, attribute, negligible):
    """The best run, its value and the default's best, where they differ by more than is negligible."""
    known = [run for run in runs if not math.isnan(getattr(run, attribute))]
    mine = [run for run in known if run.method == "auto"]
    if not mine:
        return []
    best, ours = (min(candidates, key=lambda run: getattr(run, attribute)) for candidates in (known, mine))
    value, our_value = getattr(best, attribute), getattr(ours, attribute)
    equal = attribute == "median_seconds" and is_as_fast(ours, best)
    return [] if equal or our_value <= max(negligible, ABOUT_EQUAL * value) else [[best, value, our_value]]
