!> The processes that work on distributed vectors, each with its rows. The first one sends a request; all then run the same code
!> and take the same decisions, as they see the same sums.
module kschur_row_team
   use kschur_archive, only: archive_type
   use kschur_kinds, only: wp, long
   use kschur_processes, only: processes_type, request_together, request_two_level
   use kschur_random, only: random_vector, skip_numbers
   use kschur_row_exchange, only: gather, scatter
   use kschur_row_ranges, only: row_ranges_type
   use kschur_row_sums, only: row_sums_type
   use mpi_f08, only: MPI_Bcast, MPI_DOUBLE_PRECISION
   implicit none
   private
   public :: row_team_type

   !> Requests of `carry` to other processes: call `give`, or `take`.
   integer, parameter, public :: to_give = 101, to_take = 102

   !> A group of processes.
   type :: row_team_type
      !> Not associated: one process.
      type(processes_type), pointer :: processes => null()
      type(row_ranges_type) :: ranges
      !> Number of the basis they work on.
      integer :: basis = 0
      !> Whether they work on a two-level basis, not on a block Lanczos decomposition.
      logical :: two_level = .false.
   contains
      !> Whether there is more than one process.
      procedure :: is_several
      !> Number of rows of this process, of vectors of a given length.
      procedure :: rows
      !> The object that adds up sums over rows.
      procedure :: sums
      !> Requests a collective operation from the other processes; called by the first one.
      procedure :: call_all
      !> Broadcasts numbers of the first process.
      procedure :: send
      !> Draws the local rows of a random vector that does not depend on the number of processes.
      procedure :: draw
      !> Writes whole vectors to a checkpoint, gathered in the first process, or reads and scatters them.
      generic :: carry => carry_real, carry_complex
      procedure, private :: carry_real, carry_complex
      !> Gathers local rows of vectors in the first process; collective.
      generic :: give => give_real, give_complex
      procedure, private :: give_real, give_complex
      !> Scatters vectors of the first process to local rows; collective.
      generic :: take => take_real, take_complex
      procedure, private :: take_real, take_complex
   end type row_team_type

contains

   pure logical function is_several(self)
      class(row_team_type), intent(in) :: self

      is_several = associated(self%processes)
   end function is_several

   pure integer function rows(self, length)
      class(row_team_type), intent(in) :: self
      integer, intent(in) :: length

      rows = length
      if (associated(self%processes)) rows = self%ranges%rows(self%processes%rank)
   end function rows

   function sums(self)
      class(row_team_type), intent(in) :: self
      type(row_sums_type) :: sums

      if (associated(self%processes)) sums%communicator = self%processes%communicator
   end function sums

   subroutine call_all(self, request)
      class(row_team_type), intent(in) :: self
      !> Code of the operation, and its arguments.
      integer, intent(in) :: request(:)

      if (associated(self%processes)) &
         call self%processes%send_request([merge(request_two_level, request_together, self%two_level), self%basis, request])
   end subroutine call_all

   subroutine send(self, numbers)
      class(row_team_type), intent(in) :: self
      real(wp), contiguous, intent(inout) :: numbers(:)

      if (associated(self%processes)) &
         call MPI_Bcast(numbers, size(numbers), MPI_DOUBLE_PRECISION, 0, self%processes%communicator)
   end subroutine send

   subroutine draw(self, state, x)
      class(row_team_type), intent(in) :: self
      !> As in `random_vector`, equal in all processes.
      integer(long), intent(inout) :: state
      real(wp), intent(out) :: x(:)

      if (.not. associated(self%processes)) then
         call random_vector(state, x)
         return
      end if
      associate (rank => self%processes%rank, ranges => self%ranges)
         call skip_numbers(state, ranges%before(rank))
         call random_vector(state, x)
         call skip_numbers(state, ranges%last(self%processes%number - 1) - ranges%last(rank))
      end associate
   end subroutine draw

#define SCALAR real(wp)
#define CARRY carry_real
#define GIVE give_real
#define TAKE take_real
#include "kschur_row_team.inc"

#define SCALAR complex(wp)
#define CARRY carry_complex
#define GIVE give_complex
#define TAKE take_complex
#include "kschur_row_team.inc"
end module kschur_row_team
