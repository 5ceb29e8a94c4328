"""Questions for all modes of a band, and whether the answers are true."""
import json
import random as random_numbers
import subprocess
from math import pi

from judge import CERTIFICATE, FLAGGED, OK, REFUSED, SILENT, SPURIOUS, Verdict

SECONDS = 60
# The program takes in what is this near to an end of a band, relative to it; what lies half as near has to be there.
EDGE = 1e-6
NO_EIGENVALUE = "is no eigenvalue"


def band_of(seed, spectrum):
    """Two frequencies (Hz), some of them those of modes."""
    random = random_numbers.Random(seed)
    places = sorted({abs(complex(re, im)) / (2 * pi) for re, im, _ in spectrum}) or [1.0]
    ends = [random.choice(places) * random.choice([1, 1, random.uniform(0.5, 2)]) for _ in range(2)]
    if random.random() < 0.3:
        ends[0] = 0.0
    first, last = sorted(ends)
    return first, last if last > first else 2 * first or 1.0


def judge_band(program, folder, problem):
    """Verdict on an answer to a question for a band. Real eigenvalues may have the frequency of an oscillator that they
    are a root of: they are judged, but not missed."""
    first, last = map(float, problem.command[problem.command.index("--band") + 1].split(","))
    command = [program, "solve", folder, *problem.command, "--format", "json", "--quiet"]
    try:
        run = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS)
    except subprocess.TimeoutExpired:
        return Verdict(REFUSED, f"over {SECONDS} s")
    if run.returncode not in (0, 3):
        return Verdict(REFUSED, f"exit {run.returncode}: {run.stderr.strip()[-200:]}")
    answer = json.loads(run.stdout)
    wrong = what_is_wrong(problem.spectrum, first, last, [complex(*mode["eigenvalue"]) for mode in answer["modes"]])
    said = "; ".join([f"exit {run.returncode}, band {first:.6g} to {last:.6g} Hz", *wrong])
    if wrong and answer.get("certified") is True:
        return Verdict(CERTIFICATE, said)
    if run.returncode == 3:
        return Verdict(SPURIOUS if any(NO_EIGENVALUE in each for each in wrong) else FLAGGED, said)
    return Verdict(SILENT, said) if wrong else Verdict(OK)


def what_is_wrong(spectrum, first, last, listed):
    """Sentences about eigenvalues that are listed, or not, in a band."""
    wrong = []
    for value in sorted({complex(*row[:2]) for row in spectrum if row[1] >= 0}, key=abs):
        tolerances = [row[2] for row in spectrum if complex(*row[:2]) == value]
        near, place = tolerances[0] + 1e-14 * abs(value), abs(value) / (2 * pi)
        found = sum(abs(z - value) <= near for z in listed)
        listed = [z for z in listed if not abs(z - value) <= near]
        if near < EDGE / 2 * abs(value):
            inside = first * (1 - EDGE / 2) <= place <= last * (1 + EDGE / 2)
        else:
            inside = first * (1 + EDGE) + near < place < last * (1 - EDGE) - near
        if found > len(tolerances) or (found < len(tolerances) and inside and value.imag):
            wrong.append(f"{value:.8g} {found} times, not {len(tolerances)}")
        if found and value.imag and not first * (1 - 2 * EDGE) - near <= place <= last * (1 + 2 * EDGE) + near:
            wrong.append(f"{value:.8g} is not in the band")
    return wrong + [f"{z:.8g} {NO_EIGENVALUE}" for z in listed]
