!> Processes that do the same, each with its rows of vectors. In this build there is one, which has them all; `with/mpi` has the
!> module for several.
module kschur_row_team
   use kschur_archive, only: archive_type
   use kschur_kinds, only: wp, long
   use kschur_random, only: random_vector
   use kschur_row_sums, only: row_sums_type
   implicit none
   private
   public :: row_team_type

   !> Who they are.
   type :: row_team_type
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
      !> To or from a checkpoint, which has vectors whole.
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

   subroutine call_all(self, words)
      class(row_team_type), intent(in) :: self
      !> What they do, and its arguments.
      integer, intent(in) :: words(:)

      associate (unused => self, also => words)
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
      !> As in `random_vector`, the same in all processes.
      integer(long), intent(inout) :: state
      real(wp), intent(out) :: x(:)

      associate (unused => self)
      end associate
      call random_vector(state, x)
   end subroutine draw

   subroutine carry_real(self, archive, length, part)
      class(row_team_type), intent(in) :: self
      type(archive_type), intent(inout) :: archive
      !> Of the vectors.
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
