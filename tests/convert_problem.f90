!> convert_problem IN OUT: reads a problem and writes it again; each is an .h5
!> file or a folder of Matrix Market files. What fails is said on standard
!> error, with exit status 2.
program convert_problem
   use, intrinsic :: iso_c_binding, only: c_int
   use, intrinsic :: iso_fortran_env, only: error_unit
   use kschur_error, only: error_type
   use kschur_hdf5_problem, only: read_hdf5_problem, write_hdf5_problem
   use kschur_matrix_market_problem, only: read_matrix_market_problem, write_matrix_market_problem
   use kschur_problem, only: modal_problem_type
   implicit none

   interface
      subroutine exit_silently(status) bind(c, name="exit")
         import :: c_int
         integer(c_int), value :: status
      end subroutine exit_silently
   end interface

   type(modal_problem_type) :: problem
   type(error_type), allocatable :: error

   if (is_hdf5(argument(1))) then
      call read_hdf5_problem(problem, argument(1), error)
   else
      call read_matrix_market_problem(problem, argument(1), error)
   end if
   if (.not. allocated(error)) then
      if (is_hdf5(argument(2))) then
         call write_hdf5_problem(problem, argument(2), error)
      else
         call write_matrix_market_problem(problem, argument(2), error)
      end if
   end if
   if (allocated(error)) then
      write (error_unit, "(a)") error%message
      call exit_silently(2_c_int)
   end if

contains

   function argument(place)
      integer, intent(in) :: place
      character(len=:), allocatable :: argument
      integer :: length

      call get_command_argument(place, length=length)
      allocate (character(len=length) :: argument)
      call get_command_argument(place, argument)
   end function argument

   logical function is_hdf5(path)
      character(len=*), intent(in) :: path

      is_hdf5 = len(path) > 3 .and. index(path, ".h5", back=.true.) == len(path) - 2
   end function is_hdf5
end program convert_problem
