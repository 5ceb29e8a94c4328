"""The program kschur from end to end: test_program.py PATH_OF_KSCHUR.

Prints each check, then `N passed, N failed`; fails where a check does.
"""
import csv
import io
import json
import math
import os
import pathlib
import pty
import re
import subprocess

import h5py
import numpy as np

from checks import check, run_tests
from program import KSCHUR, check_refused, check_values, eigenvalues, kschur, solve, write_problem

DATA = pathlib.Path(__file__).resolve().parent.parent / "data"

# The eigenvalues of the scene beam-body, -lambda^2 (MATLAB, from Project Chrono).
BEAM_BODY = [
    0.03186203916787638, 1.147033410628716, 3.208029301486185, 4.20968757982959, 27.08121339975415,
    96.16794832572644, 115.4890548367898, 189.1659286964141, 968.7479287601021, 974.923682385529,
    1889.820391999078, 3286.961235434142, 3462.04613971705, 5605.163263529525, 6809.973433001152,
    23980.35242401345, 29995.32551176242, 37085.90282988458, 50149.65262278832, 91311.70174230162,
    152458.5830655474, 863292.6872645169, 1335092.501875816, 1805387.494420379]
# The eigenvalues nearest to 0.1 of the random problems (MATLAB), pairs once, nearest to zero first.
RANDOM_CONSTRAINED = [0, 0.0027371093, -0.48766697, -0.50012545 + 0.34641648j]
RANDOM_UNSYMMETRIC = [-0.073186212, 0.2145172, 0.217844 + 0.29647593j, -0.93675962]

# Each scene, small: options, unknowns, constraints, and its lowest frequency that is not zero, in rad/s.
SCENES = {
    "beam-body": ([], 30, 6, math.sqrt(0.03186203916787638)),
    "block": (["--cells", 1, "--supports", "hinged", "--damping", "none"], 48, 5, None),
    "brake": (["--friction", 0.2, "--damping", "none"], 4, 2,
              math.sqrt(1.28125e6 - math.sqrt((0.5625e6 / 2)**2 - 0.04 * 1.5625e12))),
    "cantilever": (["--elements", 4, "--tip-mass", 1e12, "--damping", "none"], 36, 12, 9.200165685940e-6 * math.tau / math.sqrt(1e3)),
    "crank": (["--density", 1, "--damping", "none"], 444, 20, None),
    "free-free": (["--bodies", 2, "--damping", "none"], 120, 12, None),
    "grid": (["--cells", "2x1", "--damping", "none"], 138, 36, None),
    "linkage": (["--loops", 1], 24, 26, math.sqrt(400 / (3.14 * (2 / 3 + 1 / 2 + 0.02**2 / 6)))),
    "pendulum": (["--bars", 2, "--length", 1], 12, 10, math.sqrt(9.81 * (2 - math.sqrt(2)))),
    "rotor": (["--speed", 0, "--bearings", "rigid", "--density", 0, "--damping", "none"], 60, 12,
              math.sqrt(48 * 2.1e11 * math.pi * 0.04**4 / 64 / 40)),
    "shell": (["--cells", "3x3", "--damping", "none"], 36, 0, None),
    "spring-chain": (["--masses", 7, "--damping", "none"], 7, 0, 2 * math.sin(math.pi / 14)),
    "turbine": (["--tower-elements", 10, "--damping", "none"], 966, 41, None),
}


def test_help(_):
    for words in (["--help"], ["help"], ["solve", "--help"], ["help", "help"], ["help", "solve"], ["help", "compare"],
                  ["help", "scene"], ["help", "info"]):
        run = kschur(*words)
        check(f"{' '.join(words)}: explains", run.returncode == 0 and "kschur" in run.stdout and not run.stderr, run)
    check("help solve: every option", all(option in kschur("help", "solve").stdout for option in (
        "--modes --target --frequency --band --shift --method --arpack --formulation --inner --presolve --block --subspace --tolerance --max-restarts "
        "--constraint-scaling --symmetric --left --certify --mass --stiffness --damping --constraints --output --format --quiet --verbose "
        "--threads").split()))
    possible = re.search("wants one of (.*), not 'best'", kschur("solve", DATA, "--formulation", "best").stderr)
    check("help solve: every formulation", possible and all(
        name in kschur("help", "solve").stdout for name in possible[1].split(", ")), possible)
    check("help scene: every scene", re.findall("^([a-z-]+): ", kschur("help", "scene").stdout, re.M) == list(SCENES))
    every = kschur("help", "scene").stdout
    check("help scene NAME: that one", all(kschur("help", "scene", name).stdout.startswith(f"{name}: ")
          and kschur("help", "scene", name).stdout in every for name in SCENES))
    check("scene NAME --help: the same", kschur("scene", "crank", "--help").stdout == kschur("help", "scene", "crank").stdout)
    unknown = kschur("help", "scene", "house")
    check("help on an unknown scene: 1, names those there are", unknown.returncode == 1 and "house" in unknown.stderr
          and "pendulum" in unknown.stderr, unknown.stderr)
    check("scene --help: the same", kschur("scene", "--help").stdout == kschur("help", "scene").stdout)
    check("--version: name and number", kschur("--version").stdout.split()[0] == "kschur")


def test_scenes(folder):
    for name, (options, unknowns, constraints, lowest) in SCENES.items():
        path = folder / f"scene-{name}.h5"
        run = kschur("scene", name, *options, "--output", path)
        check(f"scene {name}: size", run.returncode == 0
              and run.stdout == f"{path}: {unknowns} unknowns, {constraints} constraints\n", run)
        result, _ = solve(path, "--modes", 1 if lowest and name != "spring-chain" else 2)
        if lowest:
            check_values(f"scene {name}: lowest frequency", [result["modes"][-1]["frequency_hz"] * math.tau], [lowest], 1e-6)
    run = kschur("scene", "turbine", "--speed", 12.1, "--aerodynamic", -1, "--output", folder / "reversed.h5")
    result, _ = solve(folder / "reversed.h5", "--modes", 6)
    check("turbine, damping reversed: unstable modes are named", sum(m["kind"] == "unstable" for m in result["modes"]) >= 3, result)


