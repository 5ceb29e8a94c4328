!> What may be wrong with pairs and modes that an iteration found is looked at again, one by one, and mended or dropped.
module kschur_mending
   use kschur_backward_error, only: backward_errors
   use kschur_copies, only: any_equal, separate_copies
   use kschur_context, only: solve_context_type
   use kschur_eigenpairs, only: append_pairs, chosen_pairs, eigenpairs_type, keep_pairs, normalize
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_linear_solver, only: complex_linear_solver_type
   use kschur_mode_selection, only: accept_pairs, drop_spurious, highest, replace_pairs, wanted_type
   use kschur_modes, only: modes_type
   use kschur_outcome, only: inaccurate_above
   use kschur_real_pairs, only: join_real_pairs
   use kschur_refine, only: confirm, refine
   use kschur_residual_parts, only: residual_parts
   use kschur_scaling, only: constraint_factors
   use kschur_settling, only: settle_pairs
   use kschur_tolerances, only: same_value
   implicit none
   private
   public :: add_pairs, drop_unfounded, mend, save_all, save_hidden

   ! Units that are further apart than this hide errors.
   real(wp), parameter :: uneven = 1.0e6_wp
   ! A mode with a backward error above this can be known better, most often.
   real(wp), parameter :: nearly_rounding = 1.0e-13_wp

