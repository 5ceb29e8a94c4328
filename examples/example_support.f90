!> What the examples share: a scene built and solved from one line, as on the command line.
module example_support
   use, intrinsic :: iso_fortran_env, only: error_unit
   use kschur, only: error_type, modal_options_type, modal_problem_type, modal_result_type, solve_modes, text, write_vtu
   use kschur_scenes, only: build_scene
   implicit none
   private
   public :: argument, argument_count, draw_modes, solve_scene, stop_on

contains

   !> Modes of a scene.
   subroutine solve_scene(line, options, result)
      !> Its name and options, as in "pendulum --bars 2".
      character(len=*), intent(in) :: line
      type(modal_options_type), intent(in) :: options
      type(modal_result_type), intent(out) :: result
      character(len=24) :: words(20)
      type(modal_problem_type) :: problem
      type(error_type), allocatable :: error
      integer :: status

      words = ""
      read (line, *, iostat=status) words
      call build_scene(trim(words(1)), words(2:count(words /= "")), problem, error)
      call stop_on(error)
      call solve_modes(problem, options, result, error)
      call stop_on(error)
   end subroutine solve_scene

   !> Writes the shapes of all modes, `mode_1_real` and so on, into a file for ParaView.
   subroutine draw_modes(result, path)
      type(modal_result_type), intent(in) :: result
      character(len=*), intent(in) :: path
      type(error_type), allocatable :: error
      character(len=12) :: names(size(result%eigenvalues))
      integer :: k

      do k = 1, size(names)
         names(k) = "mode_"//text(k)
      end do
      call write_vtu(result%mesh, result%eigenvectors, names, path, error)
      call stop_on(error)
   end subroutine draw_modes

   !> The i-th word of the command line, or a default.
   function argument(i, default) result(word)
      integer, intent(in) :: i
      character(len=*), intent(in) :: default
      character(len=1024) :: word
      integer :: status

      call get_command_argument(i, word, status=status)
      if (status /= 0) word = default
   end function argument

   !> The i-th word of the command line as a count of at least one, or a default.
   integer function argument_count(i, default)
      integer, intent(in) :: i, default
      character(len=1024) :: word
      integer :: status

      argument_count = default
      word = argument(i, "")
      if (word == "") return
      read (word, *, iostat=status) argument_count
      if (status == 0 .and. argument_count > 0) return
      write (error_unit, "(a)") "argument "//text(i)//" must be a count, not '"//trim(word)//"'"
      stop 1
   end function argument_count

   !> Ends the program with the message of a raised error.
   subroutine stop_on(error)
      type(error_type), allocatable, intent(in) :: error

      if (.not. allocated(error)) return
      write (error_unit, "(a)") error%message
      stop 1
   end subroutine stop_on
end module example_support