def test_beam_body(folder):
    for name, damping, formulation in (("undamped.h5", "none", "auto"), ("zero.h5", "zero", "damped-constrained"),
                                       ("undamped-folder", "none", "undamped-constrained")):
        run = kschur("scene", "beam-body", "--damping", damping, "--output", folder / name)
        check(f"scene beam-body {name}: written", run.returncode == 0 and (folder / name).exists(), run)
        result, run = solve(folder / name, "--modes", 24, "--formulation", formulation)
        check_values(f"{name} {formulation}: the 24 reference eigenvalues", -(eigenvalues(result) ** 2), BEAM_BODY)
        check(f"{name}: backward errors below 1e-10", all(m["backward_error"] < 1e-10 for m in result["modes"]))
        check(f"{name}: nothing on standard error", run.stderr == "", run.stderr)
    frequency = math.sqrt(BEAM_BODY[7]) / (2 * math.pi)
    result, _ = solve(folder / "undamped.h5", "--modes", 2, "--frequency", frequency)
    check("--frequency sets the target", np.allclose(result["target"], [0, math.sqrt(BEAM_BODY[7])], rtol=1e-14))
    check_values("--frequency: the nearest modes, nearest first", -(eigenvalues(result) ** 2), BEAM_BODY[7:5:-1])


def test_random_problems(_):
    for name, reference in (("random_constrained", RANDOM_CONSTRAINED), ("random_unsymmetric", RANDOM_UNSYMMETRIC)):
        result, _ = solve(DATA / name, "--modes", len(reference), "--shift", "0.1")
        check_values(f"{name}: the MATLAB eigenvalues, pairs once", eigenvalues(result), reference)
        check(f"{name}: --shift is kept", result.get("shift") == [0.1, 0], result.get("shift"))
    files = ["--mass", DATA / name / "M.mtx", "--stiffness", DATA / name / "K.mtx", "--damping", DATA / name / "R.mtx",
             "--constraints", DATA / name / "Cq.mtx"]
    result, _ = solve(*files, "--modes", 4, "--shift=0.1")
    check_values("files named one by one", eigenvalues(result), RANDOM_UNSYMMETRIC)


def read_square(path):
    sizes, *entries = np.loadtxt(path, comments="%")
    matrix = np.zeros((int(sizes[0]), int(sizes[1])))
    for row, column, value in entries:
        matrix[int(row) - 1, int(column) - 1] = value
    return matrix


def test_left_vectors_in_uneven_units(folder):
    """Of copies, some of which the transposed iteration misses. Judged where each unknown has stiffness one."""
    problem = DATA / "copies_in_uneven_units"
    solve(problem, "--modes", 8, "--target=-0.8,1.6545933663421843", "--left", "--block", 3, "--output", folder / "left.h5")
    mass, damping, stiffness = (read_square(problem / f"{name}.mtx") for name in "MRK")
    units = np.exp2(np.round(np.log2(abs(np.diag(stiffness))) / 2))
    even = [matrix / np.outer(units, units) for matrix in (mass, damping, stiffness)]
    with h5py.File(folder / "left.h5") as file:
        found = zip(file["eigenvalues"][:], file["left_eigenvectors"][:] * units)
    for value, shape in found:
        terms = [value**2 * even[0], value * even[1], even[2]]
        residual = np.linalg.norm(shape.conj() @ sum(terms)) / sum(np.linalg.norm(shape.conj() @ term) for term in terms)
        check(f"left vector of {value:.6f} in even units", residual < 1e-9, residual)


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def test_json(folder):
    result, _ = solve(folder / "undamped.h5", "--modes", 3, "--threads", 1)
    check("JSON: the fields", list(result) == ["kschur", "problem", "method", "formulation", "target", "shift",
                                               "reason", "certified", "modes", "counts", "seconds", "factor_memory_bytes",
                                               "peak_memory_bytes"], list(result))
    check("JSON: problem", result["problem"] == {"n": 30, "m": 6, "symmetric": True, "damping": "none"}, result["problem"])
    check("JSON: method and formulation", (result["method"], result["formulation"]) == ("krylov-schur", "dense"))
    check("JSON: reason", (result["reason"], result["certified"]) == ("converged", True))
    check("JSON: fields of a mode", all(list(mode) == [
        "eigenvalue", "frequency_hz", "damped_frequency_hz", "damping_ratio", "loss_factor", "kind", "backward_error", "error"]
        for mode in result["modes"]))
    mode = result["modes"][0]
    check("JSON: a mode", mode["kind"] == "undamped" and math.isclose(
        mode["frequency_hz"], math.sqrt(BEAM_BODY[0]) / (2 * math.pi), rel_tol=1e-8) and mode["damping_ratio"] == 0, mode)
    for mode, exact in zip(result["modes"], BEAM_BODY):
        check("JSON: the error of an eigenvalue is bounded", 0 < mode["error"] < 1e-6 and
              abs(mode["eigenvalue"][1] - math.sqrt(exact)) < 1e-8 * math.sqrt(exact) + mode["error"], mode)
    counts, seconds = result["counts"], result["seconds"]
    purposes = counts.get("factorizations_for", {})
    check("JSON: counts", list(counts) == ["operator_applications", "restarts", "factorizations", "wanted_after",
                                           "factorizations_for"]
          and all(isinstance(count, int) for count in list(counts.values())[:4]) and counts["factorizations"] >= 1, counts)
    check("JSON: what was factored for", list(purposes) == ["mass", "rigid_motions", "iteration", "refinement", "count", "left"]
          and sum(purposes.values()) == counts["factorizations"], purposes)
    check("JSON: after which the wanted had converged", 0 < counts["wanted_after"] <= counts["operator_applications"], counts)
    check("JSON: seconds", list(seconds) == [
        "total", "analyze", "factorize", "solve", "orthogonalize", "examine", "place", "iterate", "recover", "judge", "left", "other"]
          and all(is_number(second) and second >= 0 for second in seconds.values())
          and math.isclose(2 * seconds["total"], sum(seconds.values()), rel_tol=1e-9), seconds)
    check("JSON: what took time has a name", seconds["judge"] > 0 and seconds["examine"] > 0 and seconds["left"] < seconds["total"]/10 and
          seconds["other"] < 0.2*seconds["total"] + 1e-3, seconds)
    factored, _ = solve(folder / "undamped.h5", "--modes", 3, "--formulation", "symmetric")
    check("JSON: memory of factors", 30 * 8 <= factored["factor_memory_bytes"] < 1e5, factored["factor_memory_bytes"])
    check("JSON: peak memory", isinstance(result["peak_memory_bytes"], int) and result["peak_memory_bytes"] > 1e6)


def inner_of(path, *words):
    """Which inner solver was taken, and why."""
    return re.search(r"^inner +(.*)$", kschur("solve", path, "--verbose", *words).stdout, re.MULTILINE)[1]


