!> Chooses the formulation of a problem: the one that the options name, if it fits, or the smallest exact one.
module kschur_formulation
   use kschur_effort, only: effort_type
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_solver_choice, only: inner_solvers_type, choose_inner_solvers
   use kschur_kinds, only: wp
   use kschur_local_forces, only: description_of, local_forces_type, new_local_forces
   use kschur_loss, only: find_local_loss
   use kschur_mass, only: examine_mass
   use kschur_mass_bound, only: is_definite
   use kschur_options, only: modal_options_type, formulation_auto, formulation_dense, formulation_low_rank, formulation_names, &
      formulation_proportional, formulation_quadratic, formulation_symmetric, formulation_undamped, formulation_undamped_constrained
   use kschur_pencil, only: check_fit
   use kschur_problem, only: modal_problem_type, damping_general, damping_none
   use kschur_sparse, only: csr_matrix_type
   use kschur_tolerances, only: least_of_mass
   implicit none
   private
   public :: choose_formulation, is_structured, likely_formulation

contains

   ! The smallest formulation that is exact if the mass matrix is definite.
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

   ! The formulation that any problem fits: the quadratic form, or the smallest pencil of Table 1 without damping and losses.
   pure integer function general_formulation(problem) result(formulation)
      type(modal_problem_type), intent(in) :: problem

      formulation = formulation_quadratic
      if (problem%damping_kind == damping_none .and. .not. allocated(problem%loss)) &
         formulation = merge(formulation_undamped_constrained, formulation_undamped, problem%multipliers() > 0)
   end function general_formulation

   !> Whether a formulation is one of the library's structured forms, not an explicit pencil of Table 1.
   pure logical function is_structured(formulation)
      integer, intent(in) :: formulation

      is_structured = any(formulation == [formulation_quadratic, formulation_symmetric, formulation_proportional, &
         formulation_low_rank, formulation_dense])
   end function is_structured

   !> Returns the formulation asked for, or for `formulation_auto` the smallest exact one, and for `formulation_dense` the one whose
   !> matrix is computed. Fails with the reason if it does not fit the problem.
   subroutine choose_formulation(problem, asked, formulation, decision, error, inner, effort, mass_bound)
      type(modal_problem_type), intent(in) :: problem
      !> One of `formulation_*`.
      integer, intent(in) :: asked
      integer, intent(out) :: formulation
      !> Why it was chosen, in words.
      character(len=:), allocatable, intent(out) :: decision
      type(error_type), allocatable, intent(out) :: error
      !> Solvers that factor the mass; absent: the library's.
      type(inner_solvers_type), intent(in), optional :: inner
      !> To which the effort of that is added.
      class(effort_type), intent(inout), optional :: effort
      !> Lower bound of the eigenvalues of M, scaled to unit diagonal; zero: none was proved.
      real(wp), intent(out), optional :: mass_bound
      type(inner_solvers_type) :: solvers
      character(len=:), allocatable :: obstacle
      real(wp) :: bound
      logical :: ill_conditioned

      if (present(mass_bound)) mass_bound = 0
      formulation = asked
      if (any(asked == [formulation_auto, formulation_dense])) formulation = smallest_formulation(problem)
      if (asked == formulation_dense .and. .not. is_structured(formulation)) formulation = formulation_quadratic
      if (.not. is_structured(formulation)) then
         call check_fit(problem, formulation, error)
         if (allocated(error)) return
      end if
      if (present(inner)) then
         solvers = inner
      else
         call choose_inner_solvers(modal_options_type(), solvers, error)
      end if
      call find_obstacle(problem, formulation, solvers, obstacle, bound, ill_conditioned, error, effort)
      if (allocated(error)) return
      if (asked == formulation_auto) call try_low_rank(problem, formulation, solvers, bound, decision, error, effort)
      if (present(mass_bound)) mass_bound = bound
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
      if (allocated(error) .or. .not. ill_conditioned) return
      if (seem_swapped(problem)) decision = decision//"; are mass and stiffness swapped?"
   end subroutine choose_formulation

   ! Whether mass and stiffness of a problem with an ill-conditioned mass seem to be swapped: the mass has no negative diagonal
   ! entry, and the stiffness is as well conditioned as masses of finite elements are.
   logical function seem_swapped(problem)
      type(modal_problem_type), intent(in) :: problem

      seem_swapped = all(problem%mass%diagonal() >= 0)
      if (seem_swapped) seem_swapped = is_definite(problem%stiffness, least_of_mass)
   end function seem_swapped

   ! Why the formulation of a symmetric problem with a loss matrix was chosen, in words.
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

   !> The formulation that `choose_formulation` returns if the mass is semidefinite; nothing is factored to test that.
   subroutine likely_formulation(problem, asked, formulation, error)
      type(modal_problem_type), intent(in) :: problem
      !> One of `formulation_*`.
      integer, intent(in) :: asked
      integer, intent(out) :: formulation
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: obstacle
      logical :: few

      formulation = asked
      if (any(asked == [formulation_auto, formulation_dense])) formulation = smallest_formulation(problem)
      if (asked /= formulation_auto) return
      call check_few(problem, few, error)
      if (.not. allocated(error) .and. few) call find_low_rank_obstacle(problem, obstacle, error)
      if (allocated(error) .or. .not. few) return
      if (len(obstacle) == 0) formulation = formulation_low_rank
   end subroutine likely_formulation

   ! Tests whether few enough unknowns, at most a quarter, have damping that is not proportional, or losses that are not.
   subroutine check_few(problem, few, error)
      type(modal_problem_type), intent(in) :: problem
      logical, intent(out) :: few
      type(error_type), allocatable, intent(out) :: error
      ! Inverse of the largest fraction of unknowns that is few.
      integer, parameter :: few_part = 4
      type(csr_matrix_type) :: local
      real(wp) :: factor

      few = smallest_formulation(problem) == formulation_quadratic .and. &
         (allocated(problem%loss) .or. problem%damping_kind == damping_general)
      if (few .and. problem%damping_kind == damping_general) then
         few = allocated(problem%dampers)
         if (few) few = few_part*count(problem%dampers%row_maxima() > 0) <= problem%unknowns()
      end if
      if (few .and. allocated(problem%loss) .and. .not. abs(problem%loss_factor) > 0) &
         call find_local_loss(problem%stiffness, problem%loss, problem%unknowns()/few_part, factor, local, few, error)
   end subroutine check_few

   ! Sets the low-rank formulation and the decision, if it fits.
   subroutine try_low_rank(problem, formulation, inner, bound, decision, error, effort)
      type(modal_problem_type), intent(in) :: problem
      integer, intent(inout) :: formulation
      type(inner_solvers_type), intent(in) :: inner
      !> As for `find_obstacle`, where the mass is examined.
      real(wp), intent(inout) :: bound
      character(len=:), allocatable, intent(inout) :: decision
      type(error_type), allocatable, intent(out) :: error
      class(effort_type), intent(inout), optional :: effort
      character(len=:), allocatable :: obstacle
      logical :: ill_conditioned, few

      call check_few(problem, few, error)
      if (allocated(error) .or. .not. few) return
      call find_obstacle(problem, formulation_low_rank, inner, obstacle, bound, ill_conditioned, error, effort)
      if (allocated(error) .or. len(obstacle) > 0) return
      formulation = formulation_low_rank
      decision = trim(description_of(problem))
   end subroutine try_low_rank

   ! Why the low-rank form does not fit a problem, as far as nothing is factored: it must be symmetric and proportionally damped
   ! except for a few local forces, which act on unknowns with mass. Empty if it fits.
   subroutine find_low_rank_obstacle(problem, obstacle, error)
      type(modal_problem_type), intent(in) :: problem
      character(len=:), allocatable, intent(out) :: obstacle
      type(error_type), allocatable, intent(out) :: error
      type(local_forces_type) :: forces
      logical :: are_few, has_mass(problem%unknowns())

      obstacle = ""
      has_mass = problem%mass%row_maxima() > 0
      if (.not. problem%mass%is_symmetric()) then
         obstacle = "its mass matrix is not symmetric"
         return
      end if
      call new_local_forces(problem, forces, are_few, error)
      if (allocated(error)) return
      ! If forces act on more than half of all motions, a space of undamped modes does not help.
      if (are_few) are_few = 2*forces%rank() <= problem%unknowns()
      if (.not. are_few) then
         obstacle = "it differs from a symmetric problem with proportional damping and losses at more than a few unknowns"
      else if (.not. all(has_mass([forces%rows, forces%columns]))) then
         obstacle = "it is damped at unknowns without mass, or has losses of its own there"
      end if
   end subroutine find_low_rank_obstacle

   ! Why a formulation for symmetric matrices does not fit a problem; empty if it fits, or for other formulations.
   subroutine find_obstacle(problem, formulation, inner, obstacle, bound, ill_conditioned, error, effort)
      type(modal_problem_type), intent(in) :: problem
      integer, intent(in) :: formulation
      type(inner_solvers_type), intent(in) :: inner
      character(len=:), allocatable, intent(out) :: obstacle
      !> Lower bound of the eigenvalues of M, scaled to unit diagonal; zero: none was proved.
      real(wp), intent(out) :: bound
      !> Whether the mass was examined, and is conditioned worse than masses of finite elements are.
      logical, intent(out) :: ill_conditioned
      type(error_type), allocatable, intent(out) :: error
      class(effort_type), intent(inout), optional :: effort
      logical :: semidefinite
      integer :: nullity

      obstacle = ""
      bound = 0
      ill_conditioned = .false.
      if (all(formulation /= [formulation_symmetric, formulation_proportional, formulation_low_rank])) return
      if (formulation == formulation_low_rank) then
         call find_low_rank_obstacle(problem, obstacle, error)
         if (allocated(error) .or. len(obstacle) > 0) return
      else if (allocated(problem%loss) .and. formulation == formulation_symmetric) then
         obstacle = "it has a loss matrix H"
      else if (allocated(problem%loss) .and. .not. abs(problem%loss_factor) > 0) then
         obstacle = "its loss matrix H is not proportional to the stiffness"
      else if (.not. problem%symmetric) then
         obstacle = "its matrices are not symmetric"
      else if (formulation == formulation_symmetric .and. problem%damping_kind /= damping_none) then
         obstacle = "it has damping"
      else if (problem%damping_kind == damping_general) then
         obstacle = "its damping is not proportional"
      end if
      if (len(obstacle) == 0) then
         call examine_mass(problem%mass, inner, semidefinite, nullity, bound, ill_conditioned, error, effort)
         if (allocated(error)) return
         if (nullity > 0 .or. .not. semidefinite) bound = 0
         if (.not. semidefinite) then
            ! As given: constraints may exclude all such motions.
            obstacle = "its mass matrix as given has eigenvalues that are negative or next to zero"
         else if (nullity > 0 .and. abs(problem%beta) > 0) then
            obstacle = "its mass matrix is singular, so that damping by stiffness makes modes that it lacks without"
         else if (nullity > count(.not. problem%mass%row_maxima() > 0)) then
            ! A Krylov space in the inner product of M does not see the components that rounding leaves in such motions.
            obstacle = "its mass matrix is singular in motions of several unknowns"
         end if
      end if
   end subroutine find_obstacle
end module kschur_formulation
