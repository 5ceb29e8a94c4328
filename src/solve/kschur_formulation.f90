!> Which formulation of a problem is solved: the one that was asked for, if it
!> fits, or the smallest exact one.
module kschur_formulation
   use kschur_effort, only: effort_type
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_solver_choice, only: inner_solvers_type, choose_inner_solvers
   use kschur_local_forces, only: description_of, local_forces_type, new_local_forces
   use kschur_mass, only: examine_mass, is_definite
   use kschur_options, only: modal_options_type, formulation_auto, formulation_dense, formulation_low_rank, formulation_names, &
      formulation_proportional, formulation_quadratic, formulation_symmetric, formulation_undamped, formulation_undamped_constrained
   use kschur_pencil, only: check_fit
   use kschur_problem, only: modal_problem_type, damping_general, damping_none
   implicit none
   private
   public :: choose_formulation, is_structured, likely_formulation

contains

   ! The smallest formulation that is exact for a problem with a definite mass matrix.
   pure integer function smallest_formulation(problem) result(formulation)
      type(modal_problem_type), intent(in) :: problem

      if (allocated(problem%loss) .and. .not. abs(problem%loss_factor) > 0) then
         formulation = formulation_quadratic
      else if (problem%symmetric .and. problem%damping_kind == damping_none .and. .not. allocated(problem%loss)) then
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
      if (problem%damping_kind == damping_none .and. .not. allocated(problem%loss)) &
         formulation = merge(formulation_undamped_constrained, formulation_undamped, problem%multipliers() > 0)
   end function general_formulation

   !> Whether a formulation is not an explicit pencil of Table 1.
   pure logical function is_structured(formulation)
      integer, intent(in) :: formulation

      is_structured = any(formulation == [formulation_quadratic, formulation_symmetric, formulation_proportional, &
         formulation_low_rank, formulation_dense])
   end function is_structured

   !> The formulation that was asked for, or the smallest exact one for `formulation_auto`; for `formulation_dense` the
   !> one whose matrix is computed. Fails where it does not fit the problem, with the reason.
   subroutine choose_formulation(problem, asked, formulation, decision, error, inner, effort)
      type(modal_problem_type), intent(in) :: problem
      !> One of `formulation_*`.
      integer, intent(in) :: asked
      integer, intent(out) :: formulation
      !> Why, in words.
      character(len=:), allocatable, intent(out) :: decision
      type(error_type), allocatable, intent(out) :: error
      !> What factors the mass; absent: the library's own.
      type(inner_solvers_type), intent(in), optional :: inner
      !> What that takes is added.
      class(effort_type), intent(inout), optional :: effort
      type(inner_solvers_type) :: own
      character(len=:), allocatable :: obstacle
      logical :: poor

      formulation = asked
      if (any(asked == [formulation_auto, formulation_dense])) formulation = smallest_formulation(problem)
      if (asked == formulation_dense .and. .not. is_structured(formulation)) formulation = formulation_quadratic
      if (.not. is_structured(formulation)) then
         if (allocated(problem%loss)) call new_error(error, error_usage, "the formulation "// &
            trim(formulation_names(formulation))//" is of real matrices, and there is a loss matrix H: quadratic and dense "// &
            "take it, proportional where H = g K")
         if (.not. allocated(error)) call check_fit(problem, formulation, error)
         if (allocated(error)) return
      end if
      if (present(inner)) then
         own = inner
      else
         call choose_inner_solvers(modal_options_type(), own, error)
      end if
      call find_obstacle(problem, formulation, own, obstacle, poor, error, effort)
      if (allocated(error)) return
      if (asked == formulation_auto .and. may_be_low_rank(problem)) &
         call try_low_rank(problem, formulation, own, decision, error, effort)
      if (allocated(error) .or. allocated(decision)) return
      if (len(obstacle) > 0 .and. all(asked /= [formulation_auto, formulation_dense])) then
         call new_error(error, error_usage, "the formulation "//trim(formulation_names(formulation))// &
            " does not fit the problem: "//obstacle)
      else if (len(obstacle) > 0) then
         formulation = merge(formulation_quadratic, general_formulation(problem), asked == formulation_dense)
         decision = obstacle
         if (asked == formulation_dense) decision = "it was asked for"
      else if (asked /= formulation_auto) then
         decision = "it was asked for"
      else if (.not. problem%symmetric) then
         decision = "the matrices are not symmetric"
      else if (allocated(problem%loss)) then
         decision = trim(decision_of_loss(problem))
      else if (problem%damping_kind == damping_none) then
         decision = "the matrices are symmetric and there is no damping"
      else if (problem%damping_kind == damping_general) then
         decision = "the damping is not a combination of mass and stiffness"
      else
         decision = "the damping is a combination of mass and stiffness, so that the undamped modes give the damped ones"
      end if
      if (allocated(error) .or. .not. poor) return
      if (seem_swapped(problem, own)) decision = decision//"; are mass and stiffness swapped?"
   end subroutine choose_formulation

   ! Whether a stiffness is conditioned as well as masses are, beside a mass that is not, though it has no negative entry.
   logical function seem_swapped(problem, inner)
      type(modal_problem_type), intent(in) :: problem
      type(inner_solvers_type), intent(in) :: inner

      seem_swapped = all(problem%mass%diagonal() >= 0)
      if (seem_swapped) seem_swapped = is_definite(problem%stiffness, inner)
   end function seem_swapped

   ! Of a symmetric problem that has an H.
   pure function decision_of_loss(problem) result(decision)
      type(modal_problem_type), intent(in) :: problem
      character(len=120) :: decision

      if (.not. abs(problem%loss_factor) > 0) then
         decision = "the loss matrix H is not proportional to the stiffness"
      else if (problem%damping_kind == damping_general) then
         decision = "the damping is not a combination of mass and stiffness"
      else
         decision = "losses and damping are combinations of mass and stiffness, so that the undamped modes give the damped ones"
      end if
   end function decision_of_loss

   !> What `choose_formulation` takes where the mass is an inner product: nothing is factored to see that.
   subroutine likely_formulation(problem, asked, formulation, error)
      type(modal_problem_type), intent(in) :: problem
      !> One of `formulation_*`.
      integer, intent(in) :: asked
      integer, intent(out) :: formulation
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: obstacle

      formulation = asked
      if (any(asked == [formulation_auto, formulation_dense])) formulation = smallest_formulation(problem)
      if (asked /= formulation_auto .or. .not. may_be_low_rank(problem)) return
      call find_distributed(problem, obstacle, error)
      if (allocated(error)) return
      if (len(obstacle) == 0) formulation = formulation_low_rank
   end subroutine likely_formulation

   ! Whether only few unknowns are damped otherwise than all.
   pure logical function may_be_low_rank(problem)
      type(modal_problem_type), intent(in) :: problem
      ! More than this part of all unknowns is not few.
      integer, parameter :: few_part = 4

      may_be_low_rank = allocated(problem%dampers) .and. problem%damping_kind == damping_general .and. &
         .not. allocated(problem%loss) .and. &
         smallest_formulation(problem) == formulation_quadratic
      if (may_be_low_rank) may_be_low_rank = few_part*count(problem%dampers%row_maxima() > 0) <= problem%unknowns()
   end function may_be_low_rank

   ! Takes it where it fits.
   subroutine try_low_rank(problem, formulation, inner, decision, error, effort)
      type(modal_problem_type), intent(in) :: problem
      integer, intent(inout) :: formulation
      type(inner_solvers_type), intent(in) :: inner
      character(len=:), allocatable, intent(inout) :: decision
      type(error_type), allocatable, intent(out) :: error
      class(effort_type), intent(inout), optional :: effort
      character(len=:), allocatable :: obstacle
      logical :: poor

      call find_obstacle(problem, formulation_low_rank, inner, obstacle, poor, error, effort)
      if (allocated(error) .or. len(obstacle) > 0) return
      formulation = formulation_low_rank
      decision = trim(description_of(problem))
   end subroutine try_low_rank

   ! What keeps a problem from being symmetric and proportionally damped but for local forces that move masses.
   subroutine find_distributed(problem, obstacle, error)
      type(modal_problem_type), intent(in) :: problem
      character(len=:), allocatable, intent(out) :: obstacle
      type(error_type), allocatable, intent(out) :: error
      type(local_forces_type) :: forces
      logical :: few, heavy(problem%unknowns())

      obstacle = ""
      heavy = problem%mass%row_maxima() > 0
      if (.not. problem%mass%is_symmetric()) then
         obstacle = "its mass matrix is not symmetric"
         return
      end if
      call new_local_forces(problem, forces, few, error)
      if (allocated(error)) return
      ! Of most motions the undamped space is no help.
      if (few) few = 2*forces%rank() <= problem%unknowns()
      if (.not. few) then
         obstacle = "it differs from a symmetric problem with proportional damping at more than a few unknowns"
      else if (.not. all(heavy([forces%rows, forces%columns]))) then
         obstacle = "it is damped at unknowns without mass"
      end if
   end subroutine find_distributed

   ! What keeps a problem from a formulation for symmetric matrices; empty where nothing does.
   subroutine find_obstacle(problem, formulation, inner, obstacle, poor, error, effort)
      type(modal_problem_type), intent(in) :: problem
      integer, intent(in) :: formulation
      type(inner_solvers_type), intent(in) :: inner
      character(len=:), allocatable, intent(out) :: obstacle
      !> Whether the mass was looked at, and is conditioned worse than masses are.
      logical, intent(out) :: poor
      type(error_type), allocatable, intent(out) :: error
      class(effort_type), intent(inout), optional :: effort
      logical :: semidefinite
      integer :: nullity

      obstacle = ""
      poor = .false.
      if (all(formulation /= [formulation_symmetric, formulation_proportional, formulation_low_rank])) return
      if (allocated(problem%loss) .and. formulation /= formulation_proportional) then
         obstacle = "it has a loss matrix H"
      else if (allocated(problem%loss) .and. .not. abs(problem%loss_factor) > 0) then
         obstacle = "its loss matrix H is not proportional to the stiffness"
      else if (formulation == formulation_low_rank) then
         call find_distributed(problem, obstacle, error)
         if (allocated(error) .or. len(obstacle) > 0) return
      else if (.not. problem%symmetric) then
         obstacle = "its matrices are not symmetric"
      else if (formulation == formulation_symmetric .and. problem%damping_kind /= damping_none) then
         obstacle = "it has damping"
      else if (problem%damping_kind == damping_general) then
         obstacle = "its damping is not proportional"
      end if
      if (len(obstacle) == 0) then
         call examine_mass(problem%mass, inner, semidefinite, nullity, poor, error, effort)
         if (allocated(error)) return
         if (.not. semidefinite) then
            ! Constraints may leave none of these motions.
            obstacle = "its mass matrix as given has eigenvalues that are negative or next to zero"
         else if (nullity > 0 .and. abs(problem%beta) > 0) then
            obstacle = "its mass matrix is singular, so that damping by stiffness makes modes that it lacks without"
         else if (nullity > count(.not. problem%mass%row_maxima() > 0)) then
            ! A Krylov space in the inner product of M does not see what rounding leaves in such motions.
            obstacle = "its mass matrix is singular in motions of several unknowns"
         end if
      end if
   end subroutine find_obstacle
end module kschur_formulation
