!> Prepares a problem for the iteration: reduces and examines it.
module kschur_preparation
   use kschur_backward_error, only: norms_of
   use kschur_balance, only: balance
   use kschur_clock, only: clock, seconds_since
   use kschur_context, only: solve_context_type, whole_iterated
   use kschur_dense_choice, only: consider_dense, settle_dense
   use kschur_eigenpairs, only: eigenpairs_type, move_pairs
   use kschur_eigenvalue_count, only: count_eigenvalues
   use kschur_error, only: error_input, error_singular, error_type, new_error
   use kschur_examination, only: find_rigid_motions, assume_no_rigid_motions
   use kschur_formulation, only: is_structured
   use kschur_kinds, only: long, wp
   use kschur_memory, only: require_memory
   use kschur_notes, only: named, note_dependence, note_penalties, note_problem
   use kschur_options, only: formulation_proportional, formulation_quadratic, formulation_symmetric
   use kschur_presolve, only: presolve
   use kschur_problem, only: modal_problem_type
   use kschur_processes, only: are_several
   use kschur_redundancy, only: dependence_type, find_dependence
   use kschur_saddle, only: order_elimination
   use kschur_shapes, only: orthonormalize_zeros
   use kschur_sparse, only: same_pattern
   use kschur_suspicions, only: note_suspicions
   use kschur_text, only: text
   use kschur_tolerances, only: blurred_entry
   implicit none
   private
   public :: examine, reduce, reduce_again

