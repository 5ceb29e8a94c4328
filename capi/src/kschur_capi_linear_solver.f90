!> Adapters of C callbacks to linear solvers.
module kschur_capi_linear_solver
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_double_complex, c_f_procpointer, c_funptr, c_int, &
      c_int32_t, c_int64_t, c_null_funptr, c_null_ptr, c_ptr
   use kschur, only: complex_csr_matrix_type, complex_linear_solver_type, csr_matrix_type, error_singular, error_type, &
      matrix_structure_type, new_error, real_linear_solver_type, wp
   use kschur_capi_status, only: check_returned
   implicit none
   private
   public :: solver_callbacks_type, called_real_solver_type, called_complex_solver_type

   !> A kschur_factorize_callback, a kschur_solve_callback and a kschur_release_callback, with their context.
   type :: solver_callbacks_type
      type(c_funptr) :: factorize = c_null_funptr, solve = c_null_funptr, release = c_null_funptr
      type(c_ptr) :: context = c_null_ptr
   end type solver_callbacks_type

   ! Factors of one matrix, which belong to the caller; released when they are finalized. Never copied, as that would release them
   ! twice: solvers are copied before they factor.
   type :: factors_type
      type(solver_callbacks_type) :: callbacks
      type(c_ptr) :: address = c_null_ptr
      logical :: exist = .false.
   contains
      final :: release
   end type factors_type

   !> Solver for real matrices that calls callbacks.
   type, extends(real_linear_solver_type) :: called_real_solver_type
      type(solver_callbacks_type) :: callbacks
      type(factors_type), private :: factors
      integer, private :: n = 0
   contains
      procedure :: factorize => factorize_real
      procedure :: solve => solve_real
      procedure :: solve_adjoint => solve_adjoint_real
   end type called_real_solver_type

   !> Solver for complex matrices that calls callbacks.
   type, extends(complex_linear_solver_type) :: called_complex_solver_type
      type(solver_callbacks_type) :: callbacks
      type(factors_type), private :: factors
      integer, private :: n = 0
   contains
      procedure :: factorize => factorize_complex
      procedure :: solve => solve_complex
      procedure :: solve_adjoint => solve_adjoint_complex
   end type called_complex_solver_type

   abstract interface
      integer(c_int) function factorize_real_interface(context, n, entries, row_start, column, value, symmetric, factors) bind(c)
         import :: c_double, c_int, c_int32_t, c_int64_t, c_ptr
         type(c_ptr), value :: context
         integer(c_int64_t), value :: n, entries
         integer(c_int32_t), intent(in) :: row_start(*), column(*)
         real(c_double), intent(in) :: value(*)
         integer(c_int), value :: symmetric
         type(c_ptr), intent(inout) :: factors
      end function factorize_real_interface

      integer(c_int) function factorize_complex_interface(context, n, entries, row_start, column, value, symmetric, factors) &
         bind(c)
         import :: c_double_complex, c_int, c_int32_t, c_int64_t, c_ptr
         type(c_ptr), value :: context
         integer(c_int64_t), value :: n, entries
         integer(c_int32_t), intent(in) :: row_start(*), column(*)
         complex(c_double_complex), intent(in) :: value(*)
         integer(c_int), value :: symmetric
         type(c_ptr), intent(inout) :: factors
      end function factorize_complex_interface

      integer(c_int) function solve_real_interface(context, factors, adjoint, n, vectors, x) bind(c)
         import :: c_double, c_int, c_int64_t, c_ptr
         type(c_ptr), value :: context, factors
         integer(c_int), value :: adjoint
         integer(c_int64_t), value :: n, vectors
         real(c_double), intent(inout) :: x(*)
      end function solve_real_interface

      integer(c_int) function solve_complex_interface(context, factors, adjoint, n, vectors, x) bind(c)
         import :: c_double_complex, c_int, c_int64_t, c_ptr
         type(c_ptr), value :: context, factors
         integer(c_int), value :: adjoint
         integer(c_int64_t), value :: n, vectors
         complex(c_double_complex), intent(inout) :: x(*)
      end function solve_complex_interface

      subroutine release_interface(context, factors) bind(c)
         import :: c_ptr
         type(c_ptr), value :: context, factors
      end subroutine release_interface
   end interface

