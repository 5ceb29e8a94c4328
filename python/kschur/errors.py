"""What is raised where a solve fails: a class for each status of the C library."""
from __future__ import annotations

import numpy as np


class Error(Exception):
    """A failure of the library; its text is a sentence that names what is wrong."""


class UsageError(Error, ValueError):
    """An option that is wrong or does not fit the problem."""


class InputError(Error, ValueError):
    """A matrix, a shape or a value that cannot be right."""


class FileError(Error, OSError):
    """A file that cannot be opened, read or written."""


class OutOfMemoryError(Error, MemoryError):
    """There is not enough memory."""


class SingularError(Error, np.linalg.LinAlgError):
    """The matrix to be factored is singular."""


class LibraryError(Error, RuntimeError):
    """A library below this one failed."""


class ConvergenceError(Error, ArithmeticError):
    """A linear solver that iterates came to no solution."""


class NotThereError(Error, AttributeError):
    """The result does not hold what was asked of it, left vectors without `left=True`, say."""


OF_STATUS: dict[int, type[Error]] = {1: UsageError, 2: InputError, 3: FileError, 4: OutOfMemoryError, 5: SingularError,
                                     6: LibraryError, 7: ConvergenceError, 22: NotThereError}
