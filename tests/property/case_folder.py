"""A problem as a folder: M.mtx, K.mtx, perhaps R.mtx and Cq.mtx, what to ask in options.txt, and spectrum.txt."""
from pathlib import Path

import numpy as np

from assemble import Problem

HEADER = ("finite eigenvalues, both of a pair, with multiplicity (zeros: once a null vector): "
          "real, imaginary, tolerance")


def write_case(folder, problem):
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for name, matrix in problem.matrices.items():
        entries = [f"{i + 1} {j + 1} {matrix[i, j]:.17g}\n" for i, j in np.argwhere(matrix)]
        (folder / f"{name}.mtx").write_text("%%MatrixMarket matrix coordinate real general\n"
                                            f"{matrix.shape[0]} {matrix.shape[1]} {len(entries)}\n" + "".join(entries))
    (folder / "options.txt").write_text(" ".join(problem.command) + "\n")
    np.savetxt(folder / "spectrum.txt", problem.spectrum, fmt=("%.17g", "%.17g", "%.3g"), header=HEADER)


def read_case(folder):
    """What the judge needs: of the matrices their names, as they stay in their files."""
    folder = Path(folder)
    names = (file.stem for file in folder.glob("*.mtx"))
    return Problem(dict.fromkeys(names), np.loadtxt(folder / "spectrum.txt", ndmin=2), (folder / "options.txt").read_text().split())
