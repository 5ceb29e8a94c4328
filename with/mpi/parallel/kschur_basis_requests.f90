!> Integers in requests on a distributed basis, after its number: kind of scalar, and operation.
module kschur_basis_requests
   implicit none
   private

   !> Kind of scalar.
   integer, parameter, public :: real_basis = 1, complex_basis = 2
   !> Operation: the procedures of `basis_rows_type`.
   integer, parameter, public :: to_reserve = 1, to_read = 2, to_store = 3, to_orthonormalize = 4, to_orthogonalize = 5, &
      to_complete = 6, to_form = 7, to_take_out = 8, to_subtract = 9, to_combine = 10, to_choose = 11, to_rotate = 12, &
      to_move = 13, to_release = 14
end module kschur_basis_requests
