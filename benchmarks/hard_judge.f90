!> Solves a hard case by each method, compares with what is expected, prints a line.
module hard_judge
   use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
   use kschur, only: arpack_fair, arpack_names, arpack_plain, error_type, formulation_auto, formulation_damped_constrained, &
      formulation_dense, formulation_names, formulation_quadratic, method_arpack, method_krylov_schur, modal_options_type, &
      modal_problem_type, &
      modal_result_type, solve_modes, text, wp
   implicit none
   private
   public :: case_type, judge_type, said, stop_on

   !> One case.
   type :: case_type
      character(len=:), allocatable :: name
      !> Modes, target and shift.
      type(modal_options_type) :: options
      !> The eigenvalues that the problem has (1/s), Im >= 0, any order: at least those that are
      !> asked for. A zero must be found as a zero.
      complex(wp), allocatable :: expected(:)
      !> What is demanded of the backward error and, relatively, of the eigenvalue.
      real(wp) :: backward = 1.0e-13_wp, accuracy = 1.0e-10_wp
      !> The latter for the formulation `quadratic` by name; 0: the same.
      real(wp) :: accuracy_quadratic = 0
      !> Whether the damping ratio is compared as well.
      logical :: ratios = .false.
   end type case_type

   !> Counts what fails.
   type :: judge_type
      integer :: failures = 0
      !> Whether the paper's pencil is solved as well.
      logical :: pencil = .true.
      !> Whether ARPACK, plain and fair, is run as well.
      logical :: arpack = .false.
      !> Vectors that iterations of ours apply their operator to at a time, if it is not the library that chooses.
      integer, allocatable :: block
   contains
      !> Solves one case by each method.
      procedure :: examine
   end type judge_type

