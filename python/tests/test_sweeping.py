"""Branches with rigid motions, onsets of instability, and what can be saved and copied."""
import copy
import pickle

import matplotlib
import numpy as np
import pytest
import scipy.sparse as sparse
from test_solve import chain

import kschur
from kschur.errors import FileError, InputError, UsageError

matplotlib.use("Agg")

INNER, OUTER, OMEGA = 0.4, 1.0, 10.0
ONSET = OMEGA * (1 + OUTER / INNER)


def jeffcott(speed):
    """A disc of mass 1 on a massless shaft, omega = 10: damping of the ground and of the shaft, which turns; and a third
    unknown that is free."""
    circulation = INNER * speed * np.array([[0, 1.0, 0], [-1, 0, 0], [0, 0, 0]])
    return np.eye(3), OMEGA**2 * np.diag([1, 1, 0.0]) + circulation, np.diag([INNER + OUTER, INNER + OUTER, 0])


def seven(speed):
    """Three free masses in a chain, and two pairs that whirl."""
    M, K, R = np.eye(7), np.zeros((7, 7)), np.zeros((7, 7))
    K[:3, :3] = [[1, -1, 0], [-1, 2, -1], [0, -1, 1]]
    for first, stiffness, inertia in ((3, 4, 1), (5, 9, 0.7)):
        K[first, first] = K[first + 1, first + 1] = stiffness
        R[first, first + 1], R[first + 1, first] = inertia * speed, -inertia * speed
    return M, K, R


@pytest.mark.parametrize("values", [np.linspace(5, 80, 4), np.linspace(0, 80, 20), np.linspace(80, 5, 4)])
def test_onset(values):
    swept = kschur.sweep(jeffcott, values, modes=3, parameter="speed", unit="rad/s")
    assert swept.eigenvalues.shape[1] == 3 and [onset.unstable for onset in swept.onsets] == [values[0] < values[-1]]
    assert abs(swept.onsets[0].value / ONSET - 1) < 1e-4 and swept.onsets[0].within <= 1e-3 * ONSET
    word = "unstable" if values[0] < values[-1] else "stable"
    assert f"branch {swept.onsets[0].branch} {word} from 35 rad/s" in repr(swept)


def test_matrices_of_a_sequence_are_interpolated():
    values = [5.0, 40.0, 80.0]
    swept = kschur.sweep([jeffcott(value) for value in values], values, modes=3)
    assert abs(swept.onsets[0].value / ONSET - 1) < 1e-4
    with pytest.raises(UsageError, match="matrices for 1 of 3 values"):
        kschur.sweep([jeffcott(5.0)], values, modes=3)


def test_what_matrices_raise_between_points_comes_out():
    def only_at_points(value):
        if value not in (5.0, 80.0):
            raise KeyError(value)
        return jeffcott(value)
    with pytest.raises(KeyError):
        kschur.sweep(only_at_points, [5.0, 80.0], modes=3)


def test_a_zero_is_one_branch():
    values = np.linspace(0.5, 3.5, 7)
    swept = kschur.sweep(seven, values, modes=7)
    assert swept.eigenvalues.shape == (7, 7) and len(swept.events) == 3
    assert sorted(set(swept.eigenvalues[0].imag == 0)) == [False, True] and (swept.eigenvalues[:, 0] == 0).all()


def test_a_rotor_that_is_free_in_torsion():
    def rotor(torsion):
        n = 6 if torsion else 4
        tilt, polar = 0.3, 0.5

        def at(speed):
            M, K, R = np.diag([2, 2, tilt, tilt, polar, polar][:n]), np.zeros((n, n)), np.zeros((n, n))
            K[:4, :4] = np.diag([800, 800, 90, 90.0])
            R[2, 3], R[3, 2] = polar * speed, -polar * speed
            if torsion:
                K[4:, 4:] = [[70, -70], [-70, 70]]
            return M, K, R
        return at
    values = np.linspace(0, 60, 12)
    without = kschur.sweep(rotor(False), values, modes=4).eigenvalues.shape[1]
    swept = kschur.sweep(rotor(True), values, modes=6)
    assert without == 4 and swept.eigenvalues.shape[1] == 6
    assert np.count_nonzero((swept.eigenvalues == 0).all(axis=0)) == 1


def test_a_sweep_is_saved_read_copied_and_drawn(tmp_path):
    swept = kschur.sweep(jeffcott, [5, 40, 80], modes=3, parameter="speed", unit="rad/s")
    swept.save(tmp_path / "s.h5")
    for again in (kschur.load(tmp_path / "s.h5"), pickle.loads(pickle.dumps(swept)), copy.deepcopy(swept)):
        assert (again.parameter, again.unit, again.events, again.onsets) == ("speed", "rad/s", swept.events, swept.onsets)
        for name in ("values", "eigenvalues", "frequency_hz", "damping_ratio", "share"):
            assert np.array_equal(getattr(again, name), getattr(swept, name), equal_nan=True)
        assert repr(again) == repr(swept) and again._repr_html_().startswith("<div>")
        again.save(tmp_path / "again.h5")
    axes = swept.campbell(orders=[1, 2])
    assert axes.get_xlabel() == "speed (rad/s)" and {"1P", "2P", "35"} <= {text.get_text() for text in axes.texts}
    with pytest.raises(UsageError, match="--unit rpm"):
        kschur.sweep(jeffcott, [5, 40], modes=3).campbell(orders=[1])
    with pytest.raises(FileError):
        swept.save(tmp_path / "nowhere" / "s.h5")


