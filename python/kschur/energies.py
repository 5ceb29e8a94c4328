"""Where the strain energy of a mode is, and what it loses there."""
from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import UsageError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .result import Result


def strain_energy_shares(result: Result, parts: Sequence[Any]) -> NDArray[np.float64]:
    """What each part has of the strain energy of each mode, modes x parts: phi^* K_p phi over the sum of all parts; NaN of what
    has no strain energy, as a rigid motion.

    With loss factors of the parts, `shares @ factors` is the loss factor by modal strain energy (Johnson, Kienholz, AIAA J. 20
    (1982)): of modes without losses to first order in the factors, of modes with losses Im/Re of their own complex strain energy.

    result : of a solve.
    parts : the stiffness matrices K_p of the parts, n x n, symmetric; their sum is K.
    """
    if not parts:
        raise UsageError("there are no parts: give the stiffness matrix of each")
    n = result.unknowns
    for part in parts:
        if np.shape(part) != (n, n):
            raise UsageError(f"the stiffness matrix of a part is {' x '.join(map(str, np.shape(part)))} but must be {n} x {n}")
    phi = result.shapes
    energies = np.array([np.einsum("ij,ij->j", phi.conj(), part @ phi).real for part in parts]).T.reshape(len(result), len(parts))
    total, terms = energies.sum(axis=1, keepdims=True), np.abs(energies).sum(axis=1, keepdims=True)
    strained = (total > 0) & (result.eigenvalues[:, None] != 0) & (terms > 0)
    return np.divide(energies, total, out=np.full_like(energies, np.nan), where=np.broadcast_to(strained, energies.shape))
