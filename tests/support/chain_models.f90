!> A chain of unequal masses and springs of any length, with what makes problems
!> different from each other: for tests that compare ways to solve them.
module chain_models
   use kschur, only: csr_matrix_type, empty_csr_matrix, error_type, modal_problem_type, new_csr_from_triplets, &
      new_modal_problem, wp
   implicit none
   private
   public :: chain_model

   !> Features, to be added: dashpots, damping proportional to K and M, a force that follows the
   !> motion, constraints that no presolve eliminates, no wall, a consistent mass.
   integer, parameter, public :: damped = 1, proportional = 2, follower = 4, constrained = 8, free = 16, consistent = 32

contains

   function chain_model(masses, features) result(problem)
      integer, intent(in) :: masses, features
      type(modal_problem_type) :: problem
      type(csr_matrix_type) :: mass, damping, stiffness, constraints
      type(error_type), allocatable :: error
      integer :: from(masses - 1), to(masses - 1), all(masses), i, n
      real(wp) :: spring(masses - 1), body(masses)

      n = masses
      all = [(i, i=1, n)]
      from = all(:n - 1)
      to = all(2:)
      spring = 100*(1 + 0.3_wp*mod(3*from, 4))
      body = 1 + 0.1_wp*mod(7*all, 5)
      call bars(mass, from, to, spread(merge(0.2_wp, 0.0_wp, has(consistent)), 1, n - 1), all, body)
      call bars(stiffness, from, to, -spring, [1], [merge(0.0_wp, 100.0_wp, has(free))])
      if (has(follower)) call add(stiffness, [6, 6], [2, 3], [30.0_wp, -30.0_wp])
      damping = empty_csr_matrix(n, n)
      if (has(proportional)) then
         call add(damping, [stiffness%row_indices(), mass%row_indices()], [stiffness%column, mass%column], &
            [0.002_wp*stiffness%value, 0.1_wp*mass%value])
      else if (has(damped)) then
         call bars(damping, [1, 3, n - 4], [5, 7, n], [-2.0_wp, -3.0_wp, -5.0_wp], [1], [0.0_wp])
      end if
      constraints = empty_csr_matrix(0, n)
      ! Each a sum of four displacements that is zero for a motion of all as one.
      if (has(constrained)) call new_csr_from_triplets(constraints, 2, n, [1, 1, 1, 1, 2, 2, 2, 2], &
         [2, 4, 8, 9, 5, 7, n - 2, n - 1], [1.0_wp, 1.0_wp, -1.0_wp, -1.0_wp, 2.0_wp, 1.0_wp, -1.0_wp, -2.0_wp], error)
      call new_modal_problem(problem, mass, stiffness, error, damping, constraints)

   contains

      logical function has(feature)
         integer, intent(in) :: feature

         has = iand(features, feature) > 0
      end function has

      ! Couplings of a and b, balanced on the diagonal, and what is on the diagonal besides.
      subroutine bars(matrix, a, b, coupling, places, diagonal)
         type(csr_matrix_type), intent(out) :: matrix
         integer, intent(in) :: a(:), b(:), places(:)
         real(wp), intent(in) :: coupling(:), diagonal(:)

         call new_csr_from_triplets(matrix, n, n, [a, b, a, b, places], [b, a, a, b, places], &
            [coupling, coupling, abs(coupling), abs(coupling), diagonal], error)
      end subroutine bars

      subroutine add(matrix, row, column, value)
         type(csr_matrix_type), intent(inout) :: matrix
         integer, intent(in) :: row(:), column(:)
         real(wp), intent(in) :: value(:)
         type(csr_matrix_type) :: sum

         call new_csr_from_triplets(sum, n, n, [matrix%row_indices(), row], [matrix%column, column], &
            [matrix%value, value], error)
         matrix = sum
      end subroutine add
   end function chain_model
end module chain_models
