!> Penalties: diagonal entries that constrain an unknown, so large that they dominate the norm of their matrix.
module kschur_penalties
   use kschur_kinds, only: wp
   use kschur_sparse, only: csr_matrix_type
   use kschur_tolerances, only: penalty
   implicit none
   private
   public :: damping_penalties, norm_without, stiffness_penalties

contains

   !> Marks rows of the stiffness with a penalty. Not if the mass of the row is as extraordinary: then the unknown only has other
   !> units.
   pure function stiffness_penalties(stiffness, mass) result(penalties)
      type(csr_matrix_type), intent(in) :: stiffness, mass
      logical :: penalties(stiffness%rows)

      penalties = find_penalties(stiffness, 0.0_wp)
      if (any(penalties)) penalties = penalties .and. .not. has_unit_of_its_own(mass)
   end function stiffness_penalties

   !> Marks rows of the damping with a penalty. A single dashpot is none: entries must also exceed the critical damping of the
   !> highest frequencies, sqrt(||K|| ||M||).
   pure function damping_penalties(damping, stiffness, mass) result(penalties)
      type(csr_matrix_type), intent(in) :: damping, stiffness, mass
      logical :: penalties(damping%rows)

      penalties = find_penalties(damping, sqrt(norm_without(stiffness, stiffness_penalties(stiffness, mass)))* &
         sqrt(mass%infinity_norm()))
      if (any(penalties)) penalties = penalties .and. .not. has_unit_of_its_own(mass)
   end function damping_penalties

   ! Marks unknowns whose mass is as far above the others as a penalty, or zero.
   pure function has_unit_of_its_own(mass) result(stands_out)
      type(csr_matrix_type), intent(in) :: mass
      logical :: stands_out(mass%rows)

      stands_out = find_penalties(mass, 0.0_wp) .or. .not. abs(mass%diagonal()) > 0
   end function has_unit_of_its_own

   ! Marks rows of a square matrix with a diagonal entry far above all unmarked rows and its off-diagonal entries; none if that
   ! is most rows, or nothing can be compared.
   pure function find_penalties(matrix, level) result(penalties)
      type(csr_matrix_type), intent(in) :: matrix
      !> Lower bound of the magnitude of other rows.
      real(wp), intent(in) :: level
      logical :: penalties(matrix%rows)
      real(wp) :: diagonal(matrix%rows), off_diagonal(matrix%rows), rest
      logical, allocatable :: occupied(:)
      integer :: i

      penalties = .false.
      if (matrix%nonzeros() == 0) return
      diagonal = abs(matrix%diagonal())
      do i = 1, matrix%rows
         off_diagonal(i) = sum(abs(matrix%value(matrix%row_start(i):matrix%row_start(i + 1) - 1)))
      end do
      off_diagonal = max(off_diagonal - diagonal, 0.0_wp)
      penalties = diagonal > 0 .and. off_diagonal*penalty <= diagonal
      if (.not. any(penalties)) return
      rest = maxval(off_diagonal + diagonal, .not. penalties)
      if (all(penalties)) rest = minval(diagonal)
      rest = max(rest, level)
      if (.not. rest > 0) penalties = .false.
      ! First gap above the other rows, by powers of two.
      allocate (occupied(minexponent(rest) - digits(rest):maxexponent(rest)), source=.false.)
      do i = 1, size(penalties)
         if (penalties(i)) occupied(exponent(diagonal(i))) = .true.
      end do
      do i = exponent(rest), maxexponent(rest)
         if (scale(1.0_wp, i - exponent(rest)) > 2*penalty) exit
         if (occupied(i)) rest = scale(1.0_wp, i)
      end do
      penalties = penalties .and. diagonal > penalty*rest
      if (2*count(penalties) > size(penalties)) penalties = .false.
   end function find_penalties

   !> Infinity norm of the rows that are not left out.
   pure real(wp) function norm_without(matrix, left_out) result(norm)
      type(csr_matrix_type), intent(in) :: matrix
      logical, intent(in) :: left_out(:)
      integer :: i

      norm = 0
      do i = 1, matrix%rows
         if (.not. left_out(i)) &
            norm = max(norm, sum(abs(matrix%value(matrix%row_start(i):matrix%row_start(i + 1) - 1))))
      end do
   end function norm_without
end module kschur_penalties
