!> Presolve: exact elimination of clamped and tied unknowns, and the way back.
!>
!> A constraint on one unknown clamps it, one on two unknowns ties them: then phi = T y with Cq T = 0 for these rows, and (T^T M
!> T, T^T R T, T^T K T, C_rest T) has exactly the modes of the problem. A row of T has at most one entry: each unknown is a
!> factor, |factor| <= 1, times one master. Where joints confine bodies, row operations come first, and an unknown may be a sum
!> of several masters.
module kschur_presolve
   use kschur_confinement, only: confinement_type, convert_multipliers, resolve
   use kschur_congruence, only: reduce
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_elimination, only: eliminate, ties_type
   use kschur_error, only: error_type, new_error, add_context, error_input
   use kschur_joints, only: confine
   use kschur_kinds, only: wp
   use kschur_loss, only: times_factor
   use kschur_problem, only: modal_problem_type, settle_modal_problem
   use kschur_sparse, only: complete_pattern, csr_matrix_type, identity_csr_matrix, linear_combination, new_csr_from_triplets
   use kschur_tolerances, only: rounding_of_entry
   implicit none
   private
   public :: presolve_type, presolve

   !> The reduction and its inverse; created by `presolve`.
   type, extends(ties_type) :: presolve_type
      !> Numbers of unknowns of the original and the reduced problem, n and n'.
      integer :: unknowns_before = 0, unknowns_after = 0
      !> Number of constraints of the reduced problem, m'.
      integer :: constraints_after = 0
      ! T, n x n'.
      type(csr_matrix_type), private :: expansion
      ! Scaling: equation i was multiplied by row_units(i) times the factor its unknown was divided by, and the multiplier of
      ! constraint i is reaction_units(i) times the original one. Not allocated: 1.
      real(wp), allocatable, private :: row_units(:), reaction_units(:)
      !> Replaced rows, and combinations Y of rows that replaced them. Not allocated: none.
      integer, allocatable :: replaced(:)
      type(csr_matrix_type), private :: combinations
   contains
      !> phi = T y: expands shapes of the reduced problem.
      procedure :: expand_shapes
      !> Restricts phi = T y to y, and multipliers to the remaining rows.
      procedure :: contract
      !> T^T f: restricts forces.
      procedure :: restrict
      !> Ratio of the largest to the smallest unit of the reduced unknowns.
      procedure :: spread_of_units
      !> Removes redundant constraints of the reduced problem, and replaces nearly redundant ones.
      procedure :: replace_rows
      !> Converts multipliers of the constraints to those before `replace_rows`.
      procedure :: expand_reactions
      !> Rescales the reduced unknowns: y(i) is now units(i) times as large.
      procedure :: change_units
      !> Additionally rescales equations of the reduced problem.
      procedure :: change_row_units
      !> The same reduction of the transposed problem.
      procedure :: transposed
   end type presolve_type

