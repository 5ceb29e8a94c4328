!> Criteria that select the wanted Ritz values.
module kschur_selection
   use kschur_kinds, only: wp
   use kschur_sorting, only: ascending_order
   use kschur_tolerances, only: negligible_change
   implicit none
   private
   public :: directions_around, selection_type, named_selection_type, order_by_preference

   !> Nearest to `target` first.
   integer, parameter, public :: nearest_target = 1
   integer, parameter, public :: largest_magnitude = 2
   integer, parameter, public :: smallest_magnitude = 3
   integer, parameter, public :: largest_real = 4
   integer, parameter, public :: smallest_real = 5
   integer, parameter, public :: largest_imaginary = 6
   integer, parameter, public :: smallest_imaginary = 7

   !> A selection criterion; extend it for your own.
   type, abstract :: selection_type
      !> Number of wanted values.
      integer :: wanted = 1
   contains
      !> Sort key of a value: smallest is most wanted.
      procedure(key_interface), deferred :: key
      !> Number of leading values, sorted by preference, that contain all wanted ones; larger than their number if they do not
      !> suffice.
      procedure :: needed
      !> The border of the region in which values are more wanted than `last`.
      procedure :: find_border
      !> Whether a cluster of values about `last` is too large for any of them to converge; .false. by default.
      procedure :: crowds
   end type selection_type

   abstract interface
      real(wp) function key_interface(self, value)
         import :: selection_type, wp
         class(selection_type), intent(in) :: self
         complex(wp), intent(in) :: value
      end function key_interface
   end interface

   !> One of the usual criteria, on the eigenvalues of the operator.
   type, extends(selection_type) :: named_selection_type
      !> One of the constants above.
      integer :: criterion = largest_magnitude
      complex(wp) :: target = (0.0_wp, 0.0_wp)
   contains
      procedure :: key => named_key
      procedure :: find_border => find_named_border
   end type named_selection_type

contains

   integer function needed(self, values)
      class(selection_type), intent(in) :: self
      complex(wp), intent(in) :: values(:)

      needed = self%wanted + 0*size(values)
   end function needed

   subroutine find_border(self, last, values, border)
      class(selection_type), intent(in) :: self
      complex(wp), intent(in) :: last
      !> None of them lies inside.
      complex(wp), intent(in) :: values(:)
      !> Points on it, of which some are the nearest to the values. Not allocated if it is not known, or inside are small values
      !> that no iteration finds.
      complex(wp), allocatable, intent(out) :: border(:)

      associate (unused_self => self, unused_last => last, unused_values => values)
      end associate
   end subroutine find_border

   logical function crowds(self, values, last)
      class(selection_type), intent(in) :: self
      complex(wp), intent(in) :: values(:), last

      crowds = self%wanted < 0 .and. any(abs(values - last) < 0)
   end function crowds

   subroutine find_named_border(self, last, values, border)
      class(named_selection_type), intent(in) :: self
      complex(wp), intent(in) :: last, values(:)
      complex(wp), allocatable, intent(out) :: border(:)
      integer :: i

      if (self%criterion /= largest_magnitude) return
      border = (1 + negligible_change)*abs(last)*[directions_around(), (values(i)/max(abs(values(i)), tiny(1.0_wp)), i=1, &
         size(values))]
   end subroutine find_named_border

   !> Unit vectors in sixteen directions.
   function directions_around() result(directions)
      integer, parameter :: points = 16
      complex(wp) :: directions(points)
      real(wp), parameter :: turn = 8*atan(1.0_wp)/points
      integer :: i

      directions = [(exp(cmplx(0, i*turn, wp)), i=1, points)]
   end function directions_around

   real(wp) function named_key(self, value) result(key)
      class(named_selection_type), intent(in) :: self
      complex(wp), intent(in) :: value

      select case (self%criterion)
      case (nearest_target)
         key = abs(value - self%target)
      case (smallest_magnitude)
         key = abs(value)
      case (largest_real)
         key = -real(value, wp)
      case (smallest_real)
         key = real(value, wp)
      case (largest_imaginary)
         key = -aimag(value)
      case (smallest_imaginary)
         key = aimag(value)
      case default
         key = -abs(value)
      end select
   end function named_key

   !> Returns the permutation that sorts `values` by preference, most wanted first; stable.
   function order_by_preference(selection, values) result(order)
      class(selection_type), intent(in) :: selection
      complex(wp), intent(in) :: values(:)
      integer :: order(size(values))
      integer :: i

      order = ascending_order([(selection%key(values(i)), i=1, size(values))])
   end function order_by_preference
end module kschur_selection
