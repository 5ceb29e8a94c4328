"""Beams with losses against closed forms and characteristic equations, and what is made of lossy problems."""
from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg as linalg
import scipy.optimize as optimize
import scipy.sparse as sparse
from test_loss import rod, sandwich

import kschur


def part_of(K, unknowns):
    """The stiffness of the first unknowns alone."""
    inside = sparse.diags((np.arange(K.shape[0]) < unknowns).astype(float))
    return inside @ K @ inside


def lowest(M, stiffness, count):
    """i sqrt(theta) of the complex pencil, by LAPACK."""
    squares = linalg.eigvals(stiffness.toarray(), M.toarray())
    return 1j * np.sqrt(squares[np.argsort(np.abs(squares))][:count])


def test_beam_of_complex_modulus():
    # Clamped and free: cos x cosh x = -1, lambda = i (x/span)^2 sqrt(bending (1 + i eta)/mass).
    span, bending, mass, eta, elements = 2.0, 5.0, 0.3, 0.15, 60
    order = 2 * (elements + 1)
    M, K = (matrix[:order, :order] for matrix in sandwich(elements, span, bending, 1.0, 1.0, mass)[:2])
    result = kschur.solve(M, K, Cq=np.eye(2, order), loss=eta, modes=4)
    x = np.array([optimize.brentq(lambda x: np.cos(x) + 1 / np.cosh(x), (j - 0.7) * np.pi, (j - 0.3) * np.pi, xtol=1e-14)
                  for j in range(1, 5)])
    expected = 1j * (x / span) ** 2 * np.sqrt(bending * (1 + 1j * eta) / mass)
    np.testing.assert_allclose(result.eigenvalues, expected, rtol=2e-6)
    np.testing.assert_allclose(result.loss_factor, eta, rtol=1e-9)


def test_sandwich_cantilever_of_mead_and_markus():
    # Clamped at one end there is no closed form. D. J. Mead, S. Markus, J. Sound Vib. 10 (1969): with s = u - v,
    # bending w'''' - shear (s + w')' + mass lambda^2 w = 0 and axial/2 s'' = shear (s + w'), whose solutions are sums of six
    # exponentials; w = w' = s = 0 at the clamp, w'' = s' = bending w''' - shear (s + w') = 0 at the end.
    mpmath = pytest.importorskip("mpmath")
    span, bending, axial, shear, mass, eta, elements = 1.0, 0.05, 3.0, 9.0, 1.0e-3, 0.7, 60
    M, faces, core, _ = sandwich(elements, span, bending, axial, shear, mass)
    per_node, order = 2 * (elements + 1), len(M)
    clamp = np.zeros((4, order))
    clamp[[0, 1, 2, 3], [0, 1, per_node, per_node + 2 * elements + 1]] = 1
    result = kschur.solve(M, faces + core, Cq=clamp, loss=eta * core, modes=4)
    lossy = shear * mpmath.mpc(1, eta)

    def determinant(value):
        # (bending k^4 + mass lambda^2) (axial/2 k^2 - shear) = shear axial/2 k^4.
        squares = mpmath.polyroots([bending * axial / 2, -lossy * (bending + axial / 2), mass * value**2 * axial / 2,
                                    -lossy * mass * value**2], maxsteps=200, extraprec=100)
        columns = []
        for k in (sign * mpmath.sqrt(square) for square in squares for sign in (1, -1)):
            s = lossy * k / (axial / 2 * k**2 - lossy)
            at_clamp, at_end = mpmath.exp(-abs(mpmath.re(k)) * span), mpmath.exp((k - abs(mpmath.re(k))) * span)
            columns.append([at_clamp, at_clamp * k, at_clamp * s, at_end * k**2, at_end * k * s,
                            at_end * (bending * k**3 - lossy * (s + k))])
        return mpmath.det(mpmath.matrix(columns))
    with mpmath.workdps(30):
        for value, factor in zip(result.eigenvalues, result.loss_factor):
            exact = complex(mpmath.findroot(determinant, (mpmath.mpc(value), mpmath.mpc(value) * (1 + 1e-4),
                                                          mpmath.mpc(value) * (1 + 1e-4j)), solver="muller"))
            assert abs(value - exact) < 3e-6 * abs(exact)
            assert abs(factor - (exact**2).imag / (exact**2).real) < 1e-5 * factor


def test_table_shows_loss_factors_where_there_are_any():
    M, K = rod(20)
    lossy, plain = kschur.solve(M, K, modes=2, loss=0.04), kschur.solve(M, K, modes=2)
    assert lossy.has_losses and not plain.has_losses
    assert "loss factor (%)" in repr(lossy) and "loss factor" not in repr(plain)
    row = repr(lossy).splitlines()[2].split()
    assert row[6] == "4" and row[7] == "underdamped"
    assert "loss factor (%)" in lossy._repr_html_()


