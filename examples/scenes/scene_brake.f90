!> The scene `brake`: a pad and its backing plate, clamped together, pressed by springs in two directions against a
!> sliding surface. The friction force follows the normal force of the other spring, so that K is not symmetric
!> (Hulten, Friction phenomena related to drum brake squeal instabilities, ASME DETC97/VIB-4161).
!>
!> With s = -lambda^2: (k1 - s m)(k2 - s m) + mu^2 k1 k2 = 0, flutter above mu = |k1 - k2|/(2 sqrt(k1 k2)).
module scene_brake
   use kschur, only: error_type, wp
   use scene_assembly, only: assembly_type, new_assembly
   use scene_options, only: option_type, options_type
   implicit none
   private
   public :: brake_options, build_brake

contains

   !> What the scene can be asked for.
   pure function brake_options() result(options)
      type(options_type) :: options

      options%description = "pad and plate on a sliding surface: flutter by friction"
      allocate (options%list(6))
      options%list(1) = option_type("--friction", "0.3", "coefficient of friction; flutter above 0.225")
      options%list(2) = option_type("--mass", "1", "mass of pad and plate, kg")
      options%list(3) = option_type("--stiffness-1", "1e6", "stiffness of the first spring, N/m")
      options%list(4) = option_type("--stiffness-2", "1.5625e6", "stiffness of the second spring, N/m")
      options%list(5) = option_type("--damping", "rayleigh", "damping by mass: rayleigh or none")
      options%list(6) = option_type("--alpha", "10", "damping by mass, 1/s")
   end function brake_options

   !> Builds the scene: unknowns 1 and 2 are the pad's, 3 and 4 the plate's; n = 4, m = 2.
   subroutine build_brake(options, assembly, error)
      type(options_type), intent(in) :: options
      type(assembly_type), intent(out) :: assembly
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: no_stiffness(1, 1) = 0
      character(len=:), allocatable :: damping
      real(wp) :: friction, mass, k1, k2, alpha
      integer :: k

      call options%read_not_negative("--friction", friction, error)
      call options%read_positive("--mass", mass, error)
      call options%read_positive("--stiffness-1", k1, error)
      call options%read_positive("--stiffness-2", k2, error)
      call options%read_choice("--damping", [character(len=8) :: "rayleigh", "none"], damping, error)
      call options%read_not_negative("--alpha", alpha, error)
      call options%require("--damping", "rayleigh", ["--alpha"], error)
      if (allocated(error)) return

      if (damping == "none") alpha = 0
      assembly = new_assembly(4)
      do k = 1, 4
         call assembly%add_element([k], reshape([mass/2], [1, 1]), no_stiffness, [alpha, 0.0_wp])
      end do
      ! The springs hold the plate, the friction acts on the pad.
      call assembly%stiffness%add_block([3, 4], [3, 4], reshape([k1, 0.0_wp, 0.0_wp, k2], [2, 2]))
      call assembly%stiffness%add_block([1, 2], [3, 4], friction*reshape([0.0_wp, k1, -k2, 0.0_wp], [2, 2]))
      call assembly%add_constraints([1, 3], reshape([1.0_wp, -1.0_wp], [1, 2]))
      call assembly%add_constraints([2, 4], reshape([1.0_wp, -1.0_wp], [1, 2]))
      call assembly%geometry%add_line(reshape([0.0_wp, 0.0_wp, 0.0_wp], [3, 1]), reshape([1, 2, 0], [3, 1]))
   end subroutine build_brake
end module scene_brake
