!> The processes that work on distributed vectors, each with its rows. This build has one process with all rows; `with/mpi` has
!> the module for several.
module kschur_row_team
   use kschur_archive, only: archive_type
   use kschur_kinds, only: wp, long
   use kschur_random, only: random_vector
   use kschur_row_sums, only: row_sums_type
   implicit none
   private
   public :: row_team_type

   !> A group of processes.
   type :: row_team_type
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
      !> Writes whole vectors to a checkpoint, or reads them.
      generic :: carry => carry_real, carry_complex
      procedure, private :: carry_real, carry_complex
   end type row_team_type

contains

   pure logical function is_several(self)
      class(row_team_type), intent(in) :: self

      associate (unused => self)
      end associate
      is_several = .false.
   end function is_several

   pure integer function rows(self, length)
      class(row_team_type), intent(in) :: self
      integer, intent(in) :: length

      associate (unused => self)
      end associate
      rows = length
   end function rows

   pure function sums(self)
      class(row_team_type), intent(in) :: self
      type(row_sums_type) :: sums

      associate (unused => self)
      end associate
      sums = row_sums_type()
   end function sums

   subroutine call_all(self, request)
      class(row_team_type), intent(in) :: self
      !> Code of the operation, and its arguments.
      integer, intent(in) :: request(:)

      associate (unused => self, also => request)
      end associate
   end subroutine call_all

   subroutine send(self, numbers)
      class(row_team_type), intent(in) :: self
      real(wp), intent(inout) :: numbers(:)

      associate (unused => self, unchanged => numbers)
      end associate
   end subroutine send

   subroutine draw(self, state, x)
      class(row_team_type), intent(in) :: self
      !> As in `random_vector`, equal in all processes.
      integer(long), intent(inout) :: state
      real(wp), intent(out) :: x(:)

      associate (unused => self)
      end associate
      call random_vector(state, x)
   end subroutine draw

   subroutine carry_real(self, archive, length, part)
      class(row_team_type), intent(in) :: self
      type(archive_type), intent(inout) :: archive
      !> Length of the vectors.
      integer, intent(in) :: length
      real(wp), allocatable, intent(inout) :: part(:, :)

      associate (unused => self, also => length)
      end associate
      call archive%carry(part)
   end subroutine carry_real

   subroutine carry_complex(self, archive, length, part)
      class(row_team_type), intent(in) :: self
      type(archive_type), intent(inout) :: archive
      integer, intent(in) :: length
      complex(wp), allocatable, intent(inout) :: part(:, :)

      associate (unused => self, also => length)
      end associate
      call archive%carry(part)
   end subroutine carry_complex
end module kschur_row_team
