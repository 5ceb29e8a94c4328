!> Abstract linear operators, defined by their action on a block of vectors: all that the eigensolvers know of a problem. Extend
!> one of the types to supply your own.
module kschur_operator
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   implicit none
   private
   public :: real_operator_type, symmetric_operator_type, complex_operator_type

   !> An operator on real vectors.
   type, abstract :: real_operator_type
   contains
      !> Length of the vectors.
      procedure(order_real), deferred :: order
      !> y := C x for a block of vectors.
      procedure(apply_real), deferred :: apply
   end type real_operator_type

   !> An operator C that is self-adjoint in the inner product x^T B y of its
   !> metric B, symmetric and positive semidefinite: B C is symmetric.
   type, abstract, extends(real_operator_type) :: symmetric_operator_type
   contains
      !> y := B x for a block of vectors.
      procedure(apply_metric), deferred :: apply_metric
      !> Projects vectors of unit norm onto the range of C, to remove rounding errors outside it. `noise` is the accuracy of the
      !> result; 0 if nothing was done.
      procedure :: restrict => no_restriction
      !> Removes from vectors of any norm what lies outside the range of C, if that is cheap: rounding errors, which combinations
      !> of vectors amplify from step to step.
      procedure :: clean => no_cleaning
      !> The operator on distributed vectors, called by all processes with their rows; null if this process has all rows.
      procedure :: by_rows => not_distributed
   end type symmetric_operator_type

   !> An operator on complex vectors.
   type, abstract :: complex_operator_type
   contains
      !> Length of the vectors.
      procedure(order_complex), deferred :: order
      !> y := C x for a block of vectors.
      procedure(apply_complex), deferred :: apply
   end type complex_operator_type

   abstract interface
      integer function order_real(self)
         import :: real_operator_type
         class(real_operator_type), intent(in) :: self
      end function order_real

      integer function order_complex(self)
         import :: complex_operator_type
         class(complex_operator_type), intent(in) :: self
      end function order_complex

      subroutine apply_real(self, x, y, error)
         import :: real_operator_type, wp, error_type
         class(real_operator_type), intent(inout) :: self
         real(wp), contiguous, intent(in) :: x(:, :)
         real(wp), contiguous, intent(out) :: y(:, :)
         type(error_type), allocatable, intent(out) :: error
      end subroutine apply_real

      subroutine apply_metric(self, x, y, error)
         import :: symmetric_operator_type, wp, error_type
         class(symmetric_operator_type), intent(inout) :: self
         real(wp), contiguous, intent(in) :: x(:, :)
         real(wp), contiguous, intent(out) :: y(:, :)
         type(error_type), allocatable, intent(out) :: error
      end subroutine apply_metric

      subroutine apply_complex(self, x, y, error)
         import :: complex_operator_type, wp, error_type
         class(complex_operator_type), intent(inout) :: self
         complex(wp), contiguous, intent(in) :: x(:, :)
         complex(wp), contiguous, intent(out) :: y(:, :)
         type(error_type), allocatable, intent(out) :: error
      end subroutine apply_complex
   end interface

contains

   ! Default of `by_rows`: this process has all rows.
   function not_distributed(self) result(part)
      class(symmetric_operator_type), target, intent(in) :: self
      class(symmetric_operator_type), pointer :: part

      associate (unused => self)
      end associate
      nullify (part)
   end function not_distributed

   ! Default of `clean`.
   subroutine no_cleaning(self, x)
      class(symmetric_operator_type), intent(in) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)

      associate (unused => self, nor => x)
      end associate
   end subroutine no_cleaning

   ! Default of `restrict`: leaves the vectors as they are.
   subroutine no_restriction(self, x, noise, error)
      class(symmetric_operator_type), intent(inout) :: self
      real(wp), contiguous, intent(inout) :: x(:, :)
      real(wp), intent(out) :: noise
      type(error_type), allocatable, intent(out) :: error

      associate (unused => self, nor => x)
      end associate
      noise = 0
   end subroutine no_restriction
end module kschur_operator
