"""What is made of modes, by the program as a user calls it: test_studies.py PATH_OF_KSCHUR PATH_OF_KSCHUR_CAMPBELL
[--without-picture].

Prints each check, then `N passed, N failed`; fails where a check does.
"""
import csv
import io
import json
import math
import os
import subprocess
import sys
import tempfile

import h5py
import matplotlib.image
import numpy as np

from checks import check, finish

KSCHUR, CAMPBELL = map(os.path.abspath, sys.argv[1:3])


def kschur(*words, status=0):
    run = subprocess.run([KSCHUR, *map(str, words)], capture_output=True, text=True, timeout=300)
    if run.returncode != status:
        check("exit status of " + " ".join(map(str, words)), False, f"{run.returncode}: {run.stderr}")
    return run


def write_matrix(path, matrix):
    rows, columns = np.nonzero(matrix)
    lines = ["%%MatrixMarket matrix coordinate real general", f"{matrix.shape[0]} {matrix.shape[1]} {len(rows)}"]
    lines += [f"{i + 1} {j + 1} {matrix[i, j]!r}" for i, j in zip(rows, columns)]
    with open(path, "w") as file:
        file.write("\n".join(lines) + "\n")


def write_problem(folder, **matrices):
    os.makedirs(folder, exist_ok=True)
    for name, matrix in matrices.items():
        write_matrix(os.path.join(folder, name + ".mtx"), np.asarray(matrix, dtype=float))
    return folder


def chain(n):
    """n masses of 1 kg between walls, springs of 100 N/m: omega_j = 20 sin(j pi/(2 (n + 1)))."""
    return 200 * np.eye(n) - 100 * np.eye(n, k=1) - 100 * np.eye(n, k=-1)


def test_normalisation(folder):
    problem = write_problem(folder + "/p", M=np.diag([1.0, 2, 3, 4]), K=chain(4))
    lengths = {"length": lambda phi: np.linalg.norm(phi), "displacement": lambda phi: np.abs(phi).max(),
               "mass": lambda phi: math.sqrt(np.sum([1, 2, 3, 4] * np.abs(phi)**2))}
    for name, length in lengths.items():
        path = f"{folder}/{name}.h5"
        kschur("solve", problem, "--modes", 4, "--normalise", name, "--output", path)
        with h5py.File(path) as file:
            shapes = file["eigenvectors"][:]
            check("shapes of unit " + name, all(abs(length(phi) - 1) < 1e-13 for phi in shapes))
            check("the file says " + name, file.attrs["normalisation"] == name)
    check("other lengths are refused", "length, mass, displacement" in kschur("solve", problem, "--normalise", "weight",
                                                                              status=1).stderr)


def test_properties(folder):
    n = 9
    problem = write_problem(folder + "/p", M=np.eye(n), K=chain(n), R=0.3 * np.eye(n))
    write_matrix(folder + "/d.mtx", np.column_stack([np.ones(n), np.arange(n)]))
    run = kschur("solve", problem, "--modes", n, "--normalise", "mass", "--directions", folder + "/d.mtx", "--format", "json",
                 "--output", folder + "/r.h5")
    result = json.loads(run.stdout)
    check("total masses", np.allclose(result["total_mass"], [n, np.sum(np.arange(n)**2)], rtol=1e-12))
    expected = [2 / (n + 1) / math.tan(j * math.pi / 2 / (n + 1))**2 if j % 2 else 0 for j in range(1, n + 1)]
    found = np.array([mode["effective_mass"] for mode in result["modes"]])
    check("effective masses", np.allclose(found[:, 0], expected, atol=1e-10), found[:, 0])
    check("they add up to the totals", np.allclose(found.sum(axis=0), result["total_mass"], rtol=1e-10))
    check("generalised values", all(abs(mode["generalised_mass"] - 1) < 1e-12 and abs(mode["generalised_damping"] - 0.3) < 1e-12
                                    for mode in result["modes"]))
    with h5py.File(folder + "/r.h5") as file:
        check("the file holds them", np.allclose(file["properties/effective_mass"][:].T, found, rtol=1e-14))
    for run in (kschur("solve", problem, "--modes", n, "--properties", "--directions", folder + "/d.mtx"),
                kschur("info", folder + "/r.h5")):
        check("the table has a line of the total", "direction 1: the modes have 9 of 9\n" in run.stdout, run.stdout)
    unsymmetric = write_problem(folder + "/u", M=np.eye(2), K=[[200.0, -90], [-100, 200]])
    run = kschur("solve", unsymmetric, "--modes", 2, "--properties")
    check("an unsymmetric problem gets its left vectors", "stiffness" in run.stdout and "condition" in run.stdout)
    write_matrix(folder + "/short.mtx", np.ones((3, 1)))
    for wrong, words in (("short.mtx", "the directions have 3 entries, but the problem has 9 unknowns"),
                         ("nothing.mtx", "No such file")):
        run = kschur("solve", problem, "--directions", f"{folder}/{wrong}", status=2)
        check("refused: " + wrong, words in run.stderr and wrong in run.stderr, run.stderr)


