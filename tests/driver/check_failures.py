#!/usr/bin/env python3
"""Checks that the driver reports failing tests, a run of no test and mistaken .pf files.

    check_failures.py DRIVER_FAILING DRIVER_WITHOUT_TESTS      (the two executables)
"""
import re
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent

# In each the second text takes the place of the first, in a file that is sound otherwise.
MISTAKES = {
    "an unknown directive": ("@assertEqual(1, 1)", "@assertEquals(1, 1)"),
    "a comment after a directive": ("@assertEqual(1, 1)", "@assertEqual(1, 1) ! one"),
    "an unfinished directive": ("@assertEqual(1, 1)", "@assertEqual(1, &\n"),
    "no test": ("@test", ""),
    "a test which is no subroutine": ("subroutine one()", "integer function one()"),
    "an unknown option": ("@test", "@test(cases=all)"),
    "cases without a parameter": ("@test", "@test(cases=[1])"),
    "another module name": ("module mistaken", "module misnamed"),
}
SOUND = """module mistaken
contains
@test
subroutine one()
@assertEqual(1, 1)
end subroutine one
end module mistaken
"""


def fails(*command):
    """What a command prints which is to end with an error."""
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert done.returncode != 0, f"{command} ended as if all were well:\n{done.stdout}"
    return done.stdout


def check_failing(executable):
    """Each failure is reported in the line of its assertion, and the test ends there."""
    output = fails(executable)
    lines = (HERE / "failing.pf").read_text(encoding="utf-8").splitlines()
    asserted = [number for number, line in enumerate(lines, 1) if "@assert" in line]
    reported = [int(number) for number in re.findall(r"^   failing\.pf:(\d+): ", output, re.M)]
    assert reported == asserted, f"failures in {reported}, expected in {asserted}:\n{output}"
    assert f"\n0 passed, {len(asserted)} failed\n" in output, output
    for part in (": expected <1> but found <2>\n", ", tolerance <0.5", ">, at [1,1]\n",
                 ": why it matters: expected true", "expected shape [2,3] but found [3,2]\n"):
        assert part in output, f"'{part}' is not in:\n{output}"


def check_mistakes():
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "mistaken.pf")
        command = [sys.executable, HERE / "pf_preprocess.py", source, source.with_suffix(".F90")]
        source.write_text(SOUND, encoding="utf-8")
        subprocess.run(command, check=True)
        for mistake, (sound, mistaken) in MISTAKES.items():
            source.write_text(SOUND.replace(sound, mistaken, 1), encoding="utf-8")
            assert re.search(r"mistaken\.pf:\d+: ", fails(*command)), mistake


if __name__ == "__main__":
    check_failing(sys.argv[1])
    assert fails(sys.argv[2]).startswith("0 passed, 0 failed\n")
    check_mistakes()
