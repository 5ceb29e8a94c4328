"""Modes against closed forms and against SciPy's dense solvers, and what is raised where something is wrong."""
import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sparse
import scipy.sparse.linalg

import kschur
from kschur._library import INSTALLED
from kschur.errors import FileError, InputError, NotThereError, UsageError


def chain(n):
    """A chain of n unit masses and n + 1 unit springs between two walls: omega_j = 2 sin(j pi / (2 n + 2))."""
    return sparse.identity(n, format="csr"), sparse.diags([-1.0, 2.0, -1.0], [-1, 0, 1], (n, n), format="csr")


def chain_omega(n):
    return 2 * np.sin(np.arange(1, n + 1) * np.pi / (2 * n + 2))


def damped(n, seed):
    """A chain with dashpots of any size, which no combination of mass and stiffness is."""
    M, K = chain(n)
    return M, K, sparse.diags(np.random.default_rng(seed).uniform(0, 0.3, n), format="csr")


def dense_eigenvalues(M, K, R):
    """All eigenvalues by LAPACK, of the companion matrix."""
    M, K, R = (np.asarray(matrix.todense()) for matrix in (M, K, R))
    n = len(M)
    inverse = np.linalg.inv(M)
    return scipy.linalg.eigvals(np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ K, -inverse @ R]]))


def residuals(result, M, K, R, Cq=None):
    """Of each mode, relative to the stiffness."""
    found = []
    for k, value in enumerate(result.eigenvalues):
        shape = result.shapes[:, k]
        left_over = value**2 * (M @ shape) + value * (R @ shape) + K @ shape
        if Cq is not None:
            left_over = left_over + Cq.T @ result.multipliers[:, k]
            found.append(np.abs(Cq @ shape).max())
        found.append(np.linalg.norm(left_over) / scipy.sparse.linalg.norm(K))
    return np.array(found)


@pytest.mark.parametrize("shape_of", [sparse.csr_matrix, sparse.csc_matrix, sparse.coo_matrix, sparse.csr_array,
                                      sparse.dia_matrix, lambda matrix: matrix.toarray(), lambda matrix: matrix.toarray().tolist()])
def test_matrices_of_any_format(shape_of):
    M, K = (shape_of(matrix) for matrix in chain(40))
    result = kschur.solve(M, K, modes=6)
    assert len(result) == 6 and result.converged and result.certified is True
    assert np.allclose(result.eigenvalues.imag, chain_omega(40)[:6], rtol=1e-12, atol=0)
    assert np.allclose(result.frequency_hz, chain_omega(40)[:6] / (2 * np.pi), rtol=1e-12)
    assert result.kind == ["undamped"] * 6 and not result.damping_ratio.any()


@pytest.mark.parametrize("half, name", [(sparse.tril, "lower"), (sparse.triu, "upper")])
def test_halves_of_symmetric_matrices(half, name):
    M, K = chain(40)
    with pytest.raises(InputError, match=f"stiffness matrix K has entries in its {name} triangle only"):
        kschur.solve(M, half(K), modes=6)
    for stiffness in half(K), K:
        result = kschur.solve(M, stiffness, half(0.01 * K), modes=6, symmetric=name)
        assert np.allclose(np.abs(result.eigenvalues), chain_omega(40)[:6], rtol=1e-12, atol=0)
    with pytest.raises(InputError, match="must mirror"):
        kschur.solve(M, half(K), modes=6, symmetric="upper" if name == "lower" else "lower")
    taken = kschur.solve(np.eye(2), half([[1.0, 0.5], [0.5, 4.0]]), modes=2, symmetric="no")
    assert np.allclose(taken.eigenvalues.imag, [1, 2], rtol=1e-12, atol=0)
    for wrong in "half", True:
        with pytest.raises(UsageError, match="lower"):
            kschur.solve(M, K, symmetric=wrong)


def test_shapes_are_real_where_all_are():
    M, K = chain(40)
    result = kschur.solve(M, K, modes=3)
    sines = np.sin(np.outer(np.arange(1, 41), np.arange(1, 4)) * np.pi / 41)
    sines /= np.linalg.norm(sines, axis=0)
    assert result.shapes.dtype == np.float64 and result.shapes.shape == (40, 3)
    assert np.allclose(np.abs(np.sum(result.shapes * sines, axis=0)), 1, atol=1e-12)
    assert result.multipliers.shape == (0, 3)
    again = kschur.solve(M, K, modes=3)
    assert np.array_equal(again.shape(-1), result.shapes[:, 2])
    assert np.array_equal(again.shape(1, [7, 3]), result.shapes[[7, 3], 1])
    with pytest.raises(IndexError):
        again.shape(3)


