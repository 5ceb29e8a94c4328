"""The .vtu files of the examples: test_pictures.py EXAMPLE_CRANK EXAMPLE_GRID EXAMPLE_TURBINE."""
import pathlib
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree

import numpy as np

from checks import check, finish


def read(path):
    """Points, cells as lists, types and point data of an unstructured grid in ASCII."""
    piece = ElementTree.parse(path).getroot().find("UnstructuredGrid").find("Piece")

    def numbers(array):
        values = np.array(array.text.split(), dtype=float)
        return values.reshape(-1, int(array.get("NumberOfComponents", 1))).squeeze()

    cells = {array.get("Name"): numbers(array).astype(int) for array in piece.find("Cells")}
    points = numbers(piece.find("Points")[0])
    check(f"{path.name}: counts", len(points) == int(piece.get("NumberOfPoints"))
          and len(cells["types"]) == len(cells["offsets"]) == int(piece.get("NumberOfCells"))
          and cells["offsets"][-1] == len(cells["connectivity"]) and cells["connectivity"].max() == len(points) - 1)
    corners = np.split(cells["connectivity"], cells["offsets"][:-1])
    return points, corners, cells["types"], {array.get("Name"): numbers(array) for array in piece.find("PointData")}


with tempfile.TemporaryDirectory() as folder:
    path = pathlib.Path(folder) / "crank.vtu"
    subprocess.run([sys.argv[1], "2", str(path)], check=True, capture_output=True)
    points, cells, types, data = read(path)
    check("crank: tetrahedra", (types == 10).all() and all(len(cell) == 4 for cell in cells))
    edges = np.array([points[cell[1:]] - points[cell[0]] for cell in cells])
    volumes = np.linalg.det(edges) / 6
    check("crank: volume", (volumes > 0).all() and np.isclose(volumes.sum(), (5 * 2 + 15 + 3 * 3 * 2) * 0.02**3), volumes.sum())
    check("crank: modes", set(data) == {f"mode_{k}_{part}" for k in range(1, 6) for part in ("real", "imaginary")}, set(data))
    check("crank: largest displacement 1", np.isclose(np.linalg.norm(data["mode_3_real"], axis=1).max(), 1))
    # The first is the motion of the mechanism, which strains no cell.
    ends = np.array([[cell[0], cell[1]] for cell in cells])
    side, motion = points[ends[:, 1]] - points[ends[:, 0]], data["mode_1_real"]
    stretch = (side * (motion[ends[:, 1]] - motion[ends[:, 0]])).sum(1) / (side**2).sum(1)
    check("crank: a rigid motion", np.abs(stretch).max() < 1e-8, np.abs(stretch).max())

    path = pathlib.Path(folder) / "grid.vtu"
    subprocess.run([sys.argv[2], "3x2", str(path)], check=True, capture_output=True)
    points, cells, types, data = read(path)
    length = sum(np.linalg.norm(points[b] - points[a]) for a, b in cells)
    check("grid: length of the beams", (types == 3).all() and np.isclose(length, 3 * 3 + 4 * 2), length)

    path = pathlib.Path(folder) / "turbine.vtu"
    subprocess.run([sys.argv[3], "1", str(path)], check=True, capture_output=True)
    points, cells, types, data = read(path)
    check("turbine: blades and tower", np.isclose(np.linalg.norm(points[-1] - points[-49]), 61.5), points[-1])
    hub = points[21]
    check("turbine: hub height", np.isclose(hub[2], 90, atol=1e-3) and np.isclose(hub[0], -5.0, atol=1e-3), hub)
    reach = [np.linalg.norm(points[k] - hub) for k in (-1, -50, -99)]
    check("turbine: three blades", np.allclose(reach, 63), reach)
    run = subprocess.run([sys.argv[3], "1", f"{folder}/nowhere/turbine.vtu"], capture_output=True, text=True)
    check("a file that cannot be written is an error", run.returncode != 0 and "nowhere" in run.stderr, run.stderr)

finish()
