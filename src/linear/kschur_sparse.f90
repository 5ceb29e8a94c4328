!> Sparse matrices: what they are, how they are made and added.
module kschur_sparse
   use kschur_csr, only: complex_csr_matrix_type, csr_matrix_type, same_pattern
   use kschur_csr_assembly, only: empty_csr_matrix, identity_csr_matrix, new_csr_from_triplets, new_csr_matrix, &
      rows_of_csr, settle_csr_matrix, transpose_csr
   use kschur_csr_combination, only: complete_pattern, complex_combination, linear_combination, unite
   implicit none
   private
   public :: csr_matrix_type, complex_csr_matrix_type
   public :: new_csr_matrix, settle_csr_matrix, new_csr_from_triplets, empty_csr_matrix, identity_csr_matrix
   public :: complete_pattern, linear_combination, complex_combination, rows_of_csr, same_pattern, transpose_csr, unite
end module kschur_sparse
