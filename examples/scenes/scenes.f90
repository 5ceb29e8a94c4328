!> The scenes by name: models that end in M, R, K, Cq, each with a few options.
module kschur_scenes
   use kschur, only: error_type, error_usage, modal_problem_type, new_error
   use scene_beam_body, only: beam_body_options, build_beam_body
   use scene_cantilever, only: build_cantilever, cantilever_options
   use scene_grid, only: build_grid, grid_options
   use scene_options, only: listed, options_type
   implicit none
   private
   public :: build_scene, scene_help

   !> The scenes there are.
   character(len=*), parameter, public :: scene_names(3) = [character(len=10) :: "beam-body", "cantilever", "grid"]

contains

   !> Builds a scene. Fails with `error_usage` on an unknown scene or option and
   !> on a bad value.
   subroutine build_scene(name, arguments, problem, error)
      !> One of `scene_names`.
      character(len=*), intent(in) :: name
      !> The scene's options as words, names and values in turn: `--elements`, `10`, ...
      character(len=*), intent(in) :: arguments(:)
      type(modal_problem_type), intent(out) :: problem
      type(error_type), allocatable, intent(out) :: error

      select case (name)
      case ("beam-body")
         call build_beam_body(arguments, problem, error)
      case ("cantilever")
         call build_cantilever(arguments, problem, error)
      case ("grid")
         call build_grid(arguments, problem, error)
      case default
         call new_error(error, error_usage, &
            "there is no scene '"//trim(name)//"', only "//listed(scene_names, "and"))
      end select
   end subroutine build_scene

   !> What a scene is and which options it takes, with their defaults: a line
   !> for the scene, one for each option. Empty for an unknown scene.
   pure function scene_help(name) result(lines)
      !> One of `scene_names`.
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: lines
      type(options_type) :: options

      lines = ""
      select case (name)
      case ("beam-body")
         options = beam_body_options()
      case ("cantilever")
         options = cantilever_options()
      case ("grid")
         options = grid_options()
      case default
         return
      end select
      lines = trim(name)//": "//options%help()
   end function scene_help
end module kschur_scenes
