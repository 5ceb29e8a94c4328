!> Factors a formulation at a shift, and makes the transform that is iterated.
module kschur_factoring
   use kschur_context, only: solve_context_type
   use kschur_dense_transform, only: dense_transform_type, new_dense_transform
   use kschur_direct_complex, only: direct_complex_type
   use kschur_direct_solver, only: direct_real_type
   use kschur_effort, only: for_iteration
   use kschur_error, only: error_type, new_error, error_singular, error_usage
   use kschur_iterative_real, only: iterative_real_type
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: complex_linear_solver_type, real_linear_solver_type
   use kschur_low_rank_transform, only: low_rank_transform_type, new_low_rank_transform
   use kschur_options, only: formulation_low_rank, formulation_names, formulation_proportional, &
      formulation_quadratic, formulation_symmetric, inner_ldl
   use kschur_pencil_transform, only: pencil_transform_type, new_pencil_transform
   use kschur_placement, only: placement_type
   use kschur_quadratic_transform_complex, only: complex_quadratic_type => quadratic_transform_type, &
      new_complex_quadratic => new_quadratic_transform
   use kschur_quadratic_transform_real, only: real_quadratic_type => quadratic_transform_type, &
      new_real_quadratic => new_quadratic_transform
   use kschur_scaling, only: constraint_factors, first_scale
   use kschur_symmetric_transform, only: symmetric_transform_type, new_symmetric_transform
   use kschur_tolerances, only: rounding_of_row
   implicit none
   private
   public :: factor_at

