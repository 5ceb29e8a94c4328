"""Pictures of several modes: what stands in them, where, and that it can be read."""
import itertools

import matplotlib
import numpy as np
import pytest
from test_solve import chain

import kschur
from kschur.errors import FileError
from kschur.marks import round_length
from kschur.picture import axis_of_whirl, columns_that_fill, draw
from kschur.saving import save_figure

matplotlib.use("Agg")


def whirling(nodes=9, slender=1.0):
    """A string of masses along x that turns: gyroscopic terms between y and z, whose modes whirl about x."""
    M, K = np.eye(3 * nodes), np.kron(chain(nodes)[1].toarray(), np.diag([9.0, 1, 1])) + 0.05 * np.eye(3 * nodes)
    R = np.kron(np.eye(nodes), [[0, 0, 0], [0, 0, 0.3], [0, -0.3, 0]])
    return kschur.solve(M, K, R, modes=3, geometry=kschur.Geometry(slender * np.arange(nodes)[:, None]))


def boxes(figure):
    """Of all titles and of all axes, in pixels."""
    figure.canvas.draw()
    return [ax.title.get_window_extent() for ax in figure.axes if ax.get_title()], [ax.get_window_extent() for ax in figure.axes]


@pytest.mark.parametrize("slender, count", [(1.0, 1), (1.0, 3), (0.01, 3), (100.0, 3)])
def test_words_can_be_read(slender, count):
    figure = draw(whirling(slender=slender), list(range(count)))
    titles, axes = boxes(figure)
    page = figure.bbox
    assert len(titles) == 2 * count and all(page.x0 <= box.x0 and box.x1 <= page.x1 and box.y1 <= page.y1 for box in titles)
    assert not any(first.overlaps(second) for first, second in itertools.combinations(titles, 2))
    assert not any(first.overlaps(second) for first, second in itertools.combinations(axes, 2))


def test_a_whirl_has_two_views_with_axes_scale_and_key():
    result = whirling()
    figure = draw(result, [0, 1])
    titles = [ax.get_title() for ax in figure.axes]
    assert [title[:6] for title in titles[::2][:2]] == ["mode 1", "mode 2"] and titles[1:4:2] == [f"mode {k} along the axis of its whirl" for k in (1, 2)]
    assert figure.axes[-1].get_ylabel() == "displacement, largest 1" and len(figure.axes) == 5
    along = figure.axes[1]
    names = {text.get_text() for text in along.findobj(matplotlib.text.Text)}
    assert {"y", "z"} <= names and "x" not in names and {"x", "y", "z"} <= {text.get_text() for text in figure.axes[0].findobj(matplotlib.text.Text)}
    length = round_length(np.ptp(along.get_xlim()) / 3)
    assert f"{length:g}" in names
    # Seen along x every node runs in a circle.
    paths = next(part for part in along.collections if len(part.get_segments()[0]) == 49)
    for path in map(np.array, paths.get_segments()):
        radius = np.linalg.norm(path, axis=1)
        assert np.ptp(radius) < 1e-6 * radius.max() + 1e-9


def test_a_mode_that_goes_to_and_fro_has_one_view():
    result = kschur.solve(*chain(12), modes=2, geometry=kschur.Geometry([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]))
    figure = draw(result, [0, 1])
    assert [ax.get_title()[:6] for ax in figure.axes] == ["mode 1", "mode 2", ""]


def test_axis_of_whirl():
    n = np.array([2.0, -1, 2]) / 3
    u, v = np.array([1.0, 2, 0]) / 5**0.5, np.cross(n, np.array([1.0, 2, 0]) / 5**0.5)
    radii = np.array([0.2, 1, 0.7])[:, None]
    assert np.allclose(axis_of_whirl(radii * (u - 1j * v)), n)
    assert np.allclose(axis_of_whirl(radii * (u + 1j * v)), -n)
    assert axis_of_whirl(radii * (1 + 1j) * u) is None and axis_of_whirl(radii * (u - 0.05j * v)) is None
    # Halves that turn against each other.
    assert abs(abs(axis_of_whirl(np.array([u - 1j * v, u + 1j * v])) @ n) - 1) < 1e-12


def test_grids_fill_the_page():
    for count, aspect in itertools.product(range(1, 26), (0.7, 1.0, 2.0, 2.6)):
        columns = columns_that_fill(count, aspect)
        rows = -(-count // columns)
        assert count / (rows * columns) >= 0.75
        if count > 3:
            assert 0.45 < columns * aspect / rows < 4
    assert columns_that_fill(4, 1.5) == 2 and columns_that_fill(12, 1.0) == 4
    assert [round_length(most) for most in (1.0, 1.99, 2, 7, 0.05, 0.06, 300)] == [1, 1, 2, 5, 0.05, 0.05, 200]


def test_formats(tmp_path):
    figure = draw(whirling(), [0])
    with pytest.raises(FileError, match=r"\.png, \.pdf, \.svg"):
        save_figure(figure, tmp_path / "modes.mp4")
    assert not list(tmp_path.iterdir())
    save_figure(figure, tmp_path / "modes.svg")
    assert "<svg" in (tmp_path / "modes.svg").read_text()
