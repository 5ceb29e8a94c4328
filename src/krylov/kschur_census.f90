!> Interface by which an iteration asks for an independent count of eigenvalues, to prove that no wanted one is missing.
module kschur_census
   use kschur_archive, only: archive_type
   use kschur_kinds, only: wp
   use kschur_random_start, only: random_start_type
   implicit none
   private
   public :: census_type

   !> Abstract type; extend it by a method that counts eigenvalues.
   type, abstract :: census_type
   contains
      !> Called when all wanted eigenvalues seem to have converged.
      procedure(examine_interface), deferred :: examine
      !> Writes its state to a checkpoint, or reads it.
      procedure(carry_interface), deferred :: carry
   end type census_type

   abstract interface
      subroutine examine_interface(self, values, residuals, wanted, complete, seen)
         import :: census_type, random_start_type, wp
         class(census_type), intent(inout) :: self
         !> Ritz values, most wanted first; not all of them need have converged.
         real(wp), intent(in) :: values(:)
         !> Relative residual of each.
         real(wp), intent(in) :: residuals(:)
         !> Number of wanted values, which come first and have converged.
         integer, intent(in) :: wanted
         !> Whether it is certain that no wanted one is missing.
         logical, intent(out) :: complete
         !> What the iteration tells of its random start vectors; absent or without values: nothing.
         type(random_start_type), optional, intent(in) :: seen
      end subroutine examine_interface

      subroutine carry_interface(self, archive)
         import :: archive_type, census_type
         class(census_type), intent(inout) :: self
         type(archive_type), intent(inout) :: archive
      end subroutine carry_interface
   end interface
end module kschur_census
