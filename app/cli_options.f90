!> The options of the solver that several commands take.
module cli_options
   use cli_arguments, only: arguments_type
   use kschur, only: error_type, error_usage, inner_names, modal_options_type, new_error, scaling_names, wp
   implicit none
   private
   public :: take_iteration, take_wanted

contains

   !> Takes the wanted modes: their number, the target they are nearest to, and the shift; or, for commands with `band`, all in a
   !> band.
   subroutine take_wanted(arguments, options, error, band)
      type(arguments_type), intent(inout) :: arguments
      type(modal_options_type), intent(inout) :: options
      type(error_type), allocatable, intent(inout) :: error
      !> Two frequencies (Hz); not allocated: none.
      real(wp), allocatable, optional, intent(out) :: band(:)
      real(wp), parameter :: two_pi = 8*atan(1.0_wp)
      complex(wp), allocatable :: target
      real(wp), allocatable :: frequency
      integer :: modes

      modes = 0
      call arguments%take_integer("--modes", 1, modes, error)
      call arguments%take_complex("--shift", options%shift, error)
      call arguments%take_complex("--target", target, error)
      call arguments%take_positive("--frequency", frequency, error)
      if (present(band)) call arguments%take_pair("--band", band, error)
      if (allocated(error)) return
      if (allocated(target) .and. allocated(frequency)) &
         call new_error(error, error_usage, "--target and --frequency exclude each other")
      if (present(band)) then
         if (allocated(band) .and. (modes > 0 .or. allocated(target) .or. allocated(frequency) .or. allocated(options%shift))) &
            call new_error(error, error_usage, "--band excludes --modes, --target, --frequency and --shift")
      end if
      if (modes > 0) options%modes = modes
      if (allocated(target)) options%target = target
      if (allocated(frequency)) options%target = cmplx(0.0_wp, two_pi*frequency, wp)
   end subroutine take_wanted

   !> Takes options of the iteration and solvers.
   subroutine take_iteration(arguments, options, error)
      type(arguments_type), intent(inout) :: arguments
      type(modal_options_type), intent(inout) :: options
      type(error_type), allocatable, intent(inout) :: error
      real(wp), allocatable :: tolerance
      integer :: presolve

      call arguments%take_choice("--constraint-scaling", scaling_names, options%constraint_scaling, error)
      presolve = merge(1, 0, options%presolve)
      call arguments%take_choice("--presolve", [character(len=3) :: "off", "on"], presolve, error)
      options%presolve = presolve == 1
      call arguments%take_choice("--inner", inner_names, options%inner, error)
      call arguments%take_integer("--subspace", 1, options%subspace, error)
      call arguments%take_positive("--tolerance", tolerance, error)
      if (allocated(tolerance)) options%tolerance = tolerance
      call arguments%take_integer("--max-restarts", 1, options%max_restarts, error)
      call arguments%take_integer("--block", 1, options%block, error, zero="auto")
      call arguments%take_bytes("--memory", options%memory, error)
      call arguments%take_integer("--distribute", 1, options%distribute, error)
      call arguments%take_integer("--groups", 1, options%groups, error)
   end subroutine take_iteration
end module cli_options
