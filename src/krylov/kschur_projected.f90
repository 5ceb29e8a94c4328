!> The small dense problem inside a Krylov method: Schur form, reordering,
!> eigenvectors.
module kschur_projected
   use kschur_error, only: error_type, new_error, error_library
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgees, dsyevd, dtrevc, dtrsen, zgees, ztrevc, ztrsen
   use kschur_text, only: text
   implicit none
   private
   public :: schur_form, schur_values, move_to_head, eigenvector_couplings, independent_eigenvectors, join_pairs, &
      keep_one_of_pairs, make_triangular, symmetric_eigenvectors

   !> Overwrites a square matrix by its Schur factor T, triangular or (real)
   !> quasi-triangular, so that it was U T U^*, and gives its eigenvalues.
   interface schur_form
      module procedure schur_form_complex, schur_form_real
   end interface schur_form

   !> The eigenvalues of a Schur factor.
   interface schur_values
      module procedure schur_values_complex, schur_values_real
   end interface schur_values

   !> Reorders a Schur form so that the selected eigenvalues come first, in the order they had; updates T, U and the
   !> eigenvalues. `moved` is false if two of a real form are too close to be swapped; T and U are then a Schur form in another
   !> order.
   interface move_to_head
      module procedure move_to_head_complex, move_to_head_real
   end interface move_to_head

   !> Norms of the products of given rows with the unit eigenvectors of a Schur factor: with the rows of B^* U the residual norms
   !> of Ritz pairs.
   interface eigenvector_couplings
      module procedure eigenvector_couplings_complex, eigenvector_couplings_real
   end interface eigenvector_couplings

   !> Computes selected eigenvectors of a Schur factor, as complex columns of unit norm, linearly independent for a multiple
   !> eigenvalue: couplings below `noise`, relative to the eigenvalue, are set to zero, since they do not distinguish a multiple
   !> eigenvalue from a defective one.
   interface independent_eigenvectors
      module procedure independent_eigenvectors_complex, independent_eigenvectors_real
   end interface independent_eigenvectors

   !> Marks both members of a conjugate pair of a real Schur form if one is marked.
   interface join_pairs
      module procedure join_pairs_complex, join_pairs_real
   end interface join_pairs

   !> Keeps one of each conjugate pair of the chosen eigenvalues of a real Schur form, the one with negative imaginary part, and
   !> marks those that stand for a pair.
   interface keep_one_of_pairs
      module procedure keep_one_of_pairs_complex, keep_one_of_pairs_real
   end interface keep_one_of_pairs

