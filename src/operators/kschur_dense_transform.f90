!> Symmetric or quadratic form, solved densely: all eigenpairs from the matrix of its operator on the null space of the
!> constraints, so that the number of eigenvalues is known too, but with losses.
module kschur_dense_transform
   use kschur_allowed_motions, only: allowed_motions
   use kschur_deflation, only: deflation_type
   use kschur_dense_eigenpairs, only: complex_eigenpairs, dense_eigenpairs_type, general_eigenpairs, symmetric_eigenpairs
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_energy_basis, only: new_energy_basis
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_krylov_options, only: krylov_options_type, ritz_pairs_type
   use kschur_linear_solver, only: complex_linear_solver_type, linear_solver_type
   use kschur_modal_selection, only: modal_selection_type
   use kschur_monitor, only: is_stopped, monitor_type
   use kschur_outcome, only: certified_unknown, certified_yes, history_type, reason_cancelled, reason_fewer_modes
   use kschur_problem, only: modal_problem_type
   use kschur_quadratic_transform_complex, only: complex_quadratic_type => quadratic_transform_type
   use kschur_quadratic_transform_real, only: quadratic_transform_type
   use kschur_selection, only: order_by_preference
   use kschur_staircase, only: zero_and_infinite
   use kschur_symmetric_transform, only: purify, symmetric_transform_type
   use kschur_spare_solvers, only: spare_solvers_type
   use kschur_tolerances, only: twelve_digits
   use kschur_transform, only: transform_type
   implicit none
   private
   public :: dense_transform_type, new_dense_transform

   !> All eigenpairs of a form, computed by the first iteration.
   type, extends(transform_type) :: dense_transform_type
      !> The symmetric or quadratic transform, factored.
      class(transform_type), allocatable :: form
      ! All pairs, kept by the first iteration.
      type(dense_eigenpairs_type), allocatable, private :: pairs
      ! Whether the pairs are exactly all finite eigenvalues.
      logical, private :: complete = .false.
      ! Values up to this are infinite eigenvalues.
      real(wp), private :: infinite = -1
   contains
      procedure :: iterate
      procedure :: recover
      procedure :: linear_solver
      procedure :: hand_over
      procedure :: order
      procedure :: transposed
   end type dense_transform_type

