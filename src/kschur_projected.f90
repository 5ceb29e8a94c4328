!> The small dense problem inside a Krylov method: Schur form, reordering,
!> eigenvectors.
module kschur_projected
   use kschur_error, only: error_type, new_error, error_library
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgees, dtrevc, dtrsen, zgees, ztrevc, ztrsen
   use kschur_text, only: text
   implicit none
   private
   public :: schur_form, schur_values, move_to_head, triangular_eigenvectors, join_pairs

   !> Overwrites a square matrix by its Schur factor T, triangular or (real)
   !> quasi-triangular, so that it was U T U^*, and gives its eigenvalues.
   interface schur_form
      module procedure schur_form_complex, schur_form_real
   end interface schur_form

   !> The eigenvalues of a Schur factor.
   interface schur_values
      module procedure schur_values_complex, schur_values_real
   end interface schur_values

   !> Reorders a Schur form so that the selected eigenvalues come first, in the
   !> order they had; updates T, U and the eigenvalues. `moved` is false where
   !> two of a real form are too close to change places: then T and U are a
   !> Schur form in another order.
   interface move_to_head
      module procedure move_to_head_complex, move_to_head_real
   end interface move_to_head

   !> Eigenvectors of a Schur factor, as complex columns of unit norm.
   interface triangular_eigenvectors
      module procedure triangular_eigenvectors_complex, triangular_eigenvectors_real
   end interface triangular_eigenvectors

   !> Marks both of a conjugate pair of a real Schur form where one is marked.
   interface join_pairs
      module procedure join_pairs_complex, join_pairs_real
   end interface join_pairs

