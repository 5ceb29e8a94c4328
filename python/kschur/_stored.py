"""What can be saved is pickled, and copied, as the file that it writes."""
from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any, TypeVar

T = TypeVar("T", bound="Stored")


class Stored:
    """Something with `save` and `read`, which hold all of it."""

    def save(self, path: Any) -> None:
        """Writes an HDF5 file. Raises FileError."""
        raise NotImplementedError

    @classmethod
    def read(cls: type[T], path: Any) -> T:
        """What `save` wrote. Raises FileError or InputError."""
        raise NotImplementedError

    def __reduce__(self) -> Any:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "stored.h5")
            self.save(path)
            return _restored, (type(self), path.read_bytes())


def _restored(kind: type[T], content: bytes) -> T:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "stored.h5")
        path.write_bytes(content)
        return kind.read(path)
