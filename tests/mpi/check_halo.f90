!> Products of a matrix that processes share by rows, against those of the whole matrix, which each of them has here, and that
!> matrix put together again: square and not, sparse and dense rows, processes without rows, real and complex, one vector and
!> several; and what is put away of M, R and K, and brought back. Ends with an error where one differs.
program check_halo
   use kschur_csr, only: csr_matrix_type
   use kschur_csr_assembly, only: new_csr_from_triplets
   use kschur_error, only: error_type
   use kschur_halo_matrix, only: halo_matrix_type, new_halo_matrix
   use kschur_kinds, only: wp, long
   use kschur_matrix_rows, only: gather_rows, share_rows
   use kschur_processes, only: join_processes, processes_type
   use kschur_random, only: random_vector
   use kschur_row_problem, only: all_three, mass_alone, row_problem_type, undamped
   use kschur_row_ranges, only: row_ranges, row_ranges_type
   use mpi_f08, only: MPI_Allreduce, MPI_Comm_rank, MPI_Comm_size, MPI_COMM_WORLD, MPI_Finalize, MPI_Init, MPI_INTEGER, &
      MPI_SUM
   ! Last: read before mpi_f08, it takes gfortran 15 the specific of MPI_Comm_size.
   use kschur_worker_loop, only: worker_loop
   implicit none
   integer, parameter :: extents(2, 5) = reshape([1, 1, 2, 3, 40, 40, 17, 60, 60, 17], [2, 5])
   integer, parameter :: vectors(3) = [1, 3, 6]
   integer :: processes, rank, failed, of_all, i, j

   call MPI_Init()
   call MPI_Comm_size(MPI_COMM_WORLD, processes)
   call MPI_Comm_rank(MPI_COMM_WORLD, rank)
   failed = 0
   do i = 1, size(extents, 2)
      do j = 1, size(vectors)
         call check(extents(1, i), extents(2, i), vectors(j))
      end do
   end do
   call check_put_away(23)
   call MPI_Allreduce(failed, of_all, 1, MPI_INTEGER, MPI_SUM, MPI_COMM_WORLD)
   call MPI_Finalize()
   if (of_all > 0) error stop "products differ"
   if (rank == 0) print "(a)", "all products agree"

