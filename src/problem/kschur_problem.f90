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
   public :: modal_problem_type, new_modal_problem, settle_modal_problem

   !> No damping matrix, or one of zeros.
   integer, parameter, public :: damping_none = 0
   !> R = alpha M + beta K to rounding.
   integer, parameter, public :: damping_proportional = 1
   !> Any other damping or gyroscopic matrix.
   integer, parameter, public :: damping_general = 2
   !> The names of the kinds of damping, in this order from `damping_none` on.
   character(len=*), parameter, public :: damping_names(0:2) = [character(len=12) :: "none", "proportional", "general"]

   ! To which damping is proportional.
   real(wp), parameter :: rounding = 1.0e-13_wp

   !> A checked problem; made by `new_modal_problem` or `settle_modal_problem`, not changed afterwards.
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
      call settle_modal_problem(problem, error, kind_of)
   end subroutine new_modal_problem

   !> The same for four matrices that stand in the problem already.
   subroutine settle_modal_problem(problem, error, kind_of)
      type(modal_problem_type), intent(inout) :: problem
      type(error_type), allocatable, intent(out) :: error
      type(modal_problem_type), intent(in), optional :: kind_of
      integer :: n

      n = problem%mass%rows
      if (problem%mass%columns /= n) call new_error(error, error_input, "the mass matrix M is "//text(n)//" x "// &
         text(problem%mass%columns)//" but must be square")
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
   end subroutine settle_modal_problem

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
      real(wp), allocatable :: m(:), k(:)
      real(wp) :: alpha, beta

      problem%damping_kind = damping_none
      if (problem%damping%is_zero()) return
      problem%damping_kind = damping_general
      call divide(problem%mass, problem%damping, m)
      call divide(problem%stiffness, problem%damping, k)
      call fit(m, k, alpha, beta)
      associate (level => maxval(abs(problem%damping%value)))
         ! A share of the size of rounding is none.
         if (maxval(abs(alpha*problem%mass%value)) <= rounding*level) alpha = 0
         if (maxval(abs(beta*problem%stiffness%value)) <= rounding*level) beta = 0
      end associate
      if (.not. is_combination(problem, alpha, beta)) return
      problem%damping_kind = damping_proportional
      problem%alpha = alpha
      problem%beta = beta
   end subroutine classify_damping

   ! The entries of a matrix over those of another of its shape, where these are not zero.
   pure subroutine divide(matrix, divisors, ratios)
      type(csr_matrix_type), intent(in) :: matrix, divisors
      real(wp), allocatable, intent(out) :: ratios(:)
      integer :: i, j, k, total

      allocate (ratios(count(abs(divisors%value) > 0)), source=0.0_wp)
      total = 0
      do i = 1, divisors%rows
         k = matrix%row_start(i)
         do j = divisors%row_start(i), divisors%row_start(i + 1) - 1
            if (.not. abs(divisors%value(j)) > 0) cycle
            total = total + 1
            do while (k < matrix%row_start(i + 1))
               if (matrix%column(k) >= divisors%column(j)) exit
               k = k + 1
            end do
            if (k == matrix%row_start(i + 1)) cycle
            if (matrix%column(k) == divisors%column(j)) ratios(total) = matrix%value(k)/divisors%value(j)
         end do
      end do
   end subroutine divide

   ! alpha m + beta k = 1, least squares, by orthogonalisation: the normal equations would lose
   ! alpha. Where m and k are parallel to rounding, as of K = c M, only one of them is taken.
   pure subroutine fit(m, k, alpha, beta)
      real(wp), intent(in) :: m(:), k(:)
      real(wp), intent(out) :: alpha, beta
      real(wp), parameter :: parallel = 1.0e-12_wp
      real(wp) :: along, square_of_m, square_of_rest, step
      integer :: pass

      ! k - along m is orthogonal to m.
      square_of_m = sum(m**2)
      along = 0
      if (square_of_m > 0) along = dot_product(m, k)/square_of_m
      square_of_rest = sum((k - along*m)**2)
      if (.not. square_of_rest > parallel**2*sum(k**2)) square_of_rest = 0
      alpha = 0
      beta = 0
      ! The second pass fits what the rounding of long sums left.
      do pass = 1, 2
         step = 0
         if (square_of_rest > 0) step = dot_product(k - along*m, 1 - alpha*m - beta*k)/square_of_rest
         if (square_of_m > 0) alpha = alpha + dot_product(m, 1 - alpha*m - beta*k - step*k)/square_of_m
         beta = beta + step
      end do
   end subroutine fit

   ! R = alpha M + beta K, to rounding.
   logical function is_combination(problem, alpha, beta)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: alpha, beta
      ! Of the row at hand, R - alpha M - beta K and the sum of the magnitudes of these.
      real(wp), dimension(problem%unknowns()) :: difference, terms
      real(wp) :: level(problem%unknowns())
      integer :: i

      level = problem%damping%row_maxima()
      difference = 0
      terms = 0
      is_combination = .true.
      do i = 1, problem%unknowns()
         call add(problem%damping, 1.0_wp)
         call add(problem%mass, -alpha)
         call add(problem%stiffness, -beta)
         call settle(problem%damping)
         call settle(problem%mass)
         call settle(problem%stiffness)
         if (.not. is_combination) return
      end do

   contains

      subroutine add(matrix, factor)
         type(csr_matrix_type), intent(in) :: matrix
         real(wp), intent(in) :: factor
         integer :: k

         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            associate (j => matrix%column(k))
               difference(j) = difference(j) + factor*matrix%value(k)
               terms(j) = terms(j) + abs(factor*matrix%value(k))
            end associate
         end do
      end subroutine add

      ! Leaves zeros behind.
      subroutine settle(matrix)
         type(csr_matrix_type), intent(in) :: matrix
         integer :: k

         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            associate (j => matrix%column(k))
               is_combination = is_combination .and. abs(difference(j)) <= rounding*min(terms(j), 10*level(i))
               difference(j) = 0
               terms(j) = 0
            end associate
         end do
      end subroutine settle
   end function is_combination

   pure integer function unknowns(self)
      class(modal_problem_type), intent(in) :: self

      unknowns = self%mass%rows
   end function unknowns

   pure integer function multipliers(self)
      class(modal_problem_type), intent(in) :: self

      multipliers = self%constraints%rows
   end function multipliers
end module kschur_problem
