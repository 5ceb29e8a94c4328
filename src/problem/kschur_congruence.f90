!> Reduced matrices T^T A T, T with few entries a row.
module kschur_congruence
   use kschur_error, only: error_type
   use kschur_kinds, only: long, wp
   use kschur_sparse, only: csr_matrix_type, new_csr_from_triplets
   use kschur_tolerances, only: cancelled, rounding_of_row
   implicit none
   private
   public :: reduce

contains

   !> Computes T^T A T. Of a symmetric matrix one half is summed and mirrored, since sums in another order round differently.
   subroutine reduce(expansion, matrix, symmetric, reduced, error)
      !> T, n x n'.
      type(csr_matrix_type), intent(in) :: expansion, matrix
      logical, intent(in) :: symmetric
      type(csr_matrix_type), intent(out) :: reduced
      type(error_type), allocatable, intent(out) :: error
      integer, allocatable :: row(:), column(:)
      real(wp), allocatable :: value(:)
      integer :: length(matrix%rows)
      integer(long) :: entries
      integer :: r, k, l, h, i, j

      length = expansion%row_start(2:) - expansion%row_start(:matrix%rows)
      entries = 0
      do r = 1, matrix%rows
         do k = matrix%row_start(r), matrix%row_start(r + 1) - 1
            entries = entries + length(r)*length(matrix%column(k))
         end do
      end do
      entries = merge(2_long, 1_long, symmetric)*entries + 1
      allocate (row(entries), column(entries), value(entries))
      entries = 0
      do r = 1, matrix%rows
         do k = matrix%row_start(r), matrix%row_start(r + 1) - 1
            do l = expansion%row_start(r), expansion%row_start(r + 1) - 1
               i = expansion%column(l)
               do h = expansion%row_start(matrix%column(k)), expansion%row_start(matrix%column(k) + 1) - 1
                  j = expansion%column(h)
                  if (symmetric .and. i > j) cycle
                  row(entries + 1:entries + 2) = [i, j]
                  column(entries + 1:entries + 2) = [j, i]
                  value(entries + 1:entries + 2) = expansion%value(l)*expansion%value(h)*matrix%value(k)
                  entries = entries + merge(2, 1, symmetric .and. i < j)
               end do
            end do
         end do
      end do
      call new_csr_from_triplets(reduced, expansion%columns, expansion%columns, row(:entries), column(:entries), &
         value(:entries), error)
      if (.not. allocated(error)) call drop_rounding(row(:entries), column(:entries), value(:entries), reduced, error)
   end subroutine reduce

   ! Sets entries to zero whose sums cancel to rounding, if there is a row in which all sums do, as for a motion without forces.
   subroutine drop_rounding(row, column, value, reduced, error)
      integer, intent(in) :: row(:), column(:)
      real(wp), intent(in) :: value(:)
      type(csr_matrix_type), intent(inout) :: reduced
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: terms
      real(wp) :: largest(reduced%rows)
      integer :: k

      largest = 0
      do k = 1, size(row)
         largest(row(k)) = max(largest(row(k)), abs(value(k)))
      end do
      if (.not. any(reduced%row_maxima() < cancelled*largest)) return
      call new_csr_from_triplets(terms, reduced%rows, reduced%columns, row, column, abs(value), error)
      if (allocated(error)) return
      where (abs(reduced%value) <= rounding_of_row*terms%value) reduced%value = 0
   end subroutine drop_rounding

end module kschur_congruence
