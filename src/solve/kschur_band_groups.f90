!> Groups of processes that count and compute the parts of a band. This build has one process, which solves them one by one;
!> `with/mpi` has the module for several.
module kschur_band_groups
   use kschur_band_part, only: part_modes_type, solve_part
   use kschur_band_parts, only: count_at, part_type
   use kschur_context, only: solve_context_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_options, only: modal_options_type
   use kschur_problem, only: modal_problem_type
   use kschur_processes, only: processes_type
   implicit none
   private
   public :: band_groups_type

   !> The groups: here a single one of one process.
   type :: band_groups_type
   contains
      !> Splits the processes into groups, and distributes the problem to them.
      procedure, nopass :: begin
      !> Number of groups.
      procedure, nopass :: number_of_groups
      !> Counts eigenvalues.
      procedure, nopass :: count => count_here
      !> Distributes the list of parts.
      procedure, nopass :: announce
      !> Returns the modes of a part; parts are requested in order.
      procedure, nopass :: obtain
      !> Ends the work on parts, requested or not.
      procedure, nopass :: finish
      !> Joins the groups again; call after all factors are freed.
      procedure, nopass :: disband
   end type band_groups_type

contains

   ! Leaves the one process in its group.
   subroutine begin(problem, options, processes, error)
      type(modal_problem_type), intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      !> On return the group of this process.
      type(processes_type), intent(inout) :: processes
      type(error_type), allocatable, intent(out) :: error

      associate (unused => problem, also => options, too => processes, none => error)
      end associate
   end subroutine begin

   ! There is one group.
   pure integer function number_of_groups()
      number_of_groups = 1
   end function number_of_groups

   ! Counts the eigenvalues omega^2 below each theta ((rad/s)^2) in this process.
   subroutine count_here(s, theta, below)
      type(solve_context_type), intent(inout) :: s
      real(wp), intent(in) :: theta(:)
      integer, allocatable, intent(out) :: below(:)
      integer :: i

      allocate (below(size(theta)))
      do i = 1, size(theta)
         call count_at(s, theta(i), below(i))
      end do
   end subroutine count_here

   ! Does nothing: no other group needs the list.
   subroutine announce(parts)
      type(part_type), intent(in) :: parts(:)

      associate (unused => parts)
      end associate
   end subroutine announce

   ! Computes the modes of part i in this process.
   subroutine obtain(i, s, parts, found, error)
      integer, intent(in) :: i
      !> Its damping is left out.
      type(solve_context_type), target, intent(inout) :: s
      type(part_type), intent(in) :: parts(:)
      type(part_modes_type), intent(out) :: found
      type(error_type), allocatable, intent(out) :: error

      call solve_part(s, parts(i), found, error)
   end subroutine obtain

   ! Does nothing: no other group works on parts.
   subroutine finish()
   end subroutine finish

   ! Does nothing: there are no groups to join.
   subroutine disband(processes)
      type(processes_type), intent(inout) :: processes

      associate (unused => processes)
      end associate
   end subroutine disband
end module kschur_band_groups