def test_directions_of_a_mesh(folder):
    """A beam of 90 kg and 6 m that is clamped: parts of its mass that are known in closed form, beta l of cosh cos = -1."""
    problem, mass, length = folder + "/beam.h5", 90, 6
    kschur("scene", "cantilever", "--elements", 40, "--tip-mass", 1e-6, "--damping", "none", "--output", problem)
    run = kschur("solve", problem, "--modes", 15, "--properties", "--format", "json", "--output", folder + "/r.h5")
    result = json.loads(run.stdout)
    check("six directions", result["directions"] == ["x", "y", "z", "rx", "ry", "rz"], result["directions"])
    check("total masses of a beam", np.allclose(np.array(result["total_mass"])[[0, 1, 2, 4, 5]],
                                                [mass] * 3 + [mass * length**2 / 3] * 2, rtol=1e-6), result["total_mass"])
    found = np.array([mode["effective_mass"] for mode in result["modes"]])
    roots = np.array([1.875104068711961, 4.694091132974175, 7.854757438237613])
    sigma = (np.sinh(roots) - np.sin(roots)) / (np.cosh(roots) + np.cos(roots))
    for across, about in ((1, 5), (2, 4)):
        bending = found[found[:, across] > 1e-9 * mass][:3]
        check("bending, of the mass", np.allclose(bending[:, across], mass * (2 * sigma / roots)**2, rtol=1e-5), bending)
        check("bending, about the base", np.allclose(bending[:, about], mass * length**2 * 4 / roots**4, rtol=1e-5), bending)
    check("stretching", np.allclose(found[:, 0].max(), mass * 8 / math.pi**2, rtol=1e-3), found[:, 0])
    for run in (kschur("solve", problem, "--modes", 15, "--properties"), kschur("info", folder + "/r.h5")):
        check("the table has lines of the totals", "direction x: the modes have 72.95" in run.stdout and
              "direction rz: the modes have 10" in run.stdout, run.stdout)
    # A chain that stands node after node along z: it moves along z, and turns about nothing.
    with h5py.File(folder + "/chain.h5", "w") as file:
        for name, matrix in (("mass", np.eye(5)), ("stiffness", chain(5))):
            rows, columns = np.nonzero(matrix)
            group = file.create_group(name)
            group.attrs["shape"] = matrix.shape
            group["indptr"] = np.searchsorted(rows, np.arange(6)).astype(np.int32)
            group["indices"], group["data"] = columns.astype(np.int32), matrix[rows, columns]
        file["coordinates"] = np.outer(np.arange(5.0), [0, 0, 1])
    result = json.loads(kschur("solve", folder + "/chain.h5", "--modes", 5, "--properties", "--format", "json").stdout)
    check("only what moves", result["directions"] == ["z"] and np.allclose(result["total_mass"], 5), result["directions"])


