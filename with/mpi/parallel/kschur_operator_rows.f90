!> Common part of operators on distributed vectors: deflated motions and constraint factors.
module kschur_operator_rows
   use kschur_deflation, only: deflation_type
   use kschur_error, only: error_type
   use kschur_joint_ranges, only: joint_ranges, joint_ranges_type
   use kschur_kinds, only: wp
   use kschur_memory, only: real_bytes, require_memory
   use kschur_processes, only: processes_type, spread_error
   use kschur_row_exchange, only: scatter
   implicit none
   private
   public :: share_common

contains

   !> Scatters the rows of deflated motions and constraint factors; collective. Fails in all processes if one has no memory for
   !> them.
   subroutine share_common(shapes, images, factors, sizes, processes, deflation, own_factors, error)
      !> Deflated motions, their images, and constraint factors, in the first process.
      real(wp), contiguous, intent(in) :: shapes(:, :), images(:, :), factors(:)
      !> Numbers of unknowns, multipliers and motions.
      integer, intent(in) :: sizes(3)
      type(processes_type), intent(in) :: processes
      !> Local parts.
      type(deflation_type), pointer, intent(inout) :: deflation
      real(wp), allocatable, intent(out) :: own_factors(:)
      type(error_type), allocatable, intent(out) :: error
      type(joint_ranges_type) :: ranges
      real(wp), allocatable :: part(:, :)

      associate (unknowns => ranges%unknowns, multipliers => ranges%multipliers, here => processes%rank, motions => sizes(3))
         ranges = joint_ranges(sizes(1), sizes(2), processes%number)
         call require_memory(2*real_bytes*(motions*real(unknowns%rows(here), wp) + multipliers%rows(here)), &
            "motions that are kept out of the iteration", error)
         call spread_error(processes%communicator, error)
         if (allocated(error)) return
         allocate (deflation)
         deflation%sums%communicator = processes%communicator
         allocate (deflation%decay(motions), source=0.0_wp)
         allocate (deflation%shapes(unknowns%rows(here), motions), deflation%images(unknowns%rows(here), motions))
         call scatter(processes, unknowns, shapes, deflation%shapes)
         call scatter(processes, unknowns, images, deflation%images)
         allocate (part(multipliers%rows(here), 1))
         call scatter(processes, multipliers, reshape(factors, [size(factors), 1]), part)
         allocate (own_factors, source=part(:, 1))
      end associate
   end subroutine share_common
end module kschur_operator_rows
