!> Approximate minimum degree orders, by AMD of SuiteSparse: faster than nested dissection, and as good for factors with little
!> fill.
module kschur_minimum_degree
   use, intrinsic :: iso_c_binding, only: c_double, c_int
   use kschur_error, only: error_type, new_error, error_library, error_memory
   implicit none
   private
   public :: minimum_degree_order

   integer, parameter :: control_size = 5, info_size = 20, out_of_memory = -1, invalid = -2

   interface
      subroutine amd_defaults(control) bind(C)
         import :: c_double
         real(c_double), intent(out) :: control(*)
      end subroutine amd_defaults

      integer(c_int) function amd_order(n, start, row, order, control, info) bind(C)
         import :: c_double, c_int
         integer(c_int), value :: n
         integer(c_int), intent(in) :: start(*), row(*)
         integer(c_int), intent(out) :: order(*)
         real(c_double), intent(in) :: control(*)
         real(c_double), intent(out) :: info(*)
      end function amd_order
   end interface

contains

   !> position(i) is the place of unknown i in the elimination order of a square matrix of the given pattern
   !> (CSR, 1-based, not necessarily symmetric).
   subroutine minimum_degree_order(row_start, column, position, error)
      integer, intent(in) :: row_start(:), column(:)
      integer, allocatable, intent(out) :: position(:)
      type(error_type), allocatable, intent(out) :: error
      integer(c_int), allocatable :: start(:), row(:), order(:)
      real(c_double) :: control(control_size), info(info_size)
      integer :: n, i

      n = size(row_start) - 1
      allocate (start, source=row_start - 1)
      allocate (row, source=column - 1)
      allocate (order(n), position(n))
      call amd_defaults(control)
      select case (amd_order(n, start, row, order, control, info))
      case (out_of_memory)
         call new_error(error, error_memory, "no memory for the elimination order")
      case (invalid)
         call new_error(error, error_library, "AMD could not order the matrix")
      case default
         do i = 1, n
            position(order(i) + 1) = i
         end do
      end select
   end subroutine minimum_degree_order
end module kschur_minimum_degree
