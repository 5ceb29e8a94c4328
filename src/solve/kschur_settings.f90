!> What a method asks of everything around it: Krylov-Schur, ARPACK in its place, or ARPACK as
!> the paper compares with it.
module kschur_settings
   use kschur_arpack_options, only: arpack_options_type
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_formulation, only: is_structured
   use kschur_kinds, only: wp
   use kschur_krylov_options, only: krylov_options_type, subspace_dimension
   use kschur_options, only: modal_options_type, arpack_names, formulation_auto, formulation_damped_constrained, &
      formulation_damped_constrained_zero, formulation_dense, formulation_low_rank, formulation_names, inner_names, &
      normalisation_names, scaling_names, &
      formulation_undamped_constrained_zero, method_arpack, method_krylov_schur, method_names, scaling_none
   implicit none
   private
   public :: check_options, set_iteration_options, method_name, settings_of

contains

   !> Fails on options that no problem fits.
   subroutine check_options(options, error)
      type(modal_options_type), intent(in) :: options
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: largest = 1.0e100_wp

      if (options%modes < 1) then
         call new_error(error, error_usage, "the number of modes must be at least 1")
      else if (.not. (options%tolerance > 0 .and. options%tolerance < 1)) then
         call new_error(error, error_usage, "the tolerance must lie between 0 and 1")
      else if (.not. abs(options%target) <= largest) then
         call new_error(error, error_usage, "the target must be a number below 1e100")
      else if (options%subspace < 0) then
         call new_error(error, error_usage, "the subspace dimension must not be negative")
      else if (options%block < 0) then
         call new_error(error, error_usage, "the number of vectors of a block must not be negative")
      else if (options%threads < 0) then
         call new_error(error, error_usage, "the number of threads must not be negative")
      else if (options%memory < 0) then
         call new_error(error, error_usage, "the limit of memory must not be negative")
      else if (options%distribute < 1) then
         call new_error(error, error_usage, "a matrix that is distributed has at least one row")
      else if (options%groups < 0) then
         call new_error(error, error_usage, "the number of groups must not be negative")
      else if (options%max_restarts < 1) then
         call new_error(error, error_usage, "the number of restarts must be at least 1")
      else if (options%formulation < 0 .or. options%formulation > ubound(formulation_names, 1)) then
         call new_error(error, error_usage, "there is no such formulation")
      else if (options%constraint_scaling < 0 .or. options%constraint_scaling > ubound(scaling_names, 1)) then
         call new_error(error, error_usage, "there is no such constraint scaling")
      else if (options%inner < 0 .or. options%inner > ubound(inner_names, 1)) then
         call new_error(error, error_usage, "there is no such inner solver")
      else if (options%normalisation < 0 .or. options%normalisation > ubound(normalisation_names, 1)) then
         call new_error(error, error_usage, "there is no such normalisation")
      else if (allocated(options%shift)) then
         if (.not. abs(options%shift) <= largest) &
            call new_error(error, error_usage, "the shift must be a number below 1e100")
      end if
      if (.not. allocated(error)) call check_method(options, error)
      if (.not. allocated(error) .and. options%formulation == formulation_low_rank .and. &
         options%method /= method_krylov_schur) call new_error(error, error_usage, &
         "the formulation low-rank has an iteration of its own: leave out the method")
      if (.not. allocated(error) .and. options%formulation == formulation_dense) call check_dense(options, error)
   end subroutine check_options

   ! Fails on options of an iteration.
   subroutine check_dense(options, error)
      type(modal_options_type), intent(in) :: options
      type(error_type), allocatable, intent(out) :: error

      if (allocated(options%shift)) then
         call new_error(error, error_usage, "the formulation dense computes all eigenvalues and takes no shift")
      else if (options%subspace > 0) then
         call new_error(error, error_usage, "the formulation dense iterates nothing and takes no subspace")
      else if (options%method /= method_krylov_schur) then
         call new_error(error, error_usage, "the formulation dense iterates nothing: leave out the method")
      end if
   end subroutine check_dense

   ! Fails on options that do not fit the method.
   subroutine check_method(options, error)
      type(modal_options_type), intent(in) :: options
      type(error_type), allocatable, intent(out) :: error

      if (options%method < 0 .or. options%method > ubound(method_names, 1)) then
         call new_error(error, error_usage, "there is no such method")
      else if (options%arpack < 0 .or. options%arpack > ubound(arpack_names, 1)) then
         call new_error(error, error_usage, "there is no such setting of ARPACK")
      else if (.not. options%is_plain() .or. options%formulation == formulation_auto) then
         continue
      else if (is_structured(options%formulation) .or. any(options%formulation == &
         [formulation_undamped_constrained_zero, formulation_damped_constrained_zero])) then
         call new_error(error, error_usage, "plain ARPACK knows the pencils whose spurious eigenvalues are infinite, not "// &
            trim(formulation_names(options%formulation)))
      end if
      if (.not. allocated(error) .and. options%is_plain() .and. options%left) &
         call new_error(error, error_usage, "plain ARPACK gives no left vectors")
      if (.not. allocated(error) .and. options%is_plain() .and. options%certify) &
         call new_error(error, error_usage, "plain ARPACK is not certified: it does not know the zeros of rigid motions")
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
