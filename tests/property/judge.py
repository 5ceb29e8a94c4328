"""Whether what the program says of a problem is true."""
import json
import os
import subprocess
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import linear_sum_assignment

from spectrum import blurred

SECONDS = 60
# Distances from the target that differ by less than this part are the same.
SAME_DISTANCE = 1e-6
# What printing loses comes on top of a bound of an error; rounding of one operation.
PRINTED, ROUNDING = 1e-15, 1e-16

# What an answer can be. A certificate or an error bound that is wrong; silently wrong, with exit status 0; fewer modes
# listed "because there are no more" where there are; numbers listed that are no eigenvalues; no answer at all.
CERTIFICATE, BOUND, SILENT, NO_MORE, SPURIOUS, REFUSED = "certificate", "bound", "silent", "no more", "spurious", "refused"
# Honest: some modes were not found, and the program says so; the same of an iteration where the dense form, which is
# taken by itself, finds them all; the formulation that was asked for does not fit.
FLAGGED, ITERATED, DECLINED, OK = "flagged", "iterated", "declined", "ok"
# The worst first.
CLASSES = [CERTIFICATE, BOUND, SILENT, NO_MORE, SPURIOUS, REFUSED, FLAGGED, ITERATED, OK, DECLINED]


@dataclass
class Verdict:
    # One of CLASSES.
    name: str
    detail: str = ""
    # The true error of each listed mode by the bound that is promised, where one is.
    ratios: list = field(default_factory=list)

    @property
    def failed(self):
        return self.name not in (FLAGGED, ITERATED, DECLINED, OK)

    def __str__(self):
        return self.name + (f": {self.detail}" if self.detail else "")


def judge_folder(program, folder, problem):
    """Verdict on what the program says of the problem in a folder. Where it is solved dense, iterations solve it as well:
    the one that would else be taken, and the low-rank one where it fits. What they leave out is flagged too."""
    verdict, formulation = judge_answer(program, folder, problem)
    if verdict.failed or formulation != "dense" or "--formulation" in problem.command:
        return verdict
    verdicts = [verdict]
    for iterated in ("symmetric", "proportional", "quadratic"):
        verdicts.append(judge_iterated(program, folder, problem, iterated))
        if verdicts[-1].name != DECLINED:
            break
    verdicts.append(judge_iterated(program, folder, problem, "low-rank"))
    worst = min(verdicts, key=lambda each: CLASSES.index(each.name))
    return Verdict(worst.name, worst.detail, [ratio for each in verdicts for ratio in each.ratios])


def judge_iterated(program, folder, problem, formulation):
    verdict, _ = judge_answer(program, folder, problem, "--formulation", formulation)
    name = ITERATED if verdict.name == FLAGGED else verdict.name
    return Verdict(name, f"{formulation}: {verdict.detail}" if verdict.detail else "", verdict.ratios)


def judge_answer(program, folder, problem, *more):
    """Verdict on one answer, and the formulation that it was found by."""
    command = [program, "solve", folder, *problem.command, *more, "--format", "json", "--quiet"]
    try:
        run = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS,
                             env={**os.environ, "OPENBLAS_NUM_THREADS": "1"})
    except subprocess.TimeoutExpired:
        return Verdict(REFUSED, f"over {SECONDS} s"), None
    if run.returncode == 1 and "--formulation" in command:
        return Verdict(DECLINED, run.stderr.strip()), None
    if run.returncode not in (0, 3):
        return Verdict(REFUSED, f"exit {run.returncode}: {run.stderr.strip()[-200:]}"), None
    try:
        answer = json.loads(run.stdout)
    except ValueError as error:
        return Verdict(REFUSED, f"exit {run.returncode}, no JSON: {error}"), None
    return judge(problem, run.returncode, answer), answer["formulation"]


def judge(problem, status, answer):
    """Verdict on an answer, the object that the program prints, and its exit status, 0 or 3."""
    verdict, off = judge_modes(problem, status, answer)
    return Verdict(*verdict, [ratio for *_, ratio in off])