def test_inner_solvers(folder):
    kschur("scene", "grid", "--cells", "3x2", "--damping", "none", "--output", folder / "ties.h5")
    found = {}
    for inner, said in (("auto", "ldl: symmetric definite, "), ("ldl", "ldl: symmetric definite, "),
                        ("mumps", "mumps: as asked"),
                        ("iterative", "iterative: FGMRES with ldl in single precision, ")):
        result, _ = solve(folder / "ties.h5", "--modes", 20, "--inner", inner)
        check(f"--inner {inner}: says what was taken", said in inner_of(folder / "ties.h5", "--inner", inner))
        found[inner] = eigenvalues(result)
    check_values("--inner ldl: the modes of MUMPS", found["ldl"], found["mumps"])
    check_values("--inner auto: the modes of MUMPS", found["auto"], found["mumps"])
    check_values("--inner iterative: the modes of MUMPS", found["iterative"], found["mumps"])
    result, _ = solve(folder / "ties.h5", "--modes", 20, "--inner", "iterative")
    check("--inner iterative: counted by pivots in double precision", result["certified"] is True)
    check("--inner iterative: backward errors of a direct solver",
          max(mode["backward_error"] for mode in result["modes"]) < 1e-13)
    kschur("scene", "cantilever", "--elements", "500", "--output", folder / "slender.h5")
    for scene, options, rigid in (("grid", ["--cells", "2x2"], 6), ("spring-chain", [], 1)):
        kschur("scene", scene, *options, "--output", folder / "free.h5")
        result, _ = solve(folder / "free.h5", "--modes", 8, "--inner", "iterative")
        check(f"--inner iterative: rigid motions of {scene}", [mode["kind"] for mode in result["modes"]].count("rigid") == rigid)
    words = (folder / "slender.h5", "--modes", 2, "--shift", "0.03")
    check_values("--inner iterative on a slender beam: LDL stays definite", eigenvalues(solve(*words, "--inner", "iterative")[0]),
                 eigenvalues(solve(*words, "--inner", "ldl")[0]), 1e-5)
    run = kschur("solve", *words, "--inner", "iterative", "--formulation", "damped-constrained")
    check_refused("--inner iterative on a slender beam, by MUMPS", 4, run, "iterative does not converge", "auto")
    check("--inner auto: LDL where constraints are left",
          inner_of(folder / "undamped.h5").startswith("ldl: quasi-definite, "), inner_of(folder / "undamped.h5"))
    found = {inner: eigenvalues(solve(folder / "undamped.h5", "--inner", inner)[0]) for inner in ("ldl", "mumps")}
    check_values("--inner ldl: the modes of MUMPS where constraints are left", found["ldl"], found["mumps"])
    kschur("scene", "grid", "--cells", "6x4", "--damping", "none", "--output", folder / "larger.h5")
    words = (folder / "larger.h5", "--modes", 12, "--target", "0,300")
    check("--inner auto: LDL amid the spectrum", inner_of(*words).startswith("ldl: symmetric indefinite, "), inner_of(*words))
    found = {inner: eigenvalues(solve(*words, "--inner", inner)[0]) for inner in ("auto", "mumps")}
    check_values("--inner auto: the modes of MUMPS amid the spectrum", found["auto"], found["mumps"])
    words = (folder / "larger.h5", "--modes", 2, "--target", "0,800")
    run = kschur("solve", *words, "--inner", "ldl")
    check_refused("--inner ldl next to an eigenvalue of a leading block", 4, run, "ldl", "indefinite")
    check("--inner auto: MUMPS there", inner_of(*words) == "mumps: the matrix is indefinite", inner_of(*words))
    check("the inner solver: only with --verbose", "inner" not in kschur("solve", folder / "ties.h5").stdout)


def test_certificate(folder):
    run = kschur("solve", folder / "undamped.h5", "--modes", 3, "--output", folder / "certified.h5")
    check("table: certified", "3 of 3, converged, certified: no mode is missing\n" in run.stdout, run)
    run = kschur("info", folder / "certified.h5", "--format", "json")
    check("the result file keeps it", json.loads(run.stdout)["certified"] is True, run)
    result, _ = solve(folder / "undamped.h5", "--modes", 3, "--formulation", "undamped-constrained")
    check("JSON: null where nothing was counted", result["certified"] is None, result)
    kschur("scene", "grid", "--cells", "2x1", "--output", folder / "free-grid.h5")
    result, _ = solve(folder / "free-grid.h5", "--modes", 6)
    check("rigid-body modes, certified", result["certified"] is True
          and [mode["kind"] for mode in result["modes"]] == ["rigid"] * 6, result)


def test_band(folder):
    hertz = [math.sqrt(-value if value < 0 else value) / (2 * math.pi) for value in BEAM_BODY]
    problem, output = folder / "undamped.h5", folder / "band.h5"
    result, run = solve(problem, "--band", f"{hertz[4]},5", "--output", output)
    check_values("--band: all modes from its lower edge on, in order", [m["frequency_hz"] for m in result["modes"]],
                 [f for f in hertz[4:] if f < 5])
    check("--band: counted", result["certified"] is True and run.stderr == "", run)
    check("--band: in JSON", result["band"] == [hertz[4], 5] and result["target"] == [0, 2 * math.pi * hertz[4]], result)
    again = json.loads(kschur("info", output, "--format", "json").stdout)
    check("--band: in the result file", again["band"] == result["band"] and again["modes"] == result["modes"], again)
    result, _ = solve(problem, "--band", f"{hertz[4]},5", "--formulation", "undamped-constrained")
    check_values("--band: of a pencil", [m["frequency_hz"] for m in result["modes"]], [f for f in hertz[4:] if f < 5])
    check("--band: not counted", result["certified"] is None, result)
    run = kschur("solve", problem, "--band", "0.2,0.25", "--output", output)
    check("--band without modes: a success that says so", run.returncode == 0 and run.stderr == ""
          and "no mode between 0.2 and 0.25 Hz\n" in run.stdout and "certified" in run.stdout, run)
    run = kschur("info", output)
    check("--band without modes: in the result file", "no mode between 0.2 and 0.25 Hz\n" in run.stdout, run)
    for block in 1, 2, 3, 4, "auto":
        check_values(f"--block {block}: the same modes", eigenvalues(solve(problem, "--block", block, "--formulation", "quadratic")[0]),
                     eigenvalues(solve(problem)[0]))
    check("no band in JSON where none was asked for", "band" not in solve(problem)[0])


