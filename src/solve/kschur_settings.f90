!> What a method asks of everything around it: Krylov-Schur, ARPACK in its place, or ARPACK as
!> the paper compares with it.
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

   ! More modes, dimensions of a space or vectors of a block than anybody has memory for; a hundred times as many are still a
   ! default integer.
   integer, parameter :: most_columns = 10**7

contains

   !> Fails on options that no problem fits.
   subroutine check_options(options, error)
      type(modal_options_type), intent(in) :: options
      type(error_type), allocatable, intent(out) :: error

      call between("number of modes", options%modes, 1, most_columns, error)
      if (.not. (allocated(error) .or. (options%tolerance > 0 .and. options%tolerance < 1))) call new_error(error, error_usage, &
         "the tolerance is "//text(options%tolerance)//" but must lie between 0 and 1")
      call check_place("target", options%target, error)
      if (allocated(options%shift)) call check_place("shift", options%shift, error)
      call between("subspace dimension", options%subspace, 0, most_columns, error)
      call between("number of vectors of a block", options%block, 0, most_columns, error)
      call between("number of threads", options%threads, 0, most_threads, error)
      call at_least("limit of memory", options%memory, 0, error)
      call at_least("number of rows from which a matrix is distributed", int(options%distribute, long), 1, error)
      call at_least("number of groups", int(options%groups, long), 0, error)
      call at_least("number of restarts", int(options%max_restarts, long), 1, error)
      call one_of("formulation", options%formulation, formulation_names, error)
      call one_of("constraint scaling", options%constraint_scaling, scaling_names, error)
      call one_of("inner solver", options%inner, inner_names, error)
      call one_of("normalisation", options%normalisation, normalisation_names, error)
      call one_of("method", options%method, method_names, error)
      call one_of("setting of ARPACK", options%arpack, arpack_names, error)
      if (.not. allocated(error) .and. options%certify .and. options%uncounted) call new_error(error, error_usage, &
         "the modes cannot be both certified and uncounted")
      if (.not. allocated(error)) call check_method(options, error)
      if (.not. allocated(error) .and. options%formulation == formulation_dense) call check_dense(options, error)
   end subroutine check_options

   ! Of a number that others are added to, and that is multiplied.
   subroutine between(name, value, least, most, error)
      character(len=*), intent(in) :: name
      integer, intent(in) :: value, least, most
      type(error_type), allocatable, intent(inout) :: error

      call at_least(name, int(value, long), least, error)
      if (.not. allocated(error) .and. value > most) call new_error(error, error_usage, "the "//name//" is "//text(value)// &
         " but must be at most "//text(most))
   end subroutine between

   subroutine at_least(name, value, least, error)
      character(len=*), intent(in) :: name
      integer(long), intent(in) :: value
      integer, intent(in) :: least
      type(error_type), allocatable, intent(inout) :: error

      if (.not. allocated(error) .and. value < least) call new_error(error, error_usage, "the "//name//" is "//text(value)// &
         " but must be at least "//text(least))
   end subroutine at_least

   subroutine check_place(name, value, error)
      character(len=*), intent(in) :: name
      complex(wp), intent(in) :: value
      type(error_type), allocatable, intent(inout) :: error
      real(wp), parameter :: largest = 1.0e100_wp

      if (.not. (allocated(error) .or. abs(value) <= largest)) &
         call new_error(error, error_usage, "the "//name//" must be a number below 1e100")
   end subroutine check_place

   subroutine one_of(name, value, names, error)
      character(len=*), intent(in) :: name
      integer, intent(in) :: value
      !> From number 0 on.
      character(len=*), intent(in) :: names(0:)
      type(error_type), allocatable, intent(inout) :: error

      if (.not. allocated(error) .and. (value < 0 .or. value > ubound(names, 1))) call new_error(error, error_usage, &
         "there is no "//name//" number "//text(value)//", only 0 to "//text(ubound(names, 1)))
   end subroutine one_of

   ! Fails on options of an iteration.
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

   !> The options that a method solves with.
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

   !> What the iteration is told.
   subroutine set_iteration_options(options, formulation, order, asked, known, oscillator, krylov)
      type(modal_options_type), intent(in) :: options
      integer, intent(in) :: formulation
      !> Length of the vectors that are iterated.
      integer, intent(in) :: order
      !> How many modes are wanted; how many of them are known beforehand.
      integer, intent(in) :: asked, known
      !> Whether a mode is one eigenvalue; otherwise it is two.
      logical, intent(in) :: oscillator
      class(krylov_options_type), allocatable, intent(out) :: krylov
      integer :: values, subspace

      values = merge(1, 2, oscillator)*asked
      subspace = options%subspace
      if (options%method == method_arpack) then
         if (.not. options%is_plain()) then
            values = max(values - merge(1, 2, oscillator)*known, 1)
            ! The wanted eigenvalues are nearest to the target, those of ARPACK to the shift. A certificate
            ! wants to see the next ones.
            values = values + merge(2, max(values/4, 2), oscillator)
         end if
         allocate (krylov, source=arpack_options_type(values=values, raw=options%is_plain()))
      else
         allocate (krylov_options_type :: krylov)
         ! So much that a restart is rare; memory is touched as far as it is used.
         if (subspace == 0 .and. is_structured(formulation)) then
            subspace = 3*values + 40*options%block
            ! Of most of all there is the projected problem costs more than a restart.
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
