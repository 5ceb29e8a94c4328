"""Modes as one page for a browser: a list of them, and the model in space, which moves."""
from __future__ import annotations

import base64
import html
import json
import math
import os
import sys
import tempfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from .errors import Error, InputError, NotThereError
from .geometry import Geometry
from .result import Result

WEB = Path(__file__).with_name("web")
SCRIPTS = ("data.js", "camera.js", "model.js", "overlay.js", "mac.js", "main.js")
# A displacement of the largest one: on a screen the step of the motion is far below a pixel.
STEPS = 2047
MOST_PARTS = 30


class View:
    """A page of modes. `save` writes it; a notebook shows it."""

    def __init__(self, result: Result, modes: Any = None) -> None:
        if result.geometry is None:
            raise InputError("modes are shown on a geometry: give solve one, as geometry=kschur.Geometry(coordinates)")
        chosen = list(range(len(result))) if modes is None else [range(len(result))[mode] for mode in modes]
        blocks = {f"model-{name}": _packed(part) for name, part in _model(result.geometry).items()}
        facts = {"message": result.message, "certified": result.certified, "notes": result.notes, "steps": STEPS,
                 "nodes": len(result.geometry.coordinates), "unknowns": result.unknowns, "mac": _mac(result, chosen),
                 "modes": [_facts(result, mode) for mode in chosen]}
        for place, mode in enumerate(chosen):
            moved = result.geometry.displacements(result.shape(mode))
            largest = math.sqrt((np.abs(moved)**2).sum(axis=1).max()) or 1.0
            for name, part in (("re", moved.real), ("im", moved.imag)):
                if name == "re" or np.iscomplexobj(moved):
                    blocks[f"mode-{place}-{name}"] = _packed(np.rint(STEPS * part.T / largest).astype(np.int16))
        style, page = (WEB.joinpath(name).read_text() for name in ("style.css", "page.html"))
        scripts = "\n".join(WEB.joinpath(name).read_text() for name in SCRIPTS)
        data = "\n".join(f'<script type="text/plain" id="{name}">{block}</script>' for name, block in blocks.items())
        for mark, text in (("STYLE", style), ("THREE", _three()), ("SCRIPTS", scripts), ("DATA", data),
                           ("FACTS", json.dumps(_finite(facts), allow_nan=False).replace("<", "\\u003c"))):
            page = page.replace(f"@{mark}@", text)
        self.html = page

    def save(self, path: Any) -> None:
        """Writes the page; it appears under its name when it is whole."""
        place = Path(path).absolute()
        with tempfile.TemporaryDirectory(dir=place.parent, prefix=f"{place.name}.partial-") as staging:
            whole = Path(staging, place.name)
            whole.write_text(self.html, encoding="utf-8")
            whole.replace(place)

    def _repr_html_(self) -> str:
        return f'<iframe srcdoc="{html.escape(self.html)}" style="width:100%;height:640px;border:1px solid #ccc"></iframe>'


def _three() -> str:
    """three.js, as KSCHUR_THREE names it, as a wheel has it, or as Debian's libjs-three."""
    bundled = WEB / "three.min.js"
    place = Path(os.environ.get("KSCHUR_THREE", bundled if bundled.exists() else "/usr/share/javascript/three/three.min.js"))
    try:
        return place.read_text(encoding="utf-8").replace("</script", "<\\/script")
    except OSError:
        raise Error(f"there is no {place}: a page takes three.js, Debian's package libjs-three, or a three.min.js that "
                    "KSCHUR_THREE names") from None


def _packed(numbers: NDArray[Any]) -> str:
    """Differences of whole numbers, or floating numbers, byte after byte of all of them, compressed, as text."""
    flat = np.ascontiguousarray(numbers).ravel()
    if flat.dtype.kind == "i":
        flat = np.diff(flat, prepend=flat.dtype.type(0))
    planes = flat.astype(flat.dtype.newbyteorder("<")).view(np.uint8).reshape(-1, flat.itemsize).T
    return base64.b64encode(zlib.compress(planes.tobytes(), 9)).decode()


def _model(geometry: Geometry) -> dict[str, NDArray[Any]]:
    """Positions of the nodes, what is drawn between them, and the part of each node: those that cells join are one part."""
    nodes = len(geometry.coordinates)
    faces = geometry.faces()
    surface = [loops for loops in faces if loops.shape[1] > 2]
    lines = [loops for loops in faces if loops.shape[1] == 2]
    triangles = [loops[:, [0, k, k + 1]] for loops in surface for k in range(1, loops.shape[1] - 1)]
    rims = [np.column_stack([loop.ravel(), np.roll(loop, -1, axis=1).ravel()]) for loop in surface]
    edges = np.unique(np.sort(_stack(rims, 2), axis=1), axis=0)
    cells = [rows for rows in (geometry.cells or {}).values() if rows.size]
    joined = np.vstack([np.zeros((0, 2), int)] + [np.column_stack([rows[:, 0], rows[:, k]])
                                                  for rows in cells for k in range(1, rows.shape[1])])
    graph = sparse.coo_matrix((np.ones(len(joined)), (joined[:, 0], joined[:, 1])), shape=(nodes, nodes))
    part = connected_components(graph, directed=False)[1]
    alone = np.ones(nodes, bool)
    for kind, rows in (geometry.cells or {}).items():
        alone[rows.ravel()] = kind == "vertex"
    return {"coordinates": geometry.coordinates.astype(np.float32), "triangles": _stack(triangles, 3), "edges": edges.astype(np.int32),
            "lines": _stack(lines, 2), "points": np.flatnonzero(alone).astype(np.int32),
            "parts": np.minimum(part, MOST_PARTS - 1).astype(np.int16)}


def _stack(rows: list[NDArray[Any]], columns: int) -> NDArray[Any]:
    return np.vstack([np.zeros((0, columns), int), *rows]).astype(np.int32)


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


def _finite(facts: Any) -> Any:
    """The same with None for what is not a finite number, which JSON does not know."""
    if isinstance(facts, dict):
        return {name: _finite(value) for name, value in facts.items()}
    if isinstance(facts, list):
        return [_finite(value) for value in facts]
    return None if isinstance(facts, float) and not math.isfinite(facts) else facts


def _mac(result: Result, modes: list[int]) -> list[list[float]]:
    """|phi_i^* phi_j|^2 of shapes of unit norm."""
    shapes = np.column_stack([result.shape(mode) for mode in modes])
    shapes = shapes / np.linalg.norm(shapes, axis=0)
    return [[round(float(value), 4) for value in row] for row in np.abs(shapes.conj().T @ shapes)**2]


def main(words: list[str]) -> None:
    """What kschur-picture --html does: words are a result, a page, and numbers of modes from 1."""
    path, page, *numbers = words
    try:
        View(Result.read(path), [int(number) - 1 for number in numbers]).save(page)
    except Exception as error:
        sys.exit(f"kschur-picture: {error}")
