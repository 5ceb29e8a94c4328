# The libraries below kschur, as one target kschur::libraries: MUMPS, METIS, AMD and COLAMD of SuiteSparse, BLAS
# and LAPACK, and, unless KSCHUR_WITH_ARPACK or KSCHUR_WITH_HDF5 is off, ARPACK and serial HDF5 with its Fortran interface.
#
# BLAS is OpenBLAS where there is one, else any; BLA_VENDOR says which (Generic: the reference BLAS).
#
# MUMPS is the sequential one, or, where KSCHUR_MPI is on, the other one with ScaLAPACK: never both, as two of them in one
# program overwrite each other. HDF5 is always the serial one.
# Never the parallel ARPACK either: it wants MPI.
# Never CHOLMOD or another GPL part of SuiteSparse: AMD and COLAMD are BSD.

include(FindPackageHandleStandardArgs)
find_package(PkgConfig QUIET)
if(PkgConfig_FOUND)
  pkg_check_modules(PC_HDF5 QUIET hdf5-serial)
  pkg_check_modules(PC_ARPACK QUIET arpack)
endif()

set(KschurLibraries_VARIABLES)
set(KschurLibraries_FOUND_LIBRARIES)
macro(kschur_find_library variable)
  find_library(KSCHUR_${variable}_LIBRARY NAMES ${ARGN} HINTS ${PC_HDF5_LIBRARY_DIRS} ${PC_ARPACK_LIBRARY_DIRS} PATH_SUFFIXES hdf5/serial)
  mark_as_advanced(KSCHUR_${variable}_LIBRARY)
  list(APPEND KschurLibraries_VARIABLES KSCHUR_${variable}_LIBRARY)
  list(APPEND KschurLibraries_FOUND_LIBRARIES "${KSCHUR_${variable}_LIBRARY}")
endmacro()

if(KSCHUR_MPI)
  set(KSCHUR_SEQ)
else()
  set(KSCHUR_SEQ _seq)
endif()
kschur_find_library(DMUMPS dmumps${KSCHUR_SEQ})
kschur_find_library(ZMUMPS zmumps${KSCHUR_SEQ})
kschur_find_library(SMUMPS smumps${KSCHUR_SEQ})
kschur_find_library(CMUMPS cmumps${KSCHUR_SEQ})
kschur_find_library(MUMPS_COMMON mumps_common${KSCHUR_SEQ})
kschur_find_library(MUMPS_PORD pord${KSCHUR_SEQ})
if(KSCHUR_MPI)
  kschur_find_library(SCALAPACK scalapack-openmpi scalapack)
else()
  kschur_find_library(MUMPS_MPISEQ mpiseq_seq)
endif()
kschur_find_library(METIS metis)
kschur_find_library(AMD amd)
kschur_find_library(COLAMD colamd)
find_path(KSCHUR_MUMPS_INCLUDE_DIR NAMES zmumps_struc.h)
mark_as_advanced(KSCHUR_MUMPS_INCLUDE_DIR)
list(APPEND KschurLibraries_VARIABLES KSCHUR_MUMPS_INCLUDE_DIR)
if(NOT DEFINED KSCHUR_WITH_ARPACK OR KSCHUR_WITH_ARPACK)
  kschur_find_library(ARPACK arpack)
endif()

if(NOT BLA_VENDOR AND NOT DEFINED ENV{BLA_VENDOR})
  set(BLA_VENDOR OpenBLAS)
  find_package(BLAS QUIET)
  find_package(LAPACK QUIET)
  unset(BLA_VENDOR)
endif()
if(NOT BLAS_FOUND OR NOT LAPACK_FOUND)
  find_package(BLAS QUIET)
  find_package(LAPACK QUIET)
endif()
set(KSCHUR_BLAS_LIBRARIES ${LAPACK_LIBRARIES} ${BLAS_LIBRARIES})
list(REMOVE_DUPLICATES KSCHUR_BLAS_LIBRARIES)
list(APPEND KschurLibraries_VARIABLES KSCHUR_BLAS_LIBRARIES)
list(APPEND KschurLibraries_FOUND_LIBRARIES ${KSCHUR_BLAS_LIBRARIES})

if(NOT DEFINED KSCHUR_WITH_HDF5 OR KSCHUR_WITH_HDF5)
  kschur_find_library(HDF5_FORTRAN hdf5_serial_fortran hdf5_fortran)
  kschur_find_library(HDF5 hdf5_serial hdf5)
  find_path(KSCHUR_HDF5_MODULE_DIR NAMES hdf5.mod HINTS ${PC_HDF5_INCLUDE_DIRS} PATH_SUFFIXES hdf5/serial)
  mark_as_advanced(KSCHUR_HDF5_MODULE_DIR)
  list(APPEND KschurLibraries_VARIABLES KSCHUR_HDF5_MODULE_DIR)
endif()

# CMake looks for threads in C and C++ only.
if(CMAKE_C_COMPILER_LOADED OR CMAKE_CXX_COMPILER_LOADED)
  find_package(Threads REQUIRED)
elseif(NOT TARGET Threads::Threads)
  add_library(Threads::Threads INTERFACE IMPORTED)
  set_target_properties(Threads::Threads PROPERTIES INTERFACE_LINK_LIBRARIES pthread)
endif()
find_package_handle_standard_args(KschurLibraries REQUIRED_VARS ${KschurLibraries_VARIABLES})

if(KschurLibraries_FOUND AND NOT TARGET kschur::libraries)
  add_library(kschur::libraries INTERFACE IMPORTED)
  set_target_properties(kschur::libraries PROPERTIES
    INTERFACE_LINK_LIBRARIES "${KschurLibraries_FOUND_LIBRARIES};Threads::Threads")
endif()
