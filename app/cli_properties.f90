!> Modal properties: reads directions from a file, and prints tables.
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

   !> The columns of a Matrix Market file; not allocated where there is no file.
   subroutine read_directions(path, n, directions, error)
      character(len=:), allocatable, intent(in) :: path
      integer, intent(in) :: n
      real(wp), allocatable, intent(out) :: directions(:, :)
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: matrix
      integer :: i, k

      if (.not. allocated(path)) return
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

   !> Prints tables of the properties, with total effective masses.
   subroutine print_properties(properties)
      type(modal_properties_type), intent(in) :: properties
      character(len=15), parameter :: names(5) = [character(len=15) :: "mass", "damping", "stiffness", "Re a", "Im a"]
      real(wp), allocatable :: factor(:, :), mass(:, :)
      integer :: j, d

      d = size(properties%total_mass)
      call print_line("")
      call print_columns("mode", names, spread("", 1, size(names)), reshape([properties%mass, properties%damping, &
         properties%stiffness, real(properties%a, wp), aimag(properties%a)], [size(properties%mass), size(names)]), format_table)
      if (d == 0) return
      allocate (factor, source=real(properties%participation, wp))
      allocate (mass, source=properties%effective_mass)
      where (is_rounding(properties)) factor = 0
      where (is_rounding(properties)) mass = 0
      call print_line("")
      call print_columns("mode", properties%direction, spread("participation", 1, d), factor, format_table)
      call print_line("")
      call print_columns("mode", properties%direction, spread("effective mass", 1, d), mass, format_table)
      call print_line("")
      do j = 1, d
         call print_line("direction "//trim(properties%direction(j))//": the modes have "//rounded(sum(mass(:, j)))//" of "// &
            rounded(properties%total_mass(j)))
      end do
   end subroutine print_properties

   ! Whether the effective mass of a mode along a direction is rounding: it is a square, so that a relative error of 1e-9 counts as
   ! 1e-18 of the total mass.
   pure function is_rounding(properties)
      type(modal_properties_type), intent(in) :: properties
      logical :: is_rounding(size(properties%mass), size(properties%total_mass))
      real(wp), parameter :: rounding = 1.0e-18_wp

      is_rounding = abs(properties%effective_mass) <= rounding*spread(properties%total_mass, 1, size(is_rounding, 1))
   end function is_rounding
end module cli_properties
