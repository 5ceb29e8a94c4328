!> The modal problem (lambda^2 M + lambda R + K) phi + Cq^T xi = 0, Cq phi = 0:
!> its four matrices, what is wrong with them, and what kind of problem they make.
module kschur_problem
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use kschur_error, only: error_type, new_error, error_input
   use kschur_kinds, only: wp
   use kschur_sparse, only: csr_matrix_type, empty_csr_matrix
   use kschur_text, only: text
   implicit none
   private
   public :: modal_problem_type, new_modal_problem

   !> No damping matrix, or one of zeros.
   integer, parameter, public :: damping_none = 0
   !> R = alpha M + beta K to rounding.
   integer, parameter, public :: damping_proportional = 1
   !> Any other damping or gyroscopic matrix.
   integer, parameter, public :: damping_general = 2
   !> The names of the kinds of damping, in this order from `damping_none` on.
   character(len=*), parameter, public :: damping_names(0:2) = [character(len=12) :: "none", "proportional", "general"]

   !> A checked problem; made by `new_modal_problem`, not changed afterwards.
   type :: modal_problem_type
      !> Mass matrix M, n x n (kg and kg m^2 in SI).
      type(csr_matrix_type) :: mass
      !> Stiffness matrix K, n x n (N/m and N m in SI).
      type(csr_matrix_type) :: stiffness
      !> Damping and gyroscopic matrix R, n x n (N s/m in SI); without entries where none was given.
      type(csr_matrix_type) :: damping
      !> Constraint Jacobian Cq, m x n; m = 0 where none was given.
      type(csr_matrix_type) :: constraints
      !> Whether M, R and K are all symmetric to rounding.
      logical :: symmetric = .false.
      !> One of `damping_none`, `damping_proportional`, `damping_general`.
      integer :: damping_kind = damping_none
      !> Where the damping is proportional: R = alpha M + beta K (1/s, s).
      real(wp) :: alpha = 0, beta = 0
      !> Unknown i, multipliers behind the others, is best eliminated as number position(i) where matrices of the
      !> problem are factored. Not allocated: not known yet.
      integer, allocatable :: position(:)
   contains
      !> Number of unknowns n.
      procedure :: unknowns
      !> Number of constraints m.
      procedure :: multipliers
   end type modal_problem_type

