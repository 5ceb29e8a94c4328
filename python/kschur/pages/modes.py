"""Modes as a page: a list of them, and the model in space, which moves."""
from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import InputError, NotThereError
from ..result import Result
from .page import Page
from .space import STEPS, Space


class ModesPage(Page):
    """A page of modes, all or some, counted from 0."""

    def __init__(self, result: Result, modes: Any = None) -> None:
        if result.geometry is None:
            raise InputError("modes are shown on a geometry: give solve one, as geometry=kschur.Geometry(coordinates)")
        chosen = list(range(len(result))) if modes is None else [range(len(result))[mode] for mode in modes]
        if not chosen:
            raise InputError("there are no modes to be shown")
        space = Space(result.geometry)
        for place, mode in enumerate(chosen):
            space.add(place, result.shape(mode))
        facts = {"message": result.message, "certified": result.certified, "notes": result.notes, "steps": STEPS,
                 "nodes": len(result.geometry.coordinates), "unknowns": result.unknowns, "mac": _mac(result, chosen), "box": space.box,
                 "modes": [_facts(result, mode) for mode in chosen]}
        super().__init__("modes", ("mac.js", "modes.js"), facts, space.blocks)


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
