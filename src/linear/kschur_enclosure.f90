!> Perturbation of the pivots of LDL^T by a bound of the rounding errors, or to a least size.
module kschur_enclosure
   use kschur_kinds, only: wp
   implicit none
   private
   public :: enclosure_type

   !> Perturbation of pivots: downwards or upwards by a bound of the rounding errors (theory in kschur_proved_inertia), or to a
   !> least size.
   type :: enclosure_type
      !> -1 downwards, 1 upwards, 0 not at all, as for complex pivots.
      integer :: side = 0
      !> Dimensions of the panel.
      integer :: rows = 0, columns = 0
      !> Of each row of the diagonal block, the sum of (e_p + sqrt(e_p)) |d_p| l_kp^2 over the columns done; of all
      !> columns before it, the number of entries.
      real(wp), allocatable :: sum(:), terms(:)
      !> Bound of errors by underflow.
      real(wp) :: underflow = 0
      !> Least size of a pivot; smaller ones are replaced by it.
      real(wp) :: least = 0
   contains
      !> (e + sqrt(e)) |d| of column k, |d| the size of its pivot, e entries below it.
      procedure :: weight
      !> How far pivot k is moved: by the bound S_k of kschur_proved_inertia.
      procedure :: offset
      !> Adds the terms of column k of L to the sums of S in the rows below pivot k.
      procedure :: add_column
   end type enclosure_type

contains

   pure real(wp) function weight(self, k, pivot)
      class(enclosure_type), intent(in) :: self
      integer, intent(in) :: k
      !> |d|
      real(wp), intent(in) :: pivot

      weight = (self%rows - k + sqrt(real(self%rows - k, wp)))*pivot
   end function weight

   pure real(wp) function offset(self, k, pivot)
      class(enclosure_type), intent(in) :: self
      integer, intent(in) :: k
      !> |d|
      real(wp), intent(in) :: pivot
      real(wp), parameter :: unit = epsilon(1.0_wp)/2
      ! Allows for second-order terms and for rounding of the bound.
      real(wp), parameter :: caution = 1.01_wp
      real(wp) :: rounding

      rounding = self%sum(k) + (1 + sqrt(real(self%rows - k, wp)))*pivot
      offset = self%side*(caution*unit*(self%terms(k) + 4)*rounding + self%underflow)
   end function offset

   pure subroutine add_column(self, k, pivot, column)
      class(enclosure_type), intent(inout) :: self
      integer, intent(in) :: k
      !> |d|, and the entries or their sizes.
      real(wp), intent(in) :: pivot, column(:)

      self%sum(k + 1:k + size(column)) = self%sum(k + 1:k + size(column)) + self%weight(k, pivot)*column**2
   end subroutine add_column
end module kschur_enclosure
