"""The program kschur-mpi on several processes: test_processes.py PATH_OF_KSCHUR_MPI MPIRUN FAIL_AT [--all].

Each scene is solved on some number of processes, with --all on each of 1, 2, 3, 4. Prints each check, then `N passed, N failed`; fails where a check does.
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

import h5py
import numpy as np
import scipy.linalg
import scipy.sparse

KSCHUR = os.path.abspath(sys.argv[1])
MPIRUN = sys.argv[2]
# The library that lets a process fail.
FAIL_AT = os.path.abspath(sys.argv[3])
ALL = "--all" in sys.argv
# Each scene, small, with its default damping: options, and whether it is symmetric and certified.
SCENES = {
    "beam-body": [], "block": ["--cells", 2], "brake": [], "cantilever": ["--elements", 4], "crank": ["--density", 1], "free-free": ["--bodies", 2],
    "grid": ["--cells", "2x1"], "linkage": ["--loops", 2, "--cells-per-loop", 4], "pendulum": ["--bars", 2], "rotor": [],
    "shell": ["--cells", "3x3"], "spring-chain": ["--masses", 7], "turbine": ["--tower-elements", 10]}
# Those whose matrices are symmetric, so that undamped frequencies follow from LAPACK.
SYMMETRIC = ["beam-body", "block", "cantilever", "crank", "free-free", "grid", "linkage", "pendulum", "shell", "spring-chain"]
MODES = 8

passed = failed = 0


def check(name, condition, detail=""):
    global passed, failed
    passed, failed = passed + bool(condition), failed + (not condition)
    print(("ok      " if condition else "FAILED  ") + name + ("" if condition else f"  [{detail}]"), flush=True)


def run(processes, *words):
    """Every matrix is distributed, however small."""
    command = [KSCHUR, *map(str, words)]
    if processes:
        command = [MPIRUN, "--oversubscribe", "-np", str(processes), *command]
    return subprocess.run(command, capture_output=True, text=True, timeout=300)


def solve(processes, problem, *options):
    done = run(processes, "solve", problem, "--format", "json", "--threads", 1, *([] if "--distribute" in options else ["--distribute", 1]), *options)
    if done.returncode not in (0, 3):
        return done.returncode, done.stderr
    return done.returncode, json.loads(done.stdout)


def frequencies_by_lapack(problem):
    """All undamped frequencies in rad/s, squared, from the matrices on the null space of the constraints."""
    with h5py.File(problem) as file:
        matrix = {name: scipy.sparse.csr_matrix((group["data"][:], group["indices"][:], group["indptr"][:]),
                                                group.attrs["shape"]).toarray() for name, group in file.items()
                  if name in ("mass", "stiffness", "constraints")}
    mass, stiffness = matrix["mass"], matrix["stiffness"]
    if "constraints" in matrix:
        allowed = scipy.linalg.null_space(matrix["constraints"])
        mass, stiffness = allowed.T @ mass @ allowed, allowed.T @ stiffness @ allowed
    return scipy.linalg.eigh(stiffness, mass, eigvals_only=True)


def values(answer):
    return np.array([complex(*mode["eigenvalue"]) for mode in answer["modes"]])


def bounds(answer):
    """How far apart two answers may be: by the bounds of their errors, and else by what rounding does to a double value."""
    scale = max(abs(values(answer)))
    return np.array([3 * mode["error"] + 1e-9 * scale if mode["error"] is not None else 1e-7 * scale for mode in answer["modes"]])


def check_scenes(folder):
    for number, (scene, options) in enumerate(SCENES.items()):
        problem = folder / f"{scene}.h5"
        run(0, "scene", scene, *options, "--output", problem)
        status, alone = solve(0, problem, "--modes", MODES)
        for processes in (1, 2, 3, 4) if ALL else (2 + number % 3,):
            name = f"{scene} on {processes}"
            got, answer = solve(processes, problem, "--modes", MODES)
            if got != status:
                check(name, False, f"{got} {answer}")
                continue
            check(f"{name}: as many modes, and the same", len(answer["modes"]) == len(alone["modes"])
                  and np.all(abs(values(answer) - values(alone)) <= bounds(alone)), abs(values(answer) - values(alone)))
            check(f"{name}: the same certificate", answer["certified"] == alone["certified"])
            check(f"{name}: backward errors", max(mode["backward_error"] for mode in answer["modes"]) < 1e-11)


def check_lapack(folder):
    for number, scene in enumerate(SYMMETRIC):
        problem = folder / f"{scene}-undamped.h5"
        run(0, "scene", scene, *SCENES[scene], *([] if scene == "pendulum" else ["--damping", "none"]), "--output", problem)
        exact = frequencies_by_lapack(problem)
        count = min(2 * MODES, len(exact))
        for processes in (2, 3, 4) if ALL else (2 + number % 2,):
            status, answer = solve(processes, problem, "--modes", count)
            got = values(answer).imag**2
            check(f"{scene} on {processes} against LAPACK", len(got) == count and
                  np.all(abs(got - exact[:count]) <= 1e-12 * max(exact) + 1e-8 * got), f"{got} {exact[:count]}")


def check_methods(folder):
    """What factors in other ways than by default."""
    problem = folder / "crank.h5"
    table = run(3, "solve", problem, "--modes", 4, "--distribute", 1, "--verbose").stdout
    check("three processes factor", "inner    ldl: quasi-definite" in table and "on 3 processes" in table, table)
    table = run(3, "solve", problem, "--modes", 4, "--verbose").stdout
    check("a small matrix is factored by one", "on 3 processes" not in table and "processes factor" not in table, table)
    table = run(3, "solve", folder / "brake.h5", "--modes", 4, "--distribute", 1, "--verbose").stdout
    check("what LDL does not fit goes to MUMPS", "unsymmetric, 3 processes factor it" in table, table)
    _, alone = solve(0, problem, "--modes", 4)
    for options in (["--inner", "mumps"], ["--inner", "iterative"], ["--inner", "ldl"], ["--formulation", "quadratic"],
                    ["--formulation", "damped-constrained"], ["--left"], ["--method", "arpack"],
                    ["--formulation", "quadratic", "--certify"]):
        status, answer = solve(2, problem, "--modes", 4, *options)
        name = "two processes, " + " ".join(options)
        if status != 0:
            check(name, False, f"{status} {answer}")
            continue
        check(name, np.all(abs(values(answer) - values(alone)) <= bounds(alone) + 1e-7 * max(abs(values(alone)))), values(answer))
        check(name + ": nothing missing", answer["certified"] is not False)
    done = run(2, "compare", problem, "--modes", 4, "--distribute", 1)
    check("compare", done.returncode == 0 and done.stdout.count("E-") >= 8, done.stdout + done.stderr)
    done = run(2, "--version")
    check("what solves nothing", done.returncode == 0 and done.stdout.startswith("kschur "), done.stdout)


def read_matrix(file, name):
    return scipy.sparse.csr_matrix(tuple(file[name][key][:] for key in ("data", "indices", "indptr")), file[name].attrs["shape"])


def check_losses(folder):
    """Each process reads its rows of H: every form finds the modes of LAPACK's QZ, of losses in all of a model and in little of it."""
    problem = folder / "lossy.h5"
    for place in ("everywhere", "in few unknowns"):
        run(0, "scene", "cantilever", "--elements", 10, "--output", problem)
        with h5py.File(problem, "a") as file:
            mass, damping, stiffness = (read_matrix(file, name) for name in ("mass", "damping", "stiffness"))
            constraints = read_matrix(file, "constraints").toarray() if "constraints" in file else np.zeros((0, mass.shape[0]))
            n = mass.shape[0]
            factors = np.where(np.arange(n) > n / 2, 0.3, 0.05) if place == "everywhere" else np.zeros(n)
            loss = scipy.sparse.lil_matrix(scipy.sparse.diags(np.sqrt(factors)) @ stiffness @ scipy.sparse.diags(np.sqrt(factors)))
            loss[n - 2, n - 2] = 0.1 * stiffness[n - 2, n - 2]
            loss = scipy.sparse.csr_matrix(loss)
            group = file.create_group("loss")
            group.attrs["shape"] = loss.shape
            for key in ("indptr", "indices", "data"):
                group[key] = getattr(loss, key)
        allowed = scipy.linalg.null_space(constraints) if len(constraints) else np.eye(n)
        m, r, k = (allowed.T @ matrix @ allowed for matrix in (mass, damping, stiffness + 1j * loss))
        zero, one, rate = np.zeros_like(m), np.eye(len(m)), np.sqrt(np.linalg.norm(k) / np.linalg.norm(m))
        exact = rate * scipy.linalg.eigvals(np.block([[zero, one], [-k / rate**2, -r / rate]]), scipy.linalg.block_diag(one, m))
        exact = exact[exact.imag > 0]
        exact = exact[np.argsort(abs(exact))][:4]
        forms = ["auto", "quadratic", "damped-constrained"] + ["low-rank"] * (place == "in few unknowns")
        for processes, options in ((2, ["--formulation", form]) for form in forms):
            check_modes(f"losses {place}, {options[-1]} on {processes}", solve(processes, problem, "--modes", 4, *options), exact)
        check_modes(f"losses {place}, ARPACK on 3", solve(3, problem, "--modes", 4, "--method", "arpack"), exact)
        check_modes(f"losses {place}, certified on 3", solve(3, problem, "--modes", 4, "--certify", "--formulation", "quadratic"), exact)
        check_modes(f"losses {place}, more processes than it takes", solve(4, problem, "--modes", 4, "--distribute", 5000), exact)
    _, alone = solve(0, folder / "crank.h5", "--modes", 4, "--loss-factor", 0.1)
    check_modes("a loss factor on 3", solve(3, folder / "crank.h5", "--modes", 4, "--loss-factor", 0.1), values(alone))


