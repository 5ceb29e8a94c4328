"""What the program kschur reads and writes: test_program_files.py PATH_OF_KSCHUR.

Prints each check, then `N passed, N failed`; fails where a check does.
"""
import csv
import io
import json
import math
import os
import re
import subprocess
import tempfile
from pathlib import Path

import h5py
import numpy as np

from checks import check, run_tests
from program import KSCHUR, check_refused, eigenvalues, kschur, read_dense, solve, write_matrix, write_problem


def test_scenes(folder):
    """The problems of the tests below."""
    for scene, name in ("beam-body", "undamped.h5"), ("grid", "grid.h5"):
        run = kschur("scene", scene, "--damping", "none", *(["--cells", "2x1"] if scene == "grid" else []), "--output", folder / name)
        check(f"scene {scene}", run.returncode == 0, run)


def test_csv(folder):
    run = kschur("solve", folder / "grid.h5", "--modes", 7, "--format", "csv")
    rows = list(csv.reader(io.StringIO(run.stdout)))
    check("CSV: the columns", rows[0] == ["mode", "eigenvalue_re", "eigenvalue_im", "frequency_hz", "damped_frequency_hz",
                                          "damping_ratio", "kind", "backward_error", "error"], rows[0])
    check("CSV: a row for each mode", len(rows) == 8 and all(len(row) == 9 for row in rows))
    check("CSV: a rigid mode", rows[1][:7] == ["1", "0", "0", "0", "0", "", "rigid"], rows[1])
    check("CSV: an elastic mode", rows[7][6] == "undamped" and float(rows[7][2]) > 0, rows[7])


def test_result_file(folder):
    place = folder / "results"
    place.mkdir()
    output = place / "result.h5"
    output.write_text("what stood there before")
    result, _ = solve(folder / "undamped.h5", "--modes", 5, "--tolerance", "1e-11", "--subspace", 21, "--max-restarts",
                      150, "--constraint-scaling", "scalar", "--output", output)
    check("result: only the file under its final name", os.listdir(place) == ["result.h5"], os.listdir(place))
    with h5py.File(output) as file, h5py.File(folder / "undamped.h5") as problem:
        values, shapes, multipliers = (file[name][:] for name in ("eigenvalues", "eigenvectors", "multipliers"))
        m, k, cq = (read_dense(problem[name]) for name in ("mass", "stiffness", "constraints"))
        check("result: the datasets", {"frequency_hz", "damped_frequency_hz", "damping_ratio", "backward_error", "error", "kind",
                                       "history"} <= set(file), list(file))
        check("result: options, counts, timings and version as attributes", {
            "kschur", "modes_asked", "target", "shift", "tolerance", "subspace", "max_restarts", "constraint_scaling",
            "seed", "method", "formulation", "reason", "operator_applications", "restarts", "factorizations",
            "seconds_total", "peak_memory_bytes"} <= set(file.attrs), dict(file.attrs))
        check("result: the options that were given", [file.attrs[name] for name in (
            "tolerance", "subspace", "max_restarts", "constraint_scaling")] == [1e-11, 21, 150, "scalar"], dict(file.attrs))
        check("result: the memory that was printed", file.attrs["peak_memory_bytes"] == result["peak_memory_bytes"])
    check("result: complex values and shapes", np.iscomplexobj(values) and shapes.shape == (5, 30)
          and multipliers.shape == (5, 6), (values.dtype, shapes.shape, multipliers.shape))
    check("result: the values that were printed", np.array_equal(values, eigenvalues(result)))
    residual = values[:, None] ** 2 * (shapes @ m.T) + shapes @ k.T + multipliers @ cq
    check("result: the equations of motion hold", np.linalg.norm(residual, axis=1).max() < 1e-10 * np.linalg.norm(k, 2))
    check("result: the constraints hold", np.abs(shapes @ cq.T).max() < 1e-12)
    run = kschur("info", output)
    check("info RESULT: its table", run.returncode == 0 and run.stdout.count("undamped ") >= 5, run)
    again = kschur("info", output, "--format", "json")
    check("info RESULT: its modes in JSON", again.returncode == 0
          and json.loads(again.stdout)["modes"] == result["modes"], again)
    check("info RESULT: the memory of the solution",
          json.loads(again.stdout)["peak_memory_bytes"] == result["peak_memory_bytes"] > 1000000, again.stdout)
    with h5py.File(output, "r+") as file:
        for name in ("tolerance", "subspace", "max_restarts", "constraint_scaling", "seed", "peak_memory_bytes"):
            del file.attrs[name]
    again, table = kschur("info", output, "--format", "json"), kschur("info", output).stdout
    check("info RESULT of before the options: is read, its memory unknown", again.returncode == 0
          and json.loads(again.stdout)["peak_memory_bytes"] is None and " s, - MB\n" in table, (again, table))


