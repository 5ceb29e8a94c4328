!> The linear solvers of a computation: those of the library, as an option
!> names them, or a user's own.
module kschur_solver_choice
   use kschur_direct_complex, only: direct_complex_type
   use kschur_direct_solver, only: direct_real_type
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_inertia_solver, only: inertia_real_type
   use kschur_iterative_complex, only: iterative_complex_type
   use kschur_iterative_real, only: iterative_real_type
   use kschur_kinds, only: wp
   use kschur_last_analysis, only: last_analysis_type
   use kschur_linear_solver, only: complex_linear_solver_type, real_linear_solver_type
   use kschur_monitor, only: monitor_type
   use kschur_options, only: inner_auto, inner_iterative, inner_mumps, modal_options_type
   use kschur_processes, only: processes_type
   use kschur_tolerances, only: rounding_of_sums
   implicit none
   private
   public :: inner_solvers_type, choose_inner_solvers

   !> Prototypes, never factored themselves: each matrix is factored by a copy (`allocate (copy, source=prototype)`), and
   !> several copies may exist at once. All copies share the targets of pointer components.
   !>
   !> Where a user gives only one of `real` and `complex`, matrices of the other kind are
   !> factored by the library's own.
   type :: inner_solvers_type
      !> For real matrices, symmetric or not: the problem at a real shift.
      class(real_linear_solver_type), allocatable :: real
      !> For complex matrices: pencils, complex shifts, refined modes and left vectors.
      class(complex_linear_solver_type), allocatable :: complex
      !> For real matrices without a shift: the mass, and the nearly singular stiffness when rigid motions are sought. Not
      !> allocated: as `real`.
      class(real_linear_solver_type), allocatable :: unshifted
      !> Sets `negative_pivots` of every real symmetric matrix, indefinite ones too. Not
      !> allocated: eigenvalues are not counted, and nothing is certified.
      class(real_linear_solver_type), allocatable :: counting
   contains
      !> Sets the monitor polled during factorisations.
      procedure :: set_monitor
      !> Sets the analysis shared by solvers of the library.
      procedure :: set_last_analysis
   end type inner_solvers_type

contains

   subroutine set_monitor(self, monitor)
      class(inner_solvers_type), intent(inout) :: self
      !> Disassociated: none.
      class(monitor_type), pointer, intent(in) :: monitor

      if (allocated(self%real)) self%real%monitor => monitor
      if (allocated(self%complex)) self%complex%monitor => monitor
      if (allocated(self%unshifted)) self%unshifted%monitor => monitor
      if (allocated(self%counting)) self%counting%monitor => monitor
   end subroutine set_monitor

   subroutine set_last_analysis(self, last)
      class(inner_solvers_type), intent(inout) :: self
      type(last_analysis_type), pointer, intent(in) :: last

      call set_in(self%real)
      call set_in(self%unshifted)
      call set_in(self%counting)

   contains

      ! Passes the shared analysis to a solver of the library.
      subroutine set_in(solver)
         class(real_linear_solver_type), allocatable, intent(inout) :: solver

         if (.not. allocated(solver)) return
         select type (solver)
         type is (direct_real_type)
            solver%last => last
         type is (inertia_real_type)
            solver%last => last
         type is (iterative_real_type)
            solver%factors%last => last
         end select
      end subroutine set_in
   end subroutine set_last_analysis

   !> Creates the solvers that options ask for, with the user's own in their places. Fails if both an own solver and an `inner`
   !> option are given.
   subroutine choose_inner_solvers(options, inner, error, own, processes)
      type(modal_options_type), intent(in) :: options
      !> All but `counting` are allocated.
      type(inner_solvers_type), intent(out) :: inner
      type(error_type), allocatable, intent(out) :: error
      type(inner_solvers_type), intent(in), optional :: own
      !> Processes that may factor jointly; absent or not associated: this one alone.
      type(processes_type), pointer, intent(in), optional :: processes
      type(processes_type), pointer :: together

      nullify (together)
      if (present(processes)) together => processes
      if (present(own)) then
         if (options%inner /= inner_auto) then
            call new_error(error, error_usage, &
               "the option inner chooses among the library's solvers: leave it out where you bring your own")
            return
         end if
         if (allocated(own%real)) allocate (inner%real, source=own%real)
         if (allocated(own%complex)) allocate (inner%complex, source=own%complex)
         if (allocated(own%unshifted)) allocate (inner%unshifted, source=own%unshifted)
         if (allocated(own%counting)) allocate (inner%counting, source=own%counting)
      end if
      if (options%inner == inner_iterative) call choose_iterative(options%tolerance, together, inner)
      if (.not. (allocated(inner%real) .or. allocated(inner%counting))) &
         allocate (inner%counting, source=inertia_real_type(processes=together))
      if (allocated(inner%real) .and. .not. allocated(inner%unshifted)) allocate (inner%unshifted, source=inner%real)
      if (.not. allocated(inner%unshifted)) allocate (inner%unshifted, &
         source=direct_real_type(refinements=2, processes=together))
      if (.not. allocated(inner%real)) allocate (inner%real, &
         source=direct_real_type(inner=options%inner, processes=together))
      ! LDL that is asked for by name is for the shift, not for what refines modes.
      if (.not. allocated(inner%complex)) allocate (inner%complex, source=direct_complex_type(inner=merge(inner_mumps, inner_auto, &
         options%inner == inner_mumps), processes=together))
   end subroutine choose_inner_solvers

   ! Chooses the iterative solvers. Their tolerance is tighter than that of Ritz pairs, as the errors of many solves enter their
   ! residuals. Eigenvalues are counted by proof alone, which needs no factors.
   subroutine choose_iterative(tolerance, processes, inner)
      real(wp), intent(in) :: tolerance
      type(processes_type), pointer, intent(in) :: processes
      type(inner_solvers_type), intent(inout) :: inner
      real(wp), parameter :: part_of_tolerance = 0.01_wp
      type(iterative_real_type) :: for_real
      type(iterative_complex_type) :: for_complex

      for_real%tolerance = part_of_tolerance*tolerance
      for_real%accuracy = rounding_of_sums
      for_real%processes => processes
      for_complex%tolerance = part_of_tolerance*tolerance
      for_complex%accuracy = rounding_of_sums
      for_complex%processes => processes
      allocate (inner%counting, source=inertia_real_type(processes=processes, by_proof_alone=.true.))
      allocate (inner%real, source=for_real)
      allocate (inner%complex, source=for_complex)
   end subroutine choose_iterative
end module kschur_solver_choice
