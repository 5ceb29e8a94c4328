!> dnaupd and dneupd: real operators.
module kschur_arpack_real
   use kschur_arpack_interfaces, only: dnaupd, dneupd
   use kschur_arpack_process, only: arpack_process_type, check_extraction, keep_vectors, largest_magnitude, ido_apply, &
      ido_start
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_operator, only: real_operator_type
   implicit none
   private
   public :: real_process_type

   type, extends(arpack_process_type) :: real_process_type
      class(real_operator_type), pointer :: operator => null()
      real(wp), allocatable :: residual(:), basis(:, :), workd(:, :), workl(:)
   contains
      procedure :: order
      procedure :: reserve
      procedure :: filter
      procedure :: step
      procedure :: ritz
      procedure :: extract
      procedure :: apply
   end type real_process_type

contains

   integer function order(self)
      class(real_process_type), intent(in) :: self

      order = self%operator%order()
   end function order

   subroutine reserve(self, start, status)
      class(real_process_type), intent(inout) :: self
      real(wp), intent(in) :: start(:)
      integer, intent(out) :: status

      if (allocated(self%basis)) deallocate (self%residual, self%basis, self%workd, self%workl)
      allocate (self%residual(self%length), self%basis(self%length, self%columns), self%workd(self%length, 3), &
         self%workl(3*self%columns**2 + 8*self%columns), stat=status)
      if (status /= 0) return
      self%residual = 0
      self%residual(:size(start)) = start
      self%workd = 0
      self%workl = 0
   end subroutine reserve

   subroutine filter(self, error)
      class(real_process_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      self%workd(:, 1) = self%residual
      call self%apply(1, 2, error)
      if (allocated(error)) return
      if (norm2(self%workd(:, 2)) > 0) self%residual = self%workd(:, 2)/norm2(self%workd(:, 2))
   end subroutine filter

   subroutine apply(self, from, to, error)
      class(real_process_type), intent(inout) :: self
      integer, intent(in) :: from, to
      type(error_type), allocatable, intent(out) :: error
      integer :: n

      n = self%order()
      call self%operator%apply(self%workd(:n, from:from), self%workd(:n, to:to), error)
      self%workd(n + 1:, to) = 0
   end subroutine apply

   subroutine step(self, error)
      class(real_process_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      call dnaupd(self%ido, "I", self%length, largest_magnitude, self%wanted, self%tolerance, self%residual, &
         self%columns, self%basis, self%length, self%iparam, self%ipntr, self%workd, self%workl, size(self%workl), &
         self%info)
      if (all(self%ido /= [ido_start, ido_apply])) return
      self%applications = self%applications + 1
      call self%apply(self%from(), self%to(), error)
   end subroutine step

   pure subroutine ritz(self, magnitudes, bounds)
      class(real_process_type), intent(in) :: self
      real(wp), intent(out) :: magnitudes(:), bounds(:)
      integer :: i

      if (self%ipntr(6) == 0) then
         magnitudes = 0
         bounds = 0
         return
      end if
      do i = 1, self%columns
         magnitudes(i) = hypot(self%workl(self%ipntr(6) + i - 1), self%workl(self%ipntr(7) + i - 1))
         bounds(i) = self%workl(self%ipntr(8) + i - 1)
      end do
   end subroutine ritz

   ! A pair stands in two columns, real and imaginary part, and may be split at the end: half a
   ! pair has no vector.
   subroutine extract(self, mu, vectors, error)
      class(real_process_type), intent(inout) :: self
      complex(wp), allocatable, intent(out) :: mu(:), vectors(:, :)
      type(error_type), allocatable, intent(out) :: error
      ! More than NEV may have converged.
      real(wp) :: re(self%columns + 1), im(self%columns + 1), workev(3*self%columns)
      logical :: select(self%columns)
      integer :: j, found, n

      re = 0
      im = 0
      call dneupd(.true., "A", select, re, im, self%basis, self%length, 0.0_wp, 0.0_wp, workev, "I", self%length, &
         largest_magnitude, self%wanted, self%tolerance, self%residual, self%columns, self%basis, self%length, &
         self%iparam, self%ipntr, self%workd, self%workl, size(self%workl), self%info)
      call check_extraction("dneupd", self%info, self%iparam(5), error)
      if (allocated(error)) return
      n = self%order()
      allocate (mu(self%converged()), vectors(n, self%converged()))
      found = 0
      j = 1
      do while (j <= self%converged())
         if (.not. abs(im(j)) > 0) then
            found = found + 1
            mu(found) = 1/re(j)
            vectors(:, found) = self%basis(:n, j)
            j = j + 1
            cycle
         end if
         if (j < self%converged()) then
            if (.not. abs(im(j) + im(j + 1)) > 0) then
               found = found + 2
               mu(found - 1) = 1/cmplx(re(j), im(j), wp)
               mu(found) = conjg(mu(found - 1))
               vectors(:, found - 1) = cmplx(self%basis(:n, j), self%basis(:n, j + 1), wp)
               vectors(:, found) = conjg(vectors(:, found - 1))
            end if
         end if
         j = j + 2
      end do
      call keep_vectors(mu, vectors, found)
   end subroutine extract
end module kschur_arpack_real
