!> Processes that do the same, each with its rows of vectors. The first one calls the others, and from there to the end of what
!> they do all of them go the same way, as they see the same sums.
module kschur_row_team
   use kschur_archive, only: archive_type
   use kschur_kinds, only: wp, long
   use kschur_processes, only: processes_type, word_together, word_two_level
   use kschur_random, only: random_vector, skip_numbers
   use kschur_row_exchange, only: gather, scatter
   use kschur_row_ranges, only: row_ranges_type
   use kschur_row_sums, only: row_sums_type
   use mpi_f08, only: MPI_Bcast, MPI_DOUBLE_PRECISION
   implicit none
   private
   public :: row_team_type

   !> What the others do of `carry`.
   integer, parameter, public :: to_give = 101, to_take = 102

   !> Who they are.
   type :: row_team_type
      !> Not associated: this process alone.
      type(processes_type), pointer :: processes => null()
      type(row_ranges_type) :: ranges
      !> The number of the basis that they work on.
      integer :: basis = 0
      !> Whether it is a two-level basis that they work on, and not a block Lanczos decomposition.
      logical :: two_level = .false.
   contains
      !> Whether there are several.
      procedure :: is_several
      !> How many rows of vectors of a length this process has.
      procedure :: rows
      !> Sums over rows.
      procedure :: sums
      !> The first process calls the others, to do something together.
      procedure :: call_all
      !> All get the numbers of the first process.
      procedure :: send
      !> Rows of a random vector, the same however many processes have them.
      procedure :: draw
      !> To or from a checkpoint, which has vectors whole: they go from all to the first process, and back.
      generic :: carry => carry_real, carry_complex
      procedure, private :: carry_real, carry_complex
      generic :: give => give_real, give_complex
      procedure, private :: give_real, give_complex
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

   subroutine call_all(self, words)
      class(row_team_type), intent(in) :: self
      !> What they do, and its arguments.
      integer, intent(in) :: words(:)

      if (associated(self%processes)) &
         call self%processes%tell([merge(word_two_level, word_together, self%two_level), self%basis, words])
   end subroutine call_all

   subroutine send(self, numbers)
      class(row_team_type), intent(in) :: self
      real(wp), contiguous, intent(inout) :: numbers(:)

      if (associated(self%processes)) &
         call MPI_Bcast(numbers, size(numbers), MPI_DOUBLE_PRECISION, 0, self%processes%communicator)
   end subroutine send

   subroutine draw(self, state, x)
      class(row_team_type), intent(in) :: self
      !> As in `random_vector`, the same in all processes.
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