contains

   !> Overwrites a symmetric matrix by orthonormal eigenvectors, and gives its eigenvalues, ascending.
   subroutine symmetric_eigenvectors(a, values, error)
      real(wp), contiguous, intent(inout) :: a(:, :)
      real(wp), allocatable, intent(out) :: values(:)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: work(:)
      integer, allocatable :: iwork(:)
      integer :: n, info

      n = size(a, 1)
      allocate (values(n), work(1 + 6*n + 2*n**2), iwork(3 + 5*n))
      call dsyevd("V", "U", n, a, max(n, 1), values, work, size(work), iwork, size(iwork), info)
      if (info /= 0) call new_error(error, error_library, &
         "LAPACK could not compute the eigenvalues of a symmetric matrix: dsyevd returned "//text(info))
   end subroutine symmetric_eigenvectors

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
      call zgees("V", "N", no_sort, n, t, n, ignored, values, u, n, work_size, -1, rwork, bwork, info)
      allocate (work(int(work_size(1))))
      call zgees("V", "N", no_sort, n, t, n, ignored, values, u, n, work, size(work), rwork, bwork, info)
      if (info /= 0) call new_error(error, error_library, &
         "LAPACK could not compute the Schur form of the projected problem: zgees returned "//text(info))
   end subroutine schur_form_complex

   ! zgees needs this argument even if it does not sort.
   logical function no_sort(value)
      complex(wp), intent(in) :: value

      no_sort = abs(value) < 0
   end function no_sort

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

   subroutine eigenvector_couplings_complex(t, rows, couplings, error)
      complex(wp), intent(in) :: t(:, :), rows(:, :)
      real(wp), intent(out) :: couplings(:)
      type(error_type), allocatable, intent(out) :: error
      complex(wp), allocatable :: copy(:, :), vectors(:, :)
      complex(wp) :: unused(1, 1), work(2*size(t, 1))
      real(wp) :: rwork(size(t, 1))
      logical :: all_of_them(1)
      integer :: n, j, computed, info

      n = size(t, 1)
      if (n == 0) return
      allocate (vectors(n, n))
      allocate (copy, source=t)
      all_of_them = .true.
      call ztrevc("R", "A", all_of_them, n, copy, n, unused, 1, vectors, n, n, computed, work, rwork, info)
      if (info /= 0) then
         call new_error(error, error_library, &
            "LAPACK could not compute eigenvectors of the projected problem: ztrevc returned "//text(info))
         return
      end if
      do j = 1, n
         couplings(j) = norm2(abs(matmul(rows(:, :j), vectors(:j, j))))/norm2(abs(vectors(:j, j)))
      end do
   end subroutine eigenvector_couplings_complex

   ! Back substitution as in LAPACK, except for copies of an eigenvalue: their coupling is the residual of the whole row, not a
   ! single entry of T.
   subroutine independent_eigenvectors_complex(t, noise, chosen, vectors)
      complex(wp), intent(in) :: t(:, :)
      real(wp), intent(in) :: noise
      !> The positions of their eigenvalues.
      integer, intent(in) :: chosen(:)
      complex(wp), allocatable, intent(out) :: vectors(:, :)
      ! Copies whose vectors have an angle above noise times this are independent as they are.
      real(wp), parameter :: parallel = 100
      complex(wp) :: gap
      real(wp) :: smallest
      integer :: i, j, k

      allocate (vectors(size(t, 1), size(chosen)), source=(0.0_wp, 0.0_wp))
      smallest = max(epsilon(1.0_wp)*maxval([0.0_wp, abs(t)]), tiny(1.0_wp))
      do k = 1, size(chosen)
         j = chosen(k)
         associate (y => vectors(:, k))
            y(j) = 1
            y(:j - 1) = -t(:j - 1, j)
            do i = j - 1, 1, -1
               gap = t(i, i) - t(j, j)
               if (abs(gap) <= parallel*abs(y(i)) .and. abs(y(i)) <= noise*abs(t(j, j))*norm2(abs(y(i + 1:j)))) then
                  y(i) = 0
                  cycle
               end if
               if (abs(gap) < smallest) gap = smallest
               y(i) = y(i)/gap
               y(:i - 1) = y(:i - 1) - y(i)*t(:i - 1, i)
               y(:j) = y(:j)/max(1.0_wp, abs(y(i)))
            end do
            y(:j) = y(:j)/norm2(abs(y(:j)))
         end associate
      end do
   end subroutine independent_eigenvectors_complex

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
      call dgees("V", "N", no_sort_real, n, t, n, ignored, re, im, u, n, work_size, -1, bwork, info)
      allocate (work(int(work_size(1))))
      call dgees("V", "N", no_sort_real, n, t, n, ignored, re, im, u, n, work, size(work), bwork, info)
      values = cmplx(re, im, wp)
      if (info /= 0) call new_error(error, error_library, &
         "LAPACK could not compute the Schur form of the projected problem: dgees returned "//text(info))
   end subroutine schur_form_real

   logical function no_sort_real(re, im)
      real(wp), intent(in) :: re, im

      no_sort_real = abs(re) + abs(im) < 0
   end function no_sort_real

   function schur_values_complex(t) result(values)
      complex(wp), intent(in) :: t(:, :)
      complex(wp) :: values(size(t, 1))
      integer :: i

      do i = 1, size(t, 1)
         values(i) = t(i, i)
      end do
   end function schur_values_complex

   ! LAPACK standardises 2x2 blocks: equal diagonal entries, off-diagonal ones of opposite sign.
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

   subroutine eigenvector_couplings_real(t, rows, couplings, error)
      real(wp), intent(in) :: t(:, :), rows(:, :)
      real(wp), intent(out) :: couplings(:)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: copy(:, :), parts(:, :)
      real(wp) :: unused(1, 1), work(3*size(t, 1))
      logical :: all_of_them(1)
      integer :: n, j, last, computed, info

      n = size(t, 1)
      if (n == 0) return
      allocate (parts(n, n))
      allocate (copy, source=t)
      all_of_them = .true.
      call dtrevc("R", "A", all_of_them, n, copy, n, unused, 1, parts, n, n, computed, work, info)
      if (info /= 0) then
         call new_error(error, error_library, &
            "LAPACK could not compute eigenvectors of the projected problem: dtrevc returned "//text(info))
         return
      end if
      ! LAPACK returns real and imaginary parts of the vector of a conjugate pair.
      j = 1
      do while (j <= n)
         last = j
         if (j < n) then
            if (abs(t(j + 1, j)) > 0) last = j + 1
         end if
         couplings(j:last) = norm2(matmul(rows(:, :last), parts(:last, j:last)))/norm2(parts(:last, j:last))
         j = last + 1
      end do
   end subroutine eigenvector_couplings_real

   subroutine independent_eigenvectors_real(t, noise, chosen, vectors)
      real(wp), intent(in) :: t(:, :)
      real(wp), intent(in) :: noise
      integer, intent(in) :: chosen(:)
      complex(wp), allocatable, intent(out) :: vectors(:, :)
      complex(wp), allocatable :: triangular(:, :), blocks(:, :, :)
      integer :: first(size(chosen)), i, k
      logical :: conjugate(size(chosen))

      ! The second of a conjugate pair has the conjugate vector.
      first = chosen
      do k = 1, size(chosen)
         if (chosen(k) == 1) cycle
         if (abs(t(chosen(k), chosen(k) - 1)) > 0) first(k) = chosen(k) - 1
      end do
      conjugate = first /= chosen
      call make_triangular(t, triangular, blocks)
      call independent_eigenvectors(triangular, noise, first, vectors)
      do i = 1, size(t, 1) - 1
         if (abs(t(i + 1, i)) > 0) vectors(i:i + 1, :) = matmul(blocks(:, :, i), vectors(i:i + 1, :))
      end do
      do k = 1, size(chosen)
         if (conjugate(k)) vectors(:, k) = conjg(vectors(:, k))
      end do
   end subroutine independent_eigenvectors_real

   !> Transforms a real Schur factor T, quasi-triangular, to a complex triangular one S with the same order of eigenvalues: rotates
   !> each 2 x 2 block.
   subroutine make_triangular(t, s, blocks)
      real(wp), intent(in) :: t(:, :)
      complex(wp), allocatable, intent(out) :: s(:, :)
      !> Unitary 2 x 2 rotations, 2 x 2 x n, of the rows with a subdiagonal entry of T.
      complex(wp), allocatable, intent(out) :: blocks(:, :, :)
      complex(wp) :: values(size(t, 1)), v(2)
      integer :: i, n

      n = size(t, 1)
      values = schur_values(t)
      allocate (s(n, n), source=cmplx(t, kind=wp))
      allocate (blocks(2, 2, n))
      do i = 1, n - 1
         if (.not. abs(t(i + 1, i)) > 0) cycle
         v = [cmplx(t(i, i + 1), kind=wp), values(i) - t(i, i)]
         v = v/norm2(abs(v))
         associate (q => blocks(:, :, i))
            q = reshape([v(1), v(2), -conjg(v(2)), conjg(v(1))], [2, 2])
            s(i:i + 1, i:) = matmul(conjg(transpose(q)), s(i:i + 1, i:))
            s(:i + 1, i:i + 1) = matmul(s(:i + 1, i:i + 1), q)
         end associate
         s(i, i) = values(i)
         s(i + 1, i) = 0
         s(i + 1, i + 1) = values(i + 1)
      end do
   end subroutine make_triangular

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

   ! A complex form has no pairs.
   subroutine keep_one_of_pairs_complex(t, chosen, paired)
      complex(wp), intent(in) :: t(:, :)
      integer, allocatable, intent(inout) :: chosen(:)
      logical, allocatable, intent(out) :: paired(:)

      associate (unused => t, as_they_are => chosen)
      end associate
      if (allocated(paired)) deallocate (paired)
   end subroutine keep_one_of_pairs_complex

   subroutine keep_one_of_pairs_real(t, chosen, paired)
      real(wp), intent(in) :: t(:, :)
      !> Positions on the diagonal.
      integer, allocatable, intent(inout) :: chosen(:)
      logical, allocatable, intent(out) :: paired(:)
      logical :: first(0:size(t, 1)), taken(0:size(t, 1) + 1)
      integer :: i

      first = .false.
      first(1:size(t, 1) - 1) = [(abs(t(i + 1, i)) > 0, i=1, size(t, 1) - 1)]
      taken = .false.
      taken(chosen) = .true.
      chosen = pack(chosen, .not. (first(chosen) .and. taken(chosen + 1)))
      allocate (paired, source=first(chosen - 1) .and. taken(chosen - 1))
   end subroutine keep_one_of_pairs_real
end module kschur_projected
