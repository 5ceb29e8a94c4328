"""Where problems stand in space, and the files of kschur view, opened by meshio: test_view.py KSCHUR [--without-picture].

An interpreter does not load a library with sanitizers: no picture then.
"""
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import h5py
import matplotlib.image
import meshio
import numpy as np
import scipy.sparse as sparse

from checks import check, finish

PROGRAM = sys.argv[1]


def run(*words):
    return subprocess.run([PROGRAM, *map(str, words)], capture_output=True, text=True)


def lattice(seed=0):
    """A square lattice of 4 x 3 nodes, in its plane and across it, its unknowns in any order, one of them of no node."""
    draw = np.random.default_rng(seed)
    places = np.array([(x, y, 0) for y in range(3) for x in range(4)], float)
    node, component = (part.ravel() for part in np.mgrid[:12, :3])
    order = draw.permutation(37)
    node, component = np.append(node, -1)[order], np.append(component, 0)[order]
    where = {(a, c): k for k, (a, c) in enumerate(zip(node, component))}
    stiffness = sparse.lil_matrix((37, 37))
    neighbours = [(a, a + 1) for a in range(12) if a % 4 < 3] + [(a, a + 4) for a in range(8)]
    for a, b in neighbours:
        for c in range(3):
            i, j, k = where[a, c], where[b, c], draw.uniform(1, 2)
            for row, column, value in ((i, i, k), (j, j, k), (i, j, -k), (j, i, -k)):
                stiffness[row, column] += value
    stiffness += 0.1 * sparse.identity(37)
    damping = sparse.diags(draw.uniform(0, 0.2, 37))
    return {"mass": sparse.identity(37, format="csr"), "stiffness": stiffness.tocsr(), "damping": damping.tocsr()}, \
        {"coordinates": places, "unknown_node": node, "unknown_component": component}, neighbours


def write(path, matrices, mesh):
    with h5py.File(path, "w") as file:
        for name, matrix in matrices.items():
            group = file.create_group(name)
            group.attrs["shape"] = matrix.shape
            for part in ("indptr", "indices", "data"):
                group[part] = getattr(matrix, part)
        for name, array in mesh.items():
            file[name] = array
    return path


def displacements(mesh, shape):
    moved = np.zeros((len(mesh["coordinates"]), 3), complex)
    there = (np.array(mesh["unknown_node"]) >= 0) & (np.array(mesh["unknown_component"]) < 3)
    moved[mesh["unknown_node"][there], mesh["unknown_component"][there]] = shape[there]
    return moved / np.sqrt((abs(moved)**2).sum(1).max())


def series(path):
    collection = ElementTree.parse(path).getroot().find("Collection")
    return [(float(item.get("timestep")), item.get("file")) for item in collection]


def slab():
    """The lattice with cells, two slaves in it, the constraints that tie them, and the T that eliminates them."""
    matrices, mesh, neighbours = lattice()
    n = len(mesh["unknown_node"])
    where = {(a, c): k for k, (a, c) in enumerate(zip(mesh["unknown_node"], mesh["unknown_component"]))}
    # Nodes 8 to 11 stand in a row; they follow the two ends of it, across it alone.
    slaves = {where[a, 2]: {where[8, 2]: 1 - (a - 8)/3, where[11, 2]: (a - 8)/3} for a in (9, 10)}
    kept = [k for k in range(n) if k not in slaves]
    transformation, rows = sparse.lil_matrix((n, len(kept))), sparse.lil_matrix((2, n))
    for column, k in enumerate(kept):
        transformation[k, column] = 1
    for row, (slave, masters) in enumerate(slaves.items()):
        rows[row, slave] = -1
        for k, share in masters.items():
            transformation[slave, kept.index(k)] = rows[row, k] = share
    T = transformation.tocsr()
    cells = {"cells/types": np.full(len(neighbours), 3), "cells/offsets": np.arange(0, 2*len(neighbours) + 1, 2),
             "cells/connectivity": np.ravel(neighbours)}
    return matrices, mesh | cells, rows.tocsr(), T


