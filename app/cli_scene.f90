!> kschur scene: builds one of the models of examples/scenes and writes it as a problem.
module cli_scene
   use cli_arguments, only: arguments_type
   use cli_system, only: check_new_file, check_new_folder, ends_with, print_line
   use kschur, only: error_type, error_usage, modal_problem_type, new_error, text, write_hdf5_problem, &
      write_matrix_market_problem
   use kschur_scenes, only: build_scene
   implicit none
   private
   public :: scene_command

contains

   !> Runs the command. An output name that ends in .h5 or .hdf5 makes an HDF5 file, any other a folder of Matrix Market files.
   subroutine scene_command(arguments, error)
      type(arguments_type), intent(inout) :: arguments
      type(error_type), allocatable, intent(out) :: error
      type(modal_problem_type) :: problem
      character(len=:), allocatable :: name, output
      logical :: one_file

      call arguments%take_text("--output", output, error)
      if (allocated(error)) return
      call arguments%take_word(name)
      if (.not. allocated(name)) then
         call new_error(error, error_usage, "no scene is named; see kschur help scene")
      else if (.not. allocated(output)) then
         call new_error(error, error_usage, "kschur scene wants --output PROBLEM.h5, or the name of a folder")
      end if
      if (allocated(error)) return

      if (len(output) > 1 .and. ends_with(output, "/")) output = output(:len(output) - 1)
      one_file = ends_with(output, ".h5") .or. ends_with(output, ".hdf5")
      if (one_file) then
         call check_new_file(output, error)
      else
         call check_new_folder(output, error)
      end if
      if (allocated(error)) return

      call build_scene(name, arguments%rest(), problem, error)
      if (allocated(error)) return
      if (one_file) then
         call write_hdf5_problem(problem, output, error)
      else
         call write_matrix_market_problem(problem, output, error)
      end if
      if (allocated(error)) return
      call print_line(output//": "//text(problem%unknowns())//" unknowns, "// &
         text(problem%multipliers())//" constraints")
   end subroutine scene_command
end module cli_scene
