"""A model and shapes of it as blocks of a page: numbers near each other in space stand near each other, and compress well."""
from __future__ import annotations

import base64
import math
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from ..geometry import Geometry

# A displacement of the largest one: on a screen the step of the motion is far below a pixel.
STEPS = 2047
MOST_PARTS = 30
# Places along each axis that the curve tells apart, as a power of two.
BITS = 16


class Space:
    """The model of a page, and shapes in the order of its nodes."""

    def __init__(self, geometry: Geometry) -> None:
        self.geometry = geometry
        faces, points = geometry.faces(), _alone(geometry)
        drawn = np.unique(np.concatenate([points, *map(np.ravel, faces)]))
        # What is within a solid is not seen.
        self.order = drawn[along_curve(geometry.coordinates[drawn])]
        self.blocks = {f"model-{name}": packed(part) for name, part in _model(geometry, self.order, faces, points).items()}

    def add(self, number: int, shape: NDArray[Any]) -> float:
        """A shape of n unknowns as the blocks mode-NUMBER-re and -im; returns its largest displacement."""
        moved = self.geometry.displacements(shape)
        largest = math.sqrt((np.abs(moved)**2).sum(axis=1).max())
        moved = moved[self.order]
        for name, part in (("re", moved.real), ("im", moved.imag)):
            if name == "re" or np.iscomplexobj(moved):
                self.blocks[f"mode-{number}-{name}"] = packed(np.rint(STEPS * part.T / (largest or 1.0)).astype(np.int16))
        return largest


def packed(numbers: NDArray[Any]) -> str:
    """Differences of whole numbers, or floating numbers, byte after byte of all of them, compressed, as text."""
    flat = np.ascontiguousarray(numbers).ravel()
    if flat.dtype.kind == "i":
        flat = np.diff(flat, prepend=flat.dtype.type(0))
    planes = flat.astype(flat.dtype.newbyteorder("<")).view(np.uint8).reshape(-1, flat.itemsize).T
    return base64.b64encode(zlib.compress(planes.tobytes(), 9)).decode()


def along_curve(coordinates: NDArray[np.float64]) -> NDArray[np.int64]:
    """The nodes in the order in which Hilbert's curve meets them, by Skilling's algorithm (AIP Conf. Proc. 707, 381, 2004)."""
    low, size = coordinates.min(axis=0), np.ptp(coordinates, axis=0).max() or 1.0
    x = np.rint((coordinates - low) / size * (2**BITS - 1)).astype(np.int64).T.copy()
    for bit in range(BITS - 1, 0, -1):
        below = (1 << bit) - 1
        for axis in range(3):
            inverted = (x[axis] >> bit & 1).astype(bool)
            swapped = np.where(inverted, 0, (x[0] ^ x[axis]) & below)
            x[0] ^= np.where(inverted, below, swapped)
            x[axis] ^= swapped
    x[1] ^= x[0]
    x[2] ^= x[1]
    flipped = np.zeros_like(x[0])
    for bit in range(BITS - 1, 0, -1):
        flipped ^= np.where(x[2] >> bit & 1, (1 << bit) - 1, 0)
    x ^= flipped
    place = np.zeros_like(x[0])
    for bit in range(BITS - 1, -1, -1):
        for axis in range(3):
            place = place << 1 | x[axis] >> bit & 1
    return np.argsort(place, kind="stable")


def _alone(geometry: Geometry) -> NDArray[np.int64]:
    """Nodes of no cell, and of vertices."""
    alone = np.ones(len(geometry.coordinates), bool)
    for kind, rows in (geometry.cells or {}).items():
        alone[rows.ravel()] = kind == "vertex"
    return np.flatnonzero(alone)


def _parts(geometry: Geometry) -> NDArray[np.int32]:
    """The part of each node: those that cells join are one."""
    nodes = len(geometry.coordinates)
    joined = [np.column_stack([rows[:, 0], rows[:, k]])
              for rows in (geometry.cells or {}).values() if rows.size for k in range(1, rows.shape[1])]
    first, last = _stack(joined, 2).T
    graph = sparse.coo_matrix((np.ones(len(first)), (first, last)), shape=(nodes, nodes))
    part: NDArray[np.int32] = connected_components(graph, directed=False)[1]
    return part


def _model(geometry: Geometry, order: NDArray[np.int64], faces: list[NDArray[Any]], points: NDArray[np.int64]) -> dict[str, NDArray[Any]]:
    """Positions of nodes, what is drawn between them, and their parts."""
    number = np.zeros(len(geometry.coordinates), np.int32)
    number[order] = np.arange(len(order))
    faces = [number[loops] for loops in faces]
    surface = [loops for loops in faces if loops.shape[1] > 2]
    lines = [loops for loops in faces if loops.shape[1] == 2]
    triangles = [loops[:, [0, k, k + 1]] for loops in surface for k in range(1, loops.shape[1] - 1)]
    rims = [np.column_stack([loop.ravel(), np.roll(loop, -1, axis=1).ravel()]) for loop in surface]
    return {"coordinates": geometry.coordinates[order].astype(np.float32), "triangles": _sorted(_stack(triangles, 3)),
            "edges": np.unique(np.sort(_stack(rims, 2), axis=1), axis=0), "lines": _stack(lines, 2),
            "points": np.sort(number[points]), "parts": np.minimum(_parts(geometry)[order], MOST_PARTS - 1).astype(np.int16)}


def _stack(rows: list[NDArray[Any]], columns: int) -> NDArray[Any]:
    return np.vstack([np.zeros((0, columns), int), *rows]).astype(np.int32)


def _sorted(rows: NDArray[Any]) -> NDArray[Any]:
    """From low to high within each, as no side of a triangle is its front, and among them."""
    rows = np.sort(rows, axis=1)
    return rows[np.lexsort(rows.T[::-1])]
