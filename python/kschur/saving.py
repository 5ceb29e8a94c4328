"""Figures of Matplotlib as files."""
from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from .errors import FileError


def check_ending(path: Any) -> None:
    """Raises FileError where it is that of no format."""
    from matplotlib.backend_bases import FigureCanvasBase

    known = FigureCanvasBase.filetypes
    if Path(path).suffix[1:].lower() not in known:
        raise FileError(f"{path}: a picture ends in .png, .pdf, .svg, or in one of {', '.join(sorted(known.keys() - {'png', 'pdf', 'svg'}))}")


def save_figure(figure: Any, path: Any, **options: Any) -> None:
    """Writes it in the format of the ending of the path; it appears under its name when it is whole. Raises FileError."""
    check_ending(path)
    place = Path(path).absolute()
    with tempfile.TemporaryDirectory(dir=place.parent, prefix=f"{place.name}.partial-") as staging:
        whole = Path(staging, place.name)
        figure.savefig(whole, **options)
        whole.replace(place)
