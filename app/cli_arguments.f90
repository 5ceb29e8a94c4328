!> Command-line arguments, taken by name until none is left. Takers do nothing if `error` is already raised, so that one check
!> after many is enough.
module cli_arguments
   use cli_numbers, only: read_integer, read_real
   use kschur, only: did_you_mean, error_type, error_usage, index_of_name, long, new_error, text, wp
   implicit none
   private
   public :: arguments_type, command_arguments

   integer, parameter :: longest_name = 24
   ! Options that a letter stands for, in every command that has them.
   character(len=*), parameter :: short_names(*) = [character(len=2) :: "-h", "-V", "-m", "-b", "-o", "-f", "-t", "-q", "-v"]
   character(len=*), parameter :: long_names(*) = [character(len=longest_name) :: "--help", "--version", "--modes", "--band", &
      "--output", "--format", "--threads", "--quiet", "--verbose"]

   !> Remaining words of a command line.
   type :: arguments_type
      private
      character(len=:), allocatable :: words(:)
      logical, allocatable :: taken(:)
      ! Of the options that were looked for.
      character(len=longest_name), allocatable :: names(:)
   contains
      !> Takes the option `--name`, which has no value.
      procedure :: take_flag
      !> Takes option `--name` that has no value, or the value off.
      procedure :: take_switch
      !> Takes the value of option `--name`; not allocated where it was not given.
      procedure :: take_text
      !> Takes the whole number of option `--name`; unchanged where it was not given.
      procedure :: take_integer
      !> Takes the bytes of option `--name`, a whole number with K, M or G for powers of 1000; unchanged where it was not given.
      procedure :: take_bytes
      !> Takes the positive number of option `--name`; not allocated where it was not given.
      procedure :: take_positive
      !> Takes the value RE or RE,IM of option `--name`; not allocated where it was not given.
      procedure :: take_complex
      !> Takes the two numbers A,B of option `--name`; not allocated where it was not given.
      procedure :: take_pair
      !> Takes a name out of a list, as its position from 0; unchanged where it was not given.
      procedure :: take_choice
      !> Takes the first word that is not an option; not allocated if there is none.
      procedure :: take_word
      !> The remaining words.
      procedure :: rest
      !> Fails if a word remains.
      procedure :: check_all_taken
   end type arguments_type

