!> How large a part of its start vector a Krylov process can have missed.
!>
!> After any number of steps and restarts p(C) q = gamma r with the random start vector q, the unit residual vector r, and a
!> polynomial p with leading coefficient one: its roots are the Ritz values, those that restarts have purged or locked, and a zero
!> for each application of the filter, and gamma is the product of all norms before normalisation (Sorensen, SIAM J. Matrix Anal.
!> Appl. 13 (1992)). For a unit left eigenvector psi of an eigenvalue mu that gives |psi^* q| = gamma |psi^* r|/|p(mu)| <=
!> gamma/|p(mu)|: a value far from all roots can be missing only if q has hardly any part along its vector. On a region without
!> roots, gamma/|p| is largest on the border.
module kschur_unseen_part
   use kschur_archive, only: archive_type
   use kschur_kinds, only: wp
   implicit none
   private
   public :: krylov_polynomial_type

   !> gamma, and the roots of p but for the present Ritz values.
   type :: krylov_polynomial_type
      real(wp), private :: log_gamma = 0
      complex(wp), allocatable :: roots(:)
   contains
      procedure :: begin
      procedure :: add_norm
      procedure :: add_roots
      procedure :: bound
      procedure :: carry
   end type krylov_polynomial_type

contains

   !> Begins a process with a unit vector.
   subroutine begin(self)
      class(krylov_polynomial_type), intent(inout) :: self

      self%log_gamma = 0
      self%roots = [complex(wp) ::]
   end subroutine begin

   !> Takes the norm of a new vector before its normalisation.
   subroutine add_norm(self, norm)
      class(krylov_polynomial_type), intent(inout) :: self
      real(wp), intent(in) :: norm

      self%log_gamma = self%log_gamma + log(max(norm, tiny(1.0_wp)))
   end subroutine add_norm

   !> Takes roots that will be no Ritz values.
   subroutine add_roots(self, roots)
      class(krylov_polynomial_type), intent(inout) :: self
      complex(wp), intent(in) :: roots(:)

      self%roots = [self%roots, roots]
   end subroutine add_roots

   !> The largest part of the start vector along a left eigenvector of an eigenvalue at a point.
   real(wp) function bound(self, ritz_values, point)
      class(krylov_polynomial_type), intent(in) :: self
      complex(wp), intent(in) :: ritz_values(:), point

      bound = exp(self%log_gamma - sum(log(max(abs(point - self%roots), tiny(1.0_wp)))) - &
         sum(log(max(abs(point - ritz_values), tiny(1.0_wp)))))
   end function bound

   !> Writes to a checkpoint, or reads.
   subroutine carry(self, archive)
      class(krylov_polynomial_type), intent(inout) :: self
      type(archive_type), intent(inout) :: archive

      call archive%carry(self%log_gamma)
      call archive%carry(self%roots)
   end subroutine carry
end module kschur_unseen_part
