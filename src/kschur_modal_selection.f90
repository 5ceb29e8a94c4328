!> The modes nearest to a target, as a criterion on Ritz values of a
!> shift-invert operator.
module kschur_modal_selection
   use kschur_kinds, only: wp
   use kschur_modes, only: real_tolerance, same_value
   use kschur_pencil, only: pencil_type
   use kschur_selection, only: selection_type
   implicit none
   private
   public :: modal_selection_type

   !> Wants `wanted` modes, a complex-conjugate pair being one.
   type, extends(selection_type) :: modal_selection_type
      type(pencil_type), pointer :: pencil => null()
      !> The shift, as a theta of the pencil.
      complex(wp) :: shift = (0.0_wp, 0.0_wp)
      !> The target, as a lambda (1/s).
      complex(wp) :: target = (0.0_wp, 0.0_wp)
   contains
      procedure :: key
      procedure :: needed
      procedure, private :: lambda_of
   end type modal_selection_type

contains

   pure complex(wp) function lambda_of(self, mu)
      class(modal_selection_type), intent(in) :: self
      complex(wp), intent(in) :: mu

      lambda_of = huge(1.0_wp)
      if (abs(mu) > tiny(1.0_wp)) lambda_of = self%pencil%lambda(self%shift + 1/mu)
   end function lambda_of

   !> Distance from the target; of an undamped pair +-lambda, that of the nearer one.
   real(wp) function key(self, value)
      class(modal_selection_type), intent(in) :: self
      complex(wp), intent(in) :: value
      complex(wp) :: lambda

      lambda = self%lambda_of(value)
      key = abs(lambda - self%target)
      if (.not. self%pencil%is_damped()) key = min(key, abs(lambda + self%target))
   end function key

   !> Counts the values until they hold enough modes: one that is the
   !> conjugate of an earlier one completes a pair and adds none.
   integer function needed(self, values)
      class(modal_selection_type), intent(in) :: self
      complex(wp), intent(in) :: values(:)
      complex(wp) :: lambda(size(values))
      logical :: single(size(values))
      integer :: modes, i, j

      modes = 0
      do needed = 1, size(values)
         i = needed
         lambda(i) = self%lambda_of(values(i))
         single(i) = abs(aimag(lambda(i))) > real_tolerance*abs(lambda(i)) .and. self%pencil%is_damped()
         modes = modes + 1
         if (single(i)) then
            do j = i - 1, 1, -1
               if (.not. single(j)) cycle
               if (abs(lambda(j) - conjg(lambda(i))) > same_value*abs(lambda(i))) cycle
               single([i, j]) = .false.
               modes = modes - 1
               exit
            end do
         end if
         if (modes >= self%wanted) return
      end do
      needed = size(values) + self%wanted - modes
   end function needed
end module kschur_modal_selection