def test_64_bit_indices():
    M, K = chain(30)
    K.indices, K.indptr = K.indices.astype(np.int64), K.indptr.astype(np.int64)
    assert np.allclose(kschur.solve(M, K, modes=2).eigenvalues.imag, chain_omega(30)[:2], rtol=1e-12)


def test_damped_modes_are_those_of_lapack():
    matrices = damped(30, 1)
    M, K, R = matrices
    result = kschur.solve(M, K, R, modes=8)
    reference = dense_eigenvalues(M, K, R)
    for value in result.eigenvalues:
        assert np.abs(reference - value).min() < 1e-11
    wanted = np.sort(np.abs(reference[reference.imag >= 0]))[:8]
    assert np.allclose(np.sort(np.abs(result.eigenvalues)), wanted, rtol=1e-9)
    assert result.shapes.dtype == np.complex128
    assert residuals(result, M, K, R).max() < 1e-12
    ratios = -result.eigenvalues.real / np.abs(result.eigenvalues)
    assert np.allclose(result.damping_ratio, ratios, atol=1e-12)


def test_constraints_and_multipliers():
    # The middle mass is held still: two chains of 20, each mode twice.
    M, K = chain(41)
    Cq = sparse.csr_matrix(([1.0], ([0], [20])), (1, 41))
    result = kschur.solve(M, K, Cq=Cq, modes=6)
    assert np.allclose(result.eigenvalues.imag, np.repeat(chain_omega(20)[:3], 2), rtol=1e-11)
    assert result.multipliers.shape == (1, 6)
    assert residuals(result, M, K, 0 * M, Cq).max() < 1e-12


@pytest.mark.parametrize("wanted", [{"target": 1.2j}, {"frequency": 1.2 / (2 * np.pi)}])
def test_target(wanted):
    M, K = chain(60)
    result = kschur.solve(M, K, modes=5, **wanted)
    omega = chain_omega(60)
    assert np.allclose(np.sort(result.eigenvalues.imag), np.sort(omega[np.argsort(abs(omega - 1.2))[:5]]), rtol=1e-12)
    assert result.target == pytest.approx(1.2j)


def test_band():
    M, K = chain(60)
    hertz = chain_omega(60) / (2 * np.pi)
    result = kschur.solve(M, K, band=(0.1, 0.2))
    inside = hertz[(hertz >= 0.1) & (hertz <= 0.2)]
    assert len(result) == len(inside) and result.certified is True
    assert np.allclose(np.sort(result.frequency_hz), inside, rtol=1e-11)


def test_options_reach_the_solver():
    M, K, R = damped(30, 2)
    result = kschur.solve(M, K, R, modes=4, formulation="quadratic", shift=0.3, presolve=False, seed=7, tolerance=1e-10)
    assert result.formulation == "quadratic" and result.shift == pytest.approx(0.3)


def test_shapes_of_unit_mass():
    M, K = chain(20)
    shapes = kschur.solve(4 * M, K, modes=3, normalisation="mass").shapes
    assert np.allclose(shapes.T @ (4 * M) @ shapes, np.eye(3), atol=1e-12)


def test_properties():
    # Of the sines phi_i = sin(i theta), i = 1 to n, of an odd mode: sum phi = cot(theta/2), sum phi^2 = (n + 1)/2.
    n = 30
    M, K = chain(n)
    result = kschur.solve(2 * M, K, modes=n, properties=True, directions=np.ones(n))
    theta = np.arange(1, n + 1) * np.pi / (n + 1)
    wanted = np.where(np.arange(n) % 2 == 0, 2 * 2 / (n + 1) / np.tan(theta / 2)**2, 0)
    assert result.effective_mass.shape == (n, 1) and result.participation_factors.shape == (n, 1)
    assert np.allclose(result.effective_mass[:, 0], wanted, atol=1e-9)
    assert np.allclose(result.total_mass, [2 * n]) and np.isclose(result.effective_mass.sum(), 2 * n)
    assert np.allclose(result.generalised_mass, 2) and np.allclose(result.modal_a, 2j * result.eigenvalues.imag * 2)
    assert np.allclose(result.generalised_stiffness, 2 * result.eigenvalues.imag**2) and not result.generalised_damping.any()
    geometry = kschur.Geometry(np.arange(10)[:, None])
    result = kschur.solve(M, K, modes=3, properties=True, geometry=geometry)
    assert result.directions == ["x", "y", "z", "ry", "rz"]
    assert np.allclose(result.total_mass, [10, 10, 10, 285, 285])
    with pytest.raises(UsageError, match="30 x directions, not 3 x 1"):
        kschur.solve(M, K, properties=True, directions=[1, 0, 0])
    with pytest.raises(NotThereError):
        kschur.solve(M, K).effective_mass


