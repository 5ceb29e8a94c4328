!> Estimates the memory of a solve before anything is factored: of matrices from their patterns, of factors from their symbolic
!> analysis, of the Krylov space from its dimension.
module kschur_memory_estimate
   use kschur_error, only: error_type, new_error, error_input, error_memory
   use kschur_formulation, only: is_structured, likely_formulation
   use kschur_kinds, only: wp, long
   use kschur_krylov_options, only: krylov_options_type
   use kschur_linear_solver, only: matrix_structure_type
   use kschur_local_forces, only: local_forces_type, new_local_forces
   use kschur_memory, only: complex_bytes, real_bytes, require_memory
   use kschur_options, only: modal_options_type, formulation_dense, formulation_low_rank, formulation_proportional, &
      formulation_quadratic, formulation_symmetric
   use kschur_pencil, only: new_pencil, pencil_type
   use kschur_presolve, only: presolve, presolve_type
   use kschur_problem, only: modal_problem_type
   use kschur_saddle, only: bordered, enlarged, order_elimination, saddle_structure
   use kschur_settings, only: set_iteration_options, settings_of
   use kschur_solver_choice, only: choose_inner_solvers, inner_solvers_type
   use kschur_sparse, only: csr_matrix_type, linear_combination
   use kschur_text, only: text
   implicit none
   private
   public :: check_memory, estimate_memory, memory_estimate_type

   !> Estimates in bytes.
   type :: memory_estimate_type
      !> Matrices as given, reduced ones, and those to be factored.
      real(wp) :: matrices = 0
      !> Largest size of factors that exist at a time, with the work space of the factorisation.
      real(wp) :: factors = 0
      !> Krylov space, or dense matrices in its place, and shapes.
      real(wp) :: vectors = 0
   contains
      !> Sum of these and of the program.
      procedure :: total
   end type memory_estimate_type

   ! Formulation, pattern and structure of the factored matrix; whether it is complex and theta is omega^2; length of the iterated
   ! vectors.
   type :: plan_type
      integer :: formulation = 0
      type(csr_matrix_type) :: pattern
      type(matrix_structure_type) :: structure
      logical :: complex = .false., oscillator = .false.
      integer :: order = 0
   end type plan_type

