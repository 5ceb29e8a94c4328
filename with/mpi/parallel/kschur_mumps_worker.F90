!> Joint factorisations in processes other than the first: they call MUMPS with the jobs that the first one requests, and hold
!> their part of the factors. Matrices and right-hand sides are distributed by rows, solutions by pivots.
module kschur_mumps_worker
   use kschur_error, only: error_type, new_error, error_memory, error_usage
   use kschur_kinds, only: long, single, wp
   use kschur_linear_solver, only: complex_linear_solver_type, matrix_structure_type, real_linear_solver_type
   use kschur_lock, only: acquire_lock, release_lock, lock_mumps
   use kschur_memory, only: require_memory
   use kschur_mumps_caller, only: job_take_rows, job_solve_vectors, mumps_complex, mumps_real, mumps_single_complex, &
      mumps_single_real, scalar_of
   use kschur_mumps_memory, only: solution_bytes
   use kschur_mumps_messages, only: mumps_error
   use kschur_processes, only: request_length, processes_type
   use kschur_solution_rows, only: solution_rows_type
   use kschur_sparse, only: complex_csr_matrix_type, csr_matrix_type
   use kschur_threads, only: set_blas_threads, team_size
   use mpi_f08, only: MPI_Comm, MPI_INTEGER, MPI_LOGICAL, MPI_Recv, MPI_Send, MPI_STATUS_IGNORE
   implicit none
   private
   public :: complex_part, complex_part_type, serve_mumps, mumps_instance_type, real_part, real_part_type

#include <dmumps_root.h>
#include <zmumps_root.h>
#include <smumps_root.h>
#include <cmumps_root.h>
#define INCLUDE !
#include <dmumps_struc.h>
#include <zmumps_struc.h>
#include <smumps_struc.h>
#include <cmumps_struc.h>
#undef INCLUDE

   ! JOB of MUMPS.
   integer, parameter :: job_begin = -1, job_end = -2, job_factorize = 2

   !> Local part of one factorisation.
   type :: mumps_instance_type
      private
      !> Its number in the first process.
      integer :: number = 0
      type(dmumps_struc), pointer :: real => null()
      type(zmumps_struc), pointer :: complex => null()
      type(smumps_struc), pointer :: single_real => null()
      type(cmumps_struc), pointer :: single_complex => null()
      ! Distribution of vectors.
      type(solution_rows_type) :: rows
   end type mumps_instance_type

   !> Local part of distributed factors of a real matrix, for collective solves with distributed vectors.
   type, extends(real_linear_solver_type) :: real_part_type
      private
      type(dmumps_struc), pointer :: factors => null()
      type(solution_rows_type) :: rows
   contains
      procedure :: factorize => keep_real_factors
      procedure :: solve => solve_real_part
      procedure :: solve_adjoint => refuse_real_adjoint
   end type real_part_type

   !> As above, complex.
   type, extends(complex_linear_solver_type) :: complex_part_type
      private
      type(zmumps_struc), pointer :: factors => null()
      type(solution_rows_type) :: rows
   contains
      procedure :: factorize => keep_complex_factors
      procedure :: solve => solve_complex_part
      procedure :: solve_adjoint => refuse_complex_adjoint
   end type complex_part_type

contains

   !> Executes a job that the first process has requested.
   subroutine serve_mumps(instances, processes, request)
      !> All factorisations in use.
      type(mumps_instance_type), allocatable, intent(inout) :: instances(:)
      type(processes_type), pointer, intent(in) :: processes
      !> After the code: number of the factorisation, job, library and symmetry; for vectors, numbers of unknowns, multipliers
      !> and columns.
      integer, intent(in) :: request(request_length)
      type(mumps_instance_type) :: new
      integer :: i

      associate (number => request(2), job => request(3))
         if (job == job_begin) then
            new%number = number
            instances = [instances, new]
         end if
         i = findloc(instances%number, number, dim=1)
         if (job == job_factorize) call set_blas_threads(team_size())
         select case (request(4))
         case (mumps_real)
            call help_real(instances(i)%real, instances(i)%rows, processes, request)
         case (mumps_complex)
            call help_complex(instances(i)%complex, instances(i)%rows, processes, request)
         case (mumps_single_real)
            call help_single_real(instances(i)%single_real, instances(i)%rows, processes, request)
         case (mumps_single_complex)
            call help_single_complex(instances(i)%single_complex, instances(i)%rows, processes, request)
         end select
         if (job == job_factorize) call set_blas_threads(1)
         if (job == job_end) instances = pack(instances, instances%number /= number)
      end associate
   end subroutine serve_mumps

#define HELP help_real
#define TAKE take_real
#define FORGET forget_real
#define SOLVE solve_real
#define SOLVE_ROWS solve_real_rows
#define SCALAR real(wp)
#define STORED(x) x
#define LIBRARY mumps_real
#define MUMPS_STRUC dmumps_struc
#define MUMPS_NAME dmumps
#define MATRIX_TYPE csr_matrix_type
#define PART_TYPE real_part_type
#define PART_OF real_part
#define FACTORS real
#define KEEP_FACTORS keep_real_factors
#define SOLVE_PART solve_real_part
#define REFUSE refuse_real_adjoint
#include "kschur_mumps_part.inc"
#include "kschur_mumps_worker.inc"
#include "kschur_mumps_rows.inc"

#define HELP help_complex
#define TAKE take_complex
#define FORGET forget_complex
#define SOLVE solve_complex
#define SOLVE_ROWS solve_complex_rows
#define SCALAR complex(wp)
#define STORED(x) x
#define LIBRARY mumps_complex
#define MUMPS_STRUC zmumps_struc
#define MUMPS_NAME zmumps
#define MATRIX_TYPE complex_csr_matrix_type
#define PART_TYPE complex_part_type
#define PART_OF complex_part
#define FACTORS complex
#define KEEP_FACTORS keep_complex_factors
#define SOLVE_PART solve_complex_part
#define REFUSE refuse_complex_adjoint
#include "kschur_mumps_part.inc"
#include "kschur_mumps_worker.inc"
#include "kschur_mumps_rows.inc"

#define HELP help_single_real
#define TAKE take_single_real
#define FORGET forget_single_real
#define SOLVE solve_single_real
#define SOLVE_ROWS solve_single_real_rows
#define SCALAR real(wp)
#define STORED(x) real(x, single)
#define LIBRARY mumps_single_real
#define MUMPS_STRUC smumps_struc
#define MUMPS_NAME smumps
#include "kschur_mumps_worker.inc"
#include "kschur_mumps_rows.inc"

#define HELP help_single_complex
#define TAKE take_single_complex
#define FORGET forget_single_complex
#define SOLVE solve_single_complex
#define SOLVE_ROWS solve_single_complex_rows
#define SCALAR complex(wp)
#define STORED(x) cmplx(x, kind=single)
#define LIBRARY mumps_single_complex
#define MUMPS_STRUC cmumps_struc
#define MUMPS_NAME cmumps
#include "kschur_mumps_worker.inc"
#include "kschur_mumps_rows.inc"
end module kschur_mumps_worker
