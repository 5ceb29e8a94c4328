!> How much memory a solve takes, told before anything is factored: what is known of matrices by their patterns, of factors by
!> their analysis, of the Krylov space by its dimension.
module kschur_memory_estimate
   use kschur_error, only: error_type, new_error, error_input, error_memory
   use kschur_formulation, only: is_structured, likely_formulation
   use kschur_kinds, only: wp, long
   use kschur_krylov_options, only: krylov_options_type
   use kschur_linear_solver, only: matrix_structure_type
   use kschur_memory, only: complex_bytes, real_bytes, require_memory
   use kschur_options, only: modal_options_type, formulation_dense, formulation_low_rank, formulation_proportional, &
      formulation_quadratic, formulation_symmetric
   use kschur_pencil, only: new_pencil, pencil_type
   use kschur_presolve, only: presolve, presolve_type
   use kschur_problem, only: modal_problem_type
   use kschur_saddle, only: bordered, order_elimination, saddle_structure
   use kschur_settings, only: set_iteration_options, settings_of
   use kschur_solver_choice, only: choose_inner_solvers, inner_solvers_type
   use kschur_sparse, only: csr_matrix_type, linear_combination
   use kschur_text, only: text
   implicit none
   private
   public :: check_memory, estimate_memory, memory_estimate_type

   !> Bytes.
   type :: memory_estimate_type
      !> Of the matrices as given and reduced, and of what is made of them to be factored.
      real(wp) :: matrices = 0
      !> Of the factors that there are at a time, and of their making.
      real(wp) :: factors = 0
      !> Of the Krylov space, or of dense matrices in its place, and of the shapes.
      real(wp) :: vectors = 0
   contains
      !> All that, and the program.
      procedure :: total
   end type memory_estimate_type

   ! What is factored, whether the shift is complex, and what is iterated.
   type :: plan_type
      integer :: formulation = 0
      type(csr_matrix_type) :: pattern
      type(matrix_structure_type) :: structure
      logical :: complex = .false., oscillator = .false.
      integer :: order = 0
   end type plan_type

contains

   !> Of a solve with such options for the modes nearest to the target. Mass is taken for an inner product, and modes for
   !> accurate as they are found. Solvers that do not tell are left out.
   subroutine estimate_memory(problem, options, estimate, error, solvers)
      type(modal_problem_type), intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      type(memory_estimate_type), intent(out) :: estimate
      type(error_type), allocatable, intent(out) :: error
      !> Absent: those that the options name.
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
         ! No motion is left.
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

   !> Fails where a solve is estimated to take more than the options allow.
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
         plan%structure = saddle_structure(work)
         plan%structure%symmetric = plan%structure%symmetric .or. plan%oscillator .or. plan%formulation == formulation_low_rank
         plan%order = merge(1, 2, plan%oscillator)*work%unknowns()
         if (plan%formulation /= formulation_quadratic) return
         plan%complex = abs(aimag(settings%target)) > 0 .or. allocated(work%loss)
         if (allocated(settings%shift)) plan%complex = abs(aimag(settings%shift)) > 0 .or. allocated(work%loss)
      else
         call new_pencil(pencil, work, plan%formulation, spread(1.0_wp, 1, work%multipliers()), 1.0_wp, error)
         if (allocated(error)) return
         plan%oscillator = pencil%map%oscillator
         plan%pattern = linear_combination(1.0_wp, pencil%a, 1.0_wp, pencil%b)
         plan%structure = pencil%structure
         plan%order = plan%pattern%rows
         plan%complex = .true.
      end if
   end subroutine make_plan

   ! The stiffness is factored for the rigid motions, and left. Beside the factors at the shift eigenvalues are counted.
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

   ! Of the Krylov space what is used where nothing restarts, though there is room for more; a two-level basis of states has vectors
   ! of half the length. Shapes of oscillators are real until they are handed out, others are recovered and judged as complex ones.
   real(wp) function bytes_of_vectors(problem, settings, plan) result(bytes)
      type(modal_problem_type), intent(in) :: problem
      type(modal_options_type), intent(in) :: settings
      type(plan_type), intent(in) :: plan
      ! Images and what the operator takes; matrices of the dense form; projected matrices and their decompositions.
      integer, parameter :: beside = 16, dense_matrices = 12, projected = 6, projected_symmetric = 3
      ! Of a wanted value, and of a vector of a block.
      real(wp), parameter :: used = 1.5_wp, steps = 40
      class(krylov_options_type), allocatable :: krylov
      real(wp) :: word, vectors, small
      integer :: length, modes, room

      modes = min(settings%modes, plan%order)
      length = plan%order
      if (any(plan%formulation == [formulation_quadratic, formulation_low_rank])) length = length/2
      call set_iteration_options(settings, plan%formulation, plan%order, modes, 0, plan%oscillator, krylov)
      word = merge(complex_bytes, real_bytes, plan%complex)
      room = min(krylov%subspace, plan%order)
      vectors = min(real(room, wp), used*merge(1, 2, plan%oscillator)*modes + steps*max(krylov%block, 1))
      if (plan%formulation == formulation_low_rank) vectors = vectors + beside_responses(problem)
      small = projected*word*real(room, wp)**2
      if (plan%formulation == formulation_low_rank) small = projected*word*vectors**2
      if (plan%oscillator) small = projected_symmetric*word*vectors**2
      bytes = word*length*(vectors + beside) + small
      if (settings%formulation == formulation_dense) bytes = dense_matrices*real_bytes*real(plan%order, wp)**2
      if (settings%left) bytes = 2*bytes
      bytes = bytes + merge(1, 2, plan%oscillator)*complex_bytes*modes*(real(problem%unknowns(), wp) + problem%multipliers())
   end function bytes_of_vectors

   ! Vectors that a space of low rank has room for beside what is asked of it: responses to each local force, and six rigid motions.
   pure integer function beside_responses(problem) result(vectors)
      type(modal_problem_type), intent(in) :: problem
      integer, parameter :: of_force = 10, of_rigid_motions = 18

      vectors = of_rigid_motions
      if (allocated(problem%dampers)) vectors = vectors + of_force*count(problem%dampers%row_maxima() > 0)
   end function beside_responses

   pure real(wp) function total(self)
      class(memory_estimate_type), intent(in) :: self
      ! With its libraries.
      real(wp), parameter :: program = 3.0e7_wp

      total = program + self%matrices + self%factors + self%vectors
   end function total
end module kschur_memory_estimate
