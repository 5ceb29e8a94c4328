# Not tried: Spack could not be reached where this was written. README.md says what to look at first.
from spack.package import *


class Kschur(CMakePackage):
    """Modes of damped, constrained, possibly unsymmetric structures."""

    license("BSD-3-Clause")

    version("0.2.0")

    variant("shared", default=True, description="Shared libraries")
    variant("openmp", default=True, description="All cores, by OpenMP")
    variant("arpack", default=True, description="The method arpack")
    variant("hdf5", default=True, description="HDF5 files")

    depends_on("c", type="build")
    depends_on("fortran", type="build")
    depends_on("cmake@3.25:", type="build")
    depends_on("pkgconfig", type="build")
    depends_on("mumps@5.5: ~mpi+double+float+complex+shared")
    depends_on("metis@5:")
    depends_on("suite-sparse@5:")
    depends_on("blas")
    depends_on("lapack")
    depends_on("arpack-ng@3.8: ~mpi", when="+arpack")
    depends_on("hdf5 +fortran~mpi", when="+hdf5")

    def cmake_args(self):
        return [
            self.define_from_variant("BUILD_SHARED_LIBS", "shared"),
            self.define_from_variant("KSCHUR_OPENMP", "openmp"),
            self.define_from_variant("KSCHUR_WITH_ARPACK", "arpack"),
            self.define_from_variant("KSCHUR_WITH_HDF5", "hdf5"),
            self.define("KSCHUR_BUILD_EXAMPLES", False),
            self.define("KSCHUR_BUILD_BENCHMARKS", False),
        ]
