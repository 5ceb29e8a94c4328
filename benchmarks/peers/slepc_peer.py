"""SLEPc on the matrices of a problem: slepc_peer.py METHOD PROBLEM --eigenvalues N ... (see peer.py).

pencil          Krylov-Schur on the paper's pencil (33), in the arithmetic of the PETSc that is loaded
toar            two-level orthogonal Arnoldi on the quadratic problem of order n + m
toar-cholesky   the same where the matrices are symmetric: MUMPS factors P(sigma) as one that is
symmetric       symmetric Krylov-Schur on K phi = omega^2 M phi with tied unknowns eliminated by hand
saddle          the same with the constraints as rows and columns of K, whose M has no entries
"""

import sys
import time

import numpy as np
import scipy.sparse as sp
from peer import arguments, constraint_factor, peak_memory_bytes, pencil, read_problem, write
from petsc4py import PETSc
from scipy.sparse.linalg import splu
from slepc4py import SLEPc
from ties import NotApplicable, damping_coefficients, tied_unknowns

EVENTS = {
    "analyze": ("MatLUFactorSym", "MatCholFctrSym"),
    "factorize": ("MatLUFactorNum", "MatCholFctrNum"),
    "solve": ("MatSolve",),
    "orthogonalize": ("BVOrthogonalize", "BVOrthogonalizeV"),
}
# Orderings of MUMPS made little difference on the beam grids; room for pivots it needs.
MUMPS = {"st_mat_mumps_icntl_14": "300"}


def petsc_matrix(matrix):
    csr = sp.csr_matrix(matrix)
    csr.sort_indices()
    types = PETSc.IntType
    return PETSc.Mat().createAIJ(csr.shape, csr=(csr.indptr.astype(types), csr.indices.astype(types), csr.data))


def factor_by_mumps(transform, kind):
    preconditioner = transform.getKSP().getPC()
    preconditioner.setType(kind)
    preconditioner.setFactorSolverType("mumps")
    transform.getKSP().setType("preonly")


def eigenproblem(a, b, kind, options, shift):
    solver = SLEPc.EPS().create()
    solver.setOperators(petsc_matrix(a), petsc_matrix(b))
    solver.setProblemType(kind)
    solver.setType("krylovschur")
    solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    solver.setTarget(shift)
    solver.setDimensions(options.eigenvalues)
    solver.setTolerances(options.tolerance, 1000)
    solver.getST().setType("sinvert")
    return solver


def solve_pencil(problem, options):
    solver = eigenproblem(*pencil(problem), SLEPc.EPS.ProblemType.GNHEP, options, options.shift)
    factor_by_mumps(solver.getST(), "lu")
    return solver


def solve_toar(problem, options):
    if options.method == "toar-cholesky" and not is_symmetric(problem):
        raise NotApplicable("its matrices are not symmetric")
    m = problem.constraints.shape[0]
    nothing = sp.csr_matrix((m, m))
    stiffness = sp.bmat([[problem.stiffness, problem.constraints.T], [problem.constraints, nothing]])
    solver = SLEPc.PEP().create()
    solver.setOperators(
        [
            petsc_matrix(stiffness),
            petsc_matrix(sp.block_diag([problem.damping, nothing])),
            petsc_matrix(sp.block_diag([problem.mass, nothing])),
        ]
    )
    solver.setProblemType(SLEPc.PEP.ProblemType.GENERAL)
    solver.setType("toar")
    if options.quadratic_scaling == "scalar":
        solver.setScale(SLEPc.PEP.Scale.SCALAR)
    solver.setWhichEigenpairs(SLEPc.PEP.Which.TARGET_MAGNITUDE)
    solver.setTarget(options.shift)
    solver.setDimensions(options.eigenvalues)
    solver.setTolerances(options.tolerance, 1000)
    solver.getST().setType("sinvert")
    factor_by_mumps(solver.getST(), "cholesky" if options.method == "toar-cholesky" else "lu")
    return solver


def is_symmetric(problem):
    """To rounding, as of elements that are summed in another order."""
    matrices = (problem.mass, problem.damping, problem.stiffness)
    return all(abs(a - a.T).max() <= 1e-14 * abs(a).max() for a in matrices)


def pairs(solver):
    """Values and vectors as a real PETSc (two vectors) or a complex one (one) returns them."""
    is_real = np.issubdtype(PETSc.ScalarType, np.floating)
    operators = solver.getOperators()
    right, imaginary = operators[0].createVecs()
    values, vectors = [], []
    for i in range(solver.getConverged()):
        if isinstance(solver, SLEPc.EPS):
            value = solver.getEigenvalue(i)
            solver.getEigenvector(i, right, imaginary)
        else:
            value = solver.getEigenpair(i, right, imaginary)
        values.append(value)
        vectors.append(right.getArray() + 1j * imaginary.getArray() if is_real else right.getArray().copy())
    return np.array(values), np.array(vectors)


