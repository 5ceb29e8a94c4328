!> Modal properties: directions from a file, and what is printed.
module cli_properties
   use cli_arguments, only: arguments_type
   use cli_columns, only: print_columns
   use cli_numbers, only: rounded
   use cli_output, only: format_table
   use cli_system, only: print_line
   use kschur, only: csr_matrix_type, error_file, error_input, error_type, modal_properties_type, new_error, &
      read_matrix_market, text, wp
   implicit none
   private
   public :: print_properties, read_directions, take_properties

contains

   !> Takes --properties and --directions FILE, which implies it.
   subroutine take_properties(arguments, wanted, directions, error)
      type(arguments_type), intent(inout) :: arguments
      logical, intent(out) :: wanted
      !> A Matrix Market file; not allocated where none was given.
      character(len=:), allocatable, intent(out) :: directions
      type(error_type), allocatable, intent(inout) :: error

      call arguments%take_flag("--properties", wanted, error)
      call arguments%take_text("--directions", directions, error)
      wanted = wanted .or. allocated(directions)
   end subroutine take_properties

   !> The columns of a Matrix Market file; none where there is no file.
   subroutine read_directions(path, n, directions, error)
      character(len=:), allocatable, intent(in) :: path
      integer, intent(in) :: n
      real(wp), allocatable, intent(out) :: directions(:, :)
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: matrix
      integer :: i, k

      if (.not. allocated(path)) then
         allocate (directions(n, 0))
         return
      end if
      call read_matrix_market(matrix, path, error)
      if (allocated(error)) then
         if (error%code == error_file) error%code = error_input
         return
      end if
      if (matrix%rows /= n) then
         call new_error(error, error_input, path//": the directions have "//text(matrix%rows)// &
            " entries, but the problem has "//text(n)//" unknowns")
         return
      end if
      allocate (directions(matrix%rows, matrix%columns), source=0.0_wp)
      do i = 1, matrix%rows
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            directions(i, matrix%column(k)) = matrix%value(k)
         end do
      end do
   end subroutine read_directions

   !> Prints the table of the properties, with what the modes weigh in all.
   subroutine print_properties(properties)
      type(modal_properties_type), intent(in) :: properties
      character(len=15), allocatable :: names(:), units(:)
      real(wp), allocatable :: values(:, :)
      integer :: d, j

      d = size(properties%total_mass)
      allocate (names(5 + 2*d), units(5 + 2*d), values(size(properties%mass), 5 + 2*d))
      names(:5) = [character(len=15) :: "mass", "damping", "stiffness", "Re a", "Im a"]
      units = ""
      values(:, 1) = properties%mass
      values(:, 2) = properties%damping
      values(:, 3) = properties%stiffness
      values(:, 4) = real(properties%a, wp)
      values(:, 5) = aimag(properties%a)
      do j = 1, d
         names(4 + 2*j:5 + 2*j) = [character(len=15) :: "participation", "effective mass"]
         units(4 + 2*j:5 + 2*j) = "direction "//text(j)
         values(:, 4 + 2*j) = without_rounding(real(properties%participation(:, j), wp))
         values(:, 5 + 2*j) = without_rounding(properties%effective_mass(:, j))
      end do
      call print_line("")
      call print_columns("mode", names, units, values, format_table)
      do j = 1, d
         call print_line("direction "//text(j)//": the modes have "//rounded(sum(properties%effective_mass(:, j)))//" of "// &
            rounded(properties%total_mass(j)))
      end do
   end subroutine print_properties

   ! What is far below the others is zero but for rounding.
   pure function without_rounding(values) result(kept)
      real(wp), intent(in) :: values(:)
      real(wp) :: kept(size(values))
      real(wp), parameter :: rounding = 1.0e-9_wp

      kept = values
      where (abs(values) <= rounding*maxval(abs(values))) kept = 0
   end function without_rounding
end module cli_properties
