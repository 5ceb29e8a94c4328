"""Materials by tables of the frequency: each mode at its own frequency, against scalar equations and determinants."""
from __future__ import annotations

import numpy as np
import pytest
import scipy.optimize as optimize
import scipy.sparse as sparse
from test_loss import rod

import kschur
from kschur.errors import UsageError

# A rubber: over four decades a hundred times as stiff, most lossy in the middle.
TABLE = np.array([[1.0, 1.0e6, 2.0e5], [10.0, 3.0e6, 2.0e6], [100.0, 2.0e7, 2.4e7], [1.0e3, 7.0e7, 4.0e7], [1.0e4, 1.0e8, 1.0e7]]).T


def modulus(hertz):
    """The same by hand: straight lines on logarithmic axes."""
    place = np.log(np.clip(hertz, TABLE[0, 0], TABLE[0, -1]))
    storage, loss = (np.exp(np.interp(place, np.log(TABLE[0]), np.log(row))) for row in TABLE[1:])
    return storage + 1j * loss


def test_modulus_between_and_beyond():
    rubber = kschur.Material(*TABLE)
    for hertz in (0.0, 0.2, 1.0, 30.0, 1.0e3, 5.0e5):
        assert rubber.modulus(hertz) == pytest.approx(modulus(hertz), rel=1e-13)
    assert rubber.modulus(np.sqrt(1000.0)).real == pytest.approx(np.sqrt(3.0e6 * 2.0e7), rel=1e-13)
    assert rubber.covers(1.0) and rubber.covers(77.0) and not rubber.covers(0.9) and not rubber.covers(1.1e4)


def test_bar_of_rubber_has_scalar_equations():
    # K = E(f) K_1: lambda = i omega_1 sqrt(E(f)), f = Im lambda/2 pi, omega_1 of linear elements with a modulus of 1.
    elements, density = 60, 1100.0
    M, K = rod(elements, modulus=1.0, density=density)
    found = kschur.solve_viscoelastic(M, None, [(K, kschur.Material(*TABLE))], modes=5)
    phase = (2 * np.arange(1, 6) - 1) * np.pi / 2 / elements
    omega = np.sqrt(6 / density * elements**2 * (1 - np.cos(phase)) / (2 + np.cos(phase)))
    expected = []
    for w in omega:
        f = optimize.brentq(lambda f, w=w: (1j * w * np.sqrt(modulus(f))).imag / (2 * np.pi) - f, 1e-3, 1e6, xtol=1e-12, rtol=1e-14)
        expected.append(1j * w * np.sqrt(modulus(f)))
    assert found.converged.all() and found.covered.all() and (found.steps > 2).all()
    np.testing.assert_allclose(found.eigenvalues, expected, rtol=1e-8)
    np.testing.assert_allclose(found.loss_factor, modulus(found.frequency_hz).imag / modulus(found.frequency_hz).real, rtol=1e-8)
    assert (found.backward_error < 1e-12).all()


def test_chain_of_steel_and_rubber_by_its_determinant():
    mpmath = pytest.importorskip("mpmath")
    n = 6

    def chain(springs):
        return np.diag(springs[:-1] + springs[1:]) - np.diag(springs[1:-1], 1) - np.diag(springs[1:-1], -1)
    soft = np.arange(n + 1) < 3
    steel, rubber = chain(np.where(soft, 0.0, 5.0e6)), chain(np.where(soft, 1.0, 0.0))
    found = kschur.solve_viscoelastic(np.eye(n), steel, [(rubber, kschur.Material(*TABLE))], modes=3)
    assert found.converged.all()

    def determinant(re, im):
        value = mpmath.mpc(re, im)
        matrix = steel + complex(modulus(float(im) / (2 * np.pi))) * rubber
        result = mpmath.det(value**2 * mpmath.eye(n) + mpmath.matrix(matrix.tolist()))
        return [mpmath.re(result) / scale, mpmath.im(result) / scale]
    for value in found.eigenvalues:
        scale = mpmath.mpf(abs(value)) ** (2 * n)
        re, im = mpmath.findroot(determinant, (value.real * (1 + 1e-3), value.imag * (1 + 1e-3)), tol=1e-18)
        assert abs(value - complex(re, im)) < 1e-8 * abs(value)


def test_equal_modes_stay_two():
    M, K = rod(20, modulus=1.0, density=1100.0)
    twice = [sparse.block_diag([matrix, matrix]) for matrix in (M, K)]
    one = kschur.solve_viscoelastic(M, None, [(K, kschur.Material(*TABLE))], modes=2)
    two = kschur.solve_viscoelastic(twice[0], None, [(twice[1], kschur.Material(*TABLE))], modes=4)
    np.testing.assert_allclose(two.eigenvalues, np.repeat(one.eigenvalues, 2), rtol=1e-7)
    for j in (0, 2):
        assert abs(np.vdot(two.shapes[:, j], two.shapes[:, j + 1])) < 0.5


def test_what_does_not_settle_is_said():
    M, K = rod(20, modulus=1.0, density=1100.0)
    found = kschur.solve_viscoelastic(M, None, [(K, kschur.Material(*TABLE))], modes=2, most_steps=2)
    assert not found.converged.any() and (found.change > 1e-9).all()
    beyond = kschur.solve_viscoelastic(M, None, [(K, kschur.Material(*TABLE[:, :1]))], modes=2)
    assert beyond.converged.all() and not beyond.covered.any()


@pytest.mark.parametrize("columns", [([1.0, 2.0], [1.0], [1.0]), ([2.0, 1.0], [1.0, 1.0], [1.0, 1.0]), ([1.0], [0.0], [1.0]),
                                     ([1.0, 2.0], [1.0, 1.0], [0.0, 1.0]), ([], [], [])])
def test_tables_that_are_none(columns):
    with pytest.raises(UsageError, match="material"):
        kschur.Material(*columns)


def test_wants_parts_and_the_lowest_modes():
    M, K = rod(4)
    with pytest.raises(UsageError, match="no parts"):
        kschur.solve_viscoelastic(M, K, [])
    with pytest.raises(UsageError, match="leave out target"):
        kschur.solve_viscoelastic(M, K, [(K, kschur.Material(*TABLE))], target=1j)
