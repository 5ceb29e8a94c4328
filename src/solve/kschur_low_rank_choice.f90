!> Whether the low-rank form, where it fits, is cheaper than the quadratic one.
module kschur_low_rank_choice
   use kschur_context, only: solve_context_type
   use kschur_error, only: error_type
   use kschur_local_forces, only: local_forces_type, new_local_forces
   use kschur_options, only: formulation_auto, formulation_low_rank, formulation_quadratic, method_krylov_schur
   use kschur_text, only: text
   implicit none
   private
   public :: leave_low_rank, settle_low_rank

   ! Where both took as many seconds on grids: forces of this rank, and so much more for each mode.
   real, parameter :: of_rank = 2, of_rank_a_mode = 0.25

contains

   !> Takes the low-rank form back where `formulation_auto` chose it and it would cost more, or could not be completed by
   !> a count.
   subroutine settle_low_rank(s, error)
      type(solve_context_type), intent(inout) :: s
      type(error_type), allocatable, intent(out) :: error
      type(local_forces_type) :: forces
      logical :: few

      if (s%options%formulation /= formulation_auto .or. s%formulation /= formulation_low_rank) return
      call new_local_forces(s%problem, forces, few, error)
      if (allocated(error)) return
      if (s%options%method /= method_krylov_schur .or. s%options%subspace > 0 .or. .not. allocated(s%inner%counting)) then
         call leave_low_rank(s, "the damping is not a combination of mass and stiffness")
      else if (forces%rank() > of_rank + of_rank_a_mode*s%options%modes) then
         call leave_low_rank(s, "the damping has a part of rank "//text(forces%rank())// &
            " that is no combination of mass and stiffness: too much for so few modes")
      end if
   end subroutine settle_low_rank

   !> Takes the quadratic form instead.
   subroutine leave_low_rank(s, reason)
      type(solve_context_type), intent(inout) :: s
      character(len=*), intent(in) :: reason

      s%formulation = formulation_quadratic
      s%decision = reason
   end subroutine leave_low_rank
end module kschur_low_rank_choice