def test_rigid_modes(folder):
    run = kschur("scene", "grid", "--cells", "2x2", "--damping", "none", "--output", folder / "grid.h5")
    check("scene grid: written", run.returncode == 0, run)
    result, _ = solve(folder / "grid.h5", "--modes", 8)
    check("free grid: six rigid modes first", [m["kind"] == "rigid" for m in result["modes"]] == [True] * 6 + [False] * 2)
    check("free grid: rigid modes are zeros without a damping ratio", all(
        m["eigenvalue"] == [0, 0] and m["damping_ratio"] is None for m in result["modes"][:6]), result["modes"][:6])
    table = kschur("solve", folder / "grid.h5", "--modes", 8).stdout
    rows = [line.split() for line in table.splitlines() if line.split() and line.split()[0].isdigit()]
    check("table: eight numbered rows", [row[0] for row in rows] == list("12345678"), table)
    check("table: a rigid mode", rows and rows[0][1:7] == ["0", "0", "0", "0", "-", "rigid"], table)
    check("table: rows of one width", len({len(line) for line in table.splitlines() if re.match(" +[1-8] ", line)}) == 1, table)


def test_rigid_decay(folder):
    """The stiffness, whose rounding is 1e9 times alpha here, has no part in how fast a rigid motion decays: alpha is 1e-3."""
    kschur("scene", "crank", "--density", 1, "--output", folder / "decay.h5")
    result, _ = solve(folder / "decay.h5", "--modes", 2)
    decay = result["modes"][1]
    check("rigid decay: within its bound", abs(decay["eigenvalue"][0] + 1e-3) <= decay["error"] < 1e-6, decay)


def notes_of(run):
    return [line[9:] for line in run.stdout.splitlines() if line.startswith("note     ")]


def test_notes(folder):
    run = kschur("solve", folder / "grid.h5", "--modes", 7, "--shift", 0, "--output", folder / "notes.h5")
    notes = notes_of(run)
    check("notes: a shift on the rigid modes is moved", run.returncode == 0 and len(notes) == 2
          and notes[0].startswith("the shift is an eigenvalue, or next to one: it was moved by "), run)
    check("notes: rigid motions", notes[1:] == [
        "6 rigid motions are double zeros (Jordan blocks): nothing damps them"], notes)
    lines = run.stdout.splitlines()
    check("notes: between the header and the modes", [line.split()[0] for line in lines[:6]] == [
        "problem", "method", "because", "modes", "note", "note"] and lines[6] == "", lines[:8])
    with h5py.File(folder / "notes.h5") as file:
        check("notes: in the result file", file.attrs["notes"].splitlines() == notes, dict(file.attrs))
        check("notes: no redundant constraints", file.attrs["redundant_constraints"] == 0, dict(file.attrs))
    check("notes: info RESULT", notes_of(kschur("info", folder / "notes.h5")) == notes)
    with h5py.File(folder / "notes.h5", "r+") as file:
        del file.attrs["notes"], file.attrs["redundant_constraints"]
    run = kschur("info", folder / "notes.h5")
    check("notes: a result of before the notes", run.returncode == 0 and notes_of(run) == [], run)

    omega = math.sqrt(BEAM_BODY[3])
    for formulation in ("auto", "quadratic", "undamped-constrained", "undamped-constrained-zero", "damped-constrained",
                        "damped-constrained-zero"):
        result, _ = solve(folder / "undamped.h5", "--modes", 7, "--shift", f"0,{omega!r}", "--formulation", formulation)
        check_values(f"shift on an eigenvalue, {formulation}: it and the others", -(eigenvalues(result) ** 2), BEAM_BODY[:7])
        check(f"shift on an eigenvalue, {formulation}: no further than 1e-4", abs(result["shift"][0]) <= 1e-4 * omega
              and abs(result["shift"][1] - omega) <= 1.01e-4 * omega, result["shift"])
        check(f"shift on an eigenvalue, {formulation}: all digits", all(m["backward_error"] < 1e-12 for m in result["modes"]))

    constraints = np.array([[1, -1, 1, 0, 0, 0.], [0, 0, 1, 1, 1, 0], [2, -2, 3, 1, 1, 0]])
    problem = write_problem(folder / "redundant", M=np.diag([1, 1, 1, 1, 0, 1]), K=np.diag([1, 2, 3, 4, 5, 6]), Cq=constraints)
    run = kschur("solve", problem, "--modes", 2, "--output", folder / "redundant.h5")
    check("notes: redundant constraints, unknowns without mass", run.returncode == 0 and notes_of(run) == [
        "1 of 3 constraints follows from the others", "the mass matrix is singular: 1 unknown has no mass"], run)
    with h5py.File(folder / "redundant.h5") as file:
        check("notes: redundant constraints in the result file", file.attrs["redundant_constraints"] == 1)
    problem = write_problem(folder / "nothing-holds-it", M=np.diag([1, 1, 0]), K=np.diag([1, 2, 0]))
    check_refused("singular for every lambda", 4, kschur("solve", problem, "--modes", 1), "every lambda", "neither mass")


def test_inaccurate(folder):
    kschur("scene", "grid", "--cells", "6x4", "--output", folder / "grid-6x4.h5")
    result, _ = solve(folder / "grid-6x4.h5", "--modes", 10, "--formulation", "damped-constrained-zero", "--shift", "1e-6")
    expected = [0] * 6 + [-1e-3] * 4
    check_values("a tiny shift in a formulation with spurious zeros", eigenvalues(result), expected, 1e-4)
    check("a tiny shift: does not go on for long", result["counts"]["operator_applications"] < 1000, result["counts"])
    for formulation in ("auto", "quadratic", "damped-constrained"):
        result, run = solve(folder / "undamped.h5", "--modes", 6, "--shift", "1e10", "--formulation", formulation, status=3)
        check(f"a hopeless shift, {formulation}: the reason", result["reason"] == "inaccurate", result["reason"])
        check(f"a hopeless shift, {formulation}: one line", len(run.stderr.splitlines()) == 1
              and "0 of 6 modes" in run.stderr and "inaccurate" in run.stderr, run.stderr)
        check(f"a hopeless shift, {formulation}: given up in time", result["counts"]["operator_applications"] < 3000,
              result["counts"])
        check(f"a hopeless shift, {formulation}: a note", any("too inaccurately" in note for note in notes_of(
            kschur("solve", folder / "undamped.h5", "--modes", 6, "--shift", "1e10", "--formulation", formulation))))