def judge_modes(problem, status, answer):
    """Name and detail of a verdict, and (value, error, bound, error by bound) of modes with a bound."""
    asked, target = what_was_asked(problem.command)
    exact, tolerance = problem.spectrum[:, 0] + 1j * problem.spectrum[:, 1], problem.spectrum[:, 2]
    listed = np.array([complex(*mode["eigenvalue"]) for mode in answer["modes"]], dtype=complex)
    modes = [k for k, value in enumerate(listed) for _ in range(2 if value.imag > 0 and problem.in_pairs else 1)]
    first = [k == 0 or modes[k - 1] != modes[k] for k in range(len(modes))]
    found = np.where(first, listed[modes], listed[modes].conj())

    right, known = assign(found, exact, tolerance)
    spurious, left = np.delete(found, right), np.delete(np.arange(len(exact)), known)
    furthest = max(distance(exact[known], target) - tolerance[known], default=0.0) * (1 - SAME_DISTANCE)
    missing = exact[[k for k in left if distance(exact[k], target) + tolerance[k] < furthest]]

    nearest = np.array([min(range(len(exact)), key=lambda j: abs(exact[j] - value)) for value in found], dtype=int)
    nearest[right] = known
    off = judged_bounds(answer["modes"], modes, found, abs(found - exact[nearest]))

    wrong = [f"missing {show(missing)}"] if len(missing) else []
    wrong += [f"no eigenvalues: {show(spurious)}"] if len(spurious) else []
    wrong += ["not in order"] if not in_order(distance(listed, target), max(tolerance, default=0.0)) else []
    wrong += ["another number than asked"] if len(listed) > asked or (status == 0 and len(listed) < asked) else []
    said = "; ".join([f"exit {status}, {len(listed)} of {asked}, {answer['reason']}", *wrong])
    if wrong and answer.get("certified") is True:
        return (CERTIFICATE, said), off
    if wrong and status == 0:
        return (SILENT, said), off
    left = left[~blurred(exact[left], tolerance[left])]
    if status == 3 and answer["reason"] == "fewer_modes" and len(left):
        return (NO_MORE, f"{said}; there are {show(exact[left])}"), off
    if len(spurious):
        return (SPURIOUS, said), off
    for value, error, bound, ratio in off:
        if not ratio <= 1:
            return (BOUND, f"{said}; {show([value])} is off by {error:.1e}, at most {bound:.1e} is promised"), off
    complete = answer["reason"] == "fewer_modes" and len(listed) < asked
    return ((OK, "") if status == 0 or complete else (FLAGGED, said)), off


def judged_bounds(answered, modes, found, errors):
    """Those of modes with a bound: value, error, bound, and the error by the bound, each at least what rounding does.
    Zeros that are found are left out."""
    judged = []
    for k, (value, error) in enumerate(zip(found, errors)):
        bound = answered[modes[k]].get("error")
        if bound is not None and (value or error) and (k == 0 or modes[k - 1] != modes[k]):
            allowed = bound + PRINTED * abs(value)
            ratio = max(error, ROUNDING * abs(value)) / allowed if allowed else float(error and "inf")
            judged.append((value, error, bound, ratio))
    return judged


def what_was_asked(command):
    """The number of modes and the target."""
    target = next((word.removeprefix("--target=") for word in command if word.startswith("--target=")), "0")
    return int(command[command.index("--modes") + 1]), complex(*map(float, target.split(",")))


def assign(found, exact, tolerance):
    """Indices of the largest set of pairs that are equal within the tolerances."""
    apart = abs(found[:, None] - exact[None, :])
    cost = np.full(apart.shape, 1e6)
    np.divide(apart, tolerance, out=cost, where=apart < tolerance)
    cost[apart == 0] = 0
    rows, columns = linear_sum_assignment(cost)
    fits = cost[rows, columns] <= 1
    return rows[fits], columns[fits]


def distance(values, target):
    """Of the nearer one of a pair."""
    return np.minimum(abs(values - target), abs(np.conj(values) - target))


def in_order(distances, tolerance):
    return np.all(distances[1:] >= distances[:-1] * (1 - SAME_DISTANCE) - 2 * tolerance)


def show(values):
    shown = ", ".join(f"{z.real:.8g}{z.imag:+.8g}i" if z.imag else f"{z.real:.8g}" for z in values[:4])
    return shown + (f" and {len(values) - 4} more" if len(values) > 4 else "")
