!> Matrices in Matrix Market files: R. F. Boisvert, R. Pozo and
!> K. A. Remington, The Matrix Market exchange formats, NISTIR 5935 (1996).
module kschur_matrix_market
   use kschur_error, only: error_type, new_error, add_context, error_file, error_input
   use kschur_files, only: staging_type, check_length
   use kschur_kinds, only: wp, long
   use kschur_line_reader, only: line_reader_type, lower_case
   use kschur_sparse, only: csr_matrix_type, new_csr_from_triplets
   use kschur_text, only: text
   use kschur_triplets, only: triplets_type
   implicit none
   private
   public :: read_matrix_market, write_matrix_market, write_staged_matrix_market

   character(len=*), parameter :: comment = "%"
   character(len=*), parameter :: banner = "%%MatrixMarket"
   integer, parameter :: general = 0, symmetric = 1, skew_symmetric = 2

   ! Contents of the banner and the size line.
   type :: header_type
      logical :: is_array = .false.
      integer :: symmetry = general
      integer :: rows = 0, columns = 0
      integer(long) :: entries = 0
   end type header_type

contains

   !> Reads a matrix: coordinate or array; real or integer; general, symmetric, hermitian or skew-symmetric. Sums duplicate
   !> entries. If the banner says symmetric or skew-symmetric, mirrors every entry, also above the diagonal. Fails with the
   !> file, the line and the reason.
   subroutine read_matrix_market(matrix, path, error, most)
      type(csr_matrix_type), intent(out) :: matrix
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      !> Size of all files of the problem: an upper bound of rows and columns.
      integer(long), intent(in), optional :: most
      integer(long) :: limit
      type(line_reader_type) :: reader
      type(header_type) :: header
      type(triplets_type) :: triplets

      limit = huge(1_long)
      if (present(most)) limit = most
      call reader%open(path, error)
      if (allocated(error)) return
      call read_header(header, reader, error)
      if (max(header%rows, header%columns) > limit .and. .not. allocated(error)) call line_error(error, reader, "a matrix of "// &
         text(header%rows)//" x "//text(header%columns)//", but the files of the problem have only "//text(limit)//" bytes")
      if (.not. allocated(error)) call read_entries(triplets, header, reader, error)
      call reader%close()
      if (reader%failed) call new_error(error, error_file, "the file cannot be read to its end")
      if (.not. allocated(error)) call new_csr_from_triplets(matrix, header%rows, header%columns, &
         triplets%row(:triplets%count), triplets%column(:triplets%count), triplets%value(:triplets%count), error)
      call add_context(error, path)
   end subroutine read_matrix_market

   ! Raises an error that names the current line of the reader.
   subroutine line_error(error, reader, what)
      type(error_type), allocatable, intent(inout) :: error
      type(line_reader_type), intent(in) :: reader
      character(len=*), intent(in) :: what

      if (.not. allocated(error)) call new_error(error, error_input, "line "//text(reader%line)//": "//what)
   end subroutine line_error

   subroutine read_header(header, reader, error)
      type(header_type), intent(out) :: header
      type(line_reader_type), intent(inout) :: reader
      type(error_type), allocatable, intent(out) :: error
      integer(long) :: rows, columns
      logical :: found, valid

      call read_banner(header, reader, error)
      if (allocated(error)) return

      call reader%next_line(comment, found)
      if (.not. found) then
         call new_error(error, error_input, "the file ends before the size line")
         return
      end if
      valid = .true.
      call reader%next_integer(rows, valid)
      call reader%next_integer(columns, valid)
      if (.not. header%is_array) call reader%next_integer(header%entries, valid)
      if (.not. valid .or. min(rows, columns, header%entries) < 0 .or. .not. reader%at_end()) then
         if (header%is_array) then
            call line_error(error, reader, "the size line must be two numbers, rows and columns")
         else
            call line_error(error, reader, "the size line must be three numbers, rows, columns and entries")
         end if
      else if (max(rows, columns) >= huge(1)) then
         call line_error(error, reader, "the matrix has too many rows or columns")
      else if (header%symmetry /= general .and. rows /= columns) then
         call line_error(error, reader, "a symmetric or skew-symmetric matrix must be square")
      end if
      if (allocated(error)) return
      header%rows = int(rows)
      header%columns = int(columns)
      if (header%is_array) header%entries = entries_of_array(header%symmetry, rows, columns)
      ! Each entry takes at least one byte.
      if (header%entries > reader%bytes) call line_error(error, reader, text(header%entries)// &
         " entries are announced, more than a file of "//text(reader%bytes)//" bytes can hold")
   end subroutine read_header

   ! Number of entries that the array format stores.
   pure integer(long) function entries_of_array(symmetry, rows, columns) result(entries)
      integer, intent(in) :: symmetry
      integer(long), intent(in) :: rows, columns

      entries = rows*columns
      if (symmetry == symmetric) entries = rows*(rows + 1)/2
      if (symmetry == skew_symmetric) entries = rows*(rows - 1)/2
   end function entries_of_array

   subroutine read_banner(header, reader, error)
      type(header_type), intent(out) :: header
      type(line_reader_type), intent(inout) :: reader
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: word
      logical :: found

      ! Reads the banner, which looks like a comment: no line begins with a blank.
      call reader%next_line(" ", found)
      if (.not. found) then
         call new_error(error, error_input, "the file is empty")
         return
      end if
      call reader%next_word(word)
      word = lower_case(word)
      if (word /= lower_case(banner)) then
         call line_error(error, reader, "the file does not begin with "//banner)
         return
      end if

      call reader%next_word(word)
      word = lower_case(word)
      if (word /= "matrix") call line_error(error, reader, 'the banner says "'//word//'" where "matrix" must stand')

      call reader%next_word(word)
      word = lower_case(word)
      header%is_array = word == "array"
      if (word /= "array" .and. word /= "coordinate") &
         call line_error(error, reader, 'the format is "'//word//'" but must be coordinate or array')

      call reader%next_word(word)
      word = lower_case(word)
      if (word /= "real" .and. word /= "integer" .and. word /= "double") &
         call line_error(error, reader, 'the entries are "'//word//'" but must be real or integer')

      call reader%next_word(word)
      word = lower_case(word)
      select case (word)
      case ("general")
         header%symmetry = general
      case ("symmetric", "hermitian")
         header%symmetry = symmetric
      case ("skew-symmetric")
         header%symmetry = skew_symmetric
      case default
         call line_error(error, reader, 'the symmetry is "'//word// &
            '" but must be general, symmetric, skew-symmetric or hermitian')
      end select
   end subroutine read_banner

   ! Reads all entries, and mirrors those of a symmetric or skew-symmetric matrix.
   subroutine read_entries(triplets, header, reader, error)
      type(triplets_type), intent(out) :: triplets
      type(header_type), intent(in) :: header
      type(line_reader_type), intent(inout) :: reader
      type(error_type), allocatable, intent(out) :: error
      integer :: row, column
      integer(long) :: k
      real(wp) :: value
      logical :: found

      call triplets%reserve(1024, error)
      row = 0
      column = 0
      do k = 1, header%entries
         call reader%next_line(comment, found)
         if (.not. found) then
            call new_error(error, error_input, "the file ends after "//text(k - 1)//" of "// &
               text(header%entries)//" entries")
            return
         end if
         if (header%is_array) then
            call next_place(header, row, column)
            call read_array_entry(value, reader, error)
         else
            call read_coordinate_entry(row, column, value, header, reader, error)
         end if
         if (allocated(error)) return
         if (header%symmetry == skew_symmetric .and. row == column .and. abs(value) > 0) then
            call line_error(error, reader, "a skew-symmetric matrix cannot have the diagonal entry ("// &
               text(row)//", "//text(column)//")")
            return
         end if
         if (header%is_array .and. abs(value) <= 0) cycle
         call triplets%append(row, column, value, error)
         if (allocated(error)) return
         if (header%symmetry == general .or. row == column) cycle
         if (header%symmetry == skew_symmetric) value = -value
         call triplets%append(column, row, value, error)
         if (allocated(error)) return
      end do
      call reader%next_line(comment, found)
      if (found) call line_error(error, reader, &
         "there are more than the "//text(header%entries)//" entries announced")
   end subroutine read_entries

   subroutine read_array_entry(value, reader, error)
      real(wp), intent(out) :: value
      type(line_reader_type), intent(inout) :: reader
      type(error_type), allocatable, intent(out) :: error
      logical :: valid

      valid = .true.
      call reader%next_real(value, valid)
      if (.not. valid .or. .not. reader%at_end()) call line_error(error, reader, "one number must stand here")
   end subroutine read_array_entry

   subroutine read_coordinate_entry(row, column, value, header, reader, error)
      integer, intent(out) :: row, column
      real(wp), intent(out) :: value
      type(header_type), intent(in) :: header
      type(line_reader_type), intent(inout) :: reader
      type(error_type), allocatable, intent(out) :: error
      integer(long) :: i, j
      logical :: valid

      row = 0
      column = 0
      valid = .true.
      call reader%next_integer(i, valid)
      call reader%next_integer(j, valid)
      call reader%next_real(value, valid)
      if (.not. valid .or. .not. reader%at_end()) then
         call line_error(error, reader, "an entry must be three numbers, row, column and value")
      else if (i < 1 .or. i > header%rows .or. j < 1 .or. j > header%columns) then
         call line_error(error, reader, "entry ("//text(i)//", "//text(j)// &
            ") lies outside a matrix of "//text(header%rows)//" x "//text(header%columns))
      else
         row = int(i)
         column = int(j)
      end if
   end subroutine read_coordinate_entry

   ! Advances to the position of the next entry of the array format: by columns, from the diagonal on if symmetric, below it if
   ! skew-symmetric.
   pure subroutine next_place(header, row, column)
      type(header_type), intent(in) :: header
      integer, intent(inout) :: row, column

      row = row + 1
      if (column > 0 .and. row <= header%rows) return
      column = column + 1
      row = 1
      if (header%symmetry == symmetric) row = column
      if (header%symmetry == skew_symmetric) row = column + 1
   end subroutine next_place

   !> Writes a matrix as coordinate, real, general, with 17 digits, which reproduce every value. The file appears under its name
   !> when it is complete.
   subroutine write_matrix_market(matrix, path, error)
      type(csr_matrix_type), intent(in) :: matrix
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      type(staging_type) :: staging

      call staging%open(path, error)
      call write_staged_matrix_market(matrix, staging%path, path, error)
      call staging%finish(error)
   end subroutine write_matrix_market

   !> Writes a matrix to a staged file; messages name its final place.
   subroutine write_staged_matrix_market(matrix, path, place, error)
      type(csr_matrix_type), intent(in) :: matrix
      character(len=*), intent(in) :: path, place
      type(error_type), allocatable, intent(inout) :: error
      character(len=256) :: reason
      integer :: unit, status, ignored, i, k
      integer(long) :: position

      if (allocated(error)) return
      open (newunit=unit, file=path, status="replace", action="write", access="stream", form="formatted", &
         iostat=status, iomsg=reason)
      if (status == 0) then
         write (unit, "(a)", iostat=status, iomsg=reason) banner//" matrix coordinate real general"
         if (status == 0) write (unit, "(i0, 2(1x, i0))", iostat=status, iomsg=reason) &
            matrix%rows, matrix%columns, matrix%nonzeros()
         do i = 1, matrix%rows
            do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
               if (status == 0) write (unit, "(i0, 1x, i0, es25.16e3)", iostat=status, iomsg=reason) &
                  i, matrix%column(k), matrix%value(k)
            end do
         end do
         inquire (unit=unit, pos=position)
         close (unit, iostat=ignored)
         call check_length(path, position - 1, status, reason)
      end if
      if (status /= 0) call new_error(error, error_file, place//": cannot be written: "//trim(reason))
   end subroutine write_staged_matrix_market
end module kschur_matrix_market
