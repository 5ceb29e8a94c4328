!> Matrices in text files without header, as Abaqus and Chrono write them: lines of row, column and value, numbered from 1.
!> Dimensions follow from the entries of all matrices.
module kschur_triplet_files
   use kschur_error, only: error_type, new_error, add_context, error_file, error_input
   use kschur_kinds, only: wp, long
   use kschur_line_reader, only: line_reader_type
   use kschur_problem, only: modal_problem_type, settle_modal_problem
   use kschur_sparse, only: csr_matrix_type, new_csr_from_triplets
   use kschur_text, only: text
   use kschur_triplets, only: triplets_type
   implicit none
   private
   public :: read_triplet_files

   character(len=*), parameter :: comment = "%"

contains

   !> Reads a problem from one file for each matrix; an empty path means no matrix, - standard input. Sums duplicate entries.
   !> The number of unknowns is the largest row or column of M, K, R and H and the largest column of Cq, that of constraints the
   !> largest row of Cq. Fails with the file, the matrix and the reason.
   subroutine read_triplet_files(problem, mass_path, stiffness_path, damping_path, constraints_path, error, symmetric, loss_path)
      type(modal_problem_type), intent(out) :: problem
      character(len=*), intent(in) :: mass_path, stiffness_path, damping_path, constraints_path
      type(error_type), allocatable, intent(out) :: error
      !> As that of `new_modal_problem`.
      integer, intent(in), optional :: symmetric
      !> File of H; absent: none.
      character(len=*), intent(in), optional :: loss_path
      type(triplets_type) :: mass, stiffness, damping, constraints, loss
      integer(long) :: entries
      integer :: n, last

      call read_triplets(mass, mass_path, "mass matrix M", error)
      call read_triplets(stiffness, stiffness_path, "stiffness matrix K", error)
      call read_triplets(damping, damping_path, "damping matrix R", error)
      call read_triplets(constraints, constraints_path, "constraint Jacobian Cq", error)
      call read_triplets(loss, "", "loss matrix H", error)
      if (present(loss_path)) call read_triplets(loss, loss_path, "loss matrix H", error)
      if (allocated(error)) return
      n = max(extent(mass), extent(stiffness), extent(damping), extent(loss), largest(constraints%column, constraints%count))
      last = max(n, largest(constraints%row, constraints%count))
      entries = sum(int([mass%count, stiffness%count, damping%count, constraints%count, loss%count], long))
      if (last > entries) call new_error(error, error_input, "an entry stands at row or column "//text(last)// &
         ", but with "//text(entries)//" entries some rows before it must be empty in all matrices: is the numbering right?")
      call new_matrix(problem%mass, n, mass, "mass matrix M", error)
      call new_matrix(problem%stiffness, n, stiffness, "stiffness matrix K", error)
      call new_matrix(problem%damping, n, damping, "damping matrix R", error)
      call new_matrix(problem%constraints, largest(constraints%row, constraints%count), constraints, "constraint Jacobian Cq", &
         error)
      if (loss%count > 0) then
         allocate (problem%loss)
         call new_matrix(problem%loss, n, loss, "loss matrix H", error)
      end if
      if (.not. allocated(error)) call settle_modal_problem(problem, error, symmetric=symmetric)
      call add_context(error, mass_path//", "//stiffness_path)

   contains

      ! Creates a matrix of this many rows from its triplets; errors name it.
      subroutine new_matrix(matrix, rows, triplets, name, error)
         type(csr_matrix_type), intent(out) :: matrix
         integer, intent(in) :: rows
         type(triplets_type), intent(in) :: triplets
         character(len=*), intent(in) :: name
         type(error_type), allocatable, intent(inout) :: error
         type(error_type), allocatable :: failure

         if (allocated(error)) return
         associate (last => triplets%count)
            call new_csr_from_triplets(matrix, rows, n, triplets%row(:last), triplets%column(:last), &
               triplets%value(:last), failure)
         end associate
         call add_context(failure, "the "//name)
         if (allocated(failure)) call move_alloc(failure, error)
      end subroutine new_matrix
   end subroutine read_triplet_files

   ! Largest row or column.
   pure integer function extent(triplets)
      type(triplets_type), intent(in) :: triplets

      extent = max(largest(triplets%row, triplets%count), largest(triplets%column, triplets%count))
   end function extent

   ! Largest of the first `count` numbers, at least 0.
   pure integer function largest(list, count)
      integer, intent(in) :: list(:), count

      largest = max(0, maxval(list(:count)))
   end function largest

   ! Reads a file of triplets, none for an empty path; errors name the matrix.
   subroutine read_triplets(triplets, path, name, error)
      type(triplets_type), intent(out) :: triplets
      character(len=*), intent(in) :: path, name
      type(error_type), allocatable, intent(inout) :: error
      type(error_type), allocatable :: failure
      type(line_reader_type) :: reader

      if (allocated(error)) return
      call triplets%reserve(1024, error)
      if (path == "" .or. allocated(error)) return
      call reader%open(path, failure)
      if (.not. allocated(failure)) then
         call read_lines(triplets, reader, failure)
         call reader%close()
         call add_context(failure, path)
      end if
      call add_context(failure, "the "//name)
      if (allocated(failure)) call move_alloc(failure, error)
   end subroutine read_triplets

   subroutine read_lines(triplets, reader, error)
      type(triplets_type), intent(inout) :: triplets
      type(line_reader_type), intent(inout) :: reader
      type(error_type), allocatable, intent(out) :: error
      integer(long) :: row, column
      real(wp) :: value
      logical :: found, valid

      do
         call reader%next_line(comment, found)
         if (.not. found) exit
         valid = .true.
         call reader%next_integer(row, valid)
         call reader%next_integer(column, valid)
         call reader%next_real(value, valid)
         if (.not. valid .or. .not. reader%at_end()) then
            call new_error(error, error_input, "line "//text(reader%line)//": an entry must be three numbers, row, column "// &
               "and value")
         else if (min(row, column) < 1 .or. max(row, column) >= huge(1)) then
            call new_error(error, error_input, "line "//text(reader%line)//": entry ("//text(row)//", "//text(column)// &
               "): rows and columns count from 1")
         else
            call triplets%append(int(row), int(column), value, error)
         end if
         if (allocated(error)) return
      end do
      if (reader%failed) call new_error(error, error_file, "the file cannot be read to its end")
      if (.not. reader%failed .and. triplets%count == 0) call new_error(error, error_input, "the file is empty")
   end subroutine read_lines
end module kschur_triplet_files