contains

   !> Errors that uneven units would hide from the judge: what is refined is no longer wrong, the rest is dropped.
   subroutine save_hidden(s, pairs, error)
      type(solve_context_type), intent(inout) :: s
      !> Of what is iterated.
      type(eigenpairs_type), intent(inout) :: pairs
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: beyond_all = 10

      if (.not. s%plan%spread_of_units() > uneven) return
      call refine_pairs(s, inaccurate_above, abs(pairs%lambda) <= beyond_all*highest(s%work), pairs, error)
      if (.not. allocated(error)) call drop_spurious(s%work, pairs)
   end subroutine save_hidden

   !> The same of pairs each of which is an eigenpair, most likely, however badly it is known.
   subroutine save_all(s, pairs, error)
      type(solve_context_type), intent(inout) :: s
      !> Of what is iterated.
      type(eigenpairs_type), intent(inout) :: pairs
      type(error_type), allocatable, intent(out) :: error

      call refine_pairs(s, nearly_rounding, spread(.true., 1, size(pairs%lambda)), pairs, error)
      if (allocated(error)) return
      if (s%plan%spread_of_units() > uneven) call drop_spurious(s%work, pairs)
   end subroutine save_all

   subroutine refine_pairs(s, above, chosen, pairs, error)
      type(solve_context_type), intent(inout) :: s
      !> The backward error that is good enough.
      real(wp), intent(in) :: above
      !> Which of them are to have it.
      logical, intent(in) :: chosen(:)
      type(eigenpairs_type), intent(inout) :: pairs
      type(error_type), allocatable, intent(out) :: error
      class(complex_linear_solver_type), allocatable :: solver
      complex(wp), allocatable :: before(:)
      real(wp), allocatable :: errors(:)
      logical, allocatable :: paired(:)
      type(eigenpairs_type) :: more
      logical :: merged(size(pairs%lambda))

      allocate (errors, source=merge(backward_errors(s%work, pairs), 0.0_wp, chosen))
      if (.not. any(errors > above)) return
      allocate (solver, source=s%inner%complex)
      allocate (before, source=pairs%lambda)
      call refine(s%work, constraint_factors(s%work, s%options%constraint_scaling, s%shift), above, &
         solver, pairs, errors, s%effort, merged, more, error, s%monitor)
      if (allocated(error)) return
      call s%effort%add_solves(solver)
      ! It may have become one that is there.
      allocate (pairs%again(size(before)), source=abs(pairs%lambda - before) > same_value*abs(pairs%lambda))
      call keep_pairs(pairs, .not. merged)
      allocate (more%again(size(more%lambda)), source=.true.)
      paired = [pairs%paired, more%paired]
      call append_pairs(pairs, more)
      call move_alloc(paired, pairs%paired)
   end subroutine refine_pairs

   !> Polishes the modes, tells copies apart, and drops modes that remain inaccurate or may be anything, if they are not eigenvalues.
   subroutine mend(s, modes, error)
      type(solve_context_type), intent(inout) :: s
      type(modes_type), intent(inout) :: modes
      type(error_type), allocatable, intent(out) :: error

      call polish(s, modes, error)
      if (.not. allocated(error)) call join_pairs(s, modes, error)
      if (.not. allocated(error)) call separate(s, modes, error)
      if (.not. allocated(error)) call drop_unconfirmed(s, modes, error, inaccurate_above)
   end subroutine mend

   !> Drops modes whose error bounds let them be anything, if they are not eigenvalues after all. What is only known badly is
   !> polished before.
   subroutine drop_unfounded(s, modes, error, aside)
      type(solve_context_type), intent(inout) :: s
      type(modes_type), intent(inout) :: modes
      type(error_type), allocatable, intent(out) :: error
      !> Those that were dropped; not allocated: none.
      type(eigenpairs_type), optional, intent(out) :: aside

      if (any(may_be_anything(s, modes))) call polish(s, modes, error)
      if (.not. allocated(error)) call drop_unconfirmed(s, modes, error, aside=aside)
   end subroutine drop_unfounded

   subroutine drop_unconfirmed(s, modes, error, above, aside)
      type(solve_context_type), intent(inout) :: s
      type(modes_type), intent(inout) :: modes
      type(error_type), allocatable, intent(out) :: error
      !> Backward errors above this are doubtful, too.
      real(wp), optional, intent(in) :: above
      !> Those that were dropped; not allocated: none.
      type(eigenpairs_type), optional, intent(out) :: aside
      class(complex_linear_solver_type), allocatable :: solver
      logical, dimension(size(modes%lambda)) :: doubtful, confirmed

      doubtful = may_be_anything(s, modes, above)
      if (.not. any(doubtful)) return
      allocate (solver, source=s%inner%complex)
      call confirm(s%work, s%options%constraint_scaling, solver, s%contract(modes), doubtful, confirmed, s%effort, error, &
         s%monitor)
      if (allocated(error)) return
      call s%effort%add_solves(solver)
      if (present(aside) .and. .not. all(confirmed)) aside = chosen_pairs(modes, .not. confirmed)
      call modes%drop(.not. confirmed)
   end subroutine drop_unconfirmed

   ! Which modes have such bounds; rigid motions and their decays are known.
   function may_be_anything(s, modes, above) result(doubtful)
      type(solve_context_type), intent(in) :: s
      type(modes_type), intent(in) :: modes
      !> What has a backward error above this, too.
      real(wp), optional, intent(in) :: above
      logical :: doubtful(size(modes%lambda))
      real(wp), parameter :: anything = 1.0e-2_wp
      real(wp), dimension(size(modes%lambda)) :: errors, uncertainty

      call judge_evenly(s, modes, errors, uncertainty)
      doubtful = uncertainty > anything*abs(modes%lambda) .or. modes%error_bound > anything*abs(modes%lambda)
      doubtful = doubtful .and. .not. are_known(s, modes%lambda)
      if (present(above)) doubtful = doubtful .or. max(errors, modes%backward_error) > above
   end function may_be_anything

   ! Which eigenvalues are those of rigid motions.
   function are_known(s, lambda)
      type(solve_context_type), intent(in) :: s
      complex(wp), intent(in) :: lambda(:)
      logical :: are_known(size(lambda))
      complex(wp), allocatable :: known(:)
      integer :: i

      allocate (known, source=s%known%deflation%eigenvalues())
      are_known = .false.
      do i = 1, size(known)
         are_known = are_known .or. abs(lambda - known(i)) <= same_value*abs(known(i))
      end do
   end function are_known

   ! Backward errors, and how far eigenvalues may be off (1/s), in the units that balance has found: uneven ones make the
   ! former smaller than they are, the latter larger.
   subroutine judge_evenly(s, modes, errors, uncertainty)
      type(solve_context_type), intent(in) :: s
      type(modes_type), intent(in) :: modes
      real(wp), intent(out) :: errors(:), uncertainty(:)
      type(eigenpairs_type) :: pairs
      real(wp), allocatable :: of_pairs(:), bounds(:), off(:)
      integer :: j

      errors = modes%backward_error
      uncertainty = modes%uncertainty
      if (.not. s%plan%spread_of_units() > uneven) return
      pairs = s%contract(modes)
      do j = 1, size(pairs%lambda)
         call normalize(pairs, j)
      end do
      call settle_pairs(s%work, pairs, 0, of_pairs, bounds, off)
      errors = of_pairs
      uncertainty = off
   end subroutine judge_evenly

   ! Modes far from the shift are known less well than those near to it. Judged and refined in the units that
   ! balance has found: in those as given errors may hide behind a few large entries.
   subroutine polish(s, modes, error)
      type(solve_context_type), intent(inout) :: s
      type(modes_type), intent(inout) :: modes
      type(error_type), allocatable, intent(out) :: error
      class(complex_linear_solver_type), allocatable :: solver
      type(eigenpairs_type) :: pairs, more
      real(wp), allocatable :: errors(:), errors_before(:)
      logical, dimension(size(modes%lambda)) :: poor, merged
      real(wp) :: good_enough
      integer :: before

      good_enough = good_enough_of(s)
      if (all(modes%backward_error <= good_enough) .and. s%plan%spread_of_units() <= uneven) return
      pairs = s%contract(modes)
      allocate (errors, source=backward_errors(s%work, pairs))
      where (modes%backward_error > good_enough) errors = max(errors, modes%backward_error)
      ! Uneven units suit eigenvalues of one size only.
      if (s%plan%spread_of_units() > uneven) errors = max(errors, residual_parts(s%work, pairs, errors <= good_enough))
      poor = errors > good_enough
      if (.not. any(poor)) return
      before = s%effort%factorizations
      allocate (solver, source=s%inner%complex)
      allocate (errors_before, source=errors)
      allocate (pairs%paired(size(poor)), source=abs(aimag(modes%lambda)) > 0)
      call refine(s%work, constraint_factors(s%work, s%options%constraint_scaling, s%shift), good_enough, &
         solver, pairs, errors, s%effort, merged, more, error, s%monitor, &
         fixed=are_known(s, modes%lambda) .or. modes%is_real())
      if (allocated(error)) return
      call s%effort%add_solves(solver)
      if (s%effort%factorizations == before) return
      ! Neighbours of what is poor may have been polished with it.
      poor = poor .or. abs(errors - errors_before) > 0
      call keep_pairs(pairs, .not. merged)
      ! The pair that one is now one of is counted when it takes the place of the other.
      call modes%drop(merged)
      call s%expand(pairs, error)
      if (allocated(error)) return
      call replace_pairs(s%problem, s%options%modes, pack(poor, .not. merged), pairs, modes)
      ! Copies that are not known.
      if (size(more%lambda) == 0 .or. .not. s%known%total%exact .or. modes%found >= s%known%total%number) return
      call s%expand(more, error)
      if (allocated(error)) return
      call add_pairs(s, more, abs(s%shift), modes)
   end subroutine polish

   ! The backward error that is good enough.
   pure real(wp) function good_enough_of(s)
      type(solve_context_type), intent(in) :: s

      good_enough_of = max(nearly_rounding, s%options%tolerance/10)
   end function good_enough_of

   ! Two real eigenvalues that are a conjugate pair are joined.
   subroutine join_pairs(s, modes, error)
      type(solve_context_type), intent(inout) :: s
      type(modes_type), intent(inout) :: modes
      type(error_type), allocatable, intent(out) :: error
      class(complex_linear_solver_type), allocatable :: solver
      type(eigenpairs_type) :: pairs
      logical, dimension(size(modes%lambda)) :: joined, gone
      logical :: is_full
      integer :: found

      is_full = size(modes%lambda) == s%options%modes
      if (modes%is_real() .or. .not. any(modes%backward_error > good_enough_of(s))) return
      pairs = s%contract(modes)
      allocate (solver, source=s%inner%complex)
      call join_real_pairs(s%work, constraint_factors(s%work, s%options%constraint_scaling, s%shift), good_enough_of(s), &
         is_full, solver, pairs, backward_errors(s%work, pairs), joined, gone, s%effort, error, s%monitor)
      if (allocated(error)) return
      call s%effort%add_solves(solver)
      if (.not. any(joined)) return
      call s%expand(pairs, error)
      if (allocated(error)) return
      found = modes%found
      call replace_pairs(s%problem, s%options%modes, joined, pairs, modes, gone)
      ! What lay beyond the end of the list was found as well.
      modes%found = found
   end subroutine join_pairs

   ! From a shift far off copies of an eigenvalue look alike, though each has a shape of its own. Shapes that are held as real
   ! ones are orthogonal.
   subroutine separate(s, modes, error)
      type(solve_context_type), intent(inout) :: s
      type(modes_type), intent(inout) :: modes
      type(error_type), allocatable, intent(out) :: error
      class(complex_linear_solver_type), allocatable :: solver
      type(eigenpairs_type) :: pairs
      logical :: separated(size(modes%lambda))

      if (modes%is_real() .or. .not. any_equal(modes%lambda)) return
      pairs = s%contract(modes)
      allocate (solver, source=s%inner%complex)
      call separate_copies(s%work, constraint_factors(s%work, s%options%constraint_scaling, s%shift), good_enough_of(s), &
         solver, pairs, separated, s%effort, error, s%monitor)
      if (allocated(error)) return
      call s%effort%add_solves(solver)
      if (.not. any(separated)) return
      call s%expand(pairs, error)
      if (allocated(error)) return
      call replace_pairs(s%problem, s%options%modes, separated, pairs, modes, gone=spread(.false., 1, size(separated)))
   end subroutine separate

   !> Accepts more pairs beside the modes that there are.
   subroutine add_pairs(s, more, reference, modes)
      type(solve_context_type), intent(in) :: s
      type(eigenpairs_type), intent(in) :: more
      !> A size of lambda (1/s), against which zeros are seen.
      real(wp), intent(in) :: reference
      type(modes_type), intent(inout) :: modes
      type(eigenpairs_type) :: all
      logical, allocatable :: paired(:)
      integer :: k

      all = modes%eigenpairs_type
      all%weights = s%plan%weights()
      k = size(all%lambda)
      paired = [abs(aimag(all%lambda)) > 0, more%paired]
      call append_pairs(all, more)
      call move_alloc(paired, all%paired)
      all%again = spread(.true., 1, size(all%lambda))
      all%again(:k) = .false.
      call accept_pairs(s%problem, wanted_type(s%options%modes, s%options%target, s%known%total%number, &
         reference=reference), all, modes)
   end subroutine add_pairs
end module kschur_mending