contains

   subroutine factorize_real(self, matrix, structure, error)
      class(called_real_solver_type), intent(inout) :: self
      type(csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error
      procedure(factorize_real_interface), pointer :: callback
      integer(c_int) :: returned

      call release(self%factors)
      self%factors%callbacks = self%callbacks
      self%n = matrix%rows
      self%description = "callbacks: the matrix is real"
      call c_f_procpointer(self%callbacks%factorize, callback)
      returned = callback(self%callbacks%context, int(matrix%rows, c_int64_t), &
         int(matrix%nonzeros(), c_int64_t), matrix%row_start - 1, matrix%column - 1, matrix%value, &
         merge(1, 0, structure%symmetric), self%factors%address)
      call conclude(self%factors, returned, error)
   end subroutine factorize_real

   subroutine factorize_complex(self, matrix, structure, error)
      class(called_complex_solver_type), intent(inout) :: self
      type(complex_csr_matrix_type), intent(in) :: matrix
      type(matrix_structure_type), intent(in) :: structure
      type(error_type), allocatable, intent(out) :: error
      procedure(factorize_complex_interface), pointer :: callback
      integer(c_int) :: returned

      call release(self%factors)
      self%factors%callbacks = self%callbacks
      self%n = matrix%rows
      self%description = "callbacks: the matrix is complex"
      call c_f_procpointer(self%callbacks%factorize, callback)
      returned = callback(self%callbacks%context, int(matrix%rows, c_int64_t), &
         size(matrix%column, kind=c_int64_t), matrix%row_start - 1, matrix%column - 1, matrix%value, &
         merge(1, 0, structure%symmetric), self%factors%address)
      call conclude(self%factors, returned, error)
   end subroutine factorize_complex

   ! Raises an error if a factorisation returned a failure, `error_singular` for a singular matrix; else the factors exist.
   subroutine conclude(factors, returned, error)
      type(factors_type), intent(inout) :: factors
      integer(c_int), intent(in) :: returned
      type(error_type), allocatable, intent(out) :: error

      factors%exist = returned == 0
      if (returned == error_singular) then
         call new_error(error, error_singular, "the callback 'factorize' found the matrix to be singular")
      else
         call check_returned(returned, "factorize", error)
      end if
   end subroutine conclude

   subroutine solve_real(self, x, error)
      class(called_real_solver_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      call substitute_real(self, x, 0_c_int, error)
   end subroutine solve_real

   subroutine solve_adjoint_real(self, x, error)
      class(called_real_solver_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      call substitute_real(self, x, 1_c_int, error)
   end subroutine solve_adjoint_real

   ! Solves by the callback with the matrix, or with its adjoint if `adjoint` is 1.
   subroutine substitute_real(self, x, adjoint, error)
      class(called_real_solver_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      integer(c_int), intent(in) :: adjoint
      type(error_type), allocatable, intent(out) :: error
      procedure(solve_real_interface), pointer :: callback

      call c_f_procpointer(self%callbacks%solve, callback)
      call check_returned(callback(self%callbacks%context, self%factors%address, adjoint, int(self%n, c_int64_t), &
         size(x, 2, c_int64_t), x), "solve", error)
   end subroutine substitute_real

   subroutine solve_complex(self, x, error)
      class(called_complex_solver_type), intent(inout) :: self
      complex(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      call substitute_complex(self, x, 0_c_int, error)
   end subroutine solve_complex

   subroutine solve_adjoint_complex(self, x, error)
      class(called_complex_solver_type), intent(inout) :: self
      complex(wp), contiguous, intent(inout) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error

      call substitute_complex(self, x, 1_c_int, error)
   end subroutine solve_adjoint_complex

   ! Solves by the callback with the matrix, or with its adjoint if `adjoint` is 1.
   subroutine substitute_complex(self, x, adjoint, error)
      class(called_complex_solver_type), intent(inout) :: self
      complex(wp), contiguous, intent(inout) :: x(:, :)
      integer(c_int), intent(in) :: adjoint
      type(error_type), allocatable, intent(out) :: error
      procedure(solve_complex_interface), pointer :: callback

      call c_f_procpointer(self%callbacks%solve, callback)
      call check_returned(callback(self%callbacks%context, self%factors%address, adjoint, int(self%n, c_int64_t), &
         size(x, 2, c_int64_t), x), "solve", error)
   end subroutine substitute_complex

   ! Releases factors by the callback, if they exist and there is one.
   impure elemental subroutine release(factors)
      type(factors_type), intent(inout) :: factors
      procedure(release_interface), pointer :: callback

      if (factors%exist .and. c_associated(factors%callbacks%release)) then
         call c_f_procpointer(factors%callbacks%release, callback)
         call callback(factors%callbacks%context, factors%address)
      end if
      factors%exist = .false.
      factors%address = c_null_ptr
   end subroutine release
end module kschur_capi_linear_solver
