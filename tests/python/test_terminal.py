"""What a terminal sees and a file does not: colours, the time left, one notation a column. test_terminal.py PATH_OF_KSCHUR"""
import os
import pty
import re
import select
import subprocess
import time

import numpy as np

from checks import check, run_tests
from program import KSCHUR, kschur, write_problem

ESCAPE = re.compile(r"\x1b\[\d*m")


def in_terminal(*words, until=None, seconds=300, **environment):
    """What a run shows in a terminal: standard output and error together. It is ended where that has the pattern `until`."""
    master, slave = pty.openpty()
    settings = {name: value for name, value in os.environ.items() if name != "NO_COLOR"}
    run = subprocess.Popen([KSCHUR, *map(str, words)], stdout=slave, stderr=slave, env={**settings, "TERM": "xterm", **environment})
    os.close(slave)
    shown, end = b"", time.monotonic() + seconds
    try:
        while time.monotonic() < end and not (until and re.search(until, shown)):
            if select.select([master], [], [], 0.5)[0]:
                shown += os.read(master, 65536)
    except OSError:
        # The other end is closed: the run is over.
        pass
    run.kill()
    run.wait()
    os.close(master)
    return shown.decode().replace("\r\n", "\n")


def test_colours(folder):
    problem = folder / "turbine.h5"
    kschur("scene", "turbine", "--speed", 12.1, "--aerodynamic", -1, "--tower-elements", 4, "-o", problem)
    words = ("solve", problem, "-m", 6, "--quiet", "-t", 1)
    plain = kschur(*words).stdout
    shown = in_terminal(*words)
    unstable = [line for line in plain.splitlines() if " unstable " in line]
    check("a pipe: no colours", unstable and not ESCAPE.search(plain), plain)
    check("a terminal: unstable modes are red", all(f"\x1b[31m{line}\x1b[0m" in shown for line in unstable), shown)
    check("a terminal: others are not", len(re.findall("\x1b\\[31m *[0-9]", shown)) == len(unstable), shown)

    def table(text):
        return [line for line in text.splitlines() if not line.startswith("effort")]
    check("a terminal: the same words", table(ESCAPE.sub("", shown)) == table(plain), shown)
    for setting in ({"NO_COLOR": "1"}, {"TERM": "dumb"}, {"TERM": ""}):
        check(f"{setting}: no colours", not ESCAPE.search(in_terminal(*words, **setting)))
    check("NO_COLOR that is empty: colours", ESCAPE.search(in_terminal(*words, NO_COLOR="")))
    for name in ("json", "csv"):
        check(f"{name} in a terminal: no colours", not ESCAPE.search(in_terminal(*words, "-f", name)))
    check("a message: its name is red", "\x1b[31mkschur: \x1b[0munknown command" in in_terminal("slove"))
    certified = in_terminal("solve", write_problem(folder / "one", M=np.eye(2), K=np.diag([1.0, 4.0])), "-m", 1)
    check("certified: green", "\x1b[32mcertified\x1b[0m: no mode is missing" in certified, certified)
    sweep = in_terminal("sweep", "rotor", "--vary", "speed=3000:4000:2", "-m", 4, "-q")
    check("sweep: unstable is red", "\x1b[31munstable\x1b[0m   branch" in sweep, sweep)


def test_time_left(folder):
    """By the numbers that stand beside it: as long as what is done took, for what is not."""
    problem = folder / "grid.h5"
    kschur("scene", "grid", "--cells", "12x8", "-o", problem)
    words = ("response", problem, "--input", 1, "--frequencies", "1:50:20000")
    shown = in_terminal(*words, until=rb"about [0-9]+ (s|min) left", seconds=60)
    early = [int(s) for s in re.findall(r"\r([0-9]+) s, [^\r]*left", shown)]
    check("time left: not in the first seconds", early and min(early) >= 10, shown[-300:])
    found = re.search(r"([0-9]+) s, frequency ([0-9]+) of ([0-9]+), about ([0-9]+) (s|min) left", shown)
    if not found:
        check("time left of a response: is told", False, shown[-300:])
        return
    seconds, which, points, left = map(int, found.groups()[:4])
    left *= 60 if found[5] == "min" else 1
    # Of the seconds that the line tells one may be missing, of the minutes half of one.
    expected = seconds * (points - which + 1) / (which - 1)
    check("time left of a response", abs(left - expected) <= 0.15 * expected + (30 if found[5] == "min" else 2), (seconds, which, points, left, expected))
    quiet = in_terminal(*words, "--quiet", seconds=12)
    check("time left: not with --quiet", "left" not in quiet, quiet[-200:])


def test_one_notation_a_column(folder):
    """Zero is 0 and what is not known is -; all else of a column has six decimals, or all has an exponent."""
    values = np.array([1e-14, 1.0, 123.0, 1e5, 1e7])
    problem = write_problem(folder / "far", M=np.eye(5), K=np.diag(values), R=np.diag([0, 1e-3, 0.1, 0, 2.0]))
    other = write_problem(folder / "near", M=np.eye(3), K=np.diag([1.0, 2.0, 300.0]), R=np.diag([0.01, 0.1, 0.02]))
    for path in (problem, other):
        rows = [line.split() for line in kschur("solve", path).stdout.splitlines() if re.match(r" +[0-9]+ ", line)]
        check(f"{path.name}: rows", len(rows) >= 3, rows)
        for column in range(1, 6):
            numbers = [row[column] for row in rows if row[column] not in ("0", "-")]
            fixed = [bool(re.fullmatch(r"-?[0-9]+\.[0-9]{6}", number)) for number in numbers]
            powers = [bool(re.fullmatch(r"-?[0-9]\.[0-9]{6}E[-+][0-9]{2}", number)) for number in numbers]
            check(f"{path.name}, column {column}: one notation", all(fixed) or all(powers), numbers)


run_tests(test_colours, test_time_left, test_one_notation_a_column)