contains

   !> Makes a problem of its matrices after checking them: shapes, finite
   !> values, a mass matrix that is not zero, no more constraints than
   !> unknowns, no empty constraint.
   subroutine new_modal_problem(problem, mass, stiffness, error, damping, constraints, kind_of)
      type(modal_problem_type), intent(out) :: problem
      type(csr_matrix_type), intent(in) :: mass, stiffness
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type), intent(in), optional :: damping, constraints
      !> A problem that is known to have the same symmetry and the same damping. Found out where absent.
      type(modal_problem_type), intent(in), optional :: kind_of
      integer :: n

      n = mass%rows
      problem%mass = mass
      problem%stiffness = stiffness
      if (present(damping)) then
         problem%damping = damping
      else
         problem%damping = empty_csr_matrix(n, n)
      end if
      if (present(constraints)) then
         problem%constraints = constraints
      else
         problem%constraints = empty_csr_matrix(0, n)
      end if

      if (mass%columns /= n) call new_error(error, error_input, "the mass matrix M is "//text(n)//" x "// &
         text(mass%columns)//" but must be square")
      if (.not. allocated(error)) call check_matrix(problem%mass, n, n, "mass matrix M", error)
      if (.not. allocated(error)) call check_matrix(problem%stiffness, n, n, "stiffness matrix K", error)
      if (.not. allocated(error)) call check_matrix(problem%damping, n, n, "damping matrix R", error)
      if (.not. allocated(error)) &
         call check_matrix(problem%constraints, problem%constraints%rows, n, "constraint Jacobian Cq", error)
      if (.not. allocated(error)) call check_mass_and_constraints(problem, present(kind_of), error)
      if (allocated(error)) return

      if (present(kind_of)) then
         problem%symmetric = kind_of%symmetric
         problem%damping_kind = kind_of%damping_kind
         problem%alpha = kind_of%alpha
         problem%beta = kind_of%beta
      else
         problem%symmetric = problem%mass%is_symmetric() .and. problem%stiffness%is_symmetric() &
            .and. problem%damping%is_symmetric()
         call classify_damping(problem)
      end if
   end subroutine new_modal_problem

   subroutine check_matrix(matrix, rows, columns, name, error)
      type(csr_matrix_type), intent(in) :: matrix
      integer, intent(in) :: rows, columns
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
            text(row(k))//", "//text(matrix%column(k))//")")
         return
      end do
   end subroutine check_matrix

   subroutine check_mass_and_constraints(problem, reduced, error)
      type(modal_problem_type), intent(in) :: problem
      !> Whether constraints may have taken what had a mass.
      logical, intent(in) :: reduced
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: maxima(:)
      integer :: i

      if (problem%unknowns() == 0) then
         call new_error(error, error_input, "the mass matrix M has no rows")
      else if (problem%mass%is_zero() .and. .not. reduced) then
         call new_error(error, error_input, "the mass matrix M is zero: there are no modes")
      else if (problem%multipliers() > problem%unknowns()) then
         call new_error(error, error_input, "the constraint Jacobian Cq has "//text(problem%multipliers())// &
            " rows, more than the "//text(problem%unknowns())//" unknowns")
      else
         allocate (maxima(problem%multipliers()), source=problem%constraints%row_maxima())
         do i = 1, size(maxima)
            if (maxima(i) > 0) cycle
            call new_error(error, error_input, "row "//text(i)//" of the constraint Jacobian Cq is empty")
            return
         end do
      end if
   end subroutine check_mass_and_constraints

   ! Fits R = alpha M + beta K by least squares relative to the entries of R,
   ! then asks every entry to agree to rounding: of its terms, and of the row of R it stands in.
   subroutine classify_damping(problem)
      type(modal_problem_type), intent(inout) :: problem
      real(wp), parameter :: rounding = 1.0e-13_wp
      ! The entries of M, R and K where any of them has one, and their rows.
      real(wp), allocatable :: entries(:, :), row_level(:)
      integer, allocatable :: row(:)
      real(wp) :: alpha, beta

      problem%damping_kind = damping_none
      if (problem%damping%is_zero()) return
      problem%damping_kind = damping_general
      call align(problem%mass, problem%damping, problem%stiffness, row, entries)
      associate (m => entries(:, 1), r => entries(:, 2), k => entries(:, 3))
         call fit(pack(m, abs(r) > 0), pack(k, abs(r) > 0), pack(r, abs(r) > 0), alpha, beta)
         ! A share of the size of rounding is none.
         if (maxval(abs(alpha*m)) <= rounding*maxval(abs(r))) alpha = 0
         if (maxval(abs(beta*k)) <= rounding*maxval(abs(r))) beta = 0
         allocate (row_level, source=problem%damping%row_maxima())
         if (.not. all(abs(r - alpha*m - beta*k) <= rounding*(abs(r) + abs(alpha*m) + abs(beta*k)) &
            .and. abs(r - alpha*m - beta*k) <= 10*rounding*row_level(row))) return
      end associate
      problem%damping_kind = damping_proportional
      problem%alpha = alpha
      problem%beta = beta
   end subroutine classify_damping

   ! The entries of three matrices of one shape, wherever any of them has one.
   subroutine align(a, b, c, row, entries)
      type(csr_matrix_type), intent(in) :: a, b, c
      integer, allocatable, intent(out) :: row(:)
      real(wp), allocatable, intent(out) :: entries(:, :)
      integer :: next(3), column, i, total

      call walk(filling=.false.)
      allocate (row(total))
      allocate (entries(total, 3), source=0.0_wp)
      call walk(filling=.true.)

   contains

      subroutine walk(filling)
         logical, intent(in) :: filling

         total = 0
         do i = 1, a%rows
            next = [a%row_start(i), b%row_start(i), c%row_start(i)]
            do
               column = min(column_of(a, next(1)), column_of(b, next(2)), column_of(c, next(3)))
               if (column == huge(1)) exit
               total = total + 1
               if (filling) row(total) = i
               call take(a, 1, filling)
               call take(b, 2, filling)
               call take(c, 3, filling)
            end do
         end do
      end subroutine walk

      ! Of entry k, as long as it is of row i.
      integer function column_of(matrix, k)
         type(csr_matrix_type), intent(in) :: matrix
         integer, intent(in) :: k

         column_of = huge(1)
         if (k < matrix%row_start(i + 1)) column_of = matrix%column(k)
      end function column_of

      subroutine take(matrix, j, filling)
         type(csr_matrix_type), intent(in) :: matrix
         integer, intent(in) :: j
         logical, intent(in) :: filling

         if (column_of(matrix, next(j)) /= column) return
         if (filling) entries(total, j) = matrix%value(next(j))
         next(j) = next(j) + 1
      end subroutine take
   end subroutine align

   ! alpha m + beta k = r, least squares relative to r, by orthogonalisation: the normal equations would lose
   ! alpha. Where m and k are parallel to rounding, as of K = c M, only one of them is taken.
   pure subroutine fit(m, k, r, alpha, beta)
      real(wp), intent(in) :: m(:), k(:), r(:)
      real(wp), intent(out) :: alpha, beta
      real(wp), parameter :: parallel = 1.0e-12_wp
      real(wp), dimension(size(r)) :: a, b, c, q
      real(wp) :: step
      integer :: pass

      a = m/r
      b = k/r
      q = b
      if (sum(a**2) > 0) q = b - dot_product(a, b)/sum(a**2)*a
      alpha = 0
      beta = 0
      ! The second pass fits what the rounding of long sums left.
      do pass = 1, 2
         c = 1 - alpha*a - beta*b
         if (sum(q**2) > parallel**2*sum(b**2)) then
            step = dot_product(q, c)/sum(q**2)
            beta = beta + step
            c = c - step*b
         end if
         if (sum(a**2) > 0) alpha = alpha + dot_product(a, c)/sum(a**2)
      end do
   end subroutine fit

   pure integer function unknowns(self)
      class(modal_problem_type), intent(in) :: self

      unknowns = self%mass%rows
   end function unknowns

   pure integer function multipliers(self)
      class(modal_problem_type), intent(in) :: self

      multipliers = self%constraints%rows
   end function multipliers
end module kschur_problem
