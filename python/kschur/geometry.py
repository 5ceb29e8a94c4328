"""Where the unknowns of a problem stand in space."""
from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sparse
from numpy.typing import NDArray

from .errors import InputError

# Unknowns of a node that come one after the other, by their number: components 0 to 5 are three translations and
# three rotations.
_IN_ORDER = {1: [2], 2: [0, 1], 3: [0, 1, 2], 6: [0, 1, 2, 3, 4, 5]}


@dataclass
class Geometry:
    """Nodes in space, which unknown moves which of them, and what joins them.

    coordinates : nodes x 3; with fewer columns the others are zero.
    unknown_node : for each unknown its node, counted from 0; -1 where it has none.
    unknown_component : for each unknown what it is: 0, 1, 2 translations along x, y, z, 3, 4, 5 rotations about them.
    lines : pairs of nodes to draw between, lines x 2; those that the stiffness matrix joins, where absent.

    Without the two maps the unknowns are taken node after node: 6 of each are translations and rotations, 3 are
    translations, 2 those along x and y, 1 the one along z.
    """
    coordinates: Any
    unknown_node: Any = None
    unknown_component: Any = None
    lines: Any = None

    def __post_init__(self) -> None:
        given = np.atleast_2d(np.asarray(self.coordinates, float))
        if given.ndim != 2 or given.shape[1] > 3:
            raise InputError(f"the coordinates must be nodes x 3, not {' x '.join(map(str, given.shape))}")
        self.coordinates = np.hstack([given, np.zeros((len(given), 3 - given.shape[1]))])
        if (self.unknown_node is None) != (self.unknown_component is None):
            raise InputError("unknown_node and unknown_component must be given both or none")
        if self.unknown_node is not None:
            self.unknown_node = np.asarray(self.unknown_node, int)
            self.unknown_component = np.asarray(self.unknown_component, int)
        if self.lines is not None:
            self.lines = np.asarray(self.lines, int).reshape(-1, 2)

    def completed(self, K: Any) -> Geometry:
        """The same with the maps and lines of a problem with this stiffness. Raises InputError where they do not fit."""
        n, nodes = K.shape[0], len(self.coordinates)
        node, component = self.unknown_node, self.unknown_component
        if node is None:
            if n % nodes or n // nodes not in _IN_ORDER:
                raise InputError(f"{n} unknowns are not 1, 2, 3 or 6 for each of the {nodes} nodes: "
                                 "give unknown_node and unknown_component")
            node = np.repeat(np.arange(nodes), n // nodes)
            component = np.tile(_IN_ORDER[n // nodes], nodes)
        _check("unknown_node", node, n, nodes - 1)
        _check("unknown_component", component, n, 5)
        lines = _joined_nodes(K, node, nodes) if self.lines is None else self.lines
        return replace(self, unknown_node=node, unknown_component=component, lines=lines)

    def displacements(self, shape: NDArray[Any]) -> NDArray[Any]:
        """Displacements of the nodes, nodes x 3, of a shape of n unknowns."""
        moved = np.zeros((len(self.coordinates), 3), shape.dtype)
        there = (self.unknown_node >= 0) & (self.unknown_component < 3)
        moved[self.unknown_node[there], self.unknown_component[there]] = shape[there]
        return moved


def _check(name: str, numbers: NDArray[Any], n: int, last: int) -> None:
    if numbers.shape != (n,):
        raise InputError(f"{name} must have a number for each of the {n} unknowns, not {numbers.size}")
    if numbers.size and not -1 <= numbers.min() <= numbers.max() <= last:
        wrong = numbers[(numbers < -1) | (numbers > last)][0]
        raise InputError(f"{name} holds {wrong} but must lie between -1 and {last}")


def _joined_nodes(K: Any, node: NDArray[Any], nodes: int) -> NDArray[Any]:
    entries = sparse.coo_matrix(K)
    first, second = node[entries.row], node[entries.col]
    there = (first >= 0) & (first < second) & (entries.data != 0)
    return np.unique(np.column_stack([first[there], second[there]]), axis=0).reshape(-1, 2)
