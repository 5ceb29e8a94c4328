!> Whether the low-rank form, where it fits, is cheaper than the quadratic one: by counts of words that are read, and no
!> clock, as in the choice of blocks.
module kschur_low_rank_choice
   use kschur_context, only: solve_context_type
   use kschur_error, only: error_type
   use kschur_kinds, only: wp, long
   use kschur_local_forces, only: local_forces_type, new_local_forces
   use kschur_options, only: formulation_auto, formulation_low_rank, formulation_quadratic, method_krylov_schur
   use kschur_text, only: text
   implicit none
   private
   public :: leave_low_rank, low_rank_is_cheaper, settle_low_rank, weigh_low_rank

contains

   !> Takes the low-rank form back where `formulation_auto` chose it and what was asked for does not go with it, or where it
   !> could not be completed by a count.
   subroutine settle_low_rank(s)
      type(solve_context_type), intent(inout) :: s

      if (s%options%formulation /= formulation_auto .or. s%formulation /= formulation_low_rank) return
      if (s%options%method /= method_krylov_schur .or. s%options%subspace > 0 .or. .not. allocated(s%inner%counting)) &
         call leave_low_rank(s, "the damping is not a combination of mass and stiffness")
   end subroutine settle_low_rank

   !> The same where it would cost more; the problem has been examined.
   subroutine weigh_low_rank(s, error)
      type(solve_context_type), intent(inout) :: s
      type(error_type), allocatable, intent(out) :: error
      type(local_forces_type) :: forces
      integer(long) :: entries
      logical :: few

      if (s%options%formulation /= formulation_auto .or. s%formulation /= formulation_low_rank .or. s%only_rigid()) return
      call new_local_forces(s%work, forces, few, error)
      if (allocated(error)) return
      entries = size(s%work%stiffness%value, kind=long)
      if (allocated(s%known%stiffness)) entries = max(entries, s%known%stiffness%solver%factor_entries)
      if (.not. low_rank_is_cheaper(s%work%unknowns(), entries, s%options%modes - size(s%known%rigid%lambda), forces%rank())) &
         call leave_low_rank(s, "the damping has a part of rank "//text(forces%rank())// &
         " that is no combination of mass and stiffness: too much for so few modes")
   end subroutine weigh_low_rank

   !> Whether it reads fewer words. The vectors that both forms took on grids, and how long an eigenproblem of the projected
   !> order takes, were measured (docs/performance.md).
   pure logical function low_rank_is_cheaper(unknowns, factor_entries, modes, rank) result(cheaper)
      integer, intent(in) :: unknowns
      !> Of the triangular factors.
      integer(long), intent(in) :: factor_entries
      !> That are to be found; rank of the local forces.
      integer, intent(in) :: modes, rank
      ! A step of its process adds a vector for each force and one more, and the steps grow with the square root of the modes;
      ! a single vector finds the others, of a pair two.
      real(wp), parameter :: of_low_rank = 1.6_wp, of_quadratic = 3.6_wp
      real(wp) :: m

      m = max(modes, 1)
      cheaper = words(of_low_rank*(m + rank*sqrt(m)), rank + 1, readings=2, order=2) < &
         words(of_quadratic*m, 1, readings=3, order=1)

   contains

      ! What so many vectors read, in blocks, with solves, a basis of half as many on the average, each vector against it in so
      ! many readings, and the projected problem, of so many times their number.
      pure real(wp) function words(vectors, block, readings, order)
         real(wp), intent(in) :: vectors
         integer, intent(in) :: block, readings, order
         ! As in the choice of blocks: a sparse substitution needs the time of so many reads of a dense block, and of what one
         ! right-hand side and one vector cost these parts are left where they are one of a block.
         integer, parameter :: sparse = 2
         ! Words that are read in the time of a Schur form, for the cube of its order.
         real(wp), parameter :: of_cube = 1.5_wp

         words = vectors*2*sparse*real(factor_entries, wp)*(0.15_wp + 0.85_wp/block) + &
            vectors**2/2*readings*real(unknowns, wp)*(0.45_wp + 0.55_wp/block) + of_cube*(order*vectors)**3
      end function words
   end function low_rank_is_cheaper

   !> Takes the quadratic form instead.
   subroutine leave_low_rank(s, reason)
      type(solve_context_type), intent(inout) :: s
      character(len=*), intent(in) :: reason

      s%formulation = formulation_quadratic
      s%decision = reason
   end subroutine leave_low_rank
end module kschur_low_rank_choice
