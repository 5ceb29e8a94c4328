!> Computes left eigenvectors as conjugated modes of the transposed problem; of a symmetric problem these are the modes themselves.
module kschur_left_run
   use kschur_backward_error, only: backward_errors
   use kschur_context, only: solve_context_type, whole_both
   use kschur_effort, only: for_left
   use kschur_eigenpairs, only: eigenpairs_type, normalize
   use kschur_error, only: error_convergence, error_singular, error_type, take_cancelled
   use kschur_examination, only: find_rigid_motions, assume_no_rigid_motions
   use kschur_finishing, only: is_small
   use kschur_hidden, only: are_known
   use kschur_left, only: find_left_pairs, set_left_modes
   use kschur_kinds, only: wp
   use kschur_modes, only: modes_type, no_modes
   use kschur_outcome, only: certified_yes, reason_cancelled, reason_converged, reason_fewer_modes, reason_inaccurate
   use kschur_polish, only: polisher_type
   use kschur_problem, only: modal_problem_type
   use kschur_scaling, only: constraint_factors, first_scale
   use kschur_search, only: find_modes
   use kschur_shapes, only: orthonormalize_zeros
   use kschur_text, only: text
   use kschur_tolerances, only: above_all_rounding, blurred_value
   use kschur_transposed, only: transpose_problem
   implicit none
   private
   public :: bound_modes, find_left_modes, lacks_bounds