def test_results_of_points_are_kept_with_their_geometry(tmp_path):
    # Three nodes that move along z; the middle one was eliminated, half of its neighbours.
    T = sparse.csr_matrix([[1.0, 0.0], [0.5, 0.5], [0.0, 1.0]])
    M, K = np.diag([1.0, 2.0, 3.0]), np.array([[4.0, -1, 0], [-1, 3, -1], [0, -1, 2]])
    geometry = kschur.Geometry([[0, 0, 0], [1, 0, 0], [2, 0, 0]], cells={"line": [[0, 1], [1, 2]]}, transformation=T)
    swept = kschur.sweep(lambda p: (T.T @ M @ T, p * (T.T @ K @ T)), [1, 2, 4], modes=2, geometry=geometry)
    del swept.results[1]
    swept.save(tmp_path / "s.h5")
    for again in (kschur.load(tmp_path / "s.h5"), pickle.loads(pickle.dumps(swept)), copy.deepcopy(swept)):
        assert sorted(again.results) == [0, 2] and np.array_equal(again.eigenvalues, swept.eigenvalues)
        for point, result in again.results.items():
            assert np.array_equal(result.shapes, swept.results[point].shapes)
            moved = result.geometry.displacements(result.shape(1))[:, 2]
            assert moved[1] == moved[[0, 2]].mean() != 0
            assert result.geometry.transformation.toarray().tolist() == T.toarray().tolist()
    assert kschur.Result.read_point(tmp_path / "s.h5", 2).notes == swept.results[2].notes
    for point, words in ((1, "kschur sweep --shapes"), (3, "points 1 to 3"), (-1, "points 1 to 3"), (2**40, "points 1 to 3")):
        with pytest.raises(InputError, match=words):
            kschur.Result.read_point(tmp_path / "s.h5", point)
    with pytest.raises(InputError, match="a sweep, not a result"):
        kschur.Result.read(tmp_path / "s.h5")
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "s.h5", "r+") as file:
        del file["points/3/cells/types"]
    with pytest.raises(InputError, match="s.h5: point 3: the mesh: .*/cells/types"):
        kschur.load(tmp_path / "s.h5")
    with h5py.File(tmp_path / "s.h5", "r+") as file:
        del file["points"]
    assert kschur.load(tmp_path / "s.h5").results == {}


def test_branches_that_lie_on_each_other_are_told_apart():
    axes = kschur.sweep(jeffcott, [5, 20, 30], modes=3).campbell()
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["0", "1", "2 (on 1)"]
    assert [line.get_marker() for line in axes.lines[::2]] == [".", ".", "o"]


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda result: pickle.loads(pickle.dumps(result))])
def test_a_result_is_copied(copied, capsys):
    M, K = chain(12)
    result = kschur.solve(M, K, 0.01 * K, np.eye(1, 12), modes=4, left=True, properties=True, directions=np.ones(12),
                          geometry=kschur.Geometry(np.arange(4.0)[:, None]))
    again = copied(result)
    assert repr(again) == repr(result) and again.reason == result.reason and again.counts == result.counts
    for name in ("eigenvalues", "shapes", "multipliers", "left_shapes", "condition_number", "generalised_mass",
                 "participation_factors", "effective_mass", "error"):
        assert np.array_equal(getattr(again, name), getattr(result, name), equal_nan=True), name
    assert np.array_equal(again.geometry.lines(), result.geometry.lines())
    del again
    assert capsys.readouterr().err == ""


def test_a_handle_is_not_copied(capsys):
    with pytest.raises(TypeError, match="cannot be copied"):
        copy.copy(kschur.solve(*chain(3), modes=1)._handle)
    assert capsys.readouterr().err == ""


def test_responses_to_matrices_by_frequency():
    M, K = (matrix.toarray() for matrix in chain(5))
    hz, force = np.array([0.1, 0.2, 0.4]), np.eye(5)[0]
    stiffness = [(1 + frequency) * K for frequency in hz]
    damped = [0.1 * K / (2 * np.pi * frequency) for frequency in hz]
    wanted = np.array([np.linalg.solve((2j * np.pi * f)**2 * M + 2j * np.pi * f * r + k, force) for f, k, r in zip(hz, stiffness, damped)])
    for k in (stiffness, np.array(stiffness), lambda f: (1 + f) * K):
        found = kschur.frequency_response(M, k, damped, frequencies=hz, forces=force, threads=1)
        assert np.allclose(found.displacement, wanted, rtol=1e-11)
    part = kschur.frequency_response(M, stiffness, damped, frequencies=hz, forces=force, unknowns=[4, 1])
    assert np.allclose(part.displacement, wanted[:, [4, 1]], rtol=1e-11)
    with pytest.raises(UsageError, match="3 of K for 2 frequencies"):
        kschur.frequency_response(M, stiffness, frequencies=hz[:2], forces=force)
