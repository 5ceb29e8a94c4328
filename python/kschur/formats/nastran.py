"""Nastran: OP4 of OUTPUT4, by pyyeti, and DMIG, as in a .pch of EXTOUT=DMIGPCH, by pyNastran."""
from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sparse

from .halves import completed

# What both formats call a symmetric matrix, of which one half may be there.
SYMMETRIC = 6


def read_op4(path: Path) -> tuple[dict[str, Any], list[str] | None]:
    """The matrices of the file; names are in small letters, unknowns have none."""
    from pyyeti.nastran import op4
    names, matrices, forms, _ = op4.read(str(path), into="list", sparse=True)
    return {name: completed(matrix) if form == SYMMETRIC else matrix for name, matrix, form in zip(names, matrices, forms)}, None


def read_dmig(path: Path) -> tuple[dict[str, Any], list[str] | None]:
    """The matrices of the file, of all unknowns that any of them has, as grid.component in this order."""
    from pyNastran.bdf.bdf import BDF
    # Nothing is logged, and an error is raised.
    model = BDF(debug=None, log=None)
    model.read_bdf(str(path), punch=True, xref=False, validate=False)
    cards = model.dmig
    unknowns = sorted({(int(grid), int(component)) for card in cards.values() for pairs in (card.GCi, card.GCj)
                       for grid, component in pairs})
    place = {unknown: k for k, unknown in enumerate(unknowns)}
    matrices = {}
    for name, card in cards.items():
        if card.is_complex:
            raise ValueError(f"its matrix {name} is complex")
        row, column = ([place[int(grid), int(component)] for grid, component in pairs] for pairs in (card.GCi, card.GCj))
        matrix = sparse.coo_matrix((np.asarray(card.Real, float), (row, column)), shape=(len(unknowns),) * 2)
        matrices[name] = completed(matrix) if card.matrix_form == SYMMETRIC else matrix
    return matrices, [f"{grid}.{component}" for grid, component in unknowns]