contains

   !> Sets left vectors and condition numbers of modes. If some cannot be found, the reason becomes inaccurate, or cancelled.
   subroutine find_left_modes(s, modes, error, iterates)
      type(solve_context_type), target, intent(inout) :: s
      type(modes_type), intent(inout) :: modes
      type(error_type), allocatable, intent(out) :: error
      !> Whether the transposed problem is iterated, or each left vector is polished without. Absent: it is iterated.
      logical, intent(in), optional :: iterates
      type(solve_context_type), target :: adjoint
      type(modal_problem_type), target :: transposed
      type(modes_type) :: found
      type(eigenpairs_type) :: left
      logical :: complete, iterated

      iterated = .true.
      if (present(iterates)) iterated = iterates
      call s%announce_phase("left vectors", whole_both, error)
      if (allocated(error)) return
      call modes%make_complex()
      if (s%problem%symmetric .or. size(modes%lambda) == 0) then
         call find_left_pairs(s%problem, s%problem, modes, modes, modes%backward_error, left, s%effort, error, complete=complete)
         if (.not. allocated(error) .and. complete) call set_left_modes(s%problem, left, modes)
         if (allocated(error) .or. complete) return
      end if
      call transpose_problem(s%problem, transposed, error)
      if (.not. allocated(error)) call begin_transposed(s, transposed, adjoint, error)
      if (allocated(error)) return
      if (s%problem%symmetric) then
         found = modes
      else if (iterated) then
         call find_transposed_modes(s, adjoint, found, error)
      else
         found = no_modes(transposed%unknowns(), transposed%multipliers())
      end if
      if (.not. allocated(error)) call find_balanced_left_pairs(s, adjoint, found, modes, left, error)
      if (allocated(error)) return
      call adjoint%expand(left, error)
      if (allocated(error)) return
      call set_left_modes(s%problem, left, modes)
      call adjoint%drop_transform()
      call s%effort%add_effort(adjoint%effort)
      if (any(modes%reason == [reason_converged, reason_fewer_modes]) .and. .not. all(modes%condition >= 0)) &
         modes%reason = merge(reason_cancelled, reason_inaccurate, found%reason == reason_cancelled)
   end subroutine find_left_modes

   !> Whether modes lack error bounds, and the left vectors for these cost little: next to a dense solve, or to the refinement of a
   !> small problem.
   logical function lacks_bounds(s, modes)
      type(solve_context_type), intent(in) :: s
      type(modes_type), intent(in) :: modes

      lacks_bounds = modes%reason /= reason_cancelled .and. any(are_unbounded(s, modes)) .and. &
         (s%dense .or. (is_small(s) .and. (s%problem%symmetric .or. .not. (s%is_lossy() .or. s%options%is_plain()))))
   end function lacks_bounds

   ! Whether each mode has no error bound, or of a symmetric problem one that leaves no usable number, as where a few large entries
   ! hide the others.
   function are_unbounded(s, modes)
      type(solve_context_type), intent(in) :: s
      type(modes_type), intent(in) :: modes
      logical :: are_unbounded(size(modes%lambda))

      are_unbounded = .not. modes%error_bound >= 0
      if (.not. s%problem%symmetric .or. size(modes%lambda) == 0) return
      are_unbounded = are_unbounded .or. (modes%error_bound >= blurred_value*abs(modes%lambda) .and. abs(modes%lambda) > 0 .and. &
         .not. are_known(s, modes%lambda))
   end function are_unbounded

   !> Sets the error bounds of modes that lack them from left vectors, which are not kept. Where these cannot be found, bounds
   !> stay as they are; modes of an unsymmetric problem that were iterated are left out then, unless they are counted.
   subroutine bound_modes(s, modes)
      type(solve_context_type), target, intent(inout) :: s
      type(modes_type), intent(inout) :: modes
      type(modes_type) :: with_left
      type(error_type), allocatable :: error
      logical, dimension(size(modes%lambda)) :: unbounded, missing
      integer :: attempt

      unbounded = are_unbounded(s, modes)
      ! Factors beside each mode take the place of another iteration, which may yet find what they miss.
      do attempt = merge(2, 1, s%dense .or. s%problem%symmetric), 2
         with_left = modes
         call find_left_modes(s, with_left, error, iterates=attempt == 2)
         if (s%is_stopped()) modes%reason = reason_cancelled
         if (modes%reason == reason_cancelled) return
         if (allocated(error)) cycle
         missing = unbounded .and. .not. with_left%condition >= 0
         if (.not. any(missing)) exit
      end do
      if (allocated(error)) then
         call s%add_note("errors of modes have no bound: "//error%message)
         return
      end if
      modes%error_bound = with_left%error_bound
      modes%uncertainty = with_left%uncertainty
      ! A dense set is complete, whatever its bounds.
      if (s%dense .or. s%problem%symmetric .or. .not. any(missing)) return
      if (modes%certified == certified_yes .or. modes%missing == 0) then
         call s%add_note("modes whose errors have no bound, as no left vectors of them were found: "//text(count(missing)))
         return
      end if
      call modes%leave_out(missing)
      if (any(modes%reason == [reason_converged, reason_fewer_modes])) modes%reason = reason_inaccurate
   end subroutine bound_modes

   ! Computes the modes of the transposed problem on the factors of the problem. Returns none if there is no transform, if the
   ! monitor cancels, or if the transposed matrix is singular in the solves: missing left vectors are polished later.
   subroutine find_transposed_modes(s, adjoint, found, error)
      type(solve_context_type), target, intent(inout) :: s
      type(solve_context_type), target, intent(inout) :: adjoint
      type(modes_type), intent(out) :: found
      type(error_type), allocatable, intent(out) :: error
      logical :: cancelled, iterated

      cancelled = .false.
      iterated = allocated(s%transform)
      if (iterated) then
         call transpose_transform(s, adjoint, error)
         ! The eigenvalues are known from the modes, and vectors that are too inaccurate are polished with them.
         if (.not. allocated(error)) call find_modes(adjoint, found, error, refines=.false.)
         call take_cancelled(error, cancelled)
         if (allocated(error)) then
            if (all(error%code /= [error_singular, error_convergence])) return
            deallocate (error)
            iterated = .false.
         end if
      end if
      if (iterated .and. .not. cancelled) return
      found = no_modes(adjoint%problem%unknowns(), adjoint%problem%multipliers())
      if (cancelled) found%reason = reason_cancelled
   end subroutine find_transposed_modes

   ! Finds one left pair of the iterated problem for each mode, and polishes those that are missing or inaccurate. In balanced
   ! units: in the units as given, a few large entries may hide errors.
   subroutine find_balanced_left_pairs(s, adjoint, found, modes, left, error)
      type(solve_context_type), intent(inout) :: s
      type(solve_context_type), intent(in) :: adjoint
      class(modes_type), intent(in) :: found, modes
      type(eigenpairs_type), intent(out) :: left
      type(error_type), allocatable, intent(out) :: error
      type(eigenpairs_type) :: pairs
      ! Not allocated if the monitor has cancelled the iteration.
      type(polisher_type), allocatable :: polisher
      real(wp), allocatable :: errors(:)
      integer :: j

      pairs = s%contract(modes)
      do j = 1, size(pairs%lambda)
         call normalize(pairs, j)
      end do
      allocate (errors, source=max(modes%backward_error, backward_errors(s%work, pairs)))
      if (found%reason /= reason_cancelled) then
         allocate (polisher)
         call polisher%begin(constraint_factors(adjoint%work, s%options%constraint_scaling, s%shift), &
            adjoint%known%redundant, above_all_rounding, s%inner%complex)
         polisher%reference = max(s%reference(), first_scale(adjoint%work))
      end if
      call find_left_pairs(s%work, adjoint%work, adjoint%contract(found), pairs, errors, left, s%effort, error, polisher)
   end subroutine find_balanced_left_pairs

   ! Makes a context for the transposed problem, with the transposed reduction.
   subroutine begin_transposed(s, transposed, adjoint, error)
      type(solve_context_type), target, intent(in) :: s
      type(modal_problem_type), target, intent(in) :: transposed
      type(solve_context_type), target, intent(inout) :: adjoint
      type(error_type), allocatable, intent(out) :: error

      allocate (adjoint%notes(0))
      adjoint%problem => transposed
      adjoint%options = s%options
      adjoint%inner = s%inner
      adjoint%monitor => s%monitor
      adjoint%checkpoint => s%checkpoint
      adjoint%formulation = s%formulation
      adjoint%dense = s%dense
      adjoint%plan = s%plan%transposed()
      adjoint%shift = s%shift
      adjoint%scale = s%scale
      adjoint%known%redundant = s%known%redundant - s%plan%redundant
      call transpose_problem(s%work, adjoint%work, error)
   end subroutine begin_transposed

   ! Finds the rigid motions of the transposed problem, and makes its transform on the same factors.
   subroutine transpose_transform(s, adjoint, error)
      type(solve_context_type), target, intent(in) :: s
      type(solve_context_type), target, intent(inout) :: adjoint
      type(error_type), allocatable, intent(out) :: error
      type(eigenpairs_type) :: rigid

      if (size(s%known%rigid%lambda) > 0) then
         ! The transposed stiffness has a null space of the same dimension.
         call find_rigid_motions(adjoint%work, adjoint%formulation, merge(huge(1), s%options%modes, s%dense), adjoint%inner, &
            adjoint%known, adjoint%effort, error, s%monitor)
      else
         call assume_no_rigid_motions(adjoint%work, adjoint%known)
      end if
      if (allocated(error)) return
      call adjoint%drop_stiffness()
      rigid = adjoint%known%rigid
      call adjoint%expand(rigid, error)
      if (allocated(error)) return
      call orthonormalize_zeros(rigid)
      adjoint%known%rigid = rigid
      adjoint%known%total = s%known%total
      call s%transform%transposed(adjoint%work, adjoint%known%deflation, adjoint%inner%complex, adjoint%transform, error)
      if (allocated(error)) return
      if (.not. adjoint%transform%borrows) call adjoint%effort%add_factors(adjoint%transform%linear_solver(), for_left)
   end subroutine transpose_transform
end module kschur_left_run