def test_output_that_cannot_be_written(folder):
    """Refused before anything is read: where the problem is missing, the output is what is complained of."""
    (folder / "taken").mkdir()
    (folder / "taken.h5").mkdir()
    (folder / "file").write_text("stays")
    for name, path, *words in (("a folder that does not exist", folder / "nowhere" / "r.h5", "nowhere"),
                               ("a folder that does not exist, relative", "nowhere/r.h5", "nowhere"),
                               ("a folder", folder / "taken", "taken: a folder"), ("a folder with a slash", f"{folder}/taken/", "a folder"),
                               ("a file as its folder", folder / "file" / "r.h5", "file/r.h5"),
                               ("a device", "/dev/null", "a device")):
        for problem in (folder / "undamped.h5", folder / "missing.h5"):
            check_refused(f"solve, output in {name}, {problem.name}", 4, kschur(
                "solve", problem, "--output", path, cwd=folder), *words)
    for name, path, *words in (("a folder that does not exist", folder / "nowhere" / "g.h5", "nowhere"),
                               ("a folder", folder / "taken.h5", "taken.h5: a folder"), ("a file", folder / "file", "file: a file"),
                               ("a folder of files in none", folder / "nowhere" / "g", "nowhere")):
        check_refused(f"scene, output in {name}", 4, kschur("scene", "castle", "--output", path), *words)
    check("output that cannot be written: nothing was touched", (folder / "file").read_text() == "stays"
          and not any((folder / name).exists() for name in ("nowhere", "file.h5"))
          and os.listdir(folder / "taken") == os.listdir(folder / "taken.h5") == [])
    if os.getuid() == 0:
        return  # who may write everywhere
    (folder / "taken").chmod(0o500)
    check_refused("output in a folder that is read only", 4, kschur(
        "solve", folder / "missing.h5", "--output", folder / "taken" / "r.h5"), "may not be written to")
    check_refused("scene in a folder that is read only", 4, kschur(
        "scene", "castle", "--output", folder / "taken"), "may not be written to")


def test_output_in_shared_memory(folder):
    """It is mounted among the devices, and a place like any other."""
    if not os.access("/dev/shm", os.W_OK):
        return
    with tempfile.TemporaryDirectory(dir="/dev/shm") as name:
        run = kschur("solve", folder / "undamped.h5", "--quiet", "--output", Path(name) / "modes.h5")
        check("output in shared memory", run.returncode == 0 and os.listdir(name) == ["modes.h5"], run.stderr)


def test_output_never_replaces_the_problem(folder):
    problem = folder / "undamped.h5"
    before = problem.read_bytes()
    (folder / "here").mkdir()
    (folder / "link.h5").symlink_to(problem)
    for path in (problem, f"{folder}/./undamped.h5", f"{folder}/here/../undamped.h5", folder / "link.h5"):
        check_refused(f"--output {path}, the problem itself", 1, kschur("solve", problem, "--output", path), "replace")
    check_refused("--output of a relative path", 1, kschur("solve", problem, "--output", "undamped.h5", cwd=folder), "replace")
    check_refused("a problem by a link, --output its file", 1,
                  kschur("solve", folder / "link.h5", "--output", problem), "replace")
    os.link(problem, folder / "second-name.h5")
    run = kschur("solve", problem, "--output", folder / "second-name.h5")
    check("--output of a hard link: a file of its own, the problem stays", run.returncode == 0
          and not os.path.samefile(problem, folder / "second-name.h5") and problem.read_bytes() == before, run)
    matrices = write_problem(folder / "matrices", M=np.eye(3), K=np.eye(3))
    for name in ("M", "K", "R", "Cq"):
        write_matrix(matrices / f"{name}.mtx", np.eye(3))
    files = {path.name: path.read_bytes() for path in matrices.iterdir()}
    for name in files:
        check_refused(f"--output {name} of the folder", 1,
                      kschur("solve", matrices, "--output", matrices / name), "replace")
        check_refused(f"--output {name}, named", 1, kschur(
            "solve", "--mass", matrices / "M.mtx", "--stiffness", matrices / "K.mtx", "--damping", matrices / "R.mtx",
            "--constraints", matrices / "Cq.mtx", "--output", f"{matrices}/./{name}"), "replace")
    check("the matrices are as they were",
          files == {path.name: path.read_bytes() for path in matrices.iterdir()})
    check("the problem is as it was", problem.read_bytes() == before)


