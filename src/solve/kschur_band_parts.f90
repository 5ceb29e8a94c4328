!> Parts of a band of an undamped symmetric problem, and counts of eigenvalues by inertia.
module kschur_band_parts
   use kschur_context, only: solve_context_type
   use kschur_effort, only: for_count
   use kschur_inertia, only: count_below
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: real_linear_solver_type
   implicit none
   private
   public :: count_at, part_type

   !> The largest numbers of modes of a part: solved from a shift in its middle, or from zero (docs/theory.md, section 14); and no
   !> part with fewer than the least number is cut.
   integer, parameter, public :: most_about_shift = 200, most_from_zero = 600, least_to_cut = 100

   !> A part of a band: the modes with from < omega < to (rad/s).
   type :: part_type
      real(wp) :: from = 0, to = 0
      !> Number of omega below either end, zeros included.
      integer :: below_from = 0, below_to = 0
   contains
      !> Whether the part is better solved from near zero, with all modes below it, than from its middle: from there zeros would
      !> be as far as its ends.
      procedure :: is_lowest
   end type part_type

contains

   elemental logical function is_lowest(self)
      class(part_type), intent(in) :: self
      real(wp), parameter :: near_zero = 0.01_wp

      is_lowest = self%from <= near_zero*self%to .and. self%below_from <= least_to_cut
   end function is_lowest

   !> Counts the eigenvalues omega^2 < theta ((rad/s)^2) by inertia, zeros included; -1 if that fails.
   subroutine count_at(s, theta, below)
      type(solve_context_type), intent(inout) :: s
      real(wp), intent(in) :: theta
      integer, intent(out) :: below
      class(real_linear_solver_type), allocatable :: solver

      allocate (solver, source=s%inner%counting)
      call count_below(s%work, theta, 0, solver, below)
      call s%effort%add_factors(solver, for_count)
   end subroutine count_at
end module kschur_band_parts
