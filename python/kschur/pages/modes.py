"""Modes as a page: a list of them, and the model in space, which moves."""
from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse

from ..errors import InputError, NotThereError
from ..result import Result
from .page import Page
from .space import STEPS, Space


class ModesPage(Page):
    """A page of modes, all or some, counted from 0, with strain energies where K is given, and constraints where Cq is. Energies are of the
    unknowns of the problem, and so are the rows of Cq: where T eliminated some neither is shown."""

    def __init__(self, result: Result, modes: Any = None, stiffness: Any = None, constraints: Any = None) -> None:
        if result.geometry is None:
            raise InputError("modes are shown on a geometry: give solve one, as geometry=kschur.Geometry(coordinates)")
        chosen = list(range(len(result))) if modes is None else [range(len(result))[mode] for mode in modes]
        if not chosen:
            raise InputError("there are no modes to be shown")
        space = Space(result.geometry)
        listed = [_facts(result, mode) for mode in chosen]
        own = result.geometry.transformation is None
        stiffness = None if stiffness is None else _fitting(stiffness, "stiffness matrix", result.unknowns, result.unknowns)
        for place, mode in enumerate(chosen):
            space.add(place, result.shape(mode))
            if stiffness is not None and own:
                listed[place]["energy"] = space.add_energies(place, result.shape(mode), stiffness)
        if constraints is not None:
            constraints = _fitting(constraints, "constraint matrix", np.shape(constraints)[0], result.unknowns)
            if own:
                space.add_constraints(constraints)
        facts = {"message": result.message, "certified": result.certified, "notes": result.notes, "steps": STEPS,
                 "nodes": len(result.geometry.coordinates), "unknowns": result.unknowns, "mac": _mac(result, chosen), "box": space.box,
                 "modes": listed}
        super().__init__("modes", ("mac.js", "modes.js"), facts, space.blocks)


def _fitting(matrix: Any, name: str, rows: int, columns: int) -> Any:
    if np.shape(matrix) != (rows, columns):
        raise InputError(f"the {name} is {' x '.join(map(str, np.shape(matrix)))} but must be {rows} x {columns}")
    return sparse.csr_matrix(matrix)


def _facts(result: Result, mode: int) -> dict[str, Any]:
    facts = {"number": mode + 1, "re": result.eigenvalues[mode].real, "im": result.eigenvalues[mode].imag,
             "frequency": result.frequency_hz[mode], "damped": result.damped_frequency_hz[mode],
             "damping": result.damping_ratio[mode], "kind": result.kind[mode], "backward": result.backward_error[mode]}
    try:
        masses = np.divide(result.effective_mass[mode], result.total_mass, where=result.total_mass > 0,
                           out=np.zeros(len(result.total_mass)))
        facts["masses"] = dict(zip(result.directions, masses.tolist()))
    except NotThereError:
        pass
    return {name: value.item() if isinstance(value, np.generic) else value for name, value in facts.items()}


def _mac(result: Result, modes: list[int]) -> list[list[float]]:
    """|phi_i^* phi_j|^2 of shapes of unit norm."""
    shapes = np.column_stack([result.shape(mode) for mode in modes])
    shapes = shapes / np.linalg.norm(shapes, axis=0)
    return [[round(float(value), 4) for value in row] for row in np.abs(shapes.conj().T @ shapes)**2]
