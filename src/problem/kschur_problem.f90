!> The modal problem (lambda^2 M + lambda R + K + i H) phi + Cq^T xi = 0, Cq phi = 0, Im lambda >= 0: its matrices, their
!> checks, and its classification.
module kschur_problem
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use kschur_damping, only: classify_damping, damping_general, damping_names, damping_none, damping_proportional
   use kschur_error, only: error_type, new_error, error_input, error_usage
   use kschur_kinds, only: long, wp
   use kschur_loss, only: factor_of_loss, times_factor
   use kschur_memory, only: require_memory
   use kschur_mesh, only: mesh_type
   use kschur_sparse, only: csr_matrix_type, empty_csr_matrix
   use kschur_symmetric_storage, only: settle_storage, symmetric_check, symmetric_no
   use kschur_text, only: text
   use kschur_tolerances, only: largest_entry, rounding_of_entry
   implicit none
   private
   public :: check_sums, modal_problem_type, new_modal_problem, refuse_loss, settle_modal_problem
   public :: damping_general, damping_names, damping_none, damping_proportional

   !> A checked problem; created by `new_modal_problem` or `settle_modal_problem`, not changed afterwards.
   type :: modal_problem_type
      !> Mass matrix M, n x n (kg and kg m^2 in SI).
      type(csr_matrix_type) :: mass
      !> Stiffness matrix K, n x n (N/m and N m in SI).
      type(csr_matrix_type) :: stiffness
      !> Damping and gyroscopic matrix R, n x n (N s/m in SI); without entries if none was given.
      type(csr_matrix_type) :: damping
      !> Constraint Jacobian Cq, m x n; m = 0 if none was given.
      type(csr_matrix_type) :: constraints
      !> Loss stiffness H, n x n (N/m and N m in SI): hysteresis adds i H to K. Not allocated: none.
      type(csr_matrix_type), allocatable :: loss
      !> Loss factor g if H = g K to rounding; else 0.
      real(wp) :: loss_factor = 0
      !> Whether M, R, K and H are all symmetric to rounding.
      logical :: symmetric = .false.
      !> One of `damping_none`, `damping_proportional`, `damping_general`.
      integer :: damping_kind = damping_none
      !> If the damping is proportional, possibly except at a few unknowns: R = alpha M + beta K (1/s, s).
      real(wp) :: alpha = 0, beta = 0
      !> The exception at those few, n x n. Not allocated: none, or general damping.
      type(csr_matrix_type), allocatable :: dampers
      !> Elimination order for matrices of the problem: unknown i (multipliers last) is eliminated as number position(i). Not
      !> allocated: not computed yet.
      integer, allocatable :: position(:)
      !> First index in messages and notes: 1, or 0 as in C.
      integer :: index_base = 1
      !> Checked mesh; not allocated: none.
      type(mesh_type), allocatable :: mesh
   contains
      !> Number of unknowns n.
      procedure :: unknowns
      !> Number of constraints m.
      procedure :: multipliers
      !> Memory in bytes of its matrices.
      procedure :: bytes
      !> Sets H = g K. Fails if there is an H already, or g is not finite.
      procedure :: set_loss_factor
   end type modal_problem_type

