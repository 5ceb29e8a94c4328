!> Messages between the first processes of groups: the problem, counts, parts, the modes of a part.
module kschur_band_messages
   use kschur_band_part, only: part_modes_type
   use kschur_band_parts, only: part_type
   use kschur_clock, only: clock, seconds_since
   use kschur_effort, only: purpose_names
   use kschur_error, only: error_type, new_error
   use kschur_kinds, only: wp, long
   use kschur_memory, only: complex_bytes, integer_bytes, real_bytes, require_memory
   use kschur_options, only: formulation_proportional, formulation_symmetric, modal_options_type
   use kschur_problem, only: damping_none, modal_problem_type
   use kschur_processes, only: broadcast_request, sleep_briefly, spread_error
   use kschur_sparse, only: csr_matrix_type
   use mpi_f08, only: MPI_ANY_SOURCE, MPI_Bcast, MPI_CHARACTER, MPI_Comm, MPI_DOUBLE_COMPLEX, MPI_DOUBLE_PRECISION, &
      MPI_INTEGER, MPI_Iprobe, MPI_Recv, MPI_Reduce, MPI_Send, MPI_Status, MPI_STATUS_IGNORE, MPI_SUM
   implicit none
   private
   public :: add_counts, receive_part, send_part, share_parts, share_problem, share_thetas

   integer, parameter :: number_of_options = 9, head_length = 13 + size(purpose_names)

