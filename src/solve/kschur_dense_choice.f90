!> Decides whether to compute all eigenvalues of a dense matrix, instead of iterating for some.
module kschur_dense_choice
   use kschur_context, only: solve_context_type
   use kschur_formulation, only: is_structured
   use kschur_options, only: formulation_auto, formulation_low_rank, formulation_quadratic, inner_auto, method_krylov_schur
   use kschur_text, only: text
   implicit none
   private
   public :: consider_dense, dense_may_end_stall, dense_may_tell, settle_dense

   ! Order at which both ways cost as many instructions: a constant, and an increment for each wanted mode. For states: measured
   ! with 5 to 40 modes of beams and rotors of order 100 to 300.
   integer, parameter :: states_limit = 40, states_limit_per_mode = 6
   ! For undamped motions, whose matrix is symmetric: measured with 10 to 100 modes of chains of order 60 to 240.
   integer, parameter :: motions_limit = 60, motions_limit_per_mode = 3
   ! Largest order for which a dense solve is chosen: beyond, costs were not measured.
   integer, parameter :: largest_order = 600

contains

   !> Sets `dense` if the formulation is chosen automatically, no option is set that only an iteration has, and the matrix is small.
   subroutine consider_dense(s)
      type(solve_context_type), intent(inout) :: s
      integer :: limit

      if (s%options%formulation /= formulation_auto) return
      limit = min(largest_order, merge(states_limit + states_limit_per_mode*s%options%modes, &
         motions_limit + motions_limit_per_mode*s%options%modes, theta_is_lambda(s)))
      s%dense = permits_dense(s) .and. is_structured(s%formulation) .and. order_of_cost(s) <= limit
      if (s%dense .and. s%formulation == formulation_low_rank) s%formulation = formulation_quadratic
   end subroutine consider_dense

   !> Resets an automatically set `dense` after the examination, if the number of eigenvalues is not known exactly, so that nothing
   !> would show a missing one (losses excepted), or if there are no modes but rigid motions. Otherwise sets `decision`, the reason.
   subroutine settle_dense(s)
      type(solve_context_type), intent(inout) :: s

      if (.not. s%dense .or. s%options%formulation /= formulation_auto) return
      s%dense = (s%known%total%exact .or. (s%is_lossy() .and. theta_is_lambda(s))) .and. .not. s%only_rigid()
      if (s%dense) s%decision = "dense: order "//text(order_of_matrix(s))//", cheaper than an iteration"
   end subroutine settle_dense

   !> Whether a dense solve may replace modes of an iteration that are not trusted: the options permit it, it was not tried yet, and
   !> it is fast.
   pure logical function dense_may_tell(s)
      !> Context of the iteration.
      type(solve_context_type), intent(in) :: s

      dense_may_tell = s%options%formulation == formulation_auto .and. permits_dense(s) .and. .not. s%dense .and. &
         order_of_cost(s) <= largest_order
   end function dense_may_tell

   !> Whether a dense solve may replace the modes of an iteration that stalls, as in a crowd of real eigenvalues that no shift
   !> separates: as `dense_may_tell`, but also for larger orders, which take up to half a minute.
   pure logical function dense_may_end_stall(s)
      type(solve_context_type), intent(in) :: s
      ! Largest order for states, and for motions.
      integer, parameter :: most_states = 2000, most_motions = 3000

      dense_may_end_stall = s%options%formulation == formulation_auto .and. permits_dense(s) .and. .not. s%dense .and. &
         order_of_cost(s) <= merge(most_states, most_motions, theta_is_lambda(s))
   end function dense_may_end_stall

   ! Whether no option is set that only an iteration has.
   pure logical function permits_dense(s)
      type(solve_context_type), intent(in) :: s

      associate (o => s%options)
         permits_dense = s%may_be_dense .and. o%method == method_krylov_schur .and. o%inner == inner_auto .and. &
            o%subspace == 0 .and. o%block == 0 .and. .not. allocated(o%shift)
      end associate
   end function permits_dense

   ! Whether the matrix is one of states, with eigenvalues lambda; otherwise it is one of motions, with lambda^2.
   pure logical function theta_is_lambda(s)
      type(solve_context_type), intent(in) :: s

      theta_is_lambda = any(s%formulation == [formulation_quadratic, formulation_low_rank])
   end function theta_is_lambda

   ! Order that determines the cost: with many constraints, their null space costs as much as a matrix of all unknowns.
   pure integer function order_of_cost(s)
      type(solve_context_type), intent(in) :: s

      order_of_cost = max(order_of_matrix(s), s%work%unknowns())
   end function order_of_cost

   ! Order of the matrix: number of motions that the constraints allow, twice that for states of position and velocity.
   pure integer function order_of_matrix(s)
      type(solve_context_type), intent(in) :: s

      order_of_matrix = s%work%unknowns() - s%work%multipliers() + s%known%redundant
      if (theta_is_lambda(s)) order_of_matrix = 2*order_of_matrix
   end function order_of_matrix
end module kschur_dense_choice
