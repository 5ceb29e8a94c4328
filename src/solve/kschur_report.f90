!> Fills the result of a solve.
module kschur_report
   use kschur_bound_verdict, only: judge_bounds
   use kschur_context, only: solve_context_type, whole_given
   use kschur_description, only: describe
   use kschur_effort, only: phase_judge
   use kschur_error, only: error_type
   use kschur_hidden, only: tell_hidden
   use kschur_kinds, only: wp
   use kschur_last_analysis, only: last_analysis_type
   use kschur_memory, only: require_memory
   use kschur_linear_solver, only: linear_solver_type
   use kschur_mesh, only: join_nodes
   use kschur_mode_selection, only: nearest_first
   use kschur_modes, only: modes_type
   use kschur_normalisation, only: normalise_shapes
   use kschur_notes, only: note_accumulation, note_inaccurate, note_modes
   use kschur_options, only: modal_options_type, formulation_dense
   use kschur_problem, only: modal_problem_type
   use kschur_result, only: modal_result_type
   use kschur_settings, only: method_name
   implicit none
   private
   public :: report

contains

   !> Fills the result from the modes and the context: describes, notes and normalises the modes, and adds up the effort. The modes
   !> are moved into the result; factors are freed.
   subroutine report(s, options, modes, result, error, by_frequency)
      type(solve_context_type), intent(inout) :: s
      !> Options of the caller.
      type(modal_options_type), intent(in) :: options
      type(modes_type), intent(inout) :: modes
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      !> Present: sorts the modes by frequency, instead of by distance from the target.
      logical, intent(in), optional :: by_frequency
      real(wp), allocatable :: rigid(:, :)

      call require_memory(s%bytes_of_shapes(2*size(modes%lambda)), "the result", error)
      if (.not. allocated(error)) call tell_hidden(s, modes, error)
      if (allocated(error)) return
      call judge_bounds(s, modes)
      call report_factors(s, result)
      call s%announce_phase("result", whole_given, error)
      if (allocated(error)) return
      call report_problem(s, options, result)
      ! After the factors and matrices are freed: complex shapes need their memory.
      call report_modes(modes, result)
      call move_alloc(s%notes, result%notes)
      call s%known%rigid_motions(rigid)
      call describe(s%problem, rigid, result)
      if (present(by_frequency)) call order_by_frequency(result)
      call note_inaccurate(s%problem, size(modes%unlisted), result)
      if (size(result%eigenvalues) > 0) call note_modes(s%problem, merge(huge(1), s%known%deflation%count_undamped(), &
         s%options%is_plain()), result, error)
      call note_accumulation(s%problem, result)
      if (.not. allocated(error)) call normalise_shapes(s%problem, result)
      call s%end_step(phase_judge)
      result%effort_type = s%effort
   end subroutine report

   ! Sorts the modes by frequency.
   subroutine order_by_frequency(result)
      type(modal_result_type), intent(inout) :: result

      if (any(result%frequency_hz(2:) < result%frequency_hz(:size(result%frequency_hz) - 1))) &
         call result%take(nearest_first(cmplx(0, result%frequency_hz, wp), (0.0_wp, 0.0_wp)))
   end subroutine order_by_frequency

   ! Reports the problem, the options, and the formulation with the reason for it.
   subroutine report_problem(s, options, result)
      type(solve_context_type), intent(in) :: s
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(inout) :: result

      result%options = options
      result%method = method_name(options)
      result%modes_asked = options%modes
      result%unknowns = s%problem%unknowns()
      result%constraints = s%problem%multipliers()
      result%damping_kind = s%problem%damping_kind
      result%symmetric = s%problem%symmetric
      result%redundant_constraints = s%known%redundant
      result%target = s%options%target
      result%formulation = s%formulation
      result%decision = s%decision
      if (s%dense) result%formulation = formulation_dense
      if (allocated(result%mesh)) deallocate (result%mesh)
      if (.not. allocated(s%problem%mesh)) return
      allocate (result%mesh, source=s%problem%mesh)
      call join_nodes(result%mesh, s%problem%stiffness)
   end subroutine report_problem

   ! Moves the modes, with complex shapes, and how the search ended into the result.
   subroutine report_modes(modes, result)
      type(modes_type), intent(inout) :: modes
      type(modal_result_type), intent(inout) :: result

      call modes%make_complex()
      call move_alloc(modes%lambda, result%eigenvalues)
      call move_alloc(modes%phi, result%eigenvectors)
      call move_alloc(modes%xi, result%multipliers)
      call move_alloc(modes%backward_error, result%backward_error)
      call move_alloc(modes%error_bound, result%error_bound)
      call move_alloc(modes%left_phi, result%left_eigenvectors)
      call move_alloc(modes%left_xi, result%left_multipliers)
      call move_alloc(modes%condition, result%condition)
      result%reason = modes%reason
      result%certified = modes%certified
      result%missing = modes%missing
      result%locking_error = modes%locking_error
      result%history = modes%history
   end subroutine report_modes

   ! Reports shift and size of the last factors, and frees them; unless the solver remembers, also the analysis and the iterated
   ! problem.
   subroutine report_factors(s, result)
      type(solve_context_type), intent(inout) :: s
      type(modal_result_type), intent(inout) :: result
      class(linear_solver_type), pointer :: solver

      result%shift = s%shift
      result%block = s%block
      result%inner = "none: nothing was factored"
      if (allocated(s%transform)) then
         result%factored_order = s%transform%order()
         solver => s%transform%linear_solver()
         result%factor_entries = solver%factor_entries
         result%factor_bytes = solver%factor_bytes
         result%inner = trim(solver%description)
         call s%drop_transform()
      end if
      call s%drop_stiffness()
      call s%last_analysis%drop_room()
      if (s%remembers) return
      call s%spare%clear()
      s%last_analysis = last_analysis_type()
      if (allocated(s%matrices)) deallocate (s%matrices)
      s%work = modal_problem_type()
   end subroutine report_factors
end module kschur_report
