!> Operator of symmetric problems on distributed vectors: distributed mass, constraints, deflated motions, right-hand sides and
!> solutions.
module kschur_symmetric_rows
   use kschur_csr, only: csr_matrix_type
   use kschur_deflation, only: deflation_type
   use kschur_error, only: error_type
   use kschur_factor_parts, only: factor_parts_type
   use kschur_joint_ranges, only: joint_ranges, joint_ranges_type
   use kschur_kinds, only: wp
   use kschur_operator_rows, only: share_common
   use kschur_processes, only: are_several, request_length, processes_type, request_operator
   use kschur_row_exchange, only: send_to_all
   use kschur_row_matrix, only: part_of, row_matrix_part_type
   use kschur_rows_solver, only: real_rows_solver_type
   use kschur_symmetric_operator, only: symmetric_shift_invert_type
   implicit none
   private
   public :: end_sharing, serve_symmetric_operator, share_operator

   integer, parameter :: job_begin = 1, job_end = 2

contains

   !> Distributes an operator for an iteration on distributed vectors; all processes must have parts of the factors and the mass.
   subroutine share_operator(operator, processes, error)
      class(symmetric_shift_invert_type), target, intent(inout) :: operator
      !> Processes of the solve; not associated: one process.
      type(processes_type), pointer, intent(in) :: processes
      type(error_type), allocatable, intent(out) :: error
      type(real_rows_solver_type) :: solver
      integer :: sizes(3)

      sizes = [operator%order(), size(operator%factors), size(operator%deflation%shapes, 2)]
      if (.not. are_several(processes, sizes(1))) return
      if (operator%solver%shared_as() == 0 .or. operator%mass%shared_as() == 0) return
      call processes%send_request([request_operator, job_begin, operator%mass%shared_as(), operator%solver%shared_as(), sizes])
      allocate (operator%part)
      operator%part%mass = operator%mass%by_rows()
      solver%original => operator%solver
      allocate (operator%part%solver, source=solver)
      call make_part(operator%part, operator, operator%problem%constraints, sizes, processes, error)
      operator%shared_with => processes
      if (allocated(error)) call end_sharing(operator)
   end subroutine share_operator

   !> Ends the distribution.
   subroutine end_sharing(operator)
      class(symmetric_shift_invert_type), intent(inout) :: operator

      if (.not. associated(operator%part)) return
      call operator%shared_with%send_request([request_operator, job_end])
      call release(operator%part)
   end subroutine end_sharing

   !> Executes a request of the first process to distribute a symmetric operator, or to end that.
   subroutine serve_symmetric_operator(part, matrices, factors, processes, request)
      !> The distributed operator.
      type(symmetric_shift_invert_type), pointer, intent(inout) :: part
      !> Local parts of matrices and factors.
      type(row_matrix_part_type), intent(in) :: matrices(:)
      type(factor_parts_type), intent(in) :: factors
      type(processes_type), pointer, intent(in) :: processes
      !> After the code: job, numbers of mass and factors, and numbers of unknowns, multipliers and motions.
      integer, intent(in) :: request(request_length)
      type(symmetric_shift_invert_type) :: nothing
      type(deflation_type), target :: no_motions
      type(csr_matrix_type) :: no_constraints
      ! The first process has the same error.
      type(error_type), allocatable :: error

      if (request(2) == job_end) then
         call release(part)
         return
      end if
      allocate (part)
      part%mass = part_of(matrices, request(3))
      call factors%take(request(4), request(5), request(6), processes, part%solver)
      allocate (no_motions%shapes(0, request(7)), no_motions%images(0, request(7)), nothing%factors(0))
      nothing%deflation => no_motions
      call make_part(part, nothing, no_constraints, request(5:7), processes, error)
   end subroutine serve_symmetric_operator

   ! Collective: completes a local part, whose mass and solver are set, with data of the first process.
   subroutine make_part(part, operator, constraints, sizes, processes, error)
      type(symmetric_shift_invert_type), intent(inout) :: part
      !> Significant in the first process; empty in others.
      class(symmetric_shift_invert_type), intent(in) :: operator
      type(csr_matrix_type), intent(in) :: constraints
      !> Numbers of unknowns, multipliers and deflated motions.
      integer, intent(in) :: sizes(3)
      type(processes_type), intent(in) :: processes
      type(error_type), allocatable, intent(out) :: error
      type(joint_ranges_type) :: ranges
      real(wp) :: weight(1, 1)

      call share_common(operator%deflation%shapes, operator%deflation%images, operator%factors, sizes, processes, part%deflation, &
         part%factors, error)
      if (allocated(error)) return
      part%sums%communicator = processes%communicator
      weight = operator%weight_of_violations
      call send_to_all(processes, weight)
      part%weight_of_violations = weight(1, 1)
      ranges = joint_ranges(sizes(1), sizes(2), processes%number)
      if (sizes(2) > 0) call part%constraints%share_between(constraints, ranges%multipliers, ranges%unknowns, processes, error)
   end subroutine make_part

   ! Frees the local part of an operator.
   subroutine release(part)
      type(symmetric_shift_invert_type), pointer, intent(inout) :: part

      if (associated(part%deflation)) deallocate (part%deflation)
      call part%constraints%drop()
      deallocate (part)
   end subroutine release
end module kschur_symmetric_rows
