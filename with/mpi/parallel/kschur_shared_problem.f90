!> A problem whose matrices are distributed by rows. The first process also has them whole, except while it needs the memory.
module kschur_shared_problem
   use kschur_error, only: error_type, error_input, error_usage, new_error
   use kschur_matrix_rows, only: drop_entries, gather_matrix
   use kschur_problem, only: modal_problem_type
   use kschur_processes, only: are_several, processes_type, spread_error, request_problem
   use kschur_row_ranges, only: row_ranges
   use kschur_sparse, only: csr_matrix_type, empty_csr_matrix
   use kschur_text, only: text
   use mpi_f08, only: MPI_Bcast, MPI_INTEGER
   implicit none
   private
   public :: shared_problem_type

   !> Created by `read_hdf5_shared_problem`.
   type :: shared_problem_type
      !> The problem, in the first process.
      type(modal_problem_type) :: problem
      !> With several processes: local rows of M, R, K and H, and total numbers of rows.
      type(modal_problem_type) :: rows
      integer :: all_rows(4) = 0
      ! Number of processes with rows; 1 if one process read the whole problem.
      integer, private :: parts = 1
      logical, private :: away = .false.
   contains
      !> Gathers the whole matrices in the first process, unchecked.
      procedure :: assemble
      !> Sends the local rows to the first process, which calls `assemble` or `bring_back`.
      procedure :: give
      !> Fails if the processes that share it differ from those of the solve.
      procedure :: check
      !> Whether the processes of a solve share its rows.
      procedure :: is_distributed
      !> Frees the entries of the whole M, R, K and H in the first process, while other arrays need the memory; restores them.
      procedure :: put_away
      procedure :: bring_back
   end type shared_problem_type

contains

   subroutine assemble(self, processes, error)
      class(shared_problem_type), intent(inout) :: self
      type(processes_type), intent(in) :: processes
      type(error_type), allocatable, intent(out) :: error

      if (processes%number == 1) return
      call processes%send_request([request_problem])
      if (allocated(self%rows%loss)) allocate (self%problem%loss)
      call self%give(processes, error)
      if (allocated(error)) return
      self%problem%constraints = self%rows%constraints
      self%rows%constraints = empty_csr_matrix(0, self%rows%constraints%columns)
      call move_alloc(self%rows%mesh, self%problem%mesh)
   end subroutine assemble

   subroutine give(self, processes, error)
      class(shared_problem_type), intent(inout) :: self
      type(processes_type), intent(in) :: processes
      type(error_type), allocatable, intent(out) :: error

      call compare(self, processes, error)
      if (.not. allocated(error)) call give_matrix(self%problem%mass, self%rows%mass, self%all_rows(1), processes, error)
      if (.not. allocated(error)) call give_matrix(self%problem%damping, self%rows%damping, self%all_rows(2), processes, error)
      if (.not. allocated(error)) call give_matrix(self%problem%stiffness, self%rows%stiffness, self%all_rows(3), processes, error)
      if (.not. allocated(error) .and. allocated(self%rows%loss)) call give_loss(self, processes, error)
      if (.not. allocated(error)) self%parts = processes%number
   end subroutine give

   ! Checks that all processes read the same file.
   subroutine compare(self, processes, error)
      class(shared_problem_type), intent(in) :: self
      type(processes_type), intent(in) :: processes
      type(error_type), allocatable, intent(out) :: error
      integer :: here(8), first(8)

      here = [self%all_rows, self%rows%mass%columns, self%rows%damping%columns, self%rows%stiffness%columns, -1]
      if (allocated(self%rows%loss)) here(8) = self%rows%loss%columns
      first = here
      call MPI_Bcast(first, size(first), MPI_INTEGER, 0, processes%communicator)
      if (any(here /= first)) call new_error(error, error_input, "process "//text(processes%rank)// &
         " has read matrices of other extents than the first one: do all find the same file?")
      call spread_error(processes%communicator, error)
   end subroutine compare

   ! Gathers H, unless the first process has found that it is zero and has none.
   subroutine give_loss(self, processes, error)
      class(shared_problem_type), intent(inout) :: self
      type(processes_type), intent(in) :: processes
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type), allocatable :: loss
      logical :: has_loss

      has_loss = allocated(self%problem%loss)
      call move_alloc(self%problem%loss, loss)
      if (.not. has_loss) allocate (loss)
      call give_matrix(loss, self%rows%loss, self%all_rows(4), processes, error)
      if (has_loss) call move_alloc(loss, self%problem%loss)
   end subroutine give_loss

   ! Gathers a matrix in the first process.
   subroutine give_matrix(matrix, rows, all_rows, processes, error)
      !> In the first process, becomes the whole matrix.
      type(csr_matrix_type), intent(inout) :: matrix
      type(csr_matrix_type), intent(in) :: rows
      integer, intent(in) :: all_rows
      type(processes_type), intent(in) :: processes
      type(error_type), allocatable, intent(out) :: error

      call gather_matrix(matrix, row_ranges(all_rows, processes%number), processes%communicator, rows, error)
   end subroutine give_matrix

   subroutine check(self, processes, error)
      class(shared_problem_type), intent(in) :: self
      type(processes_type), intent(in) :: processes
      type(error_type), allocatable, intent(inout) :: error

      if (.not. allocated(error) .and. all(self%parts /= [1, processes%number])) call new_error(error, error_usage, &
         "a problem that "//text(self%parts)//" processes have read is to be solved by "//text(processes%number))
   end subroutine check

   ! Small problems are not.
   logical function is_distributed(self, processes)
      class(shared_problem_type), intent(in) :: self
      type(processes_type), pointer, intent(in) :: processes

      is_distributed = self%parts > 1 .and. are_several(processes, self%problem%unknowns())
   end function is_distributed

   subroutine put_away(self, processes)
      class(shared_problem_type), intent(inout) :: self
      type(processes_type), pointer, intent(in) :: processes

      if (self%away .or. .not. self%is_distributed(processes)) return
      call drop_entries(self%problem%mass)
      call drop_entries(self%problem%damping)
      call drop_entries(self%problem%stiffness)
      if (allocated(self%rows%loss) .and. allocated(self%problem%loss)) call drop_entries(self%problem%loss)
      self%away = .true.
   end subroutine put_away

   subroutine bring_back(self, processes, error)
      class(shared_problem_type), intent(inout) :: self
      type(processes_type), intent(in) :: processes
      type(error_type), allocatable, intent(inout) :: error
      type(error_type), allocatable :: failure

      if (.not. self%away) return
      call processes%send_request([request_problem])
      call self%give(processes, failure)
      self%away = allocated(failure)
      if (allocated(failure)) call move_alloc(failure, error)
   end subroutine bring_back
end module kschur_shared_problem
