!> The operators of the quadratic form on rows of states: rows of the mass and the damping, of motions that are kept out, and of
!> right-hand sides and solutions.
module kschur_quadratic_rows
   use kschur_deflation, only: deflation_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_mumps_help, only: complex_part, mumps_instance_type, real_part
   use kschur_operator_rows, only: share_known
   use kschur_processes, only: are_several, number_of_words, processes_type, word_quadratic
   use kschur_quadratic_complex, only: complex_operator_type => quadratic_operator_type
   use kschur_quadratic_real, only: real_operator_type => quadratic_operator_type
   use kschur_row_exchange, only: send_to_all
   use kschur_row_matrix, only: part_of, row_matrix_part_type
   use kschur_rows_solver, only: complex_rows_solver_type, real_rows_solver_type
   implicit none
   private
   public :: end_sharing, help_share_quadratic, quadratic_parts_type, share_operator

   integer, parameter :: job_begin = 1, job_end = 2
   integer, parameter :: real_operator = 1, complex_operator = 2

   !> Gives each process its part, where all of them have the factors, the mass and the damping.
   interface share_operator
      module procedure share_real, share_complex
   end interface share_operator

   !> Takes them back.
   interface end_sharing
      module procedure end_real, end_complex
   end interface end_sharing

   !> What another process than the first has of the operator that is shared.
   type :: quadratic_parts_type
      type(real_operator_type), pointer :: real => null()
      type(complex_operator_type), pointer :: complex => null()
   end type quadratic_parts_type

contains

   !> Does what the first process has announced.
   subroutine help_share_quadratic(parts, matrices, instances, processes, words)
      type(quadratic_parts_type), intent(inout) :: parts
      !> Matrices and factors that are here.
      type(row_matrix_part_type), intent(in) :: matrices(:)
      type(mumps_instance_type), intent(in) :: instances(:)
      type(processes_type), pointer, intent(in) :: processes
      !> Kind, job, the numbers of mass, damping and factors, unknowns, multipliers and motions, after the first word.
      integer, intent(in) :: words(number_of_words)

      if (words(2) == real_operator) then
         call help_real(parts%real, matrices, instances, processes, words(3:))
      else
         call help_complex(parts%complex, matrices, instances, processes, words(3:))
      end if
   end subroutine help_share_quadratic

#define SCALAR real(wp)
#define QUADRATIC_TYPE real_operator_type
#define ROWS_SOLVER_TYPE real_rows_solver_type
#define KIND_OF_OPERATOR real_operator
#define PART_OF_FACTORS real_part
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
#define PART_OF_FACTORS complex_part
#define SHARE share_complex
#define END_SHARE end_complex
#define HELP help_complex
#define MAKE_PART make_complex_part
#define RELEASE release_complex
#include "kschur_quadratic_rows.inc"
end module kschur_quadratic_rows
