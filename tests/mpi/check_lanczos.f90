!> Block Lanczos of diagonal operators, of which each process has some rows, as of the vectors: eigenvalues that are known, double
!> ones too, after restarts, in blocks and not, with a metric and with vectors that are kept out. Ends with an error where one is
!> wrong.
module diagonal_operator
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_operator, only: symmetric_operator_type
   implicit none
   private
   public :: diagonal_type

   !> The whole in the first process, which has never a vector to apply it to but at the end, and rows in each.
   type, extends(symmetric_operator_type) :: diagonal_type
      real(wp), allocatable :: values(:), metric(:)
      type(diagonal_type), pointer :: part => null()
      integer :: applications = 0
   contains
      procedure :: order
      procedure :: apply
      procedure :: apply_metric
      procedure :: by_rows
   end type diagonal_type

contains

   integer function order(self)
      class(diagonal_type), intent(in) :: self

      order = size(self%values)
   end function order

   subroutine apply(self, x, y, error)
      class(diagonal_type), intent(inout) :: self
      real(wp), contiguous, intent(in) :: x(:, :)
      real(wp), contiguous, intent(out) :: y(:, :)
      type(error_type), allocatable, intent(out) :: error
      integer :: j

      do j = 1, size(x, 2)
         y(:, j) = self%values*x(:, j)
      end do
      self%applications = self%applications + size(x, 2)
   end subroutine apply

   subroutine apply_metric(self, x, y, error)
      class(diagonal_type), intent(inout) :: self
      real(wp), contiguous, intent(in) :: x(:, :)
      real(wp), contiguous, intent(out) :: y(:, :)
      type(error_type), allocatable, intent(out) :: error
      integer :: j

      do j = 1, size(x, 2)
         y(:, j) = self%metric*x(:, j)
      end do
   end subroutine apply_metric

   function by_rows(self) result(part)
      class(diagonal_type), target, intent(in) :: self
      class(symmetric_operator_type), pointer :: part

      nullify (part)
      if (associated(self%part)) part => self%part
   end function by_rows
end module diagonal_operator

program check_lanczos
   use diagonal_operator, only: diagonal_type
   use kschur_basis_worker, only: basis_instance_type, serve_basis
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_krylov_options, only: krylov_options_type, real_ritz_pairs_type
   use kschur_lanczos, only: lanczos, lanczos_state_type
   use kschur_processes, only: join_processes, request_length, processes_type, request_basis, request_end, request_together
   use kschur_row_ranges, only: row_ranges, row_ranges_type
   use kschur_selection, only: largest_magnitude, named_selection_type
   use kschur_together_worker, only: serve_lanczos
   use mpi_f08, only: MPI_COMM_WORLD, MPI_Finalize, MPI_Init
   implicit none
   integer, parameter :: orders(3) = [3, 60, 500], blocks(2) = [1, 4], kept_out(2) = [0, 2]
   type(processes_type), target :: processes
   type(error_type), allocatable :: error
   integer, allocatable :: communicator
   integer :: failed, i, j, k

   call MPI_Init()
   failed = 0
   communicator = MPI_COMM_WORLD%mpi_val
   call join_processes(communicator, 1, processes, error)
   call expect(.not. allocated(error))
   do i = 1, size(orders)
      do j = 1, size(blocks)
         do k = 1, size(kept_out)
            call check(orders(i), blocks(j), kept_out(k))
         end do
      end do
   end do
   call MPI_Finalize()
   if (failed > 0) error stop "eigenvalues are wrong"
   if (processes%rank == 0) print "(a)", "all eigenvalues are found"

contains

   subroutine check(n, block, out)
      !> Of the first unit vectors so many are kept out.
      integer, intent(in) :: n, block, out
      type(diagonal_type), target :: whole, part
      type(row_ranges_type) :: ranges
      real(wp), allocatable :: excluded(:, :)
      integer :: row

      ! 1, 1, 1/2, 1/2, 1/3, ...
      allocate (whole%values(n), whole%metric(n), excluded(n, out))
      whole%values = [(1.0_wp/((row + 1)/2), row=1, n)]
      whole%metric = [(1 + 0.5_wp*mod(row, 7), row=1, n)]
      excluded = 0
      do row = 1, min(out, n)
         excluded(row, row) = 1/sqrt(whole%metric(row))
      end do
      if (processes%number > 1) then
         ranges = row_ranges(n, processes%number)
         associate (first => ranges%first(processes%rank), last => ranges%last(processes%rank))
            allocate (part%values, source=whole%values(first:last))
            allocate (part%metric, source=whole%metric(first:last))
            excluded = reshape(excluded(first:last, :), [last - first + 1, out])
         end associate
         whole%part => part
      end if
      if (processes%rank == 0) then
         call lead(whole, block, excluded)
         call processes%send_request([request_end])
      else
         call follow(part, excluded)
      end if
   end subroutine check

   subroutine lead(operator, block, excluded)
      type(diagonal_type), intent(inout) :: operator
      integer, intent(in) :: block
      real(wp), intent(in) :: excluded(:, :)
      integer, parameter :: most = 8
      type(lanczos_state_type) :: state
      type(krylov_options_type) :: options
      type(named_selection_type) :: selection
      type(real_ritz_pairs_type) :: found
      real(wp), allocatable :: expected(:)
      integer :: out, j

      out = size(excluded, 2)
      allocate (expected, source=operator%values(out + 1:min(out + most, operator%order())))
      selection%wanted = size(expected)
      selection%criterion = largest_magnitude
      options%subspace = 16
      options%block = block
      options%filter = 1
      options%processes => processes
      state%decomposition%most = operator%order() - out
      if (out > 0) allocate (state%decomposition%excluded, source=excluded)
      call lanczos(operator, selection, options, state, found, error)
      call expect(.not. allocated(error))
      call expect(size(found%values) == size(expected))
      if (size(found%values) == size(expected)) call expect(all(abs(found%values - expected) < 1.0e-10_wp))
      do j = 1, size(found%values)
         associate (x => found%vectors(:, j))
            call expect(norm2((operator%values - found%values(j))*x) < 1.0e-8_wp)
            call expect(abs(sum(operator%metric*x**2) - 1) < 1.0e-10_wp)
         end associate
      end do
      ! Whole vectors are those of the result.
      if (processes%number > 1) call expect(operator%applications <= 2*size(found%values))
   end subroutine lead

   subroutine follow(part, excluded)
      type(diagonal_type), intent(inout) :: part
      real(wp), intent(in) :: excluded(:, :)
      type(basis_instance_type), allocatable :: bases(:)
      integer :: request(request_length)

      allocate (bases(0))
      do
         call processes%receive_request(request)
         if (request(1) == request_basis) call serve_basis(bases, processes, request)
         if (request(1) == request_together) call serve_lanczos(bases, part, excluded, request)
         if (request(1) == request_end) exit
      end do
   end subroutine follow

   subroutine expect(condition)
      logical, intent(in) :: condition

      if (.not. condition) failed = failed + 1
   end subroutine expect
end program check_lanczos
