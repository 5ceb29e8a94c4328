!> Worker loop of all processes but the first: receives and executes its requests.
module kschur_worker_loop
   use kschur_band_groups, only: lead_group
   use kschur_basis_worker, only: basis_instance_type, serve_basis
   use kschur_error, only: error_type
   use kschur_factor_parts, only: factor_parts_type
   use kschur_joint_ldl_worker, only: serve_ldl
   use kschur_mumps_worker, only: serve_mumps
   use kschur_processes, only: request_length, processes_type, request_basis, request_end, request_judge, request_ldl, &
      request_matrix, request_mumps, request_operator, request_parts, request_problem, request_quadratic, request_together, &
      request_two_level
   use kschur_quadratic_rows, only: serve_quadratic_operator, quadratic_parts_type
   use kschur_row_matrix, only: serve_matrix, row_matrix_part_type
   use kschur_shared_judgement, only: serve_judgement
   use kschur_shared_problem, only: shared_problem_type
   use kschur_symmetric_operator, only: symmetric_shift_invert_type
   use kschur_symmetric_rows, only: serve_symmetric_operator
   use kschur_together_worker, only: serve_lanczos
   use kschur_two_level_worker, only: serve_two_level
   use mpi_f08, only: MPI_Comm
   implicit none
   private
   public :: worker_loop

contains

   !> Executes requests of the first process until it ends the joint work.
   recursive subroutine worker_loop(processes, shared)
      type(processes_type), target, intent(inout) :: processes
      !> The problem, if it is distributed.
      type(shared_problem_type), intent(inout), optional :: shared
      type(factor_parts_type) :: factors
      type(basis_instance_type), allocatable :: bases(:)
      type(row_matrix_part_type), allocatable :: parts(:)
      type(symmetric_shift_invert_type), pointer :: operator
      type(quadratic_parts_type) :: quadratic
      type(processes_type), pointer :: all
      ! The first process has the same error.
      type(error_type), allocatable :: none
      integer :: request(request_length)

      all => processes
      allocate (factors%mumps(0), factors%ldl(0), bases(0), parts(0))
      do
         call processes%receive_request(request)
         select case (request(1))
         case (request_problem)
            call shared%give(processes, none)
         case (request_judge)
            call serve_judgement(shared, processes, request)
         case (request_matrix)
            call serve_matrix(parts, processes, request)
         case (request_mumps)
            call serve_mumps(factors%mumps, all, request)
         case (request_ldl)
            call serve_ldl(factors%ldl, all, request)
         case (request_operator)
            call serve_symmetric_operator(operator, parts, factors, all, request)
         case (request_quadratic)
            call serve_quadratic_operator(quadratic, parts, factors, all, request)
         case (request_together)
            call serve_lanczos(bases, operator, operator%deflation%shapes, request)
         case (request_two_level)
            call serve_two_level(bases, quadratic, request)
         case (request_basis)
            call serve_basis(bases, processes, request)
         case (request_parts)
            call work_in_group(processes, request(2))
         case (request_end)
            exit
         end select
      end do
   end subroutine worker_loop

   ! Splits the processes into groups that compute parts of a band, and works in one of them.
   recursive subroutine work_in_group(processes, groups)
      type(processes_type), intent(in) :: processes
      integer, intent(in) :: groups
      type(processes_type), target :: group
      type(MPI_Comm) :: leaders
      type(error_type), allocatable :: none

      call processes%split(groups, group, leaders)
      if (group%rank == 0) then
         call lead_group(group, groups, leaders)
      else
         call worker_loop(group)
      end if
      call group%leave(none)
   end subroutine work_in_group
end module kschur_worker_loop
