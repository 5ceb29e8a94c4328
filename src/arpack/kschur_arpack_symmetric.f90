!> dsaupd and dseupd, for operators self-adjoint in the inner product of their metric.
module kschur_arpack_symmetric
   use kschur_arpack_interfaces, only: dsaupd, dseupd
   use kschur_arpack_process, only: check_extraction, keep_vectors, largest_magnitude, ido_apply, &
      ido_metric, ido_start
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_arpack_real, only: real_process_type
   use kschur_operator, only: symmetric_operator_type
   implicit none
   private
   public :: symmetric_process_type

   !> The process for such an operator.
   type, extends(real_process_type) :: symmetric_process_type
      class(symmetric_operator_type), pointer :: self_adjoint => null()
   contains
      procedure :: step
      procedure :: ritz
      procedure :: extract
   end type symmetric_process_type

contains

   subroutine step(self, error)
      class(symmetric_process_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      integer :: n

      call dsaupd(self%ido, "G", self%length, largest_magnitude, self%wanted, self%tolerance, self%residual, &
         self%columns, self%basis, self%length, self%iparam, self%ipntr, self%workd, self%workl, size(self%workl), &
         self%info)
      select case (self%ido)
      case (ido_start, ido_apply)
         self%applications = self%applications + 1
         call self%apply(self%from(), self%to(), error)
      case (ido_metric)
         n = self%order()
         associate (from => self%from(), to => self%to())
            call self%self_adjoint%apply_metric(self%workd(:n, from:from), self%workd(:n, to:to), error)
            self%workd(n + 1:, to) = self%workd(n + 1:, from)
         end associate
      end select
   end subroutine step

   pure subroutine ritz(self, magnitudes, bounds)
      class(symmetric_process_type), intent(in) :: self
      real(wp), intent(out) :: magnitudes(:), bounds(:)

      magnitudes = abs(self%values_at(6))
      bounds = self%values_at(7)
   end subroutine ritz

   subroutine extract(self, mu, vectors, error)
      class(symmetric_process_type), intent(inout) :: self
      complex(wp), allocatable, intent(out) :: mu(:), vectors(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: inverses(self%columns)
      logical :: select(self%columns)
      integer :: found, n

      inverses = 0
      call dseupd(.true., "A", select, inverses, self%basis, self%length, 0.0_wp, "G", self%length, largest_magnitude, &
         self%wanted, self%tolerance, self%residual, self%columns, self%basis, self%length, self%iparam, self%ipntr, &
         self%workd, self%workl, size(self%workl), self%info)
      call check_extraction("dseupd", self%info, self%iparam(5), error)
      if (allocated(error)) return
      found = self%converged()
      n = self%order()
      allocate (mu(found), source=cmplx(1/inverses(:found), 0, wp))
      allocate (vectors(n, found), source=cmplx(self%basis(:n, :found), 0, wp))
      call keep_vectors(mu, vectors, found)
   end subroutine extract
end module kschur_arpack_symmetric