def test_mac(folder):
    for name, n in (("a", 5), ("b", 5), ("c", 4)):
        kschur("solve", write_problem(f"{folder}/{name}", M=np.diag(np.arange(1.0, n + 1) if name == "b" else np.ones(n)),
                                      K=chain(n)), "--modes", 3, "--output", f"{folder}/{name}.h5")
    shapes = {}
    for name in "ab":
        with h5py.File(f"{folder}/{name}.h5") as file:
            shapes[name] = file["eigenvectors"][:].real.T
    rows = list(csv.reader(io.StringIO(kschur("mac", folder + "/a.h5", folder + "/b.h5", "--format", "csv").stdout)))
    check("MAC", rows[0] == ["mode", "mode_1", "mode_2", "mode_3"] and
          np.allclose(np.array(rows[1:], dtype=float)[:, 1:], (shapes["a"].T @ shapes["b"])**2, atol=1e-12), rows)
    for words, status, message in ((["a.h5"], 1, "two results"), (["a.h5", "c.h5"], 1, "5 and 4 unknowns"),
                                   (["a.h5", "none.h5"], 2, "none.h5")):
        run = kschur("mac", *[f"{folder}/{word}" for word in words], status=status)
        check("mac refuses " + " ".join(words), message in run.stderr, run.stderr)


def test_sensitivity(folder):
    n = 5
    problem = write_problem(folder + "/p", M=np.eye(n), K=chain(n))
    stiffer = write_problem(folder + "/s", M=np.eye(n), K=1.25 * chain(n))
    modes = json.loads(kschur("sensitivity", problem, stiffer, "--step", 0.25, "--modes", 3, "--format", "json").stdout)
    check("all stiffnesses: d omega/omega is 1/2", len(modes) == 3 and
          all(abs(mode["rate_im"] - mode["eigenvalue_im"] / 2) < 1e-12 for mode in modes), modes)
    check("in Hz", all(abs(mode["frequency_rate"] - mode["eigenvalue_im"] / 2 / math.tau) < 1e-12 for mode in modes))
    # A dashpot: the damping ratio of mode j grows by phi_1^2/(2 omega).
    damped = write_problem(folder + "/d", M=np.eye(n), K=chain(n), R=np.diag([1.0] + (n - 1) * [0]))
    modes = json.loads(kschur("sensitivity", problem, damped, "--modes", 3, "--format", "json").stdout)
    expected = [2 / (n + 1) * math.sin(j * math.pi / (n + 1))**2 / 2 / (20 * math.sin(j * math.pi / 2 / (n + 1)))
                for j in (1, 2, 3)]
    check("a dashpot", np.allclose([mode["damping_rate"] for mode in modes], expected, rtol=1e-10), modes)
    other = write_problem(folder + "/o", M=np.eye(3), K=chain(3))
    check("of another size", "same numbers" in kschur("sensitivity", problem, other, status=1).stderr)
    check("one problem is not enough", "two problems" in kschur("sensitivity", problem, status=1).stderr)


