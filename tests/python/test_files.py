#!/usr/bin/python3
"""Files between kschur and SciPy, h5py, AnnData's layout: each reads what the other writes.

    test_files.py CONVERT_PROBLEM [KSCHUR]

CONVERT_PROBLEM is the program of tests/convert_problem.f90; KSCHUR, the kschur
program, is tried too where it is given. Exit status 0: all is well.
"""
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np
import scipy.io
import scipy.sparse as sparse
from checks import check, finish

CONVERTER = sys.argv[1]
PROGRAM = sys.argv[2] if len(sys.argv) > 2 else None
GROUPS = {"mass": "M", "stiffness": "K", "damping": "R", "constraints": "Cq"}


def run(*command):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True)


def convert(source, target, what):
    done = run(CONVERTER, source, target)
    check(what + ": converts without a word",
          done.returncode == 0 and done.stdout == "" and done.stderr == "")
    if done.stderr:
        print("      " + done.stderr.strip())
    return done.returncode == 0


def refuses(source, *parts):
    """One line that names all the parts, no file left behind."""
    target = source.parent / "refused.h5"
    done = run(CONVERTER, source, target)
    check("refused in one line: " + done.stderr.strip(),
          done.returncode == 2 and done.stderr.count("\n") == 1 and all(part in done.stderr for part in parts)
          and not list(source.parent.glob("refused*")))


def equal(a, b):
    return a.shape == b.shape and (abs(sparse.csr_matrix(a) - sparse.csr_matrix(b))).max() == 0


def make_problem(n=40, m=3, seed=1):
    random = np.random.default_rng(seed)
    stiffness = sparse.random(n, n, 0.1, random_state=seed)
    stiffness = (stiffness + stiffness.T + 10*sparse.identity(n)).tocsr()
    return {"mass": sparse.diags(random.random(n) + 0.1).tocsr(),
            "stiffness": stiffness,
            "damping": sparse.random(n, n, 0.05, random_state=seed + 1).tocsr(),
            "constraints": sparse.csr_matrix((random.standard_normal(2*m), (np.repeat(np.arange(m), 2), np.arange(2*m))),
                                             shape=(m, n))}


def write_group(file, name, matrix, integers=np.int32, encoding="csr_matrix", data=None, **options):
    group = file.create_group(name)
    if encoding is not None:
        group.attrs["encoding-type"] = encoding
    group.attrs["shape"] = np.array(matrix.shape, dtype=integers)
    group.create_dataset("indptr", data=matrix.indptr.astype(integers), **options)
    group.create_dataset("indices", data=matrix.indices.astype(integers), **options)
    group.create_dataset("data", data=matrix.data if data is None else data, **options)
    return group


def write_hdf5(path, problem, **options):
    with h5py.File(path, "w") as file:
        for name, matrix in problem.items():
            write_group(file, name, matrix, **options)
    return path


def read_hdf5(path):
    matrices = {}
    with h5py.File(path, "r") as file:
        for name in GROUPS.keys() & file.keys():
            group = file[name]
            assert group.attrs["encoding-type"] == "csr_matrix" and group.attrs["encoding-version"] == "0.1.0"
            matrices[name] = sparse.csr_matrix((group["data"][:], group["indices"][:], group["indptr"][:]),
                                               shape=tuple(group.attrs["shape"]))
            matrices[name].check_format()
    return matrices


def same(problem, other):
    return problem.keys() == other.keys() and all(equal(problem[name], other[name]) for name in problem)


def test_hdf5_varieties(folder):
    problem = make_problem()
    varieties = {
        "32-bit integers": dict(integers=np.int32),
        "64-bit integers": dict(integers=np.int64),
        "unsigned integers": dict(integers=np.uint32),
        "big-endian integers": dict(integers=">i8"),
        "gzip": dict(compression="gzip", shuffle=True),
        "fixed-length encoding-type": dict(encoding=np.bytes_("csr_matrix")),
        "variable-length ASCII encoding-type": dict(
            encoding=np.array("csr_matrix", dtype=h5py.string_dtype("ascii"))),
        "no encoding-type": dict(encoding=None),
    }
    for what, options in varieties.items():
        source = write_hdf5(folder/"in.h5", problem, **options)
        target = folder/"out.h5"
        if convert(source, target, "h5py, " + what):
            check("h5py, " + what + ": the same comes back", same(problem, read_hdf5(target)))


