"""SciPy's eigs (ARPACK, SuperLU) on the paper's pencil (33): scipy_peer.py eigs PROBLEM ... (see peer.py)."""

import time

import numpy as np
import scipy
import scipy.sparse.linalg as spl
from peer import arguments, constraint_factor, peak_memory_bytes, pencil, read_problem, write


def main():
    options = arguments(["eigs"])
    baseline = peak_memory_bytes()
    problem = read_problem(options.problem)
    factor = constraint_factor(problem, options)
    problem.constraints = factor * problem.constraints
    begin = time.perf_counter()
    a, b = pencil(problem)
    factors = spl.splu((a - options.shift * b).tocsc())
    factorized = time.perf_counter() - begin
    solves = []

    def solve(x):
        started = time.perf_counter()
        y = factors.solve(x)
        solves.append(time.perf_counter() - started)
        return y

    inverse = spl.LinearOperator(a.shape, solve, dtype=float)
    start = np.random.default_rng(1).standard_normal(a.shape[0])
    values, vectors = spl.eigs(
        a, options.eigenvalues, M=b, sigma=options.shift, OPinv=inverse, v0=start, tol=options.tolerance, maxiter=1000
    )
    total = time.perf_counter() - begin
    write(
        options,
        problem,
        factor,
        values,
        vectors.T,
        dict(
            seconds_total=total,
            seconds_factorize=factorized,
            seconds_solve=sum(solves),
            operator_applications=len(solves),
            baseline_memory_bytes=baseline,
            reason="converged",
            library=f"SciPy {scipy.__version__}",
        ),
    )


if __name__ == "__main__":
    main()
