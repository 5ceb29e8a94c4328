"""The methods that are compared: how each is called, what it is called on the page, how it is drawn."""

import os
import pathlib
import sys
from dataclasses import dataclass

from . import slepc

PEERS = pathlib.Path(__file__).resolve().parent.parent / "peers"
REFERENCE_TOLERANCE = 1e-12  # of the run of kschur that says which eigenvalues there are
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "OMP_WAIT_POLICY": "PASSIVE"}


@dataclass(frozen=True)
class Method:
    """`options` follow the problem; a peer is a script of the folder peers and its first argument."""

    name: str
    label: str
    settings: str
    colour: str
    marker: str
    options: tuple = ()
    script: str = ""
    argument: str = ""
    arithmetic: str = ""

    @property
    def formulation(self):
        """The one that it forces; empty where it forces none."""
        return self.options[1] if self.options[:1] == ("--formulation",) else ""

    @property
    def is_peer(self):
        return bool(self.script)

    @property
    def is_other(self):
        """Whether it is another eigensolver, in our operators or in its own program."""
        return self.is_peer or "arpack" in self.options


# Colours of Okabe and Ito and of Tol, made for colour-blind readers; markers say the same.
METHODS = {
    method.name: method
    for method in (
        Method("auto", "kschur", "as it comes: the smallest exact formulation", "#0072B2", "o"),
        Method(
            "quadratic",
            "kschur (quadratic)",
            "the form for any damping, order n + m",
            "#56B4E9",
            "s",
            ("--formulation", "quadratic"),
        ),
        Method(
            "low-rank",
            "kschur (low-rank)",
            "the form for few dampers, order n + m",
            "#44AA99",
            "d",
            ("--formulation", "low-rank"),
        ),
        Method(
            "dense",
            "kschur (dense)",
            "all eigenvalues by LAPACK, for small problems",
            "#332288",
            "p",
            ("--formulation", "dense"),
        ),
        Method(
            "pencil",
            "kschur (pencil 33)",
            "the paper's pencil, order 2n + m, complex MUMPS LU, kschur's scaling and shift",
            "#009E73",
            "^",
            ("--formulation", "damped-constrained"),
        ),
        Method(
            "pencil-zero",
            "kschur (pencil 34)",
            "the same with spurious zeros",
            "#117733",
            "v",
            ("--formulation", "damped-constrained-zero"),
        ),
        Method(
            "arpack-fair",
            "ARPACK (fair)",
            "ARPACK in the place of Krylov-Schur, all else the same",
            "#E69F00",
            "D",
            ("--method", "arpack", "--arpack", "fair"),
        ),
        Method(
            "arpack-plain",
            "ARPACK (plain)",
            "as the paper uses it: pencil (33), shift 1e-3 1/s, no scaling",
            "#D55E00",
            "X",
            ("--method", "arpack", "--arpack", "plain"),
        ),
        Method(
            "slepc-toar",
            "SLEPc TOAR",
            "PEP TOAR on the quadratic problem of order n + m, real, MUMPS LU (ICNTL(14) = 300, its own ordering)",
            "#CC79A7",
            "P",
            (),
            "slepc_peer.py",
            "toar",
            "real",
        ),
        Method(
            "slepc-toar-unscaled",
            "SLEPc TOAR (unscaled)",
            "the same, constraints as given",
            "#999933",
            "p",
            ("--constraint-scaling", "none"),
            "slepc_peer.py",
            "toar",
            "real",
        ),
        Method(
            "slepc-toar-scaled",
            "SLEPc TOAR (scaled)",
            "TOAR with the matrices scaled by SLEPc (PEP_SCALE_SCALAR), which makes its modes as accurate as others'",
            "#88CCEE",
            "8",
            ("--quadratic-scaling", "scalar"),
            "slepc_peer.py",
            "toar",
            "real",
        ),
        Method(
            "slepc-toar-cholesky",
            "SLEPc TOAR (Cholesky)",
            "the same where the matrices are symmetric: MUMPS factors P(shift) as one that is",
            "#DDCC77",
            "H",
            ("--quadratic-scaling", "scalar"),
            "slepc_peer.py",
            "toar-cholesky",
            "real",
        ),
        Method(
            "slepc-saddle",
            "SLEPc symmetric (constraints)",
            "EPS Krylov-Schur on K phi + Cq^T mu = omega^2 M phi, Cq phi = 0, for any constraints, proportional damping put back "
            "by formula, MUMPS Cholesky",
            "#AA7744",
            "d",
            (),
            "slepc_peer.py",
            "saddle",
            "real",
        ),
        Method(
            "slepc-real",
            "SLEPc Krylov-Schur (real)",
            "EPS Krylov-Schur on the pencil (33), real, MUMPS LU",
            "#882255",
            "<",
            (),
            "slepc_peer.py",
            "pencil",
            "real",
        ),
        Method(
            "slepc-complex",
            "SLEPc Krylov-Schur (complex)",
            "EPS Krylov-Schur on the pencil (33), complex, MUMPS LU",
            "#661100",
            ">",
            (),
            "slepc_peer.py",
            "pencil",
            "complex",
        ),
        Method(
            "slepc-symmetric",
            "SLEPc symmetric",
            "EPS Krylov-Schur on K phi = omega^2 M phi, tied unknowns eliminated by hand, proportional damping put back by formula, "
            "MUMPS Cholesky",
            "#AA4499",
            "h",
            (),
            "slepc_peer.py",
            "symmetric",
            "real",
        ),
        Method(
            "scipy",
            "SciPy eigs",
            "ARPACK in scipy.sparse.linalg.eigs on the pencil (33), real, SuperLU",
            "#000000",
            "*",
            (),
            "scipy_peer.py",
            "eigs",
        ),
    )
}
OURS = tuple(name for name, method in METHODS.items() if not method.is_peer)
PEER_NAMES = tuple(name for name, method in METHODS.items() if method.is_peer)


def missing(method):
    """Why a method cannot run here; empty where it can."""
    if method.arithmetic and slepc.environment(method.arithmetic) is None:
        return f"SLEPc ({method.arithmetic}) is not installed: apt-get install python3-slepc4py-{method.arithmetic}"
    return ""


def shift_for_peers(ours):
    """Our shift (1/s) or, where that is zero, which is an eigenvalue of what is free, the lowest |lambda| above it."""
    shift = float(abs(ours.facts["shift"]))
    sizes = abs(ours.eigenvalues)
    return shift if shift > 0 else float(min(sizes[sizes > 0]))


@dataclass(frozen=True)
class Question:
    """What every method is asked: the lowest modes. Peers count both of a pair, and are given our shift (1/s)."""

    modes: int
    eigenvalues: int = 0
    shift: float = 0.0


def command(method, kschur, problem, question, tolerance, output, extra=()):
    """The command line and the environment of one run."""
    environment = dict(os.environ, **ONE_THREAD)
    if not method.is_peer:
        return [
            str(kschur),
            "solve",
            str(problem),
            "--modes",
            str(question.modes),
            "--tolerance",
            repr(tolerance),
            *(() if "--threads" in extra else ("--threads", "1")),
            "--quiet",
            "--output",
            str(output),
            *method.options,
            *extra,
        ], environment
    if method.arithmetic:
        environment.update(slepc.environment(method.arithmetic))
    return [
        sys.executable,
        str(PEERS / method.script),
        method.argument,
        str(problem),
        "--eigenvalues",
        str(question.eigenvalues),
        "--shift",
        repr(question.shift),
        "--tolerance",
        repr(tolerance),
        "--output",
        str(output),
        *method.options,
    ], environment
