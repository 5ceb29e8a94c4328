!> Eigenpairs of a modal problem, on the way from the Ritz pairs of an iteration to modes.
module kschur_eigenpairs
   use kschur_kinds, only: wp
   use kschur_lapack, only: dnrm2, dznrm2
   use kschur_threads, only: panel_rows
   implicit none
   private
   public :: append_pairs, chosen_pairs, eigenpairs_type, keep_pairs, move_pairs, near, normalize, replace_pair

   !> Eigenpairs of a modal problem.
   type :: eigenpairs_type
      !> Eigenvalues (1/s).
      complex(wp), allocatable :: lambda(:)
      !> Shapes, n x k.
      complex(wp), allocatable :: phi(:, :)
      !> Multipliers, m x k.
      complex(wp), allocatable :: xi(:, :)
      !> Marks pairs that stand for themselves and their conjugates. Not allocated: none.
      logical, allocatable :: paired(:)
      !> Real shapes, if all are real, possibly with further columns allocated; then `phi` is not allocated.
      real(wp), allocatable :: real_phi(:, :)
   contains
      !> Whether shapes are stored as real.
      procedure :: is_real
      !> The number of unknowns n.
      procedure :: rows
      !> The shape of a pair, in either storage.
      procedure :: column
      !> Converts shapes to complex storage.
      procedure :: make_complex
      !> Converts shapes to real storage, dropping imaginary parts.
      procedure :: make_real
   end type eigenpairs_type