def test_eliminated_unknowns(folder):
    """Slaves of a rigid slab: eliminated by hand, they move in pictures as those that constraints tie."""
    matrices, mesh, rows, T = slab()
    n = T.shape[0]
    tied = write(folder/"tied.h5", matrices | {"constraints": rows}, mesh)
    reduced = write(folder/"reduced.h5", {name: (T.T @ matrix @ T).tocsr() for name, matrix in matrices.items()} | {"transformation": T},
                    mesh)
    pictures = []
    for problem in (tied, reduced):
        result, view = problem.with_suffix(".modes.h5"), problem.with_suffix(".view")
        done = run("solve", problem, "--modes", 3, "--properties", "--format", "json", "--output", result)
        check("eliminated: is solved", done.returncode == 0, done)
        check("eliminated: is drawn", run("view", result, "--output", view, "--frames", 0).returncode == 0)
        shapes = meshio.read(view/"mode_2.vtu").point_data
        pictures.append(shapes["mode_2_real"] + 1j*shapes["mode_2_imaginary"])
    # Phases are those of the largest unknown, which is the same here.
    check("eliminated: the same picture", np.abs(pictures[0][[9, 10]]).max() > 1e-3 and np.abs(pictures[0] - pictures[1]).max() < 1e-8,
          pictures)
    with h5py.File(reduced.with_suffix(".modes.h5")) as file:
        check("eliminated: the result keeps it", tuple(file["transformation"].attrs["shape"]) == T.shape
              and np.array_equal(file["transformation/data"][:], T.data))
    for name, damage, words in (
            ("columns", {"transformation": sparse.identity(n, format="csr")}, f"must have a column for each of {n - 2} unknowns"),
            ("finite", {"transformation": T*np.inf}, "not a finite number")):
        done = run("info", write(folder/f"{name}.h5", {key: (T.T @ matrix @ T).tocsr() for key, matrix in matrices.items()} | damage, mesh))
        check(f"eliminated: {name}", done.returncode == 2 and words in done.stderr, done)
    bare = write(folder/"bare.h5", {key: (T.T @ matrix @ T).tocsr() for key, matrix in matrices.items()} | {"transformation": T},
                 {name: array for name, array in mesh.items() if not name.startswith("cells")})
    done = run("info", bare)
    check("eliminated: without cells", done.returncode == 2 and "cells must be given" in done.stderr, done)


def test_points_of_a_sweep(folder):
    """A sweep with shapes keeps the geometry, T included: a point of it is drawn as the result of a solve there."""
    matrices, mesh, _, T = slab()
    problems = [write(folder/f"{k}.h5", {"mass": (T.T @ matrices["mass"] @ T).tocsr(), "transformation": T,
                                         "stiffness": (T.T @ (k*matrices["stiffness"]) @ T).tocsr()}, mesh) for k in (1, 2)]
    swept, result = folder/"sweep.h5", folder/"modes.h5"
    done = run("sweep", *problems, "--modes", 5, "--shapes", "--output", swept)
    check("points: a sweep", done.returncode == 0, done)
    run("solve", problems[1], "--modes", 5, "--output", result)
    with h5py.File(swept) as file, h5py.File(result) as alone:
        check("points: each is a result", list(file["points"]) == ["1", "2"] and set(file["points/2"]) == set(alone)
              and set(file["points/2"].attrs) == set(alone.attrs))
        check("points: with the geometry", all(np.array_equal(file["points/2"][name][:], alone[name][:]) for name in (
            "coordinates", "unknown_node", "unknown_component", "cells/types", "cells/connectivity", "transformation/data")))
    for path, *point in (result,), (swept, "--point", 2):
        done = run("view", path, *point, "--output", folder/f"view{len(point)}", "--frames", 0)
        check("points: are drawn", done.returncode == 0 and "5 modes on 12 nodes" in done.stdout, done)
    one, other = (meshio.read(folder/f"view{k}/mode_5.vtu").point_data["mode_5_real"] for k in (0, 2))
    check("points: the same picture, slaves move", np.allclose(one, other, atol=1e-8) and np.abs(one[[9, 10]]).max() > 1e-3,
          (one, other))
    plain = folder/"plain.h5"
    run("sweep", *problems, "--modes", 3, "--output", plain)
    with h5py.File(plain) as file:
        check("points: not without being asked for", "points" not in file)
    with h5py.File(folder/"damaged.h5", "w") as file, h5py.File(swept) as whole:
        file.attrs["kschur_sweep"], file["values"] = "0.2.0", whole["values"][:]
        whole.copy("points", file)
        del file["points/2/transformation/data"], file["points/1"]
        file["points/1"] = [1.0]
    before = sorted(folder.iterdir())
    for status, words, path, *point in (
            (2, "the modes of point 1 are not in it: kschur sweep --shapes", plain, "--point", 1),
            (2, "no point 3: the sweep has points 1 to 2", swept, "--point", 3), (2, "not a sweep", result, "--point", 1),
            (2, "a sweep, not a result: kschur view --point", swept), (1, "at least 1", swept, "--point", 0),
            (2, "point 2: the mesh: the transformation: there is no dataset", folder/"damaged.h5", "--point", 2),
            (2, "/points/1 is not a group", folder/"damaged.h5", "--point", 1)):
        done = run("view", path, *point, "--output", folder/"none", "--frames", 0)
        check(f"points: {words}", done.returncode == status and words in done.stderr and done.stderr.count("\n") == 1, done)
    done = run("sweep", *problems, "--shapes")
    check("points: shapes want a file", done.returncode == 1 and "--output" in done.stderr, done)
    check("points: nothing is left", sorted(folder.iterdir()) == before)