def test_hdf5_values(folder):
    problem = {name: matrix for name, matrix in make_problem().items() if name in ("mass", "stiffness")}
    for kind in (np.int32, np.int64, np.uint8, np.float32):
        with h5py.File(folder/"in.h5", "w") as file:
            for name, matrix in problem.items():
                write_group(file, name, matrix, data=np.round(5*matrix.data).astype(kind))
        if convert(folder/"in.h5", folder/"out.h5", f"data of {kind.__name__}"):
            rounded = {name: sparse.csr_matrix((np.round(5*matrix.data).astype(kind).astype(float), matrix.indices,
                                                matrix.indptr), shape=matrix.shape) for name, matrix in problem.items()}
            check(f"data of {kind.__name__}: the same comes back", same(rounded, read_hdf5(folder/"out.h5")))


def test_unsorted_rows(folder):
    problem = make_problem()
    matrix = problem["stiffness"].copy()
    for row in range(matrix.shape[0]):
        part = slice(matrix.indptr[row], matrix.indptr[row + 1])
        matrix.indices[part] = matrix.indices[part][::-1].copy()
        matrix.data[part] = matrix.data[part][::-1].copy()
    source = write_hdf5(folder/"in.h5", {**problem, "stiffness": matrix})
    if convert(source, folder/"out.h5", "unsorted rows"):
        back = read_hdf5(folder/"out.h5")
        check("unsorted rows: the same comes back, sorted",
              same(problem, back) and back["stiffness"].has_sorted_indices)


def test_matrix_market_varieties(folder):
    problem = make_problem()
    source = folder/"in"
    source.mkdir()
    symmetric = {"mass", "stiffness"}
    whole = {name: sparse.csr_matrix(np.round(5*matrix.toarray())) for name, matrix in problem.items()}
    whole["mass"] = sparse.identity(40, format="csr")*3
    varieties = {
        "coordinate general": (problem, lambda name, matrix: (matrix, dict(symmetry="general"))),
        "coordinate symmetric": (problem, lambda name, matrix: (
            matrix, dict(symmetry="symmetric" if name in symmetric else "general"))),
        "array": (problem, lambda name, matrix: (matrix.toarray(), dict(symmetry="general"))),
        "array symmetric": (problem, lambda name, matrix: (
            matrix.toarray(), dict(symmetry="symmetric" if name in symmetric else "general"))),
        "integer": (whole, lambda name, matrix: (matrix.astype(int), dict(symmetry="general"))),
        "integer array": (whole, lambda name, matrix: (matrix.toarray().astype(int), {})),
    }
    for what, (matrices, form) in varieties.items():
        for name, matrix in matrices.items():
            content, options = form(name, matrix)
            options.setdefault("symmetry", None)
            scipy.io.mmwrite(source/(GROUPS[name] + ".mtx"), content, precision=17, comment="by SciPy", **options)
        if convert(source, folder/"out.h5", "mmwrite, " + what):
            check("mmwrite, " + what + ": the same comes back", same(matrices, read_hdf5(folder/"out.h5")))


def test_matrix_market_written(folder):
    problem = make_problem()
    source = write_hdf5(folder/"in.h5", problem)
    if convert(source, folder/"out", "to Matrix Market"):
        back = {name: scipy.io.mmread(folder/"out"/(file + ".mtx")).tocsr() for name, file in GROUPS.items()}
        check("to Matrix Market: mmread finds the same", same(problem, back))
        check("to Matrix Market: nothing else is left", sorted(path.name for path in (folder/"out").iterdir())
              == ["Cq.mtx", "K.mtx", "M.mtx", "R.mtx"])
    check("no temporary file is left", not list(folder.rglob("*partial*")))


def test_skew_symmetric(folder):
    problem = make_problem()
    skew = sparse.random(40, 40, 0.1, random_state=7)
    problem["damping"] = (skew - skew.T).tocsr()
    source = folder/"in"
    source.mkdir()
    for name, matrix in problem.items():
        scipy.io.mmwrite(source/(GROUPS[name] + ".mtx"), matrix, precision=17,
                         symmetry="skew-symmetric" if name == "damping" else "general")
    if convert(source, folder/"out.h5", "mmwrite, skew-symmetric"):
        check("mmwrite, skew-symmetric: the same comes back", same(problem, read_hdf5(folder/"out.h5")))


