!> Problems in HDF5 files: a group for each matrix in the CSR layout of SciPy and AnnData: /mass, /stiffness, optionally
!> /damping, /constraints and /loss; optionally a mesh.
module kschur_hdf5_problem
   use hdf5, only: hid_t
   use kschur_error, only: error_type, add_context
   use kschur_hdf5_basics, only: output_type, printing_type, silence_hdf5, restore_printing, forbid_external_links, &
      open_hdf5_file, create_hdf5_file, close_hdf5_file, finish_hdf5_file, exists
   use kschur_hdf5_matrix, only: bytes_of_matrix, read_matrix, whole, write_matrix
   use kschur_hdf5_mesh, only: bytes_of_mesh, read_mesh, write_mesh
   use kschur_kinds, only: long
   use kschur_problem, only: modal_problem_type, settle_modal_problem
   use kschur_sparse, only: empty_csr_matrix
   use kschur_trial, only: try_in_child
   implicit none
   private
   public :: read_hdf5_problem, read_hdf5_rows, write_hdf5_problem

contains

   !> Reads a problem. Integers may have any size; values are single or double reals, or integers. Fails with the file, the
   !> matrix and the reason.
   subroutine read_hdf5_problem(problem, path, error, trial, symmetric)
      type(modal_problem_type), intent(out) :: problem
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      !> Whether to read the file first in a child process, as a damaged file may crash or hang HDF5 (no). Not while other
      !> threads run.
      logical, intent(in), optional :: trial
      !> As that of `new_modal_problem`.
      integer, intent(in), optional :: symmetric
      integer :: all_rows(4)

      call read_hdf5_rows(problem, all_rows, path, whole, error, trial)
      if (allocated(error)) return
      call settle_modal_problem(problem, error, symmetric=symmetric)
      call add_context(error, path)
   end subroutine read_hdf5_problem

   !> Reads one of several equal ranges of rows of M, R, K and H; the first range also Cq and the mesh. Fails as
   !> `read_hdf5_problem`, for errors in its rows.
   subroutine read_hdf5_rows(rows, all_rows, path, part, error, trial)
      !> Unchecked matrices of these rows.
      type(modal_problem_type), intent(out) :: rows
      !> Total numbers of rows of M, R, K and H.
      integer, intent(out) :: all_rows(4)
      character(len=*), intent(in) :: path
      !> Number of the range, from 0, and number of ranges.
      integer, intent(in) :: part(2)
      type(error_type), allocatable, intent(out) :: error
      !> As that of `read_hdf5_problem`.
      logical, intent(in), optional :: trial
      type(printing_type) :: printing

      call silence_hdf5(printing, error)
      call try_in_child(read_and_discard, path, "problem", error, trial, part)
      call read_matrices(rows, all_rows, path, part, error)
      call restore_printing(printing)
      call add_context(error, path)
   end subroutine read_hdf5_rows

   ! Trial for `try_in_child`: reads a range of rows.
   subroutine read_and_discard(path, part, error)
      character(len=*), intent(in) :: path
      integer, intent(in) :: part(2)
      type(error_type), allocatable, intent(inout) :: error
      type(modal_problem_type) :: problem
      integer :: all_rows(4)

      call forbid_external_links()
      call read_matrices(problem, all_rows, path, part, error)
   end subroutine read_and_discard

   subroutine read_matrices(problem, all_rows, path, part, error)
      type(modal_problem_type), intent(inout) :: problem
      integer, intent(out) :: all_rows(4)
      character(len=*), intent(in) :: path
      integer, intent(in) :: part(2)
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: file
      integer :: constraints

      all_rows = 0
      call open_hdf5_file(file, path, error)
      call read_matrix(problem%mass, all_rows(1), file, "/mass", "mass matrix M", part, error)
      call read_matrix(problem%stiffness, all_rows(3), file, "/stiffness", "stiffness matrix K", part, error)
      if (.not. allocated(error)) then
         all_rows(2) = all_rows(1)
         problem%damping = empty_csr_matrix(problem%mass%rows, all_rows(1))
         problem%constraints = empty_csr_matrix(0, all_rows(1))
         if (exists(file, "/damping", error)) &
            call read_matrix(problem%damping, all_rows(2), file, "/damping", "damping matrix R", part, error)
         if (exists(file, "/loss", error)) then
            allocate (problem%loss)
            call read_matrix(problem%loss, all_rows(4), file, "/loss", "loss matrix H", part, error)
         end if
      end if
      if (part(1) == 0) then
         if (exists(file, "/constraints", error)) call read_matrix(problem%constraints, constraints, file, "/constraints", &
            "constraint Jacobian Cq", whole, error)
         call read_mesh(problem%mesh, file, all_rows(1), error)
      end if
      call close_hdf5_file(file)
   end subroutine read_matrices

   !> Writes a problem; /damping, /constraints and /loss only if they have entries.
   !> The file appears under its name when it is complete.
   subroutine write_hdf5_problem(problem, path, error)
      type(modal_problem_type), intent(in) :: problem
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      type(output_type) :: output

      call create_hdf5_file(output, path, bytes_of(problem), error)
      call write_matrix(output%file, "/mass", problem%mass, error)
      call write_matrix(output%file, "/stiffness", problem%stiffness, error)
      if (problem%damping%nonzeros() > 0) call write_matrix(output%file, "/damping", problem%damping, error)
      if (problem%multipliers() > 0) call write_matrix(output%file, "/constraints", problem%constraints, error)
      if (allocated(problem%loss)) call write_matrix(output%file, "/loss", problem%loss, error)
      call write_mesh(output%file, problem%mesh, error)
      call finish_hdf5_file(output, error)
   end subroutine write_hdf5_problem

   ! Size of a problem in a file, in bytes.
   pure integer(long) function bytes_of(problem)
      type(modal_problem_type), intent(in) :: problem

      bytes_of = bytes_of_matrix(problem%mass) + bytes_of_matrix(problem%stiffness) + bytes_of_matrix(problem%damping) &
         + bytes_of_matrix(problem%constraints) + bytes_of_mesh(problem%mesh)
      if (allocated(problem%loss)) bytes_of = bytes_of + bytes_of_matrix(problem%loss)
   end function bytes_of
end module kschur_hdf5_problem