def test_own_model(folder):
    matrices, mesh, neighbours = lattice()
    result = folder/"modes.h5"
    check("own model: is solved", run("solve", write(folder/"own.h5", matrices, mesh), "--modes", 5, "--output", result).returncode == 0)
    done = run("view", result, "--output", folder/"view", "--modes", "2,5", "--frames", 8, "--amplitude", 0.25)
    check("own model: is viewed", done.returncode == 0 and "2 modes on 12 nodes" in done.stdout, done)
    names = {f"mode_{k}{end}" for k in (2, 5) for end in (".vtu", ".pvd", *(f"_{i}.vtu" for i in range(1, 9)))}
    check("own model: the files", {path.name for path in (folder/"view").iterdir()} == names | {"modes.pvd"})
    check("own model: the series of modes", series(folder/"view/modes.pvd") == [(2, "mode_2.vtu"), (5, "mode_5.vtu")])
    with h5py.File(result) as file:
        shapes = file["eigenvectors"][:]
    for k in (2, 5):
        grid = meshio.read(folder/f"view/mode_{k}.vtu")
        check("own model: points", np.array_equal(grid.points, mesh["coordinates"]))
        check("own model: lines where the stiffness joins nodes", {tuple(line) for line in grid.cells_dict["line"].tolist()} == set(neighbours))
        wanted = displacements(mesh, shapes[k - 1])
        found = grid.point_data[f"mode_{k}_real"] + 1j * grid.point_data[f"mode_{k}_imaginary"]
        check("own model: the shape is complex, and that of the result", np.allclose(found, wanted, atol=1e-14) and abs(wanted.imag).max() > 1e-3)
        frames = series(folder/f"view/mode_{k}.pvd")
        check("own model: times of a period", np.allclose([time for time, _ in frames], np.arange(8) / 8))
        size = np.hypot(3, 2)
        for time, name in frames:
            grid = meshio.read(folder/"view"/name)
            moved = 0.25 * size * (np.exp(2j * np.pi * time) * wanted).real
            check(f"own model: {name}", np.allclose(grid.points, mesh["coordinates"] + moved, atol=1e-13)
                  and np.allclose(grid.point_data["displacement"], moved, atol=1e-13))


