!> Distribution of right-hand sides and solutions by rows over the processes. This build has one process with all rows;
!> `with/mpi` has the module for several.
module kschur_solution_rows
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_processes, only: processes_type
   implicit none
   private
   public :: solution_rows_type

   !> The distribution.
   type :: solution_rows_type
      private
      ! Without a component with a value gfortran makes no structure constructor of the types that this one is in.
      integer :: processes = 1
   contains
      procedure :: begin
      !> Number of the rows of this process, and their indices.
      procedure :: rows
      procedure :: row_numbers
      !> Fails in all processes if one failed.
      procedure :: agree
      !> Moves solutions from the processes of their pivots to those of their rows.
      generic :: redistribute => redistribute_real, redistribute_complex
      procedure, private :: redistribute_real, redistribute_complex
      !> Scatters whole vectors of the first process, and gathers them.
      generic :: scatter => scatter_real, scatter_complex
      procedure, private :: scatter_real, scatter_complex
      generic :: gather => gather_real, gather_complex
      procedure, private :: gather_real, gather_complex
   end type solution_rows_type

contains

   subroutine begin(self, unknowns, multipliers, processes)
      class(solution_rows_type), intent(in) :: self
      !> Rows of a vector: unknowns first, then multipliers.
      integer, intent(in) :: unknowns, multipliers
      type(processes_type), pointer, intent(in) :: processes

      associate (unused => self, also => unknowns, too => multipliers, neither => processes)
      end associate
   end subroutine begin

   pure integer function rows(self)
      class(solution_rows_type), intent(in) :: self

      associate (unused => self)
      end associate
      rows = 0
   end function rows

   pure function row_numbers(self)
      class(solution_rows_type), intent(in) :: self
      integer :: row_numbers(0)

      associate (unused => self)
      end associate
      row_numbers = [integer ::]
   end function row_numbers

   subroutine agree(self, error)
      class(solution_rows_type), intent(in) :: self
      type(error_type), allocatable, intent(inout) :: error

      associate (unused => self, unchanged => error)
      end associate
   end subroutine agree

   subroutine redistribute_real(self, row, solutions, x)
      class(solution_rows_type), intent(in) :: self
      !> Indices of the rows of `solutions`.
      integer, intent(in) :: row(:)
      real(wp), intent(in) :: solutions(:, :)
      !> As many columns; the local rows.
      real(wp), intent(inout) :: x(:, :)

      associate (unused => self, also => row, too => solutions, unchanged => x)
      end associate
   end subroutine redistribute_real

   subroutine redistribute_complex(self, row, solutions, x)
      class(solution_rows_type), intent(in) :: self
      integer, intent(in) :: row(:)
      complex(wp), intent(in) :: solutions(:, :)
      complex(wp), intent(inout) :: x(:, :)

      associate (unused => self, also => row, too => solutions, unchanged => x)
      end associate
   end subroutine redistribute_complex

   subroutine scatter_real(self, x, part)
      class(solution_rows_type), intent(in) :: self
      real(wp), contiguous, intent(in) :: x(:, :)
      real(wp), contiguous, intent(inout) :: part(:, :)

      associate (unused => self, also => x, unchanged => part)
      end associate
   end subroutine scatter_real

   subroutine scatter_complex(self, x, part)
      class(solution_rows_type), intent(in) :: self
      complex(wp), contiguous, intent(in) :: x(:, :)
      complex(wp), contiguous, intent(inout) :: part(:, :)

      associate (unused => self, also => x, unchanged => part)
      end associate
   end subroutine scatter_complex

   subroutine gather_real(self, part, x)
      class(solution_rows_type), intent(in) :: self
      real(wp), contiguous, intent(in) :: part(:, :)
      real(wp), contiguous, intent(inout) :: x(:, :)

      associate (unused => self, also => part, unchanged => x)
      end associate
   end subroutine gather_real

   subroutine gather_complex(self, part, x)
      class(solution_rows_type), intent(in) :: self
      complex(wp), contiguous, intent(in) :: part(:, :)
      complex(wp), contiguous, intent(inout) :: x(:, :)

      associate (unused => self, also => part, unchanged => x)
      end associate
   end subroutine gather_complex
end module kschur_solution_rows
