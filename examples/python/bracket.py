"""A bracket of steel by scikit-fem (from PyPI), clamped by constraints, with a rubber foot. bracket.py [PICTURE]"""
import sys

import numpy as np
import scipy.sparse as sparse
import skfem
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

import kschur

mesh = skfem.MeshTet.init_tensor(np.linspace(0, 0.2, 13), np.linspace(0, 0.2, 13), np.linspace(0, 0.05, 4))
mesh = mesh.remove_elements(np.flatnonzero(np.all(mesh.p[:2, mesh.t].mean(axis=1) > 0.05, axis=0)))
basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTetP1()))
K = linear_elasticity(*lame_parameters(210e9, 0.3)).assemble(basis)
M = skfem.BilinearForm(lambda u, v, _: 7850 * dot(u, v)).assemble(basis)
clamped = basis.get_dofs(lambda x: x[1] > 0.2 - 1e-9).all()
foot = basis.get_dofs(lambda x: x[0] > 0.2 - 1e-9).all()
R = sparse.coo_matrix((np.full(foot.size, 50.0), (foot, foot)), K.shape)
Cq = sparse.identity(K.shape[0], format="csr")[clamped]

geometry = kschur.Geometry(mesh.p.T, *np.divmod(np.argsort(basis.nodal_dofs.T.ravel()), 3), cells={"tetra": mesh.t.T})
result = kschur.solve(M, K, R, Cq, modes=6, geometry=geometry)
print(result)
if len(sys.argv) > 1:
    result.plot_shape(0).figure.savefig(sys.argv[1], dpi=120)
