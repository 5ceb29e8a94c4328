"""Matrices of other codes: one module a format, and the table that says which file goes to which."""
from __future__ import annotations

from pathlib import Path
from typing import Any, Callable

from ..errors import FileError, InputError
from . import abaqus, calculix, harwell_boeing, matlab, nastran, numpy_archive, petsc

# What a reader gives: matrices by name, and names of the unknowns where the file has them.
Content = tuple[dict[str, Any], list[str] | None]
READERS: dict[str, Callable[[Path], Content]] = {
    ".sti": calculix.read, ".mas": calculix.read,
    ".mtx": abaqus.read,
    ".mat": matlab.read,
    ".npz": numpy_archive.read,
    ".hb": harwell_boeing.read, ".rua": harwell_boeing.read, ".rsa": harwell_boeing.read,
    ".petsc": petsc.read,
    ".op4": nastran.read_op4,
    ".pch": nastran.read_dmig, ".dmig": nastran.read_dmig,
}


def read_file(path: Path) -> Content:
    """The matrices of one file; raises FileError where it cannot be read, InputError where it is none of a known format."""
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise InputError(f"{path}: no known format; endings are {', '.join(READERS)}")
    try:
        return reader(path)
    except ImportError as error:
        raise FileError(f"{path}: reading it takes {error.name}: pip install {error.name}") from error
    except OSError as error:
        raise FileError(f"{path}: {error.strerror or 'it is damaged, or no file of this format'}") from error
    except Exception as error:
        # A damaged file ends in whatever its library raises.
        raise InputError(f"{path}: it is damaged, or no file of this format: {' '.join(str(error).split())}") from error
