!> The options of a scene: their defaults, what the command line makes of
!> them, and their values.
module scene_options
   use kschur, only: did_you_mean, error_type, error_usage, new_error, text, wp
   implicit none
   private
   public :: listed, option_type, options_type

   !> One option.
   type :: option_type
      !> Its name, `--elements` say.
      character(len=20) :: name = ""
      !> Its value, at first the default.
      character(len=64) :: value = ""
      !> What it means, a few words, units included.
      character(len=64) :: help = ""
      !> Whether the command line gave it.
      logical :: given = .false.
   end type option_type

   !> All options of a scene. Each `read_*` fails with a sentence that names
   !> what is possible, and does nothing where there is an error already.
   type :: options_type
      !> What the scene is, one line.
      character(len=80) :: description = ""
      type(option_type), allocatable :: list(:)
   contains
      !> Puts the values of the command line in place of the defaults.
      procedure :: parse
      !> The value as one of some words.
      procedure :: read_choice
      !> The value as a whole number within bounds.
      procedure :: read_integer
      !> The value as two whole numbers within bounds, written 20x14.
      procedure :: read_integer_pair
      !> The value as a positive number.
      procedure :: read_positive
      !> The value as a number that is not negative.
      procedure :: read_not_negative
      !> The value as any number.
      procedure :: read_number
      !> Fails where options were given that only one value of another one has a use for.
      procedure :: require
      !> The description and the options, a line each.
      procedure :: help
      procedure, private :: value_of
   end type options_type

