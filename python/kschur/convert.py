"""Problems out of files of other codes: kschur.read, and what the command kschur convert does."""
from __future__ import annotations

import argparse
import os
import re
import sys
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sparse

from .errors import Error, InputError
from .formats import read_file

# What matrices are called, without regard to case: by hand, by Abaqus (job_STIF1), by Nastran.
USUAL = {
    "mass": r"m|mass|maa|mgg|.*_mass\d*",
    "stiffness": r"k|stiffness|kaa|kgg|.*_stif\d*",
    "damping": r"r|c|d|damping|baa|bgg|.*_dmpv\d*",
    "constraints": r"cq|constraints|held",
}


class Problem(NamedTuple):
    """M, K, R and Cq, sparse, the last two None where there is none, the names of the unknowns where files have them, and what was done
    to the matrices."""

    mass: Any
    stiffness: Any
    damping: Any
    constraints: Any
    labels: list[str] | None
    notes: tuple[str, ...] = ()


def read(*paths: str | Path, mass: str | None = None, stiffness: str | None = None, damping: str | None = None,
         constraints: str | None = None) -> Problem:
    """The problem in one or several files of other codes.

    `mass` and the like are the names of matrices (docs/convert.md), where these are not the usual ones. Raises FileError and
    InputError."""
    matrices: dict[str, Any] = {}
    contents = [(path, *read_file(path)) for path in map(Path, paths)]
    labels: list[str] | None = max((names for *_, names in contents if names is not None), key=len, default=None)
    held = {names[k] for _, found, names in contents if names is not None and "held" in found for k in found["held"].indices}
    for path, found, names in contents:
        for name, matrix in found.items():
            if name in matrices:
                raise InputError(f"{path}: a matrix {name} was in an earlier file too")
            matrices[name] = matrix if labels is None or names in (None, labels) else _widened(matrix, names, labels, held, path)
    where = ", ".join(map(str, paths))
    given = {"mass": mass, "stiffness": stiffness, "damping": damping, "constraints": constraints}
    chosen = {role: _choose(matrices, role, name, where) for role, name in given.items()}
    size = chosen["stiffness"].shape[0]
    for role, matrix in chosen.items():
        wanted = (matrix.shape[0] if role == "constraints" else size, size) if matrix is not None else None
        if matrix is not None and matrix.shape != wanted:
            raise InputError(f"{where}: the {role} is {matrix.shape[0]} x {matrix.shape[1]}, which does not fit {size} unknowns")
    return Problem(**chosen, labels=labels, notes=tuple(
        f"{path}: {found['held'].shape[0]} unknowns with 1e36 on the diagonal are held: rows of Cq say so in its place"
        for path, found, _ in contents if "held" in found))


def _widened(matrix: Any, names: list[str], labels: list[str], held: set[str], path: Path) -> Any:
    """A matrix of all unknowns; its file may leave out those that are held."""
    if not set(names) <= set(labels) or not set(labels) - set(names) <= held:
        raise InputError(f"{path}: it has other unknowns than the other files")
    place = {label: k for k, label in enumerate(labels)}
    to_all = sparse.csr_matrix((np.ones(len(names)), (np.arange(len(names)), [place[name] for name in names])), (len(names), len(labels)))
    return (to_all.T @ matrix if matrix.shape[0] == matrix.shape[1] else matrix) @ to_all


def _choose(matrices: dict[str, Any], role: str, name: str | None, where: str) -> Any:
    there = ", ".join(matrices) or "none"
    if name is None:
        usual = [known for known in matrices if re.fullmatch(USUAL[role], known, re.IGNORECASE)]
        if len(usual) > 1 or not usual and role in ("mass", "stiffness"):
            raise InputError(f"{where}: which matrix is the {role}? Say --{role} NAME; there are {there}")
        if not usual:
            return None
        name = usual[0]
    if name not in matrices:
        raise InputError(f"{where}: there is no matrix {name}; there are {there}")
    matrix = sparse.csr_matrix(matrices[name])
    if matrix.dtype.kind == "c":
        raise InputError(f"{where}: the {role} {name} is complex but must be real")
    matrix = matrix.astype(float)
    if not np.isfinite(matrix.data).all():
        raise InputError(f"{where}: the {role} {name} holds a number that is not finite")
    matrix.sum_duplicates()
    return matrix


def write(problem: Problem, path: str | Path) -> None:
    """An HDF5 file that kschur solves; it appears under its name when it is whole."""
    import h5py
    place = Path(path).absolute()
    with tempfile.TemporaryDirectory(dir=place.parent, prefix=f"{place.name}.partial-") as staging:
        whole = Path(staging, place.name)
        with h5py.File(whole, "w") as file:
            for role in USUAL:
                matrix = getattr(problem, role)
                if matrix is not None:
                    group = file.create_group(role)
                    group.attrs["shape"] = matrix.shape
                    group["indptr"], group["indices"], group["data"] = matrix.indptr, matrix.indices, matrix.data
            if problem.labels is not None:
                file["unknown_label"] = np.array(problem.labels, dtype="S")
        os.replace(whole, place)


def main(words: list[str]) -> None:
    """What kschur convert does; the exit status is 1 for wrong usage, 2 for files that cannot be right."""
    parser = argparse.ArgumentParser("kschur convert", description="files of other codes into an HDF5 file: docs/convert.md")
    parser.add_argument("input", nargs="+", metavar="IN", help="matrices, in one file or several")
    parser.add_argument("output", metavar="OUT.h5")
    for role in USUAL:
        parser.add_argument(f"--{role}", metavar="NAME", help=f"which matrix is the {role}")
    try:
        options = vars(parser.parse_args(words))
    except SystemExit as stop:
        sys.exit(1 if stop.code else 0)
    paths, output = options.pop("input"), options.pop("output")
    # The last word may be an input whose output was forgotten.
    if Path(output).suffix not in (".h5", ".hdf5"):
        _fail(f"{output}: the output, which is the last word, must end in .h5 or .hdf5", status=1)
    try:
        problem = read(*paths, **options)
        write(problem, output)
    except ImportError as error:
        _fail(f"{output}: writing it takes {error.name}: pip install kschur[convert]")
    except (Error, OSError) as error:
        _fail(str(error))
    rows = 0 if problem.constraints is None else problem.constraints.shape[0]
    print(f"{output}: {problem.mass.shape[0]} unknowns, {rows} constraints", *problem.notes, sep="\n")


def _fail(message: str, status: int = 2) -> None:
    print(f"kschur: {message}", file=sys.stderr)
    sys.exit(status)