contains

   subroutine examine(self, case, problem)
      class(judge_type), intent(inout) :: self
      type(case_type), intent(in) :: case
      type(modal_problem_type), intent(in) :: problem
      integer, parameter :: formulations(6) = [formulation_auto, formulation_dense, formulation_quadratic, &
         formulation_damped_constrained, formulation_auto, formulation_auto]
      integer, parameter :: methods(6) = [method_krylov_schur, method_krylov_schur, method_krylov_schur, &
         method_krylov_schur, method_arpack, method_arpack]
      integer, parameter :: plain = 5
      ! Beyond this it takes minutes; it takes no shift.
      integer, parameter :: most_dense = 300
      type(modal_options_type) :: options
      type(modal_result_type) :: result
      type(error_type), allocatable :: error
      character(len=:), allocatable :: method, counts, verdict
      complex(wp), allocatable :: expected(:)
      integer :: i, found
      logical :: ours
      real(wp) :: backward, off, accuracy

      method = ""
      counts = ""
      options = case%options
      allocate (expected, source=nearest_values(case%expected, options%target, options%modes))
      do i = 1, size(methods)
         options%formulation = formulations(i)
         options%method = methods(i)
         options%arpack = merge(arpack_plain, arpack_fair, i == plain)
         if (allocated(self%block)) options%block = self%block
         ours = methods(i) == method_krylov_schur .and. formulations(i) /= formulation_damped_constrained
         if (formulations(i) == formulation_damped_constrained .and. .not. self%pencil) cycle
         if (methods(i) == method_arpack .and. .not. self%arpack) cycle
         ! Where it is chosen, it has run.
         if (formulations(i) == formulation_dense .and. (problem%unknowns() > most_dense .or. allocated(options%shift))) cycle
         if (any(formulations(i) == [formulation_dense, formulation_quadratic]) .and. allocated(result%eigenvalues) &
            .and. result%formulation == formulations(i)) cycle
         accuracy = case%accuracy
         if (formulations(i) == formulation_quadratic .and. case%accuracy_quadratic > 0) accuracy = case%accuracy_quadratic
         call solve_modes(problem, options, result, error)
         method = trim(formulation_names(formulations(i)))
         if (methods(i) == method_arpack) method = "arpack "//trim(arpack_names(options%arpack))
         if (.not. allocated(error)) then
            if (method == "auto") method = "auto: "//trim(formulation_names(result%formulation))
            call compare(result, expected, case%ratios, found, backward, off)
            counts = text(found)//"/"//text(size(expected))
            verdict = "ok"
            if (found /= size(expected) .or. .not. backward <= case%backward .or. .not. off <= accuracy) verdict = "FAIL"
            if (ours .and. verdict == "FAIL") self%failures = self%failures + 1
            if (.not. ours .and. verdict == "FAIL") verdict = "fails, reported"
            print "(a48, a28, a9, es9.1, es9.1, f8.2, 2x, a)", padded(case%name, 48), padded(method, 28), counts, backward, &
               off, result%seconds%total, verdict
         else
            verdict = "FAIL: "
            if (ours) then
               self%failures = self%failures + 1
            else
               verdict = "fails, reported: "
            end if
            print "(a48, a28, a9, a26, 2x, 2a)", padded(case%name, 48), padded(method, 28), "-", "", verdict, error%message
         end if
         flush (output_unit)
      end do
   end subroutine examine

   ! How many modes were found, the worst backward error, and how far any expected
   ! eigenvalue is from the one that stands for it.
   subroutine compare(result, expected, ratios, found, backward, off)
      type(modal_result_type), intent(in) :: result
      complex(wp), intent(in) :: expected(:)
      logical, intent(in) :: ratios
      integer, intent(out) :: found
      real(wp), intent(out) :: backward, off
      logical :: used(size(result%eigenvalues))
      real(wp) :: ratio
      integer :: i, j

      found = count_independent(result)
      backward = 0
      if (found > 0) backward = maxval(result%backward_error)
      off = 0
      used = .false.
      do i = 1, size(expected)
         if (all(used)) exit
         j = minloc(abs(result%eigenvalues - expected(i)), 1, .not. used)
         used(j) = .true.
         if (abs(expected(i)) > 0) then
            off = max(off, abs(result%eigenvalues(j) - expected(i))/abs(expected(i)))
            ratio = -real(expected(i), wp)/abs(expected(i))
            if (ratios) off = max(off, abs(result%damping_ratio(j) - ratio)/abs(ratio))
         else if (abs(result%eigenvalues(j)) > 0) then
            off = max(off, 1.0_wp)
         end if
      end do
   end subroutine compare

   ! Modes, without those whose shape is a combination of others of the same eigenvalue.
   integer function count_independent(result) result(found)
      type(modal_result_type), intent(in) :: result
      real(wp), parameter :: same = 1.0e-7_wp, dependent = 1.0e-3_wp
      complex(wp), allocatable :: basis(:, :), rest(:)
      integer :: i, j, k

      found = 0
      do j = 1, size(result%eigenvalues)
         rest = result%eigenvectors(:, j)
         allocate (basis(size(rest), 0))
         do i = 1, j
            if (abs(result%eigenvalues(i) - result%eigenvalues(j)) > same*abs(result%eigenvalues(j))) cycle
            rest = result%eigenvectors(:, i)
            do k = 1, size(basis, 2)
               rest = rest - dot_product(basis(:, k), rest)*basis(:, k)
            end do
            if (length(rest) <= dependent) cycle
            basis = reshape([basis, rest/length(rest)], [size(rest), size(basis, 2) + 1])
         end do
         if (length(rest) > dependent) found = found + 1
         deallocate (basis)
      end do
   end function count_independent

   pure real(wp) function length(x)
      complex(wp), intent(in) :: x(:)

      length = sqrt(sum(real(x, wp)**2 + aimag(x)**2))
   end function length

   ! The values nearest to a target, as the solver counts them: of the nearer of each pair.
   pure function nearest_values(values, target, wanted) result(chosen)
      complex(wp), intent(in) :: values(:), target
      integer, intent(in) :: wanted
      complex(wp) :: chosen(min(wanted, size(values)))
      logical :: left(size(values))
      integer :: i, at

      left = .true.
      do i = 1, size(chosen)
         at = minloc(min(abs(values - target), abs(conjg(values) - target)), 1, left)
         chosen(i) = values(at)
         left(at) = .false.
      end do
   end function nearest_values

   pure function padded(word, width) result(field)
      character(len=*), intent(in) :: word
      integer, intent(in) :: width
      character(len=width) :: field

      field = word
   end function padded

   !> The words, or nothing.
   pure function said(words, condition)
      character(len=*), intent(in) :: words
      logical, intent(in) :: condition
      character(len=:), allocatable :: said

      said = ""
      if (condition) said = words
   end function said

   !> Ends the program with the message of a raised error.
   subroutine stop_on(error)
      type(error_type), allocatable, intent(in) :: error

      if (.not. allocated(error)) return
      write (error_unit, "(a)") error%message
      stop 1
   end subroutine stop_on
end module hard_judge