def check_modes(name, solved, expected):
    status, answer = solved
    if status != 0:
        check(name, False, f"{status} {answer}")
        return
    got = values(answer)
    check(name, len(got) == len(expected) and np.all(abs(got - expected) <= 1e-8 * abs(expected)), f"{got} {expected}")
    check(name + ": accurate, nothing missing", answer["certified"] is not False and
          max(mode["backward_error"] for mode in answer["modes"]) < 1e-12)


def check_ldl(folder):
    """The same factorisations, modes and certificate of a solid on any number of processes: free, damped, with constraints, and
    with anchors, so that it is factored as it is."""
    for name, words in (("free", ["block", "--cells", 4]), ("constrained", ["crank", "--density", 2]), ("tied", ["crank", "--density", 4])):
        problem = folder / f"{name}.h5"
        run(0, "scene", *words, "--output", problem)
        _, alone = solve(0, problem, "--modes", 12)
        for processes in (1, 2, 3, 4):
            status, answer = solve(processes, problem, "--modes", 12)
            check(f"{name} on {processes}: the same modes", status == 0 and np.all(abs(values(answer) - values(alone)) <= bounds(alone)),
                  f"{status} {answer}"[:300])
            check(f"{name} on {processes}: the same factorisations", status == 0 and answer["certified"] is True and
                  answer["counts"]["factorizations_for"] == alone["counts"]["factorizations_for"], f"{answer} {alone}"[:300])
        _, other = solve(3, problem, "--modes", 12)
        _, again = solve(3, problem, "--modes", 12)
        check(f"{name} on 3 twice: the same digits", np.array_equal(values(other), values(again)), f"{values(other)} {values(again)}")
    problem = folder / "amid.h5"
    run(0, "scene", "block", "--cells", 6, "--output", problem)
    amid = (problem, "--modes", 12, "--target", "0,20000")
    _, alone = solve(0, *amid)
    for processes in (1, 2, 3, 4):
        status, answer = solve(processes, *amid)
        check(f"amid the spectrum on {processes}: the same modes, counted", status == 0 and answer["certified"] is True and
              np.all(abs(values(answer) - values(alone)) <= bounds(alone)), f"{status} {answer}"[:300])
        words = run(processes, "solve", *amid, "--distribute", 1, "--threads", 1, "--verbose").stdout
        check(f"amid the spectrum on {processes}: LDL", "ldl: symmetric indefinite, " in words, words[:300])
    run(0, "scene", "grid", "--cells", "6x4", "--damping", "none", "--output", problem)
    for processes in (1, 2, 3, 4):
        words = run(processes, "solve", problem, "--modes", 2, "--target", "0,800", "--distribute", 1, "--threads", 1, "--verbose").stdout
        check(f"factors that grow on {processes}: MUMPS", "mumps: the matrix is indefinite" in words, words[:300])


