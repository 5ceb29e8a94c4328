!> Stiffness levels of unknowns that have no stiffness themselves but are coupled to others by constraints.
module kschur_tied_levels
   use kschur_kinds, only: wp
   use kschur_sparse, only: csr_matrix_type
   implicit none
   private
   public :: spread_levels

contains

   !> Passes stiffness levels along constraints to unknowns without one, as those of a rigid body: such an unknown gets the level
   !> of the softest unknown that a constraint couples it to, in its own units; with several constraints the largest of these.
   pure subroutine spread_levels(constraints, level)
      !> m x n
      type(csr_matrix_type), intent(in) :: constraints
      !> n numbers, zero if unknown: on return only for unknowns that no constraint connects to a known one.
      real(wp), intent(inout) :: level(:)
      ! Longest chain of constraints to an unknown with stiffness.
      integer, parameter :: passes = 8
      real(wp) :: found(size(level)), softest
      integer :: pass, i, k

      do pass = 1, passes
         found = 0
         do i = 1, constraints%rows
            associate (first => constraints%row_start(i), last => constraints%row_start(i + 1) - 1)
               softest = huge(softest)
               do k = first, last
                  if (abs(constraints%value(k)) > 0 .and. level(constraints%column(k)) > 0) &
                     softest = min(softest, level(constraints%column(k))/constraints%value(k)**2)
               end do
               if (.not. softest < huge(softest)) cycle
               do k = first, last
                  associate (j => constraints%column(k))
                     if (.not. level(j) > 0) found(j) = max(found(j), softest*constraints%value(k)**2)
                  end associate
               end do
            end associate
         end do
         if (.not. any(found > 0)) exit
         where (found > 0) level = found
      end do
   end subroutine spread_levels
end module kschur_tied_levels
