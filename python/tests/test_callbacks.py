"""Functions of the caller: they are told, may cancel, may solve, and their exceptions come out."""
import os
import signal
import time

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sparse
import scipy.sparse.linalg
from test_solve import chain, chain_omega, damped

import kschur
from kschur._callbacks import Callbacks


def test_progress_is_told_and_may_cancel():
    M, K = chain(400)
    calls = []
    kschur.solve(M, K, modes=30, formulation="symmetric", subspace=40, progress=lambda *state: calls.append(state))
    assert len(calls) > 1 and all(wanted >= 30 for _, _, wanted, _ in calls)
    stopped = kschur.solve(M, K, modes=30, formulation="symmetric", subspace=40, progress=lambda *state: True)
    assert stopped.reason == "cancelled" and len(stopped) < 30 and not stopped.converged
    assert stopped.message.endswith("cancelled")


def test_an_exception_in_progress_comes_out():
    def interrupt(*_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        kschur.solve(*chain(400), modes=30, formulation="symmetric", progress=interrupt)
    assert len(kschur.solve(*chain(40), modes=3)) == 3


def test_an_interrupt_ends_a_solve_at_its_next_step(monkeypatch):
    n = 200
    K = sparse.kronsum(*[sparse.diags([-1, 2, -1], [-1, 0, 1], (n, n))] * 2).tocsr()
    M, asked, stop = sparse.identity(n * n, format="csr"), [], Callbacks._stop
    monkeypatch.setattr(Callbacks, "_stop", lambda self, context: asked.append(0) or stop(self, context))
    # Reports do not hear of it.
    monkeypatch.setattr(Callbacks, "_report", lambda *_: 0)
    began = time.process_time()
    kschur.solve(M, K, modes=20, threads=1)
    seconds, whole = time.process_time() - began, len(asked)
    asked.clear()
    handler = signal.getsignal(signal.SIGINT)
    signal.signal(signal.SIGPROF, lambda *_: os.kill(os.getpid(), signal.SIGINT))
    signal.setitimer(signal.ITIMER_PROF, seconds/2)
    with pytest.raises(KeyboardInterrupt):
        kschur.solve(M, K, modes=20, threads=1)
    assert 0 < len(asked) < whole and signal.getsignal(signal.SIGINT) is handler


def test_an_interrupt_ends_a_response(monkeypatch):
    M, K = chain(50)
    asked, stop = [], Callbacks._stop

    def interrupt_third(self, context):
        asked.append(0)
        if len(asked) == 3:
            os.kill(os.getpid(), signal.SIGINT)
        return stop(self, context)

    monkeypatch.setattr(Callbacks, "_stop", interrupt_third)
    with pytest.raises(KeyboardInterrupt):
        kschur.frequency_response(M, K, frequencies=np.linspace(0.3, 0.6, 50), forces=np.eye(50)[0])
    assert 3 <= len(asked) < 10


def test_a_sweep_ends_with_the_points_before():
    M, K = chain(200)
    ended = []

    def matrices(p):
        ended.append(p)
        return M, (1 + p) * K

    def stop(*_):
        return len(ended) > 2

    assert list(kschur.sweep(matrices, [0, 1, 2, 3, 4], modes=3, formulation="symmetric", progress=stop).values) == [0, 1]
    assert len(ended) == 3

    def fail(*_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        kschur.sweep(matrices, [0, 1], modes=3, formulation="symmetric", progress=fail)


@pytest.mark.parametrize("wanted", [{}, {"target": -0.1 + 1.1j}])
def test_own_linear_solver(wanted):
    M, K, R = damped(150, 1)
    kinds = []

    def factorize(matrix):
        kinds.append(matrix.dtype)
        return scipy.sparse.linalg.splu(matrix)

    own = kschur.solve(M, K, R, modes=6, formulation="quadratic", linear_solver=factorize, left=True, **wanted)
    theirs = kschur.solve(M, K, R, modes=6, formulation="quadratic", left=True, **wanted)
    assert (np.complex128 if wanted else np.float64) in kinds and own.inner.startswith("callbacks")
    assert np.allclose(own.eigenvalues, theirs.eigenvalues, rtol=1e-10)
    assert np.allclose(own.condition_number, theirs.condition_number, rtol=1e-6)
    assert own.backward_error.max() < 1e-12


def test_a_singular_matrix_is_told():
    # Free at both ends: the matrix at zero is singular for sure.
    M, K = chain(150)
    K = K.tolil()
    K[0, 0] = K[-1, -1] = 1
    result = kschur.solve(M, K, modes=3, shift=0, formulation="symmetric", linear_solver=scipy.sparse.linalg.splu)
    assert result.kind[0] == "rigid"
    assert np.allclose(result.eigenvalues.imag[1:], 2 * np.sin(np.arange(1, 3) * np.pi / 300), rtol=1e-9)


@pytest.mark.parametrize("broken", ["factorize", "solve"])
def test_an_exception_in_a_linear_solver_comes_out(broken):
    class Broken:
        def __init__(self, _matrix):
            if broken == "factorize":
                raise ZeroDivisionError("of the caller")

        def solve(self, _b, _trans):
            raise ZeroDivisionError("of the caller")

    with pytest.raises(ZeroDivisionError, match="of the caller"):
        kschur.solve(*damped(150, 2), modes=3, formulation="quadratic", linear_solver=Broken)


def test_threads_may_solve_at_the_same_time():
    from concurrent.futures import ThreadPoolExecutor
    sizes = [60, 80, 100, 120] * 3
    with ThreadPoolExecutor(4) as pool:
        results = list(pool.map(lambda n: kschur.solve(*chain(n), modes=4), sizes))
    for n, result in zip(sizes, results):
        assert np.allclose(result.eigenvalues.imag, chain_omega(n)[:4], rtol=1e-11)