def check_bands(folder):
    """Parts by groups of processes: the same modes in the same order, and the same counts."""
    problem = folder / "grid-band.h5"
    run(0, "scene", "grid", "--cells", "6x4", "--output", problem)
    _, alone = solve(0, problem, "--band", "0,400")
    for processes, options in ((2, ["--distribute", 5000]), (3, ["--distribute", 5000]), (4, ["--groups", 2]), (3, ["--groups", 2]),
                               (3, ["--groups", 1])):
        status, answer = solve(processes, problem, "--band", "0,400", *options)
        name = f"a band on {processes} {' '.join(map(str, options))}"
        if status != 0:
            check(name, False, f"{status} {answer}")
            continue
        check(name, len(answer["modes"]) == len(alone["modes"]) and
              np.all(abs(values(answer) - values(alone)) <= bounds(alone)), len(answer["modes"]))
        check(name + ": certified", answer["certified"] is True, answer["counts"])
        # Each group gets a part, so that the band is cut more often; within one group, in the same places.
        purposes, alone_for = (of["counts"]["factorizations_for"] for of in (answer, alone))
        if options != ["--groups", 1]:
            check(name + ": cut for its groups", purposes["iteration"] > alone_for["iteration"] and purposes["count"] > alone_for["count"],
                  purposes)
            continue
        check(name + ": counts", purposes["count"] == alone_for["count"] and purposes["iteration"] == alone_for["iteration"], purposes)
    # A long list is cut like a band, but where modes above it may be nearer to zero.
    _, alone = solve(0, problem, "--modes", 510)
    status, answer = solve(3, problem, "--modes", 510, "--distribute", 5000)
    check("a long list on 3", status == 0 and len(answer["modes"]) == 510 and answer["certified"] is True and
          np.all(abs(values(answer) - values(alone)) <= bounds(alone)), f"{status} {answer}"[:300])
    check("a long list is cut", answer["counts"]["factorizations_for"]["count"] > 10 + alone["counts"]["factorizations_for"]["count"],
          answer["counts"])
    # One that is not counted, and one that cannot be had.
    status, answer = solve(3, folder / "brake.h5", "--band", "0,400")
    check("a band that is not counted", status == 0 and answer["certified"] is None, f"{status} {answer}")
    done = run(3, "solve", problem, "--band", "5,2")
    check("a band that is none", done.returncode == 1, f"{done.returncode} {done.stderr}")


