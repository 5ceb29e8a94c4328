!> Chooses between the low-rank form, where it fits, and the quadratic form, by an estimate of the words that each reads from
!> memory. As in the choice of blocks, no clock is used.
module kschur_low_rank_choice
   use kschur_context, only: solve_context_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp, long
   use kschur_local_forces, only: local_forces_type, new_local_forces
   use kschur_options, only: formulation_auto, formulation_low_rank, formulation_quadratic, inner_iterative, &
      method_krylov_schur
   use kschur_text, only: text
   implicit none
   private
   public :: leave_low_rank, low_rank_is_cheaper, settle_low_rank, weigh_low_rank

contains

   !> Replaces an automatically chosen low-rank form by the quadratic one if the method or the subspace option excludes it, or if no
   !> solver is sure to compute the inertias for its eigenvalue count.
   subroutine settle_low_rank(s)
      type(solve_context_type), intent(inout) :: s

      if (s%options%formulation /= formulation_auto .or. s%formulation /= formulation_low_rank) return
      if (s%options%method /= method_krylov_schur .or. s%options%subspace > 0 .or. s%options%inner == inner_iterative .or. &
         .not. allocated(s%inner%counting)) &
         call leave_low_rank(s, trim(merge("damping and losses are", "the damping is        ", s%is_lossy()))// &
         " not a combination of mass and stiffness")
   end subroutine settle_low_rank

   !> Replaces an automatically chosen low-rank form by the quadratic one if it would cost more. Called after the examination.
   subroutine weigh_low_rank(s, error)
      type(solve_context_type), intent(inout) :: s
      type(error_type), allocatable, intent(out) :: error
      type(local_forces_type) :: forces
      integer(long) :: entries
      logical :: are_few

      if (s%options%formulation /= formulation_auto .or. s%formulation /= formulation_low_rank .or. s%only_rigid()) return
      call new_local_forces(s%work, forces, are_few, error)
      if (allocated(error)) return
      entries = size(s%work%stiffness%value, kind=long)
      if (allocated(s%known%stiffness)) entries = max(entries, s%known%stiffness%solver%factor_entries)
      if (.not. low_rank_is_cheaper(s%work%unknowns(), entries, s%options%modes - size(s%known%rigid%lambda), forces%rank(), &
         s%is_lossy())) call leave_low_rank(s, trim(merge("damping and losses have", "the damping has        ", s%is_lossy()))// &
         " a part of rank "//text(forces%rank())//" that is no combination of mass and stiffness: too much for so few modes")
   end subroutine weigh_low_rank

   !> Whether the low-rank form reads fewer words than the quadratic one. The numbers of vectors that both take, on grids, and the
   !> time of projected eigenproblems were measured (docs/performance.md).
   pure logical function low_rank_is_cheaper(unknowns, factor_entries, modes, rank, lossy) result(cheaper)
      integer, intent(in) :: unknowns
      !> Entries of the triangular factors.
      integer(long), intent(in) :: factor_entries
      !> Number of modes to be computed; rank of the local forces.
      integer, intent(in) :: modes, rank
      !> Whether there is a loss matrix H: the quadratic form then has complex factors and vectors, and both forms have a complex
      !> projected problem.
      logical, intent(in) :: lossy
      ! Vectors for each mode. Each step of the low-rank process adds a vector for each force and one more, and its steps grow with
      ! the square root of the number of modes; the quadratic form adds one vector a step and needs two values for each pair.
      ! With losses it has the eigenvalues below the axis in its space besides.
      real(wp), parameter :: vectors_low_rank = 1.6_wp, vectors_quadratic = 3.6_wp, vectors_lossy = 5.0_wp
      real(wp) :: m

      m = max(modes, 1)
      cheaper = words(vectors_low_rank*(m + rank*sqrt(m)), rank + 1, readings=2, order=2, reals=1) < &
         words(merge(vectors_lossy, vectors_quadratic, lossy)*m, 1, readings=3, order=1, reals=merge(2, 1, lossy))

   contains

      ! Words read by an iteration: solves in blocks; orthogonalisation of each vector in `readings` passes over the basis, which
      ! has half of all vectors on average; projected problem of `order` times as many rows as there are vectors. Numbers of factors
      ! and vectors take `reals` words.
      pure real(wp) function words(vectors, block, readings, order, reals)
         real(wp), intent(in) :: vectors
         integer, intent(in) :: block, readings, order, reals
         ! As in the choice of blocks: time of a sparse substitution relative to that of reading a dense block of the same size;
         ! cost of one right-hand side and one vector of a block relative to single ones, 0.15 + 0.85/b and 0.45 + 0.55/b.
         integer, parameter :: substitution = 2
         ! Words read in the time of a Schur form, relative to the cube of its order, real and complex.
         real(wp), parameter :: of_cube(2) = [1.5_wp, 4.0_wp]

         words = reals*(vectors*2*substitution*real(factor_entries, wp)*(0.15_wp + 0.85_wp/block) + &
            vectors**2/2*readings*real(unknowns, wp)*(0.45_wp + 0.55_wp/block)) + &
            of_cube(merge(2, 1, lossy))*(order*vectors)**3
      end function words
   end function low_rank_is_cheaper

   !> Replaces the low-rank form by the quadratic one.
   subroutine leave_low_rank(s, reason)
      type(solve_context_type), intent(inout) :: s
      !> Why, for the result.
      character(len=*), intent(in) :: reason

      s%formulation = formulation_quadratic
      s%decision = reason
   end subroutine leave_low_rank
end module kschur_low_rank_choice