contains

   !> Eliminates clamped and tied unknowns, and balances the reduced problem. The pencils of Table 1 keep all unknowns; plain ARPACK
   !> also keeps their units.
   subroutine reduce(s, error)
      type(solve_context_type), intent(inout) :: s
      type(error_type), allocatable, intent(out) :: error

      call require_memory(3*s%problem%bytes(), "the reduced matrices", error)
      if (.not. allocated(error)) call s%enter_phase("presolve", error)
      if (allocated(error)) return
      call presolve(s%problem, s%work, s%plan, error, eliminating=s%options%presolve .and. is_structured(s%formulation))
      if (allocated(error)) then
         ! No unknown is left: a problem without modes.
         if (s%plan%unknowns_after == 0 .and. error%code == error_input) deallocate (error)
      end if
      if (allocated(error) .or. s%plan%unknowns_after == 0) return
      ! That of the problem as given.
      if (s%plan%eliminated > 0) s%known%mass_bound = 0
      if (.not. s%options%is_plain()) call balance(s%work, s%plan)
   end subroutine reduce

   !> Reduces the problem again after damping and stiffness have got other values. Keeps the elimination order if the patterns are
   !> the same, and counts the eigenvalues.
   subroutine reduce_again(s, error)
      type(solve_context_type), intent(inout) :: s
      type(error_type), allocatable, intent(out) :: error
      type(modal_problem_type), allocatable :: former

      allocate (former, source=s%work)
      call reduce(s, error)
      if (allocated(error)) return
      if (same_pattern(former%mass, s%work%mass) .and. same_pattern(former%damping, s%work%damping) .and. &
         same_pattern(former%stiffness, s%work%stiffness) .and. same_pattern(former%constraints, s%work%constraints) .and. &
         allocated(former%position)) call move_alloc(former%position, s%work%position)
      s%known%total = count_eigenvalues(s%work, s%known%deflation, s%known%redundant - s%plan%redundant, &
         size(s%known%rigid%lambda))
   end subroutine reduce_again

   !> Removes redundant constraints, replaces nearly dependent ones, finds the rigid motions, and counts the eigenvalues; zero if
   !> the constraints leave no motion. Plain ARPACK keeps all constraints and looks for no rigid motions. Adds notes on the problem.
   !> Fails if a motion has neither mass, damping nor stiffness.
   subroutine examine(s, error)
      type(solve_context_type), target, intent(inout) :: s
      type(error_type), allocatable, intent(out) :: error
      type(dependence_type) :: dependence
      type(eigenpairs_type) :: rigid
      integer(long) :: started

      s%known%redundant = s%plan%redundant
      if (associated(s%shared)) then
         ! Processes judge modes by their rows, each of which does not tell norms. A loss factor that was set after reading is not
         ! in the rows.
         if (s%shared%is_distributed(s%processes) .and. (allocated(s%problem%loss) .eqv. allocated(s%shared%rows%loss))) &
            s%norms = norms_of(s%problem)
      end if
      call note_penalties(s%problem, s%notes)
      call note_suspicions(s%problem, s%notes)
      if (s%plan%unknowns_after == 0) then
         allocate (rigid%lambda(0), rigid%real_phi(s%problem%unknowns(), 0), rigid%xi(s%problem%multipliers(), 0))
         call move_pairs(rigid, s%known%rigid)
         call note_problem(s%work, s%problem%multipliers(), s%known%redundant, s%notes)
         return
      end if
      call require_memory(3*s%work%bytes() + s%bytes_of_shapes(8), "the examination of the problem", error)
      if (.not. allocated(error)) call s%enter_phase("rank of the constraints", error)
      if (allocated(error)) return
      call find_dependence(s%work%constraints, dependence, error)
      if (allocated(error)) return
      s%known%redundant = count(dependence%is_redundant)
      call note_problem(s%work, s%problem%multipliers(), s%plan%redundant + s%known%redundant, s%notes)
      call note_dependence(s%problem, dependence, s%plan%kept, s%notes)
      if (.not. s%options%is_plain()) then
         associate (d => dependence)
            call s%plan%replace_rows(d%is_redundant, d%near, d%combinations, d%rows, s%work, error)
         end associate
         s%known%redundant = 0
      end if
      if (allocated(error)) return
      if (s%options%is_plain()) then
         call assume_no_rigid_motions(s%work, s%known)
      else
         call s%enter_phase("rigid motions", error, whole_iterated)
         if (allocated(error)) return
         started = clock()
         call order_elimination(s%work, error)
         s%effort%seconds%analyze = s%effort%seconds%analyze + seconds_since(started)
         if (allocated(error)) return
         call consider_dense(s)
         if (frees_matrices(s)) call s%share_matrices(error)
         if (allocated(error)) return
         ! Unless they are allocated, they count as absent.
         call find_rigid_motions(s%work, s%formulation, merge(huge(1), s%options%modes, s%dense), s%inner, s%known, s%effort, &
            error, s%monitor, s%matrices)
         if (allocated(s%known%singular_motion)) call name_motion(s, error)
         if (s%known%chains_skipped > 0) call s%add_note("there are "//text(s%known%chains_skipped)// &
            " rigid motions, too many to look for what damping makes of them: modes near zero may be missing, or too many")
         if (s%known%lossy > 0) call s%add_note("the loss matrix H acts on "//text(s%known%lossy)// &
            " motions without stiffness: they are no rigid ones")
      end if
      if (allocated(error)) return
      call require_memory(s%bytes_of_shapes(3*size(s%known%rigid%lambda)), "rigid motions", error)
      if (allocated(error)) return
      call move_pairs(s%known%rigid, rigid)
      call s%expand(rigid, error)
      if (allocated(error)) return
      call orthonormalize_zeros(rigid)
      call move_pairs(rigid, s%known%rigid)
      s%known%massless = count(.not. s%work%mass%row_maxima() > 0)
      s%known%total = count_eigenvalues(s%work, s%known%deflation, s%known%redundant, size(s%known%rigid%lambda))
      call settle_dense(s)
      call announce_number(s)
      s%known%redundant = s%plan%redundant + s%known%redundant
   end subroutine examine

   ! Whether several processes distribute the matrices before the stiffness is factored, which needs none of them whole.
   logical function frees_matrices(s)
      type(solve_context_type), intent(in) :: s

      frees_matrices = are_several(s%processes, s%work%unknowns()) .and. s%work%symmetric .and. .not. s%dense .and. &
         any(s%formulation == [formulation_symmetric, formulation_proportional, formulation_quadratic])
   end function frees_matrices

   ! Makes the error that names the unknowns of a motion without mass, damping and stiffness.
   subroutine name_motion(s, error)
      type(solve_context_type), intent(in) :: s
      type(error_type), allocatable, intent(inout) :: error
      type(eigenpairs_type) :: motion

      allocate (motion%lambda(1), source=(0.0_wp, 0.0_wp))
      allocate (motion%real_phi, source=reshape(s%known%singular_motion, [size(s%known%singular_motion), 1]))
      allocate (motion%xi(s%work%multipliers(), 1), source=(0.0_wp, 0.0_wp))
      call s%plan%expand_shapes(motion)
      associate (sizes => abs(motion%real_phi(:, 1)))
         call new_error(error, error_singular, "the problem is singular for every lambda: the motion of "// &
            trim(named("unknown", sizes > blurred_entry*maxval(sizes), s%problem%index_base))// &
            " has neither mass, damping nor stiffness; give it one of them, or a constraint that holds it")
      end associate
   end subroutine name_motion

   ! Adds a note, and tells the monitor, if more modes are requested than there are eigenvalues.
   subroutine announce_number(s)
      type(solve_context_type), intent(inout) :: s

      associate (number => s%known%total%number)
         if (s%options%modes <= number .or. s%options%is_plain()) return
         call s%add_note("of "//text(s%options%modes)//" modes there are "//text(number)// &
            " at most: so many eigenvalues the problem has, both of a conjugate pair counted")
         if (associated(s%monitor)) call s%monitor%announce("the problem has "//text(number)// &
            " eigenvalues, both of a conjugate pair counted: no more modes are looked for")
      end associate
   end subroutine announce_number
end module kschur_preparation
