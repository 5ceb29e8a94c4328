! Reads many damaged files in one process: read_cases CASES PLACE. CASES is one record after the other: how it is to be
! read, 8 characters; its length, 8 bytes; its bytes. Each is written to the file PLACE and read from there. A line of the
! output answers a record: `ok` with all that was read, real numbers by their bits, or `error CODE MESSAGE`.
program read_cases
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_long, c_null_ptr, c_ptr, c_size_t
   use, intrinsic :: iso_fortran_env, only: output_unit
   use kschur, only: csr_matrix_type, error_type, long, modal_problem_type, modal_result_type, read_hdf5_problem, &
      read_hdf5_result, read_matrix_market, read_matrix_market_files, read_triplet_files, text, wp
   implicit none

   interface
      integer(c_int) function c_pipe(ends) bind(c, name="pipe")
         import :: c_int
         integer(c_int), intent(out) :: ends(2)
      end function c_pipe

      integer(c_size_t) function c_write(to, bytes, count) bind(c, name="write")
         import :: c_char, c_int, c_size_t
         integer(c_int), value :: to
         character(kind=c_char), intent(in) :: bytes(*)
         integer(c_size_t), value :: count
      end function c_write

      ! `times`: seconds and microseconds between signals, and to the first.
      integer(c_int) function c_setitimer(which, times, before) bind(c, name="setitimer")
         import :: c_int, c_long, c_ptr
         integer(c_int), value :: which
         integer(c_long), intent(in) :: times(4)
         type(c_ptr), value :: before
      end function c_setitimer

      integer(c_int) function c_close(descriptor) bind(c, name="close")
         import :: c_int
         integer(c_int), value :: descriptor
      end function c_close
   end interface

   character(len=4096) :: cases, place
   character(len=8) :: how
   character(len=:), allocatable :: bytes
   integer(long) :: length
   integer :: unit, status
   ! ITIMER_PROF: what goes round in a circle is ended when it has taken so many seconds of the processor.
   integer(c_int), parameter :: processor_time = 2
   integer(c_long), parameter :: most_seconds = 60

   call get_command_argument(1, cases)
   call get_command_argument(2, place)
   open (newunit=unit, file=trim(cases), access="stream", form="unformatted", action="read", status="old")
   do
      read (unit, iostat=status) how, length
      if (status /= 0) exit
      allocate (character(len=length) :: bytes)
      read (unit) bytes
      status = c_setitimer(processor_time, [0_c_long, 0_c_long, most_seconds, 0_c_long], c_null_ptr)
      call read_case(trim(how), bytes, trim(place))
      deallocate (bytes)
      flush (output_unit)
   end do

contains

   subroutine read_case(how, bytes, place)
      character(len=*), intent(in) :: how, bytes, place
      type(csr_matrix_type) :: matrix
      type(modal_problem_type) :: problem
      type(modal_result_type) :: result
      type(error_type), allocatable :: error
      character(len=:), allocatable :: name
      integer(c_int) :: ends(2)

      name = place
      if (how == "piped") then
         call fill_pipe(bytes, ends)
         name = "/dev/fd/"//text(int(ends(1)))
      else
         call write_file(place, bytes)
      end if
      select case (how)
      case ("matrix", "piped")
         call read_matrix_market(matrix, name, error)
      case ("files")
         call read_matrix_market_files(problem, name, name, name, "", error)
      case ("triplets")
         call read_triplet_files(problem, name, name, "", "", error)
      case ("problem", "problem!")
         call read_hdf5_problem(problem, name, error, trial=how == "problem")
      case ("result", "result!")
         call read_hdf5_result(result, name, error, trial=how == "result")
      end select
      if (how == "piped") call close_pipe(ends)
      if (allocated(error)) then
         write (output_unit, "(a, i0, 2a)") "error ", error%code, " ", error%message
         return
      end if
      write (output_unit, "(a)", advance="no") "ok"
      select case (how)
      case ("matrix", "piped")
         call show_matrix(matrix)
      case ("result", "result!")
         call show_result(result)
      case default
         call show_matrix(problem%mass)
         call show_matrix(problem%stiffness)
         call show_matrix(problem%damping)
         call show_matrix(problem%constraints)
      end select
      write (output_unit, "(a)") ""
   end subroutine read_case

   subroutine write_file(place, bytes)
      character(len=*), intent(in) :: place, bytes
      integer :: unit

      open (newunit=unit, file=place, access="stream", form="unformatted", status="replace", action="write")
      write (unit) bytes
      close (unit)
   end subroutine write_file

   ! A pipe holds 64 kB before anyone reads it.
   subroutine fill_pipe(bytes, ends)
      character(len=*), intent(in) :: bytes
      integer(c_int), intent(out) :: ends(2)
      integer(c_int) :: status
      integer(c_size_t) :: written

      status = c_pipe(ends)
      written = c_write(ends(2), bytes, len(bytes, c_size_t))
      if (status /= 0 .or. written /= len(bytes)) error stop "no pipe"
      status = c_close(ends(2))
   end subroutine fill_pipe

   subroutine close_pipe(ends)
      integer(c_int), intent(in) :: ends(2)
      integer(c_int) :: status

      status = c_close(ends(1))
   end subroutine close_pipe

   ! rows, columns, entries, then row, column and value of each.
   subroutine show_matrix(matrix)
      type(csr_matrix_type), intent(in) :: matrix
      integer :: i, k

      write (output_unit, "(3(1x, i0))", advance="no") matrix%rows, matrix%columns, matrix%nonzeros()
      do i = 1, matrix%rows
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            write (output_unit, "(2(1x, i0))", advance="no") i, matrix%column(k)
            call show_reals([matrix%value(k)])
         end do
      end do
   end subroutine show_matrix

   ! n, m, modes, then the arrays in the order of the file's names below.
   subroutine show_result(result)
      type(modal_result_type), intent(in) :: result

      write (output_unit, "(3(1x, i0))", advance="no") result%unknowns, result%constraints, size(result%eigenvalues)
      call show_complexes(result%eigenvalues)
      call show_complexes(reshape(result%eigenvectors, [size(result%eigenvectors)]))
      call show_complexes(reshape(result%multipliers, [size(result%multipliers)]))
      call show_reals(result%frequency_hz)
      call show_reals(result%damped_frequency_hz)
      call show_reals(result%damping_ratio)
      call show_reals(result%backward_error)
      call show_reals(result%error_bound)
   end subroutine show_result

   subroutine show_complexes(values)
      complex(wp), intent(in) :: values(:)
      integer :: k

      do k = 1, size(values)
         call show_reals([real(values(k)), aimag(values(k))])
      end do
   end subroutine show_complexes

   subroutine show_reals(values)
      real(wp), intent(in) :: values(:)
      integer :: k

      do k = 1, size(values)
         write (output_unit, "(1x, z16.16)", advance="no") transfer(values(k), 1_long)
      end do
   end subroutine show_reals
end program read_cases
