!> Problems in HDF5 files: a group for each matrix in the CSR layout of SciPy
!> and AnnData, /mass, /stiffness and, where given, /damping and /constraints.
module kschur_hdf5_problem
   use hdf5, only: hid_t
   use kschur_error, only: error_type, new_error, add_context, error_input
   use kschur_files, only: temporary_name
   use kschur_hdf5_attributes, only: has_attribute, read_attribute, write_attribute
   use kschur_hdf5_basics, only: printing_type, silence_hdf5, restore_printing, open_hdf5_file, create_hdf5_file, &
      close_hdf5_file, finish_hdf5_file, create_group, exists
   use kschur_hdf5_datasets, only: read_dataset, write_dataset
   use kschur_kinds, only: wp
   use kschur_problem, only: modal_problem_type, settle_modal_problem
   use kschur_sparse, only: csr_matrix_type, empty_csr_matrix, settle_csr_matrix
   use kschur_text, only: text
   implicit none
   private
   public :: read_hdf5_problem, write_hdf5_problem

   character(len=*), parameter :: encoding = "csr_matrix"

contains

   !> Reads a problem. Integers may have any length in the file, values any real
   !> or integer type. Fails with the file, the matrix and what is wrong.
   subroutine read_hdf5_problem(problem, path, error)
      type(modal_problem_type), intent(out) :: problem
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      type(printing_type) :: printing
      integer(hid_t) :: file

      call silence_hdf5(printing, error)
      call open_hdf5_file(file, path, error)
      call read_matrix(problem%mass, file, "/mass", "mass matrix M", error)
      call read_matrix(problem%stiffness, file, "/stiffness", "stiffness matrix K", error)
      if (.not. allocated(error)) then
         associate (n => problem%mass%rows)
            problem%damping = empty_csr_matrix(n, n)
            problem%constraints = empty_csr_matrix(0, n)
         end associate
         if (exists(file, "/damping")) call read_matrix(problem%damping, file, "/damping", "damping matrix R", error)
         if (exists(file, "/constraints")) &
            call read_matrix(problem%constraints, file, "/constraints", "constraint Jacobian Cq", error)
      end if
      call close_hdf5_file(file)
      call restore_printing(printing)
      if (.not. allocated(error)) call settle_modal_problem(problem, error)
      call add_context(error, path)
   end subroutine read_hdf5_problem

   subroutine read_matrix(matrix, file, group, name, error)
      type(csr_matrix_type), intent(out) :: matrix
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: group, name
      type(error_type), allocatable, intent(inout) :: error
      character(len=:), allocatable :: found
      integer :: extents(2)

      if (allocated(error)) return
      if (.not. exists(file, group)) then
         call new_error(error, error_input, "there is no group "//group//", which must hold the "//name)
         return
      end if
      if (has_attribute(file, group, "encoding-type")) then
         call read_attribute(found, file, group, "encoding-type", error)
         if (found /= encoding .and. .not. allocated(error)) call new_error(error, error_input, &
            group//" is encoded as """//found//""" but must be """//encoding//"""")
      end if
      call read_attribute(extents, file, group, "shape", error)
      if (.not. allocated(error) .and. (minval(extents) < 0 .or. maxval(extents) == huge(1))) call new_error(error, &
         error_input, "attribute shape of "//group//" cannot be "//text(extents(1))//" x "//text(extents(2)))
      call read_dataset(matrix%row_start, file, group//"/indptr", 0, huge(1) - 1, error)
      call read_dataset(matrix%column, file, group//"/indices", 0, extents(2) - 1, error)
      call read_dataset(matrix%value, file, group//"/data", error)
      if (.not. allocated(error)) then
         if (size(matrix%column) /= size(matrix%value)) call new_error(error, error_input, &
            group//" has "//text(size(matrix%column))//" indices but "//text(size(matrix%value))//" data")
      end if
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
      character(len=:), allocatable :: temporary
      type(printing_type) :: printing
      integer(hid_t) :: file

      temporary = temporary_name(path)
      call silence_hdf5(printing, error)
      call create_hdf5_file(file, temporary, error)
      call write_matrix(file, "/mass", problem%mass, error)
      call write_matrix(file, "/stiffness", problem%stiffness, error)
      if (problem%damping%nonzeros() > 0) call write_matrix(file, "/damping", problem%damping, error)
      if (problem%multipliers() > 0) call write_matrix(file, "/constraints", problem%constraints, error)
      call finish_hdf5_file(file, temporary, path, error)
      call restore_printing(printing)
   end subroutine write_hdf5_problem

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
