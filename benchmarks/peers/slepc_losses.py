"""SLEPc on a quadratic problem with losses, in complex arithmetic: slepc_losses.py PROBLEM --eigenvalues N --shift RE IM
--tolerance T --output FILE. Two-level orthogonal Arnoldi with its scaling on (lambda^2 M + lambda R + K + i H) bordered by the
constraints; the complex symmetric matrix at the shift is factored by MUMPS."""

import argparse
import time

import h5py
import numpy as np
import scipy.sparse as sp
from peer import peak_memory_bytes, read_problem
from petsc4py import PETSc
from slepc4py import SLEPc

from kschur_report.problem import read_matrix


def petsc_matrix(matrix):
    csr = sp.csr_matrix(matrix)
    csr.sort_indices()
    types = PETSc.IntType
    return PETSc.Mat().createAIJ(csr.shape, csr=(csr.indptr.astype(types), csr.indices.astype(types), csr.data.astype(complex)))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("problem")
    parser.add_argument("--eigenvalues", type=int, required=True)
    parser.add_argument("--shift", type=float, nargs=2, required=True)
    parser.add_argument("--tolerance", type=float, required=True)
    parser.add_argument("--output", required=True)
    options = parser.parse_args()
    problem = read_problem(options.problem)
    n, m = problem.unknowns, problem.constraints.shape[0]
    with h5py.File(options.problem) as file:
        loss = read_matrix(file, "loss", (n, n))
    PETSc.Options()["st_mat_mumps_icntl_14"] = "300"
    before, started, used = peak_memory_bytes(), time.perf_counter(), time.process_time()
    nothing = sp.csr_matrix((m, m))
    # The paper's factor of the constraints.
    factor = abs(problem.stiffness.data).mean() / abs(problem.constraints.data).mean() if m else 1.0
    border = factor * problem.constraints
    solver = SLEPc.PEP().create()
    solver.setOperators([petsc_matrix(sp.bmat([[problem.stiffness + 1j * loss, border.T], [border, nothing]])),
                         petsc_matrix(sp.block_diag([problem.damping, nothing])),
                         petsc_matrix(sp.block_diag([problem.mass, nothing]))])
    solver.setProblemType(SLEPc.PEP.ProblemType.GENERAL)
    solver.setType("toar")
    solver.setScale(SLEPc.PEP.Scale.SCALAR)
    solver.setWhichEigenpairs(SLEPc.PEP.Which.TARGET_MAGNITUDE)
    solver.setTarget(complex(*options.shift))
    solver.setDimensions(options.eigenvalues)
    solver.setTolerances(options.tolerance, 1000)
    transform = solver.getST()
    transform.setType("sinvert")
    transform.getKSP().setType("preonly")
    preconditioner = transform.getKSP().getPC()
    preconditioner.setType("lu")
    preconditioner.setFactorSolverType("mumps")
    solver.setFromOptions()
    transform.setFromOptions()
    solver.solve()
    seconds, used = time.perf_counter() - started, time.process_time() - used
    right = solver.getOperators()[0].createVecRight()
    values, vectors = [], []
    for i in range(solver.getConverged()):
        values.append(solver.getEigenpair(i, right))
        vectors.append(right.getArray().copy())
    vectors = np.array(vectors).reshape(len(values), n + m)
    with h5py.File(options.output, "w") as file:
        file["eigenvalues"] = np.array(values, complex)
        file["eigenvectors"], file["multipliers"] = vectors[:, :n], factor * vectors[:, n:]
        file.attrs["seconds"], file.attrs["processor_seconds"] = seconds, used
        file.attrs["memory"] = peak_memory_bytes() - before


main()