def run_without_output(how, *words):
    """Runs kschur with its standard output redirected as the shell writes it."""
    return subprocess.run(["sh", "-c", f'exec "$0" "$@" {how}', KSCHUR, *map(str, words)], stderr=subprocess.PIPE,
                          text=True, timeout=300)


def test_lost_output(folder):
    problem, output = folder / "undamped.h5", folder / "kept.h5"
    kschur("solve", problem, "--output", output)
    for how in (">&-", "> /dev/full"):
        if "full" in how and not os.path.exists("/dev/full"):
            continue
        for words in (["--version"], ["help", "scene"], ["info", problem], ["info", output, "--verbose"],
                      ["solve", problem], ["solve", problem, "--modes", 99], ["solve", problem, "--format", "json"],
                      ["solve", problem, "--format", "csv"], ["scene", "grid", "--output", folder / "g.h5"]):
            run = run_without_output(how, *words)
            name = " ".join([os.path.basename(str(word)) for word in words] + [how])
            check(f"{name}: exit status 4", run.returncode == 4, (run.returncode, run.stderr))
            check(f"{name}: one line", run.stderr == "kschur: standard output cannot be written to\n", run.stderr)
    output.unlink()
    run = run_without_output(">&-", "solve", problem, "--output", output)
    check("result with standard output closed: exit status 4, but written", run.returncode == 4
          and kschur("info", output).returncode == 0, run)


def test_closed_descriptors(folder):
    """With two of the standard descriptors closed a sound file is read, and what is written is whole."""
    problem, output = folder / "undamped.h5", folder / "closed.h5"
    for how, status in (("<&- 2>&-", 0), ("<&- >&-", 4), (">&- 2>&-", 4), ("<&- >&- 2>&-", 4)):
        output.unlink(missing_ok=True)
        run = run_without_output(how, "solve", problem, "--modes", 3, "--output", output)
        check(f"{how}: exit status {status}", run.returncode == status, (run.returncode, run.stderr))
        check(f"{how}: the result is whole", kschur("info", output).returncode == 0)


def test_matrices_that_cannot_be_read(folder):
    for name, link in (("R", "nowhere"), ("Cq", "nowhere"), ("R", "R.mtx")):
        bad = write_problem(folder / f"broken-{name}-{link}", M=np.eye(3), K=np.eye(3))
        (bad / f"{name}.mtx").symlink_to(link)
        check_refused(f"{name}.mtx a link to {link}", 2, kschur("solve", bad), f"{name}.mtx", "link")
    bad = write_problem(folder / "folder-R", M=np.eye(3), K=np.eye(3))
    (bad / "R.mtx").mkdir()
    check_refused("R.mtx a folder", 2, kschur("solve", bad), "R.mtx", "a folder, not a file")
    check_refused("--mass a folder", 2, kschur("solve", "--mass", bad, "--stiffness", bad / "K.mtx"), "a folder")
    bad = write_problem(folder / "empty-R", M=np.eye(3), K=np.eye(3))
    (bad / "R.mtx").touch()
    check_refused("R.mtx empty", 2, kschur("solve", bad), "R.mtx", "the file is empty")
    if os.getuid() == 0:
        return  # who may read everything
    (bad / "R.mtx").chmod(0)
    check_refused("R.mtx unreadable", 2, kschur("solve", bad), "R.mtx", "Permission denied")
    bad.chmod(0)
    check_refused("an unreadable folder", 2, kschur("solve", bad), "M.mtx", "Permission denied")
    bad.chmod(0o700)