def test_response(folder):
    """A chain with dashpots and a constraint against NumPy; a mass on a spring in closed form."""
    n, frequencies = 6, [0.2, 0.7, 1.2, 1.7, 2.2]
    M, R, K = np.diag(np.arange(1.0, n + 1)), np.diag([0, 3.0, 0, 0, 1, 0]), chain(n)
    Cq = np.array([[1.0, 0, 0, -2, 0, 0]])
    problem = write_problem(folder + "/p", M=M, R=R, K=K, Cq=Cq)
    force = np.array([0, 1.0, 0, 0, 0, -2])
    write_matrix(folder + "/f.mtx", force[:, None])

    def solved(frequency, f):
        s = 2j * math.pi * frequency
        return np.linalg.solve(np.block([[s * s * M + s * R + K, Cq.T], [Cq, np.zeros((1, 1))]]), np.append(f, 0))

    wanted = np.array([solved(f, force) for f in frequencies])
    run = kschur("response", problem, "--frequencies", "0.2:2.2:5", "--input", folder + "/f.mtx", "--at", "2,5",
                 "--format", "csv", "--output", folder + "/r.h5")
    rows = list(csv.reader(io.StringIO(run.stdout)))
    check("the names of columns", rows[0] == ["point", "frequency_hz", "unknown_2_re", "unknown_2_im", "unknown_5_re",
                                              "unknown_5_im"], rows[0])
    found = np.array(rows[1:], dtype=float)
    check("a response as NumPy's", np.allclose(found[:, 1], frequencies) and
          np.allclose(found[:, 2::2] + 1j * found[:, 3::2], wanted[:, [1, 4]], rtol=1e-10), found)
    with h5py.File(folder + "/r.h5") as file:
        x, xi = (file[name][:]["r"] + 1j * file[name][:]["i"] if file[name].dtype.names else file[name][:]
                 for name in ("response", "multipliers"))
        check("the file of a response", np.allclose(x, wanted[:, :n], rtol=1e-10) and
              np.allclose(xi, wanted[:, n:], rtol=1e-10) and np.allclose(file["frequency_hz"][:], frequencies))
    points = json.loads(kschur("response", problem, "--frequencies", "0.7", "--input", 3, "--format", "json").stdout)
    wanted = solved(0.7, np.eye(n)[2])[2]
    check("a force at an unknown, seen there", len(points) == 1 and
          np.allclose([points[0]["unknown_3_re"], points[0]["unknown_3_im"]], [wanted.real, wanted.imag], rtol=1e-10), points)
    # 2 kg, 8 N/m, 0.4 Ns/m: at resonance, 2 rad/s, the amplitude is 1/(0.4 2), a quarter behind.
    one = write_problem(folder + "/one", M=[[2.0]], K=[[8.0]], R=[[0.4]])
    run = kschur("response", one, "--frequencies", f"0,{1 / math.pi!r}", "--input", 1)
    check("at a resonance", " 1.250000" in run.stdout and "-90.000000" in run.stdout and " 0.125000" in run.stdout, run.stdout)
    # The ground shakes: on a stiff spring the inertia bends the beam as its weight does, w = rho A g l^4/(8 E I).
    kschur("scene", "cantilever", "--elements", 20, "--tip-mass", 1e-6, "--damping", "none", "--output", folder + "/b.h5")
    tip = [json.loads(kschur("response", folder + "/b.h5", "--frequencies", 0, *words, "--at", 128, "--format", "json").stdout)[0]
           ["unknown_128_re"] for words in (("--input", "y"), ("--input", 128))]
    check("inertia at rest", math.isclose(tip[0], -90 / 6 * 6**4 / 8 / (6**3 / 3) * tip[1], rel_tol=1e-6), tip)
    undamped = write_problem(folder + "/u", M=np.eye(1), K=[[(2 * math.pi) ** 2]])
    for words, status, message in (([problem], 1, "--frequencies and --input"),
                                   ([problem, "--frequencies", "1:2:1", "--input", 1], 1, "FIRST:LAST:POINTS"),
                                   ([problem, "--frequencies", "1,-2", "--input", 1], 1, "none negative"),
                                   ([problem, "--frequencies", "1", "--input", 7], 1, "no unknown 7: the problem has 6"),
                                   ([problem, "--frequencies", "1", "--input", 1, "--at", "0"], 1, "from 1, not '0'"),
                                   ([problem, "--frequencies", "1", "--input", 1, "--at", "9"], 1, "no unknown 9"),
                                   ([problem, "--frequencies", "1", "--input", "y"], 2, "/coordinates"),
                                   ([problem, "--frequencies", "1", "--input", "z.mtx"], 2, "z.mtx"),
                                   ([folder + "/b.h5", "--frequencies", "1", "--input", 1, "--output", folder + "/b.h5"], 1,
                                    "replace the problem"),
                                   ([write_problem(folder + "/free", M=np.eye(2), K=[[1, -1], [-1, 1]]), "--frequencies", "0",
                                     "--input", 1], 4, "no response at"),
                                   ([undamped, "--frequencies", "0.5,1", "--input", 1], 4, "no response at 1")):
        run = kschur("response", *words, status=status)
        check("response refuses: " + message, message in run.stderr and not run.stdout, run.stderr)


