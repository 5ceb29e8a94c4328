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
# Lines of constraints that are drawn, the first ones.
MOST_TIES = 20000
# A surface of more triangles than this has a coarser one beside it, of about as many; some of a screen's pixels each.
COARSE = 20000


class Space:
    """A model of a page, the first or a later one, and shapes in the order of its nodes."""

    def __init__(self, geometry: Geometry, place: int = 0) -> None:
        self.geometry, self.place = geometry, place
        faces, points = geometry.faces(), _alone(geometry)
        drawn = np.unique(np.concatenate([points, *map(np.ravel, faces)]))
        # What is within a solid is not seen.
        self.order = drawn[along_curve(geometry.coordinates[drawn])]
        seen = geometry.coordinates[self.order]
        self.box = [seen.min(axis=0).tolist(), seen.max(axis=0).tolist()]
        self.blocks = {f"model-{place}-{name}": packed(part) for name, part in _model(geometry, self.order, faces, points).items()}

    def shows(self, geometry: Geometry) -> bool:
        """Whether the nodes and cells of a geometry are those of the model."""
        one, other = self.geometry.cells or {}, geometry.cells or {}
        return (np.array_equal(self.geometry.coordinates, geometry.coordinates) and one.keys() == other.keys()
                and all(np.array_equal(rows, other[kind]) for kind, rows in one.items()))

    def add(self, number: int, shape: NDArray[Any], geometry: Geometry | None = None) -> float:
        """A shape of n unknowns as the blocks mode-NUMBER-re and -im; returns its largest displacement. Another geometry of the same
        nodes may say how unknowns move them."""
        moved = (geometry or self.geometry).displacements(shape)
        largest = math.sqrt((np.abs(moved)**2).sum(axis=1).max())
        moved = moved[self.order]
        for name, part in (("re", moved.real), ("im", moved.imag)):
            if name == "re" or np.iscomplexobj(moved):
                self.blocks[f"mode-{number}-{name}"] = packed(np.rint(STEPS * part.T / (largest or 1.0)).astype(np.int16))
        return largest

    def add_energies(self, number: int, shape: NDArray[Any], stiffness: Any) -> float:
        """Strain energies of the nodes, the mean over a period, as the block mode-NUMBER-energy, relative to the largest; returns their sum."""
        each = 0.25 * (shape.conj() * (stiffness @ shape)).real
        node = self.geometry.unknown_node
        energies = np.bincount(node[node >= 0], each[node >= 0], len(self.geometry.coordinates))
        seen = np.maximum(energies[self.order], 0)
        self.blocks[f"mode-{number}-energy"] = packed(np.rint(STEPS * seen / (seen.max() or 1.0)).astype(np.int16))
        return float(energies.sum())

    def add_constraints(self, constraints: Any) -> None:
        """Lines between the nodes that a row touches, from its first to each other one, as the block model-PLACE-ties, and nodes that a row
        touches alone, or that stand on each other, as model-PLACE-marks. Nodes within a solid are left out."""
        place = np.full(len(self.geometry.coordinates), -1)
        place[self.order] = np.arange(len(self.order))
        touched = constraints.tocoo()
        node = self.geometry.unknown_node[touched.col]
        there = (touched.data != 0) & (node >= 0)
        pairs = np.unique(np.column_stack([touched.row[there], place[node[there]]]), axis=0)
        pairs = pairs[pairs[:, 1] >= 0]
        _, first, of_row, times = np.unique(pairs[:, 0], return_index=True, return_inverse=True, return_counts=True)
        ends = np.column_stack([pairs[first, 1][of_row.ravel()], pairs[:, 1]])
        apart = np.any(self.geometry.coordinates[self.order[ends[:, 0]]] != self.geometry.coordinates[self.order[ends[:, 1]]], axis=1)
        marked = ~apart & ((times[of_row.ravel()] == 1) | (ends[:, 0] != ends[:, 1]))
        self.blocks[f"model-{self.place}-ties"] = packed(np.unique(np.sort(ends[apart], axis=1), axis=0)[:MOST_TIES].astype(np.int32))
        self.blocks[f"model-{self.place}-marks"] = packed(np.unique(ends[marked, 0])[:MOST_TIES].astype(np.int32))


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
    places = geometry.coordinates[order]
    rims = [np.column_stack([loop.ravel(), np.roll(loop, -1, axis=1).ravel()]) for loop in surface]
    return {"coordinates": places.astype(np.float32), "triangles": _sorted(_stack(triangles, 3)),
            "coarse": _sorted(coarser(_stack(triangles, 3), places)),
            "edges": np.unique(np.sort(_stack(rims, 2), axis=1), axis=0), "lines": _stack(lines, 2),
            "points": np.sort(number[points]), "parts": np.minimum(_parts(geometry)[order], MOST_PARTS - 1).astype(np.int16)}


def coarser(triangles: NDArray[Any], places: NDArray[np.float64]) -> NDArray[Any]:
    """A surface of about COARSE triangles, by one node for those of a cell of a lattice, which is one of a rim where there is any, so that
    outlines stay; none where they are no more."""
    if len(triangles) <= COARSE:
        return triangles[:0]
    sides = np.sort(np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [0, 2]]]), axis=1)
    sides, times = np.unique(sides, axis=0, return_counts=True)
    inside = np.ones(len(places), bool)
    inside[sides[times == 1].ravel()] = False
    corners = places[triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    lattice = np.floor((places - places.min(axis=0)) / (math.sqrt(2 * area / COARSE) or 1.0)).astype(np.int64)
    _, cell = np.unique(lattice, axis=0, return_inverse=True)
    by_cell = np.lexsort([inside, cell.ravel()])
    _, first, of_cell = np.unique(cell.ravel()[by_cell], return_index=True, return_inverse=True)
    node = np.empty(len(places), np.int32)
    node[by_cell] = by_cell[first][of_cell.ravel()]
    rows = np.unique(np.sort(node[triangles], axis=1), axis=0)
    return rows[(rows[:, 0] < rows[:, 1]) & (rows[:, 1] < rows[:, 2])]


def _stack(rows: list[NDArray[Any]], columns: int) -> NDArray[Any]:
    return np.vstack([np.zeros((0, columns), int), *rows]).astype(np.int32)


def _sorted(rows: NDArray[Any]) -> NDArray[Any]:
    """From low to high within each, as no side of a triangle is its front, and among them."""
    rows = np.sort(rows, axis=1)
    return rows[np.lexsort(rows.T[::-1])]