def test_picture(folder):
    matrices, mesh, _ = lattice()
    result, picture = folder/"modes.h5", folder/"it's modes.png"
    run("solve", write(folder/"damped.h5", matrices, mesh), "--modes", 5, "--output", result)
    done = run("view", result, "--picture", picture, "--modes", "1,2,5")
    pixels = matplotlib.image.imread(picture)
    dark = np.array([[pane.mean() for pane in np.array_split(row, 2, axis=1)] for row in np.array_split(pixels[:, :-200, :3].sum(2) < 2, 2)])
    check("picture: three modes, two views of the one that whirls, in a square", done.returncode == 0 and (dark > 0.002).all(), dark)
    run("sweep", folder/"damped.h5", folder/"damped.h5", "--modes", 5, "--shapes", "--output", folder/"sweep.h5")
    before = sorted(folder.iterdir())
    done = run("view", folder/"sweep.h5", "--point", 2, "--picture", picture, "--modes", "1,2,5")
    check("picture: of a point of a sweep", done.returncode == 0 and "3 modes" in done.stdout and sorted(folder.iterdir()) == before,
          done)
    del matrices["damping"]
    run("solve", write(folder/"own.h5", matrices, mesh), "--modes", 5, "--output", result)
    done = run("view", result, "--picture", picture, "--modes", "1,2,5")
    check("picture: is drawn", done.returncode == 0 and "3 modes" in done.stdout and done.stderr == "", done)
    pixels = matplotlib.image.imread(picture)
    dark = np.array([part.mean() for part in np.array_split(pixels[:, :, :3].sum(2) < 2, 3, axis=1)])
    check("picture: three modes side by side", pixels.shape[1] > max(1500, 2*pixels.shape[0]) and (dark > 0.005).all(), (pixels.shape, dark))
    done = run("view", result, "--picture", folder/"modes.nonsense")
    check("picture: an ending that is none", done.returncode == 1 and "nonsense" in done.stderr
          and not list(folder.glob("*nonsense*")) and not list(folder.glob(".*")), done)
    done = run("view", result, "--picture", folder/"modes.gif")
    check("picture: what moves is no picture", done.returncode == 1 and ".png, .pdf or .svg" in done.stderr and "--html" in done.stderr
          and done.stderr.count("\n") == 1, done)


def test_frames(folder):
    """More frames than a period may have are refused before anything is written, and so are more than the disk has room for."""
    matrices, mesh, _ = lattice()
    run("solve", write(folder/"own.h5", matrices, mesh), "--modes", 1, "--output", folder/"modes.h5")
    before = sorted(folder.iterdir())
    for frames in (10001, 1000000000, 2147483647):
        done = run("view", folder/"modes.h5", "--output", folder/"many", "--frames", frames)
        check(f"{frames} frames: are refused", done.returncode == 1 and f"from 0 to 10000 frames, not {frames}" in done.stderr, done)
    check("frames: nothing is left", sorted(folder.iterdir()) == before)


def test_cells_and_order(folder):
    matrices, _, _ = lattice()
    matrices = {name: matrix[:36, :36].tocsr() for name, matrix in matrices.items()}
    squares = [(a, a + 1, a + 5, a + 4) for a in (0, 1, 2, 4, 5, 6)]
    mesh = {"coordinates": lattice()[1]["coordinates"], "cells/types": [9] * 6, "cells/offsets": np.arange(0, 25, 4),
            "cells/connectivity": np.ravel(squares)}
    run("solve", write(folder/"own.h5", matrices, mesh), "--modes", 3, "--output", folder/"modes.h5")
    run("view", folder/"modes.h5", "--output", folder/"view", "--frames", 0)
    check("cells: no motion, no frames", len(list((folder/"view").iterdir())) == 4)
    grid = meshio.read(folder/"view/mode_1.vtu")
    check("cells: as given", grid.cells_dict["quad"].tolist() == [list(square) for square in squares])
    in_order = {"coordinates": mesh["coordinates"], "unknown_node": np.repeat(np.arange(12), 3), "unknown_component": np.tile(range(3), 12)}
    with h5py.File(folder/"modes.h5") as file:
        wanted = displacements(in_order, file["eigenvectors"][0])
        check("order: node after node", np.array_equal(file["unknown_node"][:], in_order["unknown_node"])
              and np.array_equal(file["unknown_component"][:], in_order["unknown_component"]))
    check("order: the shape", np.allclose(grid.point_data["mode_1_real"] + 1j * grid.point_data["mode_1_imaginary"], wanted, atol=1e-14))