# All modes of a damped problem: exactly as many eigenvalues as there are about any target.
def test_certify(folder):
    rng = np.random.default_rng(11)
    a, b = rng.random((8, 8)), rng.random((8, 8))
    problem = write_problem(folder / "certify", M=np.eye(8), K=a @ a.T + np.eye(8), R=0.1 * b @ b.T)
    for target in ("0", "-0.1,1.5"):
        output = folder / "certify.h5"
        output.unlink(missing_ok=True)
        asked = ("--modes", 4, "--target=" + target, "--formulation", "quadratic")
        plain, _ = solve(problem, *asked)
        result, run = solve(problem, *asked, "--certify", "--output", output)
        check("--certify: only where asked", plain["certified"] is None and "missing" not in plain, plain)
        check("--certify: none is missing", run.returncode == 0 and result["certified"] is True and result["missing"] == 0, result)
        check("--certify: the count takes factorisations", result["counts"]["factorizations"] > plain["counts"]["factorizations"])
        with h5py.File(output) as file:
            check("--certify: in the file", file.attrs["missing"] == 0 and file.attrs["certified"] in ("true", b"true"))
        check("--certify: read again", "no mode is missing" in kschur("info", output).stdout, kschur("info", output).stdout)
    counted, _ = solve(problem, "--modes", 4, "--formulation", "quadratic", "--certify", "off")
    check("--certify off: nothing is counted", counted["certified"] is None and counted["counts"]["factorizations_for"]["count"] == 0,
          counted)
    check_refused("--certify off with a band", 1, kschur("solve", problem, "--certify=off", "--band", "0.1,0.2"), "counted", "band")
    check_refused("--certify with another value", 1, kschur("solve", problem, "--certify=no"), "--certify", "off")
    check_refused("--certify with a band", 1, kschur("solve", problem, "--certify", "--band", "0.1,0.2"), "certify", "band")
    check_refused("--certify of plain ARPACK", 1, kschur(
        "solve", problem, "--certify", "--method", "arpack", "--arpack", "plain"), "certified")


def test_left(folder):
    rng = np.random.default_rng(7)
    m, k, r = np.diag(1 + rng.random(8)), np.diag(3 + rng.random(8)) + 0.4 * rng.random((8, 8)), 0.1 * rng.random((8, 8))
    cq = np.zeros((1, 8))
    cq[0, 2:5] = 1, -2, 0.5
    problem, output = write_problem(folder / "left", M=m, K=k, R=r, Cq=cq), folder / "left.h5"
    result, run = solve(problem, "--modes", 5, "--left", "--output", output)
    check("--left: nothing on standard error", run.stderr == "", run.stderr)
    kappa = np.array([mode["condition_number"] for mode in result["modes"]])
    with h5py.File(output) as file:
        values, shapes, reactions, left, multipliers, conditions = (file[name][:] for name in (
            "eigenvalues", "eigenvectors", "multipliers", "left_eigenvectors", "left_multipliers", "condition_number"))
    check("--left: the condition numbers that were printed", np.array_equal(kappa, conditions), (kappa, conditions))
    level = np.abs(values) ** 2 * np.abs(m).sum(1).max() + np.abs(values) * np.abs(r).sum(1).max() + np.abs(k).sum(1).max()
    residual = [psi.conj() @ (s * s * m + s * r + k) + eta.conj() @ cq for s, psi, eta in zip(values, left, multipliers)]
    check("--left: the left equations hold", (np.linalg.norm(residual, axis=1) < 1e-12 * level).all(), residual)
    check("--left: the constraints hold", np.abs(left @ cq.T).max() < 1e-12)
    # What errors of each entry of the constraints move.
    level += [(np.abs(cq) * np.abs(np.outer(xi, psi.conj()) + np.outer(eta.conj(), phi))).sum()
              for phi, xi, psi, eta in zip(shapes, reactions, left, multipliers)]
    expected = [level[j] / abs(s * (left[j].conj() @ (2 * s * m + r) @ shapes[j])) for j, s in enumerate(values)]
    check("--left: the condition numbers are those of the vectors", np.allclose(kappa, expected, rtol=1e-9), (kappa, expected))
    table = kschur("solve", problem, "--modes", 5, "--left").stdout.splitlines()
    check("--left: a column of the table", sum(line.endswith("condition") for line in table) == 1, table)
    rows = list(csv.reader(io.StringIO(kschur("solve", problem, "--modes", 5, "--left", "--format", "csv").stdout)))
    check("--left: a column of the CSV", rows[0][-1] == "condition_number" and all(
        float(row[-1]) == value for row, value in zip(rows[1:], kappa)), rows)
    again = kschur("info", output, "--format", "json")
    check("--left: info RESULT", json.loads(again.stdout)["modes"] == result["modes"], again)
    result, _ = solve(folder / "grid.h5", "--modes", 7, "--left")
    check("--left: a rigid mode has none", [mode["condition_number"] is None for mode in result["modes"]] == 6 * [True] + [False])
    check("--left: infinite in the table", kschur("solve", folder / "grid.h5", "--modes", 7, "--left").stdout.count(" infinite\n") == 6)


def test_info(folder):
    run = kschur("info", folder / "undamped.h5")
    check("info PROBLEM: sizes, kind and formulation", run.returncode == 0 and all(
        word in run.stdout for word in ("30", "6", "symmetric", "none", "formulation  symmetric", "mass M")), run)
    kschur("scene", "grid", "--cells", "2x1", "--output", folder / "damped-grid.h5")
    run = kschur("info", folder / "damped-grid.h5")
    factors = re.search(r"proportional, alpha (\S+) 1/s, beta (\S+) s\n", run.stdout)
    check("info PROBLEM: proportional damping and its formulation", factors and "formulation  proportional" in run.stdout
          and np.allclose([float(factor) for factor in factors.groups()], [1e-3, 1e-5], rtol=1e-5, atol=0), run)
    check("info PROBLEM: why this formulation", "because the damping is a combination of mass and stiffness" in run.stdout, run)
    check("info PROBLEM: what presolve leaves", re.search(
        r"presolve +36 constraints clamp or tie an unknown, 0 follow from them: (\d+) unknowns, 0 constraints", run.stdout), run)


def test_presolve_option(folder):
    kept, _ = solve(folder / "damped-grid.h5", "--modes", 16, "--presolve", "off", "--output", folder / "kept.h5")
    gone, run = solve(folder / "damped-grid.h5", "--modes", 16, "--output", folder / "gone.h5")
    check_values("--presolve off: the same modes", eigenvalues(kept), eigenvalues(gone), 1e-8)
    with h5py.File(folder / "kept.h5") as off, h5py.File(folder / "gone.h5") as on:
        check("--presolve: the order of what was factored", off.attrs["factored_order"] == off.attrs["n"] + off.attrs["m"]
              and on.attrs["factored_order"] == on.attrs["n"] - on.attrs["m"], (dict(off.attrs), dict(on.attrs)))
        check("result file: the decision in words", on.attrs["decision"].startswith("dense: order 102, "), on.attrs["decision"])
    table = kschur("info", folder / "gone.h5").stdout
    check("table: the decision in words", "because  dense: order 102, cheaper than an iteration" in table, table)


