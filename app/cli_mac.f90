!> kschur mac: the modal assurance criterion of two results.
module cli_mac
   use cli_arguments, only: arguments_type
   use cli_columns, only: print_columns
   use cli_output, only: take_format
   use kschur, only: error_file, error_input, error_type, error_usage, modal_assurance, modal_result_type, new_error, &
      read_hdf5_result, text, wp
   implicit none
   private
   public :: mac_command

contains

   !> Runs the command.
   subroutine mac_command(arguments, error)
      type(arguments_type), intent(inout) :: arguments
      type(error_type), allocatable, intent(out) :: error
      type(modal_result_type) :: first, second
      character(len=:), allocatable :: one, other
      character(len=16), allocatable :: names(:)
      real(wp), allocatable :: mac(:, :)
      integer :: format, j

      call take_format(arguments, format, error)
      call arguments%take_word(one)
      call arguments%take_word(other)
      if (.not. allocated(error)) call arguments%check_all_taken(error)
      if (.not. (allocated(error) .or. allocated(other))) &
         call new_error(error, error_usage, "kschur mac wants two results, which kschur solve --output wrote")
      if (allocated(error)) return
      call read_hdf5_result(first, one, error, trial=.true.)
      if (.not. allocated(error)) call read_hdf5_result(second, other, error, trial=.true.)
      if (allocated(error)) then
         if (error%code == error_file) error%code = error_input
         return
      end if
      call modal_assurance(first, second, mac, error)
      if (allocated(error)) return
      allocate (names(size(mac, 2)))
      do j = 1, size(names)
         names(j) = "mode_"//text(j)
      end do
      ! Squares of rounding.
      where (mac < epsilon(mac)) mac = 0
      call print_columns("mode", names, spread("1", 1, size(names)), mac, format)
   end subroutine mac_command
end module cli_mac
