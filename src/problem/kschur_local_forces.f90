!> Local unsymmetric or nonproportional forces at a few unknowns: dampers, lossy bushings, gyroscopic discs, follower forces.
module kschur_local_forces
   use kschur_error, only: error_type, new_error, error_library
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgeqp3, dtrsm
   use kschur_loss, only: find_local_loss
   use kschur_problem, only: modal_problem_type, damping_general
   use kschur_sparse, only: csr_matrix_type, linear_combination, new_csr_from_triplets, transpose_csr
   use kschur_text, only: text
   use kschur_tolerances, only: rounding_of_row, rounding_of_sums
   implicit none
   private
   public :: description_of, local_forces_type, new_local_forces, symmetric_stiffness

   ! Largest number of unknowns.
   integer, parameter :: most = 256

   !> With K_s the symmetric part of K, R = alpha M + beta K_s + B S, K = K_s + B T and H = g K_s + B U: B has few columns, S, T and
   !> U few nonzero columns.
   type :: local_forces_type
      !> Unknowns that forces act on, and unknowns that they depend on.
      integer, allocatable :: rows(:), columns(:)
      !> Nonzero rows of B, size(rows) x r.
      real(wp), allocatable :: directions(:, :)
      !> Nonzero columns of S, T and U, r x size(columns).
      real(wp), allocatable :: damping(:, :), stiffness(:, :), loss(:, :)
      !> g.
      real(wp) :: loss_factor = 0
   contains
      !> r.
      procedure :: rank
      !> B, n x r.
      procedure :: columns_of_b
      !> f := f + a (lambda B S + B T + i B U) x.
      procedure :: add_forces
   end type local_forces_type

