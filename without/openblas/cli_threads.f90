!> In the place of the module of this name where kschur is built with another BLAS than OpenBLAS.
module cli_threads
   use kschur, only: error_type, error_usage, new_error, text
   implicit none
   private
   public :: set_threads

contains

   !> Fails: the BLAS cannot be told.
   subroutine set_threads(threads, error)
      integer, intent(in) :: threads
      type(error_type), allocatable, intent(inout) :: error

      if (.not. allocated(error)) call new_error(error, error_usage, &
         "--threads "//text(threads)//": the BLAS of this program is not OpenBLAS, and has its own way to set them")
   end subroutine set_threads
end module cli_threads