contains

   !> Broadcasts a symmetric problem with no or proportional damping, and its options. Fails in all processes if one has no memory
   !> for it.
   subroutine share_problem(problem, options, communicator, error)
      type(modal_problem_type), intent(inout) :: problem
      type(modal_options_type), intent(inout) :: options
      type(MPI_Comm), intent(in) :: communicator
      type(error_type), allocatable, intent(out) :: error
      integer :: numbers(number_of_options)

      numbers = [options%constraint_scaling, options%inner, options%subspace, options%block, options%max_restarts, &
         merge(1, 0, options%presolve), options%seed, options%distribute, &
         problem%damping_kind]
      call MPI_Bcast(numbers, size(numbers), MPI_INTEGER, 0, communicator)
      options%constraint_scaling = numbers(1)
      options%inner = numbers(2)
      options%subspace = numbers(3)
      options%block = numbers(4)
      options%max_restarts = numbers(5)
      options%presolve = numbers(6) == 1
      options%seed = numbers(7)
      options%distribute = numbers(8)
      problem%damping_kind = numbers(9)
      options%formulation = merge(formulation_symmetric, formulation_proportional, problem%damping_kind == damping_none)
      call MPI_Bcast(options%tolerance, 1, MPI_DOUBLE_PRECISION, 0, communicator)
      call MPI_Bcast(problem%alpha, 1, MPI_DOUBLE_PRECISION, 0, communicator)
      call MPI_Bcast(problem%beta, 1, MPI_DOUBLE_PRECISION, 0, communicator)
      call share_matrix(problem%mass, communicator, error)
      if (.not. allocated(error)) call share_matrix(problem%damping, communicator, error)
      if (.not. allocated(error)) call share_matrix(problem%stiffness, communicator, error)
      if (.not. allocated(error)) call share_matrix(problem%constraints, communicator, error)
      problem%symmetric = .true.
   end subroutine share_problem

   ! Broadcasts a matrix of the first process.
   subroutine share_matrix(matrix, communicator, error)
      type(csr_matrix_type), intent(inout) :: matrix
      type(MPI_Comm), intent(in) :: communicator
      type(error_type), allocatable, intent(out) :: error
      integer :: numbers(3)

      numbers = [matrix%rows, matrix%columns, 0]
      if (allocated(matrix%column)) numbers(3) = size(matrix%column)
      call MPI_Bcast(numbers, 3, MPI_INTEGER, 0, communicator)
      matrix%rows = numbers(1)
      matrix%columns = numbers(2)
      if (.not. allocated(matrix%column)) call require_memory((integer_bytes + real_bytes)*numbers(3) + integer_bytes*numbers(1), &
         "the matrices in another process", error)
      call spread_error(communicator, error)
      if (allocated(error)) return
      if (.not. allocated(matrix%column)) &
         allocate (matrix%row_start(numbers(1) + 1), matrix%column(numbers(3)), matrix%value(numbers(3)))
      call MPI_Bcast(matrix%row_start, numbers(1) + 1, MPI_INTEGER, 0, communicator)
      call MPI_Bcast(matrix%column, numbers(3), MPI_INTEGER, 0, communicator)
      call MPI_Bcast(matrix%value, numbers(3), MPI_DOUBLE_PRECISION, 0, communicator)
   end subroutine share_matrix

   !> Broadcasts the theta below which the first process wants eigenvalues counted; none: it wants no more counts.
   subroutine share_thetas(theta, communicator)
      real(wp), allocatable, intent(inout) :: theta(:)
      type(MPI_Comm), intent(in) :: communicator
      integer :: numbers(1)

      numbers = 0
      if (allocated(theta)) numbers = size(theta)
      call broadcast_request(numbers, communicator)
      if (.not. allocated(theta)) allocate (theta(numbers(1)))
      call MPI_Bcast(theta, numbers(1), MPI_DOUBLE_PRECISION, 0, communicator)
   end subroutine share_thetas

   !> Adds up the counts of all groups in the first process.
   subroutine add_counts(below, communicator)
      integer, intent(inout) :: below(:)
      type(MPI_Comm), intent(in) :: communicator
      integer :: mine(size(below))

      mine = below
      call MPI_Reduce(mine, below, size(below), MPI_INTEGER, MPI_SUM, 0, communicator)
   end subroutine add_counts

   !> Broadcasts the list of parts of the first process.
   subroutine share_parts(parts, communicator)
      type(part_type), allocatable, intent(inout) :: parts(:)
      type(MPI_Comm), intent(in) :: communicator
      integer :: numbers(1), i

      numbers = 0
      if (allocated(parts)) numbers = size(parts)
      call broadcast_request(numbers, communicator)
      if (.not. allocated(parts)) allocate (parts(numbers(1)))
      do i = 1, numbers(1)
         associate (part => parts(i))
            call MPI_Bcast(part%from, 1, MPI_DOUBLE_PRECISION, 0, communicator)
            call MPI_Bcast(part%to, 1, MPI_DOUBLE_PRECISION, 0, communicator)
            call MPI_Bcast(part%below_from, 1, MPI_INTEGER, 0, communicator)
            call MPI_Bcast(part%below_to, 1, MPI_INTEGER, 0, communicator)
         end associate
      end do
   end subroutine share_parts

   !> Sends the modes of part i, or an error, to the first process.
   subroutine send_part(i, found, error, communicator)
      integer, intent(in) :: i
      type(part_modes_type), intent(inout) :: found
      type(error_type), allocatable, intent(in) :: error
      type(MPI_Comm), intent(in) :: communicator
      integer :: head(head_length), j

      head = 0
      if (allocated(error)) head(1:2) = [error%code, len(error%message)]
      if (.not. allocated(error)) then
         associate (effort => found%effort)
            head(3:) = [size(found%lambda), found%rows(), size(found%xi, 1), merge(1, 0, found%is_real()), found%reason, &
               found%certified, merge(1, 0, found%counted), size(found%history%converged), found%oscillators, &
               effort%operator_applications, effort%restarts, effort%factorizations_for]
         end associate
      end if
      call MPI_Send(head, size(head), MPI_INTEGER, 0, i, communicator)
      if (allocated(error)) then
         call MPI_Send(error%message, head(2), MPI_CHARACTER, 0, i, communicator)
         return
      end if
      call MPI_Send(found%lambda, size(found%lambda), MPI_DOUBLE_COMPLEX, 0, i, communicator)
      do j = 1, size(found%lambda)
         if (found%is_real()) then
            call MPI_Send(found%real_phi(:, j), size(found%real_phi, 1), MPI_DOUBLE_PRECISION, 0, i, communicator)
         else
            call MPI_Send(found%phi(:, j), size(found%phi, 1), MPI_DOUBLE_COMPLEX, 0, i, communicator)
         end if
         call MPI_Send(found%xi(:, j), size(found%xi, 1), MPI_DOUBLE_COMPLEX, 0, i, communicator)
      end do
      call MPI_Send(found%backward_error, head(3), MPI_DOUBLE_PRECISION, 0, i, communicator)
      call MPI_Send(found%error_bound, head(3), MPI_DOUBLE_PRECISION, 0, i, communicator)
      call MPI_Send(found%locking_error, 1, MPI_DOUBLE_PRECISION, 0, i, communicator)
      call MPI_Send(found%history%converged, head(10), MPI_INTEGER, 0, i, communicator)
      call MPI_Send(found%history%operator_applications, head(10), MPI_INTEGER, 0, i, communicator)
      call MPI_Send(found%history%residual, head(10), MPI_DOUBLE_PRECISION, 0, i, communicator)
   end subroutine send_part

   !> Receives the modes of part i; fails if the other process failed.
   subroutine receive_part(i, found, error, communicator)
      integer, intent(in) :: i
      type(part_modes_type), intent(out) :: found
      type(error_type), allocatable, intent(out) :: error
      type(MPI_Comm), intent(in) :: communicator
      integer :: head(head_length), from
      character(len=:), allocatable :: message

      call await_part(i, from, communicator)
      call MPI_Recv(head, size(head), MPI_INTEGER, from, i, communicator, MPI_STATUS_IGNORE)
      if (head(1) /= 0) then
         allocate (character(len=head(2)) :: message)
         call MPI_Recv(message, head(2), MPI_CHARACTER, from, i, communicator, MPI_STATUS_IGNORE)
         call new_error(error, head(1), message)
         return
      end if
      found%reason = head(7)
      found%certified = head(8)
      found%counted = head(9) == 1
      found%oscillators = head(11)
      found%effort%operator_applications = head(12)
      found%effort%restarts = head(13)
      found%effort%factorizations_for = head(14:)
      found%effort%factorizations = sum(found%effort%factorizations_for)
      call receive_vectors(i, from, head(3:6), found, communicator, error)
      allocate (found%backward_error(head(3)), found%error_bound(head(3)))
      allocate (found%history%converged(head(10)), found%history%operator_applications(head(10)), &
         found%history%residual(head(10)))
      call MPI_Recv(found%backward_error, head(3), MPI_DOUBLE_PRECISION, from, i, communicator, MPI_STATUS_IGNORE)
      call MPI_Recv(found%error_bound, head(3), MPI_DOUBLE_PRECISION, from, i, communicator, MPI_STATUS_IGNORE)
      call MPI_Recv(found%locking_error, 1, MPI_DOUBLE_PRECISION, from, i, communicator, MPI_STATUS_IGNORE)
      call MPI_Recv(found%history%converged, head(10), MPI_INTEGER, from, i, communicator, MPI_STATUS_IGNORE)
      call MPI_Recv(found%history%operator_applications, head(10), MPI_INTEGER, from, i, communicator, MPI_STATUS_IGNORE)
      call MPI_Recv(found%history%residual, head(10), MPI_DOUBLE_PRECISION, from, i, communicator, MPI_STATUS_IGNORE)
   end subroutine receive_part

   ! Receives eigenvalues, shapes and multipliers by columns, since all of them may have more entries than an integer can count.
   ! They are received even if there is no memory to keep them, as the sender waits.
   subroutine receive_vectors(i, from, shape, found, communicator, error)
      integer, intent(in) :: i, from
      !> Numbers of columns, rows and multipliers; 1 for real shapes.
      integer, intent(in) :: shape(4)
      type(part_modes_type), intent(inout) :: found
      type(MPI_Comm), intent(in) :: communicator
      type(error_type), allocatable, intent(out) :: error
      integer :: j, kept, place

      associate (columns => shape(1), rows => shape(2), multipliers => shape(3))
         call require_memory(complex_bytes*(real(rows, wp) + multipliers)*columns, "the modes of another process", error)
         kept = columns
         if (allocated(error)) kept = min(columns, 1)
         allocate (found%lambda(columns), found%xi(multipliers, kept))
         if (shape(4) == 1) allocate (found%real_phi(rows, kept))
         if (shape(4) /= 1) allocate (found%phi(rows, kept))
         call MPI_Recv(found%lambda, columns, MPI_DOUBLE_COMPLEX, from, i, communicator, MPI_STATUS_IGNORE)
         do j = 1, columns
            place = min(j, kept)
            if (found%is_real()) then
               call MPI_Recv(found%real_phi(:, place), rows, MPI_DOUBLE_PRECISION, from, i, communicator, MPI_STATUS_IGNORE)
            else
               call MPI_Recv(found%phi(:, place), rows, MPI_DOUBLE_COMPLEX, from, i, communicator, MPI_STATUS_IGNORE)
            end if
            call MPI_Recv(found%xi(:, place), multipliers, MPI_DOUBLE_COMPLEX, from, i, communicator, MPI_STATUS_IGNORE)
         end do
      end associate
   end subroutine receive_vectors

   ! Waits, mostly asleep, for a message about part i; `from` is its sender.
   subroutine await_part(i, from, communicator)
      integer, intent(in) :: i
      integer, intent(out) :: from
      type(MPI_Comm), intent(in) :: communicator
      type(MPI_Status) :: status
      integer(long) :: started
      logical :: there

      started = clock()
      do
         call MPI_Iprobe(MPI_ANY_SOURCE, i, communicator, there, status)
         if (there) exit
         call sleep_briefly(seconds_since(started))
      end do
      from = status%MPI_SOURCE
   end subroutine await_part
end module kschur_band_messages
