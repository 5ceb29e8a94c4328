!> Options by name, for C: texts as on the command line, passed to the setters.
module kschur_capi_named_options
   use, intrinsic :: iso_c_binding, only: c_double, c_int, c_int64_t, c_ptr
   use kschur, only: error_type, new_error
   use kschur_capi_options, only: options_handle_type, options_of, kschur_options_set_arpack, kschur_options_set_block, &
      kschur_options_set_certify, kschur_options_set_checkpoint, kschur_options_set_constraint_scaling, &
      kschur_options_set_distribute, &
      kschur_options_set_formulation, kschur_options_set_groups, &
      kschur_options_set_inner, kschur_options_set_left, kschur_options_set_max_restarts, kschur_options_set_memory, &
      kschur_options_set_method, &
      kschur_options_set_modes, kschur_options_set_normalisation, kschur_options_set_presolve, kschur_options_set_resume, &
      kschur_options_set_seed, &
      kschur_options_set_shift, kschur_options_set_subspace, kschur_options_set_target, kschur_options_set_target_hz, &
      kschur_options_set_threads, kschur_options_set_tolerance
   use kschur_capi_status, only: outcome, require, status_null, status_usage
   use kschur_capi_text, only: take_text
   implicit none
   private

   abstract interface
      integer(c_int) function integer_setter(address, given) bind(c)
         import :: c_int, c_int64_t, c_ptr
         type(c_ptr), value :: address
         integer(c_int64_t), value :: given
      end function integer_setter

      integer(c_int) function flag_setter(address, given) bind(c)
         import :: c_int, c_ptr
         type(c_ptr), value :: address
         integer(c_int), value :: given
      end function flag_setter

      integer(c_int) function real_setter(address, given) bind(c)
         import :: c_double, c_int, c_ptr
         type(c_ptr), value :: address
         real(c_double), value :: given
      end function real_setter

      integer(c_int) function complex_setter(address, re, im) bind(c)
         import :: c_double, c_int, c_ptr
         type(c_ptr), value :: address
         real(c_double), value :: re, im
      end function complex_setter
   end interface

