"""Where unknowns stand, and the pictures of shapes."""
import matplotlib
import numpy as np
import pytest
import scipy.sparse as sparse
from test_solve import chain

import kschur
from kschur.errors import InputError

matplotlib.use("Agg")


def test_maps_and_lines_of_nodes_in_order():
    geometry = kschur.solve(*chain(12), modes=1, geometry=kschur.Geometry(np.arange(4.0)[:, None])).geometry
    assert geometry.coordinates.shape == (4, 3)
    assert geometry.unknown_node.tolist() == [0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3]
    assert geometry.unknown_component.tolist() == [0, 1, 2] * 4
    assert geometry.lines().tolist() == [[0, 1], [1, 2], [2, 3]]
    moved = geometry.displacements(np.arange(12.0))
    assert moved.tolist() == np.arange(12.0).reshape(4, 3).tolist()


def test_unknowns_without_a_node_and_rotations_move_nothing():
    geometry = kschur.Geometry([[0, 0, 0], [1, 0, 0]], [0, 1, 1, -1], [2, 1, 4, 0])
    assert geometry.displacements(np.array([1.0, 2.0, 3.0, 4.0])).tolist() == [[0, 0, 1], [0, 2, 0]]
    solved = kschur.solve(sparse.identity(4), sparse.diags([1.0, 2.0, 3.0, 4.0]), modes=1, geometry=geometry).geometry
    assert solved.lines().shape == (0, 2) and solved.unknown_node.tolist() == [0, 1, 1, -1]


@pytest.mark.parametrize("arguments, words", [
    ((np.zeros((5, 3)),), "12 unknowns are not 1, 2, 3 or 6 for each of 5 nodes"),
    ((np.zeros((4, 4)),), "nodes x 3"), ((np.zeros((4, 3)), [0] * 12), "both or none"),
    ((np.zeros((4, 3)), [0] * 11, [0] * 12), "equally long"),
    ((np.zeros((4, 3)), [4] + [0] * 11, [0] * 12), r"node\[0\] is 4"),
    ((np.zeros((4, 3)), [0] * 12, [6] + [0] * 11), r"component\[0\] is 6")])
def test_what_does_not_fit(arguments, words):
    with pytest.raises(InputError, match=words):
        kschur.solve(*chain(12), modes=1, geometry=kschur.Geometry(*arguments))


def test_eliminated_unknowns_move(tmp_path):
    # Three nodes that move along z; the middle one was eliminated, half of its neighbours.
    T = sparse.csr_matrix([[1.0, 0.0], [0.5, 0.5], [0.0, 1.0]])
    M, K = np.diag([1.0, 2.0, 3.0]), np.array([[4.0, -1, 0], [-1, 3, -1], [0, -1, 2]])
    geometry = kschur.Geometry([[0, 0, 0], [1, 0, 0], [2, 0, 0]], cells={"line": [[0, 1], [1, 2]]}, transformation=T)
    result = kschur.solve(T.T @ M @ T, T.T @ K @ T, modes=2, geometry=geometry, properties=True)
    result.save(tmp_path / "modes.h5")
    for again in (result, kschur.load(tmp_path / "modes.h5")):
        moved = again.geometry.displacements(again.shapes[:, 1])[:, 2]
        assert np.array_equal(moved[[0, 2]], again.shapes[:, 1]) and moved[1] == moved[[0, 2]].mean()
        assert again.geometry.transformation.toarray().tolist() == T.toarray().tolist()
    # All of it moves along z by 1: 6 kg.
    assert result.total_mass[list(result.directions).index("z")] == pytest.approx(6.0)
    with pytest.raises(InputError, match="column for each of 3 unknowns"):
        kschur.solve(M, K, modes=1, geometry=geometry)


def test_cells(tmp_path):
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0]])
    geometry = kschur.Geometry(corners, cells={"quad": [[0, 1, 2, 3]], "triangle": [[1, 4, 5]]})
    result = kschur.solve(*chain(18), modes=1, geometry=geometry)
    wanted = [[0, 1], [0, 3], [1, 2], [1, 4], [1, 5], [2, 3], [4, 5]]
    assert geometry.lines().tolist() == result.geometry.lines().tolist() == wanted
    result.save(tmp_path / "modes.h5")
    again = kschur.load(tmp_path / "modes.h5").geometry
    assert again.lines().tolist() == wanted and np.array_equal(again.coordinates, corners)
    with pytest.raises(InputError, match="no kind of cell 'cube'"):
        kschur.Geometry(corners, cells={"cube": [[0, 1]]})
    with pytest.raises(InputError, match=r"node\[1\] is 6"):
        kschur.solve(*chain(18), modes=1, geometry=kschur.Geometry(corners, cells={"line": [[0, 6]]}))


def test_only_the_surface_of_solids_is_drawn():
    # A cube of eight hexahedra: its 26 outer nodes, 24 outer faces and 48 edges; each split in six tetrahedra as well.
    z, y, x = np.mgrid[:3, :3, :3]
    points = np.column_stack([part.ravel() for part in (x, y, z)])
    corner = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
    cubes = np.array([[(p[0] + i) + 3 * (p[1] + j) + 9 * (p[2] + k) for p in corner] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    solid = kschur.Geometry(points, cells={"hexahedron": cubes})
    assert [face.shape for face in solid.faces()] == [(24, 4)] and solid.lines().shape == (48, 2) and 13 not in solid.lines()
    tetrahedra = np.vstack([cubes[:, [0, 6, a, b]] for a, b in ((1, 2), (2, 3), (3, 7), (7, 4), (4, 5), (5, 1))])
    assert [face.shape for face in kschur.Geometry(points, cells={"tetra": tetrahedra}).faces()] == [(48, 3)]


def test_picture():
    # The first mode of a string is a half sine, drawn in the plane of x and z.
    n = 39
    result = kschur.solve(*chain(n), modes=2, geometry=kschur.Geometry(np.arange(1.0, n + 1)[:, None]))
    ax = result.plot_shape(0, scale=3.0)
    drawn = np.array(ax.collections[1].get_segments())
    assert ax.name == "rectilinear" and drawn.shape == (n - 1, 2, 2)
    sine = np.sin(np.arange(1, n + 1) * np.pi / (n + 1))
    assert np.allclose(drawn[:, 0, 1], 3 * (sine / np.linalg.norm(sine))[:-1], atol=1e-10)
    assert ax.get_title() == f"{result.frequency_hz[0]:.5g} Hz"
    quarter = np.array(result.plot_shape(0, scale=3.0, phase=np.pi / 2).collections[1].get_segments())
    assert np.allclose(quarter[:, :, 1], 0, atol=1e-10)
    with pytest.raises(InputError, match="geometry"):
        kschur.solve(*chain(n), modes=1).plot_shape()


def test_picture_in_space():
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    result = kschur.solve(*chain(12), modes=2, geometry=kschur.Geometry(corners))
    assert result.plot_shape(1).name == "3d"
    # Along y: x goes to the right and z up.
    seen = result.plot_shape(1, scale=1e-9, view=(-90, 0))
    assert seen.name == "rectilinear"
    rest = np.array(seen.collections[0].get_segments()).reshape(-1, 2)
    assert {tuple(point) for point in rest.round(9)} == {(0, 0), (1, 0), (0, 1)}