contains

   !> Eliminates clamped and tied unknowns, in time linear in the number of entries. The reduced problem equals the problem if
   !> there are none, and is symmetric or proportionally damped if the problem is. Fails if no unknown is left.
   subroutine presolve(problem, reduced, plan, error, eliminating)
      type(modal_problem_type), intent(in) :: problem
      type(modal_problem_type), intent(out) :: reduced
      type(presolve_type), intent(out) :: plan
      type(error_type), allocatable, intent(out) :: error
      !> False: nothing is eliminated.
      logical, optional, intent(in) :: eliminating
      type(csr_matrix_type) :: clean, constraints
      logical :: short_rows

      short_rows = .true.
      if (present(eliminating)) short_rows = eliminating
      call drop_rounding_of_constraints(problem%constraints, clean, error)
      if (.not. allocated(error)) call eliminate(clean, short_rows, plan%ties_type, constraints, error)
      if (.not. allocated(error) .and. short_rows .and. constraints%rows > 0) call try_confinement(clean, plan, constraints, error)
      if (allocated(error)) return
      plan%unknowns_before = problem%unknowns()
      plan%constraints_after = constraints%rows
      call number_unknowns(plan, constraints, error)
      if (allocated(error)) return
      if (plan%unknowns_after == 0) then
         call new_error(error, error_input, &
            "the constraints leave no motion: as many of them are independent as there are unknowns")
      else if (plan%eliminated == 0) then
         reduced = problem
         reduced%constraints = constraints
         if (short_rows .and. problem%symmetric) then
            call complete_pattern(reduced%mass)
            call complete_pattern(reduced%damping)
            call complete_pattern(reduced%stiffness)
            if (allocated(reduced%loss)) call complete_pattern(reduced%loss)
         end if
      end if
      if (min(plan%unknowns_after, plan%eliminated) == 0) return
      call reduce(plan%expansion, problem%mass, problem%symmetric, reduced%mass, error)
      if (.not. allocated(error)) call reduce(plan%expansion, problem%stiffness, problem%symmetric, reduced%stiffness, error)
      if (allocated(error)) return
      if (allocated(problem%dampers)) then
         allocate (reduced%dampers)
         call reduce(plan%expansion, problem%dampers, problem%symmetric, reduced%dampers, error)
         if (allocated(error)) return
      end if
      if (allocated(problem%dampers) .or. .not. max(abs(problem%alpha), abs(problem%beta)) > 0) then
         ! R itself: far larger terms may cancel in alpha M + beta K + D.
         call reduce(plan%expansion, problem%damping, problem%symmetric, reduced%damping, error)
      else
         ! Of the reduced M and K: separate sums that cancel would not be the same combination.
         reduced%damping = linear_combination(problem%alpha, reduced%mass, problem%beta, reduced%stiffness)
      end if
      if (allocated(problem%loss) .and. .not. allocated(error)) call reduce_loss(plan, problem, reduced, error)
      reduced%constraints = constraints
      if (.not. allocated(error)) call settle_modal_problem(reduced, error, kind_of=problem)
      call add_context(error, "without the clamped and tied unknowns")
   end subroutine presolve

   ! Computes T^T H T; g times the reduced K if H = g K.
   subroutine reduce_loss(plan, problem, reduced, error)
      type(presolve_type), intent(in) :: plan
      type(modal_problem_type), intent(in) :: problem
      type(modal_problem_type), intent(inout) :: reduced
      type(error_type), allocatable, intent(out) :: error

      if (abs(problem%loss_factor) > 0) then
         allocate (reduced%loss, source=times_factor(reduced%stiffness, problem%loss_factor))
      else
         allocate (reduced%loss)
         call reduce(plan%expansion, problem%loss, problem%symmetric, reduced%loss, error)
      end if
   end subroutine reduce_loss

   ! Drops constraint entries that are rounding errors relative to both their row and their column, in any units, as the cosine
   ! of a right angle.
   subroutine drop_rounding_of_constraints(constraints, clean, error)
      type(csr_matrix_type), intent(in) :: constraints
      type(csr_matrix_type), intent(out) :: clean
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: of_rows(constraints%rows), of_columns(constraints%columns)
      integer, allocatable :: row(:)
      logical, allocatable :: stays(:)
      integer :: k

      of_rows = constraints%row_maxima()
      of_columns = 0
      associate (value => constraints%value, column => constraints%column)
         do k = 1, size(value)
            of_columns(column(k)) = max(of_columns(column(k)), abs(value(k)))
         end do
         allocate (row, source=constraints%row_indices())
         allocate (stays, source=abs(value) > rounding_of_entry*min(of_rows(row), of_columns(column)))
         if (all(stays)) then
            clean = constraints
         else
            call new_csr_from_triplets(clean, constraints%rows, constraints%columns, pack(row, stays), pack(column, stays), &
               pack(value, stays), error)
         end if
      end associate
   end subroutine drop_rounding_of_constraints

   ! Confines bodies by their joints first, if more rows can be eliminated then.
   subroutine try_confinement(clean, plan, constraints, error)
      type(csr_matrix_type), intent(in) :: clean
      type(presolve_type), intent(inout) :: plan
      !> The rows that stay.
      type(csr_matrix_type), intent(inout) :: constraints
      type(error_type), allocatable, intent(out) :: error
      type(confinement_type) :: confinement
      type(csr_matrix_type) :: fewer
      type(ties_type) :: ties

      call confine(clean, confinement, error)
      if (allocated(error) .or. size(confinement%unknown) == 0) return
      call eliminate(confinement%constraints, .true., ties, fewer, error)
      if (allocated(error) .or. fewer%rows >= constraints%rows) return
      plan%ties_type = ties
      constraints = fewer
      allocate (plan%confinement, source=confinement)
   end subroutine try_confinement

   ! Forms T, and numbers the masters as unknowns of the reduced problem, also in the constraints that stay.
   subroutine number_unknowns(plan, constraints, error)
      type(presolve_type), intent(inout) :: plan
      type(csr_matrix_type), intent(inout) :: constraints
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: shares
      integer, allocatable :: row(:)
      logical, allocatable :: stays(:)
      real(wp) :: noise, factor(plan%unknowns_before)
      integer :: number(0:plan%unknowns_before), master(plan%unknowns_before), i

      number(0) = 0
      do i = 1, plan%unknowns_before
         if (plan%parent(i) == i) plan%unknowns_after = plan%unknowns_after + 1
         number(i) = plan%unknowns_after
         call plan%find_master(i, master(i), factor(i), noise)
      end do
      master = number(master)
      constraints%column = master(constraints%column)
      constraints%columns = plan%unknowns_after
      plan%expansion = identity_csr_matrix(plan%unknowns_before)
      if (plan%eliminated == 0) return
      if (allocated(plan%confinement)) then
         call resolve(plan%confinement, plan%unknowns_before, shares, error)
         if (allocated(error)) return
      else
         shares = plan%expansion
      end if
      allocate (row, source=shares%row_indices())
      allocate (stays, source=master(shares%column) > 0)
      call new_csr_from_triplets(plan%expansion, plan%unknowns_before, plan%unknowns_after, pack(row, stays), &
         pack(master(shares%column), stays), pack(shares%value*factor(shares%column), stays), error)
   end subroutine number_unknowns

   pure real(wp) function spread_of_units(self)
      class(presolve_type), intent(in) :: self
      real(wp) :: units(self%unknowns_after)
      integer :: i

      do i = 1, self%unknowns_before
         if (self%parent(i) /= i) cycle
         associate (t => self%expansion, k => self%expansion%row_start(i))
            units(t%column(k)) = abs(t%value(k))
         end associate
      end do
      spread_of_units = 1
      if (size(units) > 0) spread_of_units = maxval(units)/minval(units)
   end function spread_of_units

   ! Removes and replaces rows of the reduced constraints, and records how to recover their multipliers.
   subroutine replace_rows(self, follows, near, combinations, rows, reduced, error)
      class(presolve_type), intent(inout) :: self
      !> Whether each of the m' rows is removed.
      logical, intent(in) :: follows(:)
      !> Replaced rows, k of m': each by the combination Y of rows at its position, k x m', with values Y Cq, k x n'. A
      !> combination has its own row, earlier replaced ones, and no removed one.
      integer, intent(in) :: near(:)
      type(csr_matrix_type), intent(in) :: combinations, rows
      type(modal_problem_type), intent(inout) :: reduced
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: rest
      integer, allocatable :: row(:), number(:)
      logical, allocatable :: stays(:), replaced(:)
      integer :: i

      if (.not. any(follows) .and. size(near) == 0) return
      associate (cq => reduced%constraints)
         allocate (row(cq%nonzeros()), source=cq%row_indices())
         allocate (number(cq%rows), source=0)
         self%constraints_after = 0
         do i = 1, cq%rows
            if (follows(i)) cycle
            self%constraints_after = self%constraints_after + 1
            number(i) = self%constraints_after
         end do
         allocate (replaced(cq%rows), source=.false.)
         replaced(near) = .true.
         allocate (stays(size(row)), source=.not. (follows(row) .or. replaced(row)))
         call new_csr_from_triplets(rest, self%constraints_after, cq%columns, &
            [pack(number(row), stays), number(near(rows%row_indices()))], [pack(cq%column, stays), rows%column], &
            [pack(cq%value, stays), rows%value], error)
      end associate
      if (allocated(error)) return
      reduced%constraints = rest
      self%kept = pack(self%kept, .not. follows)
      if (allocated(self%reaction_units)) self%reaction_units = pack(self%reaction_units, .not. follows)
      self%redundant = self%redundant + count(follows)
      if (size(near) == 0) return
      self%replaced = number(near)
      self%combinations = combinations
      self%combinations%columns = self%constraints_after
      self%combinations%column = number(combinations%column)
   end subroutine replace_rows

   !> Converts multipliers of combinations to those of rows, Y^T xi, in original units.
   subroutine expand_reactions(self, xi)
      class(presolve_type), intent(in) :: self
      !> m' x k
      complex(wp), contiguous, intent(inout) :: xi(:, :)
      complex(wp), allocatable :: combined(:, :)

      if (allocated(self%replaced)) then
         allocate (combined(size(self%replaced), size(xi, 2)), source=xi(self%replaced, :))
         xi(self%replaced, :) = 0
         call self%combinations%add_transposed_product((1.0_wp, 0.0_wp), combined, xi)
      end if
      if (allocated(self%reaction_units)) xi = xi/spread(self%reaction_units, 2, size(xi, 2))
   end subroutine expand_reactions

   ! Inverse of `expand_reactions`; the combinations are triangular.
   pure subroutine contract_reactions(self, xi)
      class(presolve_type), intent(in) :: self
      complex(wp), intent(inout) :: xi(:)
      complex(wp) :: reaction
      integer :: i, k, own

      if (allocated(self%reaction_units)) xi = xi*self%reaction_units
      if (.not. allocated(self%replaced)) return
      associate (y => self%combinations)
         do i = y%rows, 1, -1
            own = y%place_of(i, self%replaced(i))
            reaction = xi(self%replaced(i))/y%value(own)
            do k = y%row_start(i), y%row_start(i + 1) - 1
               xi(y%column(k)) = xi(y%column(k)) - y%value(k)*reaction
            end do
            xi(self%replaced(i)) = reaction
         end do
      end associate
   end subroutine contract_reactions

   pure subroutine change_units(self, units)
      class(presolve_type), intent(inout) :: self
      real(wp), intent(in) :: units(:)

      associate (t => self%expansion)
         t%value = t%value*units(t%column)
      end associate
   end subroutine change_units

   pure subroutine change_row_units(self, units, constraints)
      class(presolve_type), intent(inout) :: self
      !> Equal for all unknowns of a constraint.
      real(wp), intent(in) :: units(:)
      !> Constraints of the reduced problem, none of them replaced.
      type(csr_matrix_type), intent(in) :: constraints
      integer :: i, largest

      if (.not. allocated(self%row_units)) then
         allocate (self%row_units(size(units)), self%reaction_units(constraints%rows), source=1.0_wp)
      end if
      self%row_units = self%row_units*units
      do i = 1, constraints%rows
         associate (first => constraints%row_start(i), last => constraints%row_start(i + 1) - 1)
            largest = first - 1 + maxloc(abs(constraints%value(first:last)), 1)
         end associate
         self%reaction_units(i) = self%reaction_units(i)*units(constraints%column(largest))
      end do
   end subroutine change_row_units

   function transposed(self) result(plan)
      class(presolve_type), intent(in) :: self
      type(presolve_type) :: plan

      plan = self
      if (.not. allocated(self%row_units)) return
      ! Both problems have the same constraints, in units of this one's unknowns.
      call plan%change_units(self%row_units)
      plan%row_units = 1/self%row_units
      plan%reaction_units = 1
   end function transposed

   !> Overwrites each shape y by phi = T y.
   subroutine expand_shapes(self, pairs)
      class(presolve_type), intent(in) :: self
      class(eigenpairs_type), intent(inout) :: pairs
      real(wp), allocatable :: real_phi(:, :)
      complex(wp), allocatable :: phi(:, :)
      integer :: k

      k = size(pairs%lambda)
      if (pairs%is_real()) then
         allocate (real_phi(self%unknowns_before, k), source=0.0_wp)
         call self%expansion%add_product(1.0_wp, pairs%real_phi(:, :k), real_phi)
         call move_alloc(real_phi, pairs%real_phi)
      else
         allocate (phi(self%unknowns_before, k), source=(0.0_wp, 0.0_wp))
         call self%expansion%add_product((1.0_wp, 0.0_wp), pairs%phi, phi)
         call move_alloc(phi, pairs%phi)
      end if
   end subroutine expand_shapes

   !> Restricts phi = T y and xi, n and m entries, to y and the multipliers of the reduced problem, n' and m' entries.
   pure subroutine contract(self, phi, xi, y, xi_reduced)
      class(presolve_type), intent(in) :: self
      complex(wp), intent(in) :: phi(:), xi(:)
      complex(wp), intent(out) :: y(:), xi_reduced(:)
      complex(wp), allocatable :: reactions(:)
      integer :: i

      do i = 1, self%unknowns_before
         if (self%parent(i) /= i) cycle
         associate (t => self%expansion, k => self%expansion%row_start(i))
            y(t%column(k)) = phi(i)/t%value(k)
         end associate
      end do
      if (allocated(self%confinement)) then
         reactions = xi
         call convert_multipliers(self%confinement, reactions)
         xi_reduced = reactions(self%kept)
      else
         xi_reduced = xi(self%kept)
      end if
      call contract_reactions(self, xi_reduced)
   end subroutine contract

   !> T^T f, n' x k, for f, n x k.
   pure function restrict(self, f) result(restricted)
      class(presolve_type), intent(in) :: self
      complex(wp), intent(in) :: f(:, :)
      complex(wp) :: restricted(self%unknowns_after, size(f, 2))
      integer :: i, j, k

      restricted = 0
      associate (t => self%expansion)
         do j = 1, size(f, 2)
            do i = 1, self%unknowns_before
               do k = t%row_start(i), t%row_start(i + 1) - 1
                  restricted(t%column(k), j) = restricted(t%column(k), j) + t%value(k)*f(i, j)
               end do
            end do
         end do
      end associate
   end function restrict
end module kschur_presolve
