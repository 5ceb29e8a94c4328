!> The cases that methods fail on, each with an answer that this library did not compute: a
!> closed form, quadruple precision, dense LAPACK. A line says case, method, modes found of
!> those expected, worst backward error, worst relative error of an eigenvalue, seconds.
!>
!>     benchmark_hard_cases [--full] [--ours] [--arpack] [--block B] [GROUP ...]
!>
!> Ends with status 1 where a method of ours fails; the paper's pencil, by name, is only
!> reported, and with `--ours` left out. With `--arpack` ARPACK is run as well, plain and fair, and
!> reported. With `--full` the grid of 60x42 cells is solved as
!> well. Groups are those below; all, if none is named.
program hard_cases
   use, intrinsic :: iso_fortran_env, only: error_unit
   use hard_constraints, only: examine_constraints, examine_massless, examine_mechanisms, examine_ties, examine_units
   use hard_judge, only: judge_type
   use hard_spectra, only: examine_brakes, examine_multiple, examine_rotors, examine_targets
   use hard_structures, only: examine_cantilevers, examine_free_bodies, examine_grids
   implicit none

   character(len=*), parameter :: groups(12) = [character(len=11) :: "cantilevers", "free", "grids", "targets", &
      "constraints", "ties", "massless", "mechanisms", "units", "multiple", "brakes", "rotors"]
   type(judge_type) :: judge
   character(len=16) :: word
   logical :: full, chosen(size(groups))
   integer :: i, status

   full = .false.
   chosen = .false.
   i = 0
   do while (i < command_argument_count())
      i = i + 1
      call get_command_argument(i, word)
      if (word == "--full") then
         full = .true.
      else if (word == "--ours") then
         judge%pencil = .false.
      else if (word == "--arpack") then
         judge%arpack = .true.
      else if (word == "--block") then
         i = i + 1
         call get_command_argument(i, word)
         allocate (judge%block)
         read (word, *, iostat=status) judge%block
         if (status /= 0) call explain()
      else if (any(groups == word)) then
         where (groups == word) chosen = .true.
      else
         call explain()
      end if
   end do
   print "(a48, a28, a9, 2a9, a8)", "case"//repeat(" ", 44), "method"//repeat(" ", 22), "modes", "backward", "off", "seconds"
   if (.not. any(chosen)) chosen = .true.
   do i = 1, size(groups)
      if (.not. chosen(i)) cycle
      select case (groups(i))
      case ("cantilevers")
         call examine_cantilevers(judge)
      case ("free")
         call examine_free_bodies(judge)
      case ("grids")
         call examine_grids(judge, full)
      case ("targets")
         call examine_targets(judge)
      case ("constraints")
         call examine_constraints(judge)
      case ("ties")
         call examine_ties(judge)
      case ("massless")
         call examine_massless(judge)
      case ("mechanisms")
         call examine_mechanisms(judge)
      case ("units")
         call examine_units(judge)
      case ("multiple")
         call examine_multiple(judge)
      case ("brakes")
         call examine_brakes(judge)
      case ("rotors")
         call examine_rotors(judge)
      end select
   end do
   print "(/, i0, a)", judge%failures, " failures"
   if (judge%failures > 0) stop 1

contains

   subroutine explain()
      write (error_unit, "(*(a, 1x))") &
         "usage: benchmark_hard_cases [--full] [--ours] [--arpack] [--block B] [GROUP ...], a GROUP one of", groups
      stop 1
   end subroutine explain
end program hard_cases