contains

   subroutine check(rows, columns, k)
      integer, intent(in) :: rows, columns, k
      complex(wp), parameter :: alpha = (0.5_wp, -2.0_wp)
      real(wp) :: dense(rows, columns), x(columns, k), y_real(rows, k)
      complex(wp) :: y(rows, k), u(columns, k)
      type(row_ranges_type) :: of_rows, of_columns
      type(csr_matrix_type) :: whole, none, part, joined
      type(halo_matrix_type) :: matrix
      type(error_type), allocatable :: error
      real(wp), allocatable :: real_part(:, :)
      complex(wp), allocatable :: complex_part(:, :)

      call fill(dense, x, whole)
      u = cmplx(x, x(columns:1:-1, :), wp)
      y_real = -1.5_wp*matmul(dense, x)
      y = alpha*matmul(dense, u)
      of_rows = row_ranges(rows, processes)
      of_columns = row_ranges(columns, processes)
      if (rank == 0) then
         call share_rows(whole, of_rows, columns, MPI_COMM_WORLD, part, error)
      else
         call share_rows(none, of_rows, columns, MPI_COMM_WORLD, part, error)
      end if
      call expect(.not. allocated(error))
      call new_halo_matrix(matrix, part, of_columns, MPI_COMM_WORLD, error)
      call expect(.not. allocated(error))
      call matrix%join(joined)
      if (rank == 0) none%row_start = whole%row_start
      call gather_rows(none, of_rows, MPI_COMM_WORLD, joined, error)
      call expect(.not. allocated(error))
      if (rank == 0) call expect(size(none%column) == size(whole%column))
      if (rank == 0) call expect(all(none%column == whole%column) .and. all(abs(none%value - whole%value) <= 0))
      associate (first => of_rows%first(rank), last => of_rows%last(rank), left => of_columns%first(rank), &
         right => of_columns%last(rank))
         ! What is there before stays.
         real_part = 0*y_real(first:last, :) + 1
         call matrix%add_product(-1.5_wp, x(left:right, :), real_part)
         call expect(all(abs(real_part - 1 - y_real(first:last, :)) < 1.0e-13_wp*columns))
         complex_part = 0*y(first:last, :) + 1
         call matrix%add_product(alpha, u(left:right, :), complex_part)
         call expect(all(abs(complex_part - 1 - y(first:last, :)) < 1.0e-13_wp*columns))
      end associate
   end subroutine check

   ! R and K are put away, then all three; then M and K are back, then all.
   subroutine check_put_away(order)
      integer, intent(in) :: order
      type(processes_type), target :: processes_of_all
      type(processes_type), pointer :: several
      type(row_problem_type), allocatable :: problem
      type(csr_matrix_type), target :: matrices(3), given(3)
      type(error_type), allocatable :: error
      integer, allocatable :: communicator
      real(wp) :: dense(order, order), x(order, 1), y(order, 1)
      logical :: alone
      integer :: l

      communicator = MPI_COMM_WORLD%mpi_val
      call join_processes(communicator, 1, processes_of_all, error)
      call expect(.not. allocated(error))
      several => processes_of_all
      if (rank > 0) then
         call worker_loop(processes_of_all)
      else
         call fill(dense, x, given(1))
         do l = 1, 3
            given(l) = given(1)
            given(l)%value = l*given(1)%value
            matrices(l) = given(l)
         end do
         alone = processes == 1
         allocate (problem)
         call problem%share(matrices(1), matrices(2), matrices(3), several, error)
         call expect(.not. allocated(error))
         call problem%put_away(.not. mass_alone)
         call expect(all([(is_whole(matrices(l), given(l)), l=1, 3)] .eqv. (mass_alone .or. alone)))
         call problem%put_away(all_three)
         call expect(all([(is_whole(matrices(l), given(l)), l=1, 3)] .eqv. alone))
         y = 0
         call problem%damping%add_product(1.0_wp, x, y, error)
         call expect(all(abs(y - 2*matmul(dense, x)) < 1.0e-13_wp*order))
         call problem%bring_back(undamped, error)
         call expect(.not. allocated(error))
         call expect(all([(is_whole(matrices(l), given(l)), l=1, 3)] .eqv. (undamped .or. alone)))
         call problem%bring_back(all_three, error)
         call expect(.not. allocated(error))
         call expect(all([(is_whole(matrices(l), given(l)), l=1, 3)]))
         deallocate (problem)
      end if
      call processes_of_all%leave(error)
   end subroutine check_put_away

   pure logical function is_whole(matrix, given)
      type(csr_matrix_type), intent(in) :: matrix, given

      is_whole = size(matrix%value) == size(given%value)
      if (is_whole) is_whole = all(matrix%column == given%column) .and. all(abs(matrix%value - given%value) <= 0)
   end function is_whole

   ! A third of the entries, one row full and one empty where there are so many; the same in each process.
   subroutine fill(dense, x, whole)
      real(wp), intent(out) :: dense(:, :), x(:, :)
      type(csr_matrix_type), intent(out) :: whole
      type(error_type), allocatable :: error
      real(wp) :: random(size(dense))
      integer(long) :: state
      integer :: l, m

      state = 12345
      do l = 1, size(x, 2)
         call random_vector(state, x(:, l))
      end do
      call random_vector(state, random)
      dense = reshape(random, shape(dense))
      if (size(dense) > 1) where (abs(dense) < 0.66_wp) dense = 0
      call random_vector(state, dense(1, :))
      if (size(dense, 1) > 5) dense(5, :) = 0
      call new_csr_from_triplets(whole, size(dense, 1), size(dense, 2), &
         pack(spread([(l, l=1, size(dense, 1))], 2, size(dense, 2)), abs(dense) > 0), &
         pack(spread([(m, m=1, size(dense, 2))], 1, size(dense, 1)), abs(dense) > 0), pack(dense, abs(dense) > 0), error)
      call expect(.not. allocated(error))
   end subroutine fill

   subroutine expect(condition)
      logical, intent(in) :: condition

      if (.not. condition) failed = failed + 1
   end subroutine expect
end program check_halo