contains

   !> Factors the nonproportional damping, the skew part of K and the nonproportional losses into local forces, possibly none; `few`
   !> is false if they act at too many unknowns.
   subroutine new_local_forces(problem, forces, few, error)
      type(modal_problem_type), intent(in) :: problem
      type(local_forces_type), intent(out) :: forces
      logical, intent(out) :: few
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: dampers, skew, loss
      real(wp), allocatable :: damping(:, :), stiffness(:, :), losses(:, :)

      few = allocated(problem%dampers) .or. problem%damping_kind /= damping_general
      if (.not. few) return
      call find_skew(problem, skew, few, error)
      if (allocated(error) .or. .not. few) return
      dampers = skew
      dampers%value = problem%beta*dampers%value
      if (allocated(problem%dampers)) dampers = linear_combination(1.0_wp, dampers, 1.0_wp, problem%dampers)
      loss = skew
      loss%value = 0
      if (allocated(problem%loss)) call find_loss(problem, skew, forces%loss_factor, loss, few, error)
      if (allocated(error) .or. .not. few) return
      allocate (forces%rows, source=filled(max(dampers%row_maxima(), loss%row_maxima()), skew%row_maxima()))
      allocate (forces%columns, source=filled(max(column_maxima(dampers), column_maxima(loss)), column_maxima(skew)))
      few = max(size(forces%rows), size(forces%columns)) <= most
      if (.not. few) return
      allocate (damping, source=block_of(dampers, forces))
      allocate (stiffness, source=block_of(skew, forces))
      allocate (losses, source=block_of(loss, forces))
      call factor(forces, damping, stiffness, losses, error)
   end subroutine new_local_forces

   ! Splits H = g K_s + L.
   subroutine find_loss(problem, skew, factor, local, few, error)
      type(modal_problem_type), intent(in) :: problem
      !> K - K_s.
      type(csr_matrix_type), intent(in) :: skew
      real(wp), intent(out) :: factor
      type(csr_matrix_type), intent(inout) :: local
      logical, intent(out) :: few
      type(error_type), allocatable, intent(out) :: error

      factor = problem%loss_factor
      few = .true.
      if (.not. abs(factor) > 0) call find_local_loss(problem%stiffness, problem%loss, most, factor, local, few, error)
      if (allocated(error) .or. .not. few) return
      local = linear_combination(1.0_wp, local, factor, skew)
   end subroutine find_loss

   !> Describes the damping, the losses and the local forces of a problem for reports.
   function description_of(problem) result(sentence)
      type(modal_problem_type), intent(in) :: problem
      character(len=128) :: sentence
      character(len=:), allocatable :: kind
      type(local_forces_type) :: forces
      type(error_type), allocatable :: error
      logical :: few

      sentence = "the damping is general"
      call new_local_forces(problem, forces, few, error)
      if (allocated(error) .or. .not. few) return
      sentence = "the damping is proportional"
      if (.not. max(abs(problem%alpha), abs(problem%beta)) > 0) sentence = "there is no damping"
      if (abs(forces%loss_factor) > 0) then
         sentence = "damping and losses are proportional"
         if (.not. max(abs(problem%alpha), abs(problem%beta)) > 0) sentence = "losses are proportional"
      end if
      if (size(forces%rows) == 0) return
      kind = "forces"
      if (problem%symmetric) kind = trim(merge("dampers", "losses ", maxval(abs(forces%damping)) > 0))
      if (kind == "dampers" .and. maxval(abs(forces%loss)) > 0) kind = "dampers and losses"
      sentence = trim(sentence)//" but for "//kind
      sentence = trim(sentence)//" at "//text(size(forces%rows))//trim(merge(" unknown ", " unknowns", size(forces%rows) == 1))
   end function description_of

   !> (K + K^T)/2.
   function symmetric_stiffness(problem) result(matrix)
      type(modal_problem_type), intent(in) :: problem
      type(csr_matrix_type) :: matrix

      matrix = linear_combination(0.5_wp, problem%stiffness, 0.5_wp, transpose_csr(problem%stiffness))
   end function symmetric_stiffness

   ! Computes (K - K^T)/2 and drops entries that are rounding errors.
   subroutine find_skew(problem, skew, few, error)
      type(modal_problem_type), intent(in) :: problem
      type(csr_matrix_type), intent(out) :: skew
      logical, intent(out) :: few
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: whole, level
      integer, allocatable :: row(:)
      logical, allocatable :: kept(:)
      integer :: n

      n = problem%unknowns()
      allocate (kept(0), row(0))
      if (.not. problem%symmetric) then
         whole = linear_combination(0.5_wp, problem%stiffness, -0.5_wp, transpose_csr(problem%stiffness))
         level = symmetric_stiffness(problem)
         kept = abs(whole%value) > rounding_of_row*abs(level%value)
         row = whole%row_indices()
         few = count(kept) <= most**2
         if (.not. few) return
         call new_csr_from_triplets(skew, n, n, pack(row, kept), pack(whole%column, kept), pack(whole%value, kept), error)
      else
         few = .true.
         call new_csr_from_triplets(skew, n, n, row, row, [real(wp) ::], error)
      end if
   end subroutine find_skew

   ! Largest magnitude in each column.
   pure function column_maxima(matrix) result(maxima)
      type(csr_matrix_type), intent(in) :: matrix
      real(wp) :: maxima(matrix%columns)
      integer :: k

      maxima = 0
      do k = 1, matrix%nonzeros()
         maxima(matrix%column(k)) = max(maxima(matrix%column(k)), abs(matrix%value(k)))
      end do
   end function column_maxima

   ! Positions at which one of two lists is positive.
   pure function filled(first, second) result(numbers)
      real(wp), intent(in) :: first(:), second(:)
      integer, allocatable :: numbers(:)
      integer :: i

      allocate (numbers, source=pack([(i, i=1, size(first))], max(first, second) > 0))
   end function filled

   ! The dense block of a matrix in the rows and columns of the forces.
   pure function block_of(matrix, forces) result(block)
      type(csr_matrix_type), intent(in) :: matrix
      type(local_forces_type), intent(in) :: forces
      real(wp) :: block(size(forces%rows), size(forces%columns))
      integer :: place(matrix%columns), i, k

      place = 0
      place(forces%columns) = [(i, i=1, size(forces%columns))]
      block = 0
      do i = 1, size(forces%rows)
         do k = matrix%row_start(forces%rows(i)), matrix%row_start(forces%rows(i) + 1) - 1
            if (place(matrix%column(k)) > 0) block(i, place(matrix%column(k))) = matrix%value(k)
         end do
      end do
   end function block_of

   ! Factors the forces: selects linearly independent rows as S, T and U, separately for each damper, so that strong ones do not
   ! hide weak ones; the others are combinations of these.
   subroutine factor(forces, damping, stiffness, loss, error)
      type(local_forces_type), intent(inout) :: forces
      real(wp), intent(in) :: damping(:, :), stiffness(:, :), loss(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: directions(size(damping, 1), size(damping, 1)), level(size(damping, 1))
      real(wp), allocatable :: combinations(:, :)
      integer :: of(size(damping, 1)), taken(size(damping, 1)), i, j, part, r
      integer, allocatable :: rows(:), pivots(:)

      level = max(maxval(abs(damping), 2), maxval(abs(stiffness), 2), maxval(abs(loss), 2))
      of = coupled_rows(abs(damping) > 0 .or. abs(stiffness) > 0 .or. abs(loss) > 0)
      directions = 0
      r = 0
      do part = 1, size(of)
         rows = pack([(i, i=1, size(of))], of == part)
         if (size(rows) == 0) cycle
         call find_rows(damping(rows, :), stiffness(rows, :), loss(rows, :), level(rows), pivots, combinations, error)
         if (allocated(error)) return
         do j = 1, size(combinations, 1)
            taken(r + j) = rows(pivots(j))
            do i = 1, size(rows)
               directions(rows(pivots(i)), r + j) = combinations(j, i)*(level(rows(pivots(i)))/level(rows(pivots(j))))
            end do
         end do
         r = r + size(combinations, 1)
      end do
      allocate (forces%directions, source=directions(:, :r))
      allocate (forces%damping, source=damping(taken(:r), :))
      allocate (forces%stiffness, source=stiffness(taken(:r), :))
      allocate (forces%loss, source=loss(taken(:r), :))
   end subroutine factor

   ! Connected components of rows that share columns, numbered by their first row.
   pure function coupled_rows(pattern) result(of)
      logical, intent(in) :: pattern(:, :)
      integer :: of(size(pattern, 1))
      integer :: i, j, number
      logical :: joined(size(pattern, 1))

      of = [(i, i=1, size(pattern, 1))]
      do j = 1, size(pattern, 2)
         if (.not. any(pattern(:, j))) cycle
         number = minval(of, mask=pattern(:, j))
         joined = [(any(pattern(:, j) .and. of == of(i)), i=1, size(of))]
         where (joined) of = number
      end do
   end function coupled_rows

   ! Rank-revealing factorisation of the rows of [first, second, third], scaled by their levels: leading pivots are independent, all
   ! rows are combinations of these.
   subroutine find_rows(first, second, third, level, pivots, combinations, error)
      real(wp), intent(in) :: first(:, :), second(:, :), third(:, :), level(:)
      integer, allocatable, intent(out) :: pivots(:)
      !> Independent rows x all rows in pivot order.
      real(wp), allocatable, intent(out) :: combinations(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: a(3*size(first, 2), size(first, 1)), tau(size(first, 1)), work(8*size(a) + 8), largest
      integer :: m, n, i, j, rank, info

      m = size(a, 1)
      n = size(a, 2)
      a(:m/3, :) = transpose(first)
      a(m/3 + 1:2*m/3, :) = transpose(second)
      a(2*m/3 + 1:, :) = transpose(third)
      do j = 1, n
         a(:, j) = a(:, j)/level(j)
      end do
      do i = 1, m
         largest = maxval(abs(a(i, :)))
         if (largest > 0) a(i, :) = a(i, :)/largest
      end do
      allocate (pivots(n), source=0)
      call dgeqp3(m, n, a, m, pivots, tau, work, size(work), info)
      rank = count([(abs(a(j, j)) > rounding_of_sums*abs(a(1, 1)), j=1, min(m, n))])
      if (info /= 0) call new_error(error, error_library, "LAPACK's dgeqp3 failed")
      allocate (combinations(rank, n), source=0.0_wp)
      do j = 1, rank
         combinations(j, j) = 1
      end do
      combinations(:, rank + 1:) = a(:rank, rank + 1:)
      call dtrsm("L", "U", "N", "N", rank, n - rank, 1.0_wp, a, m, combinations(:, rank + 1:), rank)
   end subroutine find_rows

   pure integer function rank(self)
      class(local_forces_type), intent(in) :: self

      rank = size(self%directions, 2)
   end function rank

   pure function columns_of_b(self, n) result(columns)
      class(local_forces_type), intent(in) :: self
      integer, intent(in) :: n
      real(wp) :: columns(n, size(self%directions, 2))

      columns = 0
      columns(self%rows, :) = self%directions
   end function columns_of_b

   pure subroutine add_forces(self, a, lambda, x, f)
      class(local_forces_type), intent(in) :: self
      real(wp), intent(in) :: a
      complex(wp), intent(in) :: lambda, x(:)
      complex(wp), intent(inout) :: f(:)
      complex(wp) :: strength
      integer :: i

      do i = 1, size(self%directions, 2)
         strength = a*sum((lambda*self%damping(i, :) + cmplx(self%stiffness(i, :), self%loss(i, :), wp))*x(self%columns))
         f(self%rows) = f(self%rows) + self%directions(:, i)*strength
      end do
   end subroutine add_forces
end module kschur_local_forces
