!> Colours of terminals (ECMA-48, SGR). Files and pipes get none, nor does a terminal if NO_COLOR is set (no-color.org).
module cli_colour
   use, intrinsic :: iso_c_binding, only: c_int
   implicit none
   private
   public :: coloured, coloured_error

   !> For `coloured`.
   character(len=*), parameter, public :: bold = "1", red = "31", green = "32", yellow = "33"
   character(len=*), parameter :: escape = achar(27)//"["

   interface
      integer(c_int) function c_isatty(descriptor) bind(c, name="isatty")
         import :: c_int
         integer(c_int), value :: descriptor
      end function c_isatty
   end interface

contains

   !> Words for standard output: in a colour if that is a terminal with colours, and `colour` is not empty.
   function coloured(words, colour)
      character(len=*), intent(in) :: words, colour
      character(len=:), allocatable :: coloured

      coloured = words
      if (len(colour) > 0 .and. has_colours(1_c_int)) coloured = escape//colour//"m"//words//escape//"0m"
   end function coloured

   !> Words for standard error: in a colour if that is a terminal with colours.
   function coloured_error(words, colour) result(coloured)
      character(len=*), intent(in) :: words, colour
      character(len=:), allocatable :: coloured

      coloured = words
      if (has_colours(2_c_int)) coloured = escape//colour//"m"//words//escape//"0m"
   end function coloured_error

   ! Whether a file descriptor is a terminal that shows colours.
   logical function has_colours(descriptor)
      integer(c_int), intent(in) :: descriptor
      ! Of several processes mpirun gathers the output: to each of them its end looks like a terminal.
      character(len=*), parameter :: without(*) = [character(len=20) :: "NO_COLOR", "OMPI_COMM_WORLD_SIZE", "PMI_SIZE"]
      character(len=8) :: terminal
      integer :: i

      has_colours = c_isatty(descriptor) == 1
      if (.not. has_colours) return
      has_colours = .not. any([(is_set(trim(without(i))), i=1, size(without))])
      call get_environment_variable("TERM", terminal)
      if (terminal == "" .or. terminal == "dumb") has_colours = .false.
   end function has_colours

   ! Whether an environment variable is set to something that is not empty.
   logical function is_set(variable)
      character(len=*), intent(in) :: variable
      integer :: length, status

      call get_environment_variable(variable, length=length, status=status)
      is_set = status == 0 .and. length > 0
   end function is_set
end module cli_colour
