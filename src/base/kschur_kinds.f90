!> Working precision and the integer kind of sizes.
module kschur_kinds
   use, intrinsic :: iso_fortran_env, only: int64, real32, real64
   implicit none
   private

   !> Working precision: every matrix, vector and result is in this kind.
   integer, parameter, public :: wp = real64
   !> More than the working precision, for sums that cancel: 64 bits on x86, elsewhere more.
   integer, parameter, public :: xp = selected_real_kind(18)
   !> Half the working precision: what preconditioners are stored in.
   integer, parameter, public :: single = real32
   !> Kind of sizes that can outgrow a default integer, as bytes or file offsets.
   integer, parameter, public :: long = int64
end module kschur_kinds
