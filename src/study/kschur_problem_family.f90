!> Problems that depend on a parameter.
module kschur_problem_family
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_loss, only: loss_or_none
   use kschur_problem, only: modal_problem_type
   use kschur_sparse, only: csr_matrix_type, linear_combination
   implicit none
   private
   public :: interpolate, problem_family_type

   !> Abstract type; extend it to provide a problem at any value.
   type, abstract :: problem_family_type
   contains
      !> The problem at a value.
      procedure(at_interface), deferred :: at
   end type problem_family_type

   abstract interface
      subroutine at_interface(self, value, problem, error)
         import :: error_type, modal_problem_type, problem_family_type, wp
         class(problem_family_type), intent(inout) :: self
         real(wp), intent(in) :: value
         type(modal_problem_type), intent(out) :: problem
         type(error_type), allocatable, intent(out) :: error
      end subroutine at_interface
   end interface

contains

   !> Interpolates the matrices linearly between two problems.
   pure subroutine interpolate(from, to, part, problem)
      type(modal_problem_type), intent(in) :: from, to
      !> From 0 to 1.
      real(wp), intent(in) :: part
      type(modal_problem_type), intent(out) :: problem

      problem%symmetric = from%symmetric .and. to%symmetric
      problem%mass = between(from%mass, to%mass, part)
      problem%damping = between(from%damping, to%damping, part)
      problem%stiffness = between(from%stiffness, to%stiffness, part)
      problem%constraints = between(from%constraints, to%constraints, part)
      if (.not. (allocated(from%loss) .or. allocated(to%loss))) return
      allocate (problem%loss, source=between(loss_or_none(from%stiffness, from%loss), loss_or_none(to%stiffness, to%loss), part))
   end subroutine interpolate

   ! A + part (B - A); entries that are equal in both are copied exactly.
   pure function between(from, to, part) result(matrix)
      type(csr_matrix_type), intent(in) :: from, to
      real(wp), intent(in) :: part
      type(csr_matrix_type) :: matrix

      matrix = linear_combination(1.0_wp, from, part, linear_combination(1.0_wp, to, -1.0_wp, from))
   end function between
end module kschur_problem_family
