!> Seconds of four solves one after another, each on all cores, and of the same in four threads of the caller, which share
!> the cores.
!>
!>     benchmark_callers [ROUNDS [SCENE WITH OPTIONS]]
!>
!> Without a scene a grid of 60x42 cells. The least of the rounds each; a ratio above one would say that the threads of
!> the solves are in each other's way.
program callers
   use kschur, only: error_type, modal_options_type, modal_problem_type, modal_result_type, solve_modes, wp
   use kschur_clock, only: clock, seconds_since
   use kschur_kinds, only: long
   use kschur_scenes, only: build_scene
   implicit none
   integer, parameter :: solves = 4, modes = 56
   type(modal_problem_type) :: problem
   type(error_type), allocatable :: error
   character(len=32), allocatable :: words(:)
   real(wp) :: in_turn, together
   integer :: rounds, i

   allocate (words(command_argument_count()))
   do i = 1, size(words)
      call get_command_argument(i, words(i))
   end do
   rounds = 3
   if (size(words) > 0) read (words(1), *) rounds
   if (size(words) > 1) then
      call build_scene(trim(words(2)), words(3:), problem, error)
   else
      call build_scene("grid", [character(len=7) :: "--cells", "60x42"], problem, error)
   end if
   if (allocated(error)) then
      print "(a)", error%message
      error stop
   end if
   in_turn = huge(in_turn)
   together = huge(together)
   do i = 1, rounds
      in_turn = min(in_turn, seconds(together=.false.))
      together = min(together, seconds(together=.true.))
   end do
   print "(a, 2f9.3, a, f6.3)", "one after another and together, s", in_turn, together, "; ratio", together/in_turn

contains

   real(wp) function seconds(together)
      logical, intent(in) :: together
      type(modal_result_type) :: results(solves)
      type(error_type), allocatable :: wrong
      integer(long) :: started
      integer :: k

      started = clock()
      !$omp parallel do num_threads(solves) private(wrong) if (together)
      do k = 1, solves
         call solve_modes(problem, modal_options_type(modes=modes), results(k), wrong)
         if (allocated(wrong)) print "(a)", wrong%message
      end do
      !$omp end parallel do
      seconds = seconds_since(started)
   end function seconds
end program callers
