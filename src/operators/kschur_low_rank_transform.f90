!> Problems that are symmetric and proportionally damped but for local forces, as a transform: the undamped Krylov space
!> of the symmetric form, with the responses to those forces among its start vectors, holds all their modes. Every mode
!> is a combination of undamped modes and of such responses.
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
   use kschur_outcome, only: history_type, reason_cancelled, reason_converged, reason_fewer_modes, reason_max_restarts
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

   !> The undamped part with its local forces, and the space that grows for both.
   type, extends(transform_type) :: low_rank_transform_type
      !> The undamped part, factored.
      type(symmetric_transform_type) :: undamped
      type(local_forces_type) :: forces
      ! The problem with the symmetric part of K, where K is not symmetric.
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
      procedure, private :: keep
      procedure, private :: look
      procedure, private :: undamped_selection
      procedure, private :: copies_are_there
   end type low_rank_transform_type

   ! What a look at the space tells.
   type :: look_type
      type(projection_type) :: undamped
      type(dense_eigenpairs_type) :: pairs
      !> The wanted ones of the pairs, most wanted first; how many it takes; how many of these have converged.
      integer, allocatable :: chosen(:)
      integer :: needed = 0, converged = 0
      real(wp) :: residual = 0
   contains
      procedure :: settled
   end type look_type

