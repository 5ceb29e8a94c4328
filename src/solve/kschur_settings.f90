!> Checks options, and sets those that a method prescribes: Krylov-Schur, ARPACK in its place (fair), or ARPACK as in the paper
!> (plain).
module kschur_settings
   use kschur_arpack_options, only: arpack_options_type
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_formulation, only: is_structured
   use kschur_kinds, only: wp, long
   use kschur_krylov_options, only: krylov_options_type, subspace_dimension
   use kschur_options, only: modal_options_type, arpack_names, formulation_auto, formulation_damped_constrained, &
      formulation_damped_constrained_zero, formulation_dense, formulation_low_rank, formulation_names, inner_names, &
      normalisation_names, scaling_names, &
      formulation_undamped_constrained_zero, method_arpack, method_krylov_schur, method_names, scaling_none
   use kschur_text, only: text
   use kschur_threads, only: most_threads
   implicit none
   private
   public :: check_options, set_iteration_options, method_name, settings_of

   ! Largest number of modes, dimension of a space or block size: beyond any memory, but a hundred times as many are still a default
   ! integer.
   integer, parameter :: most_columns = 10**7

contains

   !> Fails on options that are invalid for every problem.
   subroutine check_options(options, error)
      type(modal_options_type), intent(in) :: options
      type(error_type), allocatable, intent(out) :: error

      call check_range("number of modes", options%modes, 1, most_columns, error)
      if (.not. (allocated(error) .or. (options%tolerance > 0 .and. options%tolerance < 1))) call new_error(error, error_usage, &
         "the tolerance is "//text(options%tolerance)//" but must lie between 0 and 1")
      call check_point("target", options%target, error)
      if (allocated(options%shift)) call check_point("shift", options%shift, error)
      call check_range("subspace dimension", options%subspace, 0, most_columns, error)
      call check_range("number of vectors of a block", options%block, 0, most_columns, error)
      call check_range("number of threads", options%threads, 0, most_threads, error)
      call check_minimum("limit of memory", options%memory, 0, error)
      call check_minimum("number of rows from which a matrix is distributed", int(options%distribute, long), 1, error)
      call check_minimum("number of groups", int(options%groups, long), 0, error)
      call check_minimum("number of restarts", int(options%max_restarts, long), 1, error)
      call check_choice("formulation", options%formulation, formulation_names, error)
      call check_choice("constraint scaling", options%constraint_scaling, scaling_names, error)
      call check_choice("inner solver", options%inner, inner_names, error)
      call check_choice("normalisation", options%normalisation, normalisation_names, error)
      call check_choice("method", options%method, method_names, error)
      call check_choice("setting of ARPACK", options%arpack, arpack_names, error)
      if (.not. allocated(error) .and. options%certify .and. options%uncounted) call new_error(error, error_usage, &
         "the modes cannot be both certified and uncounted")
      if (.not. allocated(error)) call check_method(options, error)
      if (.not. allocated(error) .and. options%formulation == formulation_dense) call check_dense(options, error)
   end subroutine check_options

   ! Fails if a number lies outside its range. The upper limit keeps sums and multiples of it in range of default integers.
   subroutine check_range(name, value, least, most, error)
      character(len=*), intent(in) :: name
      integer, intent(in) :: value, least, most
      type(error_type), allocatable, intent(inout) :: error

      call check_minimum(name, int(value, long), least, error)
      if (.not. allocated(error) .and. value > most) call new_error(error, error_usage, "the "//name//" is "//text(value)// &
         " but must be at most "//text(most))
   end subroutine check_range

   ! Fails if a number is below its minimum.
   subroutine check_minimum(name, value, least, error)
      character(len=*), intent(in) :: name
      integer(long), intent(in) :: value
      integer, intent(in) :: least
      type(error_type), allocatable, intent(inout) :: error

      if (.not. allocated(error) .and. value < least) call new_error(error, error_usage, "the "//name//" is "//text(value)// &
         " but must be at least "//text(least))
   end subroutine check_minimum

   ! Fails if a target or shift is not finite, or so large that its powers may overflow.
   subroutine check_point(name, value, error)
      character(len=*), intent(in) :: name
      complex(wp), intent(in) :: value
      type(error_type), allocatable, intent(inout) :: error
      real(wp), parameter :: largest = 1.0e100_wp

      if (.not. (allocated(error) .or. abs(value) <= largest)) &
         call new_error(error, error_usage, "the "//name//" must be a number below 1e100")
   end subroutine check_point

   ! Fails if a number is none of an enumeration.
   subroutine check_choice(name, value, names, error)
      character(len=*), intent(in) :: name
      integer, intent(in) :: value
      !> Names of the enumeration, from 0 on.
      character(len=*), intent(in) :: names(0:)
      type(error_type), allocatable, intent(inout) :: error

      if (.not. allocated(error) .and. (value < 0 .or. value > ubound(names, 1))) call new_error(error, error_usage, &
         "there is no "//name//" number "//text(value)//", only 0 to "//text(ubound(names, 1)))
   end subroutine check_choice

   ! Fails on options that only an iteration has, for `formulation_dense`.
   subroutine check_dense(options, error)
      type(modal_options_type), intent(in) :: options
      type(error_type), allocatable, intent(out) :: error

      if (allocated(options%shift)) then
         call new_error(error, error_usage, "the formulation dense computes all eigenvalues: leave out the shift")
      else if (options%subspace > 0) then
         call new_error(error, error_usage, "the formulation dense iterates nothing: leave out the subspace")
      else if (options%method /= method_krylov_schur) then
         call new_error(error, error_usage, "the formulation dense iterates nothing: leave out the method")
      end if
   end subroutine check_dense

   ! Fails on options that do not fit the method.
   subroutine check_method(options, error)
      type(modal_options_type), intent(in) :: options
      type(error_type), allocatable, intent(out) :: error

      if (options%formulation == formulation_low_rank .and. options%method /= method_krylov_schur) then
         call new_error(error, error_usage, "the formulation low-rank has an iteration of its own: leave out the method")
      else if (.not. options%is_plain()) then
         continue
      else if (options%formulation /= formulation_auto .and. (is_structured(options%formulation) .or. any(options%formulation == &
         [formulation_undamped_constrained_zero, formulation_damped_constrained_zero]))) then
         call new_error(error, error_usage, "plain ARPACK iterates pencils whose spurious eigenvalues are infinite, not "// &
            trim(formulation_names(options%formulation))//": leave out the formulation, or take damped-constrained")
      else if (options%left) then
         call new_error(error, error_usage, "plain ARPACK gives no left vectors: take the fair setting")
      else if (options%certify) then
         call new_error(error, error_usage, &
            "plain ARPACK is not certified, as it does not know the zeros of rigid motions: take the fair setting")
      end if
   end subroutine check_method

   !> Returns the options that a method solves with: plain ARPACK sets formulation, scaling, presolve and shift as in the paper.
   function settings_of(options) result(settings)
      type(modal_options_type), intent(in) :: options
      type(modal_options_type) :: settings
      ! The paper's shift (1/s).
      real(wp), parameter :: beside_target = 1.0e-3_wp

      settings = options
      if (.not. options%is_plain()) return
      if (options%formulation == formulation_auto) settings%formulation = formulation_damped_constrained
      settings%constraint_scaling = scaling_none
      settings%presolve = .false.
      if (.not. allocated(options%shift)) allocate (settings%shift, source=options%target + beside_target)
   end function settings_of

   !> "krylov-schur", "arpack-plain" or "arpack-fair".
   pure function method_name(options) result(name)
      type(modal_options_type), intent(in) :: options
      character(len=merge(len_trim(arpack_names(options%arpack)) + len("arpack-"), len_trim(method_names(options%method)), &
         options%method == method_arpack)) :: name

      name = method_names(options%method)
      if (options%method == method_arpack) name = "arpack-"//arpack_names(options%arpack)
   end function method_name

   !> Makes the options of the iteration: dimension of the Krylov space, tolerance, limits, and for ARPACK the number of values.
   subroutine set_iteration_options(options, formulation, order, wanted, known, oscillator, upper, krylov)
      type(modal_options_type), intent(in) :: options
      integer, intent(in) :: formulation
      !> Length of the vectors that are iterated.
      integer, intent(in) :: order
      !> Number of wanted modes, and how many of them are known beforehand.
      integer, intent(in) :: wanted, known
      !> Whether a mode is one eigenvalue theta = omega^2; otherwise it is two lambda.
      logical, intent(in) :: oscillator
      !> Whether only eigenvalues above the real axis are modes: those below it are not wanted.
      logical, intent(in) :: upper
      class(krylov_options_type), allocatable, intent(out) :: krylov
      integer :: values, subspace

      values = merge(1, 2, oscillator)*wanted
      subspace = options%subspace
      if (options%method == method_arpack) then
         if (.not. options%is_plain()) then
            values = max(values - merge(1, 2, oscillator)*known, 1)
            ! More values than wanted: ARPACK finds those nearest to the shift, not to the target, and a certificate needs the next
            ! ones to find a gap.
            values = values + merge(2, max(values/4, 2), oscillator)
         end if
         allocate (krylov, source=arpack_options_type(values=values, raw=options%is_plain()))
      else
         allocate (krylov_options_type :: krylov)
         ! So large that restarts are rare; only the part in use takes memory.
         if (subspace == 0 .and. is_structured(formulation)) then
            subspace = 3*merge(wanted, values, upper) + 40*options%block
            ! If most of all eigenvalues are wanted, a larger projected problem costs more than a restart.
            if (.not. oscillator) subspace = min(subspace, max(subspace_dimension(0, values, options%block), order/2))
         end if
      end if
      krylov%block = options%block
      krylov%subspace = subspace_dimension(subspace, values, krylov%block)
      krylov%tolerance = options%tolerance
      krylov%max_restarts = options%max_restarts
      krylov%seed = options%seed
   end subroutine set_iteration_options
end module kschur_settings