def test_sweep_of_files(folder):
    """Two modes with 1 + p and 2 - p, coupled or not: they veer or cross at p = 1/2."""
    values = [0, 0.2, 0.4, 0.6, 0.8, 1]
    for coupling, kind in ((0.02, "veering"), (0, "crossing")):
        problems = [write_problem(f"{folder}/{kind}{p}", M=np.eye(2), K=[[1 + p, coupling], [coupling, 2 - p]]) for p in values]
        words = [*problems, "--values", ",".join(map(str, values)), "--modes", 2]
        sweep = json.loads(kschur("sweep", *words, "--format", "json", "--output", folder + "/s.h5").stdout)
        root = np.array([(math.hypot(p - 0.5, coupling) if coupling else 0.5 - p) for p in values])
        expected = np.sqrt(np.stack([1.5 - root, 1.5 + root], axis=1))
        found = np.array([[point["eigenvalue_im_1"], point["eigenvalue_im_2"]] for point in sweep["points"]])
        check(kind + ": each branch", np.allclose(found, expected, rtol=1e-12), found)
        check(kind + ": one event", [event["kind"] for event in sweep["events"]] == [kind], sweep["events"])
        with h5py.File(folder + "/s.h5") as file:
            check(kind + ": the file", np.allclose(file["eigenvalues"][:].imag, expected) and
                  np.allclose(file["values"][:], values) and file["events/kind"][0].decode().strip() == kind)
    sweep = json.loads(kschur("sweep", problems[0], "--loss-factor", "0:0.4:3", "--modes", 2, "--format", "json").stdout)
    found = np.array([[complex(point[f"eigenvalue_re_{b}"], point[f"eigenvalue_im_{b}"]) for b in (1, 2)] for point in sweep["points"]])
    check("a sweep over the loss factor", np.allclose(found, [1j * np.sqrt(np.array([1, 2]) * (1 + 1j * g)) for g in (0, 0.2, 0.4)], rtol=1e-12,
                                                      atol=0), found)
    for words, message in ((problems[:1], "two problems or more"), ([*problems[:2], "--loss-factor", "0:1:3"], "wants one problem"),
                           ([problems[0], "--loss-factor", "0.1"], "FIRST:LAST:POINTS"), ([*problems, "--values", "1,2"], "a number for each problem"),
                           ([*problems[:3], "--values", "1,3,2"], "rising or falling"),
                           ([*problems[:2], "--vary", "p=1:2:3", "--values", "1,2"], "for problem files"),
                           (["rotor", "--vary", "speed=1:2"], "OPTION=FIRST:LAST:POINTS"),
                           (["rotor", "--vary", "color=1:2:3"], "color")):
        run = kschur("sweep", *words, status=1)
        check("sweep refuses: " + message, message in run.stderr, run.stderr)


def test_pictures_of_files(folder):
    values = [0, 0.2, 0.4, 0.6, 0.8, 1]
    problems = [write_problem(f"{folder}/{p}", M=np.eye(2), K=[[1 + p, 0], [0, 2 - p]]) for p in values]
    for name, order in (("s", 1), ("falling", -1)):
        kschur("sweep", *problems[::order], "--values", ",".join(map(str, values[::order])), "--modes", 2, "--output", f"{folder}/{name}.h5")
        subprocess.run([CAMPBELL, f"{folder}/{name}.h5", f"{folder}/{name}.png"], check=True)
        check(name + ": a picture", open(f"{folder}/{name}.png", "rb").read(4) == b"\x89PNG")
    # Black within the axes is the mark of the crossing alone.
    marks = [np.argwhere(matplotlib.image.imread(path)[40:540, 80:670, :3].sum(2) < 0.3) for path in (folder + "/s.png", folder + "/falling.png")]
    check("a crossing is marked where it is, also of a falling sweep", min(map(len, marks)) > 0
          and np.allclose(marks[0].mean(0), marks[1].mean(0), atol=1), [mark.mean(0) for mark in marks])
    h5py.File(folder + "/other.h5", "w").close()
    before = sorted(os.listdir(folder))
    for path, picture, *parts in (("s.h5", "nowhere/p.png", "nowhere"), ("s.h5", "p.nonsense", "nonsense"), ("none.h5", "p.png", "none.h5"),
                                  ("other.h5", "p.png", "not a sweep")):
        run = subprocess.run([CAMPBELL, path, picture], cwd=folder, capture_output=True, text=True)
        check(f"a picture {picture} of {path} is refused", run.returncode == 1 and run.stderr.count("\n") == 1
              and all(part in run.stderr for part in parts) and sorted(os.listdir(folder)) == before, run.stderr)


