!> Distribution of right-hand sides and solutions by rows: a range of unknowns and of multipliers in each process. Solutions are
!> computed in the processes of their pivots, and sent to those of their rows.
module kschur_solution_rows
   use kschur_error, only: error_type
   use kschur_joint_ranges, only: joint_ranges, joint_ranges_type
   use kschur_kinds, only: wp
   use kschur_processes, only: processes_type, spread_error
   use kschur_row_exchange, only: exchange_gather => gather, exchange_scatter => scatter
   use mpi_f08, only: MPI_Allreduce, MPI_Alltoall, MPI_Alltoallv, MPI_DOUBLE_COMPLEX, MPI_DOUBLE_PRECISION, MPI_INTEGER, &
      MPI_LOGICAL, MPI_LOR
   implicit none
   private
   public :: solution_rows_type

   !> The distribution. Calls are collective unless marked as local.
   type :: solution_rows_type
      private
      type(processes_type), pointer :: processes => null()
      type(joint_ranges_type) :: ranges
      ! Rows of the last solution, their order in messages, and number sent to each process.
      integer, allocatable :: row(:), order(:), sent(:)
      ! Number received from each process, and positions.
      integer, allocatable :: received(:), place(:)
      !> The pivots never move: the plan is made once.
      logical, public :: is_fixed = .false.
   contains
      procedure :: begin
      !> All rows in the first process.
      procedure :: begin_whole
      !> Number of local rows, and their indices; local.
      procedure :: rows
      procedure :: row_numbers
      !> Fails in all processes if one failed.
      procedure :: agree
      !> Moves solutions from the processes of their pivots to those of their rows.
      generic :: redistribute => redistribute_real, redistribute_complex
      procedure, private :: redistribute_real, redistribute_complex
      !> Moves right-hand sides from the processes of their rows to those of their pivots.
      procedure :: collect
      !> Scatters whole vectors of the first process, and gathers them.
      generic :: scatter => scatter_real, scatter_complex
      procedure, private :: scatter_real, scatter_complex
      generic :: gather => gather_real, gather_complex
      procedure, private :: gather_real, gather_complex
      procedure, private :: plan_exchange
   end type solution_rows_type

contains

   subroutine begin(self, unknowns, multipliers, processes)
      class(solution_rows_type), intent(inout) :: self
      !> Rows of a vector: unknowns first, then multipliers.
      integer, intent(in) :: unknowns, multipliers
      type(processes_type), pointer, intent(in) :: processes

      self%processes => processes
      self%ranges = joint_ranges(unknowns, multipliers, processes%number)
   end subroutine begin

   subroutine begin_whole(self, unknowns, processes)
      class(solution_rows_type), intent(inout) :: self
      integer, intent(in) :: unknowns
      type(processes_type), pointer, intent(in) :: processes

      self%processes => processes
      self%ranges = joint_ranges(unknowns, 0, processes%number)
      self%ranges%unknowns%before(1:) = unknowns
   end subroutine begin_whole

   pure integer function rows(self)
      class(solution_rows_type), intent(in) :: self

      rows = self%ranges%rows(self%processes%rank)
   end function rows

   pure function row_numbers(self)
      class(solution_rows_type), intent(in) :: self
      integer :: row_numbers(self%rows())

      row_numbers = self%ranges%row_numbers(self%processes%rank)
   end function row_numbers

   subroutine agree(self, error)
      class(solution_rows_type), intent(in) :: self
      type(error_type), allocatable, intent(inout) :: error

      call spread_error(self%processes%communicator, error)
   end subroutine agree

   ! Plans the messages that move solutions from the processes of their pivots to those of their rows. Keeps the plan until the
   ! pivots move: with other factors, or the transpose.
   subroutine plan_exchange(self, row)
      class(solution_rows_type), intent(inout) :: self
      integer, intent(in) :: row(:)
      integer :: owner(size(row)), next(0:self%processes%number - 1), p, i
      integer, allocatable :: goes(:)
      logical :: is_new, is_new_somewhere

      is_new = .not. allocated(self%row)
      if (self%is_fixed .and. .not. is_new) return
      if (.not. is_new) is_new = size(self%row) /= size(row)
      if (.not. is_new) is_new = any(self%row /= row)
      associate (communicator => self%processes%communicator)
         call MPI_Allreduce(is_new, is_new_somewhere, 1, MPI_LOGICAL, MPI_LOR, communicator)
         if (.not. is_new_somewhere) return
         self%row = row
         owner = [(self%ranges%owner(row(i)), i=1, size(row))]
         self%sent = [(count(owner == p), p=0, self%processes%number - 1)]
         next = before(self%sent)
         self%order = row
         do i = 1, size(row)
            next(owner(i)) = next(owner(i)) + 1
            self%order(next(owner(i))) = i
         end do
         self%received = self%sent
         call MPI_Alltoall(self%sent, 1, MPI_INTEGER, self%received, 1, MPI_INTEGER, communicator)
         goes = [(self%ranges%place(row(self%order(i))), i=1, size(row))]
         if (allocated(self%place)) deallocate (self%place)
         allocate (self%place(sum(self%received)))
         call MPI_Alltoallv(goes, self%sent, before(self%sent), MPI_INTEGER, self%place, self%received, before(self%received), &
            MPI_INTEGER, communicator)
      end associate
   end subroutine plan_exchange

   subroutine collect(self, row, x, sides)
      class(solution_rows_type), intent(inout) :: self
      !> Indices of the rows of `sides`.
      integer, intent(in) :: row(:)
      !> The local rows.
      real(wp), intent(in) :: x(:, :)
      !> As many columns.
      real(wp), intent(out) :: sides(:, :)
      ! Packed by process.
      real(wp), allocatable :: going(:, :), coming(:, :)
      integer :: k

      call self%plan_exchange(row)
      k = size(x, 2)
      allocate (going(k, size(self%place)), coming(k, size(row)))
      going = transpose(x(self%place, :))
      call MPI_Alltoallv(going, k*self%received, k*before(self%received), MPI_DOUBLE_PRECISION, coming, k*self%sent, &
         k*before(self%sent), MPI_DOUBLE_PRECISION, self%processes%communicator)
      sides(self%order, :) = transpose(coming)
   end subroutine collect

   ! Exclusive prefix sums.
   pure function before(numbers)
      integer, intent(in) :: numbers(:)
      integer :: before(size(numbers))
      integer :: p

      before = [(sum(numbers(:p - 1)), p=1, size(numbers))]
   end function before

#define SCALAR real(wp)
#define MPI_SCALAR MPI_DOUBLE_PRECISION
#define REDISTRIBUTE redistribute_real
#define SCATTER scatter_real
#define GATHER gather_real
#include "kschur_solution_rows.inc"

#define SCALAR complex(wp)
#define MPI_SCALAR MPI_DOUBLE_COMPLEX
#define REDISTRIBUTE redistribute_complex
#define SCATTER scatter_complex
#define GATHER gather_complex
#include "kschur_solution_rows.inc"
end module kschur_solution_rows
