!> Results that a file of a sweep keeps.
module kschur_kept_result
   use kschur_result, only: modal_result_type
   implicit none
   private
   public :: kept_result_type

   !> The result of a point of a sweep. Not associated: it is not kept.
   type :: kept_result_type
      type(modal_result_type), pointer :: result => null()
   end type kept_result_type
end module kschur_kept_result
