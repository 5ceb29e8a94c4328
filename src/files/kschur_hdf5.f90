!> Problems and results in HDF5 files.
module kschur_hdf5
   use kschur_hdf5_problem, only: read_hdf5_problem, write_hdf5_problem
   use kschur_hdf5_result, only: read_hdf5_result, write_hdf5_result
   implicit none
   private
   public :: read_hdf5_problem, write_hdf5_problem, read_hdf5_result, write_hdf5_result
end module kschur_hdf5
