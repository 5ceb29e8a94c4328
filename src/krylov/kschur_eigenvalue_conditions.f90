!> Condition numbers of the eigenvalues of a Schur factor.
module kschur_eigenvalue_conditions
   use kschur_error, only: error_type, new_error, error_library
   use kschur_kinds, only: wp
   use kschur_lapack, only: ztrevc
   use kschur_projected, only: make_triangular
   use kschur_text, only: text
   implicit none
   private
   public :: eigenvalue_conditions

   !> Computes 1/|y^* x| for each eigenvalue, x and y its right and left eigenvectors of unit norm. There is at least one
   !> eigenvalue.
   interface eigenvalue_conditions
      module procedure eigenvalue_conditions_complex, eigenvalue_conditions_real
   end interface eigenvalue_conditions

contains

   subroutine eigenvalue_conditions_complex(t, conditions, error)
      complex(wp), intent(in) :: t(:, :)
      real(wp), intent(out) :: conditions(:)
      type(error_type), allocatable, intent(out) :: error
      complex(wp), allocatable :: copy(:, :), left(:, :), right(:, :)
      complex(wp) :: work(2*size(t, 1))
      real(wp) :: rwork(size(t, 1))
      logical :: all_of_them(1)
      integer :: n, j, computed, info

      n = size(t, 1)
      if (n == 0) return
      allocate (left(n, n), right(n, n))
      allocate (copy, source=t)
      all_of_them = .true.
      call ztrevc("B", "A", all_of_them, n, copy, n, left, n, right, n, n, computed, work, rwork, info)
      if (info /= 0) then
         call new_error(error, error_library, &
            "LAPACK could not compute eigenvectors of the projected problem: ztrevc returned "//text(info))
         return
      end if
      do j = 1, n
         conditions(j) = norm2(abs(left(j:, j)))*norm2(abs(right(:j, j)))/max(abs(left(j, j)*right(j, j)), tiny(1.0_wp))
      end do
   end subroutine eigenvalue_conditions_complex

   subroutine eigenvalue_conditions_real(t, conditions, error)
      real(wp), intent(in) :: t(:, :)
      real(wp), intent(out) :: conditions(:)
      type(error_type), allocatable, intent(out) :: error
      complex(wp), allocatable :: triangular(:, :), blocks(:, :, :)

      call make_triangular(t, triangular, blocks)
      call eigenvalue_conditions(triangular, conditions, error)
   end subroutine eigenvalue_conditions_real
end module kschur_eigenvalue_conditions