contains

   pure logical function is_real(self)
      class(eigenpairs_type), intent(in) :: self

      is_real = allocated(self%real_phi)
   end function is_real

   pure integer function rows(self)
      class(eigenpairs_type), intent(in) :: self

      if (self%is_real()) then
         rows = size(self%real_phi, 1)
      else
         rows = size(self%phi, 1)
      end if
   end function rows

   pure function column(self, j)
      class(eigenpairs_type), intent(in) :: self
      integer, intent(in) :: j
      complex(wp) :: column(self%rows())

      if (self%is_real()) then
         column = cmplx(self%real_phi(:, j), kind=wp)
      else
         column = self%phi(:, j)
      end if
   end function column

   !> Moves pairs; `from` is empty afterwards.
   subroutine move_pairs(from, to)
      type(eigenpairs_type), intent(inout) :: from
      type(eigenpairs_type), intent(out) :: to

      call move_alloc(from%lambda, to%lambda)
      call move_alloc(from%phi, to%phi)
      call move_alloc(from%xi, to%xi)
      call move_alloc(from%paired, to%paired)
      call move_alloc(from%real_phi, to%real_phi)
   end subroutine move_pairs

   subroutine make_complex(self)
      class(eigenpairs_type), intent(inout) :: self

      if (.not. self%is_real()) return
      allocate (self%phi(self%rows(), size(self%lambda)))
      call copy_shapes(self, self%phi)
      deallocate (self%real_phi)
   end subroutine make_complex

   subroutine make_real(self)
      class(eigenpairs_type), intent(inout) :: self

      allocate (self%real_phi, source=real(self%phi, wp))
      deallocate (self%phi)
   end subroutine make_real

   ! Copies the shapes, of either storage, by columns: memory may not suffice for a temporary copy of all.
   subroutine copy_shapes(pairs, phi)
      class(eigenpairs_type), intent(in) :: pairs
      complex(wp), intent(inout) :: phi(:, :)
      integer :: j

      !$omp parallel do schedule(static) if (size(phi, 1) > panel_rows)
      do j = 1, size(phi, 2)
         if (pairs%is_real()) then
            phi(:, j) = cmplx(pairs%real_phi(:, j), kind=wp)
         else
            phi(:, j) = pairs%phi(:, j)
         end if
      end do
      !$omp end parallel do
   end subroutine copy_shapes

   !> Appends pairs of the same problem.
   subroutine append_pairs(pairs, more)
      type(eigenpairs_type), intent(inout) :: pairs
      type(eigenpairs_type), intent(in) :: more
      complex(wp), allocatable :: phi(:, :), xi(:, :)
      real(wp), allocatable :: real_phi(:, :)
      logical, allocatable :: paired(:)
      integer :: k, l

      k = size(pairs%lambda)
      l = size(more%lambda)
      if (l == 0) return
      if (pairs%is_real() .and. more%is_real()) then
         allocate (real_phi(pairs%rows(), k + l))
         real_phi(:, :k) = pairs%real_phi(:, :k)
         real_phi(:, k + 1:) = more%real_phi(:, :l)
         call move_alloc(real_phi, pairs%real_phi)
      else
         allocate (phi(pairs%rows(), k + l))
         call copy_shapes(pairs, phi(:, :k))
         call copy_shapes(more, phi(:, k + 1:))
         call move_alloc(phi, pairs%phi)
         if (pairs%is_real()) deallocate (pairs%real_phi)
      end if
      allocate (xi(size(pairs%xi, 1), k + l))
      xi(:, :k) = pairs%xi
      xi(:, k + 1:) = more%xi
      call move_alloc(xi, pairs%xi)
      if (allocated(pairs%paired)) then
         allocate (paired(k + l), source=.false.)
         paired(:k) = pairs%paired
         if (allocated(more%paired)) paired(k + 1:) = more%paired
         call move_alloc(paired, pairs%paired)
      end if
      pairs%lambda = [pairs%lambda, more%lambda]
   end subroutine append_pairs

   !> Copies the chosen pairs, without data of extended types.
   function chosen_pairs(pairs, chosen) result(kept)
      class(eigenpairs_type), intent(in) :: pairs
      logical, intent(in) :: chosen(:)
      type(eigenpairs_type) :: kept
      integer, allocatable :: order(:)
      integer :: i

      allocate (order, source=pack([(i, i=1, size(chosen))], chosen))
      allocate (kept%lambda(size(order)), source=pairs%lambda(order))
      if (pairs%is_real()) then
         allocate (kept%real_phi(pairs%rows(), size(order)), source=pairs%real_phi(:, order))
      else
         allocate (kept%phi(pairs%rows(), size(order)), source=pairs%phi(:, order))
      end if
      allocate (kept%xi(size(pairs%xi, 1), size(order)), source=pairs%xi(:, order))
   end function chosen_pairs

   !> Keeps the chosen pairs only.
   subroutine keep_pairs(pairs, chosen)
      type(eigenpairs_type), intent(inout) :: pairs
      logical, intent(in) :: chosen(:)
      type(eigenpairs_type) :: kept

      if (all(chosen)) return
      kept = chosen_pairs(pairs, chosen)
      if (allocated(pairs%paired)) kept%paired = pack(pairs%paired, chosen)
      call move_pairs(kept, pairs)
   end subroutine keep_pairs

   !> Replaces shape and multipliers of pair j by those of pair i of others, real ones if these are stored as real.
   subroutine replace_pair(pairs, j, others, i)
      class(eigenpairs_type), intent(inout) :: pairs
      type(eigenpairs_type), intent(in) :: others
      integer, intent(in) :: j, i

      if (pairs%is_real()) then
         pairs%real_phi(:, j) = others%real_phi(:, i)
      else
         pairs%phi(:, j) = others%column(i)
      end if
      pairs%xi(:, j) = others%xi(:, i)
   end subroutine replace_pair

   !> Scales the shape of pair j to unit norm with its largest entry real and positive; leaves a zero shape.
   subroutine normalize(pairs, j)
      class(eigenpairs_type), intent(inout) :: pairs
      integer, intent(in) :: j
      complex(wp) :: factor

      if (pairs%is_real()) then
         associate (phi => pairs%real_phi(:, j))
            associate (largest => phi(maxloc(abs(phi), 1)))
               if (.not. abs(largest) > 0) return
               factor = sign(1.0_wp, largest)/dnrm2(size(phi), phi, 1)
            end associate
            phi = real(factor, wp)*phi
         end associate
      else
         associate (phi => pairs%phi(:, j))
            associate (largest => phi(maxloc(real(phi, wp)**2 + aimag(phi)**2, 1)))
               if (.not. abs(largest) > 0) return
               factor = conjg(largest)/abs(largest)/dznrm2(size(phi), phi, 1)
            end associate
            phi = factor*phi
         end associate
      end if
      pairs%xi(:, j) = factor*pairs%xi(:, j)
   end subroutine normalize

   !> Marks eigenvalues within a relative distance of eigenvalue j.
   pure function near(lambda, j, distance)
      complex(wp), intent(in) :: lambda(:)
      integer, intent(in) :: j
      real(wp), intent(in) :: distance
      logical :: near(size(lambda))

      near = abs(lambda - lambda(j)) <= distance*abs(lambda(j))
   end function near
end module kschur_eigenpairs
