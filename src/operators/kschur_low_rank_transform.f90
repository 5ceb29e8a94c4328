!> Transform for symmetric, proportionally damped problems with local forces (low-rank form): the undamped Krylov space, started
!> with the responses to those forces, contains all modes, since each is a combination of undamped modes and responses.
module kschur_low_rank_transform
   use kschur_archive, only: archive_type
   use kschur_block_lanczos, only: add_random_directions, expand_block
   use kschur_certificate, only: inertia_census_type, new_inertia_census
   use kschur_checkpoint, only: checkpoint_type
   use kschur_deflation, only: deflation_type
   use kschur_dense_eigenpairs, only: dense_eigenpairs_type
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_krylov_options, only: krylov_options_type, krylov_statistics_type, ritz_pairs_type
   use kschur_linear_solver, only: complex_linear_solver_type, linear_solver_type, real_linear_solver_type
   use kschur_local_forces, only: local_forces_type, new_local_forces, symmetric_stiffness
   use kschur_low_rank_projection, only: new_projection, projection_type
   use kschur_low_rank_shapes, only: recover_shapes
   use kschur_low_rank_space, only: begin_or_continue, filter, low_rank_space_type
   use kschur_modal_selection, only: modal_selection_type
   use kschur_monitor, only: is_stopped, monitor_type
   use kschur_outcome, only: certified_unknown, history_type, reason_cancelled, reason_converged, reason_fewer_modes, &
      reason_max_restarts
   use kschur_placement, only: placement_type
   use kschur_problem, only: modal_problem_type
   use kschur_projected, only: keep_one_of_pairs
   use kschur_selection, only: order_by_preference
   use kschur_spare_solvers, only: spare_solvers_type
   use kschur_symmetric_transform, only: new_symmetric_transform, symmetric_transform_type
   use kschur_tolerances, only: seems_zero
   use kschur_transform, only: transform_type
   use kschur_transposed_solver, only: transposed_real_type
   implicit none
   private
   public :: low_rank_transform_type, new_low_rank_transform

   !> Undamped part, local forces, and their Krylov space.
   type, extends(transform_type) :: low_rank_transform_type
      !> The undamped part, factored.
      type(symmetric_transform_type) :: undamped
      type(local_forces_type) :: forces
      ! The problem with the symmetric part of K, if K is not symmetric.
      type(modal_problem_type), allocatable, private :: symmetric_part
      type(inertia_census_type), allocatable, private :: census
      type(placement_type), private :: placement
      type(low_rank_space_type), allocatable, private :: space
   contains
      procedure :: iterate
      procedure :: recover
      procedure :: linear_solver
      procedure :: hand_over
      procedure :: order
      procedure :: transposed
      procedure, private :: carry_state
      procedure, private :: check_space
      procedure, private :: undamped_selection
      procedure, private :: has_all_copies
   end type low_rank_transform_type

   ! Result of a convergence check.
   type :: ritz_check_type
      type(projection_type) :: undamped
      type(dense_eigenpairs_type) :: pairs
      !> Wanted pairs, most wanted first; number of leading pairs that contain all wanted ones; number of these that converged.
      integer, allocatable :: chosen(:)
      integer :: needed = 0, converged = 0
      real(wp) :: residual = 0
   contains
      procedure :: settled
   end type ritz_check_type

