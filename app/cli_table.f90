!> A result as a table for people.
module cli_table
   use cli_colour, only: bold, coloured, green, red, yellow
   use cli_numbers, only: aligned, exponential, rounded
   use cli_system, only: print_line
   use kschur, only: certified_no, certified_yes, damping_names, formulation_names, kind_names, kind_rigid, kind_unstable, &
      modal_result_type, phase_names, reason_names, text, wp
   implicit none
   private
   public :: print_table

contains

   !> Prints a summary of the problem, the modes, and the effort.
   subroutine print_table(result, verbose)
      type(modal_result_type), intent(in) :: result
      !> Whether to print the inner solver, the seconds of each phase and the restarts as well.
      logical, intent(in) :: verbose

      call print_header(result)
      if (verbose .and. allocated(result%inner)) call print_line("inner    "//result%inner)
      if (verbose) call print_line("block    "//text(result%block))
      if (size(result%eigenvalues) > 0) call print_modes(result)
      if (allocated(result%band) .and. size(result%eigenvalues) == 0) call print_line("         no mode between "// &
         rounded(result%band(1))//" and "//rounded(result%band(2))//" Hz")
      call print_effort(result)
      if (verbose) call print_details(result)
   end subroutine print_table

   subroutine print_header(result)
      type(modal_result_type), intent(in) :: result
      integer :: i

      call print_line("problem  "//text(result%unknowns)//" unknowns, "//text(result%constraints)// &
         " constraints, "//trim(merge("symmetric  ", "unsymmetric", result%symmetric))//", damping "// &
         trim(damping_names(result%damping_kind)))
      call print_line("method   "//result%method//", formulation "// &
         trim(formulation_names(result%formulation))//", target "//rounded(result%target)//", shift "// &
         rounded(result%shift)//" 1/s")
      call print_line("because  "//result%decision)
      call print_line("modes    "//text(size(result%eigenvalues))//" of "//text(result%modes_asked)// &
         ", "//trim(reason_names(result%reason))//certified_text(result))
      if (.not. allocated(result%notes)) return
      do i = 1, size(result%notes)
         call print_line(coloured("note     ", yellow)//trim(result%notes(i)))
      end do
   end subroutine print_header

   function certified_text(result)
      type(modal_result_type), intent(in) :: result
      character(len=:), allocatable :: certified_text

      certified_text = ""
      if (result%certified == certified_yes) certified_text = ", "//coloured("certified", green)//": no mode is missing"
      if (result%certified == certified_no) certified_text = ", "//coloured("not certified", red)//": a mode may be missing"
      if (result%missing > 0) certified_text = ", "//coloured("not certified", red)//": eigenvalues are missing, "// &
         text(result%missing)//" of them"
   end function certified_text

   subroutine print_modes(result)
      type(modal_result_type), intent(in) :: result
      ! The last is of loss factors.
      character(len=15) :: cells(-1:size(result%eigenvalues), 6)
      character(len=12) :: more(-1:size(result%eigenvalues))
      character(len=5) :: place
      integer :: i, k, columns

      more = ""
      if (allocated(result%condition)) more = ["   condition", "      number", condition(result%condition)]
      k = size(result%eigenvalues)
      cells(-1, :) = adjustr([character(len=15) :: "Re", "Im", "frequency", "damped", "damping", "loss factor"])
      cells(0, :) = adjustr([character(len=15) :: "1/s", "1/s", "Hz", "Hz", "%", "%"])
      cells(1:, 1) = aligned(real(result%eigenvalues, wp))
      cells(1:, 2) = aligned(aimag(result%eigenvalues))
      cells(1:, 3) = aligned(result%frequency_hz)
      cells(1:, 4) = aligned(result%damped_frequency_hz)
      cells(1:, 5) = aligned(100*result%damping_ratio)
      where (result%kind == kind_rigid) cells(1:, 3) = repeat(" ", 14)//"0"
      where (result%kind == kind_rigid) cells(1:, 5) = repeat(" ", 14)//"-"
      columns = 5
      if (allocated(result%loss_factor)) then
         columns = 6
         cells(1:, 6) = aligned(100*result%loss_factor)
      end if

      call print_line("")
      call print_row("     ", cells(-1, :columns), "kind       ", "  backward", "     error", more(-1), bold)
      call print_row("     ", cells(0, :columns), "           ", "     error", "       1/s", more(0), bold)
      do i = 1, k
         write (place, "(i5)") i
         call print_row(place, cells(i, :columns), kind_names(result%kind(i)), exponential(result%backward_error(i), 10, 1), &
            error_bound(result%error_bound(i)), more(i), merge(red, "  ", result%kind(i) == kind_unstable))
      end do
      call print_line("")
   end subroutine print_modes

   subroutine print_row(place, cells, kind, backward_error, bound, more, style)
      character(len=*), intent(in) :: place, cells(:), kind, backward_error, bound, more, style
      character(len=len(place) + size(cells)*len(cells)) :: line

      write (line, "(*(a))") place, cells
      call print_line(coloured(line//"  "//kind//backward_error//bound//trim(more), trim(style)))
   end subroutine print_row

   ! Cell of an error bound; `-` if it is unknown, as without a left vector.
   elemental function error_bound(bound) result(cell)
      real(wp), intent(in) :: bound
      character(len=10) :: cell

      cell = "         -"
      if (.not. bound > 0 .and. bound >= 0) then
         cell = "         0"
      else if (bound <= huge(bound)) then
         cell = exponential(bound, len(cell), 1)
      end if
   end function error_bound

   ! Cell of a condition number; `-` if it is unknown, as without a left vector.
   elemental function condition(kappa)
      real(wp), intent(in) :: kappa
      character(len=12) :: condition

      if (kappa > huge(kappa)) then
         condition = "    infinite"
      else if (kappa >= 0) then
         condition = exponential(kappa, len(condition), 1)
      else
         condition = repeat(" ", 11)//"-"
      end if
   end function condition

   subroutine print_effort(result)
      type(modal_result_type), intent(in) :: result
      character(len=:), allocatable :: memory

      memory = "-"
      if (result%peak_memory_bytes >= 0) memory = text(int(result%peak_memory_bytes/1000000))
      call print_line("effort   operator applications "//text(result%operator_applications)//", restarts "// &
         text(result%restarts)//", factorizations "//text(result%factorizations)//", "// &
         rounded(result%seconds%total)//" s, "//memory//" MB")
   end subroutine print_effort

   ! Prints factorizations by purpose, seconds by phase, and the convergence tests.
   subroutine print_details(result)
      type(modal_result_type), intent(in) :: result
      character(len=:), allocatable :: line
      real(wp) :: seconds(size(phase_names))
      integer :: i

      if (any(result%factorizations_for > 0)) call print_line("factors  "//purposes(result))
      seconds = result%seconds%of_phases()
      line = "seconds  "
      do i = 1, size(seconds)
         if (seconds(i) > 0) line = line//trim(phase_names(i))//" "//rounded(seconds(i))//", "
      end do
      call print_line(line//"other "//rounded(result%seconds%other))
      if (.not. allocated(result%history%converged)) return
      do i = 1, size(result%history%converged)
         call print_line("look     "//text(i)//": "//"converged "//text(result%history%converged(i))// &
            ", operator applications "//text(result%history%operator_applications(i))//", residual "// &
            rounded(result%history%residual(i)))
      end do
   end subroutine print_details

   ! Lists the purposes of the factorizations with their numbers; omits purposes without any.
   function purposes(result)
      type(modal_result_type), intent(in) :: result
      character(len=:), allocatable :: purposes
      character(len=*), parameter :: words(*) = [character(len=14) :: "mass", "rigid motions", "iteration", "refinement", &
         "count", "left vectors"]
      integer :: i

      purposes = ""
      do i = 1, size(words)
         if (result%factorizations_for(i) == 0) cycle
         if (purposes /= "") purposes = purposes//", "
         purposes = purposes//trim(words(i))//" "//text(result%factorizations_for(i))
      end do
   end function purposes
end module cli_table
