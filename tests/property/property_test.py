#!/usr/bin/env python3
"""Random modal problems with exact spectra, solved by the program and judged."""
import argparse
import math
import os
import statistics
import sys
import tempfile
import time
from collections import Counter
from dataclasses import replace
from multiprocessing import Pool
from pathlib import Path

os.environ["OPENBLAS_NUM_THREADS"] = "1"
from assemble import assemble  # noqa: E402
from bands import band_of, judge_band  # noqa: E402
from case_folder import write_case  # noqa: E402
from edges import EDGES  # noqa: E402
from extremes import EXTREMES  # noqa: E402
from generate import generate  # noqa: E402
from judge import CLASSES, OK, Verdict, judge_folder  # noqa: E402
from kinds import KINDS  # noqa: E402
from losses import LOSSES  # noqa: E402
from recipe import Unsuitable  # noqa: E402
from shrink import shrink  # noqa: E402


def examine(job):
    """The recipe of a seed and the verdict on what the program says of it. A problem that fails is kept."""
    command, seed, kinds, bands, keep, smaller = job
    recipe, problem = generate(seed, kinds)
    if bands:
        problem = replace(problem, command=["--band", "{!r},{!r}".format(*band_of(seed, problem.spectrum)), "--symmetric", "no"])
    verdict = judge_problem(command, problem)
    if keep and verdict.failed:
        if smaller and not bands:
            problem = assemble(shrink(recipe, lambda candidate: judge_recipe(command, candidate).name == verdict.name))
        write_case(Path(keep) / f"seed-{seed}", replace(problem, command=problem.command + command[1:]))
    return seed, recipe, verdict


def judge_recipe(command, recipe):
    try:
        return judge_problem(command, assemble(recipe))
    except Unsuitable:
        return Verdict(OK)


def replace_options(words, options):
    """The words of a command with these options in the place of the same ones: none may be given twice."""
    groups = [[]]
    for word in words:
        if word.startswith("--"):
            groups.append([])
        groups[-1].append(word)
    return [word for group in groups if not set(group[:1]) & set(options) for word in group] + options


def judge_problem(command, problem):
    program, *options = command
    problem = replace(problem, command=replace_options(problem.command, options))
    with tempfile.TemporaryDirectory(prefix="kschur-property-") as folder:
        write_case(folder, problem)
        judge = judge_band if "--band" in problem.command else judge_folder
        return judge(program, folder, problem)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program", help="the program kschur")
    parser.add_argument("--seeds", default="0:500", metavar="A:B", help="from A to B, without B (%(default)s)")
    parser.add_argument("--extremes", action="store_true", help="the kinds at the edges in place of the others")
    parser.add_argument("--edges", action="store_true", help="kinds at the edges of decisions in place of the others")
    parser.add_argument("--losses", action="store_true", help="kinds with a loss matrix in place of the others")
    parser.add_argument("--kind", metavar="NAME", help="only that one of them")
    parser.add_argument("--bands", action="store_true", help="ask for all modes of a band in place of the nearest ones")
    parser.add_argument("--keep", metavar="FOLDER", help="write problems that fail there, each a folder")
    parser.add_argument("--shrink", action="store_true", help="make them as small as they fail in the same way")
    parser.add_argument("--options", default="", metavar="WORDS", help="of the program, for each solve: \"--block 2\"")
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="so many at the same time (%(default)s)")
    options = parser.parse_args()
    first, last = map(int, options.seeds.split(":"))
    command, started = [os.path.abspath(options.program), *options.options.split()], time.time()
    kinds = EDGES if options.edges else EXTREMES if options.extremes else LOSSES if options.losses else KINDS
    kinds = [kind for kind in kinds if options.kind in (None, kind.__name__)] or parser.error("no such kind")
    jobs = ((command, seed, kinds, options.bands, options.keep, options.shrink) for seed in range(first, last))
    known = read_known()
    by_class, by_kind, failures, ratios = Counter(), Counter(), 0, []
    with Pool(options.jobs) as pool:
        for seed, recipe, verdict in pool.imap(examine, jobs):
            by_class[verdict.name] += 1
            by_kind[recipe.kind, verdict.name] += 1
            failures += verdict.failed != (seed in known)
            ratios += verdict.ratios
            if seed in known:
                print(f"{seed} {'known' if verdict.failed else 'is known to fail, and does not'}: {known[seed]}")
            if verdict.name != OK:
                print(f"{seed} {recipe.kind} n {recipe.size} m {len(recipe.combinations)}: {verdict}", flush=True)
    report(by_class, by_kind)
    report_bounds(ratios)
    print(f"{failures} failed of {last - first}, {time.time() - started:.0f} s")
    return failures > 0


def read_known():
    """The seeds that are known to fail, with the reason."""
    lines = (Path(__file__).parent / "known.txt").read_text().splitlines()
    entries = (line.split(None, 1) for line in lines if line and not line.startswith("#"))
    return {int(seed): reason for seed, reason in entries}


def report(by_class, by_kind):
    """A table: how many of each kind of problem got which verdict."""
    used = [name for name in CLASSES if by_class[name]]
    print(f"\n{'kind':22}" + "".join(f"{name:>12}" for name in used))
    for kind in sorted({kind for kind, _ in by_kind}):
        print(f"{kind:22}" + "".join(f"{by_kind[kind, name] or '-':>12}" for name in used))
    print(f"{'all':22}" + "".join(f"{by_class[name]:>12}" for name in used))


def report_bounds(ratios):
    """Of true errors by their bounds."""
    if ratios:
        typical = statistics.median(ratios)
        print(f"bounds: {len(ratios)} checked, {sum(not ratio <= 1 for ratio in ratios)} below the true error (worst ratio "
              f"{max(ratios):.2g}), median {1 / typical if typical else math.inf:.2g} times the error")


if __name__ == "__main__":
    sys.exit(main())
