!> Input of a problem: a folder of Matrix Market files, an HDF5 file, or individual files.
module cli_input
   use cli_arguments, only: arguments_type
   use cli_processes, only: read_together
   use cli_system, only: ends_with, is_folder, same_file
   use kschur, only: add_context, error_file, error_input, error_type, error_usage, long, modal_problem_type, new_error, &
      read_hdf5_problem, read_matrix_market_files, read_matrix_market_problem, read_triplet_files, &
      shared_problem_type, symmetric_check, symmetric_names, wp
   implicit none
   private
   public :: input_type, is_large, is_part_of, read_problem, read_shared_problem, take_input, take_symmetric

   !> Names of files; not allocated: not given.
   type :: input_type
      !> A folder or an HDF5 file.
      character(len=:), allocatable :: path
      !> One file per matrix, instead of `path`; - is standard input.
      character(len=:), allocatable :: mass, stiffness, damping, constraints, loss
      !> Whether these are rows, columns and values without a header.
      logical :: triplets = .false.
      !> How symmetric matrices are stored: `symmetric_check` and its like.
      integer :: symmetric = symmetric_check
      !> Loss factor g of H = g K.
      real(wp), allocatable :: loss_factor
   end type input_type

contains

   !> Takes PROBLEM or its files one by one, --mass, --stiffness, --damping, --constraints, --loss, and the options on how to read
   !> them. Fails if words remain: called after all other options were taken.
   subroutine take_input(arguments, input, error)
      type(arguments_type), intent(inout) :: arguments
      type(input_type), intent(out) :: input
      type(error_type), allocatable, intent(inout) :: error
      logical :: any_file

      call arguments%take_text("--mass", input%mass, error)
      call arguments%take_text("--stiffness", input%stiffness, error)
      call arguments%take_text("--damping", input%damping, error)
      call arguments%take_text("--constraints", input%constraints, error)
      call arguments%take_text("--loss", input%loss, error)
      call arguments%take_positive("--loss-factor", input%loss_factor, error)
      call arguments%take_flag("--triplets", input%triplets, error)
      call take_symmetric(arguments, input, error)
      call arguments%take_word(input%path)
      call arguments%check_all_taken(error)
      if (allocated(error)) return

      any_file = allocated(input%mass) .or. allocated(input%stiffness) .or. allocated(input%damping) &
         .or. allocated(input%constraints) .or. allocated(input%loss)
      if (allocated(input%path) .and. any_file) then
         call new_error(error, error_usage, "either a problem, '"//input%path//"', or its files one by one, not both")
      else if (any_file .and. .not. (allocated(input%mass) .and. allocated(input%stiffness))) then
         call new_error(error, error_usage, "files named one by one need --mass and --stiffness")
      else if (.not. (allocated(input%path) .or. any_file)) then
         call new_error(error, error_usage, "no problem is given; see kschur help")
      else if (input%triplets .and. .not. any_file) then
         call new_error(error, error_usage, "--triplets is for files named by --mass, --stiffness and their like")
      else if (times_standard_input(input) > 1) then
         call new_error(error, error_usage, "only one matrix can come from standard input")
      else if (.not. any_file) then
         if (input%path == "") call new_error(error, error_usage, "the name of the problem is empty: give a file or a folder")
      end if
   end subroutine take_input

   !> Takes the option --symmetric alone.
   subroutine take_symmetric(arguments, input, error)
      type(arguments_type), intent(inout) :: arguments
      type(input_type), intent(inout) :: input
      type(error_type), allocatable, intent(inout) :: error

      call arguments%take_choice("--symmetric", symmetric_names, input%symmetric, error)
   end subroutine take_symmetric

   !> Whether a problem is large enough for several threads, by the size of its file or of that of K.
   logical function is_large(input)
      type(input_type), intent(in) :: input
      integer(long), parameter :: large = 2_long**20

      if (allocated(input%path)) then
         is_large = max(bytes(input%path), bytes(input%path//"/K.mtx")) >= large
      else
         is_large = bytes(input%stiffness) >= large
      end if
   end function is_large

   ! Size of an existing file.
   integer(long) function bytes(path)
      character(len=*), intent(in) :: path

      inquire (file=path, size=bytes)
   end function bytes

   ! Number of matrices that are read from standard input.
   pure integer function times_standard_input(input)
      type(input_type), intent(in) :: input

      times_standard_input = count([or_empty(input%mass) == "-", or_empty(input%stiffness) == "-", &
         or_empty(input%damping) == "-", or_empty(input%constraints) == "-", or_empty(input%loss) == "-"])
   end function times_standard_input

   !> Whether a path names a file that the problem is read from.
   logical function is_part_of(input, path)
      type(input_type), intent(in) :: input
      character(len=*), intent(in) :: path
      character(len=*), parameter :: names(5) = [character(len=6) :: "M.mtx", "K.mtx", "R.mtx", "Cq.mtx", "L.mtx"]
      integer :: i

      if (allocated(input%path)) then
         is_part_of = same_file(path, input%path)
         do i = 1, size(names)
            if (.not. is_part_of) is_part_of = same_file(path, input%path//"/"//trim(names(i)))
         end do
      else
         is_part_of = same_file(path, input%mass)
         if (.not. is_part_of) is_part_of = same_file(path, input%stiffness)
         if (.not. is_part_of) is_part_of = same_file(path, or_empty(input%damping))
         if (.not. is_part_of) is_part_of = same_file(path, or_empty(input%constraints))
         if (.not. is_part_of) is_part_of = same_file(path, or_empty(input%loss))
      end if
   end function is_part_of

   !> Reads the problem; all errors are `error_input` and name a file.
   subroutine read_problem(input, problem, error)
      type(input_type), intent(in) :: input
      type(modal_problem_type), intent(out) :: problem
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: path
      logical :: exists

      if (.not. allocated(input%path)) then
         path = input%mass
         if (input%triplets) then
            call read_triplet_files(problem, input%mass, input%stiffness, or_empty(input%damping), &
               or_empty(input%constraints), error, input%symmetric, or_empty(input%loss))
         else
            call read_matrix_market_files(problem, input%mass, input%stiffness, or_empty(input%damping), &
               or_empty(input%constraints), error, input%symmetric, or_empty(input%loss))
         end if
      else
         path = input%path
         inquire (file=path, exist=exists)
         if (is_folder(path)) then
            call read_matrix_market_problem(problem, path, error, input%symmetric)
         else if (exists .and. is_of_another_code(path)) then
            call new_error(error, error_input, path//": this is a file of another code; make a problem of it by kschur convert "// &
               path//" OUT.h5")
         else if (exists .and. ends_with(path, ".mtx")) then
            call new_error(error, error_input, path//": one matrix is no problem; name its folder, or the files "// &
               "by --mass, --stiffness and their like")
         else if (exists) then
            call read_hdf5_problem(problem, path, error, trial=.true., symmetric=input%symmetric)
         else
            call new_error(error, error_input, path//": there is no such file or folder")
         end if
      end if
      call take_loss_factor(input, problem, error)
      call name_file(input, error)
   end subroutine read_problem

   ! Whether kschur convert reads files with the ending of this name. Not for .mtx, Matrix Market.
   logical function is_of_another_code(path)
      character(len=*), intent(in) :: path
      character(len=*), parameter :: endings(11) = [character(len=6) :: ".sti", ".mas", ".mat", ".npz", ".hb", ".rua", ".rsa", &
         ".petsc", ".op4", ".pch", ".dmig"]
      integer :: i

      is_of_another_code = any([(ends_with(path, trim(endings(i))), i=1, size(endings))])
   end function is_of_another_code

   ! Sets H = g K in the problem if a loss factor g was given.
   subroutine take_loss_factor(input, problem, error)
      type(input_type), intent(in) :: input
      type(modal_problem_type), intent(inout) :: problem
      type(error_type), allocatable, intent(inout) :: error
      type(error_type), allocatable :: failure

      ! The problem is in the first process.
      if (allocated(error) .or. .not. (allocated(input%loss_factor) .and. allocated(problem%stiffness%value))) return
      call problem%set_loss_factor(input%loss_factor, failure)
      if (allocated(failure)) call move_alloc(failure, error)
   end subroutine take_loss_factor

   !> Reads the problem as `read_problem` does, an HDF5 file collectively in all processes.
   subroutine read_shared_problem(input, shared, error)
      type(input_type), intent(in) :: input
      type(shared_problem_type), intent(out) :: shared
      type(error_type), allocatable, intent(out) :: error
      logical :: in_hdf5

      in_hdf5 = .false.
      if (allocated(input%path)) then
         inquire (file=input%path, exist=in_hdf5)
         if (is_folder(input%path) .or. ends_with(input%path, ".mtx") .or. is_of_another_code(input%path)) in_hdf5 = .false.
      end if
      if (in_hdf5) then
         call read_together(input%path, shared, error, input%symmetric)
         call take_loss_factor(input, shared%problem, error)
         call name_file(input, error)
      else
         call read_problem(input, shared%problem, error)
      end if
   end subroutine read_shared_problem

   ! Makes a file error an input error, and adds the name of the file if the message lacks it.
   subroutine name_file(input, error)
      type(input_type), intent(in) :: input
      type(error_type), allocatable, intent(inout) :: error

      if (.not. allocated(error)) return
      if (error%code == error_file) error%code = error_input
      if (.not. allocated(input%path)) return
      if (index(error%message, input%path) == 0) call add_context(error, input%path)
   end subroutine name_file

   pure function or_empty(path)
      character(len=:), allocatable, intent(in) :: path
      character(len=:), allocatable :: or_empty

      allocate (character(len=0) :: or_empty)
      if (allocated(path)) or_empty = path
   end function or_empty
end module cli_input
