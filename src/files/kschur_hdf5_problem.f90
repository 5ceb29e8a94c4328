!> Problems in HDF5 files: a group for each matrix in the CSR layout of SciPy and AnnData: /mass, /stiffness, optionally
!> /damping, /constraints and /loss; optionally a mesh.
module kschur_hdf5_problem
   use hdf5, only: hid_t
   use kschur_error, only: error_type, new_error, add_context, error_input
   use kschur_hdf5_attributes, only: has_attribute, read_attribute, write_attribute
   use kschur_hdf5_basics, only: output_type, printing_type, silence_hdf5, restore_printing, forbid_external_links, &
      open_hdf5_file, create_hdf5_file, close_hdf5_file, finish_hdf5_file, create_group, exists
   use kschur_hdf5_datasets, only: read_dataset, write_dataset
   use kschur_hdf5_mesh, only: bytes_of_mesh, read_mesh, write_mesh
   use kschur_kinds, only: wp, long
   use kschur_problem, only: modal_problem_type, settle_modal_problem
   use kschur_row_ranges, only: row_ranges, row_ranges_type
   use kschur_sparse, only: csr_matrix_type, empty_csr_matrix, settle_csr_matrix
   use kschur_text, only: text
   use kschur_trial, only: try_in_child
   implicit none
   private
   public :: read_hdf5_problem, read_hdf5_rows, write_hdf5_problem

   character(len=*), parameter :: encoding = "csr_matrix"
   integer, parameter :: whole(2) = [0, 1]

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
      integer :: all_rows(3)

      call read_hdf5_rows(problem, all_rows, path, whole, error, trial)
      if (allocated(error)) return
      call settle_modal_problem(problem, error, symmetric=symmetric)
      call add_context(error, path)
   end subroutine read_hdf5_problem

   !> Reads one of several equal ranges of rows of M, R and K; the first range also Cq and the mesh. Fails as
   !> `read_hdf5_problem`, for errors in its rows.
   subroutine read_hdf5_rows(rows, all_rows, path, part, error, trial)
      !> Unchecked matrices of these rows.
      type(modal_problem_type), intent(out) :: rows
      !> Total numbers of rows of M, R and K.
      integer, intent(out) :: all_rows(3)
      character(len=*), intent(in) :: path
      !> Number of the range, from 0, and number of ranges.
      integer, intent(in) :: part(2)
      type(error_type), allocatable, intent(out) :: error
      !> As that of `read_hdf5_problem`.
      logical, intent(in), optional :: trial
      type(printing_type) :: printing

      call silence_hdf5(printing, error)
      if (present(trial)) then
         if (trial) call try_in_child(read_and_discard, path, "problem", error, part)
      end if
      call read_matrices(rows, all_rows, path, part, error)
      call restore_printing(printing)
      call add_context(error, path)
   end subroutine read_hdf5_rows

   subroutine read_and_discard(path, part, error)
      character(len=*), intent(in) :: path
      integer, intent(in) :: part(2)
      type(error_type), allocatable, intent(inout) :: error
      type(modal_problem_type) :: problem
      integer :: all_rows(3)

      call forbid_external_links()
      call read_matrices(problem, all_rows, path, part, error)
   end subroutine read_and_discard

   subroutine read_matrices(problem, all_rows, path, part, error)
      type(modal_problem_type), intent(inout) :: problem
      integer, intent(out) :: all_rows(3)
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
         if (exists(file, "/loss", error)) call read_loss(problem, file, part, error)
      end if
      if (part(1) == 0) then
         if (exists(file, "/constraints", error)) call read_matrix(problem%constraints, constraints, file, "/constraints", &
            "constraint Jacobian Cq", whole, error)
         call read_mesh(problem%mesh, file, all_rows(1), error)
      end if
      call close_hdf5_file(file)
   end subroutine read_matrices

   subroutine read_loss(problem, file, part, error)
      type(modal_problem_type), intent(inout) :: problem
      integer(hid_t), intent(in) :: file
      integer, intent(in) :: part(2)
      type(error_type), allocatable, intent(inout) :: error
      integer :: rows

      if (allocated(error)) return
      if (part(2) > 1) then
         call new_error(error, error_input, "several processes and a loss matrix H do not go together yet: read it with one")
         return
      end if
      allocate (problem%loss)
      call read_matrix(problem%loss, rows, file, "/loss", "loss matrix H", part, error)
   end subroutine read_loss

   subroutine read_matrix(matrix, all_rows, file, group, name, part, error)
      type(csr_matrix_type), intent(out) :: matrix
      integer, intent(out) :: all_rows
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: group, name
      integer, intent(in) :: part(2)
      type(error_type), allocatable, intent(inout) :: error
      character(len=:), allocatable :: found
      integer :: extents(2)

      all_rows = 0
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
      if (.not. allocated(error)) then
         all_rows = extents(1)
         matrix%columns = extents(2)
         call read_part_of_matrix(matrix, file, group, all_rows, part, error)
      end if
      call add_context(error, "the "//name)
   end subroutine read_matrix

   subroutine read_part_of_matrix(matrix, file, group, all_rows, part, error)
      !> Its number of columns is set.
      type(csr_matrix_type), intent(inout) :: matrix
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: group
      integer, intent(in) :: all_rows, part(2)
      type(error_type), allocatable, intent(inout) :: error
      integer, parameter :: highest = huge(1) - 1
      type(row_ranges_type) :: ranges
      integer, allocatable :: all(:)
      integer :: before, entries

      ranges = row_ranges(all_rows, part(2))
      matrix%rows = ranges%rows(part(1))
      call read_dataset(all, file, group//"/indptr", 0, highest, error, all_rows + 1, all_rows, 1)
      call read_dataset(matrix%row_start, file, group//"/indptr", 0, highest, error, all_rows + 1, ranges%before(part(1)), &
         matrix%rows + 1)
      if (allocated(error)) return
      before = 0
      if (part(1) > 0) before = matrix%row_start(1)
      ! Errors in row starts are reported later.
      entries = max(0, min(matrix%row_start(matrix%rows + 1), all(1)) - before)
      call read_dataset(matrix%column, file, group//"/indices", 0, matrix%columns - 1, error, all(1), before, entries)
      call read_dataset(matrix%value, file, group//"/data", error, all(1), before, entries)
      if (allocated(error)) return
      matrix%row_start = matrix%row_start - before + 1
      matrix%column = matrix%column + 1
      call settle_csr_matrix(matrix, error)
      if (part(2) > 1) call add_context(error, "rows "//text(ranges%first(part(1)))//" to "//text(ranges%last(part(1))))
   end subroutine read_part_of_matrix

   !> Writes a problem; /damping, /constraints and /loss only if they have entries. The file appears under its name when it is
   !> complete.
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

   pure integer(long) function bytes_of(problem)
      type(modal_problem_type), intent(in) :: problem

      bytes_of = bytes_of_matrix(problem%mass) + bytes_of_matrix(problem%stiffness) + bytes_of_matrix(problem%damping) &
         + bytes_of_matrix(problem%constraints) + bytes_of_mesh(problem%mesh)
      if (allocated(problem%loss)) bytes_of = bytes_of + bytes_of_matrix(problem%loss)
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
