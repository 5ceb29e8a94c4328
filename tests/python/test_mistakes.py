#!/usr/bin/python3
"""What users do wrong with matrices and files, and what the program tells them: test_mistakes.py PATH_OF_KSCHUR.

Each mistake is made in a problem that is sound without it.
"""
import json

import numpy as np

from checks import check, run_tests
from program import check_refused, kschur, write_problem

N = 12


def matrices():
    """A chain of masses, held at one end, and two constraints."""
    stiffness = 2.0*np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1)
    stiffness[-1, -1] = 1
    constraints = np.zeros((2, N))
    constraints[0, [2, 5, 8]], constraints[1, [3, 9]] = (1, -2, 1), (1, -1)
    return {"M": np.diag(1.0 + np.arange(N) % 3), "K": stiffness, "Cq": constraints}


def told(name, folder, command, status, *words, **changes):
    """Runs a command of the problem with these matrices in the place of others, and looks for words in what it prints."""
    problem = write_problem(folder/name.replace(" ", "-"), **{**matrices(), **changes})
    run = kschur(command, problem, *(["--modes", 4] if command == "solve" else []))
    check(f"{name}: {command}, exit status {status}", run.returncode == status, run)
    for word in words:
        check(f"{name}: {command} tells '{word}'", word in run.stdout + run.stderr, run)
    return run


def test_nothing_wrong(folder):
    run = told("nothing", folder, "solve", 0, "certified: no mode is missing")
    check("nothing: no note", "note" not in run.stdout and "swapped" not in run.stdout, run)
    told("nothing in info", folder, "info", 0, "symmetric    yes\n")


def test_transposed_constraints(folder):
    write_problem(folder/"transposed", **{**matrices(), "Cq": matrices()["Cq"].T})
    check_refused("transposed Cq", 2, kschur("solve", "transposed", cwd=folder), "the constraint Jacobian Cq is 12 x 2 but must have 12 columns",
                  "it is given transposed")


def test_floating_unknowns(folder):
    """Without stiffness it floats, which is told; without mass besides nothing can be solved."""
    stiffness, mass = matrices()["K"], matrices()["M"]
    stiffness[6, :] = stiffness[:, 6] = 0
    told("floating", folder, "solve", 0, "neither stiffness, damping nor a constraint holds unknown 7\n", K=stiffness)
    mass[6, 6] = 0
    told("nothing at all", folder, "solve", 4, "the motion of unknown 7 has neither mass, damping nor stiffness", K=stiffness, M=mass)


def test_negative_masses(folder):
    mass = matrices()["M"]
    mass[4, 4] *= -1
    run = told("negative mass", folder, "solve", 0, "the mass matrix M is negative on the diagonal, which makes modes that grow: unknown 5\n", M=mass)
    check("negative mass: not taken for a stiffness", "swapped" not in run.stdout, run)


def test_swapped(folder):
    """A stiffness in the place of the mass, of a free structure whose constraints hold it: it is definite where they let it move."""
    free = matrices()["K"]
    free[0, 0] = 1
    clamp = np.zeros((1, N))
    clamp[0, 0] = 1
    for command in ("solve", "info"):
        run = told(f"swapped {command}", folder, command, 0, "are mass and stiffness swapped?", M=free, K=matrices()["M"], Cq=clamp)
        check(f"swapped: {command} says nothing of M that is not so", "has negative eigenvalues" not in run.stdout, run)


def test_asymmetry(folder):
    stiffness = matrices()["K"]
    stiffness[7, 8] *= 1 + 1e-6
    told("rounded", folder, "solve", 0, "the stiffness matrix K is symmetric but for 5.0E-07 of the entries, most at (8, 9) and (9, 8)",
         K=stiffness)
    told("rounded in info", folder, "info", 0, "symmetric    no: the stiffness matrix K has -1.000001 at (8, 9) and -1 at (9, 8)", K=stiffness)
    largest = json.loads(kschur("info", folder/"rounded", "--format", "json").stdout)["problem"]["asymmetry"]
    check("rounded: info in JSON", largest["matrix"] == "stiffness matrix K" and (largest["row"], largest["column"]) == (8, 9)
          and largest["entry"] == stiffness[7, 8] and largest["mirrored"] == -1 and abs(largest["part"] - 5e-7) < 1e-12, largest)
    stiffness[7, 8] = -1.5
    run = told("unsymmetric", folder, "solve", 0, K=stiffness)
    check("unsymmetric: no note", "symmetric but for" not in run.stdout, run)
    told("unsymmetric in info", folder, "info", 0, "has -1.5 at (8, 9) and -1 at (9, 8)", K=stiffness)


def test_a_picture_that_moves(folder):
    result = folder/"modes.h5"
    kschur("scene", "spring-chain", "--output", folder/"chain.h5")
    kschur("solve", folder/"chain.h5", "--modes", 2, "--output", result)
    for name in ("x.gif", "x"):
        check_refused(f"--picture {name}", 1, kschur("view", result, "--picture", name, cwd=folder), f"{name}'", ".png, .pdf or .svg", "--html")


def test_the_problem_of_a_view(folder):
    result, page = folder/"modes.h5", folder/"modes.html"
    kschur("scene", "grid", "--cells", "2x2", "--output", folder/"grid.h5")
    kschur("scene", "grid", "--cells", "3x2", "--output", folder/"other.h5")
    kschur("solve", folder/"grid.h5", "--modes", 2, "--output", result)
    check_refused("--problem of another result", 2, kschur("view", result, "--html", page, "--problem", folder/"other.h5"), "unknowns")
    check_refused("--problem that is a result", 2, kschur("view", result, "--html", page, "--problem", result), "there is no group /mass")
    check_refused("--problem without --html", 1, kschur("view", result, "--picture", folder/"a.png", "--problem", folder/"grid.h5"), "--html")
    check("nothing is written", not page.exists() and not (folder/"a.png").exists())


run_tests(test_nothing_wrong, test_transposed_constraints, test_floating_unknowns, test_negative_masses, test_swapped, test_asymmetry,
          test_a_picture_that_moves, test_the_problem_of_a_view)
