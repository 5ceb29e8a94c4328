!> Right and left eigenvectors of a Schur factor, and the condition numbers of its eigenvalues.
module kschur_eigenvalue_conditions
   use kschur_error, only: error_type, new_error, error_library
   use kschur_kinds, only: wp
   use kschur_lapack, only: ztrevc
   use kschur_projected, only: make_triangular
   use kschur_text, only: text
   implicit none
   private
   public :: eigenvalue_conditions, two_sided_eigenvectors

   !> Computes 1/|y^* x| for each eigenvalue, x and y its right and left eigenvectors of unit norm. There is at least one
   !> eigenvalue.
   interface eigenvalue_conditions
      module procedure eigenvalue_conditions_complex, eigenvalue_conditions_real
   end interface eigenvalue_conditions

   !> Computes all right eigenvectors, of unit norm, and left ones with y^* x = 1, in the order of the diagonal.
   interface two_sided_eigenvectors
      module procedure two_sided_eigenvectors_complex, two_sided_eigenvectors_real
   end interface two_sided_eigenvectors

contains

   subroutine two_sided_eigenvectors_complex(t, left, right, error)
      complex(wp), intent(in) :: t(:, :)
      complex(wp), allocatable, intent(out) :: left(:, :), right(:, :)
      type(error_type), allocatable, intent(out) :: error
      complex(wp), allocatable :: copy(:, :)
      complex(wp) :: work(2*size(t, 1)), product
      real(wp) :: rwork(size(t, 1))
      logical :: all_of_them(1)
      integer :: n, j, computed, info

      n = size(t, 1)
      allocate (left(n, n), right(n, n))
      if (n == 0) return
      allocate (copy, source=t)
      all_of_them = .true.
      call ztrevc("B", "A", all_of_them, n, copy, n, left, n, right, n, n, computed, work, rwork, info)
      if (info /= 0) then
         call new_error(error, error_library, &
            "LAPACK could not compute eigenvectors of the projected problem: ztrevc returned "//text(info))
         return
      end if
      do j = 1, n
         right(:, j) = right(:, j)/norm2(abs(right(:j, j)))
         product = conjg(left(j, j))*right(j, j)
         left(:, j) = left(:, j)/max(abs(product), tiny(1.0_wp))*merge(product/max(abs(product), tiny(1.0_wp)), (1.0_wp, 0.0_wp), &
            abs(product) > 0)
      end do
   end subroutine two_sided_eigenvectors_complex

   subroutine two_sided_eigenvectors_real(t, left, right, error)
      real(wp), intent(in) :: t(:, :)
      complex(wp), allocatable, intent(out) :: left(:, :), right(:, :)
      type(error_type), allocatable, intent(out) :: error
      complex(wp), allocatable :: triangular(:, :), blocks(:, :, :)
      integer :: i

      call make_triangular(t, triangular, blocks)
      call two_sided_eigenvectors(triangular, left, right, error)
      if (allocated(error)) return
      do i = 1, size(t, 1) - 1
         if (.not. abs(t(i + 1, i)) > 0) cycle
         left(i:i + 1, :) = matmul(blocks(:, :, i), left(i:i + 1, :))
         right(i:i + 1, :) = matmul(blocks(:, :, i), right(i:i + 1, :))
      end do
   end subroutine two_sided_eigenvectors_real

   subroutine eigenvalue_conditions_complex(t, conditions, error)
      complex(wp), intent(in) :: t(:, :)
      real(wp), intent(out) :: conditions(:)
      type(error_type), allocatable, intent(out) :: error
      complex(wp), allocatable :: left(:, :), right(:, :)
      integer :: j

      call two_sided_eigenvectors(t, left, right, error)
      if (allocated(error)) return
      conditions = [(norm2(abs(left(:, j))), j=1, size(conditions))]
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
