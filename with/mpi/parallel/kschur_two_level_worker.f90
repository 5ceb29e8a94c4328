!> Executes requested steps on two-level bases in processes other than the first: the same steps on their rows of the first level.
module kschur_two_level_worker
   use kschur_basis_worker, only: basis_instance_type
   use kschur_first_level_worker_complex, only: help_complex => serve_first_level
   use kschur_first_level_worker_real, only: help_real => serve_first_level
   use kschur_processes, only: request_length
   use kschur_quadratic_rows, only: quadratic_parts_type
   implicit none
   private
   public :: serve_two_level

contains

   !> Executes a request of the first process on a two-level basis, real or complex.
   subroutine serve_two_level(instances, operators, request)
      !> All bases.
      type(basis_instance_type), intent(inout) :: instances(:)
      !> On distributed states.
      type(quadratic_parts_type), intent(in) :: operators
      !> After the code: number of the basis, operation and arguments.
      integer, intent(in) :: request(request_length)

      associate (basis => instances(findloc(instances%number, request(2), dim=1)))
         if (associated(basis%real)) then
            call help_real(operators%real, basis%real, basis%real_parts, request(3:))
         else
            call help_complex(operators%complex, basis%complex, basis%complex_parts, request(3:))
         end if
      end associate
   end subroutine serve_two_level
end module kschur_two_level_worker