def check_lapack_band(folder):
    problem = folder / "grid-few.h5"
    run(0, "scene", "grid", "--cells", "4x3", "--damping", "none", "--output", problem)
    omega = np.sqrt(np.abs(frequencies_by_lapack(problem)))
    edges = (10.0, 400.0)
    inside = omega[(omega >= 2 * np.pi * edges[0]) & (omega <= 2 * np.pi * edges[1])]
    status, answer = solve(3, problem, "--band", "{},{}".format(*edges), "--distribute", 5000)
    got = values(answer).imag
    check("a band on 3 against LAPACK", len(got) == len(inside) and np.all(abs(got - inside) <= 1e-8 * got), f"{len(got)} {len(inside)}")


def check_checkpoint(folder):
    """What several processes wrote of their bases is gone on with by as many, to the same digits, and by others."""
    problem, checkpoint = folder / "grid-band.h5", folder / "grid.checkpoint"
    for options in (["--subspace", 60], ["--subspace", 100, "--formulation", "quadratic"]):
        name = "checkpoint, " + " ".join(map(str, options))
        status, whole = solve(2, problem, "--modes", 40, *options, "--checkpoint", checkpoint)
        check(f"{name}: it is there", status == 0 and checkpoint.exists(), whole)
        for processes in (2, 3):
            status, answer = solve(processes, problem, "--modes", 40, *options, "--resume", checkpoint)
            check(f"{name}: gone on with by {processes}", status == 0 and len(answer["modes"]) == len(whole["modes"]) and
                  np.all(abs(values(answer) - values(whole)) <= (0 if processes == 2 else bounds(whole))), f"{status} {answer}"[:300])
        checkpoint.unlink(missing_ok=True)


