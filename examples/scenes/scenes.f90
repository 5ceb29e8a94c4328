!> The scenes by name: models that end in M, R, K, Cq, each with a few options.
module kschur_scenes
   use kschur, only: did_you_mean, error_type, error_usage, modal_problem_type, new_error
   use scene_assembly, only: assembly_type
   use scene_beam_body, only: beam_body_options, build_beam_body
   use scene_block, only: block_options, build_block
   use scene_brake, only: brake_options, build_brake
   use scene_cantilever, only: build_cantilever, cantilever_options
   use scene_crank, only: build_crank, crank_options
   use scene_free_free, only: build_free_free, free_free_options
   use scene_grid, only: build_grid, grid_options
   use scene_linkage, only: build_linkage, linkage_options
   use scene_options, only: listed, options_type
   use scene_pendulum, only: build_pendulum, pendulum_options
   use scene_rotor, only: build_rotor, rotor_options
   use scene_shell, only: build_shell, shell_options
   use scene_spring_chain, only: build_spring_chain, spring_chain_options
   use scene_turbine, only: build_turbine, turbine_options
   implicit none
   private
   public :: build_scene, scene_help, unknown_scene

   !> The scenes there are.
   character(len=*), parameter, public :: scene_names(13) = [character(len=12) :: &
      "beam-body", "block", "brake", "cantilever", "crank", "free-free", "grid", "linkage", "pendulum", "rotor", &
      "shell", "spring-chain", "turbine"]

contains

   !> Builds a scene. Fails with `error_usage` on an unknown scene or option and
   !> on a bad value.
   subroutine build_scene(name, arguments, problem, error)
      !> One of `scene_names`.
      character(len=*), intent(in) :: name
      !> The scene's options as words, names and values: `--elements`, `10`, or `--elements=10`, ...
      character(len=*), intent(in) :: arguments(:)
      type(modal_problem_type), intent(out) :: problem
      type(error_type), allocatable, intent(out) :: error
      type(options_type) :: options
      type(assembly_type) :: assembly

      if (all(scene_names /= name)) then
         call new_error(error, error_usage, unknown_scene(name))
         return
      end if
      options = options_of(name)
      call options%parse(arguments, error)
      if (.not. allocated(error)) call build(name, options, assembly, error)
      if (.not. allocated(error)) call assembly%finish(problem, error)
   end subroutine build_scene

   !> What a scene is and which options it takes, with their defaults: a line
   !> for the scene, one for each option. Empty for an unknown scene.
   pure function scene_help(name) result(lines)
      !> One of `scene_names`.
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: lines
      type(options_type) :: options

      lines = ""
      if (all(scene_names /= name)) return
      options = options_of(name)
      lines = trim(name)//": "//options%help()
   end function scene_help

   !> The sentence that says which scenes there are in the place of an unknown one.
   pure function unknown_scene(name) result(sentence)
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: sentence

      sentence = "there is no scene '"//trim(name)//"', only "//listed(scene_names, "and")//did_you_mean(name, scene_names)
   end function unknown_scene

   pure function options_of(name) result(options)
      character(len=*), intent(in) :: name
      type(options_type) :: options

      select case (name)
      case ("beam-body")
         options = beam_body_options()
      case ("block")
         options = block_options()
      case ("brake")
         options = brake_options()
      case ("cantilever")
         options = cantilever_options()
      case ("crank")
         options = crank_options()
      case ("free-free")
         options = free_free_options()
      case ("grid")
         options = grid_options()
      case ("linkage")
         options = linkage_options()
      case ("pendulum")
         options = pendulum_options()
      case ("rotor")
         options = rotor_options()
      case ("shell")
         options = shell_options()
      case ("spring-chain")
         options = spring_chain_options()
      case ("turbine")
         options = turbine_options()
      end select
   end function options_of

   subroutine build(name, options, assembly, error)
      character(len=*), intent(in) :: name
      type(options_type), intent(in) :: options
      type(assembly_type), intent(out) :: assembly
      type(error_type), allocatable, intent(out) :: error

      select case (name)
      case ("beam-body")
         call build_beam_body(options, assembly, error)
      case ("block")
         call build_block(options, assembly, error)
      case ("brake")
         call build_brake(options, assembly, error)
      case ("cantilever")
         call build_cantilever(options, assembly, error)
      case ("crank")
         call build_crank(options, assembly, error)
      case ("free-free")
         call build_free_free(options, assembly, error)
      case ("grid")
         call build_grid(options, assembly, error)
      case ("linkage")
         call build_linkage(options, assembly, error)
      case ("pendulum")
         call build_pendulum(options, assembly, error)
      case ("rotor")
         call build_rotor(options, assembly, error)
      case ("shell")
         call build_shell(options, assembly, error)
      case ("spring-chain")
         call build_spring_chain(options, assembly, error)
      case ("turbine")
         call build_turbine(options, assembly, error)
      end select
   end subroutine build
end module kschur_scenes