contains

   !> Factors [K_s - s M, Cq^T; Cq, 0], s = theta(lambda) of the proportional part; for a complex lambda its real part.
   subroutine new_low_rank_transform(transform, problem, deflation, placement, solver, error, counting_solver)
      type(low_rank_transform_type), target, intent(out) :: transform
      type(modal_problem_type), target, intent(in) :: problem
      type(deflation_type), target, intent(in) :: deflation
      type(placement_type), intent(in) :: placement
      class(real_linear_solver_type), allocatable, intent(inout) :: solver
      type(error_type), allocatable, intent(out) :: error
      !> A solver that computes the inertia of indefinite matrices.
      class(real_linear_solver_type), allocatable, optional, intent(inout) :: counting_solver
      type(modal_problem_type), pointer :: undamped
      logical :: few

      transform%placement = placement
      ! Shift of the projected problem, which may have eigenvalues next to zero.
      transform%shift = abs(placement%lambda)
      if (.not. abs(transform%shift) > 0) transform%shift = placement%unit
      call new_local_forces(problem, transform%forces, few, error)
      if (allocated(error)) return
      undamped => problem
      if (.not. problem%stiffness%is_symmetric()) then
         allocate (transform%symmetric_part, source=problem)
         transform%symmetric_part%stiffness = symmetric_stiffness(problem)
         undamped => transform%symmetric_part
      end if
      call new_symmetric_transform(transform%undamped, undamped, deflation, placement, solver, error)
      transform%undamped%map%loss = transform%forces%loss_factor
      if (allocated(error) .or. .not. present(counting_solver)) return
      if (.not. allocated(counting_solver)) return
      allocate (transform%census)
      call new_inertia_census(transform%census, undamped, transform%undamped%map, real(transform%undamped%shift, wp), &
         transform%undamped%operator%solver, counting_solver, size(deflation%decay), placement%mass_bound)
   end subroutine new_low_rank_transform

   subroutine iterate(self, selection, options, ritz, error, monitor)
      class(low_rank_transform_type), target, intent(inout) :: self
      type(modal_selection_type), intent(in) :: selection
      class(krylov_options_type), intent(in) :: options
      type(ritz_pairs_type), intent(out) :: ritz
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor
      type(ritz_check_type) :: check
      logical :: proceed, complete
      integer :: next

      if (allocated(self%symmetric_part)) self%undamped%operator%problem => self%symmetric_part
      call begin_or_continue(self%space, self%undamped%operator, self%forces, self%undamped%motions, options, &
         ritz%statistics, error)
      if (allocated(error)) return
      ritz%statistics%reason = reason_max_restarts
      next = min(selection%wanted, self%space%limit)
      ! The projection is only valid with all responses in the space.
      if (.not. options%observes) next = max(next, self%space%begun)
      proceed = .true.
      do
         if (associated(options%checkpoint)) call self%carry_state(options%checkpoint, ritz%statistics, next, error)
         if (allocated(error)) return
         do while (self%space%expanded < next .and. .not. (self%space%closed() .or. self%space%full()))
            call expand_block(self%undamped%operator, self%space, ritz%statistics, error)
            if (allocated(error)) return
            if (is_stopped(monitor)) exit
         end do
         if (self%space%closed()) call add_random_directions(self%undamped%operator, self%space, 1, filter, options%seed, &
            ritz%statistics, error)
         if (.not. allocated(error)) call self%check_space(selection, options, check, error)
         if (allocated(error)) return
         if (options%observes) then
            call take_undamped(self, options, check, ritz)
            return
         end if
         if (present(monitor)) call monitor%report(0, check%converged, check%needed, check%residual, proceed)
         if (is_stopped(monitor)) proceed = .false.
         complete = .false.
         if (check%settled()) call self%has_all_copies(selection, check, complete)
         if (self%space%closed()) exit
         if ((check%settled() .and. complete) .or. .not. proceed .or. self%space%at_end()) exit
         if (check%settled()) call add_random_directions(self%undamped%operator, self%space, 1, filter, options%seed, &
            ritz%statistics, error)
         if (allocated(error)) return
         next = min(self%space%expanded + max(8, self%space%expanded/10), self%space%limit)
      end do
      if (.not. proceed) then
         ritz%statistics%reason = reason_cancelled
      else if (check%settled() .and. (complete .or. self%space%whole())) then
         ritz%statistics%reason = reason_converged
      else if (self%space%closed() .and. .not. check%settled()) then
         ritz%statistics%reason = reason_fewer_modes
      end if
      call extract(self, check, ritz)
      associate (statistics => ritz%statistics)
         statistics%history = history_type([check%converged], [statistics%operator_applications], [check%residual])
      end associate
   end subroutine iterate

   ! Writes the state of the iteration to the checkpoint, or reads it, when that is due.
   subroutine carry_state(self, checkpoint, statistics, next, error)
      class(low_rank_transform_type), intent(inout) :: self
      type(checkpoint_type), intent(inout) :: checkpoint
      type(krylov_statistics_type), intent(inout) :: statistics
      integer, intent(inout) :: next
      type(error_type), allocatable, intent(out) :: error
      type(archive_type) :: archive

      if (.not. checkpoint%opens(archive, error)) return
      call self%space%carry(archive)
      call archive%carry(statistics%operator_applications)
      call archive%carry(statistics%orthogonalize_seconds)
      call archive%carry(next)
      if (allocated(self%census)) call self%census%carry(archive)
      call checkpoint%close(archive, error)
   end subroutine carry_state

   pure logical function settled(self)
      class(ritz_check_type), intent(in) :: self

      settled = self%needed > 0 .and. self%converged >= self%needed
   end function settled

   ! Tests convergence: computes the undamped Ritz pairs; after their convergence, or if the space cannot grow, also the damped
   ! pairs, by a dense problem of twice the order, which costs more than all tests before.
   subroutine check_space(self, selection, options, check, error)
      class(low_rank_transform_type), target, intent(inout) :: self
      type(modal_selection_type), intent(in) :: selection
      class(krylov_options_type), intent(in) :: options
      type(ritz_check_type), intent(out) :: check
      type(error_type), allocatable, intent(out) :: error
      type(modal_selection_type) :: undamped
      integer, allocatable :: order(:)
      complex(wp), allocatable :: vectors(:, :)
      real(wp), allocatable :: residuals(:)
      integer :: needed, k, j

      k = self%space%expanded
      if (k == 0) then
         ! All directions are those of motions already known.
         allocate (check%undamped%values(0), check%undamped%residuals(0), check%chosen(0))
         return
      end if
      call new_projection(check%undamped, self%space, self%space%expanded_responses(), self%forces, self%undamped%map, &
         real(self%undamped%shift, wp), error)
      if (allocated(error)) return
      undamped = self%undamped_selection(selection)
      allocate (order, source=order_by_preference(undamped, cmplx(check%undamped%values, 0, wp)))
      needed = undamped%needed(cmplx(check%undamped%values(order), 0, wp))
      ! Local forces may move the second real root of an oscillator out of range; another mode then takes its place.
      needed = max(needed, min(selection%wanted - size_or_zero(selection%known), self%space%most))
      check%needed = needed
      check%converged = count(check%undamped%residuals(order(:min(needed, k))) <= options%tolerance)
      check%residual = maxval(check%undamped%residuals(order(:min(needed, k))))
      if (options%observes .or. &
         (check%converged < needed .and. .not. (self%space%closed() .or. self%space%at_end()))) then
         ! The damped problem is not solved yet, or not needed.
         check%converged = 0
         allocate (check%chosen(0))
         return
      end if
      call check%undamped%eigenpairs(real(self%shift, wp), self%placement%unit, &
         self%space%states(self%undamped%operator%deflation%zero, check%undamped%vectors), check%pairs, error)
      if (allocated(error)) return
      associate (values => check%pairs%values)
         order = order_by_preference(selection, values)
         check%needed = selection%needed(values(order))
         allocate (check%chosen, source=order(:min(check%needed, size(values))))
         allocate (vectors, source=check%pairs%vectors(check%chosen))
         allocate (residuals, source=[(check%undamped%residual(self%shift + 1/values(check%chosen(j)), vectors(:k, j)), &
            j=1, size(check%chosen))])
         check%converged = count(residuals <= options%tolerance)
         check%residual = maxval([0.0_wp, residuals])
         if (.not. check%settled()) check%chosen = pack(check%chosen, residuals <= options%tolerance)
      end associate
   end subroutine check_space

   ! Number of known eigenvalues, 0 if there are none.
   pure integer function size_or_zero(known)
      complex(wp), allocatable, intent(in) :: known(:)

      size_or_zero = 0
      if (allocated(known)) size_or_zero = size(known)
   end function size_or_zero

   ! Selection of the undamped problem: as many modes, at the distances that proportional damping gives them.
   type(modal_selection_type) function undamped_selection(self, selection)
      class(low_rank_transform_type), intent(in) :: self
      type(modal_selection_type), intent(in) :: selection

      undamped_selection = modal_selection_type(selection%wanted, self%undamped%map, self%undamped%shift, selection%target, &
         selection%known)
   end function undamped_selection

   ! Asks the census whether the space has all undamped modes as near to the target as the damped ones, with all copies of multiple
   ! ones.
   subroutine has_all_copies(self, selection, check, complete)
      class(low_rank_transform_type), target, intent(inout) :: self
      type(modal_selection_type), intent(in) :: selection
      type(ritz_check_type), intent(in) :: check
      logical, intent(out) :: complete
      type(modal_selection_type) :: undamped
      integer :: order(size(check%undamped%values)), near, j
      real(wp) :: reach

      complete = .false.
      if (.not. allocated(self%census)) return
      undamped = self%undamped_selection(selection)
      order = order_by_preference(undamped, cmplx(check%undamped%values, 0, wp))
      reach = maxval([0.0_wp, (selection%key(check%pairs%values(check%chosen(j))), j=1, size(check%chosen))])
      near = max(1, count([(undamped%key(cmplx(check%undamped%values(j), 0, wp)) <= reach, j=1, size(order))]))
      self%census%target = selection%target
      ! The furthest may be damped ones: copies of undamped modes at smaller distances are needed anyway.
      self%census%within = reach
      call self%census%examine(check%undamped%values(order), check%undamped%residuals(order), near, complete, &
         self%space%seen_from_start(check%undamped%values, check%undamped%vectors))
      ! It counts undamped modes: that says nothing of damped ones.
      self%certificate = self%census%certificate
      self%certificate%verdict = certified_unknown
   end subroutine has_all_copies

   ! Returns the converged undamped eigenvalues, which give the scale of the problem, without those of rigid motions.
   subroutine take_undamped(self, options, check, ritz)
      class(low_rank_transform_type), intent(in) :: self
      class(krylov_options_type), intent(in) :: options
      type(ritz_check_type), intent(in) :: check
      type(ritz_pairs_type), intent(inout) :: ritz
      complex(wp) :: lambda(2), mu(size(check%undamped%values))
      integer :: found, j

      found = 0
      do j = 1, size(mu)
         associate (value => check%undamped%values(j), undamped => self%undamped)
            if (check%undamped%residuals(j) > options%tolerance .or. .not. abs(value) > 0) cycle
            if (abs(undamped%shift + 1/value) <= seems_zero**2*abs(undamped%shift)) cycle
            lambda = undamped%map%lambdas(undamped%shift + 1/value)
            found = found + 1
            mu(found) = 1/(lambda(1) - self%shift)
         end associate
      end do
      allocate (ritz%mu, source=mu(:found))
      allocate (ritz%vectors(0, found))
   end subroutine take_undamped

   ! Extracts the wanted pairs, one of each conjugate pair, which halves time and memory.
   subroutine extract(self, check, ritz)
      class(low_rank_transform_type), intent(in) :: self
      type(ritz_check_type), intent(in) :: check
      type(ritz_pairs_type), intent(inout) :: ritz
      ! Vectors at a time, to save memory.
      integer, parameter :: batch = 8
      complex(wp), allocatable :: y(:, :)
      integer, allocatable :: chosen(:)
      integer :: k, before, first, last

      k = self%space%expanded
      if (.not. allocated(check%pairs%values)) then
         allocate (ritz%mu(0), ritz%vectors(self%space%basis%length(), 0))
         return
      end if
      if (allocated(check%pairs%schur)) then
         before = size(check%pairs%schur, 1) - size(check%pairs%values)
         allocate (chosen, source=before + check%chosen)
         call keep_one_of_pairs(check%pairs%schur, chosen, ritz%paired)
         chosen = chosen - before
      else
         allocate (chosen, source=check%chosen)
      end if
      allocate (ritz%mu(size(chosen)), source=check%pairs%values(chosen))
      allocate (y, source=check%pairs%vectors(chosen))
      allocate (ritz%vectors(self%space%basis%length(), size(ritz%mu)))
      do first = 1, size(ritz%mu), batch
         last = min(first + batch - 1, size(ritz%mu))
         call self%space%basis%combine(matmul(check%undamped%vectors, y(:k, first:last)), ritz%vectors(:, first:last))
      end do
   end subroutine extract

   subroutine recover(self, ritz, pairs, error)
      class(low_rank_transform_type), intent(inout) :: self
      type(ritz_pairs_type), intent(inout) :: ritz
      type(eigenpairs_type), intent(out) :: pairs
      type(error_type), allocatable, intent(out) :: error
      integer :: j

      call move_alloc(ritz%vectors, pairs%phi)
      allocate (pairs%xi(size(self%undamped%operator%factors), size(ritz%mu)))
      call recover_shapes(self%undamped%operator, self%forces, self%space%unit_responses, self%undamped%map, &
         real(self%undamped%shift, wp), [(self%theta(ritz%mu(j)), j=1, size(ritz%mu))], pairs, error)
      ritz%statistics%operator_applications = ritz%statistics%operator_applications + size(ritz%mu)
   end subroutine recover

   subroutine transposed(self, problem, deflation, solver, adjoint, error)
      class(low_rank_transform_type), target, intent(in) :: self
      type(modal_problem_type), target, intent(in) :: problem
      type(deflation_type), target, intent(in) :: deflation
      class(complex_linear_solver_type), intent(in) :: solver
      class(transform_type), allocatable, intent(out) :: adjoint
      type(error_type), allocatable, intent(out) :: error
      type(low_rank_transform_type), allocatable :: own
      type(transposed_real_type), allocatable :: borrowed
      class(real_linear_solver_type), allocatable :: factors

      associate (unused => solver)
      end associate
      allocate (own, borrowed)
      borrowed%original => self%undamped%operator%solver
      call move_alloc(borrowed, factors)
      call new_low_rank_transform(own, problem, deflation, self%placement, factors, error)
      own%borrows = .true.
      call move_alloc(own, adjoint)
   end subroutine transposed

   subroutine hand_over(self, spare)
      class(low_rank_transform_type), intent(inout) :: self
      type(spare_solvers_type), intent(inout) :: spare

      call self%undamped%hand_over(spare)
   end subroutine hand_over

   function linear_solver(self) result(solver)
      class(low_rank_transform_type), target, intent(in) :: self
      class(linear_solver_type), pointer :: solver

      solver => self%undamped%linear_solver()
   end function linear_solver

   integer function order(self)
      class(low_rank_transform_type), intent(in) :: self

      order = self%undamped%order()
   end function order
end module kschur_low_rank_transform