def test_sweep_of_a_scene(folder):
    run = kschur("sweep", "rotor", "--vary", "speed=3000:4000:5", "--bearings", "rigid", "--density", 0, "--modes", 4)
    check("a branch becomes unstable", "unstable   branch" in run.stdout and run.stdout.count("unstable") == 1, run.stdout)
    # The onset in closed form: omega (1 + resting/(rotating k)) of k = 48 E I/l^3 and 40 kg.
    k = 48*2.1e11*math.pi*0.04**4/64
    onset = math.sqrt(k/40)*(1 + 100/(1e-4*k))*30/math.pi
    words = ("sweep", "rotor", "--vary", "speed=1000:9000:4", "--bearings", "rigid", "--density", 0, "--modes", 4, "--unit", "rpm")
    line = kschur(*words).stdout.splitlines()[-1].split()
    check("an onset", line[:4] == ["unstable", "branch", "1", "from"] and abs(float(line[5])/onset - 1) < 1e-4 and line[6] == "rpm", line)
    onsets = json.loads(kschur(*words, "--format", "json").stdout)["onsets"]
    check("an onset in JSON", len(onsets) == 1 and onsets[0]["unstable"] and abs(onsets[0]["value"]/onset - 1) < 1e-4
          and onsets[0]["within"] < 1e-3*onset, onsets)
    points = json.loads(kschur("sweep", "rotor", "--vary", "speed=3000:4000:3", "--modes", 4, "--format", "json").stdout)["points"]
    for point in points:
        kschur("scene", "rotor", "--speed", point["speed"], "--output", folder + "/r.h5")
        alone = json.loads(kschur("solve", folder + "/r.h5", "--modes", 4, "--format", "json").stdout)
        together = sorted((point[f"eigenvalue_im_{i}"], point[f"eigenvalue_re_{i}"]) for i in range(1, 5))
        apart = sorted((mode["eigenvalue"][1], mode["eigenvalue"][0]) for mode in alone["modes"])
        check("as solved alone", np.allclose(together, apart, rtol=1e-8, atol=1e-8), (together, apart))


def test_pages_that_cannot_be_made(folder):
    """Tables and files are there all the same, and nothing else."""
    kschur("scene", "rotor", "--output", folder + "/rotor.h5")
    bare = {**os.environ, "KSCHUR_THREE": folder + "/nowhere.js"}
    for words in (("sweep", "rotor", "--vary", "speed=3000:4000:3", "--modes", "4"),
                  ("response", folder + "/rotor.h5", "--frequencies", "1:3:3", "--input", "1")):
        wanted, name = kschur(*words).stdout, words[0]
        before = {*os.listdir(folder), name + ".h5"}
        run = subprocess.run([KSCHUR, *words, "--html", f"{folder}/{name}.html", "--output", f"{folder}/{name}.h5"], capture_output=True,
                             text=True, env=bare)
        check(f"{name} without its page: says so", run.returncode == 4 and name + ".html" in run.stderr, run)
        check(f"{name} without its page: prints its table", run.stdout == wanted, run.stdout)
        check(f"{name} without its page: writes its file, and leaves no folder", set(os.listdir(folder)) == before, os.listdir(folder))


def test_pictures_of_a_scene(folder):
    run = subprocess.run([CAMPBELL, "rotor", "--vary", "speed=3000:4000:3", "--modes", "4", "--unit", "rpm", "--orders", "1,2", folder + "/o.png"],
                         capture_output=True, text=True)
    check("a picture with orders", run.returncode == 0 and os.path.getsize(folder + "/o.png") > 10000, run.stderr)
    run = subprocess.run([CAMPBELL, "rotor", "--vary", "speed=3000:4000:3", "--modes", "4", "--orders", "1,2", folder + "/p.png"],
                         capture_output=True, text=True)
    check("orders want a unit", run.returncode == 1 and "--unit rpm" in run.stderr and not os.path.exists(folder + "/p.png"), run.stderr)
    run = subprocess.run([CAMPBELL, "rotor", "--vary", "speed=3000:4000:3", "--modes", "4", folder + "/r.png"],
                         capture_output=True, text=True)
    check("a picture from one command", run.returncode == 0 and os.path.getsize(folder + "/r.png") > 10000, run.stderr)


def main():
    # An interpreter does not load a library with sanitizers.
    pictures = () if "--without-picture" in sys.argv else (test_pictures_of_files, test_pictures_of_a_scene)
    for test in (test_normalisation, test_properties, test_directions_of_a_mesh, test_mac, test_sensitivity, test_response,
                 test_sweep_of_files, test_sweep_of_a_scene, test_pages_that_cannot_be_made, *pictures):
        with tempfile.TemporaryDirectory() as folder:
            test(folder)
    finish()


main()
