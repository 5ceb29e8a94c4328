!> What an inner solver takes: one computation, one line of a table. The peak
!> is that of the process, so each line needs a process of its own.
!>
!>     benchmark_inner_memory grid 60x42 MODES INNER FORMULATION [SHIFT]
!>     benchmark_inner_memory block 20 MODES INNER FORMULATION [SHIFT]      a free block of 20^3 elements
!>     benchmark_inner_memory clamped 20 MODES INNER FORMULATION [SHIFT]
!>
!> Columns: model, unknowns, formulation, inner solver, modes, peak memory (MB), and that above what the problem takes, memory
!> of the factors (MB), seconds, seconds of solves, worst backward error, the solver's own words, applications.
program inner_memory
   use kschur, only: error_type, formulation_names, index_of_name, inner_names, modal_options_type, modal_problem_type, &
      modal_result_type, solve_modes, text
   use kschur_kinds, only: long, wp
   use kschur_scenes, only: build_scene
   use solid_block, only: build_block
   implicit none
   type(modal_problem_type) :: problem
   type(modal_options_type) :: options
   type(modal_result_type) :: result
   type(error_type), allocatable :: error
   character(len=30) :: words(6)
   real(wp) :: shift
   integer :: i, edge
   integer(long) :: before

   do i = 1, size(words)
      call get_command_argument(i, words(i))
   end do
   read (words(3), *) options%modes
   options%inner = index_of_name(trim(words(4)), inner_names)
   options%formulation = index_of_name(trim(words(5)), formulation_names)
   if (words(6) /= "") then
      read (words(6), *) shift
      allocate (options%shift, source=cmplx(shift, 0, wp))
   end if
   if (words(1) == "grid") then
      call build_scene("grid", [character(len=16) :: "--cells", words(2)], problem, error)
   else
      read (words(2), *) edge
      call build_block(spread(edge, 1, 3), words(1) == "clamped", problem, error)
   end if
   before = resident("VmRSS:")
   if (.not. allocated(error)) call solve_modes(problem, options, result, error)
   if (allocated(error)) then
      print "(a)", "| "//trim(words(1))//" "//trim(words(2))//" | "//trim(words(4))//" | "//error%message//" |"
   else
      print "(3a, i0, 7a, i0, a, i0, a, i0, a, f0.1, a, f0.1, a, es8.1, 5a)", "| ", trim(words(1))//" "//trim(words(2)), " | ", &
         problem%unknowns(), " | ", trim(formulation_names(result%formulation)), " | ", trim(words(4)), " | ", &
         text(size(result%eigenvalues))//" of "//text(options%modes), " | ", resident("VmHWM:")/1000, " | ", &
         (resident("VmHWM:") - before)/1000, " | ", result%factor_bytes/1000000, " | ", result%seconds%total, " | ", &
         result%seconds%solve, " | ", maxval(result%backward_error), " | ", result%inner, " | ", &
         text(result%operator_applications), " |"
   end if

contains

   !> Memory of this process (kB), as Linux counts it; zero elsewhere.
   integer(long) function resident(what)
      character(len=*), intent(in) :: what
      character(len=200) :: line
      integer :: unit, status

      resident = 0
      open (newunit=unit, file="/proc/self/status", status="old", action="read", iostat=status)
      if (status /= 0) return
      do
         read (unit, "(a)", iostat=status) line
         if (status /= 0) exit
         if (line(:len(what)) == what) read (line(len(what) + 1:index(line, " kB")), *) resident
      end do
      close (unit)
   end function resident
end program inner_memory
