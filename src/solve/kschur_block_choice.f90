!> How many vectors an iteration takes at a time: what was asked for, or what costs least by counts of words that are read.
!>
!> No clock is asked, so that the same problem has the same digits each time: the entries of the factors and of the
!> basis are counted, and what blocks do to both was measured once (docs/performance.md).
module kschur_block_choice
   use kschur_context, only: solve_context_type
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: linear_solver_type
   use kschur_options, only: formulation_low_rank, formulation_proportional, formulation_quadratic, &
      formulation_symmetric
   implicit none
   private
   public :: cheapest_block, chosen_block

   integer, parameter :: blocks(4) = [1, 2, 4, 8]
   ! Factors and basis of fewer bytes stay in the cache, where single vectors cost no more than blocks.
   integer(long), parameter :: cached = 2_long**23
   ! Of an iteration that begins with modes.
   integer, parameter :: with_modes = 2
   ! The basis has so many vectors more than are wanted, on the average.
   integer, parameter :: beyond = 10

contains

   !> For an iteration on the transform that is factored.
   integer function chosen_block(s, values) result(block)
      type(solve_context_type), target, intent(in) :: s
      !> Eigenvalues that are wanted.
      integer, intent(in) :: values
      class(linear_solver_type), pointer :: solver

      ! More are never independent.
      block = min(s%options%block, s%work%unknowns())
      ! The responses to dampers are the blocks of the low-rank form.
      if (s%formulation == formulation_low_rank .or. s%dense) block = 1
      if (block > 0) return
      solver => s%transform%linear_solver()
      block = cheapest_block(solver%factor_entries, int(s%work%unknowns(), long)*(values + beyond), values, &
         any(s%formulation == [formulation_symmetric, formulation_proportional]))
      ! Several vectors need no verification where all eigenvalues differ.
      if (allocated(s%last) .and. s%formulation == formulation_quadratic) block = max(block, with_modes)
   end function chosen_block

   !> The same from counts.
   pure integer function cheapest_block(factor_entries, basis_entries, values, lanczos) result(block)
      !> Of the triangular factors; 0: not known.
      integer(long), intent(in) :: factor_entries
      !> Of the basis on the average.
      integer(long), intent(in) :: basis_entries
      !> Eigenvalues that are wanted.
      integer, intent(in) :: values
      !> Whether a few vectors are orthogonalised against all, once; otherwise twice, and both parts of a state are formed: of a
      !> single vector in three readings.
      logical, intent(in) :: lanczos
      ! A sparse substitution needs the time of so many reads of a dense block.
      integer, parameter :: sparse = 2
      ! Single vectors, which are the safest, are left where a block costs less than this part of them: whole runs gained nothing
      ! where the counts promised less.
      real(wp), parameter :: worth = 0.7_wp
      ! So many vectors it takes one by one, and so many more for each further column of a block.
      real(wp), parameter :: vectors_each = 2.5_wp, vectors_always = 30, vectors_column = 16
      real(wp) :: least, cost, b, vectors, solve, orthogonalise
      integer :: i, readings

      block = 1
      least = 0
      if (factor_entries == 0 .or. 8*(factor_entries + basis_entries) <= cached) return
      do i = 1, size(blocks)
         b = blocks(i)
         vectors = 1 + vectors_column*(b - 1)/(vectors_each*values + vectors_always)
         ! Of what one right-hand side and one vector cost, these parts are left where they are one of a block.
         solve = 2*sparse*real(factor_entries, wp)*(0.12_wp + 0.88_wp/b)
         readings = merge(2, merge(3, 5, blocks(i) == 1), lanczos)
         orthogonalise = readings*real(basis_entries, wp)*(0.45_wp + 0.55_wp/b)
         ! The basis grows with the vectors.
         cost = vectors*solve + vectors**2*orthogonalise
         if (i == 1) least = worth*cost
         if (.not. cost < least) cycle
         least = cost
         block = blocks(i)
      end do
   end function cheapest_block
end module kschur_block_choice
