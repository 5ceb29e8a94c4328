!> What each formulation costs on the scene `grid`: prints the tables of docs/performance.md.
!>
!>     benchmark_formulations [--cells NXxNY] [--modes N] [--repeat K]
!>
!> Every formulation is asked for the same modes with the same options. The
!> repetitions are interleaved, so that what else the machine does falls on all
!> formulations alike; a number of seconds is the least over them, of the processor,
!> one thread.
program formulations
   use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
   use kschur, only: error_input, error_type, error_usage, formulation_damped_constrained, &
      formulation_damped_constrained_zero, formulation_names, &
      formulation_proportional, formulation_quadratic, formulation_symmetric, formulation_undamped_constrained, &
      formulation_undamped_constrained_zero, long, &
      modal_options_type, modal_problem_type, modal_result_type, new_error, reason_converged, reason_names, &
      solve_modes, text, wp
   use kschur_scenes, only: build_scene
   implicit none

   !> One formulation and what was measured of it.
   type :: row_type
      integer :: formulation = 0
      integer :: order = 0, factorizations = 0, applications = 0
      integer(long) :: entries = 0
      real(wp) :: worst_backward_error = 0
      !> |lambda|^2 of each mode (1/s^2), in order: rounding of K moves it by the same for all modes.
      real(wp), allocatable :: squares(:)
      !> Seconds of the processor, by repetition.
      real(wp), allocatable :: seconds(:)
   end type row_type

   type(modal_problem_type) :: damped, undamped
   type(error_type), allocatable :: error
   type(row_type) :: damped_rows(4), undamped_rows(3)
   character(len=16) :: cells
   integer :: modes, repetitions, repetition, i

   call read_options(cells, modes, repetitions, error)
   if (.not. allocated(error)) call build_scene("grid", [character(len=16) :: "--cells", cells], damped, error)
   if (.not. allocated(error)) call build_scene("grid", [character(len=16) :: "--cells", cells, "--damping", "none"], &
      undamped, error)
   call stop_on(error)

   ! The paper's pencil first: the others are compared with it.
   damped_rows%formulation = [formulation_damped_constrained, formulation_damped_constrained_zero, &
      formulation_quadratic, formulation_proportional]
   undamped_rows%formulation = [formulation_undamped_constrained, formulation_undamped_constrained_zero, &
      formulation_symmetric]
   do i = 1, size(damped_rows)
      allocate (damped_rows(i)%seconds(repetitions))
   end do
   do i = 1, size(undamped_rows)
      allocate (undamped_rows(i)%seconds(repetitions))
   end do
   do repetition = 1, repetitions
      call measure(damped, modes, repetition, damped_rows)
      call measure(undamped, modes, repetition, undamped_rows)
   end do

   print "(a)", "Grid "//trim(cells)//": "//text(damped%unknowns())//" unknowns, "//text(damped%multipliers())// &
      " constraints, "//text(modes)//" modes, automatic shift, "//text(repetitions)//" repetitions."
   call print_table("Rayleigh damping", damped_rows)
   call print_table("No damping", undamped_rows)

contains

   subroutine read_options(cells, modes, repetitions, error)
      character(len=*), intent(out) :: cells
      integer, intent(out) :: modes, repetitions
      type(error_type), allocatable, intent(out) :: error
      character(len=16) :: name, value
      integer :: i, status

      cells = "20x14"
      modes = 56
      repetitions = 3
      do i = 1, command_argument_count(), 2
         call get_command_argument(i, name)
         call get_command_argument(i + 1, value)
         status = 0
         select case (name)
         case ("--cells")
            cells = value
         case ("--modes")
            read (value, "(i16)", iostat=status) modes
         case ("--repeat")
            read (value, "(i16)", iostat=status) repetitions
         case default
            status = 1
         end select
         if (status == 0 .and. value /= "" .and. modes > 0 .and. repetitions > 0) cycle
         call new_error(error, error_usage, "usage: benchmark_formulations [--cells NXxNY] [--modes N] [--repeat K]")
         return
      end do
   end subroutine read_options

   !> Solves once with each formulation; ends the program where one does not
   !> find what the first one found: its time would mean nothing.
   subroutine measure(problem, modes, repetition, rows)
      type(modal_problem_type), intent(in) :: problem
      integer, intent(in) :: modes, repetition
      type(row_type), intent(inout) :: rows(:)
      real(wp), parameter :: same = 1.0e-8_wp
      type(modal_result_type) :: result
      type(error_type), allocatable :: error
      character(len=:), allocatable :: name
      real(wp) :: start, end
      integer :: i

      do i = 1, size(rows)
         associate (row => rows(i))
            name = trim(formulation_names(row%formulation))
            call cpu_time(start)
            call solve_modes(problem, modal_options_type(modes=modes, formulation=row%formulation, threads=1), result, error)
            call cpu_time(end)
            call stop_on(error)
            if (result%reason /= reason_converged) &
               call new_error(error, error_input, name//": "//trim(reason_names(result%reason)))
            call stop_on(error)
            row%order = result%factored_order
            row%entries = result%factor_entries
            row%factorizations = result%factorizations
            row%applications = result%operator_applications
            row%worst_backward_error = max(row%worst_backward_error, maxval(result%backward_error))
            row%seconds(repetition) = end - start
            row%squares = abs(result%eigenvalues)**2
            if (maxval(abs(row%squares - rows(1)%squares)) > same*maxval(rows(1)%squares)) &
               call new_error(error, error_input, name//" finds other modes than "// &
               trim(formulation_names(rows(1)%formulation)))
            call stop_on(error)
            write (error_unit, "(a, i0, 3a, f7.3, a)") "repetition ", repetition, ": ", name, " ", &
               row%seconds(repetition), " s"
         end associate
      end do
   end subroutine measure

   subroutine print_table(scene, rows)
      character(len=*), intent(in) :: scene
      type(row_type), intent(in) :: rows(:)
      real(wp) :: least, paper, spread
      integer :: i

      print "(/, 3a)", "| ", scene, " | order | entries of the factors | factorisations | applications | "// &
         "seconds | spread | worst backward error | times faster |"
      print "(a)", "|---|"//repeat("---:|", 8)
      paper = minval(rows(1)%seconds)
      do i = 1, size(rows)
         associate (row => rows(i))
            least = minval(row%seconds)
            spread = maxval(row%seconds)/least - 1
            print "(3a, 4(i0, a), f6.2, a, i0, a, es7.1, a, f5.1, a)", "| `", &
               trim(formulation_names(row%formulation)), "` | ", row%order, " | ", row%entries, " | ", &
               row%factorizations, " | ", row%applications, " | ", least, " | ", nint(100*spread), " % | ", &
               row%worst_backward_error, " | ", paper/least, " |"
         end associate
      end do
      flush (output_unit)
   end subroutine print_table

   !> Ends the program with the message of a raised error.
   subroutine stop_on(error)
      type(error_type), allocatable, intent(in) :: error

      if (.not. allocated(error)) return
      write (error_unit, "(a)") error%message
      stop 1
   end subroutine stop_on
end program formulations
