"""Where the unknowns of a problem stand in space."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sparse
from numpy.typing import NDArray

from ._library import Handle
from .errors import InputError, NotThereError

# VTK's numbers of cells, by the names of meshio.
_TYPES = {"vertex": 1, "line": 3, "triangle": 5, "quad": 9, "tetra": 10, "hexahedron": 12, "wedge": 13, "pyramid": 14,
          "line3": 21, "triangle6": 22, "quad8": 23, "tetra10": 24, "hexahedron20": 25}
# The faces of a cell, each a loop of corners, by its number.
_FACES: dict[int, list[tuple[int, ...]]] = {
    1: [], 3: [(0, 1)], 5: [(0, 1, 2)], 9: [(0, 1, 2, 3)], 10: [(0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3)],
    12: [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)],
    13: [(0, 1, 2), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)],
    14: [(0, 1, 2, 3), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)]}
_FACES.update({21: _FACES[3], 22: _FACES[5], 23: _FACES[9], 24: _FACES[10], 25: _FACES[12]})
# Of the enumeration kschur_matrix of the C library.
_TRANSFORMATION = 5
_SOLIDS = ("tetra", "hexahedron", "wedge", "pyramid", "tetra10", "hexahedron20")


@dataclass
class Geometry:
    """Nodes in space, which unknown moves which of them, and the cells between them.

    coordinates : nodes x 3; with fewer columns the others are zero.
    unknown_node : for each unknown its node, counted from 0; -1 where it has none.
    unknown_component : for each unknown what it is: 0, 1, 2 translations along x, y, z, 3, 4, 5 rotations about them.
    cells : arrays of nodes, a cell a row, by the name of the kind of cell, as the `cells_dict` of meshio: "line",
        "triangle", "quad", "tetra", "hexahedron", ...; lines that the stiffness matrix joins, where absent.
    transformation : T, N x n, where unknowns were eliminated, as slaves of rigid parts: of the n unknowns q of the problem
        it makes the N unknowns u = T q that move the nodes. The two maps are of u then, and cells must be given.

    Without the two maps the unknowns are taken node after node: 6 of each are translations and rotations, 3 are
    translations, 2 those along x and y, 1 the one along z.
    """
    coordinates: Any
    unknown_node: Any = None
    unknown_component: Any = None
    cells: dict[str, Any] | None = None
    transformation: Any = None

    def __post_init__(self) -> None:
        given = np.atleast_2d(np.asarray(self.coordinates, float))
        if given.ndim != 2 or given.shape[1] > 3:
            raise InputError(f"the coordinates must be nodes x 3, not {' x '.join(map(str, given.shape))}")
        self.coordinates = np.hstack([given, np.zeros((len(given), 3 - given.shape[1]))])
        if (self.unknown_node is None) != (self.unknown_component is None):
            raise InputError("unknown_node and unknown_component must be given both or none")
        if self.unknown_node is not None:
            self.unknown_node = np.asarray(self.unknown_node, int).ravel()
            self.unknown_component = np.asarray(self.unknown_component, int).ravel()
            if len(self.unknown_node) != len(self.unknown_component):
                raise InputError("unknown_node and unknown_component must be equally long")
        if self.cells is not None:
            for kind in self.cells.keys() - _TYPES.keys():
                raise InputError(f"there is no kind of cell '{kind}', only {', '.join(_TYPES)}")
            self.cells = {kind: np.atleast_2d(np.asarray(nodes, int)) for kind, nodes in self.cells.items()}

    def give(self, problem: Handle) -> None:
        """Hands it to a problem. Raises InputError where it cannot be right."""
        maps = [None if given is None else np.ascontiguousarray(given, np.int32)
                for given in (self.unknown_node, self.unknown_component)]
        coordinates = np.ascontiguousarray(self.coordinates)
        problem.call("set_nodes", len(coordinates), coordinates.ctypes.data, 0 if maps[0] is None else len(maps[0]), 0,
                     *[None if given is None else given.ctypes.data for given in maps])
        if self.transformation is not None:
            given = sparse.csr_matrix(self.transformation, dtype=float)
            start, column, value = (np.ascontiguousarray(part, kind) for part, kind in
                                    ((given.indptr, np.int32), (given.indices, np.int32), (given.data, np.float64)))
            problem.call("set_csr", _TRANSFORMATION, *given.shape, len(value), 0, start.ctypes.data, column.ctypes.data,
                         value.ctypes.data)
        if self.cells is None:
            return
        rows = [(kind, row) for kind, nodes in self.cells.items() for row in nodes]
        offsets = np.cumsum([0] + [len(row) for _, row in rows]).astype(np.int32)
        nodes = np.concatenate([row for _, row in rows] + [[]]).astype(np.int32)
        types = np.array([_TYPES[kind] for kind, _ in rows], np.int32)
        problem.call("set_cells", len(types), 0, offsets.ctypes.data, nodes.ctypes.data, types.ctypes.data)

    @classmethod
    def of_result(cls, result: Handle) -> Geometry | None:
        """That of the problem of a result; None where it did not say."""
        try:
            coordinates = result.array("coordinates")
        except NotThereError:
            return None
        node = result.array("unknown_node")
        try:
            data, indices, start = (result.array(f"transformation_{part}") for part in ("data", "indices", "indptr"))
            transformation = sparse.csr_matrix((data, indices.astype(int), start.astype(int)), (len(node), result.number("n")))
        except NotThereError:
            transformation = None
        return cls.of_arrays(coordinates.reshape(-1, 3), node, result.array("unknown_component"),
                             *(result.array(f"cells_{part}").astype(int) for part in ("offsets", "connectivity", "types")), transformation)

    @classmethod
    def of_arrays(cls, coordinates: Any, unknown_node: Any, unknown_component: Any, offsets: Any, nodes: Any, types: Any,
                  transformation: Any = None) -> Geometry:
        """One whose cells are given as files have them: see docs/view.md."""
        names = {number: name for name, number in _TYPES.items()}
        cells: dict[str, list[NDArray[Any]]] = {}
        for first, last, number in zip(offsets, offsets[1:], types):
            if number in names:
                cells.setdefault(names[number], []).append(nodes[first:last])
        return cls(coordinates, unknown_node, unknown_component, {name: np.array(rows) for name, rows in cells.items()}, transformation)

    def of_unknowns(self, n: int) -> Geometry:
        """The same with the maps of n unknowns, which stand node after node where it has none."""
        if self.unknown_node is not None:
            known = len(self.unknown_node) if self.transformation is None else self.transformation.shape[1]
            if known != n:
                raise InputError(f"the geometry is that of {known} unknowns, not of {n}")
            return self
        each, rest = divmod(n, len(self.coordinates))
        if rest or each not in (1, 2, 3, 6):
            raise InputError(f"{n} unknowns are not 1, 2, 3 or 6 for each of {len(self.coordinates)} nodes")
        components = [2] if each == 1 else range(each)
        return Geometry(self.coordinates, np.repeat(np.arange(len(self.coordinates)), each), np.tile(components, len(self.coordinates)),
                        self.cells)

    def faces(self) -> list[NDArray[Any]]:
        """What can be seen: lines, shells and the outer faces of solids, an array of loops of nodes for each number of
        corners."""
        loops: dict[int, list[NDArray[Any]]] = {}
        inner: dict[int, list[NDArray[Any]]] = {}
        for kind, nodes in (self.cells or {}).items():
            for face in _FACES[_TYPES[kind]]:
                (inner if kind in _SOLIDS else loops).setdefault(len(face), []).append(nodes[:, list(face)])
        for corners, found in inner.items():
            rows = np.vstack(found)
            _, first, times = np.unique(np.sort(rows, axis=1), axis=0, return_index=True, return_counts=True)
            loops.setdefault(corners, []).append(rows[first[times == 1]])
        return [np.vstack(found) for _, found in sorted(loops.items())]

    def lines(self) -> NDArray[Any]:
        """Their edges as pairs of nodes, each once."""
        pairs = [np.column_stack([loop.ravel(), np.roll(loop, -1, axis=1).ravel()]) for loop in self.faces()]
        edges: NDArray[Any] = np.unique(np.sort(np.vstack([np.zeros((0, 2), int), *pairs]), axis=1), axis=0)
        return edges

    def displacements(self, shape: NDArray[Any]) -> NDArray[Any]:
        """Displacements of the nodes, nodes x 3, of a shape of n unknowns."""
        if self.transformation is not None:
            shape = self.transformation @ shape
        moved = np.zeros((len(self.coordinates), 3), shape.dtype)
        there = (self.unknown_node >= 0) & (self.unknown_component < 3)
        moved[self.unknown_node[there], self.unknown_component[there]] = shape[there]
        return moved
