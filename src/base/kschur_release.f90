!> Which release of the library this is.
module kschur_release
   implicit none
   private

   !> Semantic version, here and nowhere else in the sources; the same as in fpm.toml.
   character(len=*), parameter, public :: kschur_version = "0.2.0"
end module kschur_release