contains

   !> Factors [K_s - s M, Cq^T; Cq, 0], s = theta(lambda) of the proportional part; of a complex lambda the real part.
   subroutine new_low_rank_transform(transform, problem, deflation, placement, solver, error, counting_solver)
      type(low_rank_transform_type), target, intent(out) :: transform
      type(modal_problem_type), target, intent(in) :: problem
      type(deflation_type), target, intent(in) :: deflation
      type(placement_type), intent(in) :: placement
      class(real_linear_solver_type), allocatable, intent(inout) :: solver
      type(error_type), allocatable, intent(out) :: error
      !> A solver that tells the inertia of indefinite matrices.
      class(real_linear_solver_type), allocatable, optional, intent(inout) :: counting_solver
      type(modal_problem_type), pointer :: undamped
      logical :: few

      transform%placement = placement
      ! Of the projected problem, which may have eigenvalues next to zero.
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
      if (allocated(error) .or. .not. present(counting_solver)) return
      if (.not. allocated(counting_solver)) return
      allocate (transform%census)
      call new_inertia_census(transform%census, undamped, transform%undamped%map, real(transform%undamped%shift, wp), &
         transform%undamped%operator%solver, counting_solver, size(deflation%decay))
   end subroutine new_low_rank_transform

   subroutine iterate(self, selection, options, ritz, error, monitor)
      class(low_rank_transform_type), target, intent(inout) :: self
      type(modal_selection_type), intent(in) :: selection
      class(krylov_options_type), intent(in) :: options
      type(ritz_pairs_type), intent(out) :: ritz
      type(error_type), allocatable, intent(out) :: error
      class(monitor_type), intent(inout), optional :: monitor
      type(look_type) :: seen
      logical :: proceed, complete
      integer :: next

      if (allocated(self%symmetric_part)) self%undamped%operator%problem => self%symmetric_part
      call begin_or_continue(self%space, self%undamped%operator, self%forces, self%undamped%motions, options, &
         ritz%statistics, error)
      if (allocated(error)) return
      ritz%statistics%reason = reason_max_restarts
      next = min(selection%wanted, self%space%limit)
      ! Without the responses the projected problem is another one.
      if (.not. options%observes) next = max(next, self%space%begun)
      proceed = .true.
      do
         if (associated(options%checkpoint)) call self%keep(options%checkpoint, ritz%statistics, next, error)
         if (allocated(error)) return
         do while (self%space%expanded < next .and. .not. (self%space%closed() .or. self%space%full()))
            call expand_block(self%undamped%operator, self%space, ritz%statistics, error)
            if (allocated(error)) return
            if (is_stopped(monitor)) exit
         end do
         if (self%space%closed()) call add_random_directions(self%undamped%operator, self%space, 1, filter, options%seed, &
            ritz%statistics, error)
         if (.not. allocated(error)) call self%look(selection, options, seen, error)
         if (allocated(error)) return
         if (options%observes) then
            call take_undamped(self, options, seen, ritz)
            return
         end if
         if (present(monitor)) call monitor%report(0, seen%converged, seen%needed, seen%residual, proceed)
         if (is_stopped(monitor)) proceed = .false.
         complete = .false.
         if (seen%settled()) call self%copies_are_there(selection, seen, complete)
         if (self%space%closed()) exit
         if ((seen%settled() .and. complete) .or. .not. proceed .or. self%space%at_end()) exit
         if (seen%settled()) call add_random_directions(self%undamped%operator, self%space, 1, filter, options%seed, &
            ritz%statistics, error)
         if (allocated(error)) return
         next = min(self%space%expanded + max(8, self%space%expanded/10), self%space%limit)
      end do
      if (.not. proceed) then
         ritz%statistics%reason = reason_cancelled
      else if (seen%settled() .and. (complete .or. self%space%whole())) then
         ritz%statistics%reason = reason_converged
      else if (self%space%closed() .and. .not. seen%settled()) then
         ritz%statistics%reason = reason_fewer_modes
      end if
      call extract(self, seen, ritz)
      associate (statistics => ritz%statistics)
         statistics%history = history_type([seen%converged], [statistics%operator_applications], [seen%residual])
      end associate
   end subroutine iterate

   ! Where it is time to, the state goes to the checkpoint, or comes from it.
   subroutine keep(self, checkpoint, statistics, next, error)
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
   end subroutine keep

   pure logical function settled(self)
      class(look_type), intent(in) :: self

      settled = self%needed > 0 .and. self%converged >= self%needed
   end function settled

   ! The undamped Ritz pairs; and, where those have converged, or nothing more is to come, the damped ones: by a dense problem
   ! of twice the order, which costs more than all looks before.
   subroutine look(self, selection, options, seen, error)
      class(low_rank_transform_type), target, intent(inout) :: self
      type(modal_selection_type), intent(in) :: selection
      class(krylov_options_type), intent(in) :: options
      type(look_type), intent(out) :: seen
      type(error_type), allocatable, intent(out) :: error
      type(modal_selection_type) :: undamped
      integer, allocatable :: order(:)
      complex(wp), allocatable :: vectors(:, :)
      real(wp), allocatable :: residuals(:)
      integer :: needed, k, j

      k = self%space%expanded
      if (k == 0) return
      call new_projection(seen%undamped, self%space, self%space%expanded_responses(), self%forces, self%undamped%map, &
         real(self%undamped%shift, wp), error)
      if (allocated(error)) return
      undamped = self%undamped_selection(selection)
      allocate (order, source=order_by_preference(undamped, cmplx(seen%undamped%values, 0, wp)))
      needed = undamped%needed(cmplx(seen%undamped%values(order), 0, wp))
      ! Local forces may drive the second real root of an oscillator out of reach, and it takes another mode in its place.
      needed = max(needed, min(selection%wanted - count_of(selection%known), self%space%most))
      seen%needed = needed
      seen%converged = count(seen%undamped%residuals(order(:min(needed, k))) <= options%tolerance)
      seen%residual = maxval(seen%undamped%residuals(order(:min(needed, k))))
      if (options%observes .or. &
         (seen%converged < needed .and. .not. (self%space%closed() .or. self%space%at_end()))) then
         ! Nothing of the damped problem is known yet, or asked for.
         seen%converged = 0
         allocate (seen%chosen(0))
         return
      end if
      call seen%undamped%eigenpairs(real(self%shift, wp), self%placement%unit, &
         self%space%states(self%undamped%operator%deflation%zero, seen%undamped%vectors), seen%pairs, error)
      if (allocated(error)) return
      associate (values => seen%pairs%values)
         order = order_by_preference(selection, values)
         seen%needed = selection%needed(values(order))
         allocate (seen%chosen, source=order(:min(seen%needed, size(values))))
         allocate (vectors, source=seen%pairs%vectors(seen%chosen))
         allocate (residuals, source=[(seen%undamped%residual(self%shift + 1/values(seen%chosen(j)), vectors(:k, j)), &
            j=1, size(seen%chosen))])
         seen%converged = count(residuals <= options%tolerance)
         seen%residual = maxval([0.0_wp, residuals])
         if (.not. seen%settled()) seen%chosen = pack(seen%chosen, residuals <= options%tolerance)
      end associate
   end subroutine look

   pure integer function count_of(known)
      complex(wp), allocatable, intent(in) :: known(:)

      count_of = 0
      if (allocated(known)) count_of = size(known)
   end function count_of

   ! What is wanted of the undamped part: as many modes, with the distances that damping in proportion gives them.
   type(modal_selection_type) function undamped_selection(self, selection)
      class(low_rank_transform_type), intent(in) :: self
      type(modal_selection_type), intent(in) :: selection

      undamped_selection = modal_selection_type(selection%wanted, self%undamped%map, self%undamped%shift, selection%target, &
         selection%known)
   end function undamped_selection

   ! Whether the space has all undamped modes as near to the target as the damped ones, each as often as it is one.
   subroutine copies_are_there(self, selection, seen, complete)
      class(low_rank_transform_type), target, intent(inout) :: self
      type(modal_selection_type), intent(in) :: selection
      type(look_type), intent(in) :: seen
      logical, intent(out) :: complete
      type(modal_selection_type) :: undamped
      integer :: order(size(seen%undamped%values)), near, j
      real(wp) :: reach

      complete = .false.
      if (.not. allocated(self%census)) return
      undamped = self%undamped_selection(selection)
      order = order_by_preference(undamped, cmplx(seen%undamped%values, 0, wp))
      reach = maxval([0.0_wp, (selection%key(seen%pairs%values(seen%chosen(j))), j=1, size(seen%chosen))])
      near = max(1, count([(undamped%key(cmplx(seen%undamped%values(j), 0, wp)) <= reach, j=1, size(order))]))
      self%census%target = selection%target
      ! Damped modes may be the furthest: copies at a lesser distance are to be there all the same.
      self%census%within = reach
      call self%census%examine(seen%undamped%values(order), seen%undamped%residuals(order), near, complete)
   end subroutine copies_are_there

   ! What tells a scale are the undamped eigenvalues, those of rigid motions apart: the space is made for these.
   subroutine take_undamped(self, options, seen, ritz)
      class(low_rank_transform_type), intent(in) :: self
      class(krylov_options_type), intent(in) :: options
      type(look_type), intent(in) :: seen
      type(ritz_pairs_type), intent(inout) :: ritz
      complex(wp) :: lambda(2), mu(size(seen%undamped%values))
      integer :: found, j

      found = 0
      do j = 1, size(mu)
         associate (value => seen%undamped%values(j), undamped => self%undamped)
            if (seen%undamped%residuals(j) > options%tolerance .or. .not. abs(value) > 0) cycle
            if (abs(undamped%shift + 1/value) <= seems_zero**2*abs(undamped%shift)) cycle
            lambda = undamped%map%lambdas(undamped%shift + 1/value)
            found = found + 1
            mu(found) = 1/(lambda(1) - self%shift)
         end associate
      end do
      allocate (ritz%mu, source=mu(:found))
      allocate (ritz%vectors(0, found))
   end subroutine take_undamped

   ! The wanted pairs, of a conjugate pair one: shapes of both would take twice the time and room.
   subroutine extract(self, seen, ritz)
      class(low_rank_transform_type), intent(in) :: self
      type(look_type), intent(in) :: seen
      type(ritz_pairs_type), intent(inout) :: ritz
      ! Vectors at a time: copies of all would take as much memory.
      integer, parameter :: batch = 8
      complex(wp), allocatable :: y(:, :)
      integer, allocatable :: chosen(:)
      integer :: k, before, first, last

      k = self%space%expanded
      if (.not. allocated(seen%pairs%values)) then
         allocate (ritz%mu(0), ritz%vectors(self%space%basis%length(), 0))
         return
      end if
      before = size(seen%pairs%schur, 1) - size(seen%pairs%values)
      allocate (chosen, source=before + seen%chosen)
      call keep_one_of_pairs(seen%pairs%schur, chosen, ritz%paired)
      chosen = chosen - before
      allocate (ritz%mu(size(chosen)), source=seen%pairs%values(chosen))
      allocate (y, source=seen%pairs%vectors(chosen))
      allocate (ritz%vectors(self%space%basis%length(), size(ritz%mu)))
      do first = 1, size(ritz%mu), batch
         last = min(first + batch - 1, size(ritz%mu))
         call self%space%basis%combine(matmul(seen%undamped%vectors, y(:k, first:last)), ritz%vectors(:, first:last))
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
