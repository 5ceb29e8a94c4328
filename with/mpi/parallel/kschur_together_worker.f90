!> Executes requested steps of block Lanczos iterations in processes other than the first: the same steps on their rows.
module kschur_together_worker
   use kschur_basis_worker, only: basis_instance_type
   use kschur_block_decomposition, only: block_decomposition_type
   use kschur_block_lanczos, only: add_random_here, expand_here
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_krylov_options, only: krylov_statistics_type
   use kschur_operator, only: symmetric_operator_type
   use kschur_processes, only: request_length
   use kschur_row_team, only: to_give, to_take
   use kschur_together, only: end_together, join_together, to_add_random, to_expand
   implicit none
   private
   public :: serve_lanczos

contains

   !> Executes a step of block Lanczos that the first process has requested.
   subroutine serve_lanczos(instances, operator, excluded, request)
      !> All bases.
      type(basis_instance_type), intent(in) :: instances(:)
      !> On distributed vectors.
      class(symmetric_operator_type), intent(inout) :: operator
      !> Local rows of the excluded vectors.
      real(wp), intent(in) :: excluded(:, :)
      !> After the code: number of the basis, operation and arguments.
      integer, intent(in) :: request(request_length)
      type(block_decomposition_type), pointer :: d
      ! The first process has the same ones.
      type(krylov_statistics_type) :: statistics
      type(error_type), allocatable :: error
      real(wp) :: none(0, 0), limit

      d => instances(findloc(instances%number, request(2), dim=1))%decomposition
      d%team = d%basis%team()
      if (.not. allocated(d%excluded) .and. size(excluded, 2) > 0) allocate (d%excluded, source=excluded)
      select case (request(3))
      case (to_expand)
         call join_together(d, request(4), request(5), limit)
         call expand_here(operator, d, limit, statistics, error)
         call end_together(d)
      case (to_add_random)
         call join_together(d, request(4), request(5), limit)
         call add_random_here(operator, d, request(6), request(7), statistics, error)
         call end_together(d)
      case (to_give)
         call d%team%give(d%images, request(4), none)
      case (to_take)
         call d%team%take(none, request(4), d%images)
      end select
   end subroutine serve_lanczos
end module kschur_together_worker