contains

   !> The words after the program's name.
   function command_arguments() result(arguments)
      type(arguments_type) :: arguments
      integer :: i, length, longest

      longest = 1
      do i = 1, command_argument_count()
         call get_command_argument(i, length=length)
         longest = max(longest, length)
      end do
      ! A short name may become a long one.
      longest = longest + longest_name
      allocate (character(len=longest) :: arguments%words(command_argument_count()))
      allocate (arguments%taken(size(arguments%words)), source=.false.)
      do i = 1, size(arguments%words)
         call get_command_argument(i, arguments%words(i))
      end do
      allocate (arguments%names(0))
   end function command_arguments

   ! Position of option `name`, 0 if it was not given; marks it as taken, and writes its long name in place of a short one.
   subroutine find(self, name, place, error)
      class(arguments_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(out) :: place
      type(error_type), allocatable, intent(inout) :: error
      character(len=longest_name) :: known
      integer :: i, k

      place = 0
      if (allocated(error)) return
      known = name
      self%names = [character(len=longest_name) :: self%names, known]
      k = findloc(long_names, name, 1)
      do i = 1, size(self%words)
         if (self%taken(i)) cycle
         if (k > 0) then
            if (self%words(i)(:2) == short_names(k) .and. scan(self%words(i)(3:3), " =") == 1) &
               self%words(i) = name//self%words(i)(3:)
         end if
         if (self%words(i) /= name .and. index(self%words(i), name//"=") /= 1) cycle
         if (place /= 0) call new_error(error, error_usage, name//" is given twice")
         if (allocated(error)) return
         place = i
         self%taken(i) = .true.
      end do
   end subroutine find

   subroutine take_flag(self, name, value, error)
      class(arguments_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(out) :: value
      type(error_type), allocatable, intent(inout) :: error
      integer :: place

      call find(self, name, place, error)
      value = place /= 0
      if (.not. value .or. allocated(error)) return
      if (self%words(place) /= name) call new_error(error, error_usage, name//" takes no value")
   end subroutine take_flag

   subroutine take_switch(self, name, on, off, error)
      class(arguments_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(out) :: on, off
      type(error_type), allocatable, intent(inout) :: error
      integer :: place

      call find(self, name, place, error)
      on = .false.
      off = .false.
      if (place == 0 .or. allocated(error)) return
      off = self%words(place) == name//"=off"
      on = .not. off
      if (off) return
      if (self%words(place) /= name) then
         call new_error(error, error_usage, name//" takes no value but off")
      else if (place < size(self%words)) then
         off = self%words(place + 1) == "off" .and. .not. self%taken(place + 1)
         on = .not. off
         if (off) self%taken(place + 1) = .true.
      end if
   end subroutine take_switch

   subroutine take_text(self, name, value, error, wants)
      class(arguments_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      character(len=:), allocatable, intent(out) :: value
      type(error_type), allocatable, intent(inout) :: error
      !> What the value should be, for the message; without it: a file name.
      character(len=*), intent(in), optional :: wants
      integer :: place

      call find(self, name, place, error)
      if (place == 0 .or. allocated(error)) return
      if (self%words(place) /= name) then
         value = trim(self%words(place)(len(name) + 2:))
      else if (place < size(self%words)) then
         if (.not. (self%taken(place + 1) .or. is_option(self%words(place + 1)))) then
            value = trim(self%words(place + 1))
            self%taken(place + 1) = .true.
         end if
      end if
      if (.not. allocated(value)) allocate (character(len=0) :: value)
      if (value /= "") return
      if (present(wants)) then
         call new_error(error, error_usage, name//" wants "//wants)
      else
         call new_error(error, error_usage, name//" wants a file name")
      end if
   end subroutine take_text

   ! Whether a word cannot be the value of an option: numbers may begin with one dash, and a dash alone is standard input.
   pure logical function is_option(word)
      character(len=*), intent(in) :: word

      is_option = index(word, "--") == 1 .or. any(short_names == word)
   end function is_option

   subroutine take_integer(self, name, smallest, value, error, zero)
      class(arguments_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: smallest
      integer, intent(inout) :: value
      type(error_type), allocatable, intent(inout) :: error
      !> A word that means 0.
      character(len=*), optional, intent(in) :: zero
      character(len=:), allocatable :: word, wanted
      logical :: ok

      wanted = "a whole number of at least "//text(smallest)
      if (present(zero)) wanted = wanted//" or '"//zero//"'"
      call self%take_text(name, word, error, wanted)
      if (allocated(error) .or. .not. allocated(word)) return
      if (present(zero)) then
         if (word == zero) then
            value = 0
            return
         end if
      end if
      call read_integer(word, value, ok)
      if (ok) ok = value >= smallest
      if (.not. ok) call new_error(error, error_usage, name//" wants "//wanted//", not '"//word//"'")
   end subroutine take_integer

   subroutine take_bytes(self, name, value, error)
      class(arguments_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(long), intent(inout) :: value
      type(error_type), allocatable, intent(inout) :: error
      character(len=*), parameter :: wanted = "bytes as 800000000, 800M or 4G", units = "KMG"
      character(len=:), allocatable :: word
      integer :: number, power, last
      logical :: ok

      call self%take_text(name, word, error, wanted)
      if (allocated(error) .or. .not. allocated(word)) return
      power = scan(units, word(len(word):))
      last = len(word)
      if (power > 0) last = last - 1
      call read_integer(word(:last), number, ok)
      if (ok) ok = number > 0
      if (ok) value = number*1000_long**power
      if (.not. ok) call new_error(error, error_usage, name//" wants "//wanted//", not '"//word//"'")
   end subroutine take_bytes

   subroutine take_positive(self, name, value, error)
      class(arguments_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(out) :: value
      type(error_type), allocatable, intent(inout) :: error
      character(len=:), allocatable :: word
      logical :: ok

      call self%take_text(name, word, error, "a positive number")
      if (allocated(error) .or. .not. allocated(word)) return
      allocate (value, source=0.0_wp)
      call read_real(word, value, ok)
      if (ok) ok = value > 0
      if (.not. ok) call new_error(error, error_usage, name//" wants a positive number, not '"//word//"'")
   end subroutine take_positive

   subroutine take_complex(self, name, value, error)
      class(arguments_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      complex(wp), allocatable, intent(out) :: value
      type(error_type), allocatable, intent(inout) :: error
      character(len=:), allocatable :: word
      real(wp) :: re, im
      integer :: comma
      logical :: ok

      call self%take_text(name, word, error, "a number RE or two, RE,IM")
      if (allocated(error) .or. .not. allocated(word)) return
      re = 0
      im = 0
      comma = index(word//",", ",")
      call read_real(word(:comma - 1), re, ok)
      if (ok .and. comma <= len(word)) call read_real(word(comma + 1:), im, ok)
      if (.not. ok) call new_error(error, error_usage, name//" wants a number RE or two, RE,IM, not '"//word//"'")
      allocate (value, source=cmplx(re, im, wp))
   end subroutine take_complex

   subroutine take_pair(self, name, values, error)
      class(arguments_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(out) :: values(:)
      type(error_type), allocatable, intent(inout) :: error
      character(len=:), allocatable :: word
      integer :: comma
      logical :: first_ok, ok

      call self%take_text(name, word, error, "two numbers A,B")
      if (allocated(error) .or. .not. allocated(word)) return
      allocate (values(2), source=0.0_wp)
      comma = index(word//",", ",")
      call read_real(word(:comma - 1), values(1), first_ok)
      call read_real(word(comma + 1:), values(2), ok)
      if (.not. (first_ok .and. ok)) call new_error(error, error_usage, name//" wants two numbers A,B, not '"//word//"'")
   end subroutine take_pair

   subroutine take_choice(self, name, choices, value, error)
      class(arguments_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      character(len=*), intent(in) :: choices(0:)
      integer, intent(inout) :: value
      type(error_type), allocatable, intent(inout) :: error
      character(len=:), allocatable :: word, possible
      integer :: i

      possible = trim(choices(0))
      do i = 1, ubound(choices, 1)
         possible = possible//", "//trim(choices(i))
      end do
      call self%take_text(name, word, error, "one of "//possible)
      if (allocated(error) .or. .not. allocated(word)) return
      value = index_of_name(word, choices)
      if (value < 0) call new_error(error, error_usage, name//" wants one of "//possible//", not '"//word//"'"// &
         did_you_mean(word, choices))
   end subroutine take_choice

   subroutine take_word(self, word)
      class(arguments_type), intent(inout) :: self
      character(len=:), allocatable, intent(out) :: word
      integer :: i

      do i = 1, size(self%words)
         if (self%taken(i) .or. index(self%words(i), "-") == 1) cycle
         word = trim(self%words(i))
         self%taken(i) = .true.
         return
      end do
   end subroutine take_word

   pure function rest(self) result(words)
      class(arguments_type), intent(in) :: self
      character(len=len(self%words)) :: words(count(.not. self%taken))

      integer :: i, left

      left = 0
      do i = 1, size(self%words)
         if (self%taken(i)) cycle
         left = left + 1
         words(left) = self%words(i)
      end do
   end function rest

   subroutine check_all_taken(self, error)
      class(arguments_type), intent(in) :: self
      type(error_type), allocatable, intent(inout) :: error
      character(len=:), allocatable :: hint
      integer :: i

      if (allocated(error)) return
      do i = 1, size(self%words)
         if (self%taken(i)) cycle
         if (index(self%words(i), "-") == 1) then
            hint = did_you_mean(self%words(i)(:index(self%words(i)//"=", "=") - 1), self%names)
            if (hint == "") hint = "; see kschur help"
            call new_error(error, error_usage, "unknown option "//trim(self%words(i))//hint)
         else
            call new_error(error, error_usage, "one word too many: '"//trim(self%words(i))//"'; see kschur help")
         end if
         return
      end do
   end subroutine check_all_taken
end module cli_arguments
