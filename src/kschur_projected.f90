!> The small dense problem inside a Krylov method: Schur form, reordering,
!> eigenvectors.
module kschur_projected
   use kschur_error, only: error_type, new_error, error_library
   use kschur_kinds, only: wp
   use kschur_lapack, only: zgees, ztrevc, ztrsen
   use kschur_text, only: text
   implicit none
   private
   public :: schur_form, move_to_head, triangular_eigenvectors

contains

   !> Overwrites a square matrix by its upper triangular Schur factor T, so
   !> that it was U T U^*.
   subroutine schur_form(t, u, values, error)
      complex(wp), contiguous, intent(inout) :: t(:, :)
      !> Unitary Schur vectors, of the shape of t.
      complex(wp), contiguous, intent(out) :: u(:, :)
      !> The eigenvalues: the diagonal of T.
      complex(wp), intent(out) :: values(:)
      type(error_type), allocatable, intent(out) :: error
      complex(wp), allocatable :: work(:)
      complex(wp) :: work_size(1)
      real(wp) :: rwork(size(t, 1))
      logical :: bwork(1)
      integer :: n, ignored, info

      n = size(t, 1)
      if (n == 0) return
      call zgees("V", "N", unsorted, n, t, n, ignored, values, u, n, work_size, -1, rwork, bwork, info)
      allocate (work(int(work_size(1))))
      call zgees("V", "N", unsorted, n, t, n, ignored, values, u, n, work, size(work), rwork, bwork, info)
      if (info /= 0) call new_error(error, error_library, &
         "LAPACK could not compute the Schur form of the projected problem: zgees returned "//text(info))
   end subroutine schur_form

   ! zgees wants a criterion even where it does not sort.
   logical function unsorted(value)
      complex(wp), intent(in) :: value

      unsorted = abs(value) < 0
   end function unsorted

   !> Reorders a Schur form so that the selected eigenvalues come first, in
   !> the order they had; updates T, U and the eigenvalues.
   subroutine move_to_head(selected, t, u, values, error)
      logical, intent(in) :: selected(:)
      complex(wp), contiguous, intent(inout) :: t(:, :), u(:, :)
      complex(wp), intent(inout) :: values(:)
      type(error_type), allocatable, intent(out) :: error
      complex(wp) :: work(1)
      real(wp) :: s, separation
      integer :: n, count_selected, info

      n = size(t, 1)
      if (n == 0) return
      call ztrsen("N", "V", selected, n, t, n, u, n, values, count_selected, s, separation, work, 1, info)
      if (info /= 0) call new_error(error, error_library, &
         "LAPACK could not reorder the Schur form: ztrsen returned "//text(info))
   end subroutine move_to_head

   !> Eigenvectors of an upper triangular matrix, as columns of unit norm.
   subroutine triangular_eigenvectors(t, vectors, error)
      complex(wp), intent(in) :: t(:, :)
      complex(wp), allocatable, intent(out) :: vectors(:, :)
      type(error_type), allocatable, intent(out) :: error
      complex(wp), allocatable :: copy(:, :)
      complex(wp) :: unused(1, 1), work(2*size(t, 1))
      real(wp) :: rwork(size(t, 1))
      logical :: all_of_them(1)
      integer :: n, j, computed, info

      n = size(t, 1)
      allocate (vectors(n, n), copy(n, n))
      if (n == 0) return
      copy = t
      all_of_them = .true.
      call ztrevc("R", "A", all_of_them, n, copy, n, unused, 1, vectors, n, n, computed, work, rwork, info)
      if (info /= 0) then
         call new_error(error, error_library, &
            "LAPACK could not compute eigenvectors of the projected problem: ztrevc returned "//text(info))
         return
      end if
      do j = 1, n
         vectors(:, j) = vectors(:, j)/norm2(abs(vectors(:, j)))
      end do
   end subroutine triangular_eigenvectors
end module kschur_projected