contains

   subroutine schur_form_complex(t, u, values, error)
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
   end subroutine schur_form_complex

   ! zgees wants a criterion even where it does not sort.
   logical function unsorted(value)
      complex(wp), intent(in) :: value

      unsorted = abs(value) < 0
   end function unsorted

   subroutine move_to_head_complex(selected, t, u, values, moved, error)
      logical, intent(in) :: selected(:)
      complex(wp), contiguous, intent(inout) :: t(:, :), u(:, :)
      complex(wp), intent(inout) :: values(:)
      logical, intent(out) :: moved
      type(error_type), allocatable, intent(out) :: error
      complex(wp) :: work(1)
      real(wp) :: s, separation
      integer :: n, count_selected, info

      n = size(t, 1)
      moved = .true.
      if (n == 0) return
      call ztrsen("N", "V", selected, n, t, n, u, n, values, count_selected, s, separation, work, 1, info)
      if (info /= 0) call new_error(error, error_library, &
         "LAPACK could not reorder the Schur form: ztrsen returned "//text(info))
   end subroutine move_to_head_complex

   subroutine triangular_eigenvectors_complex(t, vectors, error)
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
   end subroutine triangular_eigenvectors_complex

   subroutine schur_form_real(t, u, values, error)
      real(wp), contiguous, intent(inout) :: t(:, :)
      real(wp), contiguous, intent(out) :: u(:, :)
      complex(wp), intent(out) :: values(:)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: work(:)
      real(wp) :: work_size(1), re(size(t, 1)), im(size(t, 1))
      logical :: bwork(1)
      integer :: n, ignored, info

      n = size(t, 1)
      if (n == 0) return
      call dgees("V", "N", unsorted_real, n, t, n, ignored, re, im, u, n, work_size, -1, bwork, info)
      allocate (work(int(work_size(1))))
      call dgees("V", "N", unsorted_real, n, t, n, ignored, re, im, u, n, work, size(work), bwork, info)
      values = cmplx(re, im, wp)
      if (info /= 0) call new_error(error, error_library, &
         "LAPACK could not compute the Schur form of the projected problem: dgees returned "//text(info))
   end subroutine schur_form_real

   logical function unsorted_real(re, im)
      real(wp), intent(in) :: re, im

      unsorted_real = abs(re) + abs(im) < 0
   end function unsorted_real

   function schur_values_complex(t) result(values)
      complex(wp), intent(in) :: t(:, :)
      complex(wp) :: values(size(t, 1))
      integer :: i

      do i = 1, size(t, 1)
         values(i) = t(i, i)
      end do
   end function schur_values_complex

   ! LAPACK leaves a 2x2 block with equal diagonal entries and off-diagonal
   ! ones of opposite sign.
   function schur_values_real(t) result(values)
      real(wp), intent(in) :: t(:, :)
      complex(wp) :: values(size(t, 1))
      real(wp) :: imaginary
      integer :: i

      do i = 1, size(t, 1)
         values(i) = t(i, i)
      end do
      do i = 1, size(t, 1) - 1
         if (.not. abs(t(i + 1, i)) > 0) cycle
         imaginary = sqrt(abs(t(i, i + 1)))*sqrt(abs(t(i + 1, i)))
         values(i) = cmplx(t(i, i), imaginary, wp)
         values(i + 1) = conjg(values(i))
      end do
   end function schur_values_real

   subroutine move_to_head_real(selected, t, u, values, moved, error)
      logical, intent(in) :: selected(:)
      real(wp), contiguous, intent(inout) :: t(:, :), u(:, :)
      complex(wp), intent(inout) :: values(:)
      logical, intent(out) :: moved
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: too_close = 1
      real(wp) :: s, separation, work(max(1, size(t, 1))), re(size(t, 1)), im(size(t, 1))
      integer :: n, count_selected, info, iwork(1)

      n = size(t, 1)
      moved = .true.
      if (n == 0) return
      call dtrsen("N", "V", selected, n, t, n, u, n, re, im, count_selected, s, separation, work, n, iwork, 1, info)
      moved = info /= too_close
      values = cmplx(re, im, wp)
      if (info < 0) call new_error(error, error_library, &
         "LAPACK could not reorder the Schur form: dtrsen returned "//text(info))
   end subroutine move_to_head_real

   subroutine triangular_eigenvectors_real(t, vectors, error)
      real(wp), intent(in) :: t(:, :)
      complex(wp), allocatable, intent(out) :: vectors(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: parts(:, :)
      real(wp) :: unused(1, 1), work(3*size(t, 1)), copy(size(t, 1), size(t, 1))
      complex(wp) :: values(size(t, 1))
      logical :: all_of_them(1)
      integer :: n, j, computed, info

      n = size(t, 1)
      allocate (vectors(n, n), parts(n, n))
      if (n == 0) return
      copy = t
      all_of_them = .true.
      call dtrevc("R", "A", all_of_them, n, copy, n, unused, 1, parts, n, n, computed, work, info)
      if (info /= 0) then
         call new_error(error, error_library, &
            "LAPACK could not compute eigenvectors of the projected problem: dtrevc returned "//text(info))
         return
      end if
      values = schur_values(t)
      do j = 1, n
         if (aimag(values(j)) > 0) then
            vectors(:, j) = cmplx(parts(:, j), parts(:, j + 1), wp)
         else if (aimag(values(j)) < 0) then
            vectors(:, j) = conjg(vectors(:, j - 1))
         else
            vectors(:, j) = parts(:, j)
         end if
      end do
      do j = 1, n
         vectors(:, j) = vectors(:, j)/norm2(abs(vectors(:, j)))
      end do
   end subroutine triangular_eigenvectors_real

   subroutine join_pairs_complex(t, marked)
      complex(wp), intent(in) :: t(:, :)
      logical, intent(inout) :: marked(:)

      if (size(t, 1) /= size(marked)) marked = .false.
   end subroutine join_pairs_complex

   subroutine join_pairs_real(t, marked)
      real(wp), intent(in) :: t(:, :)
      logical, intent(inout) :: marked(:)
      integer :: i

      do i = 1, size(marked) - 1
         if (abs(t(i + 1, i)) > 0) marked(i:i + 1) = any(marked(i:i + 1))
      end do
   end subroutine join_pairs_real
end module kschur_projected
