!> Quadratic operators on distributed states: distributed mass, damping, deflated motions, right-hand sides and solutions.
module kschur_quadratic_rows
   use kschur_error, only: error_type
   use kschur_factor_parts, only: factor_parts_type
   use kschur_kinds, only: wp
   use kschur_operator_rows, only: share_common
   use kschur_processes, only: are_several, request_length, processes_type, request_quadratic
   use kschur_quadratic_complex, only: complex_operator_type => quadratic_operator_type
   use kschur_quadratic_real, only: real_operator_type => quadratic_operator_type
   use kschur_row_exchange, only: send_to_all
   use kschur_row_matrix, only: part_of, row_matrix_part_type
   use kschur_rows_solver, only: complex_rows_solver_type, real_rows_solver_type
   implicit none
   private
   public :: end_sharing, serve_quadratic_operator, quadratic_parts_type, share_operator

   integer, parameter :: job_begin = 1, job_end = 2
   integer, parameter :: real_operator = 1, complex_operator = 2

   !> Distributes an operator for an iteration on distributed states; all processes must have parts of factors, mass and damping.
   interface share_operator
      module procedure share_real, share_complex
   end interface share_operator

   !> Ends the distribution.
   interface end_sharing
      module procedure end_real, end_complex
   end interface end_sharing

   !> Local parts of the distributed operator in other processes.
   type :: quadratic_parts_type
      type(real_operator_type), pointer :: real => null()
      type(complex_operator_type), pointer :: complex => null()
   end type quadratic_parts_type

contains

   !> Executes a request of the first process to distribute a quadratic operator, or to end that.
   subroutine serve_quadratic_operator(parts, matrices, factors, processes, request)
      type(quadratic_parts_type), intent(inout) :: parts
      !> Local parts of matrices and factors.
      type(row_matrix_part_type), intent(in) :: matrices(:)
      type(factor_parts_type), intent(in) :: factors
      type(processes_type), pointer, intent(in) :: processes
      !> After the code: kind, job, numbers of mass, damping and factors, and numbers of unknowns, multipliers and motions.
      integer, intent(in) :: request(request_length)

      if (request(2) == real_operator) then
         call help_real(parts%real, matrices, factors, processes, request(3:))
      else
         call help_complex(parts%complex, matrices, factors, processes, request(3:))
      end if
   end subroutine serve_quadratic_operator

#define SCALAR real(wp)
#define QUADRATIC_TYPE real_operator_type
#define ROWS_SOLVER_TYPE real_rows_solver_type
#define KIND_OF_OPERATOR real_operator
#define SHARE share_real
#define END_SHARE end_real
#define HELP help_real
#define MAKE_PART make_real_part
#define RELEASE release_real
#include "kschur_quadratic_rows.inc"

#define SCALAR complex(wp)
#define QUADRATIC_TYPE complex_operator_type
#define ROWS_SOLVER_TYPE complex_rows_solver_type
#define KIND_OF_OPERATOR complex_operator
#define SHARE share_complex
#define END_SHARE end_complex
#define HELP help_complex
#define MAKE_PART make_complex_part
#define RELEASE release_complex
#include "kschur_quadratic_rows.inc"
end module kschur_quadratic_rows