@pytest.mark.parametrize("loss", [0.04, None])
def test_result_files_keep_loss_factors(tmp_path, loss):
    h5py = pytest.importorskip("h5py")
    M, K = rod(20)
    result = kschur.solve(M, K, modes=2, loss=loss)
    result.save(tmp_path / "modes.h5")
    with h5py.File(tmp_path / "modes.h5") as file:
        assert ("loss_factor" in file) == (loss is not None)
        if loss is not None:
            np.testing.assert_allclose(file["loss_factor"][:], loss, rtol=1e-11)
    back = kschur.Result.read(tmp_path / "modes.h5")
    assert back.has_losses == (loss is not None) and repr(back) == repr(result)


def test_sweep_over_the_loss_factor_of_one_part():
    M, K = rod(40)
    core = part_of(K, 20)
    etas = [0.0, 0.2, 0.4, 0.6]
    sweep = kschur.sweep(lambda eta: (M, K, None, None, eta * core), etas, modes=4)
    for eta, row in zip(etas, sweep.eigenvalues):
        np.testing.assert_allclose(row, lowest(M, K + 1j * eta * core, 4), rtol=1e-8)


def test_band_and_count_with_losses():
    M, K = rod(60)
    H = 0.3 * part_of(K, 25)
    hertz = np.abs(lowest(M, K + 1j * H, 12)) / (2 * np.pi)
    band = kschur.solve(M, K, loss=H, band=((hertz[2] + hertz[3]) / 2, (hertz[9] + hertz[10]) / 2))
    np.testing.assert_allclose(band.frequency_hz, hertz[3:10], rtol=1e-8)
    counted = kschur.solve(M, K, loss=H, modes=6, certify=True, formulation="quadratic")
    assert counted.certified is True and counted.missing == 0


def test_properties_of_one_material_are_those_without_losses():
    M, K = rod(30)
    push = np.ones((30, 1))
    lossy, plain = (kschur.solve(M, K, modes=4, loss=loss, properties=True, directions=push, normalisation="mass")
                    for loss in (0.1, None))
    np.testing.assert_allclose(lossy.generalised_stiffness, plain.generalised_stiffness, rtol=1e-9)
    np.testing.assert_allclose(lossy.effective_mass, plain.effective_mass, rtol=1e-9)


def test_modal_strain_energy():
    M, K = rod(40)
    core = part_of(K, 20)
    parts = [core, K - core]
    # To first order without losses.
    plain, slightly = kschur.solve(M, K, modes=4), kschur.solve(M, K, modes=4, loss=1e-5 * core)
    shares = kschur.strain_energy_shares(plain, parts)
    np.testing.assert_allclose(shares.sum(axis=1), 1, rtol=1e-12)
    np.testing.assert_allclose(shares @ [1e-5, 0], slightly.loss_factor, rtol=1e-6)
    # phi^* (K + i H) phi = omega^2 phi^* M phi: of modes with losses exactly.
    lossy = kschur.solve(M, K, modes=4, loss=0.5 * core + 0.1 * (K - core))
    np.testing.assert_allclose(kschur.strain_energy_shares(lossy, parts) @ [0.5, 0.1], lossy.loss_factor, rtol=1e-9)
    free = kschur.solve(np.eye(3), [[1, -1, 0], [-1, 2, -1], [0, -1, 1]], modes=2)
    shares = kschur.strain_energy_shares(free, [np.array([[1, -1, 0], [-1, 1, 0], [0, 0, 0]]),
                                                np.array([[0, 0, 0], [0, 1, -1], [0, -1, 1]])])
    assert np.isnan(shares[0]).all()
    np.testing.assert_allclose(shares[1], 0.5, rtol=1e-12)
    for parts in ([], [np.eye(2)]):
        with pytest.raises(kschur.errors.UsageError, match="part"):
            kschur.strain_energy_shares(free, parts)


@pytest.mark.parametrize("seed", range(40))
def test_certified_sets_of_proportional_problems_lack_nothing(seed):
    random = np.random.default_rng(seed)
    n = int(random.integers(8, 60))
    root_of_mass, root_of_stiffness = random.standard_normal((2, n, n))
    M, K = root_of_mass @ root_of_mass.T + n * np.eye(n), root_of_stiffness @ root_of_stiffness.T + 0.1 * np.eye(n)
    squares = linalg.eigh(K, M, eigvals_only=True)
    rate = np.sqrt(squares.max())
    alpha, beta, eta = 10 ** random.uniform(-3, 1) * rate, 10 ** random.uniform(-3, 0) / rate, 10 ** random.uniform(-3, 1)
    alpha, beta = alpha * random.integers(2), beta * random.integers(2)
    target = complex(-abs(random.normal()), abs(random.normal())) * rate * random.integers(2)
    upper = np.array([max(np.roots([1, alpha + beta * s, s * (1 + 1j * eta)]), key=lambda root: root.imag) for s in squares])
    result = kschur.solve(M, K, alpha * M + beta * K if alpha or beta else None, loss=eta * K, modes=int(random.integers(1, n)),
                          target=target, formulation="proportional")
    found = result.eigenvalues
    near = np.abs(upper[:, None] - found) <= 1e-6 * np.abs(upper[:, None])
    assert near.any(axis=0).all()
    if result.certified is not None:
        assert result.certified
        nearer = np.abs(upper - target) < (1 - 1e-6) * np.abs(found - target).max()
        assert near[nearer].any(axis=1).all()