contains

   !> Creates a problem from its matrices after checking them: shapes, finite values, a nonzero mass or damping matrix, no empty
   !> constraint, no half of a symmetric matrix unless declared.
   subroutine new_modal_problem(problem, mass, stiffness, error, damping, constraints, kind_of, symmetric, loss)
      type(modal_problem_type), intent(out) :: problem
      type(csr_matrix_type), intent(in) :: mass, stiffness
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type), intent(in), optional :: damping, constraints
      !> A problem with the same symmetry and kind of damping. Absent: classified.
      type(modal_problem_type), intent(in), optional :: kind_of
      !> Whether M, R, K and H are given as halves of symmetric matrices: `symmetric_lower` or `symmetric_upper`;
      !> `symmetric_no`: they are complete. Absent, `symmetric_check`: what looks like a half is an error.
      integer, intent(in), optional :: symmetric
      !> H; absent: none.
      type(csr_matrix_type), intent(in), optional :: loss

      real(wp) :: needed

      needed = mass%bytes() + stiffness%bytes()
      if (present(damping)) needed = needed + damping%bytes()
      if (present(constraints)) needed = needed + constraints%bytes()
      if (present(loss)) needed = needed + loss%bytes()
      call require_memory(needed, "the matrices of the problem", error)
      if (allocated(error)) return
      problem%mass = mass
      problem%stiffness = stiffness
      if (present(damping)) then
         problem%damping = damping
      else
         problem%damping = empty_csr_matrix(mass%rows, mass%rows)
      end if
      if (present(constraints)) then
         problem%constraints = constraints
      else
         problem%constraints = empty_csr_matrix(0, mass%rows)
      end if
      if (present(loss)) allocate (problem%loss, source=loss)
      call settle_modal_problem(problem, error, kind_of, symmetric)
   end subroutine new_modal_problem

   !> Checks and classifies a problem whose matrices are set, as `new_modal_problem` does.
   subroutine settle_modal_problem(problem, error, kind_of, symmetric)
      type(modal_problem_type), intent(inout) :: problem
      type(error_type), allocatable, intent(out) :: error
      type(modal_problem_type), intent(in), optional :: kind_of
      integer, intent(in), optional :: symmetric
      integer :: n, storage

      n = problem%mass%rows
      if (problem%mass%columns /= n) call new_error(error, error_input, "the mass matrix M is "//text(n)//" x "// &
         text(problem%mass%columns)//" but must be square")
      associate (base => problem%index_base)
         if (.not. allocated(error)) call check_matrix(problem%mass, n, n, base, "mass matrix M", error)
         if (.not. allocated(error)) call check_matrix(problem%stiffness, n, n, base, "stiffness matrix K", error)
         if (.not. allocated(error)) call check_matrix(problem%damping, n, n, base, "damping matrix R", error)
         if (.not. allocated(error)) call check_columns(problem%constraints, n, error)
         if (.not. allocated(error)) &
            call check_matrix(problem%constraints, problem%constraints%rows, n, base, "constraint Jacobian Cq", error)
         if (allocated(problem%loss) .and. .not. allocated(error)) &
            call check_matrix(problem%loss, n, n, base, "loss matrix H", error)
         ! A reduced matrix may have become triangular.
         storage = merge(symmetric_no, symmetric_check, present(kind_of))
         if (present(symmetric)) storage = symmetric
         call settle_storage(problem%mass, storage, base, "mass matrix M", error)
         call settle_storage(problem%stiffness, storage, base, "stiffness matrix K", error)
         call settle_storage(problem%damping, storage, base, "damping matrix R", error)
         if (allocated(problem%loss)) call settle_storage(problem%loss, storage, base, "loss matrix H", error)
      end associate
      if (.not. present(kind_of)) call check_all_magnitudes(problem, error)
      if (.not. allocated(error)) call check_mass_and_constraints(problem, present(kind_of), error)
      if (.not. allocated(error)) call check_sums([int(n, long), int(problem%multipliers(), long)], &
         [int(problem%mass%nonzeros(), long), int(problem%stiffness%nonzeros(), long) + entries_of_loss(problem), &
         int(problem%damping%nonzeros(), long), int(problem%constraints%nonzeros(), long)], error)
      if (.not. allocated(error)) call require_memory(2*problem%bytes(), "transposed matrices", error)
      if (allocated(error)) return

      if (present(kind_of)) then
         problem%symmetric = kind_of%symmetric
         problem%damping_kind = kind_of%damping_kind
         problem%alpha = kind_of%alpha
         problem%beta = kind_of%beta
         problem%loss_factor = kind_of%loss_factor
      else
         problem%symmetric = problem%mass%is_symmetric() .and. problem%stiffness%is_symmetric() &
            .and. problem%damping%is_symmetric()
         call classify_damping(problem%mass, problem%stiffness, problem%damping, problem%damping_kind, problem%alpha, &
            problem%beta, problem%dampers)
         call classify_loss(problem)
      end if
   end subroutine settle_modal_problem

   ! Classifies H: symmetry, and loss factor if H = g K; drops a zero H.
   subroutine classify_loss(problem)
      type(modal_problem_type), intent(inout) :: problem

      problem%loss_factor = 0
      if (.not. allocated(problem%loss)) return
      if (problem%loss%is_zero()) then
         deallocate (problem%loss)
         return
      end if
      problem%symmetric = problem%symmetric .and. problem%loss%is_symmetric()
      problem%loss_factor = factor_of_loss(problem%stiffness, problem%loss)
   end subroutine classify_loss

   subroutine set_loss_factor(self, factor, error)
      class(modal_problem_type), intent(inout) :: self
      !> g
      real(wp), intent(in) :: factor
      type(error_type), allocatable, intent(out) :: error

      if (allocated(self%loss)) then
         call new_error(error, error_input, "the problem has a loss matrix H: leave out the loss factor, or the matrix")
      else if (.not. abs(factor) <= largest_entry) then
         call new_error(error, error_input, "the loss factor is "//text(factor)//" but must be a number below 1e75")
      else
         call require_memory(self%stiffness%bytes(), "the loss matrix H", error)
      end if
      if (allocated(error)) return
      allocate (self%loss, source=times_factor(self%stiffness, factor))
      call check_magnitudes(self%loss, self%index_base, "loss matrix H", error)
      if (allocated(error)) return
      self%loss_factor = factor
      if (self%loss%is_zero()) deallocate (self%loss)
   end subroutine set_loss_factor

   !> Fails if a problem has an H, which the requested computation does not support.
   subroutine refuse_loss(problem, what, error)
      type(modal_problem_type), intent(in) :: problem
      !> Subject of the message, as "a band".
      character(len=*), intent(in) :: what
      type(error_type), allocatable, intent(inout) :: error

      if (allocated(problem%loss) .and. .not. allocated(error)) call new_error(error, error_usage, &
         what//" and a loss matrix H do not go together yet: leave out one of them")
   end subroutine refuse_loss

   !> Fails if a matrix assembled from M, R, K and Cq may have more entries than a default integer can count. Damped pencils
   !> have most: the entries of M, R and K, Cq twice, and two identities; with a diagonal for multipliers this bounds all
   !> others.
   pure subroutine check_sums(order, entries, error)
      !> Numbers of unknowns and of multipliers.
      integer(long), intent(in) :: order(2)
      !> Of M, K, R and Cq.
      integer(long), intent(in) :: entries(4)
      type(error_type), allocatable, intent(out) :: error
      integer(long) :: total

      total = sum(entries) + entries(4) + 2*order(1) + order(2)
      if (total >= huge(1)) call new_error(error, error_input, "the matrices are too large together: a sum of M, R and K with "// &
         "Cq and its transpose has up to "//text(total)//" entries, and only "//text(huge(1) - 1)//" can be counted")
   end subroutine check_sums

   ! Fails unless Cq has one column for each unknown.
   subroutine check_columns(constraints, unknowns, error)
      type(csr_matrix_type), intent(in) :: constraints
      integer, intent(in) :: unknowns
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: advice

      if (constraints%columns == unknowns) return
      advice = "a row for each constraint"
      if (constraints%rows == unknowns) advice = advice//": it is given transposed"
      call new_error(error, error_input, "the constraint Jacobian Cq is "//text(constraints%rows)//" x "// &
         text(constraints%columns)//" but must have "//text(unknowns)//" columns, one for each unknown, and "//advice)
   end subroutine check_columns

   ! Fails if a matrix has other extents, or an entry that is not finite.
   subroutine check_matrix(matrix, rows, columns, base, name, error)
      type(csr_matrix_type), intent(in) :: matrix
      integer, intent(in) :: rows, columns, base
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(out) :: error
      integer, allocatable :: row(:)
      integer :: k

      if (matrix%rows /= rows .or. matrix%columns /= columns) then
         call new_error(error, error_input, "the "//name//" is "//text(matrix%rows)//" x "// &
            text(matrix%columns)//" but must be "//text(rows)//" x "//text(columns)//" to fit the mass matrix")
         return
      end if
      do k = 1, matrix%nonzeros()
         if (ieee_is_finite(matrix%value(k))) cycle
         allocate (row(matrix%nonzeros()), source=matrix%row_indices())
         call new_error(error, error_input, "the "//name//" has an entry that is not a finite number at ("// &
            text(row(k) + base - 1)//", "//text(matrix%column(k) + base - 1)//")")
         return
      end do
   end subroutine check_matrix

   subroutine check_all_magnitudes(problem, error)
      type(modal_problem_type), intent(in) :: problem
      type(error_type), allocatable, intent(inout) :: error

      associate (base => problem%index_base)
         call check_magnitudes(problem%mass, base, "mass matrix M", error)
         call check_magnitudes(problem%stiffness, base, "stiffness matrix K", error)
         call check_magnitudes(problem%damping, base, "damping matrix R", error)
         call check_magnitudes(problem%constraints, base, "constraint Jacobian Cq", error)
         if (allocated(problem%loss)) call check_magnitudes(problem%loss, base, "loss matrix H", error)
      end associate
   end subroutine check_all_magnitudes

   ! Fails if products of entries overflow, or underflow where that is not below the rounding of others.
   subroutine check_magnitudes(matrix, base, name, error)
      type(csr_matrix_type), intent(in) :: matrix
      integer, intent(in) :: base
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(inout) :: error
      real(wp), allocatable :: of_rows(:), of_columns(:)
      integer, allocatable :: row(:)
      integer :: k
      logical :: fits

      if (allocated(error) .or. matrix%nonzeros() == 0) return
      if (maxval(abs(matrix%value)) <= largest_entry .and. &
         .not. any(abs(matrix%value) > 0 .and. abs(matrix%value) < 1/largest_entry)) return
      allocate (row(matrix%nonzeros()), source=matrix%row_indices())
      allocate (of_rows, source=matrix%row_maxima())
      allocate (of_columns(matrix%columns), source=0.0_wp)
      do k = 1, matrix%nonzeros()
         of_columns(matrix%column(k)) = max(of_columns(matrix%column(k)), abs(matrix%value(k)))
      end do
      do k = 1, matrix%nonzeros()
         associate (entry => abs(matrix%value(k)))
            fits = entry <= largest_entry .and. (entry >= 1/largest_entry .or. &
               entry <= rounding_of_entry*min(of_rows(row(k)), of_columns(matrix%column(k))))
         end associate
         if (fits) cycle
         call new_error(error, error_input, "the "//name//" has the entry "//text(matrix%value(k))//" at ("// &
            text(row(k) + base - 1)//", "//text(matrix%column(k) + base - 1)//"), and entries from 1e-75 to 1e75 can be "// &
            "computed with: choose other units")
         return
      end do
   end subroutine check_magnitudes

   ! Fails without unknowns, with neither mass nor damping, or with an empty constraint.
   subroutine check_mass_and_constraints(problem, reduced, error)
      type(modal_problem_type), intent(in) :: problem
      !> Whether eliminated constraints may have removed all mass.
      logical, intent(in) :: reduced
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: maxima(:)
      integer :: i

      if (problem%unknowns() == 0) then
         call new_error(error, error_input, "the mass matrix M has no rows")
      else if (problem%mass%is_zero() .and. problem%damping%is_zero() .and. .not. reduced) then
         call new_error(error, error_input, "the mass matrix M is zero, and there is no damping: there are no modes")
      else
         allocate (maxima(problem%multipliers()), source=problem%constraints%row_maxima())
         do i = 1, size(maxima)
            if (maxima(i) > 0) cycle
            call new_error(error, error_input, "row "//text(i + problem%index_base - 1)//" of the constraint Jacobian Cq is empty")
            return
         end do
      end if
   end subroutine check_mass_and_constraints

   pure integer function unknowns(self)
      class(modal_problem_type), intent(in) :: self

      unknowns = self%mass%rows
   end function unknowns

   pure integer function multipliers(self)
      class(modal_problem_type), intent(in) :: self

      multipliers = self%constraints%rows
   end function multipliers

   pure real(wp) function bytes(self)
      class(modal_problem_type), intent(in) :: self

      bytes = self%mass%bytes() + self%stiffness%bytes() + self%damping%bytes() + self%constraints%bytes()
      if (allocated(self%loss)) bytes = bytes + self%loss%bytes()
   end function bytes

   pure integer(long) function entries_of_loss(problem) result(entries)
      type(modal_problem_type), intent(in) :: problem

      entries = 0
      if (allocated(problem%loss)) entries = problem%loss%nonzeros()
   end function entries_of_loss
end module kschur_problem