def check_reading(folder):
    """Each process reads its rows of a file: with entries in any order, twice, in one piece and in compressed ones, rows without
    any, fewer rows than processes; and what is wrong with one part of it is the error of all."""
    status, alone = solve(0, folder / "crank.h5", "--modes", 4)
    shuffled = folder / "shuffled.h5"
    random = np.random.default_rng(1)
    with h5py.File(folder / "crank.h5") as source, h5py.File(shuffled, "w") as file:
        for name in ("mass", "stiffness", "damping", "constraints"):
            start, column, value = (source[name][key][:] for key in ("indptr", "indices", "data"))
            row = np.repeat(np.arange(len(start) - 1), np.diff(start))
            row, column, value = np.tile(row, 2), np.tile(column, 2), np.concatenate([value / 4, 3 * value / 4])
            order = np.lexsort((random.random(len(row)), row))
            group = file.create_group(name)
            group.attrs["shape"] = source[name].attrs["shape"]
            group["indptr"] = 2 * start.astype(np.int64)
            group.create_dataset("indices", data=column[order].astype(np.int16), chunks=(100,), compression="gzip")
            group.create_dataset("data", data=value[order], chunks=(77,), compression="gzip")
    for processes in (1, 2, 3, 4):
        status, answer = solve(processes, shuffled, "--modes", 4)
        check(f"shuffled entries read by {processes}", status == 0 and
              np.all(abs(values(answer) - values(alone)) <= bounds(alone)), f"{status} {answer}"[:300])
    tiny = folder / "tiny.h5"
    with h5py.File(tiny, "w") as file:
        for name, matrix in (("mass", np.diag([2.0, 1.0])), ("stiffness", np.array([[6.0, 0.0], [0.0, 0.0]]))):
            matrix = scipy.sparse.csr_matrix(matrix)
            group = file.create_group(name)
            group.attrs["shape"] = matrix.shape
            for key in ("indptr", "indices", "data"):
                group[key] = getattr(matrix, key)
    status, answer = solve(4, tiny, "--modes", 2)
    check("more processes than rows", status == 0 and np.all(abs(values(answer) - [0, 3**0.5 * 1j]) < 1e-9), f"{status} {answer}")
    with h5py.File(shuffled, "a") as file:
        rows, starts = file["stiffness"].attrs["shape"][0], file["stiffness/indptr"]
        kept = starts[rows - 1]
        starts[rows - 1] = starts[rows - 3] - 1
    check_refused("row starts that descend in the last part", 3, shuffled, "descend")
    with h5py.File(shuffled, "a") as file:
        file["stiffness/indptr"][rows - 1] = kept
        file["damping/indices"][-1] = rows
    check_refused("a column too far in the last part", 4, shuffled, f"holds {rows}")
    with h5py.File(shuffled, "a") as file:
        file["damping/indices"][-1] = rows - 1
        file["mass/data"][-1] = np.nan
    check_refused("what is not finite in the last part", 2, shuffled, "not a finite number")
    with h5py.File(shuffled, "a") as file:
        del file["mass/data"]
        file["mass/data"] = np.ones(5)
    check_refused("too few values", 2, shuffled, "has 5 values")
    bytes_of = bytearray((folder / "crank.h5").read_bytes())
    truncated = folder / "truncated.h5"
    truncated.write_bytes(bytes_of[:len(bytes_of)//2])
    check_refused("a truncated file", 3, truncated, "damaged")
    # Where one process finds no file of that name, or another one.
    place = folder / "elsewhere"
    place.mkdir()
    for other, words in ((None, "process 1: crank.h5: no such file"), ("grid-band.h5", "other extents")):
        if other:
            (place / "crank.h5").write_bytes((folder / other).read_bytes())
        part = [KSCHUR, "solve", "crank.h5", "--modes", "4"]
        done = subprocess.run([MPIRUN, "--oversubscribe", "-np", "1", "--wdir", str(folder), *part, ":", "-np", "1", "--wdir",
                               str(place), *part, ":", "-np", "1", "--wdir", str(folder), *part], capture_output=True, text=True,
                              timeout=300)
        check(f"another file in one process: {words}", done.returncode == 2 and is_said(done, words), f"{done.returncode} {done.stderr}")


def check_halves(folder):
    """Halves of symmetric matrices: an error of all, or the modes of the whole."""
    status, alone = solve(0, folder / "grid.h5", "--modes", 4)
    half = folder / "half.h5"
    with h5py.File(folder / "grid.h5") as source, h5py.File(half, "w") as file:
        for name in set(source) & {"mass", "stiffness", "damping", "constraints"}:
            matrix = scipy.sparse.csr_matrix(tuple(source[name][key][:] for key in ("data", "indices", "indptr")), source[name].attrs["shape"])
            if name != "constraints":
                matrix = scipy.sparse.tril(matrix).tocsr()
            group = file.create_group(name)
            group.attrs["shape"] = matrix.shape
            for key in ("indptr", "indices", "data"):
                group[key] = getattr(matrix, key)
    check_refused("a half", 3, half, "has entries in its lower triangle only")
    for processes in (1, 3):
        status, answer = solve(processes, half, "--modes", 4, "--symmetric", "lower")
        check(f"a half on {processes}", status == 0 and np.all(abs(values(answer) - values(alone)) <= bounds(alone)),
              f"{status} {answer}"[:300])
    status, answer = solve(3, half, "--modes", 4, "--symmetric", "upper")
    check("the other half", status == 2 and "with --symmetric upper the entry" in answer, f"{status} {answer}"[:300])


def check_refused(name, processes, problem, words):
    done = run(processes, "solve", problem, "--modes", 4, "--distribute", 1)
    check(name, done.returncode == 2 and is_said(done, words), f"{done.returncode} {done.stderr}")


def check_errors(folder):
    """Every process ends with the status of the first one, and one line is said."""
    problem = folder / "crank.h5"
    wrong = {1: ["solve", problem, "--modes", 0], 2: ["solve", folder / "none.h5"], 4: ["solve", problem, "--output", "/nowhere/x.h5"]}
    for status, words in wrong.items():
        done = run(3, *words)
        lines = [line for line in done.stderr.splitlines() if line.startswith("kschur: ")]
        check(f"exit status {status}", done.returncode == status and len(lines) == 1, f"{done.returncode} {done.stderr}")
    # Found out during the solve, when the others wait: an inner solver that does not fit, a singular pencil.
    done = run(3, "solve", folder / "brake.h5", "--inner", "ldl", "--distribute", 1, "--formulation", "quadratic")
    check("an error in the first process", done.returncode == 1 and "does not fit" in done.stderr, f"{done.returncode} {done.stderr}")


def check_limits(folder):
    """Too little memory in one of three processes from the beginning: all end with status 4 and one line."""
    problem = folder / "crank-memory.h5"
    run(0, "scene", "crank", "--density", "2", "--output", problem)
    for megabytes in (100, 250, 310, 370, 5000):
        limited = f'test "$OMPI_COMM_WORLD_RANK" = 1 && ulimit -v {1024 * megabytes}; exec "$@"'
        done = subprocess.run([MPIRUN, "--oversubscribe", "-np", "3", "sh", "-c", limited, "sh", KSCHUR, "solve", str(problem),
                               "--modes", "4", "--distribute", "1", "--threads", "1"], capture_output=True, text=True, timeout=300)
        check(f"{megabytes} MB in one process", done.returncode == (0 if megabytes == 5000 else 4) and
              (megabytes == 5000 or is_said(done, "no memory")), f"{done.returncode} {done.stderr}")


def is_said(done, words):
    lines = [line for line in done.stderr.splitlines() if line.startswith("kschur: ")]
    return len(lines) == 1 and words in lines[0]


# What a process does when it calls a function for the n-th time. Of the calls of MPI_Allgatherv in the first factorisation the
# first tells the roots of subtrees, the next ones rows of common supernodes.
PURPOSES = {
    "reads": ("H5Dread", 2), "reads its rows": ("H5Dread", 5), "reads its third array": ("H5Dread", 3),
    "reads its ninth array": ("H5Dread", 9), "orders": ("METIS_NodeND", 1), "is told to end while it orders": ("gk_sigtrap", 1),
    "factors its subtrees": ("dgemm", 1), "tells the roots of its subtrees": ("MPI_Allgatherv", 1),
    "factors common supernodes": ("MPI_Allgatherv", 2), "orthogonalises": ("MPI_Reduce", 20), "writes": ("H5Dwrite", 3),
    "begins MUMPS": ("dmumps -1", 1), "analyses for MUMPS": ("dmumps 1", 1), "factors by MUMPS": ("dmumps 2", 1),
    "solves by MUMPS": ("dmumps 3", 20), "does nothing of the kind": ("nothing", 1)}


def fail(problem, rank, purpose, room, *options):
    """A solve on three processes, one of which is killed where it does something, or has no more memory than so many megabytes
    from then on. Returns how it ended, and the names of what it has written."""
    at, count = PURPOSES[purpose]
    place = problem.parent / "failed"
    place.mkdir(exist_ok=True)
    environment = dict(os.environ, LD_PRELOAD=FAIL_AT, FAIL_RANK=str(rank), FAIL_AT=at, FAIL_COUNT=str(count))
    if room is not None:
        environment["FAIL_ROOM"] = str(room)
    words = [KSCHUR, "solve", problem, "--threads", 1, "--output", place / "result.h5", *options]
    done = subprocess.run([MPIRUN, "--oversubscribe", "-np", "3", *map(str, words)], capture_output=True, text=True, timeout=120,
                          env=environment)
    return done, [path.name for path in place.iterdir()]


def check_killed(folder):
    """A process that is killed ends the others, and leaves no result, whatever it did."""
    together = [folder / "crank-memory.h5", "--modes", 10, "--distribute", 1]
    in_groups = [folder / "crank-memory.h5", "--band", "0,2000", "--groups", 3]
    by_mumps = [*together, "--inner", "mumps"]
    phases = [(0, "reads", together), (2, "reads its rows", together), (0, "orders", together),
              (2, "factors its subtrees", together), (1, "factors common supernodes", together),
              (0, "factors common supernodes", together), (1, "orthogonalises", together), (0, "orthogonalises", together),
              (1, "analyses for MUMPS", by_mumps), (2, "factors by MUMPS", by_mumps), (1, "solves by MUMPS", by_mumps),
              (0, "solves by MUMPS", by_mumps), (1, "orders", in_groups), (0, "writes", together)]
    for rank, phase, (problem, *options) in phases:
        done, written = fail(problem, rank, phase, None, *options)
        check(f"process {rank} killed when it {phase}", done.returncode not in (0, 3) and f"rank {rank}" in done.stderr and
              "signal 9" in done.stderr and "result.h5" not in written, f"{done.returncode} {done.stderr} {written}")
    done, written = fail(together[0], 9, "does nothing of the kind", None, *together[1:])
    check("what a killed process left goes with the next run", done.returncode == 0 and written == ["result.h5"], written)
    (folder / "failed" / "result.h5").unlink()


def check_told_while_it_orders(folder):
    """A SIGTERM that comes when METIS has taken those for itself, whose handler knows the way back in its own thread only: MPI has others."""
    done, written = fail(folder / "crank-memory.h5", 0, "is told to end while it orders", None, "--modes", 10, "--distribute", 1)
    check("told to end while METIS orders", done.returncode == 3 and is_said(done, "interrupted") and written == ["result.h5"],
          f"{done.returncode} {done.stderr} {written}")
    (folder / "failed" / "result.h5").unlink(missing_ok=True)


def check_memory_ends(folder):
    """Memory of one process that ends when a file is read, a matrix analysed, factored or solved with is that of all."""
    for rank, phase, inner in ((1, "reads its third array", "auto"), (0, "reads its ninth array", "auto"),
                               (1, "factors its subtrees", "auto"), (0, "tells the roots of its subtrees", "auto"),
                               (1, "tells the roots of its subtrees", "auto"), (2, "tells the roots of its subtrees", "auto"),
                               (0, "orthogonalises", "auto"), (1, "orthogonalises", "auto"), (2, "orthogonalises", "auto"),
                               (1, "begins MUMPS", "mumps"), (1, "analyses for MUMPS", "mumps"), (1, "factors by MUMPS", "mumps"),
                               (0, "solves by MUMPS", "mumps"), (1, "solves by MUMPS", "mumps")):
        for room in (1, 20):
            done, written = fail(folder / "crank-memory.h5", rank, phase, room, "--modes", 10, "--distribute", 1, "--inner", inner)
            check(f"{room} MB left in process {rank} when it {phase}", done.returncode == 4 and is_said(done, "memory") and
                  not written,
                  f"{done.returncode} {done.stderr} {written}")


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        check_scenes(folder)
        check_lapack(folder)
        check_methods(folder)
        check_losses(folder)
        check_ldl(folder)
        check_bands(folder)
        check_reading(folder)
        check_halves(folder)
        check_lapack_band(folder)
        check_checkpoint(folder)
        check_limits(folder)
        check_killed(folder)
        check_told_while_it_orders(folder)
        check_memory_ends(folder)
        check_errors(folder)
    print(f"{passed} passed, {failed} failed")
    return failed > 0


if __name__ == "__main__":
    sys.exit(main())
