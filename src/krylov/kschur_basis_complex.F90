!> Krylov bases of complex vectors.
module kschur_basis_complex
   use kschur_archive, only: archive_type
   use kschur_basis_rows_complex, only: basis_rows_type
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type
   use kschur_kinds, only: wp, long
   use kschur_memory, only: complex_bytes, require_memory
   use kschur_operator, only: complex_operator_type
   use kschur_processes, only: processes_type
   use kschur_random, only: random_vector
   implicit none
   private
   public :: basis_type, plain_basis_type

#define SCALAR complex(wp)
#define OPERATOR_TYPE complex_operator_type
#include "kschur_basis.inc"
end module kschur_basis_complex
