!> Solutions that come at pivots anywhere, brought to where their rows belong, and vectors sent out and gathered: with
!> multipliers and without, processes without rows, real and complex, other pivots after the first ones. Ends with an error where
!> one differs.
program check_solution_rows
   use kschur_error, only: error_type
   use kschur_joint_ranges, only: joint_ranges, joint_ranges_type
   use kschur_kinds, only: wp
   use kschur_processes, only: join_processes, processes_type
   use kschur_solution_rows, only: solution_rows_type
   use mpi_f08, only: MPI_Allreduce, MPI_COMM_WORLD, MPI_Finalize, MPI_Init, MPI_INTEGER, MPI_SUM
   implicit none
   integer, parameter :: extents(2, 4) = reshape([1, 0, 2, 5, 40, 0, 57, 13], [2, 4]), vectors(3) = [1, 3, 6]
   type(processes_type), target :: processes
   type(error_type), allocatable :: error
   integer, allocatable :: communicator
   integer :: failed, of_all, i, j

   call MPI_Init()
   failed = 0
   communicator = MPI_COMM_WORLD%mpi_val
   call join_processes(communicator, 1, processes, error)
   call expect(.not. allocated(error))
   do i = 1, size(extents, 2)
      call check_ranges(extents(1, i), extents(2, i))
      do j = 1, size(vectors)
         call check(extents(1, i), extents(2, i), vectors(j))
      end do
   end do
   call MPI_Allreduce(failed, of_all, 1, MPI_INTEGER, MPI_SUM, MPI_COMM_WORLD)
   call MPI_Finalize()
   if (of_all > 0) error stop "rows differ"
   if (processes%rank == 0) print "(a)", "all rows are at home"

contains

   ! Each row is somewhere, once.
   subroutine check_ranges(n, m)
      integer, intent(in) :: n, m
      type(joint_ranges_type) :: ranges
      integer, allocatable :: list(:)
      integer :: found(n + m), p, k

      ranges = joint_ranges(n, m, processes%number)
      found = 0
      do p = 0, processes%number - 1
         if (allocated(list)) deallocate (list)
         allocate (list, source=ranges%row_numbers(p))
         call expect(size(list) == ranges%rows(p))
         do k = 1, size(list)
            found(list(k)) = found(list(k)) + 1
            call expect(ranges%owner(list(k)) == p .and. ranges%place(list(k)) == k)
         end do
      end do
      call expect(all(found == 1))
   end subroutine check_ranges

   subroutine check(n, m, k)
      integer, intent(in) :: n, m, k
      type(solution_rows_type) :: rows
      type(processes_type), pointer :: all
      real(wp) :: x(n + m, k), back(merge(n + m, 0, processes%rank == 0), k)
      complex(wp) :: u(n + m, k)
      real(wp), allocatable :: part(:, :)
      complex(wp), allocatable :: complex_part(:, :)
      integer, allocatable :: pivots(:)
      integer :: stride, i, j

      do j = 1, k
         x(:, j) = [(i + 100.0_wp*j, i=1, n + m)]
      end do
      u = cmplx(x, -2*x, wp)
      all => processes
      call rows%begin(n, m, all)
      allocate (part(rows%rows(), k), complex_part(rows%rows(), k))
      do stride = 1, 7, 3
         ! In no order, and none in the last process where there are several.
         if (allocated(pivots)) deallocate (pivots)
         allocate (pivots, source=[(1 + mod(i*11*stride, 997), i=1, 997)])
         pivots = pack(pivots, pivots <= n + m .and. mod(pivots, max(processes%number - 1, 1)) == processes%rank)
         part = -1
         call rows%redistribute(pivots, x(pivots, :), part)
         call expect(.not. any(abs(part - x(rows%row_numbers(), :)) > 0))
         complex_part = -1
         call rows%redistribute(pivots, u(pivots, :), complex_part)
         call expect(.not. any(abs(complex_part - u(rows%row_numbers(), :)) > 0))
      end do
      back = x(:size(back, 1), :)
      part = -1
      call rows%scatter(back, part)
      call expect(.not. any(abs(part - x(rows%row_numbers(), :)) > 0))
      back = -1
      call rows%gather(part, back)
      if (processes%rank == 0) call expect(.not. any(abs(back - x) > 0))
   end subroutine check

   subroutine expect(condition)
      logical, intent(in) :: condition

      if (.not. condition) failed = failed + 1
   end subroutine expect
end program check_solution_rows