def symmetric_modes(problem, options):
    """Undamped modes with tied unknowns eliminated, and from them the damped ones."""
    ties = tied_unknowns(problem.constraints)
    alpha, beta = damping_coefficients(problem)
    stiffness, mass = (sp.csr_matrix(ties.T @ matrix @ ties) for matrix in (problem.stiffness, problem.mass))
    options.eigenvalues = (options.eigenvalues + 1) // 2
    solver = eigenproblem(stiffness, mass, SLEPc.EPS.ProblemType.GHEP, options, -options.shift**2)
    factor_by_mumps(solver.getST(), "cholesky")
    return solver, lambda values, vectors: damped_modes(values, vectors, ties, problem, alpha, beta)


def saddle_modes(problem, options):
    """Undamped modes with their multipliers mu; those of a damped one are (1 + beta lambda) mu."""
    if not is_symmetric(problem):
        raise NotApplicable("its matrices are not symmetric")
    alpha, beta = damping_coefficients(problem)
    n, m = problem.unknowns, problem.constraints.shape[0]
    stiffness = sp.bmat([[problem.stiffness, problem.constraints.T], [problem.constraints, None]])
    mass = sp.block_diag([problem.mass, sp.csr_matrix((m, m))])
    options.eigenvalues = (options.eigenvalues + 1) // 2
    solver = eigenproblem(stiffness, mass, SLEPc.EPS.ProblemType.GHEP, options, -options.shift**2)
    factor_by_mumps(solver.getST(), "cholesky")

    def finish(values, states):
        roots = damped_roots(np.real(values), alpha, beta)
        states = np.tile(np.real(states), (2, 1)).astype(complex)
        states[:, n:] *= (1 + beta * roots)[:, None]
        return roots, states

    return solver, finish


def damped_roots(squares, alpha, beta):
    """Of lambda^2 + (alpha + beta omega^2) lambda + omega^2 = 0 for each omega^2, first one of each, then the other."""
    half = (alpha + beta * squares) / 2
    spread = np.sqrt((half**2 - squares).astype(complex))
    return np.concatenate([-half + spread, -half - spread])


def damped_modes(values, vectors, ties, problem, alpha, beta):
    """Both roots of each mode, multipliers by least squares."""
    roots = damped_roots(np.real(values), alpha, beta)
    shapes = np.tile(np.real(vectors @ ties.T), (2, 1))
    forces = np.array(
        [
            root**2 * (problem.mass @ x) + root * (problem.damping @ x) + problem.stiffness @ x
            for root, x in zip(roots, shapes)
        ]
    )
    normal = sp.csc_matrix(problem.constraints @ problem.constraints.T)
    if normal.shape[0] == 0:
        return roots, shapes
    projected = problem.constraints @ forces.T
    factors = splu(normal)
    multipliers = -(factors.solve(projected.real) + 1j * factors.solve(projected.imag))
    return roots, np.hstack([shapes, multipliers.T])


def seconds_by_phase():
    return {
        "seconds_" + phase: sum(PETSc.Log.Event(name).getPerfInfo()["time"] for name in names)
        for phase, names in EVENTS.items()
    }


def main():
    options = arguments(["pencil", "toar", "toar-cholesky", "symmetric", "saddle"])
    baseline = peak_memory_bytes()
    problem = read_problem(options.problem)
    for name, value in MUMPS.items():
        PETSc.Options().setValue(name, value)
    PETSc.Log.begin()
    factor = constraint_factor(problem, options)
    problem.constraints = factor * problem.constraints
    begin = time.perf_counter()
    finish = lambda values, vectors: (values, vectors)  # noqa: E731
    try:
        if options.method == "pencil":
            solver = solve_pencil(problem, options)
        elif options.method == "symmetric":
            solver, finish = symmetric_modes(problem, options)
        elif options.method == "saddle":
            solver, finish = saddle_modes(problem, options)
        else:
            solver = solve_toar(problem, options)
    except NotApplicable as reason:
        sys.exit(f"does not apply: {reason}")
    solver.setFromOptions()
    solver.solve()
    values, states = finish(*pairs(solver))
    total = time.perf_counter() - begin
    applications = PETSc.Log.Event("MatSolve").getPerfInfo()["count"]
    write(
        options,
        problem,
        factor,
        values,
        states,
        dict(
            seconds_by_phase(),
            seconds_total=total,
            operator_applications=applications,
            baseline_memory_bytes=baseline,
            restarts=solver.getIterationNumber(),
            reason=reason_of(solver),
            library=f"SLEPc {'.'.join(map(str, SLEPc.Sys.getVersion()))}, PETSc {'.'.join(map(str, PETSc.Sys.getVersion()))}",
        ),
    )


def reason_of(solver):
    return "converged" if solver.getConvergedReason() > 0 else f"SLEPc reason {solver.getConvergedReason()}"


if __name__ == "__main__":
    main()
