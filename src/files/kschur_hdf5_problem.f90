!> Problems in HDF5 files: a group for each matrix in the CSR layout of SciPy
!> and AnnData, /mass, /stiffness and, where given, /damping and /constraints; and where given a mesh.
module kschur_hdf5_problem
   use hdf5, only: hid_t
   use kschur_error, only: error_type, new_error, add_context, error_input
   use kschur_files, only: staging_type
   use kschur_hdf5_attributes, only: has_attribute, read_attribute, write_attribute
   use kschur_hdf5_basics, only: printing_type, silence_hdf5, restore_printing, forbid_external_links, &
      open_hdf5_file, create_hdf5_file, close_hdf5_file, finish_hdf5_file, create_group, exists
   use kschur_hdf5_datasets, only: read_dataset, write_dataset
   use kschur_hdf5_mesh, only: bytes_of_mesh, read_mesh, write_mesh
   use kschur_kinds, only: wp, long
   use kschur_problem, only: modal_problem_type, settle_modal_problem
   use kschur_sparse, only: csr_matrix_type, empty_csr_matrix, settle_csr_matrix
   use kschur_text, only: text
   use kschur_trial, only: try_in_child
   implicit none
   private
   public :: read_hdf5_problem, write_hdf5_problem

   character(len=*), parameter :: encoding = "csr_matrix"

contains

   !> Reads a problem. Integers may have any length in the file; values are reals of
   !> single or double precision, or integers. Fails with the file, the matrix and what is wrong.
   subroutine read_hdf5_problem(problem, path, error, trial)
      type(modal_problem_type), intent(out) :: problem
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      !> Whether to read the file first in a child process, which a damaged file may make crash or hang (no). Not where
      !> other threads are at work.
      logical, intent(in), optional :: trial
      type(printing_type) :: printing

      call silence_hdf5(printing, error)
      if (present(trial)) then
         if (trial) call try_in_child(forget_matrices, path, "problem", error)
      end if
      call read_matrices(problem, path, error)
      call restore_printing(printing)
      if (.not. allocated(error)) call settle_modal_problem(problem, error)
      call add_context(error, path)
   end subroutine read_hdf5_problem

   subroutine forget_matrices(path, error)
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(inout) :: error
      type(modal_problem_type) :: problem

      call forbid_external_links()
      call read_matrices(problem, path, error)
   end subroutine forget_matrices

   subroutine read_matrices(problem, path, error)
      type(modal_problem_type), intent(inout) :: problem
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: file

      call open_hdf5_file(file, path, error)
      call read_matrix(problem%mass, file, "/mass", "mass matrix M", error)
      call read_matrix(problem%stiffness, file, "/stiffness", "stiffness matrix K", error)
      if (.not. allocated(error)) then
         associate (n => problem%mass%rows)
            problem%damping = empty_csr_matrix(n, n)
            problem%constraints = empty_csr_matrix(0, n)
         end associate
         if (exists(file, "/damping", error)) call read_matrix(problem%damping, file, "/damping", "damping matrix R", error)
         if (exists(file, "/constraints", error)) &
            call read_matrix(problem%constraints, file, "/constraints", "constraint Jacobian Cq", error)
      end if
      call read_mesh(problem%mesh, file, problem%mass%rows, error)
      call close_hdf5_file(file)
   end subroutine read_matrices

   subroutine read_matrix(matrix, file, group, name, error)
      type(csr_matrix_type), intent(out) :: matrix
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: group, name
      type(error_type), allocatable, intent(inout) :: error
      character(len=:), allocatable :: found
      integer :: extents(2), entries

      if (allocated(error)) return
      if (.not. exists(file, group, error)) then
         if (.not. allocated(error)) &
            call new_error(error, error_input, "there is no group "//group//", which must hold the "//name)
         return
      end if
      if (has_attribute(file, group, "encoding-type", error)) then
         call read_attribute(found, file, group, "encoding-type", error)
         if (found /= encoding .and. .not. allocated(error)) call new_error(error, error_input, &
            group//" is encoded as """//found//""" but must be """//encoding//"""")
      end if
      call read_attribute(extents, file, group, "shape", error)
      if (.not. allocated(error) .and. (minval(extents) < 0 .or. maxval(extents) == huge(1))) call new_error(error, &
         error_input, "attribute shape of "//group//" cannot be "//text(extents(1))//" x "//text(extents(2)))
      call read_dataset(matrix%row_start, file, group//"/indptr", 0, huge(1) - 1, error, extents(1) + 1)
      entries = 0
      if (.not. allocated(error)) entries = matrix%row_start(extents(1) + 1)
      call read_dataset(matrix%column, file, group//"/indices", 0, extents(2) - 1, error, entries)
      call read_dataset(matrix%value, file, group//"/data", error, entries)
      if (.not. allocated(error)) then
         matrix%rows = extents(1)
         matrix%columns = extents(2)
         matrix%row_start = matrix%row_start + 1
         matrix%column = matrix%column + 1
         call settle_csr_matrix(matrix, error)
      end if
      call add_context(error, "the "//name)
   end subroutine read_matrix

   !> Writes a problem; /damping and /constraints only where there are entries.
   !> The file appears under its name when it is whole.
   subroutine write_hdf5_problem(problem, path, error)
      type(modal_problem_type), intent(in) :: problem
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      type(staging_type) :: staging
      type(printing_type) :: printing
      integer(hid_t) :: file

      call silence_hdf5(printing, error)
      call create_hdf5_file(file, staging, path, bytes_of(problem), error)
      call write_matrix(file, "/mass", problem%mass, error)
      call write_matrix(file, "/stiffness", problem%stiffness, error)
      if (problem%damping%nonzeros() > 0) call write_matrix(file, "/damping", problem%damping, error)
      if (problem%multipliers() > 0) call write_matrix(file, "/constraints", problem%constraints, error)
      call write_mesh(file, problem%mesh, error)
      call finish_hdf5_file(file, staging, path, error)
      call restore_printing(printing)
   end subroutine write_hdf5_problem

   pure integer(long) function bytes_of(problem)
      type(modal_problem_type), intent(in) :: problem

      bytes_of = bytes_of_matrix(problem%mass) + bytes_of_matrix(problem%stiffness) + bytes_of_matrix(problem%damping) &
         + bytes_of_matrix(problem%constraints) + bytes_of_mesh(problem%mesh)
   end function bytes_of

   pure integer(long) function bytes_of_matrix(matrix)
      type(csr_matrix_type), intent(in) :: matrix
      integer(long), parameter :: bytes_of_an_integer = storage_size(1)/8, bytes_of_a_real = storage_size(1.0_wp)/8

      bytes_of_matrix = bytes_of_an_integer*matrix%rows + (bytes_of_an_integer + bytes_of_a_real)*matrix%nonzeros()
   end function bytes_of_matrix

   subroutine write_matrix(file, group, matrix, error)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: group
      type(csr_matrix_type), intent(in) :: matrix
      type(error_type), allocatable, intent(inout) :: error

      call create_group(file, group, error)
      call write_attribute(file, group, "encoding-type", encoding, error)
      call write_attribute(file, group, "encoding-version", "0.1.0", error)
      call write_attribute(file, group, "shape", [matrix%rows, matrix%columns], error)
      call write_dataset(file, group//"/indptr", matrix%row_start - 1, error)
      call write_dataset(file, group//"/indices", matrix%column - 1, error)
      call write_dataset(file, group//"/data", matrix%value, error)
   end subroutine write_matrix
end module kschur_hdf5_problem
