"""A thick cantilever of steel by scikit-fem (from PyPI), of quadratic tetrahedra."""
import numpy as np
import scipy.sparse as sparse
import skfem
from comparison import lines_of, report, timed
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

import kschur

MODES = 10


def build():
    mesh = skfem.MeshTet.init_tensor(np.linspace(0, 1.0, 17), np.linspace(0, 0.3, 6), np.linspace(0, 0.05, 3))
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTetP2()))
    K = linear_elasticity(*lame_parameters(210e9, 0.3)).assemble(basis)
    M = skfem.BilinearForm(lambda u, v, _: 7850 * dot(u, v)).assemble(basis)
    return basis, K, M


def own(basis, K, M):
    clamped = basis.get_dofs(lambda x: x[0] < 1e-9)
    squares, _ = skfem.solve(*skfem.condense(K, M, D=clamped), solver=skfem.solver_eigen_scipy_sym(k=MODES, sigma=0.0))
    return np.sqrt(np.sort(squares)) / (2*np.pi)


def glue(basis, K, M):
    clamped = basis.get_dofs(lambda x: x[0] < 1e-9).all()
    Cq = sparse.identity(K.shape[0], format="csr")[clamped]
    node, component = np.full(K.shape[0], -1), np.zeros(K.shape[0], int)
    for direction, unknowns in enumerate(basis.nodal_dofs):
        node[unknowns], component[unknowns] = np.arange(len(unknowns)), direction
    geometry = kschur.Geometry(basis.mesh.p.T, node, component, cells={"tetra": basis.mesh.t.T})
    return dict(M=M, K=K, Cq=Cq, geometry=geometry)


model = build()
theirs, seconds = timed(lambda: own(*model))
matrices, taken = timed(lambda: glue(*model))
result, solved = timed(lambda: kschur.solve(**matrices, modes=MODES))
print(result)
report("scikit-fem", "cantilever of quadratic tetrahedra", result.unknowns, lines_of(glue), result.frequency_hz, theirs, taken, solved, seconds)
