!> LDL^T over several processes, in processes other than the first: they do what it requests, and hold their part of the factors.
module kschur_joint_ldl_worker
   use kschur_error, only: error_type
   use kschur_joint_factors, only: joint_factors_type, pivot_counts_type
   use kschur_joint_ldl, only: job_count, job_end, job_factor, job_keep, job_scale, job_share, job_solve
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: matrix_structure_type, real_linear_solver_type
   use kschur_processes, only: processes_type, request_length
   use kschur_sparse, only: csr_matrix_type
   use kschur_tolerances, only: cancelled, rounding_of_sums
   implicit none
   private
   public :: ldl_instance_type, ldl_part_type, serve_ldl

   !> Local part of one factorisation.
   type :: ldl_instance_type
      !> Its number in the first process.
      integer :: number = 0
      type(joint_factors_type), pointer :: part => null()
   end type ldl_instance_type

   !> As a solver, for collective solves with distributed vectors.
   type, extends(real_linear_solver_type) :: ldl_part_type
      type(joint_factors_type), pointer :: part => null()
   contains
      procedure :: factorize
      procedure :: solve
      procedure :: solve_adjoint => solve
   end type ldl_part_type

contains

   !> Executes a request of the first process.
   subroutine serve_ldl(instances, processes, request)
      !> All factorisations in use.
      type(ldl_instance_type), allocatable, intent(inout) :: instances(:)
      type(processes_type), pointer, intent(in) :: processes
      !> After the code: number of the factorisation, job and arguments.
      integer, intent(in) :: request(request_length)
      type(ldl_instance_type) :: new
      type(pivot_counts_type) :: counts
      ! The first process has the same error.
      type(error_type), allocatable :: error
      real(wp) :: none(0, request(4))

      if (request(3) == job_share) then
         new%number = request(2)
         allocate (new%part)
         instances = [instances, new]
      end if
      associate (part => instances(findloc(instances%number, request(2), dim=1))%part)
         select case (request(3))
         case (job_share)
            call part%share(processes, error)
         case (job_factor)
            call part%factor(request(4), request(5) == 1, error)
         case (job_count)
            call part%count_pivots(merge(cancelled, rounding_of_sums, request(4) == 1), counts)
         case (job_keep)
            call part%drop_matrix()
         case (job_solve)
            call part%solve(none, .false., error)
         case (job_scale)
            call part%scale([real(wp) ::])
         end select
      end associate
      if (request(3) /= job_end) return
      deallocate (instances(findloc(instances%number, request(2), dim=1))%part)
      instances = pack(instances, instances%number /= request(2))
   end subroutine serve_ldl

   ! Does nothing: the first process starts factorisations.
   subroutine factorize(self, matrix, structure, error)
      class(ldl_part_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error

      associate (unused => self, also => matrix, too => structure)
      end associate
   end subroutine factorize

   subroutine solve(self, x, error)
      class(ldl_part_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      call self%part%solve(x, .true., error)
   end subroutine solve
end module kschur_joint_ldl_worker
