"""A structure of OpenSees."""
from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..convert import Problem
from ..errors import InputError
from ..geometry import Geometry


def from_opensees(ops: Any) -> tuple[Problem, Geometry]:
    """M, K, R and Cq of the model of openseespy.opensees, named node.direction, and where it stands.

    The tangent matrices are those of the present state; the analysis of the model is replaced. Rigid diaphragms and links are rows
    of Cq, so that all nodes move in pictures; `fix` and `equalDOF` leave unknowns out. Matrices are dense on their way, as
    OpenSees gives them: some thousand unknowns. Raises InputError."""
    mass, damping, stiffness = (_matrix(ops, *factors) for factors in np.eye(3))
    size, freedoms = ops.getNDM()[0], ops.getNDF()[0]
    if (size, freedoms) not in ((3, 6), (3, 3), (2, 3), (2, 2)):
        raise InputError(f"of {freedoms} unknowns a node in {size} dimensions it is not known which is what")
    components = [0, 1, 5] if (size, freedoms) == (2, 3) else list(range(freedoms))
    tags = ops.getNodeTags()
    place = {tag: np.pad(ops.nodeCoord(tag), (0, 3 - size)) for tag in tags}
    # The number of each unknown, by node and component; -1 where it is fixed.
    number = {tag: dict(zip(components, ops.nodeDOFs(tag))) for tag in tags}
    n = len(stiffness)
    node, component, labels = np.full(n, -1), np.zeros(n, int), [""] * n
    for k, tag in enumerate(tags):
        for what, unknown in number[tag].items():
            if unknown >= 0 and node[unknown] < 0:
                node[unknown], component[unknown], labels[unknown] = k, what, f"{tag}.{components.index(what) + 1}"
    rows = [row for tag in ops.getConstrainedNodes() for row in _rows(ops, tag, number, place, components, n)]
    cells: dict[str, list[Any]] = {}
    index = {tag: k for k, tag in enumerate(tags)}
    kinds = {2: "line", 3: "triangle", 4: "quad", 8: "hexahedron"}
    for element in ops.getEleTags():
        corners = [index[tag] for tag in ops.eleNodes(element)]
        if len(corners) in kinds:
            cells.setdefault(kinds[len(corners)], []).append(corners)
    problem = Problem(sparse.csr_matrix(mass), sparse.csr_matrix(stiffness), sparse.csr_matrix(damping) if damping.any() else None,
                      sparse.csr_matrix(np.array(rows)) if rows else None, labels)
    return problem, Geometry([place[tag] for tag in tags], node, component, {kind: np.array(rows) for kind, rows in cells.items()})


def _matrix(ops: Any, mass: float, damping: float, stiffness: float) -> NDArray[np.float64]:
    """The sum of the three matrices times these numbers, of all unknowns that are not fixed."""
    ops.wipeAnalysis()
    ops.constraints("Plain")
    ops.numberer("Plain")
    ops.system("FullGeneral")
    ops.algorithm("Linear")
    ops.integrator("GimmeMCK", float(mass), float(damping), float(stiffness), 0.0)
    ops.analysis("Transient", "-noWarnings")
    ops.analyze(1, 0.0)
    n = ops.systemSize()
    return np.array(ops.printA("-ret"), float).reshape(n, n)


def _rows(ops: Any, tag: int, number: Any, place: Any, components: Any, n: int) -> list[NDArray[np.float64]]:
    """Those that tie a node to others as a rigid body: u = u0 + theta x r in the directions that are tied."""
    rows = []
    for other in ops.getRetainedNodes(tag):
        r = place[tag] - place[other]
        # theta x r along x, y, z, a row each.
        lever = np.array([[0.0, r[2], -r[1]], [-r[2], 0.0, r[0]], [r[1], -r[0], 0.0]])
        for direction in ops.getConstrainedDOFs(tag, other):
            what = components[direction - 1]
            mine, its = number[tag][what], number[other][what]
            if mine == its:
                continue
            row = np.zeros(n)
            terms = [(mine, 1.0), (its, -1.0)]
            if what < 3:
                terms += [(number[other].get(3 + axis, -1), -lever[what, axis]) for axis in range(3)]
            for unknown, value in terms:
                if unknown >= 0:
                    row[unknown] += value
            rows.append(row)
    return rows