def test_restarts_run_out(folder):
    _, run = solve(folder / "undamped.h5", "--modes", 12, "--subspace", 14, "--max-restarts", 1, "--tolerance", "1e-14",
                   "--formulation", "undamped-constrained", status=3)
    lines = run.stderr.splitlines()
    check("restarts ran out: one line that names the option", len(lines) == 1 and "of 12 modes" in lines[0]
          and "--max-restarts" in lines[0] and "(" not in lines[0], run.stderr)


def test_more_modes_than_exist(folder):
    problem = write_problem(folder / "small", M=np.eye(3), K=np.diag([1, 4, 9]), R=np.diag([0.1, 0.3, 0.2]), Cq=[[0, 0, 1]])
    output = folder / "small.h5"
    result, run = solve(problem, "--modes", 7, "--output", output, status=3)
    expected = [-b / 2 + 1j * math.sqrt(k - b * b / 4) for k, b in ((1, 0.1), (4, 0.3))]
    check_values("more modes than exist: all of them printed", eigenvalues(result), expected, 1e-12)
    check("more modes than exist: the reason", result.get("reason") == "fewer_modes", result.get("reason"))
    lines = run.stderr.splitlines()
    check("more modes than exist: one line says so", len(lines) == 1 and "2 of 7" in lines[0], run.stderr)
    with h5py.File(output) as file:
        check_values("more modes than exist: all of them written", file["eigenvalues"][:], expected, 1e-12)


def test_wrong_usage(folder):
    problem = folder / "undamped.h5"
    for words, *named in (
            ([], "command"), (["-v"], "unknown option -v"), (["dance"], "dance"), (["compare"], "problem"), (["solve"], "problem"),
            (["solve", ""], "empty"), (["info", ""], "empty"),
            *[(["compare", problem, *words], words[0]) for words in (["--method", "arpack"], ["--left"], ["--band", "1,2"],
                                                                     ["--format", "csv"], ["--modes", "0"])],
            (["solve", problem, "--modes", "0"], "--modes", "at least 1"), (["solve", problem, "--modes", "x"], "--modes", "'x'"),
            (["solve", problem, "--modes", "2.5"], "--modes"), (["solve", problem, "--modes", "99999999999"], "--modes"),
            (["solve", problem, "--modes"], "--modes"), (["solve", problem, "--modes", "3", "--modes", "4"], "--modes", "twice"),
            (["solve", problem, "--tolerance", "-1"], "--tolerance", "positive"),
            (["solve", problem, "--tolerance", "nan"], "--tolerance"), (["solve", problem, "--tolerance", "1e999"], "--tolerance"),
            (["solve", problem, "--target", "1,2,3"], "--target"), (["solve", problem, "--shift", "one"], "--shift", "RE,IM"),
            (["solve", problem, "--target", "1", "--frequency", "1"], "--target", "--frequency"),
            (["solve", problem, "--band", "1"], "--band", "A,B", "'1'"), (["solve", problem, "--band", "1,2,3"], "--band"),
            (["solve", problem, "--band", "2,1"], "band", "above"), (["solve", problem, "--band", "-1,1"], "band", "at least 0"),
            *[(["solve", problem, "--band", "1,2", option, "1"], "--band", option)
              for option in ("--modes", "--target", "--frequency", "--shift")],
            (["solve", problem, "--frequency", "-1"], "--frequency"), (["solve", problem, "--threads", "0"], "--threads"),
            (["solve", problem, "--colour", "red"], "--colour"), (["solve", problem, problem], "undamped.h5"),
            (["solve", problem, "--quiet", "--verbose"], "--quiet"), (["solve", problem, "--output", problem], "--output"),
            (["solve", problem, "--mass", problem], "not both"),
            (["solve", "--mass", problem], "--stiffness"), (["solve", problem, "--format", "xml"], "--format", "json"),
            (["solve", problem, "--formulation", "best"], "--formulation", "undamped-constrained", "best"),
            (["solve", problem, "--formulation", "undamped"], "undamped"),
            (["solve", problem, "--method", "lanczos"], "--method", "arpack", "lanczos"),
            (["solve", problem, "--arpack", "plain"], "--arpack", "--method arpack"),
            (["solve", problem, "--method", "arpack", "--arpack", "raw"], "--arpack", "plain", "raw"),
            (["solve", problem, "--method", "arpack", "--arpack", "plain", "--formulation", "quadratic"], "quadratic"),
            (["solve", problem, "--method", "arpack", "--arpack", "plain", "--left"], "left"),
            (["solve", problem, "--method", "arpack", "--band", "1,2"], "band", "krylov-schur"),
            (["solve", problem, "--inner", "best"], "--inner", "mumps", "ldl", "iterative"),
            (["solve", problem, "--inner", "ldl", "--formulation", "damped-constrained"], "ldl", "complex"),
            (["solve", DATA / "random_unsymmetric", "--inner", "ldl", "--shift", "0.1"], "ldl", "unsymmetric"),
            (["solve", problem, "--block", "0"], "--block", "at least 1", "auto", "0"),
            *[([command, problem, option, "2147483647"], "must be at most 10000000")
              for command in ("solve", "compare") for option in ("--modes", "--subspace", "--block")],
            (["solve", problem, "--modes", "10000001"], "number of modes is 10000001"),
            (["sensitivity", problem, problem, "--modes", "2147483647"], "must be at most 10000000"),
            (["sweep", problem, problem, "--subspace", "2147483647"], "must be at most 10000000"),
            (["sweep", "spring-chain", "--vary", "mass=1:2:2147483647"], "two to 10000 points"),
            (["response", problem, "--input", "1", "--frequencies", "1:2:2147483647"], "two to 1000000 points"),
            (["solve", problem, "--threads", "2147483647"], "number of threads", "at most 4096"),
            (["scene", "castle", "--output", folder / "c.h5"], "castle", "beam-body"), (["scene", "grid"], "--output"),
            (["scene", "rotor", "--speed", "1", "--speed", "2", "--output", folder / "c.h5"], "--speed", "twice"),
            (["scene", "rotor", "--elements", "3", "--output", folder / "c.h5"], "--elements", "even", "'3'"),
            (["scene", "spring-chain", "--damping", "none", "--beta", "0.1", "--output", folder / "c.h5"], "--beta", "--damping rayleigh"),
            (["scene", "brake", "--friction", "-1", "--output", folder / "c.h5"], "--friction", "not negative", "'-1'"),
            (["scene", "crank", "--density", "99", "--output", folder / "c.h5"], "--density", "from 1 to 20"),
            (["scene", "pendulum", "--reactions", "yes", "--output", folder / "c.h5"], "--reactions", "on or off"),
            (["scene", "turbine", "--aerodynamic", "much", "--output", folder / "c.h5"], "--aerodynamic", "a number"),
            (["scene", "spring-chain", "--masses", "2", "--output", folder / "c.h5"], "--masses", "3"),
            *[(["scene", name, "--colour", "red", "--output", folder / "c.h5"], "--colour", "only") for name in SCENES],
            (["scene", "grid", "--cells", "0x0", "--output", folder / "c.h5"], "--cells")):
        check_refused(" ".join(os.path.basename(str(word)) for word in words) or "no words", 1, kschur(*words), *named)