def test_refusals(folder):
    matrices, mesh, _ = lattice()

    def refused(words, status=2, **change):
        changed = {name: array for name, array in {**mesh, **change}.items() if array is not None}
        done = run("solve", write(folder/"bad.h5", matrices, changed), "--modes", 1)
        check(f"refusal: {words}", done.returncode == status and words in done.stderr and "bad.h5" in done.stderr
              and done.stderr.count("\n") == 1, done)

    beyond = mesh["unknown_node"].copy()
    beyond[3] = 12
    twice = mesh["unknown_node"].copy()
    twice[:] = 0
    refused("/unknown_node holds 12", unknown_node=beyond)
    refused("two unknowns are component", unknown_node=twice)
    refused("/unknown_component holds 6", unknown_component=mesh["unknown_component"] + 4)
    refused("/coordinates is 12 x 2 but must have 3 columns", coordinates=mesh["coordinates"][:, :2])
    refused("not a finite number", coordinates=mesh["coordinates"] * np.nan)
    refused("one is missing", unknown_component=None)
    refused("37 unknowns are not 1, 2, 3 or 6 for each of 12 nodes", unknown_node=None, unknown_component=None)
    refused("/cells/connectivity holds 12", **{"cells/types": [3], "cells/offsets": [0, 2], "cells/connectivity": [0, 12]})
    refused("2 cells need 3 offsets, not 2", **{"cells/types": [3, 3], "cells/offsets": [0, 2], "cells/connectivity": [0, 1]})
    refused("must grow from 0", **{"cells/types": [3], "cells/offsets": [0, 3], "cells/connectivity": [0, 1]})
    run("solve", write(folder/"plain.h5", matrices, {}), "--modes", 1, "--output", folder/"plain_modes.h5")
    for words, status, message in ((("view", folder/"plain_modes.h5", "--output", folder/"v"), 2, "did not say where"),
                                   (("view", folder/"plain.h5", "--output", folder/"v"), 2, "not a result"),
                                   (("view", folder/"plain_modes.h5"), 1, "--output"),
                                   (("view", folder/"plain_modes.h5", "--output", folder/"v", "--modes", "2"), 1, "from 1 to 1")):
        done = run(*words)
        check(f"refusal: {message}", done.returncode == status and message in done.stderr and not (folder/"v").exists(), done)


def test_scenes(folder):
    """A translation of the mesh weighs what the scene weighs; a rotation of it strains nothing."""
    def rigid(file, axis, rotation):
        node, component, places = (file[name][:] for name in ("unknown_node", "unknown_component", "coordinates"))
        arms = np.cross(np.eye(3)[axis], places[node])
        turn = np.where(component < 3, arms[np.arange(len(node)), component % 3], component - 3 == axis)
        return turn if rotation else (component == axis).astype(float)

    def matrix(file, name):
        group = file[name]
        return sparse.csr_matrix((group["data"][:], group["indices"][:], group["indptr"][:]), tuple(group.attrs["shape"]))

    beams = (5 * 6 + 7 * 4) * 0.3 * 0.05 * 1000
    for scene, total in (("grid --cells 6x4", beams), ("crank", (5 * 2 + 15 + 3 * 3 * 2) * 0.02**3 * 7800)):
        run("scene", *scene.split(), "--output", folder/"scene.h5")
        with h5py.File(folder/"scene.h5") as file:
            mass, stiffness = matrix(file, "mass"), matrix(file, "stiffness")
            for axis in range(3):
                found = rigid(file, axis, False) @ mass @ rigid(file, axis, False)
                check(f"{scene}: mass along {'xyz'[axis]}", np.isclose(found, total, rtol=1e-10), (found, total))
                turn = rigid(file, axis, True)
                check(f"{scene}: a rotation is free", abs(stiffness @ turn).max() < 1e-9 * abs(stiffness).max() * abs(turn).max())
                if "constraints" in file and scene != "crank":
                    check(f"{scene}: a rotation keeps the ties", abs(matrix(file, "constraints") @ turn).max() < 1e-9)


tests = [test_own_model, test_eliminated_unknowns, test_points_of_a_sweep, test_frames, test_cells_and_order, test_refusals,
         test_scenes]
if "--without-picture" not in sys.argv:
    tests.append(test_picture)
for test in tests:
    with tempfile.TemporaryDirectory() as name:
        test(Path(name))
finish()
