!> Sparse matrices in HDF5 files: groups in the CSR layout of SciPy and AnnData.
module kschur_hdf5_matrix
   use hdf5, only: hid_t
   use kschur_error, only: error_type, new_error, add_context, error_input
   use kschur_hdf5_attributes, only: has_attribute, read_attribute, write_attribute
   use kschur_hdf5_basics, only: create_group, exists
   use kschur_hdf5_datasets, only: read_dataset, write_dataset
   use kschur_kinds, only: wp, long
   use kschur_row_ranges, only: row_ranges, row_ranges_type
   use kschur_sparse, only: csr_matrix_type, settle_csr_matrix
   use kschur_text, only: text
   implicit none
   private
   public :: bytes_of_matrix, read_matrix, write_matrix

   character(len=*), parameter :: encoding = "csr_matrix"
   !> The argument `part` of `read_matrix` for a whole matrix.
   integer, parameter, public :: whole(2) = [0, 1]

contains

   !> Reads a range of the rows of a matrix. Fails if the group is missing or is not a matrix in this layout.
   subroutine read_matrix(matrix, all_rows, file, group, name, part, error)
      type(csr_matrix_type), intent(out) :: matrix
      !> Number of rows of the whole matrix.
      integer, intent(out) :: all_rows
      integer(hid_t), intent(in) :: file
      !> The group, and the name of the matrix in messages.
      character(len=*), intent(in) :: group, name
      !> Number of the range, from 0, and number of equal ranges.
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

   ! Reads the entries of a range of rows.
   subroutine read_part_of_matrix(matrix, file, group, all_rows, part, error)
      !> Its columns are known.
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
      ! Wrong row starts are reported below.
      entries = max(0, min(matrix%row_start(matrix%rows + 1), all(1)) - before)
      call read_dataset(matrix%column, file, group//"/indices", 0, matrix%columns - 1, error, all(1), before, entries)
      call read_dataset(matrix%value, file, group//"/data", error, all(1), before, entries)
      if (allocated(error)) return
      matrix%row_start = matrix%row_start - before + 1
      matrix%column = matrix%column + 1
      call settle_csr_matrix(matrix, error)
      if (part(2) > 1) call add_context(error, "rows "//text(ranges%first(part(1)))//" to "//text(ranges%last(part(1))))
   end subroutine read_part_of_matrix

   !> Size of a matrix in a file, in bytes.
   pure integer(long) function bytes_of_matrix(matrix)
      type(csr_matrix_type), intent(in) :: matrix
      integer(long), parameter :: bytes_of_an_integer = storage_size(1)/8, bytes_of_a_real = storage_size(1.0_wp)/8

      bytes_of_matrix = bytes_of_an_integer*matrix%rows + (bytes_of_an_integer + bytes_of_a_real)*matrix%nonzeros()
   end function bytes_of_matrix

   !> Writes a matrix as a new group.
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
end module kschur_hdf5_matrix
