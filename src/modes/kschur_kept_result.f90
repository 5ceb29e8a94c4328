!> Results that a file of a sweep keeps.
module kschur_kept_result
   use kschur_result, only: modal_result_type
   implicit none
   private
   public :: kept_result_type

   !> Points to the result of a point that the file keeps. Not associated: the file does not keep it.
   type :: kept_result_type
      type(modal_result_type), pointer :: result => null()
   end type kept_result_type
end module kschur_kept_result
