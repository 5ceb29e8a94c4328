!> Backward errors of eigenpairs of a problem whose rows are distributed: each process multiplies its rows, and all run the same
!> code, so that none needs all of them.
module kschur_shared_judgement
   use kschur_backward_error, only: judge_as_given
   use kschur_eigenpairs, only: eigenpairs_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_matrix_rows, only: share_rows
   use kschur_memory, only: real_bytes, require_memory
   use kschur_processes, only: processes_type, request_judge, request_length, spread_error
   use kschur_products, only: pair_rows_type
   use kschur_row_exchange, only: send_to_all
   use kschur_row_ranges, only: row_ranges, row_ranges_type
   use kschur_shared_problem, only: shared_problem_type
   use kschur_sparse, only: csr_matrix_type, empty_csr_matrix, transpose_csr
   implicit none
   private
   public :: judge_by_rows, serve_judgement

contains

   !> As `judge_as_given`; the first process need not have the whole matrices.
   subroutine judge_by_rows(shared, processes, norms, pairs, is_rigid, errors, bounds, error)
      type(shared_problem_type), intent(inout) :: shared
      type(processes_type), intent(in) :: processes
      !> Those of the whole matrices, by `norms_of`.
      real(wp), intent(in) :: norms(4)
      class(eigenpairs_type), intent(in) :: pairs
      logical, intent(in) :: is_rigid(:)
      real(wp), intent(out) :: errors(:), bounds(:)
      !> Fails if a process runs out of memory.
      type(error_type), allocatable, intent(out) :: error
      logical :: rigid(size(is_rigid))
      type(csr_matrix_type) :: transposed

      call processes%send_request([request_judge, size(is_rigid), shared%problem%multipliers(), merge(1, 0, pairs%is_real()), &
         merge(1, 0, shared%problem%symmetric), shared%problem%damping_kind])
      shared%rows%symmetric = shared%problem%symmetric
      shared%rows%damping_kind = shared%problem%damping_kind
      shared%rows%constraints = shared%problem%constraints
      rigid = is_rigid
      transposed = transpose_csr(shared%problem%constraints)
      call judge_here(shared, processes, [norms, shared%problem%alpha, shared%problem%beta], transposed, pairs, rigid, errors, &
         bounds, error)
      shared%rows%constraints = empty_csr_matrix(0, shared%problem%unknowns())
   end subroutine judge_by_rows

   !> Executes the request of the first process in another one.
   subroutine serve_judgement(shared, processes, request)
      type(shared_problem_type), intent(inout) :: shared
      type(processes_type), intent(in) :: processes
      !> After the code: numbers of pairs and multipliers, whether shapes are real, and symmetry and kind of damping of the problem.
      integer, intent(in) :: request(request_length)
      type(eigenpairs_type) :: pairs
      type(csr_matrix_type) :: none
      ! The first process has the same error.
      type(error_type), allocatable :: error
      real(wp), dimension(request(2)) :: errors, bounds
      logical :: rigid(request(2))

      associate (k => request(2))
         allocate (pairs%lambda(k), pairs%xi(0, k))
         if (request(4) > 0) allocate (pairs%real_phi(0, k))
         if (request(4) == 0) allocate (pairs%phi(0, k))
      end associate
      shared%rows%symmetric = request(5) > 0
      shared%rows%damping_kind = request(6)
      none%columns = request(3)
      call judge_here(shared, processes, spread(0.0_wp, 1, 6), none, pairs, rigid, errors, bounds, error)
   end subroutine serve_judgement

   ! Judges the pairs of the first process, each process with its rows; collective.
   subroutine judge_here(shared, processes, numbers, transposed, pairs, is_rigid, errors, bounds, error)
      type(shared_problem_type), intent(inout) :: shared
      type(processes_type), intent(in) :: processes
      !> Of the first process: norms, alpha and beta; Cq^T; the pairs, and which are rigid.
      real(wp), intent(in) :: numbers(6)
      type(csr_matrix_type), intent(in) :: transposed
      class(eigenpairs_type), intent(in) :: pairs
      logical, intent(inout) :: is_rigid(:)
      real(wp), intent(out) :: errors(:), bounds(:)
      type(error_type), allocatable, intent(out) :: error
      ! Memory check: four columns of shapes whole, those packed and those sent, and up to six times four of rows here.
      integer, parameter :: whole = 8, here = 24
      type(row_ranges_type) :: ranges
      type(pair_rows_type) :: rows
      type(eigenpairs_type) :: same
      real(wp) :: known(6, 1), marks(size(is_rigid), 1)
      complex(wp) :: lambda(size(is_rigid), 1)

      ranges = row_ranges(shared%all_rows(1), processes%number)
      call require_memory(real_bytes*(whole*real(shared%all_rows(1), wp) + here*real(ranges%rows(processes%rank), wp)), &
         "products of shapes", error)
      call spread_error(processes%communicator, error)
      if (.not. allocated(error)) &
         call share_rows(transposed, ranges, transposed%columns, processes%communicator, rows%transposed, error)
      if (allocated(error)) return
      rows%before = ranges%before(processes%rank)
      rows%sums%communicator = processes%communicator
      known(:, 1) = numbers
      call send_to_all(processes, known)
      rows%norms = known(:4, 1)
      shared%rows%alpha = known(5, 1)
      shared%rows%beta = known(6, 1)
      marks(:, 1) = merge(1.0_wp, 0.0_wp, is_rigid)
      call send_to_all(processes, marks)
      is_rigid = marks(:, 1) > 0
      lambda(:, 1) = pairs%lambda
      call send_to_all(processes, lambda)
      if (processes%rank == 0) then
         call judge_as_given(shared%rows, pairs, is_rigid, errors, bounds, rows)
      else
         same = pairs
         same%lambda = lambda(:, 1)
         call judge_as_given(shared%rows, same, is_rigid, errors, bounds, rows)
      end if
   end subroutine judge_here
end module kschur_shared_judgement
