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
    M, K = chain(12)
    geometry = kschur.Geometry(np.arange(4.0)[:, None]).completed(K)
    assert geometry.coordinates.shape == (4, 3)
    assert geometry.unknown_node.tolist() == [0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3]
    assert geometry.unknown_component.tolist() == [0, 1, 2] * 4
    assert geometry.lines.tolist() == [[0, 1], [1, 2], [2, 3]]
    moved = geometry.displacements(np.arange(12.0))
    assert moved.tolist() == np.arange(12.0).reshape(4, 3).tolist()


def test_unknowns_without_a_node_and_rotations_move_nothing():
    geometry = kschur.Geometry([[0, 0, 0], [1, 0, 0]], [0, 1, 1, -1], [2, 1, 4, 0]).completed(sparse.identity(4))
    assert geometry.displacements(np.array([1.0, 2.0, 3.0, 4.0])).tolist() == [[0, 0, 1], [0, 2, 0]]
    assert geometry.lines.shape == (0, 2)


@pytest.mark.parametrize("arguments, words", [
    ((np.zeros((5, 3)),), "12 unknowns are not 1, 2, 3 or 6 for each of the 5 nodes"),
    ((np.zeros((4, 4)),), "nodes x 3"), ((np.zeros((4, 3)), [0] * 12), "both or none"),
    ((np.zeros((4, 3)), [0] * 11, [0] * 12), "each of the 12 unknowns"),
    ((np.zeros((4, 3)), [4] + [0] * 11, [0] * 12), "unknown_node holds 4"),
    ((np.zeros((4, 3)), [0] * 12, [6] + [0] * 11), "unknown_component holds 6")])
def test_what_does_not_fit(arguments, words):
    with pytest.raises(InputError, match=words):
        kschur.solve(*chain(12), modes=1, geometry=kschur.Geometry(*arguments))


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
    assert not result.plot_shape(0, phase=np.pi / 2).collections[1].get_array().max() > 1e-12
    with pytest.raises(InputError, match="geometry"):
        kschur.solve(*chain(n), modes=1).plot_shape()


def test_picture_in_space():
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    result = kschur.solve(*chain(12), modes=2, geometry=kschur.Geometry(corners))
    assert result.plot_shape(1).name == "3d"
