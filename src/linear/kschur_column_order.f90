!> Fill-reducing column orders for sparse LU with partial pivoting, by COLAMD of SuiteSparse: they bound the fill for any choice
!> of pivot rows.
module kschur_column_order
   use, intrinsic :: iso_c_binding, only: c_int, c_null_ptr, c_ptr, c_size_t
   use kschur_error, only: error_type, new_error, error_library, error_memory
   implicit none
   private
   public :: minimum_degree_columns

   integer, parameter :: stats_size = 20

   interface
      integer(c_size_t) function colamd_recommended(entries, rows, columns) bind(C)
         import :: c_int, c_size_t
         integer(c_int), value :: entries, rows, columns
      end function colamd_recommended

      integer(c_int) function colamd(rows, columns, length, row, start, control, stats) bind(C)
         import :: c_int, c_ptr
         integer(c_int), value :: rows, columns, length
         integer(c_int), intent(inout) :: row(*), start(*)
         !> Null: the default values.
         type(c_ptr), value :: control
         integer(c_int), intent(out) :: stats(*)
      end function colamd
   end interface

contains

   !> order(k) is the k-th column in the order of elimination. The matrix is given by columns (1-based).
   subroutine minimum_degree_columns(rows, column_start, row, order, error)
      integer, intent(in) :: rows
      integer, intent(in) :: column_start(:), row(:)
      integer, allocatable, intent(out) :: order(:)
      type(error_type), allocatable, intent(out) :: error
      integer(c_int), allocatable :: work(:), start(:)
      integer(c_int) :: stats(stats_size)
      integer(c_size_t) :: length
      integer :: columns, stat

      columns = size(column_start) - 1
      length = colamd_recommended(size(row), rows, columns)
      if (length > 0 .and. length < huge(stat)) then
         allocate (work(length), stat=stat)
      else
         stat = 1
      end if
      if (stat /= 0) then
         call new_error(error, error_memory, "no memory for the elimination order")
         return
      end if
      work(:size(row)) = row - 1
      allocate (start, source=column_start - 1)
      if (colamd(rows, columns, int(length, c_int), work, start, c_null_ptr, stats) == 0) then
         call new_error(error, error_library, "COLAMD could not order the matrix")
         return
      end if
      allocate (order, source=start(:columns) + 1)
   end subroutine minimum_degree_columns
end module kschur_column_order