contains

   !> Takes over a factored form.
   subroutine new_dense_transform(transform, form)
      type(dense_transform_type), intent(out) :: transform
      class(transform_type), allocatable, intent(inout) :: form

      call move_alloc(form, transform%form)
      transform%map = transform%form%map
      transform%shift = transform%form%shift
      transform%recover_applies = transform%form%recover_applies
      transform%borrows = transform%form%borrows
   end subroutine new_dense_transform

   ! Computes all pairs at the first call; selects the wanted ones.
   subroutine iterate(self, selection, options, ritz, error, monitor)
      class(dense_transform_type), target, intent(inout) :: self
      type(modal_selection_type), intent(in) :: selection
      class(krylov_options_type), intent(in) :: options
      type(ritz_pairs_type), intent(out) :: ritz
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor
      integer, allocatable :: chosen(:)
      integer :: needed, converged
      logical :: proceed

      if (.not. allocated(self%pairs)) then
         call compute(self, error)
         if (allocated(error)) return
         ritz%statistics%operator_applications = self%pairs%applications
      end if
      associate (unused => options)
      end associate
      associate (values => self%pairs%values)
         allocate (chosen(size(values)), source=order_by_preference(selection, values))
         chosen = pack(chosen, abs(values(chosen)) > self%infinite)
         needed = selection%needed(values(chosen))
         converged = min(needed, size(chosen))
         if (needed > size(chosen)) ritz%statistics%reason = reason_fewer_modes
         ! The second root of a pair may be as near as the first.
         if (converged < size(chosen)) then
            if (.not. abs(values(chosen(converged + 1)) - conjg(values(chosen(converged)))) > 0) converged = converged + 1
         end if
         if (.not. allocated(self%pairs%complex_schur)) &
            call set_certificate(self, selection, self%complete .and. .not. may_be_nearer(self, selection, chosen, converged))
         chosen = chosen(:converged)
         allocate (ritz%mu(converged), source=values(chosen))
      end associate
      if (self%map%oscillator) then
         call take_real(self, chosen, ritz, error)
      else
         allocate (ritz%vectors, source=self%pairs%vectors(chosen))
      end if
      proceed = .true.
      if (present(monitor)) call monitor%report(0, converged, needed, 0.0_wp, proceed)
      if (is_stopped(monitor)) proceed = .false.
      if (.not. proceed) ritz%statistics%reason = reason_cancelled
      associate (statistics => ritz%statistics)
         statistics%history = history_type([converged], [statistics%operator_applications], [0.0_wp])
      end associate
   end subroutine iterate

   ! Whether a value behind the first ones, of which rounding leaves no digit, may belong to an eigenvalue nearer to the target than
   ! these: |1/theta - away| >= (|1 - away theta| - |away| error)/(|theta| + error), away = target - shift.
   logical function may_be_nearer(self, selection, chosen, first) result(may_be)
      class(dense_transform_type), intent(in) :: self
      type(modal_selection_type), intent(in) :: selection
      !> Positions of values, the nearest first, and how many are taken.
      integer, intent(in) :: chosen(:), first
      real(wp) :: errors(size(self%pairs%values)), least_distance(size(chosen) - first)

      may_be = .false.
      if (size(chosen) == first .or. first == 0 .or. self%map%oscillator) return
      errors = self%pairs%errors()
      associate (values => self%pairs%values(chosen(first + 1:)), error => errors(chosen(first + 1:)), &
         away => selection%target - self%shift, reach => selection%key(self%pairs%values(chosen(first))))
         least_distance = max(0.0_wp, abs(1 - away*values) - abs(away)*error)/(abs(values) + error)
         may_be = any(error >= abs(values) .and. least_distance < reach)
      end associate
   end function may_be_nearer

   ! Computes all eigenpairs, and whether they are known to be complete.
   subroutine compute(self, error)
      class(dense_transform_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: motions(:, :), basis(:, :), dual(:, :)

      allocate (self%pairs)
      select type (form => self%form)
      type is (symmetric_transform_type)
         associate (known => form%operator%deflation)
            call allowed_motions(form%operator%problem, known, motions, error)
            if (.not. allocated(error)) call symmetric_eigenpairs(form%operator, motions, self%pairs, error)
            if (allocated(error)) return
            self%complete = known%infinite_is_known .and. &
               size(self%pairs%values) == size(motions, 2) - known%infinite%multiplicity()
         end associate
      type is (quadratic_transform_type)
         associate (known => form%operator%deflation, operator => form%operator)
            call allowed_motions(operator%problem, known, motions, error)
            if (.not. allocated(error)) call new_energy_basis(operator%problem, motions, real(self%shift, wp), operator%unit, &
               basis, dual, error)
            if (.not. allocated(error)) call general_eigenpairs(operator, basis, dual, zero_and_infinite(known%zero, &
               known%infinite, operator%order(), self%shift, operator%unit, oscillator=.false.), twelve_digits, self%pairs, error)
            self%complete = known%infinite_is_known
         end associate
      class default
         call compute_complex(self, error)
         return
      end select
      ! Eigenvalues so far from the shift that their Ritz values are at rounding level may be infinite.
      associate (sizes => abs(self%pairs%values))
         if (size(sizes) > 0) self%complete = self%complete .and. minval(sizes) > epsilon(1.0_wp)*maxval(sizes)
      end associate
   end subroutine compute

   ! Computes all eigenpairs of a quadratic form with losses. Their number is not known, and Ritz values at rounding level are
   ! infinite eigenvalues.
   subroutine compute_complex(self, error)
      class(dense_transform_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: motions(:, :)

      select type (form => self%form)
      type is (complex_quadratic_type)
         associate (known => form%operator%deflation)
            call allowed_motions(form%operator%problem, known, motions, error)
            if (.not. allocated(error)) call complex_eigenpairs(form%operator, motions, zero_and_infinite(known%zero, &
               known%infinite, form%operator%order(), self%shift, form%operator%unit, oscillator=.false.), twelve_digits, &
               self%pairs, error)
         end associate
      end select
      if (.not. allocated(error)) self%infinite = epsilon(1.0_wp)*maxval([0.0_wp, abs(self%pairs%values)])
   end subroutine compute_complex

   ! Certifies the iteration if all eigenvalues are known: sets their distances from the target.
   subroutine set_certificate(self, selection, complete)
      class(dense_transform_type), intent(inout) :: self
      type(modal_selection_type), intent(in) :: selection
      logical, intent(in) :: complete
      real(wp) :: distances(2, size(self%pairs%values))
      integer :: i, each

      self%certificate%verdict = merge(certified_yes, certified_unknown, complete)
      self%certificate%reach = huge(1.0_wp)
      each = merge(2, 1, self%map%oscillator)
      do i = 1, size(distances, 2)
         associate (lambda => self%map%lambdas(self%theta(self%pairs%values(i))), target => selection%target)
            distances(:, i) = min(abs(lambda - target), abs(conjg(lambda) - target))
         end associate
      end do
      self%certificate%distances = reshape(distances(:each, :), [each*size(distances, 2)])
   end subroutine set_certificate

   ! Copies the chosen shapes of a symmetric form, and purifies them unless `recover` does that.
   subroutine take_real(self, chosen, ritz, error)
      class(dense_transform_type), intent(inout) :: self
      integer, intent(in) :: chosen(:)
      type(ritz_pairs_type), intent(inout) :: ritz
      type(error_type), allocatable, intent(out) :: error

      allocate (ritz%real_vectors(size(self%pairs%basis, 1), size(chosen)), source=self%pairs%real_vectors(chosen))
      if (self%recover_applies) return
      select type (form => self%form)
      type is (symmetric_transform_type)
         call purify(form, real(ritz%mu, wp), ritz%real_vectors, ritz%statistics, error)
      end select
   end subroutine take_real

   subroutine recover(self, ritz, pairs, error)
      class(dense_transform_type), intent(inout) :: self
      type(ritz_pairs_type), intent(inout) :: ritz
      type(eigenpairs_type), intent(out) :: pairs
      type(error_type), allocatable, intent(out) :: error

      call self%form%recover(ritz, pairs, error)
   end subroutine recover

   subroutine transposed(self, problem, deflation, solver, adjoint, error)
      class(dense_transform_type), target, intent(in) :: self
      type(modal_problem_type), target, intent(in) :: problem
      type(deflation_type), target, intent(in) :: deflation
      class(complex_linear_solver_type), intent(in) :: solver
      class(transform_type), allocatable, intent(out) :: adjoint
      type(error_type), allocatable, intent(out) :: error
      type(dense_transform_type), allocatable :: dense
      class(transform_type), allocatable :: form

      call self%form%transposed(problem, deflation, solver, form, error)
      if (allocated(error)) return
      ! A complex form is iterated then.
      if (allocated(self%pairs)) then
         if (allocated(self%pairs%complex_schur)) then
            call move_alloc(form, adjoint)
            return
         end if
      end if
      allocate (dense)
      call new_dense_transform(dense, form)
      call move_alloc(dense, adjoint)
   end subroutine transposed

   subroutine hand_over(self, spare)
      class(dense_transform_type), intent(inout) :: self
      type(spare_solvers_type), intent(inout) :: spare

      call self%form%hand_over(spare)
   end subroutine hand_over

   function linear_solver(self) result(solver)
      class(dense_transform_type), target, intent(in) :: self
      class(linear_solver_type), pointer :: solver

      solver => self%form%linear_solver()
   end function linear_solver

   integer function order(self)
      class(dense_transform_type), intent(in) :: self

      order = self%form%order()
   end function order
end module kschur_dense_transform
