"""The cases that methods fail on: runs benchmark_hard_cases and reads its lines."""

import os
import re
import subprocess

from .methods import ONE_THREAD
from .runs import HardCase

NAME, METHOD = 48, 28  # widths of its first two columns
MEASURED = re.compile(r"\s*(\d+)/(\d+)\s*(\S+?E[+-]\d+)\s*(\S+?E[+-]\d+)\s+[\d.]+\s+(.*)")
GOOD = "ok"


def read_line(line):
    """A HardCase, or None for a line that is not one."""
    name, method, rest = line[:NAME].strip(), line[NAME : NAME + METHOD].strip(), line[NAME + METHOD :]
    measured = MEASURED.fullmatch(rest)
    if measured:
        found, expected, backward, off, verdict = measured.groups()
        return HardCase(name, column(method), int(found), int(expected), float(backward), float(off), verdict == GOOD)
    if ": " in rest and rest.strip().startswith("-"):
        return HardCase(name, column(method), 0, 0, float("nan"), float("nan"), False, rest.split(": ", 1)[1].strip())
    return None


def column(method):
    """The name in METHODS; `auto: symmetric` and `auto: quadratic` are both the default."""
    name = method.split(":")[0].replace(" ", "-")
    return "pencil" if name == "damped-constrained" else name


def run_hard_cases(program, groups=()):
    """All its cases; the program's status says whether ours fail, which the lines say as well."""
    run = subprocess.run(
        [str(program), "--arpack", *groups], capture_output=True, text=True, env=dict(os.environ, **ONE_THREAD)
    )
    cases = [read_line(line) for line in run.stdout.splitlines()]
    return [case for case in cases if case is not None]
