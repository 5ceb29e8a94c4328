"""What is made of modes and problems, against NumPy and closed forms."""
import numpy as np
import pytest
import scipy.sparse as sparse

import kschur
from kschur.errors import SingularError, UsageError


def chain(n):
    return sparse.identity(n, format="csr"), sparse.diags([200.0, -100, -100], [0, 1, -1], (n, n), format="csr")


def test_frequency_response():
    n, frequencies = 8, [0.3, 1.1, 2.0]
    M, K = chain(n)
    R, Cq = sparse.diags(np.linspace(0.1, 0.8, n)), np.eye(1, n, 2) - np.eye(1, n, 5)
    forces = np.stack([np.eye(n)[1], np.arange(n) * 1j], axis=1)
    response = kschur.frequency_response(M, K, R, Cq, frequencies=frequencies, forces=forces)
    assert response.displacement.shape == (3, 2, n) and response.multipliers.shape == (3, 2, 1)
    for k, s in enumerate(2j * np.pi * np.array(frequencies)):
        dynamic = (s * s * M + s * R + K).toarray()
        wanted = np.linalg.solve(np.block([[dynamic, Cq.T], [Cq, np.zeros((1, 1))]]), np.vstack([forces, np.zeros((1, 2))]))
        assert np.allclose(response.displacement[k], wanted[:n].T, rtol=1e-11)
        assert np.allclose(response.multipliers[k], wanted[n:].T, rtol=1e-11)
    one = kschur.frequency_response(M, K, R, Cq, frequencies=0.3, forces=forces[:, 0])
    assert one.displacement.shape == (1, n) and np.allclose(one.displacement[0], response.displacement[0, 0])
    assert one.frequency_hz.tolist() == [0.3]
    with pytest.raises(UsageError, match="8 or 8 x forces"):
        kschur.frequency_response(M, K, frequencies=1, forces=[1, 2])
    with pytest.raises(SingularError, match="no response at"):
        kschur.frequency_response(np.eye(2), [[1, -1], [-1, 1]], frequencies=0, forces=[1, 0])