def test_far_units(folder):
    """An exponent of three digits keeps its letter; what would overflow when it is multiplied is refused, and named."""
    tiny = write_problem(folder/"tiny", M=[[1e70]], K=[[1.0]], R=[[1e-70]])
    run = kschur("solve", tiny, "--modes", 1)
    numbers = re.findall(r"-?[0-9.]+E[-+]?[0-9]{3}", run.stdout)
    check("three digits: with their letter", run.returncode == 0 and "-5.000000E-141" in run.stdout and
          not re.search(r"[0-9][-+][0-9]", run.stdout), run.stdout)
    check("three digits: they read back", numbers and all(float(number) < 1e-99 for number in numbers), run.stdout)
    for name, value in (("M", 1e308), ("M", 1e300), ("K", -1e76), ("R", 1e-76), ("Cq", 1e200)):
        matrices = {"M": [[2.0, 1.0], [1.0, 2.0]], "K": [[2.0, -1.0], [-1.0, 2.0]], "R": [[0.0, 0.0], [0.0, 0.0]], "Cq": [[1.0, 1.0]]}
        matrices[name] = [row.copy() for row in matrices[name]]
        matrices[name][-1][-1] = value
        run = kschur("solve", write_problem(folder/f"far_{name}_{value}", **matrices), "--modes", 1, "--symmetric", "no")
        check_refused(f"{name} with {value}", 2, run, "choose other units", f"({len(matrices[name])}, 2)")
    # Rounding beside others stays what it is.
    rounding = {"M": [[1.0, 1e-90], [1e-90, 1.0]], "K": [[2.0, -1.0], [-1.0, 2.0]]}
    result, _ = solve(write_problem(folder/"rounding", **rounding), "--modes", 2)
    check_values("rounding of 1e-90", eigenvalues(result), [1j, 3**0.5*1j])


def test_a_huge_damper(folder):
    """A damper that is 1e20 times as strong as all else holds its unknown, and makes no chain of states without end."""
    grid = folder/"huge_damper"
    kschur("scene", "grid", "--cells", "8x5", "--damping", "none", "--output", grid)
    n = int((grid/"M.mtx").read_text().splitlines()[1].split()[0])
    (grid/"R.mtx").write_text(f"%%MatrixMarket matrix coordinate real general\n{n} {n} 1\n701 701 1e20\n")
    damped, _ = solve(grid, "--modes", 10)
    (grid/"R.mtx").unlink()
    rows = [line for line in (grid/"Cq.mtx").read_text().splitlines() if not line.startswith("%")]
    m, n, entries = map(int, rows[0].split())
    (grid/"Cq.mtx").write_text("\n".join(["%%MatrixMarket matrix coordinate real general", f"{m + 1} {n} {entries + 1}", *rows[1:],
                                          f"{m + 1} 701 1", ""]))
    held, _ = solve(grid, "--modes", 9)
    # One motion has a zero, and a decay far off, where the constraint leaves none.
    check_values("a damper of 1e20", eigenvalues(damped), np.concatenate([[0.0], eigenvalues(held)]), 1e-9)


def test_arpack(folder):
    problem = folder / "undamped.h5"
    output = folder / "arpack.h5"
    for words, method, formulation, relative in (
            ([], "arpack-fair", "symmetric", 1e-9), (["--arpack", "fair"], "arpack-fair", "symmetric", 1e-9),
            (["--formulation", "quadratic", "--shift", "1,2"], "arpack-fair", "quadratic", 1e-9),
            (["--arpack", "plain"], "arpack-plain", "damped-constrained", 1e-6)):
        result, _ = solve(problem, "--modes", 8, "--method", "arpack", "--output", output, *words)
        name = " ".join(["arpack", *words])
        check(f"{name}: method and formulation", (result["method"], result["formulation"]) == (method, formulation), result)
        check_values(f"{name}: omega^2", np.abs(eigenvalues(result)) ** 2, BEAM_BODY[:8], relative)
        with h5py.File(output) as file:
            check(f"{name}: named in the result file", file.attrs["method"] == method, file.attrs["method"])
    check("arpack: plain is factored at the shift of the paper", result["shift"] == [1e-3, 0], result["shift"])
    kschur("scene", "rotor", "--speed", 0, "--bearings", "rigid", "--output", folder / "planes.h5")
    words = ["solve", folder / "planes.h5", "--modes", 13, "--method", "arpack"]
    notes = notes_of(kschur(*words))
    check("arpack: a note where nothing is counted", len(notes) == 1 and "a mode may be missing" in notes[0], notes)
    check("arpack: null where nothing is counted", solve(*words[1:])[0]["certified"] is None)
    check("arpack: no such note with a certificate", notes_of(kschur("solve", problem, "--method", "arpack")) == [])
    check("arpack: auto is krylov-schur", solve(problem, "--method", "auto")[0]["method"] == "krylov-schur")
    result, run = solve(problem, "--modes", 8, "--method", "arpack", "--formulation", "quadratic", "--subspace", 22,
                        "--max-restarts", 1, status=3)
    check("arpack: restarts that run out", result["reason"] == "max_restarts" and "restarts ran out" in run.stderr, run.stderr)


