!> Engineering quantities of modes: frequencies, damping ratio, loss factor, kind.
module kschur_description
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgesv
   use kschur_loss, only: loss_factor_of
   use kschur_problem, only: modal_problem_type
   use kschur_result, only: modal_result_type, kind_overdamped, kind_real, kind_rigid, kind_undamped, &
      kind_underdamped, kind_unstable
   use kschur_sparse, only: csr_matrix_type
   use kschur_tolerances, only: rounding_of_row, twelve_digits
   implicit none
   private
   public :: describe, quadratic_form

   real(wp), parameter :: pi = acos(-1.0_wp)

contains

   !> Sets frequencies, damping ratios and kinds of the modes of a result, eqs. (26) to (28), and their loss factors if the problem
   !> has a loss matrix.
   subroutine describe(problem, rigid, result)
      type(modal_problem_type), intent(in) :: problem
      !> Its rigid motions, n x k.
      real(wp), intent(in) :: rigid(:, :)
      type(modal_result_type), intent(inout) :: result
      complex(wp) :: lambda
      real(wp) :: omega, zeta
      integer :: k, j

      k = size(result%eigenvalues)
      result%frequency_hz = abs(result%eigenvalues)/(2*pi)
      result%damped_frequency_hz = abs(aimag(result%eigenvalues))/(2*pi)
      result%damping_ratio = spread(0.0_wp, 1, k)
      result%kind = spread(kind_rigid, 1, k)
      do j = 1, k
         lambda = result%eigenvalues(j)
         omega = abs(lambda)
         zeta = ieee_value(1.0_wp, ieee_quiet_nan)
         if (omega > 0) zeta = 0 - real(lambda, wp)/omega
         if (.not. omega > 0) then
            result%kind(j) = kind_rigid
         else if (real(lambda, wp) > twelve_digits*omega) then
            result%kind(j) = kind_unstable
         else if (real(lambda, wp) >= -twelve_digits*omega) then
            result%kind(j) = kind_undamped
         else if (abs(aimag(lambda)) > 0) then
            result%kind(j) = kind_underdamped
         else
            result%kind(j) = kind_real
            call describe_overdamped(problem, rigid, real(lambda, wp), result%eigenvectors(:, j), result%kind(j), omega, zeta)
         end if
         result%frequency_hz(j) = omega/(2*pi)
         result%damping_ratio(j) = zeta
      end do
      if (allocated(problem%loss)) result%loss_factor = loss_factor_of(result%eigenvalues)
   end subroutine describe

   ! Sets kind, frequency and damping ratio of a real root of a symmetric problem to those of an overdamped oscillator if its shape
   ! has strain energy and inertia beyond rounding, and is not mostly a rigid motion. The other root of the oscillator follows from
   ! the product of the two, k/m.
   subroutine describe_overdamped(problem, rigid, lambda, phi, kind, omega, zeta)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: rigid(:, :), lambda
      complex(wp), intent(in) :: phi(:)
      integer, intent(inout) :: kind
      real(wp), intent(inout) :: omega, zeta
      complex(wp) :: m, k
      real(wp) :: m_terms, k_terms, other

      if (.not. problem%symmetric) return
      call quadratic_form(problem%mass, phi, m, m_terms)
      call quadratic_form(problem%stiffness, phi, k, k_terms)
      if (real(k, wp) <= rounding_of_row*k_terms .or. real(m, wp) <= rounding_of_row*m_terms) return
      if (rigid_mass(problem, rigid, phi) > 0.5_wp*real(m, wp)) return
      other = real(k, wp)/(real(m, wp)*lambda)
      kind = kind_overdamped
      omega = sqrt(lambda*other)
      zeta = -(lambda + other)/(2*omega)
   end subroutine describe_overdamped

   ! The part of phi^* M phi in the M-orthogonal projection on the rigid motions. A shape that is mostly rigid is a motion slowed by
   ! dampers, no oscillator, even if these strain the structure.
   function rigid_mass(problem, rigid, phi) result(mass)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: rigid(:, :)
      complex(wp), intent(in) :: phi(:)
      real(wp) :: mass
      real(wp) :: momenta(size(rigid, 1), size(rigid, 2)), gram(size(rigid, 2), size(rigid, 2))
      real(wp) :: shared(size(rigid, 2), 2), part(size(rigid, 2), 2)
      integer :: pivots(size(rigid, 2)), k, info

      mass = 0
      k = size(rigid, 2)
      if (k == 0) return
      momenta = 0
      call problem%mass%add_product(1.0_wp, rigid, momenta)
      gram = matmul(transpose(rigid), momenta)
      shared(:, 1) = matmul(real(phi, wp), momenta)
      shared(:, 2) = matmul(aimag(phi), momenta)
      part = shared
      call dgesv(k, 2, gram, k, pivots, part, k, info)
      if (info == 0) mass = sum(shared*part)
   end function rigid_mass

   !> Computes phi^* A phi, and |phi|^T |A| |phi|, the terms that its rounding is relative to.
   pure subroutine quadratic_form(matrix, phi, value, terms)
      type(csr_matrix_type), intent(in) :: matrix
      complex(wp), intent(in) :: phi(:)
      complex(wp), intent(out) :: value
      real(wp), intent(out) :: terms
      complex(wp) :: row
      real(wp) :: size_of_phi(size(phi)), row_terms
      integer :: i, k

      value = 0
      terms = 0
      size_of_phi = abs(phi)
      do i = 1, matrix%rows
         row = 0
         row_terms = 0
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            row = row + matrix%value(k)*phi(matrix%column(k))
            row_terms = row_terms + abs(matrix%value(k))*size_of_phi(matrix%column(k))
         end do
         value = value + conjg(phi(i))*row
         terms = terms + size_of_phi(i)*row_terms
      end do
   end subroutine quadratic_form
end module kschur_description