contains

   !> Estimates the memory of a solve with these options for the modes nearest to the target. Assumes that the mass is semidefinite
   !> and that no mode needs polishing. Solvers that give no estimate count as zero.
   subroutine estimate_memory(problem, options, estimate, error, solvers)
      type(modal_problem_type), intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      type(memory_estimate_type), intent(out) :: estimate
      type(error_type), allocatable, intent(out) :: error
      !> Linear solvers; absent: those that the options name.
      type(inner_solvers_type), intent(in), optional :: solvers
      type(modal_options_type) :: settings
      type(inner_solvers_type) :: inner
      type(modal_problem_type) :: work
      type(presolve_type) :: unused
      type(plan_type) :: plan

      settings = settings_of(options)
      call likely_formulation(problem, settings%formulation, plan%formulation, error)
      if (allocated(error)) return
      if (present(solvers)) then
         inner = solvers
      else
         call choose_inner_solvers(options, inner, error)
         if (allocated(error)) return
      end if
      call require_memory(6*problem%bytes(), "the estimate of memory", error)
      if (allocated(error)) return
      call presolve(problem, work, unused, error, eliminating=settings%presolve .and. is_structured(plan%formulation))
      if (allocated(error)) then
         ! No unknown is left, so that nothing is factored.
         if (error%code == error_input) deallocate (error)
         return
      end if
      call make_plan(work, settings, plan, error)
      if (.not. allocated(error)) call estimate_factors(inner, work, plan, estimate%factors, error)
      if (allocated(error)) return
      estimate%matrices = problem%bytes() + work%bytes() + 2*plan%pattern%bytes()
      if (plan%complex) estimate%matrices = estimate%matrices + real_bytes*plan%pattern%nonzeros()
      estimate%vectors = bytes_of_vectors(problem, settings, plan)
   end subroutine estimate_memory

   !> Fails if the estimate of a solve exceeds the memory limit of the options; without a limit nothing is estimated.
   subroutine check_memory(problem, options, solvers, error)
      type(modal_problem_type), intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      type(inner_solvers_type), intent(in) :: solvers
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: megabyte = 1.0e6_wp
      type(memory_estimate_type) :: estimate

      if (options%memory == 0) return
      call estimate_memory(problem, options, estimate, error, solvers)
      if (allocated(error)) return
      if (estimate%total() > real(options%memory, wp)) call new_error(error, error_memory, "the solve is estimated to take "// &
         text(ceiling(estimate%total()/megabyte, long))//" MB, and the limit of memory is "// &
         text(floor(real(options%memory, wp)/megabyte, long))//" MB: raise it, or ask for fewer modes")
   end subroutine check_memory

   ! Forms the pattern of the factored matrix, and describes what is iterated.
   subroutine make_plan(work, settings, plan, error)
      type(modal_problem_type), intent(inout) :: work
      type(modal_options_type), intent(in) :: settings
      type(plan_type), intent(inout) :: plan
      type(error_type), allocatable, intent(out) :: error
      type(pencil_type) :: pencil

      if (is_structured(plan%formulation)) then
         call order_elimination(work, error)
         if (allocated(error)) return
         plan%oscillator = any(plan%formulation == [formulation_symmetric, formulation_proportional])
         plan%pattern = bordered(linear_combination([1.0_wp, 1.0_wp, 1.0_wp], [work%stiffness, work%mass, work%damping]), &
            work%constraints, spread(1.0_wp, 1, work%multipliers()))
         if (allocated(work%loss)) plan%pattern = linear_combination(1.0_wp, plan%pattern, 1.0_wp, &
            enlarged(work%loss, plan%pattern%rows))
         plan%structure = saddle_structure(work)
         plan%structure%symmetric = plan%structure%symmetric .or. plan%oscillator .or. plan%formulation == formulation_low_rank
         plan%order = merge(1, 2, plan%oscillator)*work%unknowns()
         if (plan%formulation /= formulation_quadratic) return
         plan%complex = abs(aimag(settings%target)) > 0 .or. allocated(work%loss)
         if (allocated(settings%shift)) plan%complex = abs(aimag(settings%shift)) > 0 .or. allocated(work%loss)
         ! Shifts that are chosen are in the right half plane.
         plan%structure%in_half_plane = .true.
         if (allocated(settings%shift)) plan%structure%in_half_plane = real(settings%shift, wp) > 0
      else
         call new_pencil(pencil, work, plan%formulation, spread(1.0_wp, 1, work%multipliers()), 1.0_wp, error)
         if (allocated(error)) return
         plan%oscillator = pencil%map%oscillator
         plan%pattern = linear_combination(1.0_wp, pencil%a, 1.0_wp, pencil%b)
         if (allocated(pencil%loss)) plan%pattern = linear_combination(1.0_wp, plan%pattern, 1.0_wp, pencil%loss)
         plan%structure = pencil%structure
         plan%order = plan%pattern%rows
         plan%complex = .true.
      end if
   end subroutine make_plan

   ! Estimates the factors (bytes): those of the stiffness for rigid motions, which are freed before, or if larger those at the
   ! shift together with those of an eigenvalue count.
   subroutine estimate_factors(inner, work, plan, bytes, error)
      type(inner_solvers_type), intent(in) :: inner
      type(modal_problem_type), intent(in) :: work
      type(plan_type), intent(in) :: plan
      real(wp), intent(out) :: bytes
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: stiffness
      real(wp) :: unshifted, counting

      unshifted = 0
      counting = 0
      stiffness = bordered(work%stiffness, work%constraints, spread(1.0_wp, 1, work%multipliers()))
      call inner%unshifted%estimate(stiffness, saddle_structure(work), unshifted, error)
      if (allocated(error)) return
      if (plan%complex) then
         call inner%complex%estimate(plan%pattern, plan%structure, bytes, error)
      else
         call inner%real%estimate(plan%pattern, plan%structure, bytes, error)
         if (.not. allocated(error) .and. allocated(inner%counting) .and. plan%oscillator) &
            call inner%counting%estimate(plan%pattern, plan%structure, counting, error)
      end if
      bytes = max(unshifted, bytes + counting)
   end subroutine estimate_factors

   ! Estimates the Krylov space and the shapes (bytes). Of the space, counts the part in use if nothing restarts; a two-level basis
   ! of states has vectors of half the length. Shapes of oscillators are real until the result, others are complex throughout.
   real(wp) function bytes_of_vectors(problem, settings, plan) result(bytes)
      type(modal_problem_type), intent(in) :: problem
      type(modal_options_type), intent(in) :: settings
      type(plan_type), intent(in) :: plan
      ! Vectors of images and of the operator; matrices of the dense form; projected matrices and their decompositions.
      integer, parameter :: other_vectors = 16, dense_matrices = 12, projected = 6, projected_symmetric = 3
      ! Vectors for each wanted value, and steps of a block beyond these.
      real(wp), parameter :: vectors_per_value = 1.5_wp, extra_steps = 40
      class(krylov_options_type), allocatable :: krylov
      real(wp) :: bytes_of_number, vectors, projected_bytes
      integer :: length, modes, room

      modes = min(settings%modes, plan%order)
      length = plan%order
      if (any(plan%formulation == [formulation_quadratic, formulation_low_rank])) length = length/2
      call set_iteration_options(settings, plan%formulation, plan%order, modes, 0, plan%oscillator, &
         allocated(problem%loss), krylov)
      bytes_of_number = merge(complex_bytes, real_bytes, plan%complex)
      room = min(krylov%subspace, plan%order)
      vectors = min(real(room, wp), vectors_per_value*merge(1, 2, plan%oscillator)*modes + extra_steps*max(krylov%block, 1))
      if (plan%formulation == formulation_low_rank) vectors = vectors + extra_low_rank_vectors(problem)
      projected_bytes = projected*bytes_of_number*real(room, wp)**2
      if (plan%formulation == formulation_low_rank) projected_bytes = projected*bytes_of_number*vectors**2
      if (plan%oscillator) projected_bytes = projected_symmetric*bytes_of_number*vectors**2
      bytes = bytes_of_number*length*(vectors + other_vectors) + projected_bytes
      if (settings%formulation == formulation_dense) bytes = dense_matrices*real_bytes*real(plan%order, wp)**2
      if (settings%left) bytes = 2*bytes
      bytes = bytes + merge(1, 2, plan%oscillator)*complex_bytes*modes*(real(problem%unknowns(), wp) + problem%multipliers())
   end function bytes_of_vectors

   ! Vectors of a low-rank space beyond those for the wanted modes: responses to each local force and to six rigid motions.
   integer function extra_low_rank_vectors(problem) result(vectors)
      type(modal_problem_type), intent(in) :: problem
      integer, parameter :: of_force = 10, of_rigid_motions = 18
      type(local_forces_type) :: forces
      type(error_type), allocatable :: error
      logical :: are_few

      vectors = of_rigid_motions
      call new_local_forces(problem, forces, are_few, error)
      if (are_few .and. .not. allocated(error)) vectors = vectors + of_force*size(forces%rows)
   end function extra_low_rank_vectors

   pure real(wp) function total(self)
      class(memory_estimate_type), intent(in) :: self
      ! The program with its libraries.
      real(wp), parameter :: program = 3.0e7_wp

      total = program + self%matrices + self%factors + self%vectors
   end function total
end module kschur_memory_estimate
