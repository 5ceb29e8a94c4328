!> Chooses the block size of an iteration: that of the options, or the one that reads the fewest words from memory by an estimate.
!>
!> The estimate does not use a clock, so that the same problem always gives the same digits: it counts entries of the factors and of
!> the basis; the effect of blocks on the cost of both was measured once (docs/performance.md).
module kschur_block_choice
   use kschur_context, only: solve_context_type
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: linear_solver_type
   use kschur_options, only: formulation_low_rank, formulation_proportional, formulation_quadratic, &
      formulation_symmetric
   implicit none
   private
   public :: cheapest_block, chosen_block

   ! Block sizes to choose from.
   integer, parameter :: blocks(4) = [1, 2, 4, 8]
   ! Factors and basis of fewer bytes stay in the second cache, where single vectors cost no more than blocks.
   integer(long), parameter :: cached = 2_long**21
   ! Least block size of an iteration that starts with known modes.
   integer, parameter :: least_with_modes = 2
   ! Average number of vectors in the basis beyond the wanted ones.
   integer, parameter :: extra_vectors = 10

contains

   !> The block size of an iteration on the current transform.
   integer function chosen_block(s, values) result(block)
      type(solve_context_type), target, intent(in) :: s
      !> Number of wanted eigenvalues.
      integer, intent(in) :: values
      class(linear_solver_type), pointer :: solver

      ! More vectors are linearly dependent.
      block = min(s%options%block, s%work%unknowns())
      ! Without restarts, the low-rank form needs many steps in a subspace of the options.
      if (s%dense .or. (block == 0 .and. s%formulation == formulation_low_rank .and. s%options%subspace > 0)) block = 1
      if (block > 0) return
      solver => s%transform%linear_solver()
      block = cheapest_block(solver%factor_entries, int(s%work%unknowns(), long)*(values + extra_vectors), values, &
         any(s%formulation == [formulation_symmetric, formulation_proportional, formulation_low_rank]))
      ! Beside the responses that leaves random vectors enough to prove double modes complete: a count costs more.
      if (block > 1 .and. s%formulation == formulation_low_rank) block = maxval(blocks)
      ! An iteration with several vectors finds copies, and needs no verification if all eigenvalues differ.
      if (allocated(s%last) .and. s%formulation == formulation_quadratic) block = max(block, least_with_modes)
   end function chosen_block

   !> The block size that reads the fewest words by an estimate; 1 if no block saves enough, or all fits into the cache.
   pure integer function cheapest_block(factor_entries, basis_entries, values, lanczos) result(block)
      !> Entries of the triangular factors; 0: not known.
      integer(long), intent(in) :: factor_entries
      !> Entries of the basis, on average over the iteration.
      integer(long), intent(in) :: basis_entries
      !> Number of wanted eigenvalues.
      integer, intent(in) :: values
      !> Whether the iteration is Lanczos, which reads the basis twice in a step. Krylov-Schur orthogonalises twice and forms both
      !> halves of the states: three readings, five for a single vector.
      logical, intent(in) :: lanczos
      ! Time of a sparse substitution relative to that of reading a dense block of the same size.
      integer, parameter :: substitution = 2
      ! A block replaces single vectors, the safest choice, if its estimated cost is below this fraction of theirs: where the
      ! estimate promised less, whole runs gained nothing.
      real(wp), parameter :: worthwhile = 0.7_wp
      ! Number of vectors until convergence: for each wanted value and always with single vectors, and more for each further
      ! column of a block.
      real(wp), parameter :: vectors_each = 2.5_wp, vectors_always = 30, vectors_column = 16
      real(wp) :: least, cost, b, vectors, solve, orthogonalise
      integer :: i, readings

      block = 1
      least = 0
      if (factor_entries == 0 .or. 8*(factor_entries + basis_entries) <= cached) return
      do i = 1, size(blocks)
         b = blocks(i)
         vectors = 1 + vectors_column*(b - 1)/(vectors_each*values + vectors_always)
         ! Measured: cost of one right-hand side of a block, and of one vector below, relative to a single one.
         solve = 2*substitution*real(factor_entries, wp)*(0.12_wp + 0.88_wp/b)
         readings = merge(2, merge(3, 5, blocks(i) == 1), lanczos)
         orthogonalise = readings*real(basis_entries, wp)*(0.45_wp + 0.55_wp/b)
         ! The basis grows with the vectors.
         cost = vectors*solve + vectors**2*orthogonalise
         if (i == 1) least = worthwhile*cost
         if (.not. cost < least) cycle
         least = cost
         block = blocks(i)
      end do
   end function cheapest_block
end module kschur_block_choice
