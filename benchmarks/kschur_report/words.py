"""The words of kschur-report, without what its work takes: help needs Python alone."""

import argparse

from . import plan

EPILOG = """Writes index.html, a self-contained page, and beside it results.md (the same tables), data.h5 (all numbers), and an
SVG and a CSV for every figure. data.h5 is written after each problem: of a run that was ended early, --redraw makes the page
of what it holds. --again STUDY measures one study of it once more. Exit status: 0 all is well, 1 wrong usage, 2 bad input."""


def parse(words):
    parser = argparse.ArgumentParser(
        prog="kschur-report",
        epilog=EPILOG,
        description="Speed against accuracy of kschur and other "
        "eigensolvers, in pictures: on model structures, or on your own problem.",
    )
    parser.add_argument("--problem", metavar="FILE.h5", help="compare on this problem (HDF5, as kschur solve reads it)")
    parser.add_argument("--modes", type=positive, default=20, help="how many lowest modes of that problem (20)")
    parser.add_argument(
        "--preset", choices=sorted(plan.PRESETS), default="quick", help="how much to run (quick: minutes, full: about an hour)"
    )
    parser.add_argument("--no-peers", action="store_true", help="our methods only, not SLEPc and SciPy")
    parser.add_argument("--output", metavar="FOLDER", default="kschur-report", help="where to write (kschur-report)")
    parser.add_argument("--again", metavar="STUDY", help="measure this study again; the others stay as data.h5 in that folder has them")
    parser.add_argument("--redraw", action="store_true", help="draw again from data.h5 in that folder; runs nothing")
    parser.add_argument(
        "--kschur", metavar="PROGRAM", help="the program kschur (the one beside this program, or on the PATH)"
    )
    parser.add_argument("--hard-cases", metavar="PROGRAM", help="benchmark_hard_cases (the one beside kschur)")
    try:
        options = parser.parse_args(words)
    except SystemExit as end:
        raise SystemExit(1 if end.code else 0) from None
    return options


def positive(word):
    number = int(word)
    if number < 1:
        raise argparse.ArgumentTypeError("must be at least 1")
    return number
