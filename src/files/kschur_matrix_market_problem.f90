!> Problems in Matrix Market files, one for each matrix.
module kschur_matrix_market_problem
   use kschur_error, only: error_type, add_context
   use kschur_files, only: staging_type, remove_file, make_folder, is_link, kind_of_file, regular_file
   use kschur_kinds, only: long
   use kschur_matrix_market, only: read_matrix_market, write_staged_matrix_market
   use kschur_problem, only: modal_problem_type, settle_modal_problem
   use kschur_sparse, only: csr_matrix_type, empty_csr_matrix
   implicit none
   private
   public :: read_matrix_market_problem, read_matrix_market_files, write_matrix_market_problem

contains

   !> Reads M.mtx, K.mtx and, if they exist, R.mtx, Cq.mtx and L.mtx (H) of a folder; a dangling link counts as existing. Fails
   !> with the file, the matrix and the reason.
   subroutine read_matrix_market_problem(problem, folder, error, symmetric)
      type(modal_problem_type), intent(out) :: problem
      character(len=*), intent(in) :: folder
      type(error_type), allocatable, intent(out) :: error
      !> As in `new_modal_problem`; a file declared symmetric is completed anyway.
      integer, intent(in), optional :: symmetric

      call read_matrix_market_files(problem, folder//"/M.mtx", folder//"/K.mtx", &
         if_exists(folder//"/R.mtx"), if_exists(folder//"/Cq.mtx"), error, symmetric, if_exists(folder//"/L.mtx"))
   end subroutine read_matrix_market_problem

   ! The path; empty if there is no such file, nor a dangling link of this name.
   function if_exists(path) result(given)
      character(len=*), intent(in) :: path
      character(len=len(path)) :: given
      logical :: exists

      inquire (file=path, exist=exists)
      if (.not. exists) exists = is_link(path)
      given = ""
      if (exists) given = path
   end function if_exists

   !> Reads a problem from one file for each matrix; an empty path means no matrix. Fails as `read_matrix_market_problem`.
   subroutine read_matrix_market_files(problem, mass_path, stiffness_path, damping_path, constraints_path, error, symmetric, &
      loss_path)
      type(modal_problem_type), intent(out) :: problem
      character(len=*), intent(in) :: mass_path, stiffness_path, damping_path, constraints_path
      type(error_type), allocatable, intent(out) :: error
      !> As in `read_matrix_market_problem`.
      integer, intent(in), optional :: symmetric
      !> File of H; absent: none.
      character(len=*), intent(in), optional :: loss_path
      character(len=:), allocatable :: paths, loss
      integer(long) :: most

      loss = ""
      if (present(loss_path)) loss = trim(loss_path)

      ! Upper bound: each unknown has an entry in some matrix.
      most = sum([bytes_of(mass_path), bytes_of(stiffness_path), bytes_of(damping_path), bytes_of(constraints_path), &
         bytes_of(loss)])
      call read_named(problem%mass, mass_path, "mass matrix M", most, error)
      if (.not. allocated(error)) call read_named(problem%stiffness, stiffness_path, "stiffness matrix K", most, error)
      if (allocated(error)) return
      associate (n => problem%mass%rows)
         problem%damping = empty_csr_matrix(n, n)
         problem%constraints = empty_csr_matrix(0, n)
      end associate
      if (damping_path /= "") call read_named(problem%damping, damping_path, "damping matrix R", most, error)
      if (allocated(error)) return
      if (constraints_path /= "") call read_named(problem%constraints, constraints_path, "constraint Jacobian Cq", most, error)
      if (allocated(error)) return
      if (loss /= "") then
         allocate (problem%loss)
         call read_named(problem%loss, loss, "loss matrix H", most, error)
         if (allocated(error)) return
      end if
      call settle_modal_problem(problem, error, symmetric=symmetric)
      paths = mass_path//", "//stiffness_path
      if (damping_path /= "") paths = paths//", "//damping_path
      if (constraints_path /= "") paths = paths//", "//constraints_path
      if (loss /= "") paths = paths//", "//loss
      call add_context(error, paths)
   end subroutine read_matrix_market_files

   ! Size of a file in bytes; huge for a pipe.
   integer(long) function bytes_of(path) result(bytes)
      character(len=*), intent(in) :: path

      bytes = 0
      if (path == "") return
      bytes = huge(1)*4_long
      if (kind_of_file(path) == regular_file) inquire (file=path, size=bytes)
   end function bytes_of

   ! Reads a matrix; errors name it.
   subroutine read_named(matrix, path, name, most, error)
      type(csr_matrix_type), intent(out) :: matrix
      character(len=*), intent(in) :: path, name
      integer(long), intent(in) :: most
      type(error_type), allocatable, intent(out) :: error

      call read_matrix_market(matrix, path, error, most)
      call add_context(error, "the "//name)
   end subroutine read_named

   !> Writes M.mtx, K.mtx and, if they have entries, R.mtx, Cq.mtx and L.mtx into a folder, created if necessary. All appear
   !> when all are complete.
   subroutine write_matrix_market_problem(problem, folder, error)
      type(modal_problem_type), intent(in) :: problem
      character(len=*), intent(in) :: folder
      type(error_type), allocatable, intent(out) :: error
      type(staging_type) :: staging
      logical :: damped, constrained

      damped = problem%damping%nonzeros() > 0
      constrained = problem%multipliers() > 0
      call staging%open(folder, error)
      if (.not. allocated(error)) call make_folder(staging%path)
      call write_one(problem%mass, "/M.mtx")
      call write_one(problem%stiffness, "/K.mtx")
      if (damped) call write_one(problem%damping, "/R.mtx")
      if (constrained) call write_one(problem%constraints, "/Cq.mtx")
      if (allocated(problem%loss)) call write_one(problem%loss, "/L.mtx")
      call staging%finish(error)
      if (allocated(error)) return
      if (.not. damped) call remove_file(folder//"/R.mtx")
      if (.not. constrained) call remove_file(folder//"/Cq.mtx")
      if (.not. allocated(problem%loss)) call remove_file(folder//"/L.mtx")

   contains

      subroutine write_one(matrix, name)
         type(csr_matrix_type), intent(in) :: matrix
         character(len=*), intent(in) :: name

         call write_staged_matrix_market(matrix, staging%path//name, folder//name, error)
      end subroutine write_one
   end subroutine write_matrix_market_problem
end module kschur_matrix_market_problem