contains

   integer(c_int) function kschur_options_set(address, name, value) bind(c) result(status)
      type(c_ptr), value :: address, name, value
      type(options_handle_type), pointer :: handle
      type(error_type), allocatable :: error
      character(len=:), allocatable :: option, given

      status = status_null
      handle => options_of(address)
      if (.not. associated(handle)) return
      call require(name, "name", error)
      call require(value, "value", error)
      status = outcome(handle, error)
      if (allocated(error)) return
      call take_text(name, option)
      call take_text(value, given)
      select case (option)
      case ("modes")
         status = with_integer(handle, address, option, given, kschur_options_set_modes)
      case ("target")
         status = with_complex(handle, address, option, given, kschur_options_set_target)
      case ("target_hz")
         status = with_real(handle, address, option, given, kschur_options_set_target_hz)
      case ("shift")
         status = with_complex(handle, address, option, given, kschur_options_set_shift)
      case ("method")
         status = kschur_options_set_method(address, value)
      case ("arpack")
         status = kschur_options_set_arpack(address, value)
      case ("formulation")
         status = kschur_options_set_formulation(address, value)
      case ("inner")
         status = kschur_options_set_inner(address, value)
      case ("constraint_scaling")
         status = kschur_options_set_constraint_scaling(address, value)
      case ("normalisation")
         status = kschur_options_set_normalisation(address, value)
      case ("subspace")
         status = with_integer(handle, address, option, given, kschur_options_set_subspace)
      case ("tolerance")
         status = with_real(handle, address, option, given, kschur_options_set_tolerance)
      case ("max_restarts")
         status = with_integer(handle, address, option, given, kschur_options_set_max_restarts)
      case ("block")
         status = with_integer(handle, address, option, given, kschur_options_set_block)
      case ("threads")
         status = with_integer(handle, address, option, given, kschur_options_set_threads)
      case ("memory")
         status = with_integer(handle, address, option, given, kschur_options_set_memory)
      case ("distribute")
         status = with_integer(handle, address, option, given, kschur_options_set_distribute)
      case ("groups")
         status = with_integer(handle, address, option, given, kschur_options_set_groups)
      case ("seed")
         status = with_integer(handle, address, option, given, kschur_options_set_seed)
      case ("presolve")
         status = with_flag(handle, address, option, given, kschur_options_set_presolve)
      case ("left")
         status = with_flag(handle, address, option, given, kschur_options_set_left)
      case ("certify")
         status = with_flag(handle, address, option, given, kschur_options_set_certify, off=-1_c_int)
      case ("checkpoint")
         status = kschur_options_set_checkpoint(address, value)
      case ("resume")
         status = kschur_options_set_resume(address, value)
      case default
         call new_error(error, status_usage, "there is no option '"//option//"'")
         status = outcome(handle, error)
      end select
   end function kschur_options_set

   ! Passes a text to a setter of a whole number, or refuses it.
   integer(c_int) function with_integer(handle, address, name, given, setter) result(status)
      type(options_handle_type), intent(inout) :: handle
      type(c_ptr), intent(in) :: address
      character(len=*), intent(in) :: name, given
      procedure(integer_setter) :: setter
      integer(c_int64_t) :: number
      integer :: failed

      failed = verify(given, "+-0123456789")
      if (failed == 0) read (given, "(i40)", iostat=failed) number
      if (failed == 0 .and. given /= "") then
         status = setter(address, number)
      else
         status = refuse(handle, name, given, "a whole number")
      end if
   end function with_integer

   ! Passes on or off to a setter of a flag, or refuses the text.
   integer(c_int) function with_flag(handle, address, name, given, setter, off) result(status)
      type(options_handle_type), intent(inout) :: handle
      type(c_ptr), intent(in) :: address
      character(len=*), intent(in) :: name, given
      procedure(flag_setter) :: setter
      !> Value of off; absent: zero.
      integer(c_int), intent(in), optional :: off
      integer(c_int) :: no

      no = 0
      if (present(off)) no = off
      select case (given)
      case ("on", "yes", "1")
         status = setter(address, 1_c_int)
      case ("off", "no", "0")
         status = setter(address, no)
      case default
         status = refuse(handle, name, given, "on or off")
      end select
   end function with_flag

   ! Passes a text to a setter of a number, or refuses it.
   integer(c_int) function with_real(handle, address, name, given, setter) result(status)
      type(options_handle_type), intent(inout) :: handle
      type(c_ptr), intent(in) :: address
      character(len=*), intent(in) :: name, given
      procedure(real_setter) :: setter
      real(c_double) :: number
      logical :: valid

      call read_real(given, number, valid)
      if (valid) then
         status = setter(address, number)
      else
         status = refuse(handle, name, given, "a number")
      end if
   end function with_real

   ! Passes a text RE or RE,IM to a setter of a complex number, or refuses it.
   integer(c_int) function with_complex(handle, address, name, given, setter) result(status)
      type(options_handle_type), intent(inout) :: handle
      type(c_ptr), intent(in) :: address
      character(len=*), intent(in) :: name, given
      procedure(complex_setter) :: setter
      real(c_double) :: re, im
      logical :: valid
      integer :: comma

      comma = index(given//",", ",")
      im = 0
      call read_real(given(:comma - 1), re, valid)
      if (valid .and. comma <= len(given)) call read_real(given(comma + 1:), im, valid)
      if (valid) then
         status = setter(address, re, im)
      else
         status = refuse(handle, name, given, "a real part, or a real and an imaginary one with a comma between")
      end if
   end function with_complex

   ! Reads a number; `valid` is false if the word is anything else.
   subroutine read_real(word, number, valid)
      character(len=*), intent(in) :: word
      real(c_double), intent(out) :: number
      logical, intent(out) :: valid
      integer :: failed

      number = 0
      ! gfortran reads beyond a word that ends in its exponent's letter.
      failed = verify(word, "+-.0123456789eE")
      if (failed == 0) failed = verify(word, "+-eE", back=.true.) - len(word)
      if (failed == 0) read (word, "(f100.0)", iostat=failed) number
      valid = failed == 0 .and. scan(word, "0123456789") > 0
   end subroutine read_real

   ! Fails, with a message that says what the option wants.
   integer(c_int) function refuse(handle, name, given, wanted) result(status)
      type(options_handle_type), intent(inout) :: handle
      character(len=*), intent(in) :: name, given, wanted
      type(error_type), allocatable :: error

      call new_error(error, status_usage, "the option '"//name//"' wants "//wanted//", not '"//given//"'")
      status = outcome(handle, error)
   end function refuse
end module kschur_capi_named_options