def test_refusals(folder):
    problem = make_problem()
    path = folder/"bad.h5"

    def alter(change):
        write_hdf5(path, problem)
        with h5py.File(path, "r+") as file:
            change(file)

    def replace(name, data):
        def change(file):
            del file[name]
            file[name] = data
        return change

    def beyond_range(file):
        indices = file["stiffness/indices"][:].astype(np.int64)
        indices[3] = 2**40
        replace("stiffness/indices", indices)(file)

    def not_finite(file):
        file["damping/data"][2] = np.nan

    changes = [
        (beyond_range, "stiffness matrix K", "/stiffness/indices holds 1099511627776"),
        (replace("mass/indptr", np.full(41, 2**40)), "mass matrix M", "/mass/indptr holds 1099511627776"),
        (replace("mass/indptr", np.zeros(41)), "mass matrix M", "/mass/indptr does not hold integers"),
        (replace("mass/data", np.zeros(40, dtype=complex)), "mass matrix M", "does not hold real numbers"),
        (replace("mass/data", np.zeros((40, 1))), "mass matrix M", "/mass/data has 2 dimensions"),
        (replace("mass/data", np.zeros(40, dtype=np.float16)), "mass matrix M", "single or double precision"),
        (replace("mass/data", np.array(["x"]*40, dtype="S1")), "mass matrix M", "does not hold real numbers"),
        (replace("mass", np.zeros((40, 40))), "mass matrix M", "/mass"),
        (lambda file: file["mass/data"].parent.attrs.__setitem__("encoding-type", "csc_matrix"), "csc_matrix"),
        (lambda file: file["mass"].attrs.__setitem__("encoding-type", 3), "encoding-type", "not a string"),
        (lambda file: file["mass"].attrs.__setitem__("shape", [40.5, 40]), "shape", "integers"),
        (lambda file: file["mass"].attrs.__setitem__("shape", [2**40, 40]), "shape"),
        (lambda file: file.__delitem__("stiffness/indices"), "no dataset /stiffness/indices"),
        (not_finite, "damping matrix R", "not a finite number"),
    ]
    for change, *parts in changes:
        alter(change)
        refuses(path, str(path), *parts)

    write_hdf5(path, problem)
    whole = path.read_bytes()
    for length in (0, 1, 8, 100, 800, len(whole)//2, len(whole) - 1):
        path.write_bytes(whole[:length])
        refuses(path, str(path))
    refuses(folder/"missing.h5", "no such file")
    refuses(folder/"missing", "M.mtx")


def test_program(folder):
    problem = make_problem()
    source = write_hdf5(folder/"x.h5", problem)
    done = run(PROGRAM, "info", source)
    check("kschur info of an h5py file", done.returncode == 0 and "40" in done.stdout)
    done = run(PROGRAM, "scene", "beam-body", "--output", folder/"scene.h5")
    check("kschur scene beam-body", done.returncode == 0 and {"mass", "stiffness"} <= set(read_hdf5(folder/"scene.h5")))
    matrices = read_hdf5(folder/"scene.h5")
    done = run(PROGRAM, "solve", folder/"scene.h5", "--output", folder/"r.h5", "--quiet")
    check("kschur solve", done.returncode == 0)
    with h5py.File(folder/"r.h5") as file:
        values, vectors = file["eigenvalues"][:], file["eigenvectors"][:]
        multipliers = file["multipliers"][:]
        modes, n = len(values), matrices["mass"].shape[0]
        check("result: complex128, modes x n", values.dtype == np.complex128 and vectors.shape == (modes, n))
        check("result: the kinds are strings", all(isinstance(kind.decode(), str) and kind for kind in file["kind"]))
        check("result: attributes", {"kschur", "method", "formulation", "target", "shift", "reason", "n", "m"}
              <= set(file.attrs) and isinstance(file.attrs["method"], str))
        zero = sparse.csr_matrix((n, n))
        constraints = matrices.get("constraints", sparse.csr_matrix((0, n)))
        worst = 0
        for value, vector, multiplier in zip(values, vectors, multipliers):
            terms = [value**2*(matrices["mass"] @ vector), value*(matrices.get("damping", zero) @ vector),
                     matrices["stiffness"] @ vector, constraints.T @ multiplier]
            size = abs(value)**2*sparse.linalg.norm(matrices["mass"], np.inf) \
                + sparse.linalg.norm(matrices["stiffness"], np.inf)
            worst = max(worst, np.linalg.norm(sum(terms))/(size*np.linalg.norm(vector)))
        check(f"result: the modes satisfy the equations (residual {worst:.1e})", worst < 1e-10)
    check("kschur info of a result", run(PROGRAM, "info", folder/"r.h5").returncode == 0)


def main():
    import scipy.sparse.linalg  # noqa: F401
    tests = [test_hdf5_varieties, test_hdf5_values, test_unsorted_rows, test_matrix_market_varieties,
             test_matrix_market_written, test_skew_symmetric, test_refusals]
    for test in tests + ([test_program] if PROGRAM else []):
        with tempfile.TemporaryDirectory() as folder:
            test(Path(folder))
    finish()


if __name__ == "__main__":
    main()
