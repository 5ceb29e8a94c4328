"""A mechanism of Exudyn, linearised at rest."""
from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..convert import Problem
from ..errors import InputError

# Of the coordinates, which are metres, radians and Euler parameters: half of the digits of central differences.
STEP = 1e-5
# The largest force without a balance, of the largest force: what a static solution of Newton's leaves is far below.
IN_BALANCE = 1e-6


def from_exudyn(mbs: Any) -> Problem:
    """M, K, R and Cq of an assembled main system, at rest in its initial coordinates (after `SolveStatic` the solution).

    K has the stiffness of the joints' reactions, d(Cq^T lambda)/dq, which Exudyn's `ComputeLinearizedSystem` and
    `ComputeODE2Eigenvalues` leave out: without it a chain that hangs by joints has no frequency. The reactions are those that balance
    the forces; raises InputError where none do. Joints must be holonomic; first-order states are not taken over."""
    import exudyn
    solver = exudyn.MainSolverStatic()
    settings = exudyn.SimulationSettings()
    settings.staticSolver.verboseMode = 0
    settings.solution.file.write = False
    solver.InitializeSolver(mbs, settings)
    n, m = solver.GetODE2size(), solver.GetAEsize()
    if solver.GetODE1size() > 0:
        raise InputError("the system has first-order states, which are not taken over")

    def jacobian() -> NDArray[np.float64]:
        return np.array(solver.GetSystemJacobian())[:n, :n]

    def constraints() -> NDArray[np.float64]:
        # What is computed is added to what is there.
        solver.SetSystemJacobian(np.zeros((n + m, n + m)))
        solver.ComputeJacobianAE(mbs, scalarFactor_ODE2=1.0, scalarFactor_ODE2_t=0.0, scalarFactor_ODE1=0.0, velocityLevel=False)
        return np.array(solver.GetSystemJacobian())[n:n + m, :n]

    try:
        solver.ComputeMassMatrix(mbs)
        mass = np.array(solver.GetSystemMassMatrix())[:n, :n]
        solver.ComputeJacobianODE2RHS(mbs, scalarFactor_ODE2=-1.0, scalarFactor_ODE2_t=0.0, scalarFactor_ODE1=0.0)
        stiffness = jacobian()
        solver.ComputeJacobianODE2RHS(mbs, scalarFactor_ODE2=0.0, scalarFactor_ODE2_t=-1.0, scalarFactor_ODE1=0.0)
        damping = jacobian()
        solver.ComputeODE2RHS(mbs)
        force = np.array(solver.GetSystemResidual())[:n]
        Cq = constraints()
        reaction = np.linalg.lstsq(Cq.T, force, rcond=None)[0]
        largest = np.abs(force).max(initial=0.0)
        if np.abs(Cq.T @ reaction - force).max(initial=0.0) > IN_BALANCE * largest:
            raise InputError("the system is not at rest: its joints do not balance its forces; SolveStatic(updateInitialValues=True) first")
        if m > 0 and largest > 0:
            stiffness += _of_reactions(mbs, lambda: constraints().T @ reaction, n)
    finally:
        solver.FinalizeSolver(mbs, settings)
    return Problem(sparse.csr_matrix(mass), sparse.csr_matrix(stiffness),
                   sparse.csr_matrix(damping) if damping.any() else None, sparse.csr_matrix(Cq) if m > 0 else None, None)


def _of_reactions(mbs: Any, forces: Any, n: int) -> NDArray[np.float64]:
    """How the forces of the joints, whose multipliers stay, change with each coordinate."""
    rest = np.array(mbs.systemData.GetODE2Coordinates())
    columns = np.zeros((n, n))
    for unknown in range(n):
        for step in (STEP, -STEP):
            moved = rest.copy()
            moved[unknown] += step
            mbs.systemData.SetODE2Coordinates(moved)
            columns[:, unknown] += forces() / (2 * step)
    mbs.systemData.SetODE2Coordinates(rest)
    # Rounding of the differences is no stiffness.
    columns[np.abs(columns) < 1e-9 * np.abs(columns).max()] = 0.0
    return (columns + columns.T) / 2
