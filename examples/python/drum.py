"""From matrices of SciPy to a picture: a rectangular drum by finite differences. drum.py [PICTURE]

Its frequencies in units of the grid are sqrt(sin^2(i pi / 80) + sin^2(j pi / 60)) / (pi h), i = 1, 2, ..., j = 1, 2, ...
"""
import sys

import numpy as np
import scipy.sparse as sparse

import kschur

nx, ny, h = 39, 29, 0.025
along_x, along_y = (sparse.diags([-1, 2, -1], [-1, 0, 1], (n, n)) / h**2 for n in (nx, ny))
y, x = np.mgrid[1:ny + 1, 1:nx + 1] * h

result = kschur.solve(sparse.identity(nx * ny), sparse.kronsum(along_x, along_y), modes=6,
                      geometry=kschur.Geometry(np.column_stack([x.ravel(), y.ravel()])))
print(result)
if len(sys.argv) > 1:
    result.plot_shape(4).figure.savefig(sys.argv[1])
