!> Bases whose rows several processes share, against matmul on one: mpirun -np N check_basis. Prints each check that fails, then
!> `N passed, N failed`.
module checks
   use kschur_kinds, only: wp
   implicit none
   private
   public :: check, conclude

   !> Of numbers of order one.
   real(wp), parameter, public :: close = 1.0e-13_wp

   integer :: passed = 0, failed = 0

contains

   subroutine check(name, holds)
      character(len=*), intent(in) :: name
      logical, intent(in) :: holds

      if (holds) passed = passed + 1
      if (holds) return
      failed = failed + 1
      print "(a)", "FAILED  "//name
   end subroutine check

   subroutine conclude()
      print "(i0, a, i0, a)", passed, " passed, ", failed, " failed"
   end subroutine conclude
end module checks

module checks_real
   use checks, only: check, close
   use kschur_basis_rows_real, only: basis_rows_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_processes, only: processes_type
   implicit none
   private
   public :: check_basis

#define SCALAR real(wp)
#define ADJOINT(x) transpose(x)
#define RANDOM(x, y) x + 0*y
#include "check_basis.inc"
#undef SCALAR
#undef ADJOINT
#undef RANDOM
end module checks_real

module checks_complex
   use checks, only: check, close
   use kschur_basis_rows_complex, only: basis_rows_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_processes, only: processes_type
   implicit none
   private
   public :: check_basis

#define SCALAR complex(wp)
#define ADJOINT(x) conjg(transpose(x))
#define RANDOM(x, y) cmplx(x, y, wp)
#include "check_basis.inc"
end module checks_complex

program check_basis
   use checks, only: conclude
   use checks_complex, only: check_complex => check_basis
   use checks_real, only: check_real => check_basis
   use kschur_error, only: error_type
   use kschur_worker_loop, only: worker_loop
   use kschur_processes, only: join_processes, processes_type
   use mpi_f08, only: MPI_COMM_WORLD, MPI_Finalize, MPI_Init
   implicit none

   ! Fewer rows than processes, and rows that are not one panel.
   integer, parameter :: lengths(5) = [1, 3, 10, 700, 5003]
   type(processes_type), target :: processes
   type(processes_type), pointer :: all
   type(error_type), allocatable :: error
   integer, allocatable :: communicator
   character(len=8) :: length
   integer :: i

   call MPI_Init()
   allocate (communicator, source=MPI_COMM_WORLD%mpi_val)
   call join_processes(communicator, 1, processes, error)
   all => processes
   if (processes%rank > 0) then
      call worker_loop(processes)
   else
      do i = 1, size(lengths)
         write (length, "(i0)") lengths(i)
         call check_real("real, "//trim(length), lengths(i), all)
         call check_complex("complex, "//trim(length), lengths(i), all)
      end do
   end if
   call processes%leave(error)
   if (processes%rank == 0) call conclude()
   call MPI_Finalize()
end program check_basis