contains

   subroutine parse(self, arguments, error)
      class(options_type), intent(inout) :: self
      !> Names and values: `--elements`, `10`, or `--elements=10`, ...
      character(len=*), intent(in) :: arguments(:)
      type(error_type), allocatable, intent(out) :: error
      character(len=len(self%list%name)) :: names(size(self%list))
      character(len=len(arguments)) :: value
      character(len=:), allocatable :: name
      integer :: i, k, last

      names = self%list%name
      i = 0
      do while (i < size(arguments))
         i = i + 1
         last = index(arguments(i)//"=", "=") - 1
         name = trim(arguments(i)(:last))
         value = ""
         if (last < len(arguments)) then
            value = arguments(i)(last + 2:)
         else if (i < size(arguments)) then
            i = i + 1
            value = arguments(i)
         end if
         k = place(self%list, name)
         if (k == 0) then
            call new_error(error, error_usage, "this scene has no option '"//name//"', only "//listed(names, "and")// &
               did_you_mean(name, names))
         else if (self%list(k)%given) then
            call new_error(error, error_usage, "option "//name//" is given twice")
         else if (value == "") then
            call new_error(error, error_usage, "option "//name//" wants a value")
         else if (len_trim(value) > len(self%list%value)) then
            call new_error(error, error_usage, "the value of option "//name//" is too long")
         end if
         if (allocated(error)) return
         self%list(k)%value = value
         self%list(k)%given = .true.
      end do
   end subroutine parse

   subroutine read_choice(self, name, choices, choice, error)
      class(options_type), intent(in) :: self
      character(len=*), intent(in) :: name, choices(:)
      character(len=:), allocatable, intent(out) :: choice
      type(error_type), allocatable, intent(inout) :: error

      if (allocated(error)) return
      choice = self%value_of(name)
      if (all(choices /= choice)) call refuse(name, listed(choices, "or"), choice, error, did_you_mean(choice, choices))
   end subroutine read_choice

   subroutine read_integer(self, name, lowest, highest, number, error)
      class(options_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: lowest, highest
      integer, intent(out) :: number
      type(error_type), allocatable, intent(inout) :: error
      character(len=:), allocatable :: word
      logical :: valid

      number = lowest
      if (allocated(error)) return
      word = self%value_of(name)
      call parse_integer(word, lowest, highest, number, valid)
      if (.not. valid) &
         call refuse(name, "a whole number from "//text(lowest)//" to "//text(highest), word, error)
   end subroutine read_integer

   subroutine read_integer_pair(self, name, lowest, highest, numbers, error)
      class(options_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: lowest, highest
      integer, intent(out) :: numbers(2)
      type(error_type), allocatable, intent(inout) :: error
      character(len=:), allocatable :: word
      integer :: cross
      logical :: valid(2)

      numbers = lowest
      if (allocated(error)) return
      word = self%value_of(name)
      cross = index(word, "x")
      valid = .false.
      if (cross > 0) then
         call parse_integer(word(:cross - 1), lowest, highest, numbers(1), valid(1))
         call parse_integer(word(cross + 1:), lowest, highest, numbers(2), valid(2))
      end if
      if (.not. all(valid)) call refuse(name, "two whole numbers from "//text(lowest)//" to "// &
         text(highest)//", written as 20x14", word, error)
   end subroutine read_integer_pair

   subroutine read_positive(self, name, number, error)
      class(options_type), intent(in) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(out) :: number
      type(error_type), allocatable, intent(inout) :: error

      call read_above(self, name, tiny(number), "a positive number", number, error)
   end subroutine read_positive

   subroutine read_not_negative(self, name, number, error)
      class(options_type), intent(in) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(out) :: number
      type(error_type), allocatable, intent(inout) :: error

      call read_above(self, name, 0.0_wp, "a number that is not negative", number, error)
   end subroutine read_not_negative

   subroutine read_number(self, name, number, error)
      class(options_type), intent(in) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(out) :: number
      type(error_type), allocatable, intent(inout) :: error

      call read_above(self, name, -huge(number), "a number", number, error)
   end subroutine read_number

   subroutine require(self, name, value, others, error)
      class(options_type), intent(in) :: self
      !> The option and the value that it must have where one of the `others` was given.
      character(len=*), intent(in) :: name, value, others(:)
      type(error_type), allocatable, intent(inout) :: error
      integer :: i

      if (self%value_of(name) == value) return
      do i = 1, size(others)
         if (allocated(error)) return
         if (self%list(place(self%list, others(i)))%given) call new_error(error, error_usage, &
            "option "//trim(others(i))//" wants "//name//" "//value//", not '"//self%value_of(name)//"'")
      end do
   end subroutine require

   subroutine read_above(self, name, lowest, wanted, number, error)
      type(options_type), intent(in) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: lowest
      !> What is wanted, in words.
      character(len=*), intent(in) :: wanted
      real(wp), intent(out) :: number
      type(error_type), allocatable, intent(inout) :: error
      character(len=:), allocatable :: word
      integer :: status

      number = 1
      if (allocated(error)) return
      word = self%value_of(name)
      status = verify(word, "+-.0123456789deDE")
      if (status == 0) read (word, *, iostat=status) number
      if (status == 0 .and. number >= lowest .and. number <= huge(number)) return
      number = 1
      call refuse(name, wanted, word, error)
   end subroutine read_above

   pure function help(self) result(lines)
      class(options_type), intent(in) :: self
      character(len=:), allocatable :: lines
      integer :: i

      lines = trim(self%description)
      do i = 1, size(self%list)
         associate (option => self%list(i))
            lines = lines//new_line("a")//"  "//option%name//trim(option%help)//" ["//trim(option%value)//"]"
         end associate
      end do
   end function help

   pure function value_of(self, name) result(value)
      class(options_type), intent(in) :: self
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: value

      value = trim(self%list(place(self%list, name))%value)
   end function value_of

   pure integer function place(list, name)
      type(option_type), intent(in) :: list(:)
      character(len=*), intent(in) :: name

      do place = size(list), 1, -1
         if (list(place)%name == name) return
      end do
   end function place

   pure subroutine parse_integer(word, lowest, highest, number, valid)
      character(len=*), intent(in) :: word
      integer, intent(in) :: lowest, highest
      integer, intent(out) :: number
      logical, intent(out) :: valid
      integer :: status

      number = lowest
      status = verify(word, "0123456789")
      if (status == 0) read (word, *, iostat=status) number
      valid = status == 0 .and. number >= lowest .and. number <= highest
   end subroutine parse_integer

   pure subroutine refuse(name, wanted, word, error, hint)
      character(len=*), intent(in) :: name, wanted, word
      type(error_type), allocatable, intent(inout) :: error
      !> What else the word may have been meant for.
      character(len=*), optional, intent(in) :: hint
      character(len=:), allocatable :: ending

      ending = ""
      if (present(hint)) ending = hint
      call new_error(error, error_usage, "option "//name//" wants "//wanted//", not '"//word//"'"//ending)
   end subroutine refuse

   !> The words as "one, two or three".
   pure function listed(words, conjunction) result(list)
      character(len=*), intent(in) :: words(:)
      !> What stands before the last word.
      character(len=*), intent(in) :: conjunction
      character(len=:), allocatable :: list
      integer :: i

      list = trim(words(1))
      do i = 2, size(words)
         if (i < size(words)) then
            list = list//", "//trim(words(i))
         else
            list = list//" "//conjunction//" "//trim(words(i))
         end if
      end do
   end function listed
end module scene_options
