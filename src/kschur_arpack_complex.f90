!> znaupd and zneupd: complex operators.
module kschur_arpack_complex
   use kschur_arpack_interfaces, only: znaupd, zneupd
   use kschur_arpack_process, only: arpack_process_type, check_extraction, keep_vectors, largest_magnitude, ido_apply, &
      ido_start
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_operator, only: complex_operator_type
   implicit none
   private
   public :: complex_process_type

   type, extends(arpack_process_type) :: complex_process_type
      class(complex_operator_type), pointer :: operator => null()
      real(wp), allocatable :: rwork(:)
      complex(wp), allocatable :: residual(:), basis(:, :), workd(:, :), workl(:)
   contains
      procedure :: order
      procedure :: reserve
      procedure :: filter
      procedure :: step
      procedure :: ritz
      procedure :: extract
      procedure, private :: apply
   end type complex_process_type

contains

   integer function order(self)
      class(complex_process_type), intent(in) :: self

      order = self%operator%order()
   end function order

   subroutine reserve(self, start, status)
      class(complex_process_type), intent(inout) :: self
      real(wp), intent(in) :: start(:)
      integer, intent(out) :: status

      if (allocated(self%basis)) deallocate (self%residual, self%basis, self%workd, self%workl, self%rwork)
      allocate (self%residual(self%length), self%basis(self%length, self%columns), self%workd(self%length, 3), &
         self%workl(3*self%columns**2 + 5*self%columns), self%rwork(self%columns), stat=status)
      if (status /= 0) return
      self%residual = 0
      self%residual(:size(start)) = start
      self%workd = 0
      self%workl = 0
      self%rwork = 0
   end subroutine reserve

   subroutine filter(self, error)
      class(complex_process_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      self%workd(:, 1) = self%residual
      call self%apply(1, 2, error)
      if (allocated(error)) return
      associate (length => norm2(abs(self%workd(:, 2))))
         if (length > 0) self%residual = self%workd(:, 2)/length
      end associate
   end subroutine filter

   subroutine apply(self, from, to, error)
      class(complex_process_type), intent(inout) :: self
      integer, intent(in) :: from, to
      type(error_type), allocatable, intent(out) :: error
      integer :: n

      n = self%order()
      call self%operator%apply(self%workd(:n, from:from), self%workd(:n, to:to), error)
      self%workd(n + 1:, to) = 0
   end subroutine apply

   subroutine step(self, error)
      class(complex_process_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error

      call znaupd(self%ido, "I", self%length, largest_magnitude, self%wanted, self%tolerance, self%residual, &
         self%columns, self%basis, self%length, self%iparam, self%ipntr, self%workd, self%workl, size(self%workl), &
         self%rwork, self%info)
      if (all(self%ido /= [ido_start, ido_apply])) return
      self%applications = self%applications + 1
      call self%apply(self%from(), self%to(), error)
   end subroutine step

   pure subroutine ritz(self, magnitudes, bounds)
      class(complex_process_type), intent(in) :: self
      real(wp), intent(out) :: magnitudes(:), bounds(:)
      integer :: i

      magnitudes = 0
      bounds = 0
      if (self%ipntr(6) == 0) return
      do i = 1, self%columns
         magnitudes(i) = abs(self%workl(self%ipntr(6) + i - 1))
         bounds(i) = abs(self%workl(self%ipntr(8) + i - 1))
      end do
   end subroutine ritz

   subroutine extract(self, mu, vectors, error)
      class(complex_process_type), intent(inout) :: self
      complex(wp), allocatable, intent(out) :: mu(:), vectors(:, :)
      type(error_type), allocatable, intent(out) :: error
      complex(wp) :: inverses(self%columns + 1), workev(2*self%columns)
      logical :: select(self%columns)
      integer :: found, n

      inverses = 0
      call zneupd(.true., "A", select, inverses, self%basis, self%length, (0.0_wp, 0.0_wp), workev, "I", self%length, &
         largest_magnitude, self%wanted, self%tolerance, self%residual, self%columns, self%basis, self%length, &
         self%iparam, self%ipntr, self%workd, self%workl, size(self%workl), self%rwork, self%info)
      call check_extraction("zneupd", self%info, self%iparam(5), error)
      if (allocated(error)) return
      found = self%converged()
      n = self%order()
      allocate (mu(found), source=1/inverses(:found))
      allocate (vectors(n, found), source=self%basis(:n, :found))
      call keep_vectors(mu, vectors, found)
   end subroutine extract
end module kschur_arpack_complex
