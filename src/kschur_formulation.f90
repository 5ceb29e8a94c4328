!> Which formulation of a problem is solved: the one that was asked for, if it
!> fits, or the smallest exact one.
module kschur_formulation
   use kschur_direct_solver, only: direct_real_type
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_options, only: formulation_auto, formulation_names, formulation_proportional, formulation_quadratic, &
      formulation_symmetric, formulation_undamped, formulation_undamped_constrained
   use kschur_pencil, only: check_fit
   use kschur_problem, only: modal_problem_type, damping_general, damping_none
   use kschur_symmetric_transform, only: mass_is_semidefinite
   implicit none
   private
   public :: choose_formulation, is_structured, smallest_formulation

contains

   !> The smallest formulation that is exact for a problem with a mass matrix
   !> that has no negative eigenvalue: one of `formulation_*`.
   pure integer function smallest_formulation(problem) result(formulation)
      type(modal_problem_type), intent(in) :: problem

      if (problem%symmetric .and. problem%damping_kind == damping_none) then
         formulation = formulation_symmetric
      else if (problem%symmetric .and. problem%damping_kind /= damping_general) then
         formulation = formulation_proportional
      else
         formulation = general_formulation(problem)
      end if
   end function smallest_formulation

   pure integer function general_formulation(problem) result(formulation)
      type(modal_problem_type), intent(in) :: problem

      formulation = formulation_quadratic
      if (problem%damping_kind == damping_none) &
         formulation = merge(formulation_undamped_constrained, formulation_undamped, problem%multipliers() > 0)
   end function general_formulation

   !> Whether a formulation is not an explicit pencil of Table 1.
   pure logical function is_structured(formulation)
      integer, intent(in) :: formulation

      is_structured = any(formulation == [formulation_quadratic, formulation_symmetric, formulation_proportional])
   end function is_structured

   !> The formulation that was asked for, or the smallest for `formulation_auto`.
   !> Fails where it does not fit the problem, with the reason.
   subroutine choose_formulation(problem, asked, formulation, error)
      type(modal_problem_type), intent(in) :: problem
      !> One of `formulation_*`.
      integer, intent(in) :: asked
      integer, intent(out) :: formulation
      type(error_type), allocatable, intent(out) :: error
      type(direct_real_type) :: solver
      character(len=:), allocatable :: name
      logical :: semidefinite

      formulation = asked
      if (asked == formulation_auto) formulation = smallest_formulation(problem)
      if (.not. is_structured(formulation)) then
         call check_fit(problem, formulation, error)
         return
      end if
      if (formulation == formulation_quadratic) return
      name = "the formulation "//trim(formulation_names(formulation))//" does not fit the problem: "
      if (.not. problem%symmetric) then
         call new_error(error, error_usage, name//"its matrices are not symmetric")
      else if (formulation == formulation_symmetric .and. problem%damping_kind /= damping_none) then
         call new_error(error, error_usage, name//"it has damping")
      else if (problem%damping_kind == damping_general) then
         call new_error(error, error_usage, name//"its damping is not proportional")
      end if
      if (allocated(error)) return
      call mass_is_semidefinite(problem, solver, semidefinite, error)
      if (allocated(error)) return
      if (semidefinite) return
      if (asked == formulation_auto) then
         formulation = general_formulation(problem)
      else
         call new_error(error, error_usage, name//"its mass matrix has negative eigenvalues")
      end if
   end subroutine choose_formulation
end module kschur_formulation
