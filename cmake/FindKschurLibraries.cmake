# The libraries below kschur, as one target kschur::libraries: sequential MUMPS, METIS,
# AMD of SuiteSparse, ARPACK, OpenBLAS (with LAPACK) and serial HDF5 with its Fortran interface.
#
# Never the MPI build of MUMPS or HDF5: two of them in one program overwrite each other.
# Never the parallel ARPACK either: it wants MPI.
# Never CHOLMOD or another GPL part of SuiteSparse: AMD is BSD.

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

kschur_find_library(DMUMPS dmumps_seq)
kschur_find_library(ZMUMPS zmumps_seq)
kschur_find_library(SMUMPS smumps_seq)
kschur_find_library(CMUMPS cmumps_seq)
kschur_find_library(MUMPS_COMMON mumps_common_seq)
kschur_find_library(MUMPS_PORD pord_seq)
kschur_find_library(MUMPS_MPISEQ mpiseq_seq)
kschur_find_library(METIS metis)
kschur_find_library(AMD amd)
kschur_find_library(ARPACK arpack)
kschur_find_library(OPENBLAS openblas)
kschur_find_library(HDF5_FORTRAN hdf5_serial_fortran hdf5_fortran)
kschur_find_library(HDF5 hdf5_serial hdf5)

find_path(KSCHUR_MUMPS_INCLUDE_DIR NAMES zmumps_struc.h)
find_path(KSCHUR_HDF5_MODULE_DIR NAMES hdf5.mod HINTS ${PC_HDF5_INCLUDE_DIRS} PATH_SUFFIXES hdf5/serial)
mark_as_advanced(KSCHUR_MUMPS_INCLUDE_DIR KSCHUR_HDF5_MODULE_DIR)

find_package(Threads REQUIRED)
find_package_handle_standard_args(KschurLibraries
  REQUIRED_VARS ${KschurLibraries_VARIABLES} KSCHUR_MUMPS_INCLUDE_DIR KSCHUR_HDF5_MODULE_DIR)

if(KschurLibraries_FOUND AND NOT TARGET kschur::libraries)
  add_library(kschur::libraries INTERFACE IMPORTED)
  set_target_properties(kschur::libraries PROPERTIES
    INTERFACE_LINK_LIBRARIES "${KschurLibraries_FOUND_LIBRARIES};Threads::Threads")
endif()