def test_compare(folder):
    problem = folder / "undamped.h5"
    names = ["auto", "quadratic", "pencil", "arpack-plain", "arpack-fair"]
    run = kschur("compare", problem, "--modes", 8)
    check("compare: exit status 0", run.returncode == 0 and run.stderr == "", (run.returncode, run.stderr))
    rows = [line.split()[0] for line in run.stdout.splitlines()[-len(names):]]
    check("compare: a line for each method", rows == names, run.stdout)
    check("compare: says what it compares with", "those of auto, which are certified" in run.stdout, run.stdout)

    run = kschur("compare", problem, "--modes", 8, "--format", "json")
    result = json.loads(run.stdout, parse_constant=lambda word: 1 / 0)
    check("compare: the reference", result["reference"] == {"name": "auto", "certified": True}, result["reference"])
    check("compare: the problem", result["problem"] == {"n": 30, "m": 6, "symmetric": True, "damping": "none"}, result)
    check("compare: the methods", [entry["name"] for entry in result["methods"]] == names, result["methods"])
    for entry in result["methods"]:
        name = f"compare: {entry['name']}"
        check(f"{name}: modes", entry["modes"] == {"found": 8, "missed": 0, "spurious": 0}, entry["modes"])
        check(f"{name}: errors", 0 < entry["backward_error"]["median"] <= entry["backward_error"]["worst"] < 1e-6, entry)
        check(f"{name}: counts", entry["counts"]["operator_applications"] > 8 and entry["counts"]["factorizations"] > 0, entry)
        check(f"{name}: seconds", 0 < entry["seconds"]["factorize"] < entry["seconds"]["total"], entry["seconds"])
    orders = {entry["name"]: entry["factored"]["order"] for entry in result["methods"]}
    check("compare: order of the factored matrix", orders["pencil"] == orders["arpack-plain"] == 2 * 30 + 6, orders)
    check("compare: the certified ones", [entry["certified"] for entry in result["methods"]] == [True, None, None, None, True])

    # Nothing is certified where damping is general and more than two hundred unknowns are iterated: the smallest backward error is
    # the reference.
    general = folder / "general.h5"
    kschur("scene", "block", "--cells", 4, "--damping", "general", "--output", general)
    run = kschur("compare", general, "--modes", 3, "--shift", "1000", "--format", "json")
    result = json.loads(run.stdout)
    check("compare: not certified", result["reference"]["certified"] is False, result["reference"])
    fair = result["methods"][-1]
    check("compare: arpack-fair misses nothing there", fair["modes"] == {"found": 3, "missed": 0, "spurious": 0}, fair)

    run = kschur("compare", problem, "--modes", 99, "--format", "json")
    check("compare: fewer modes than asked", run.returncode == 3 and "24 of 99" in run.stderr, (run.returncode, run.stderr))
    check("compare: all there are", json.loads(run.stdout)["methods"][0]["modes"]["found"] == 24, run.stdout)

    # The complex matrices of auto are too much for factors in single precision; those of others may be or not.
    for words in (["--target", "0,0.1"], ["--shift", "0.03,0.01"]):
        run = kschur("compare", folder / "slender.h5", "--modes", 2, "--inner", "iterative", *words)
        check(f"compare: auto fails {words}: exit status 4", run.returncode == 4, (run.returncode, run.stderr))
        check(f"compare: auto fails {words}: one line", run.stderr.count("\n") == 1 and "iterative does not converge" in run.stderr,
              run.stderr)
    check_refused("compare: no such file", 2, kschur("compare", folder / "nothing.h5"), "nothing.h5")
    status, written = on_terminal("compare", problem, "--modes", "3")
    check("compare: progress on a terminal", status == 0 and "\n" not in written and "arpack-fair" in written, written)


def test_waiting_threads(folder):
    """The threads of a large solve do not spin while they wait, unless the user says so."""
    problem = folder / "large.h5"
    kschur("scene", "grid", "--cells", "24x16", "--output", problem)
    plain = {name: value for name, value in os.environ.items() if not name.startswith(("OMP_", "GOMP_"))}
    counts = {}
    for name, said in {"nothing": {}, "active": {"OMP_WAIT_POLICY": "ACTIVE"}, "a count": {"GOMP_SPINCOUNT": "7"}}.items():
        run = kschur("solve", problem, "--modes", 2, "--quiet", env={**plain, **said, "OMP_DISPLAY_ENV": "VERBOSE"})
        check(f"waiting threads, said {name}: solves", run.returncode == 0, run.stderr)
        counts[name] = re.findall("GOMP_SPINCOUNT = '(.*)'", run.stderr)
    # Without OpenMP, or with another one than that of GCC, nothing is shown.
    if any(counts.values()):
        check("waiting threads: asleep by default", counts["nothing"][-1] == "0", counts)
        check("waiting threads: as the user says", counts["active"][-1] not in ("0", "7") and counts["a count"] == ["7"], counts)


def on_terminal(*words):
    """What the program writes to standard error where that is a terminal."""
    ours, its = pty.openpty()
    run = subprocess.Popen([KSCHUR, *map(str, words)], stdout=subprocess.DEVNULL, stderr=its)
    os.close(its)
    written = b""
    try:
        while piece := os.read(ours, 4096):
            written += piece
    except OSError:
        pass
    os.close(ours)
    return run.wait(), written.decode()


def test_progress(folder):
    problem = folder / "undamped.h5"
    run = kschur("solve", problem)
    check("progress: none where standard error is no terminal", run.returncode == 0 and run.stderr == "", run.stderr)
    status, written = on_terminal("solve", problem)
    phases = ["reading", "presolve", "rigid motions", "factorisation", "iteration", "result"]
    check("progress: seconds and phases, on a terminal", status == 0 and written.startswith("\r0 s, reading") and
          [written.index(phase) for phase in phases] == sorted(written.index(phase) for phase in phases), written)
    seen = [int(number) for number in re.findall(r"(\d+) of 10 modes", written)]
    check("progress: modes of those that were asked for, never less", seen == sorted(seen) and seen[-1] == 10, seen)
    check("progress: one line, wiped at the end", "\n" not in written and written.endswith(" \r"), repr(written))
    check("progress: none with --quiet", on_terminal("solve", problem, "--quiet") == (0, ""))


run_tests(
    test_help, test_scenes, test_beam_body, test_random_problems, test_json, test_inner_solvers, test_certificate,
    test_band, test_rigid_modes, test_rigid_decay, test_notes, test_inaccurate, test_certify, test_left,
    test_left_vectors_in_uneven_units, test_info,
    test_presolve_option, test_restarts_run_out, test_more_modes_than_exist, test_arpack, test_compare,
    test_wrong_usage, test_far_units, test_a_huge_damper, test_waiting_threads, test_progress)
