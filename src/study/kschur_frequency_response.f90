!> Response to harmonic forces at given frequencies.
module kschur_frequency_response
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use kschur_error, only: error_memory, error_singular, error_type, error_usage, new_error, take_cancelled
   use kschur_kinds, only: wp, xp
   use kschur_memory, only: complex_bytes, require_memory
   use kschur_monitor, only: monitor_type
   use kschur_mumps_complex, only: mumps_complex_type
   use kschur_options, only: scaling_row
   use kschur_problem, only: modal_problem_type
   use kschur_saddle, only: order_elimination, saddle_blocks, saddle_structure, shifted_saddle
   use kschur_scaling, only: constraint_factors
   use kschur_sparse, only: csr_matrix_type
   use kschur_text, only: magnitude, text
   use kschur_threads, only: enter_solve, leave_solve
   use kschur_tolerances, only: known_well
   implicit none
   private
   public :: frequency_response

   real(wp), parameter :: two_pi = 8*atan(1.0_wp)

contains

   !> Solves (lambda^2 M + lambda R + K + i H) x + Cq^T xi = f, Cq x = 0 for lambda = i 2 pi frequency; -i H at negative
   !> frequencies, no H at zero. One complex factorisation for each frequency, one analysis, refinement with residuals in
   !> extended precision. Fails if forces do not fit the problem, or an undamped mode has the frequency.
   subroutine frequency_response(problem, frequencies, forces, response, error, multipliers, unknowns, monitor, threads)
      type(modal_problem_type), intent(in) :: problem
      !> Hz.
      real(wp), intent(in) :: frequencies(:)
      !> f, n x forces.
      complex(wp), intent(in) :: forces(:, :)
      !> x, unknowns x forces x frequencies: the frequencies solved before the monitor cancelled.
      complex(wp), allocatable, intent(out) :: response(:, :, :)
      type(error_type), allocatable, intent(out) :: error
      !> xi, m x forces x frequencies, as many.
      complex(wp), allocatable, intent(out), optional :: multipliers(:, :, :)
      !> Unknowns whose response is wanted. Absent: all n.
      integer, intent(in), optional :: unknowns(:)
      !> Told the current frequency; polled before each analysis and factorisation.
      class(monitor_type), target, intent(inout), optional :: monitor
      !> Threads, as in the options of a solve. Absent: 0.
      integer, intent(in), optional :: threads
      type(modal_problem_type) :: ordered
      type(mumps_complex_type) :: solver
      integer, allocatable :: wanted(:)
      complex(wp) :: x(problem%unknowns(), size(forces, 2)), xi(problem%multipliers(), size(forces, 2))
      integer :: threads_asked, threads_before, i, done
      logical :: cancelled

      if (present(unknowns)) then
         allocate (wanted, source=unknowns)
      else
         allocate (wanted, source=[(i, i=1, problem%unknowns())])
      end if
      call check_request(problem, frequencies, size(forces, 1), wanted, error)
      if (allocated(error)) return
      call require_memory(complex_bytes*(size(frequencies) + 4)*size(forces, 2)*(size(wanted) + problem%multipliers()), &
         "the response", error)
      if (allocated(error)) return
      threads_asked = 0
      if (present(threads)) threads_asked = threads
      call enter_solve(threads_asked, problem%unknowns(), threads_before, error)
      ordered = problem
      if (.not. allocated(error)) call order_elimination(ordered, error)
      allocate (response(size(wanted), size(forces, 2), size(frequencies)))
      if (present(multipliers)) allocate (multipliers(problem%multipliers(), size(forces, 2), size(frequencies)))
      done = 0
      if (present(monitor)) solver%monitor => monitor
      do i = 1, size(frequencies)
         if (allocated(error)) exit
         if (present(monitor)) call monitor%begins("frequency "//text(i)//" of "//text(size(frequencies)))
         call respond(ordered, cmplx(0, two_pi*frequencies(i), wp), forces, solver, x, xi, error)
         if (allocated(error)) exit
         response(:, :, i) = x(wanted, :)
         if (present(multipliers)) multipliers(:, :, i) = xi
         done = i
      end do
      cancelled = .false.
      if (present(monitor)) call take_cancelled(error, cancelled)
      if (cancelled) call keep_first(done, response, error)
      if (cancelled .and. present(multipliers) .and. .not. allocated(error)) call keep_first(done, multipliers, error)
      call leave_solve(threads_before)
   end subroutine frequency_response

   ! Keeps the first `count` entries of the last dimension.
   subroutine keep_first(count, values, error)
      integer, intent(in) :: count
      complex(wp), allocatable, intent(inout) :: values(:, :, :)
      type(error_type), allocatable, intent(out) :: error
      complex(wp), allocatable :: kept(:, :, :)
      integer :: status

      allocate (kept(size(values, 1), size(values, 2), count), stat=status)
      if (status /= 0) then
         call new_error(error, error_memory, "no memory for the part of the response that was computed")
         return
      end if
      kept = values(:, :, :count)
      call move_alloc(kept, values)
   end subroutine keep_first

   ! Fails if forces or unknowns do not fit the problem, or a frequency is not finite.
   subroutine check_request(problem, frequencies, length, wanted, error)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: frequencies(:)
      !> Length of a force.
      integer, intent(in) :: length
      integer, intent(in) :: wanted(:)
      type(error_type), allocatable, intent(out) :: error
      integer :: i

      if (length /= problem%unknowns()) call new_error(error, error_usage, "the forces have "//text(length)// &
         " entries, but the problem has "//text(problem%unknowns())//" unknowns")
      do i = 1, size(wanted)
         if (allocated(error)) return
         if (wanted(i) < 1 .or. wanted(i) > problem%unknowns()) call new_error(error, error_usage, "there is no unknown "// &
            text(wanted(i) + problem%index_base - 1)//" of "//text(problem%unknowns()))
      end do
      do i = 1, size(frequencies)
         if (allocated(error)) return
         if (.not. ieee_is_finite(frequencies(i))) call new_error(error, error_usage, "frequency number "//text(i)//" of "// &
            text(size(frequencies))//" is not a finite number")
      end do
   end subroutine check_request

   ! Factors and solves at one lambda, with refinement.
   subroutine respond(problem, lambda, forces, solver, x, xi, error)
      type(modal_problem_type), intent(in) :: problem
      complex(wp), intent(in) :: lambda
      complex(wp), intent(in) :: forces(:, :)
      !> Reuses its analysis of the pattern.
      type(mumps_complex_type), intent(inout) :: solver
      complex(wp), contiguous, intent(out) :: x(:, :), xi(:, :)
      type(error_type), allocatable, intent(out) :: error
      ! Largest number of refinement steps; stops earlier when a step changes no more.
      integer, parameter :: steps = 5
      type(csr_matrix_type) :: blocks(3)
      real(wp) :: factors(problem%multipliers())
      complex(wp), allocatable :: y(:, :)
      complex(xp), allocatable :: residual(:, :)
      integer :: n, step, j

      n = problem%unknowns()
      x = 0
      xi = 0
      factors = constraint_factors(problem, scaling_row, lambda)
      call saddle_blocks(problem, factors, blocks, error)
      if (allocated(error)) return
      call solver%factorize(shifted_saddle(problem, blocks, lambda, loss_weight(lambda)), saddle_structure(problem), error)
      if (allocated(error)) then
         if (error%code == error_singular) call report_resonance(lambda, error)
         return
      end if
      allocate (y(n + size(factors), size(forces, 2)))
      do step = 1, steps
         residual = residual_of(problem, lambda, forces, x, xi)
         y = cmplx(residual, kind=wp)
         y(n + 1:, :) = spread(factors, 2, size(y, 2))*y(n + 1:, :)
         call solver%solve(y, error)
         if (allocated(error)) return
         x = x + y(:n, :)
         xi = xi + spread(factors, 2, size(y, 2))*y(n + 1:, :)
         if (all([(norm2(abs(y(:n, j))) <= known_well*norm2(abs(x(:, j))), j=1, size(y, 2))])) return
      end do
      call report_resonance(lambda, error)
   end subroutine respond

   ! Coefficient of H: i above the real axis, -i below it, as H is in phase with the velocity; 0 for motion at rest, which has
   ! no loss.
   pure complex(wp) function loss_weight(lambda) result(weight)
      complex(wp), intent(in) :: lambda

      weight = 0
      if (abs(aimag(lambda)) > 0) weight = cmplx(0, sign(1.0_wp, aimag(lambda)), wp)
   end function loss_weight

   ! Residual f - (lambda^2 M + lambda R + K + i H) x - Cq^T xi, followed by -Cq x.
   function residual_of(problem, lambda, forces, x, xi) result(residual)
      type(modal_problem_type), intent(in) :: problem
      complex(wp), intent(in) :: lambda
      complex(wp), contiguous, intent(in) :: forces(:, :), x(:, :), xi(:, :)
      complex(xp) :: residual(size(x, 1) + size(xi, 1), size(x, 2))
      complex(xp) :: s
      integer :: i, j, k, n

      n = size(x, 1)
      s = lambda
      do j = 1, size(x, 2)
         residual(:n, j) = forces(:, j)
         residual(n + 1:, j) = 0
         call subtract_product(s**2, problem%mass, x(:, j), residual(:n, j))
         call subtract_product(s, problem%damping, x(:, j), residual(:n, j))
         call subtract_product((1.0_xp, 0.0_xp), problem%stiffness, x(:, j), residual(:n, j))
         if (allocated(problem%loss)) &
            call subtract_product(cmplx(loss_weight(lambda), kind=xp), problem%loss, x(:, j), residual(:n, j))
         associate (cq => problem%constraints)
            call subtract_product((1.0_xp, 0.0_xp), cq, x(:, j), residual(n + 1:, j))
            do i = 1, cq%rows
               do k = cq%row_start(i), cq%row_start(i + 1) - 1
                  residual(cq%column(k), j) = residual(cq%column(k), j) - real(cq%value(k), xp)*xi(i, j)
               end do
            end do
         end associate
      end do
   end function residual_of

   ! y := y - alpha A x.
   pure subroutine subtract_product(alpha, a, x, y)
      complex(xp), intent(in) :: alpha
      type(csr_matrix_type), intent(in) :: a
      complex(wp), contiguous, intent(in) :: x(:)
      complex(xp), contiguous, intent(inout) :: y(:)
      real(xp) :: re, im
      integer :: i, k

      do i = 1, a%rows
         re = 0
         im = 0
         do k = a%row_start(i), a%row_start(i + 1) - 1
            re = re + real(a%value(k), xp)*real(x(a%column(k)), wp)
            im = im + real(a%value(k), xp)*aimag(x(a%column(k)))
         end do
         y(i) = y(i) - alpha*cmplx(re, im, xp)
      end do
   end subroutine subtract_product

   ! Raises the error that an undamped mode has this frequency.
   subroutine report_resonance(lambda, error)
      complex(wp), intent(in) :: lambda
      type(error_type), allocatable, intent(out) :: error

      call new_error(error, error_singular, "there is no response at "//magnitude(abs(lambda)/two_pi)// &
         " Hz: a mode without damping has this frequency, or the problem is singular for every one")
   end subroutine report_resonance
end module kschur_frequency_response
