"""What every peer does: its command line, the paper's pencil, its memory, its result."""

import argparse
import pathlib
import sys

import numpy as np
import scipy.sparse as sp

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))

from kschur_report.problem import read_problem  # noqa: E402
from kschur_report.result import Result, write_result  # noqa: E402


def peak_memory_bytes():
    """Largest resident size of this process so far."""
    with open("/proc/self/status") as status:
        return next(int(line.split()[1]) * 1024 for line in status if line.startswith("VmHWM"))


def arguments(methods):
    """METHOD PROBLEM --eigenvalues N --shift S --tolerance T --output FILE [--constraint-scaling scalar|none]
    [--quadratic-scaling none|scalar]."""
    parser = argparse.ArgumentParser()
    parser.add_argument("method", choices=methods)
    parser.add_argument("problem")
    parser.add_argument("--eigenvalues", type=int, required=True, help="a conjugate pair counts as two")
    parser.add_argument("--shift", type=float, required=True, help="where to factor, 1/s")
    parser.add_argument("--tolerance", type=float, required=True)
    parser.add_argument("--output", required=True)
    parser.add_argument("--constraint-scaling", choices=["scalar", "none"], default="scalar")
    parser.add_argument("--quadratic-scaling", choices=["none", "scalar"], default="none", help="of M, R and K, by SLEPc")
    return parser.parse_args()


def constraint_factor(problem, options):
    """What the paper multiplies the constraints by: the mean size of a stiffness over that of a constraint entry."""
    sizes = [abs(matrix.data[matrix.data != 0]) for matrix in (problem.stiffness, problem.constraints)]
    if options.constraint_scaling == "none" or min(map(len, sizes)) == 0:
        return 1.0
    return sizes[0].mean() / sizes[1].mean()


def pencil(problem):
    """A and B of the paper's (33): the state is (phi, lambda phi, xi)."""
    n, m = problem.unknowns, problem.constraints.shape[0]
    identity = sp.identity(n, format="csr")
    a = sp.bmat(
        [
            [None, identity, None],
            [-problem.stiffness, -problem.damping, -problem.constraints.T],
            [-problem.constraints, None, None if m == 0 else sp.csr_matrix((m, m))],
        ],
        format="csr",
    )
    b = sp.block_diag([identity, problem.mass, sp.csr_matrix((m, m))], format="csr")
    return a, b


def write(options, problem, factor, values, states, facts):
    """Writes the result; `states` (modes x unknowns) begin with phi and end with xi of constraints that have the factor."""
    m = problem.constraints.shape[0]
    states = np.asarray(states, dtype=complex)
    result = Result(
        np.asarray(values, dtype=complex),
        states[:, : problem.unknowns],
        factor * states[:, states.shape[1] - m :],
        dict(facts, peak_memory_bytes=peak_memory_bytes()),
    )
    write_result(options.output, result)