def test_bad_input(folder):
    bad = folder / "huge"
    bad.mkdir()
    with h5py.File(folder / "huge.h5", "w") as file:
        for name in ("mass", "stiffness"):
            group = file.create_group(name)
            group.attrs["shape"] = [2000000000, 2000000000]
            for dataset, values in (("indptr", [0, 1]), ("indices", [0]), ("data", [1.0])):
                group[dataset] = values
    check_refused("two thousand million rows, HDF5", 2, kschur("solve", folder / "huge.h5"), "huge.h5", "2000000001")
    for name in ("M.mtx", "K.mtx"):
        (bad / name).write_text("%%MatrixMarket matrix coordinate real general\n2000000000 2000000000 1\n1 1 1.0\n")
    check_refused("two thousand million rows, one entry", 2, kschur("solve", bad), "M.mtx", "2000000000")
    check_refused("missing file", 2, kschur("solve", folder / "missing.h5"), folder / "missing.h5")
    whole = (folder / "undamped.h5").read_bytes()
    (folder / "truncated.h5").write_bytes(whole[:len(whole) // 2])
    check_refused("truncated HDF5 file", 2, kschur("solve", folder / "truncated.h5"), "truncated.h5")
    check_refused("truncated HDF5 file, info", 2, kschur("info", folder / "truncated.h5"), "truncated.h5")
    (folder / "text.h5").write_text("no HDF5 file at all\n")
    check_refused("not an HDF5 file", 2, kschur("solve", folder / "text.h5"), "text.h5")
    with h5py.File(folder / "empty.h5", "w"):
        pass
    check_refused("HDF5 file without matrices", 2, kschur("solve", folder / "empty.h5"), "empty.h5", "mass")
    check_refused("HDF5 file without matrices, info", 2, kschur("info", folder / "empty.h5"), "empty.h5", "mass")
    (folder / "nothing").mkdir()
    (folder / "alone.mtx").touch()
    check_refused("one Matrix Market file", 2, kschur("solve", folder / "alone.mtx"), "alone.mtx", "its folder", "--mass")
    check_refused("folder without matrices", 2, kschur("solve", folder / "nothing"), "M.mtx")
    unit = np.eye(3)
    bad = write_problem(folder / "range", M=unit, K=unit)
    write_matrix(bad / "K.mtx", unit, "4 1 5.0\n")
    check_refused("index out of range", 2, kschur("solve", bad), "K.mtx", "stiffness matrix K")
    bad = write_problem(folder / "nan", M=unit, K=unit)
    write_matrix(bad / "M.mtx", unit, "2 1 NaN\n")
    check_refused("NaN", 2, kschur("solve", bad), "M.mtx", "mass matrix M")
    bad = write_problem(folder / "shape", M=unit, K=np.eye(4))
    check_refused("shapes that do not match", 2, kschur("solve", bad), "K.mtx", "stiffness matrix K", "4 x 4", "3 x 3")
    with h5py.File(folder / "undamped.h5") as source, h5py.File(folder / "nan.h5", "w") as target:
        for name in source:
            source.copy(name, target)
        target["stiffness/data"][7] = math.nan
    check_refused("NaN in an HDF5 file", 2, kschur("solve", folder / "nan.h5"), "nan.h5", "stiffness matrix K")


def test_triplets_and_pipes(folder):
    """M, K, R and Cq as rows, columns and values, and through pipes: the same modes as from the folder."""
    source = write_problem(folder / "piped", M=np.diag([1.0, 2, 3]), K=np.array([[5.0, -1, 0], [-1, 4, 0], [0, 0, 2]]),
                           R=np.array([[0.1, 0, 0], [0, 0, 0], [0, 0, 0]]), Cq=np.array([[1.0, -1, 0]]))
    words = []
    for option, name in (("--mass", "M"), ("--stiffness", "K"), ("--damping", "R"), ("--constraints", "Cq")):
        entries = [line for line in (source / f"{name}.mtx").read_text().splitlines()[2:]]
        (source / f"{name}.txt").write_text("\n".join(entries))
        words += [option, source / f"{name}.txt"]
    expected = eigenvalues(solve(source, "--modes", 2)[0])
    check("triplets: three unknowns", len(expected) > 0)
    found = eigenvalues(solve(*words, "--triplets", "--modes", 2)[0])
    check("triplets: the same modes", np.allclose(found, expected, rtol=1e-12), (found, expected))
    named = [str(word).replace(".txt", ".mtx") for word in words]
    with open(source / "M.mtx") as given:
        run = kschur("solve", "--mass", "-", *named[2:], "--modes", 2, "--format", "json", stdin=given)
    check("--mass -: the same modes", run.returncode == 0
          and np.allclose(eigenvalues(json.loads(run.stdout)), expected, rtol=1e-12), run)
    run = subprocess.run(["bash", "-c", '"$0" solve --mass <(cat "$2") "${@:3}" --modes 2 --format json', KSCHUR, *named],
                         capture_output=True, text=True, timeout=300)
    check("--mass of a pipe: the same modes", run.returncode == 0
          and np.allclose(eigenvalues(json.loads(run.stdout)), expected, rtol=1e-12), run)
    check_refused("two matrices from standard input", 1, kschur("solve", "--mass", "-", "--stiffness", "-"), "standard input")
    check_refused("--triplets of a folder", 1, kschur("solve", source, "--triplets"), "--triplets")
    for text, *parts in (("0 1 2.0\n", "(0, 1)", "from 1"), ("1 2\n", "line 1", "three numbers"), ("", "empty"),
                         ("1 1 nan\n", "finite"), ("1 1 1 1\n", "three numbers"), ("1 1 1\x00\n", "three numbers"),
                         ("2147483647 1 1\n", "(2147483647, 1)"), ("4294967297 1 1\n", "(4294967297, 1)"),
                         ("-9223372036854775808 1 1\n", "three numbers")):
        (source / "bad.txt").write_text(text)
        check_refused(f"triplets {text!r}", 2, kschur("solve", "--mass", source / "bad.txt", *words[2:], "--triplets"),
                      "mass matrix M", *parts)
    (source / "bad.txt").write_text("2147483646 1 1\n")
    check_refused("triplets of unknowns without entries", 2, kschur("solve", "--mass", source / "bad.txt", *words[2:], "--triplets"),
                  "bad.txt", "2147483646", "empty in all matrices")
    (source / "K.mtx").write_text("%%MatrixMarket matrix coordinate real general\n3 3 1000000000000\n1 1 1\n")
    check_refused("more entries than the file can hold", 2, kschur("solve", source), "K.mtx", "line 2", "1000000000000")


def write_hdf5(path, **matrices):
    """Dense matrices as CSR groups; zeros are not stored."""
    with h5py.File(path, "w") as file:
        for name, matrix in matrices.items():
            matrix = np.asarray(matrix, float)
            group = file.create_group(name)
            group.attrs["shape"] = matrix.shape
            group["indptr"] = np.concatenate([[0], np.cumsum((matrix != 0).sum(axis=1))])
            group["indices"], group["data"] = np.nonzero(matrix)[1], matrix[matrix != 0]
    return path


def test_halves(folder):
    """Half of a symmetric matrix is an error, or taken as that; a coupling one way is what it is."""
    n = 6
    M, K = np.eye(n), 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    Cq = np.eye(1, n) - np.eye(1, n, 1)
    expected = {False: 2 * np.sin(np.arange(1, 4) * np.pi / (2 * n + 2))}
    Z = np.vstack([np.eye(1, n - 1), np.eye(n - 1)])
    expected[True] = np.sqrt(np.linalg.eigvals(np.linalg.solve(Z.T @ Z, Z.T @ K @ Z)).real)
    expected[True].sort()
    for half, name, other, entry in (np.tril, "lower", "upper", "(2, 1)"), (np.triu, "upper", "lower", "(1, 2)"):
        place = folder / f"half_{name}"
        market = write_problem(place, M=M, K=half(K), R=half(0.02 * K))
        hdf5 = write_hdf5(place / "half.h5", mass=M, stiffness=half(K), constraints=Cq)
        for path, tied in (market, False), (hdf5, True):
            words = "the stiffness matrix K", f"in its {name} triangle only", f"--symmetric {name}", "--symmetric no"
            # Short names, or the middle of the message is left out.
            near = path.relative_to(folder)
            for command in (["solve", near], ["info", near], ["compare", near],
                            ["response", near, "--frequencies", "1,2", "--input", 1], ["sensitivity", near, near],
                            ["sweep", near, near]):
                check_refused(f"{command[0]} {near} of a half", 2, kschur(*command, cwd=folder), near, *words)
            check_refused(f"the other half of {near}", 2, kschur("solve", near, "--symmetric", other, cwd=folder), near,
                          f"with --symmetric {other} the entry {entry} of the stiffness matrix K must mirror")
            result, _ = solve(path, "--modes", 3, "--symmetric", name)
            check(f"--symmetric {name} of {path.name}: the modes of the whole",
                  np.allclose(abs(eigenvalues(result)), expected[tied][:3], rtol=1e-12), eigenvalues(result))
            check(f"--symmetric {name} of {path.name}: symmetric", result["problem"]["symmetric"] is True, result["problem"])
            facts = json.loads(kschur("info", path, "--symmetric", name, "--format", "json").stdout)
            check(f"info --symmetric {name} of {path.name}", facts["problem"]["symmetric"] is True, facts)
            taken, _ = solve(path, "--modes", 1, "--symmetric", "no")
            check(f"--symmetric no of {path.name}: as it is", taken["problem"]["symmetric"] is False, taken["problem"])
        for command in (["response", market, "--frequencies", "0.01,0.02", "--input", 1], ["sensitivity", market, market, "--modes", 2],
                        ["sweep", market, market, "--modes", 2], ["compare", market, "--modes", 2]):
            run = kschur(*command, "--symmetric", name, "--quiet")
            check(f"{command[0]} --symmetric {name}", run.returncode == 0, run)
        files = ["--mass", market / "M.mtx", "--stiffness", market / "K.mtx", "--damping", market / "R.mtx"]
        found = eigenvalues(solve(*files, "--modes", 3, "--symmetric", name)[0])
        check(f"--stiffness FILE --symmetric {name}", np.allclose(abs(found), expected[False], rtol=1e-12), found)

    # K by half, M whole and full; a header that says symmetric.
    full = M + 0.1 * np.eye(n, k=1) + 0.1 * np.eye(n, k=-1)
    mixed = write_problem(folder / "mixed", M=full, K=np.triu(K))
    lowest = np.sqrt(np.linalg.eigvals(np.linalg.solve(full, K)).real.min())
    found = eigenvalues(solve(mixed, "--modes", 1, "--symmetric", "upper")[0])
    check("K by half, M whole", np.allclose(found.imag, lowest, rtol=1e-12), (found, lowest))
    text = (mixed / "K.mtx").read_text().splitlines()
    lines = [text[0].replace("general", "symmetric"), text[1], *(" ".join(np.array(line.split())[[1, 0, 2]]) for line in text[2:])]
    (mixed / "K.mtx").write_text("\n".join(lines) + "\n")
    for words in ([], ["--symmetric", "lower"], ["--symmetric", "upper"], ["--symmetric", "no"]):
        found = eigenvalues(solve(mixed, "--modes", 1, *words)[0])
        check(f"a header that says symmetric {words}", np.allclose(found.imag, lowest, rtol=1e-12), found)

    # One way: no half of a semidefinite matrix.
    one_way = write_problem(folder / "one_way", M=np.eye(2), K=[[1, 0], [-2.5, 4]])
    result, run = solve(one_way, "--modes", 2)
    check("a coupling one way: as it is", np.allclose(eigenvalues(result).imag, [1, 2], rtol=1e-12) and not run.stderr, (result, run.stderr))
    check_refused("--symmetric with another word", 1, kschur("solve", one_way, "--symmetric", "half"), "check, lower, upper, no", "'half'")
    run = kschur("sweep", "turbine", "--vary", "speed=1:2:2", "--symmetric", "lower")
    check_refused("--symmetric of a scene", 1, run, "no option '--symmetric'")


def test_messages(folder):
    """One line without what moves a cursor, whatever the words are, and not too long."""
    for name in (b"a\nb\rc\x1b[2J.h5", b"\x7f\xc2\x9b2J.h5", b"\x9b2J\x80.h5", "\u00e9\u6f22\U0001f600.h5".encode() * 40):
        run = subprocess.run([os.fsencode(KSCHUR), b"solve", name], capture_output=True, timeout=60)
        line = run.stderr.removesuffix(b"\n")
        check(f"message about {name[:20]!r}: one plain line", run.returncode == 2 and not re.search(
            rb"[\x00-\x1f\x7f]|\xc2[\x80-\x9f]|(?<![\x80-\xff])[\x80-\xbf]", line) and len(line) <= 240, line)
        line.decode()
    run = kschur("solve", "\u00e9\u6f22.h5")
    check("message about letters: as they are", "\u00e9\u6f22.h5" in run.stderr, run.stderr)
    run = kschur("solve", "x" * 5000)
    check("message about 5000 letters: short, says what is wrong", len(run.stderr) < 260 and "no such file" in run.stderr, run.stderr)


run_tests(
    test_scenes, test_csv, test_result_file, test_output_that_cannot_be_written, test_output_in_shared_memory,
    test_output_never_replaces_the_problem,
    test_lost_output, test_closed_descriptors, test_matrices_that_cannot_be_read, test_bad_input, test_triplets_and_pipes, test_halves, test_messages)
