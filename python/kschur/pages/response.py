"""A response as a page: Bode and Nyquist plots of some unknowns, and operating deflection shapes where they stand in space."""
from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..geometry import Geometry
from .page import Page, rounded
from .space import STEPS, Space

# Displacements on a page: nodes times shapes.
MOST_DISPLACEMENTS = 2_000_000


class ResponsePage(Page):
    """A page of x, frequencies x n, at some unknowns, counted from 0, with shapes of all of it on a geometry."""

    def __init__(self, frequency_hz: NDArray[np.float64], x: NDArray[np.complex128], unknowns: Any,
                 geometry: Geometry | None = None) -> None:
        unknowns = [range(x.shape[1])[unknown] for unknown in unknowns]
        blocks: dict[str, str] = {}
        box = None
        shapes: list[dict[str, float] | None] = [None] * len(frequency_hz)
        if geometry is not None:
            space = Space(geometry)
            for number, place in enumerate(_shaped(x, MOST_DISPLACEMENTS // len(geometry.coordinates))):
                shapes[place] = {"number": number, "largest": space.add(number, x[place])}
            blocks, box = space.blocks, space.box
        facts: dict[str, Any] = {"frequencies": frequency_hz.tolist(), "steps": STEPS, "shapes": shapes, "box": box,
                 "message": f"{len(frequency_hz)} frequencies from {min(frequency_hz):g} to {max(frequency_hz):g} Hz, "
                            f"{x.shape[1]} unknowns",
                 "unknowns": [{"name": _name(unknown, geometry), "re": rounded(x[:, unknown].real), "im": rounded(x[:, unknown].imag)}
                              for unknown in unknowns]}
        super().__init__("response", ("charts.js", "response.js"), facts, blocks)


def _shaped(x: NDArray[np.complex128], most: int) -> list[int]:
    """Places of frequencies whose shapes are shown: peaks first, then others spread evenly, as many as there is room for."""
    size = np.linalg.norm(x, axis=1)
    beside = np.pad(size, 1, constant_values=-1.0)
    peaks = np.flatnonzero((size > beside[:-2]) & (size >= beside[2:]))
    first = peaks[np.argsort(-size[peaks], kind="stable")][:max(most, 1)].tolist()
    others = [place for place in range(len(size)) if place not in set(first)]
    room = min(len(others), max(most - len(first), 0))
    return sorted(first + [others[k * len(others) // room] for k in range(room)])


def _name(unknown: int, geometry: Geometry | None) -> str:
    name = f"unknown {unknown + 1}"
    if geometry is None or geometry.transformation is not None or geometry.unknown_node[unknown] < 0:
        return name
    return f"{name}: node {geometry.unknown_node[unknown] + 1}, {('x', 'y', 'z', 'rx', 'ry', 'rz')[geometry.unknown_component[unknown]]}"
