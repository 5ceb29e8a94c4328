!> Penalties: entries on a diagonal that hold an unknown, so large that they hide all others in the norm of their matrix.
module kschur_penalties
   use kschur_kinds, only: wp
   use kschur_sparse, only: csr_matrix_type
   use kschur_tolerances, only: penalty
   implicit none
   private
   public :: are_penalties, norm_of_rest

contains

   !> Which rows of damping or stiffness are held by a penalty: those of a unit of their own have a mass that is as large.
   pure function are_penalties(matrix, mass) result(penalties)
      type(csr_matrix_type), intent(in) :: matrix, mass
      logical :: penalties(matrix%rows)

      penalties = stand_out(matrix)
      if (any(penalties)) penalties = penalties .and. abs(mass%diagonal()) > 0 .and. .not. stand_out(mass)
   end function are_penalties

   ! Which rows of a square matrix have little beside a diagonal entry that is far above all rows without one; none where that
   ! is most rows.
   pure function stand_out(matrix) result(penalties)
      type(csr_matrix_type), intent(in) :: matrix
      logical :: penalties(matrix%rows)
      real(wp) :: diagonal(matrix%rows), beside(matrix%rows), rest
      logical, allocatable :: taken(:)
      integer :: i

      penalties = .false.
      if (matrix%nonzeros() == 0) return
      diagonal = abs(matrix%diagonal())
      do i = 1, matrix%rows
         beside(i) = sum(abs(matrix%value(matrix%row_start(i):matrix%row_start(i + 1) - 1)))
      end do
      beside = max(beside - diagonal, 0.0_wp)
      penalties = diagonal > 0 .and. beside*penalty <= diagonal
      if (.not. any(penalties)) return
      rest = maxval(beside + diagonal, .not. penalties)
      if (all(penalties)) rest = minval(diagonal)
      ! One dashpot alone is none.
      if (.not. rest > 0) penalties = .false.
      ! The first gap above the rest, by powers of two.
      allocate (taken(minexponent(rest) - digits(rest):maxexponent(rest)), source=.false.)
      do i = 1, size(penalties)
         if (penalties(i)) taken(exponent(diagonal(i))) = .true.
      end do
      rest = max(rest, tiny(rest))
      do i = exponent(rest), maxexponent(rest)
         if (scale(1.0_wp, i - exponent(rest)) > 2*penalty) exit
         if (taken(i)) rest = scale(1.0_wp, i)
      end do
      penalties = penalties .and. diagonal > penalty*rest
      if (2*count(penalties) > size(penalties)) penalties = .false.
   end function stand_out

   !> The infinity norm of the other rows.
   pure real(wp) function norm_of_rest(matrix, mass) result(norm)
      type(csr_matrix_type), intent(in) :: matrix, mass
      logical :: penalties(matrix%rows)
      integer :: i

      penalties = are_penalties(matrix, mass)
      norm = 0
      do i = 1, matrix%rows
         if (.not. penalties(i)) &
            norm = max(norm, sum(abs(matrix%value(matrix%row_start(i):matrix%row_start(i + 1) - 1))))
      end do
   end function norm_of_rest
end module kschur_penalties
