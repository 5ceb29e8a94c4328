!> Whether all eigenvalues at once are cheaper than an iteration for some.
module kschur_dense_choice
   use kschur_context, only: solve_context_type
   use kschur_formulation, only: is_structured
   use kschur_options, only: formulation_auto, formulation_low_rank, formulation_quadratic, inner_auto, method_krylov_schur
   use kschur_text, only: text
   implicit none
   private
   public :: consider_dense, dense_may_end_stall, dense_may_tell, settle_dense

   ! Where both cost as many instructions, measured with 5 to 40 modes of beams and rotors of 100 to 300 states.
   integer, parameter :: of_states = 40, of_states_a_mode = 6
   ! The same of motions, whose matrix is symmetric, with 10 to 100 modes of chains of 60 to 240.
   integer, parameter :: of_motions = 60, of_motions_a_mode = 3
   ! Beyond this order it was not measured.
   integer, parameter :: most = 600

contains

   !> Sets `dense` where `formulation_auto` takes it: nobody asked for what only an iteration has, and the matrix is small.
   subroutine consider_dense(s)
      type(solve_context_type), intent(inout) :: s
      integer :: limit

      if (s%options%formulation /= formulation_auto) return
      limit = min(most, merge(of_states + of_states_a_mode*s%options%modes, of_motions + of_motions_a_mode*s%options%modes, &
         theta_is_lambda(s)))
      s%dense = leaves_open(s) .and. is_structured(s%formulation) .and. size_of_matrix(s) <= limit
      if (s%dense .and. s%formulation == formulation_low_rank) s%formulation = formulation_quadratic
   end subroutine consider_dense

   !> Takes that back where it is not known how many eigenvalues there are, or where the rigid motions are all.
   subroutine settle_dense(s)
      type(solve_context_type), intent(inout) :: s

      if (.not. s%dense .or. s%options%formulation /= formulation_auto) return
      s%dense = (s%known%total%exact .or. (s%is_lossy() .and. theta_is_lambda(s))) .and. .not. s%only_rigid()
      if (s%dense) s%decision = "dense: order "//text(order_of_matrix(s))//", cheaper than an iteration"
   end subroutine settle_dense

   !> Whether all eigenvalues may yet tell what an iteration did not: nobody asked for one, they were not computed before, and
   !> that does not take long.
   pure logical function dense_may_tell(s)
      !> That of the iteration.
      type(solve_context_type), intent(in) :: s

      dense_may_tell = s%options%formulation == formulation_auto .and. leaves_open(s) .and. .not. s%dense .and. &
         size_of_matrix(s) <= most
   end function dense_may_tell

   !> The same where an iteration stalls, as in a crowd of real eigenvalues, which no shift tells apart: up to half a minute.
   pure logical function dense_may_end_stall(s)
      type(solve_context_type), intent(in) :: s
      ! Of states, and of motions.
      integer, parameter :: most_states = 2000, most_motions = 3000

      dense_may_end_stall = s%options%formulation == formulation_auto .and. leaves_open(s) .and. .not. s%dense .and. &
         size_of_matrix(s) <= merge(most_states, most_motions, theta_is_lambda(s))
   end function dense_may_end_stall

   ! Whether nothing was asked for that only an iteration has.
   pure logical function leaves_open(s)
      type(solve_context_type), intent(in) :: s

      associate (o => s%options)
         leaves_open = s%may_be_dense .and. o%method == method_krylov_schur .and. o%inner == inner_auto .and. &
            o%subspace == 0 .and. o%block == 0 .and. .not. allocated(o%shift)
      end associate
   end function leaves_open

   pure logical function theta_is_lambda(s)
      type(solve_context_type), intent(in) :: s

      theta_is_lambda = any(s%formulation == [formulation_quadratic, formulation_low_rank])
   end function theta_is_lambda

   ! The null space of many constraints costs as much as a matrix of that order.
   pure integer function size_of_matrix(s)
      type(solve_context_type), intent(in) :: s

      size_of_matrix = max(order_of_matrix(s), s%work%unknowns())
   end function size_of_matrix

   ! Of the motions that the constraints allow, in states of position and velocity where damping is general.
   pure integer function order_of_matrix(s)
      type(solve_context_type), intent(in) :: s

      order_of_matrix = s%work%unknowns() - s%work%multipliers() + s%known%redundant
      if (theta_is_lambda(s)) order_of_matrix = 2*order_of_matrix
   end function order_of_matrix
end module kschur_dense_choice
