"""A steel block with a hole, clamped at one end, by NGSolve (from PyPI), of elements of third order."""
import ngsolve as ng
import numpy as np
import scipy.sparse as sparse
from comparison import lines_of, report, timed
from netgen.occ import Box, Cylinder, OCCGeometry, Pnt, X, Z

import kschur

MODES = 8
E, NU, RHO = 210e9, 0.3, 7850.0


def build():
    shape = Box(Pnt(0, 0, 0), Pnt(1.0, 0.4, 0.1)) - Cylinder(Pnt(0.6, 0.2, 0), Z, r=0.1, h=0.1)
    shape.faces.Min(X).name = "clamped"
    mesh = ng.Mesh(OCCGeometry(shape).GenerateMesh(maxh=0.12))
    space = ng.VectorH1(mesh, order=3, dirichlet="clamped")
    u, v = space.TnT()
    mu, lam = E/2/(1 + NU), E*NU/((1 + NU)*(1 - 2*NU))
    strain = ng.Sym(ng.Grad(u))
    K = ng.BilinearForm(2*mu*ng.InnerProduct(strain, ng.Sym(ng.Grad(v)))*ng.dx + lam*ng.div(u)*ng.div(v)*ng.dx)
    M = ng.BilinearForm(RHO*u*v*ng.dx)
    return space, K.Assemble(), M.Assemble()


def own(space, K, M):
    factors = K.mat.Inverse(space.FreeDofs(), inverse="sparsecholesky")
    squares, _ = ng.solvers.PINVIT(K.mat, M.mat, pre=factors, num=MODES, maxit=20, printrates=False)
    return np.sqrt(np.array(list(squares))) / (2*np.pi)


def glue(space, K, M):
    matrices = {name: sparse.csr_matrix(form.mat.CSR(), shape=(space.ndof, space.ndof)) for name, form in (("M", M), ("K", K))}
    clamped = ~np.array(list(space.FreeDofs()))
    return dict(matrices, Cq=sparse.identity(space.ndof, format="csr")[clamped])


model = build()
theirs, seconds = timed(lambda: own(*model))
matrices, taken = timed(lambda: glue(*model))
result, solved = timed(lambda: kschur.solve(**matrices, modes=MODES))
print(result)
report("ngsolve", "block with a hole of third order", result.unknowns, lines_of(glue), result.frequency_hz, theirs, taken, solved, seconds)
