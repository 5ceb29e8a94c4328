!> Sums over the rows of distributed vectors. This build has one process with all rows; `with/mpi` has the module for several.
module kschur_row_sums
   use kschur_kinds, only: wp, xp
   implicit none
   private
   public :: row_sums_type

   !> The processes that share the rows.
   type :: row_sums_type
   contains
      !> Replaces the partial sums of each process by the total, identical in all (all-reduce).
      generic :: add_up => add_up_real, add_up_complex, add_up_extended
      procedure, private :: add_up_real
      procedure, private :: add_up_complex
      procedure, private :: add_up_extended
      !> Broadcasts numbers of the first process.
      procedure :: send
      !> The 2-norm of a distributed vector from the 2-norm of its rows in this process.
      procedure :: length
   end type row_sums_type

contains

   subroutine add_up_real(self, c)
      class(row_sums_type), intent(in) :: self
      real(wp), intent(inout) :: c(:, :)

      associate (unused => self, unchanged => c)
      end associate
   end subroutine add_up_real

   subroutine add_up_complex(self, c)
      class(row_sums_type), intent(in) :: self
      complex(wp), intent(inout) :: c(:, :)

      associate (unused => self, unchanged => c)
      end associate
   end subroutine add_up_complex

   subroutine add_up_extended(self, c)
      class(row_sums_type), intent(in) :: self
      real(xp), intent(inout) :: c(:, :)

      associate (unused => self, unchanged => c)
      end associate
   end subroutine add_up_extended

   subroutine send(self, entries, c)
      class(row_sums_type), intent(in) :: self
      integer, intent(in) :: entries
      real(wp), intent(inout) :: c(entries)

      associate (unused => self, unchanged => c)
      end associate
   end subroutine send

   real(wp) function length(self, here)
      class(row_sums_type), intent(in) :: self
      real(wp), intent(in) :: here

      associate (unused => self)
      end associate
      length = here
   end function length
end module kschur_row_sums
