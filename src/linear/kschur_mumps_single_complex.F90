!> Complex sparse direct solver MUMPS in single precision: a preconditioner.
module kschur_mumps_single_complex
   use, intrinsic :: iso_c_binding, only: c_loc
   use kschur_analysed_pattern, only: analysed_pattern_type
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_memory, error_usage
   use kschur_kinds, only: wp, long, single
   use kschur_linear_solver, only: determinant_type, complex_linear_solver_type, matrix_structure_type
   use kschur_lock, only: acquire_lock, release_lock, lock_mumps
   use kschur_memory, only: complex_bytes, require_memory
   use kschur_monitor, only: ask_monitor
   use kschur_mumps_caller, only: job_take_rows, job_solve_vectors, mumps_caller_type, mumps_single_complex
   use kschur_mumps_memory, only: block_of_right_hand_sides, solution_bytes
   use kschur_mumps_messages, only: mumps_error, is_short_of_workspace
   use kschur_ordering, only: elimination_order
   use kschur_processes, only: processes_type
   use kschur_row_ranges, only: row_ranges, row_ranges_type
   use kschur_solution_rows, only: solution_rows_type
   use kschur_sparse, only: complex_combination, complex_csr_matrix_type, csr_matrix_type
   use kschur_text, only: text
   use kschur_threads, only: set_blas_threads, team_size
   implicit none
   private
   public :: mumps_single_complex_type

   ! Only #include searches the system's folders, for both fpm and CMake; the
   ! first header would include the second one by a Fortran include line, as it does for flang, which knows that line first.
#ifndef __flang__
#include <cmumps_root.h>
#define INCLUDE !
#endif
#include <cmumps_struc.h>
#undef INCLUDE

#define SCALAR complex(wp)
#define MATRIX_TYPE complex_csr_matrix_type
#define PARENT_TYPE complex_linear_solver_type
#define SOLVER_TYPE mumps_single_complex_type
#define MUMPS_STRUC cmumps_struc
#define MUMPS_NAME cmumps
#define MUMPS_SCALAR complex
#define LIBRARY mumps_single_complex
#define STORED(x) cmplx(x, kind=single)
#define ADJOINT_OF(x) conjg(x)
#define GIVEN(x) complex_combination([(1.0_wp, 0.0_wp)], [x])
#define HAS_INERTIA .false.
#define HAS_DETERMINANT .false.
#define IMAGINARY(x) x
#define NULL_PIVOTS 0
#define DESCRIPTION "mumps: in single precision"
#include "kschur_mumps.inc"
#include "kschur_mumps_solve.inc"
#define SOLVE_ROWS solve_by_rows
#include "kschur_mumps_rows.inc"
end module kschur_mumps_single_complex
