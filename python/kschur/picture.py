"""Several modes of a result in one picture."""
from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

from . import table
from .result import Result

VIEW = (-60.0, 30.0)


def draw(result: Result, modes: list[int], **options: Any) -> Any:
    """A Matplotlib figure of modes, which count from 0; `options` are those of `Result.plot_shape`."""
    from matplotlib import pyplot as plt
    columns = min(len(modes), 3)
    rows = -(-len(modes) // columns)
    figure = plt.figure(figsize=(4 * columns, 3.4 * rows), layout="constrained")
    for place, mode in enumerate(modes, 1):
        ax = figure.add_subplot(rows, columns, place)
        result.plot_shape(mode, ax=ax, view=VIEW, **options)
        ax.set_axis_off()
        ax.set_title(f"mode {mode + 1}: {table.caption(result, mode)}", fontsize=9)
    return figure


def main(words: list[str]) -> None:
    """What kschur-picture does: words are a result, a picture, and numbers of modes from 1."""
    path, picture, *numbers = words
    try:
        import matplotlib
        matplotlib.use("Agg")
        figure = draw(Result.read(path), [int(number) - 1 for number in numbers])
        # It appears under its name when it is whole.
        place = Path(picture).absolute()
        with tempfile.TemporaryDirectory(dir=place.parent, prefix=f"{place.name}.partial-") as staging:
            whole = Path(staging, place.name)
            figure.savefig(whole, dpi=150, bbox_inches="tight", pad_inches=0.1)
            whole.replace(place)
    except Exception as error:
        sys.exit(f"kschur-picture: {error}")