contains

   !> Factors a formulation at a shift, without trying others; sets s%transform and s%shift. Fails with `error_singular` if the
   !> shift is an eigenvalue. For a dense solve the shift is made real, as it serves all eigenvalues, but not for the quadratic form
   !> with losses.
   subroutine factor_at(s, formulation, shift, error, factored)
      type(solve_context_type), target, intent(inout) :: s
      !> One of `formulation_*`.
      integer, intent(in) :: formulation
      complex(wp), intent(in) :: shift
      type(error_type), allocatable, intent(out) :: error
      !> Solver that has already factored the real matrix at this shift; absent: none.
      class(real_linear_solver_type), allocatable, optional, intent(inout) :: factored
      type(placement_type) :: placement

      call s%drop_transform()
      if (present(factored)) call move_alloc(factored, s%spare%real)
      s%shift = shift
      if (s%dense .and. .not. (s%is_lossy() .and. formulation == formulation_quadratic)) s%shift = abs(shift)
      ! Deflated eigenvalues do not show in the factors.
      if (.not. present(factored) .and. &
         any(abs(s%known%deflation%eigenvalues() - s%shift) <= rounding_of_row*abs(s%shift))) then
         call new_error(error, error_singular, "the shift is the eigenvalue of a rigid motion; move it a little")
         return
      end if
      placement%formulation = formulation
      placement%lambda = s%shift
      placement%factored = present(factored)
      placement%raw = s%options%is_plain()
      placement%mass_bound = s%known%mass_bound
      placement%motions = s%work%unknowns() - s%work%multipliers() + s%known%redundant - s%plan%redundant
      placement%factors = constraint_factors(s%work, s%options%constraint_scaling, s%shift)
      if (.not. placement%raw) &
         placement%unit = scale(1.0_wp, exponent(merge(max(abs(s%shift), first_scale(s%work)), s%reference(), abs(s%shift) > 0)))
      if (any(formulation == [formulation_symmetric, formulation_proportional, formulation_quadratic])) then
         call s%share_matrices(error)
         if (allocated(error)) return
         placement%matrices => s%matrices
      end if
      if (any(formulation == [formulation_symmetric, formulation_proportional])) then
         call factor_symmetric(s, placement, error)
      else if (formulation == formulation_low_rank) then
         call factor_low_rank(s, placement, error)
      else if (formulation == formulation_quadratic .and. .not. (abs(aimag(s%shift)) > 0 .or. s%is_lossy())) then
         call factor_real_quadratic(s, placement, error)
      else if (s%options%inner == inner_ldl .and. formulation /= formulation_quadratic) then
         call new_error(error, error_usage, "the inner solver ldl does not fit, take auto or mumps: the formulation "// &
            trim(formulation_names(formulation))//" factors a complex matrix here")
      else
         call factor_complex(s, placement, error)
      end if
      if (.not. allocated(s%transform)) return
      if (allocated(error)) then
         if (error%code /= error_singular) return
      end if
      if (.not. present(factored)) call s%effort%add_factors(s%transform%linear_solver(), for_iteration)
      if (s%dense .and. .not. allocated(error)) call make_dense(s)
   end subroutine factor_at

   ! Replaces the transform by a dense one, with the matrix of its operator on the motions that the constraints allow.
   subroutine make_dense(s)
      type(solve_context_type), intent(inout) :: s
      type(dense_transform_type), allocatable :: dense

      allocate (dense)
      call new_dense_transform(dense, s%transform)
      call move_alloc(dense, s%transform)
   end subroutine make_dense

   ! Factors an undamped or proportional form, with a solver for its eigenvalue count unless none is wanted.
   subroutine factor_symmetric(s, placement, error)
      type(solve_context_type), target, intent(inout) :: s
      type(placement_type), intent(in) :: placement
      type(error_type), allocatable, intent(out) :: error
      type(symmetric_transform_type), allocatable :: form
      class(real_linear_solver_type), allocatable :: solver, counting_solver

      allocate (form)
      call take_real(s, solver)
      if (allocated(s%inner%counting) .and. .not. (s%dense .or. s%options%uncounted)) &
         allocate (counting_solver, source=s%inner%counting)
      call new_symmetric_transform(form, s%work, s%known%deflation, placement, solver, error, counting_solver)
      call move_alloc(form, s%transform)
   end subroutine factor_symmetric

   ! Factors the low-rank form, with a solver for its eigenvalue count.
   subroutine factor_low_rank(s, placement, error)
      type(solve_context_type), target, intent(inout) :: s
      type(placement_type), intent(in) :: placement
      type(error_type), allocatable, intent(out) :: error
      type(low_rank_transform_type), allocatable :: form
      class(real_linear_solver_type), allocatable :: solver, counting_solver

      allocate (form)
      call take_real(s, solver)
      if (allocated(s%inner%counting)) allocate (counting_solver, source=s%inner%counting)
      call new_low_rank_transform(form, s%work, s%known%deflation, placement, solver, error, counting_solver)
      call move_alloc(form, s%transform)
   end subroutine factor_low_rank

   ! Factors the quadratic form at a real shift.
   subroutine factor_real_quadratic(s, placement, error)
      type(solve_context_type), target, intent(inout) :: s
      type(placement_type), intent(in) :: placement
      type(error_type), allocatable, intent(out) :: error
      type(real_quadratic_type), allocatable :: form
      class(real_linear_solver_type), allocatable :: solver

      allocate (form)
      call take_real(s, solver)
      call new_real_quadratic(form, s%work, s%known%deflation, placement, solver, error)
      call move_alloc(form, s%transform)
   end subroutine factor_real_quadratic

   ! Takes a solver for real matrices: a spare one, which may have analysed the pattern, or a new one. Frees a spare solver for
   ! complex matrices, which may still hold factors.
   subroutine take_real(s, solver)
      type(solve_context_type), target, intent(inout) :: s
      class(real_linear_solver_type), allocatable, intent(out) :: solver

      if (allocated(s%spare%complex)) deallocate (s%spare%complex)
      call move_alloc(s%spare%real, solver)
      if (.not. allocated(solver)) allocate (solver, source=s%inner%real)
      solver%monitor => s%inner%real%monitor
      select type (solver)
      type is (direct_real_type)
         solver%last => s%last_analysis
      type is (iterative_real_type)
         solver%factors%last => s%last_analysis
      end select
   end subroutine take_real

   ! Takes a solver for complex matrices, a spare one or a new one. Frees a spare solver for real matrices and the memory kept for
   ! its factors.
   subroutine take_complex(s, solver)
      type(solve_context_type), target, intent(inout) :: s
      class(complex_linear_solver_type), allocatable, intent(out) :: solver

      if (allocated(s%spare%real)) deallocate (s%spare%real)
      call s%last_analysis%drop_room()
      call move_alloc(s%spare%complex, solver)
      if (.not. allocated(solver)) allocate (solver, source=s%inner%complex)
      solver%monitor => s%inner%complex%monitor
      select type (solver)
      type is (direct_complex_type)
         solver%last => s%last_analysis
         if (s%options%inner == inner_ldl) solver%inner = inner_ldl
      end select
   end subroutine take_complex

   ! Factors the quadratic form at a complex shift or with losses, or a pencil.
   subroutine factor_complex(s, placement, error)
      type(solve_context_type), target, intent(inout) :: s
      type(placement_type), intent(in) :: placement
      type(error_type), allocatable, intent(out) :: error
      type(complex_quadratic_type), allocatable :: quadratic
      type(pencil_transform_type), allocatable :: pencil
      class(complex_linear_solver_type), allocatable :: solver

      call take_complex(s, solver)
      if (placement%formulation == formulation_quadratic) then
         allocate (quadratic)
         call new_complex_quadratic(quadratic, s%work, s%known%deflation, placement, solver, error)
         call move_alloc(quadratic, s%transform)
      else
         allocate (pencil)
         call new_pencil_transform(pencil, s%work, s%known%deflation, placement, solver, error)
         ! Without an operator nothing was factored.
         if (allocated(pencil%operator)) call move_alloc(pencil, s%transform)
      end if
   end subroutine factor_complex
end module kschur_factoring
