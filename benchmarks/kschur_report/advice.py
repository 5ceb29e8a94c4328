"""Which method to use when, in sentences that are computed from the runs."""
import math

from .figures.scaling import curves
from .fit import fit_line, growth_exponent
from .methods import METHODS
from .plan import ACCURACY, SCALING

ACCURATE, ROUGH = 1e-12, 1e-6  # backward errors
ABOUT_EQUAL = 1.15  # ratio of times that differ no more than the next run might


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


def paragraphs(campaign):
    """What stands first on the page."""
    runs = campaign.study(ACCURACY)
    found = [about_problem(problem, [run for run in runs if run.problem == problem]) for problem in problems_of(runs)]
    return [" ".join(sentences) for sentences in (*found, about_size(campaign), about_hard_cases(campaign)) if sentences]


def about_problem(problem, runs):
    accurate, rough = fastest(runs, ACCURATE), fastest(runs, ROUGH)
    if not accurate:
        best = min(runs, key=lambda run: run.worst_backward_error)
        return [f"No method gets all modes of {problem} to a backward error of {ACCURATE:.0e}; the best is {label(best.method)} "
                f"with {best.worst_backward_error:.0e}."]
    first = accurate[0]
    equal = [run for run in accurate if run.median_seconds <= ABOUT_EQUAL * first.median_seconds]
    words = [f"{problem}, {first.unknowns:,} unknowns, {first.constraints:,} constraints, {first.modes_asked} lowest modes: to have all of "
             f"them to a backward error of {ACCURATE:.0e}, use " + " or ".join(with_formulation(run) for run in equal)
             + f" ({first.median_seconds:.2g} s" + (", about the same)." if len(equal) > 1 else ").")]
    slower = accurate[len(equal):]
    if slower:
        words.append("As accurate but slower: " + listed(
            f"{label(run.method)} ({run.median_seconds / first.median_seconds:.1f} times)" for run in slower) + ".")
    if rough[0].median_seconds * ABOUT_EQUAL < first.median_seconds:
        words.append(f"If {ROUGH:.0e} is enough, {label(rough[0].method)} is faster ({rough[0].median_seconds:.2g} s).")
    inaccurate = {run.method for run in runs} - {run.method for run in accurate}
    if inaccurate:
        words.append("Less accurate or incomplete at every tolerance: " + listed(
            f"{label(name)} ({what_is_wrong([run for run in runs if run.method == name])})" for name in METHODS if name in inaccurate) + ".")
    return words


def with_formulation(run):
    """The default with what it chooses."""
    return label(run.method) + (f" as it comes (formulation {run.formulation})" if run.method == "auto" else "")


def what_is_wrong(runs):
    run = min(runs, key=lambda run: run.worst_backward_error)
    if run.found < run.expected:
        return f"{run.found} of {run.expected} eigenvalues"
    return f"{run.worst_backward_error:.0e}"


def listed(items):
    items = list(items)
    return items[0] if len(items) == 1 else ", ".join(items[:-1]) + " and " + items[-1]


def about_size(campaign):
    """How the time of the default grows, and whom it is ahead of on the largest grid that both solved."""
    by_method = curves(campaign, "median_seconds")
    if "auto" not in by_method:
        return []
    unknowns, seconds = by_method["auto"]
    line = fit_line(unknowns, seconds)
    words = []
    if line:
        words.append(f"Up to {unknowns[-1]:,.0f} unknowns the time of {label('auto')} grows as n to the power "
                     f"{growth_exponent(unknowns, seconds):.2f} (straight line: R² = {line.r_squared:.4f}).")
    ratios = []
    for method, (sizes, times) in by_method.items():
        common = [n for n in sizes if n in unknowns]
        if method != "auto" and common:
            n = max(common)
            ratios.append(f"{label(method)} {times[list(sizes).index(n)] / seconds[list(unknowns).index(n)]:.1f} times as "
                          f"long at {n:,.0f}")
    return words + (["Compared with it, " + listed(ratios) + " unknowns."] if ratios else [])


def about_hard_cases(campaign):
    totals = {}
    for case in campaign.hard_cases:
        good, count = totals.get(case.method, (0, 0))
        totals[case.method] = good + case.good, count + 1
    if not totals:
        return []
    return ["Of the hard cases that each was given, " + listed(f"{label(method)} solves {good} of {count}" for method, (good, count) in totals.items())
            + "."]


def where_not_first(campaign):
    """What the default is not the best at, with the numbers: rows of study, problem, measure, best, its value, ours, ratio."""
    rows = []
    for study in (ACCURACY, SCALING):
        runs = campaign.study(study)
        for problem in problems_of(runs):
            here = [run for run in runs if run.problem == problem and is_complete(run)]
            for measure, attribute in (("time (s)", "median_seconds"), ("memory (bytes)", "median_memory"),
                                       ("worst backward error", "worst_backward_error"),
                                       ("worst damping-ratio error", "worst_damping_error")):
                rows += compare_measure(study, problem, measure, here, attribute)
    return rows


def compare_measure(study, problem, measure, runs, attribute):
    """One row where another method has a better value than the default's best."""
    values = [(getattr(run, attribute), run.method) for run in runs]
    values = [(value, method) for value, method in values if not math.isnan(value)]
    ours = min((value for value, method in values if method == "auto"), default=None)
    if ours is None:
        return []
    best, method = min(values)
    if best <= 0 or ours / best < ABOUT_EQUAL:
        return []
    return [[study, problem, measure, label(method), best, ours, ours / best]]
