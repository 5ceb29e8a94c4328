!> Random matrices that fill no more than the matrices of a problem: added to a singular one they make it regular.
module kschur_random_pattern
   use kschur_kinds, only: wp, long
   use kschur_problem, only: modal_problem_type
   use kschur_random, only: random_vector
   use kschur_sparse, only: csr_matrix_type, identity_csr_matrix, linear_combination, transpose_csr
   implicit none
   private
   public :: random_on_pattern

contains

   !> A random matrix on the symmetrized pattern of M, R and K and the diagonal, entries of either sign between a half and one.
   function random_on_pattern(problem, seed) result(matrix)
      type(modal_problem_type), intent(in) :: problem
      integer, intent(in) :: seed
      type(csr_matrix_type) :: matrix
      integer(long) :: state

      matrix = linear_combination(spread(1.0_wp, 1, 3), [problem%mass, problem%damping, problem%stiffness])
      matrix = linear_combination(1.0_wp, matrix, 1.0_wp, transpose_csr(matrix))
      matrix = linear_combination(1.0_wp, matrix, 1.0_wp, identity_csr_matrix(matrix%rows))
      state = seed
      call random_vector(state, matrix%value)
      matrix%value = sign((1 + abs(matrix%value))/2, matrix%value)
   end function random_on_pattern
end module kschur_random_pattern
