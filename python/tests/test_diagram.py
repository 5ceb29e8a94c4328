"""Campbell diagrams: what is red, what can be told apart, and that all words are within the figure."""
import matplotlib
import numpy as np
from matplotlib.colors import to_rgba
from test_sweeping import jeffcott

import kschur
from kschur.diagram import draw

matplotlib.use("Agg")


def many(speed):
    """25 oscillators, half of which get stiffer with the speed."""
    n = np.arange(1, 26)
    return np.eye(25), np.diag((20.0 * n)**2 + (n % 2) * (3.0 * speed)**2), 0.1 * np.eye(25)


def test_25_branches_are_told_apart_and_listed_within_the_figure():
    figure = draw(kschur.sweep(many, np.linspace(0, 10, 5), modes=25, unit="Hz"), orders=[1, 2, 6])
    figure.canvas.draw()
    ax = figure.axes[0]
    drawn = [(line.get_color(), line.get_linestyle(), line.get_marker()) for line in ax.get_legend().get_lines()]
    assert len(set(drawn)) == 25
    box, page = ax.get_legend().get_window_extent(), figure.bbox
    assert page.x0 <= box.x0 and box.x1 <= page.x1 and page.y0 <= box.y0 and box.y1 <= page.y1
    assert not any(box.overlaps(other.get_window_extent()) for other in figure.axes)
    orders = [text for text in ax.texts if text.get_text().endswith("P")]
    frame = ax.get_window_extent()
    assert [text.get_text() for text in orders] == ["1P", "2P", "6P"]
    for text in orders:
        place = text.get_window_extent()
        assert frame.x0 <= place.x0 and place.x1 <= frame.x1 and frame.y0 <= place.y0 and place.y1 <= frame.y1


def test_red_is_what_is_unstable():
    for values, unstable in ((np.linspace(5, 80, 4), True), (np.linspace(80, 5, 4), False)):
        swept = kschur.sweep(jeffcott, values, modes=3)
        ax = swept.campbell()
        red = [line for line in ax.lines if to_rgba(line.get_color()) == to_rgba("red")]
        crosses = np.concatenate([line.get_xdata() for line in red if line.get_marker() == "x"])
        assert set(crosses) == {value for value, row in zip(values, swept.eigenvalues) if (row.real > 1e-9).any()}
        triangle = [line for line in ax.lines if line.get_marker() in "^v"]
        assert len(triangle) == 1 and (triangle[0] in red) == unstable
        assert [text.get_color() for text in ax.texts] == ["red" if unstable else "green"]
