!> How an iteration learns that it has found all there is.
module kschur_census
   use kschur_archive, only: archive_type
   use kschur_kinds, only: wp
   implicit none
   private
   public :: census_type

   !> Extend it with a way to count eigenvalues.
   type, abstract :: census_type
   contains
      !> Called when all that is wanted seems to be found.
      procedure(examine_interface), deferred :: examine
      !> What it knows, to or from a checkpoint.
      procedure(carry_interface), deferred :: carry
   end type census_type

   abstract interface
      subroutine examine_interface(self, values, residuals, wanted, complete)
         import :: census_type, wp
         class(census_type), intent(inout) :: self
         !> Ritz values, most wanted first; not all of them need have converged.
         real(wp), intent(in) :: values(:)
         !> Relative residual of each.
         real(wp), intent(in) :: residuals(:)
         !> The first so many are wanted, and have converged.
         integer, intent(in) :: wanted
         !> Whether it is certain that no wanted one is missing.
         logical, intent(out) :: complete
      end subroutine examine_interface

      subroutine carry_interface(self, archive)
         import :: archive_type, census_type
         class(census_type), intent(inout) :: self
         type(archive_type), intent(inout) :: archive
      end subroutine carry_interface
   end interface
end module kschur_census
