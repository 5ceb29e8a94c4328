!> What the other processes do of a two-level basis: the same as the first one with its first level, with their rows.
module kschur_two_level_help
   use kschur_basis_help, only: basis_instance_type
   use kschur_first_level_help_complex, only: help_complex => help_first_level
   use kschur_first_level_help_real, only: help_real => help_first_level
   use kschur_processes, only: number_of_words
   use kschur_quadratic_rows, only: quadratic_parts_type
   implicit none
   private
   public :: help_two_level

contains

   !> Does what the first process has called.
   subroutine help_two_level(instances, operators, words)
      !> The bases that there are.
      type(basis_instance_type), intent(inout) :: instances(:)
      !> On rows of states.
      type(quadratic_parts_type), intent(in) :: operators
      !> Number of the basis, what is done, and its arguments, after the first word.
      integer, intent(in) :: words(number_of_words)

      associate (basis => instances(findloc(instances%number, words(2), dim=1)))
         if (associated(basis%real)) then
            call help_real(operators%real, basis%real, basis%real_parts, words(3:))
         else
            call help_complex(operators%complex, basis%complex, basis%complex_parts, words(3:))
         end if
      end associate
   end subroutine help_two_level
end module kschur_two_level_help
