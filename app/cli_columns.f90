!> Columns of numbers with names, as a table, JSON or comma-separated values.
module cli_columns
   use cli_colour, only: bold, coloured
   use cli_numbers, only: aligned, plain
   use cli_output, only: format_csv, format_json
   use cli_system, only: print_line
   use kschur, only: text, wp
   implicit none
   private
   public :: print_columns

contains

   !> Prints columns on standard output; each row starts with its number.
   subroutine print_columns(what, names, units, values, format)
      !> Name of a row, as "mode".
      character(len=*), intent(in) :: what
      !> Names as in JSON and CSV; the table replaces underscores by blanks.
      character(len=*), intent(in) :: names(:)
      !> For the table.
      character(len=*), intent(in) :: units(:)
      !> Rows x columns; nonfinite values are unknown.
      real(wp), intent(in) :: values(:, :)
      !> One of `format_*`.
      integer, intent(in) :: format

      select case (format)
      case (format_csv)
         call print_values(what, names, values)
      case (format_json)
         call print_objects(what, names, values)
      case default
         call print_table(what, names, units, values)
      end select
   end subroutine print_columns

   ! Prints comma-separated values, after a line of names.
   subroutine print_values(what, names, values)
      character(len=*), intent(in) :: what, names(:)
      real(wp), intent(in) :: values(:, :)
      character(len=:), allocatable :: line
      integer :: i, j

      line = what
      do j = 1, size(names)
         line = line//","//trim(names(j))
      end do
      call print_line(line)
      do i = 1, size(values, 1)
         line = text(i)
         do j = 1, size(names)
            line = line//","//plain(values(i, j), "")
         end do
         call print_line(line)
      end do
   end subroutine print_values

   ! Prints a JSON array with an object for each row.
   subroutine print_objects(what, names, values)
      character(len=*), intent(in) :: what, names(:)
      real(wp), intent(in) :: values(:, :)
      character(len=:), allocatable :: line
      integer :: i, j

      call print_line("[")
      do i = 1, size(values, 1)
         line = '  {"'//what//'": '//text(i)
         do j = 1, size(names)
            line = line//', "'//trim(names(j))//'": '//plain(values(i, j), "null")
         end do
         call print_line(line//"}"//trim(merge(",", " ", i < size(values, 1))))
      end do
      call print_line("]")
   end subroutine print_objects

   subroutine print_table(what, names, units, values)
      character(len=*), intent(in) :: what, names(:), units(:)
      real(wp), intent(in) :: values(:, :)
      character(len=15), allocatable :: cells(:, :)
      integer :: i, j

      allocate (cells(-1:size(values, 1), size(names)))
      do j = 1, size(names)
         cells(-1, j) = adjustr(heading(names(j)))
         cells(0, j) = adjustr(heading(units(j)))
         cells(1:, j) = aligned(values(:, j))
      end do
      call print_line(coloured(row(what//repeat(" ", max(0, 5 - len(what))), cells(-1, :)), bold))
      call print_line(coloured(row("     ", cells(0, :)), bold))
      do i = 1, size(values, 1)
         call print_line(row(repeat(" ", max(0, 5 - len(text(i))))//text(i), cells(i, :)))
      end do
   end subroutine print_table

   pure function row(first, cells) result(line)
      character(len=*), intent(in) :: first
      character(len=15), intent(in) :: cells(:)
      character(len=:), allocatable :: line
      integer :: j

      line = first
      do j = 1, size(cells)
         line = line//cells(j)
      end do
      line = trim(line)
   end function row

   ! Name of a column in the table: underscores replaced by blanks.
   pure function heading(name)
      character(len=*), intent(in) :: name
      character(len=15) :: heading
      integer :: i

      heading = name
      do i = 1, len(heading)
         if (heading(i:i) == "_") heading(i:i) = " "
      end do
   end function heading
end module cli_columns
