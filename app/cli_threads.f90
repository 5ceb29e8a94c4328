!> The number of threads of the dense linear algebra, by OpenBLAS.
module cli_threads
   use, intrinsic :: iso_c_binding, only: c_int
   use kschur, only: error_type
   implicit none
   private
   public :: set_threads

   interface
      subroutine openblas_set_num_threads(threads) bind(c, name="openblas_set_num_threads")
         import :: c_int
         integer(c_int), value :: threads
      end subroutine openblas_set_num_threads
   end interface

contains

   !> Sets it; fails where the BLAS of this program cannot be told.
   subroutine set_threads(threads, error)
      integer, intent(in) :: threads
      type(error_type), allocatable, intent(inout) :: error

      if (.not. allocated(error)) call openblas_set_num_threads(int(threads, c_int))
   end subroutine set_threads
end module cli_threads
