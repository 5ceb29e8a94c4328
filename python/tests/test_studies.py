"""What is made of modes and problems, against NumPy and closed forms."""
import matplotlib
import numpy as np
import pytest
import scipy.sparse as sparse
from test_solve import chain

import kschur
from kschur.errors import InputError, SingularError, UsageError

matplotlib.use("Agg")


@pytest.mark.parametrize("coupling, kind", [(0.02, "veering"), (0, "crossing")])
def test_sweep(coupling, kind, tmp_path):
    values = np.linspace(0, 1, 6)
    swept = kschur.sweep(lambda p: (np.eye(2), [[1 + p, coupling], [coupling, 2 - p]]), values, modes=2)
    root = np.hypot(values - 0.5, coupling) if coupling else 0.5 - values
    assert np.allclose(swept.eigenvalues.imag, np.sqrt(np.stack([1.5 - root, 1.5 + root], axis=1)), rtol=1e-12)
    assert np.allclose(swept.frequency_hz, swept.eigenvalues.imag / 2 / np.pi) and not swept.damping_ratio.any()
    assert [event.kind for event in swept.events] == [kind] and swept.events[0][1:3] == (0, 1)
    assert abs(swept.events[0].value - 0.5) < 0.11 and swept.values.tolist() == values.tolist()
    axes = swept.campbell(parameter="p")
    assert axes.get_xlabel() == "p" and len([line for line in axes.lines if line.get_marker() in "sD"]) == 1
    assert np.allclose(axes.lines[0].get_ydata(), swept.frequency_hz[:, 0])
    axes.figure.savefig(tmp_path / "campbell.png")


def test_sweep_refuses():
    with pytest.raises(UsageError, match="rise or fall"):
        kschur.sweep(lambda p: (np.eye(2), np.eye(2)), [1, 3, 2])
    with pytest.raises(InputError, match="other numbers of unknowns"):
        kschur.sweep(lambda p: (np.eye(int(p)), np.eye(int(p))), [2, 3], modes=1)


def test_halves_of_symmetric_matrices():
    M, K = chain(6)
    half = sparse.tril(K)
    response, whole = (kschur.frequency_response(M, stiffness, frequencies=[0.1], forces=np.eye(6)[0], symmetric=how).displacement
                       for stiffness, how in ((half, "lower"), (K, None)))
    assert np.allclose(response, whole, rtol=1e-14, atol=0)
    swept = kschur.sweep(lambda p: (M, p * half), [1, 2, 4], modes=2, symmetric="lower")
    assert np.allclose(swept.eigenvalues.imag / np.sqrt(swept.values)[:, None],
                       2 * np.sin(np.arange(1, 3) * np.pi / 14), rtol=1e-12)
    with pytest.raises(InputError, match="lower triangle only"):
        kschur.sweep(lambda p: (M, p * half), [1, 2], modes=2)
    # Meant as it is, from point to point.
    swept = kschur.sweep(lambda p: (np.eye(2), [[1 + p, 0], [0.1, 2 - p]]), [0, 0.4, 0.8], modes=2, symmetric="no")
    assert np.allclose(np.nanmin(swept.eigenvalues.imag**2, axis=1), [1, 1.4, 1.2], rtol=1e-12)


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
