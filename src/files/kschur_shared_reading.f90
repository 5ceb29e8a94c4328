!> Collective reading of a problem in an HDF5 file, each process its rows.
module kschur_shared_reading
   use kschur_error, only: add_context, error_type
   use kschur_hdf5_problem, only: read_hdf5_rows
   use kschur_worker_loop, only: worker_loop
   use kschur_problem, only: settle_modal_problem
   use kschur_processes, only: join_processes, processes_type
   use kschur_shared_problem, only: shared_problem_type
   use kschur_symmetric_storage, only: symmetric_lower, symmetric_upper
   use kschur_text, only: text
   implicit none
   private
   public :: read_hdf5_shared_problem

contains

   !> Reads a problem as `read_hdf5_problem`, collectively over a communicator: each process opens the file. All get the same
   !> error. Halves of symmetric matrices are read by the first process alone.
   subroutine read_hdf5_shared_problem(shared, path, error, communicator, trial, symmetric)
      type(shared_problem_type), intent(out) :: shared
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      !> MPI handle; absent: this process alone.
      integer, intent(in), optional :: communicator
      !> As that of `read_hdf5_problem`: each process reads its rows in a child first.
      logical, intent(in), optional :: trial
      !> As that of `new_modal_problem`, the same in all.
      integer, intent(in), optional :: symmetric
      type(processes_type), target :: processes
      integer, allocatable :: handle
      logical :: together

      if (present(communicator)) allocate (handle, source=communicator)
      call join_processes(handle, 1, processes, error)
      if (allocated(error)) return
      together = processes%number > 1
      ! The missing half of local rows belongs to other processes.
      if (present(symmetric)) together = together .and. all(symmetric /= [symmetric_lower, symmetric_upper])
      if (.not. together) then
         if (processes%rank == 0) call read_hdf5_rows(shared%problem, shared%all_rows, path, [0, 1], error, trial)
      else
         call read_hdf5_rows(shared%rows, shared%all_rows, path, [processes%rank, processes%number], error, trial)
         if (processes%rank > 0) call add_context(error, "process "//text(processes%rank))
      end if
      call processes%agree(error)
      if (.not. allocated(error)) then
         if (processes%rank > 0) then
            call worker_loop(processes, shared)
         else
            if (together) call shared%assemble(processes, error)
            if (.not. allocated(error)) call settle_modal_problem(shared%problem, error, symmetric=symmetric)
            call add_context(error, path)
         end if
      end if
      call processes%leave(error)
   end subroutine read_hdf5_shared_problem
end module kschur_shared_reading