def test_left_vectors():
    M, K, R = damped(20, 3)
    K = (K + sparse.csr_matrix(([0.2], ([2], [5])), K.shape)).tocsr()
    result = kschur.solve(M, K, R, modes=4, left=True)
    for k, value in enumerate(result.eigenvalues):
        row = result.left_shapes[:, k].conj() @ (value**2 * M + value * R + K)
        assert np.abs(row).max() < 1e-12
    assert np.all(result.condition_number > 0)
    with pytest.raises(NotThereError):
        kschur.solve(M, K, R, modes=4).left_shapes


def test_certify():
    M, K, R = damped(120, 4)
    assert kschur.solve(M, K, R, modes=4, formulation="quadratic").certified is None
    result = kschur.solve(M, K, R, modes=4, formulation="quadratic", certify=True)
    assert result.certified is True and result.missing == 0


def test_fewer_modes_are_a_reason():
    M, K = chain(5)
    result = kschur.solve(M, K, modes=9)
    assert result.reason == "fewer_modes" and not result.converged and len(result) == 5
    assert result.message.startswith("5 of 9 modes, fewer modes")
    assert np.allclose(result.eigenvalues.imag, chain_omega(5), rtol=1e-12)


@pytest.mark.parametrize("arguments, error, words", [
    (lambda M, K: (M, K[:3]), InputError, "stiffness matrix K is 3 x 10 but must be 10 x 10"),
    (lambda M, K: (M * 1j, K), InputError, "mass matrix M is complex"),
    (lambda M, K: (M, K, None, sparse.csr_matrix((1, 9))), InputError, "constraint Jacobian Cq is 1 x 9"),
    (lambda M, K: (0 * M, K), InputError, "mass matrix M is zero"),
    (lambda M, K: ([1.0, 2.0], K), InputError, "mass matrix M has 1 dimensions"),
    (lambda M, K: (M, np.full((10, 10), "a")), InputError, "stiffness matrix K holds"),
    (lambda M, K: (M, K * np.nan), InputError, r"not a finite number at \(0, 0\)"),
    (lambda M, K: (M, K, None, sparse.csr_matrix(([1.0], ([0], [4])), (2, 10))), InputError, "row 1 of the constraint")])
def test_wrong_matrices(arguments, error, words):
    with pytest.raises(error, match=words):
        kschur.solve(*arguments(*chain(10)))


def test_notes_count_from_zero():
    result = kschur.solve(np.eye(2), np.array([[100.0, 1.0], [0.0, 100.0]]), modes=2, symmetric="no")
    assert any("modes 0 and 1 (counted from 0)" in note for note in result.notes)


@pytest.mark.parametrize("options, words", [
    ({"modes": 0}, "at least 1"), ({"modes": 1.5}, "'modes' wants a whole number, not '1.5'"), ({"tolerance": "small"}, "tolerance"), ({"shift": [1]}, "shift cannot be"), ({"target": np.inf}, "target"),
    ({"formulation": "best"}, "no formulation 'best'"), ({"colour": 1}, "no option 'colour'"),
    ({"band": (1, 2), "modes": 3}, "band excludes"), ({"band": 5}, "two frequencies"), ({"frequency": -1}, "-1"),
    ({"frequency": 1, "target": 1}, "exclude"), ({"band": (2, 1)}, "band")])
def test_wrong_options(options, words):
    with pytest.raises(UsageError, match=words):
        kschur.solve(*chain(10), **options)


def test_a_result_is_saved_and_loaded(tmp_path):
    M, K, R = damped(20, 5)
    result = kschur.solve(M, K, R, modes=3)
    result.save(tmp_path / "modes.h5")
    again = kschur.load(tmp_path / "modes.h5")
    assert np.array_equal(again.eigenvalues, result.eigenvalues) and np.array_equal(again.shapes, result.shapes)
    assert repr(again) == repr(result)
    with pytest.raises(FileError, match="nowhere.h5"):
        kschur.load(tmp_path / "nowhere.h5")


def test_tables():
    result = kschur.solve(*damped(20, 6), modes=3)
    lines = repr(result).splitlines()
    assert lines[0] == "3 of 3 modes, converged, certified: no mode is missing" and len(lines) == 5
    for k in range(3):
        cells = lines[2 + k].split()
        assert float(cells[3]) == pytest.approx(result.frequency_hz[k], rel=1e-5) and cells[6] == "underdamped"
        assert f"<td>{cells[3]}</td>" in result._repr_html_()
    assert result._repr_html_().count("<tr>") == 4


def test_version():
    assert kschur.__version__.count(".") == 2


def test_the_installed_library_is_of_this_version():
    assert INSTALLED == "libkschur_capi.so." + kschur.__version__.rpartition(".")[0]
