!> Penalties: entries on a diagonal that hold an unknown, so large that they hide all others in the norm of their matrix.
module kschur_penalties
   use kschur_kinds, only: wp
   use kschur_sparse, only: csr_matrix_type
   use kschur_tolerances, only: penalty
   implicit none
   private
   public :: damping_penalties, norm_without, stiffness_penalties

contains

   !> Which rows of the stiffness are held by a penalty: those of a unit of their own have a mass that is as large.
   pure function stiffness_penalties(stiffness, mass) result(penalties)
      type(csr_matrix_type), intent(in) :: stiffness, mass
      logical :: penalties(stiffness%rows)

      penalties = stand_out(stiffness, 0.0_wp)
      if (any(penalties)) penalties = penalties .and. .not. has_unit_of_its_own(mass)
   end function stiffness_penalties

   !> Which rows of the damping are held by a penalty. A dashpot is none for being the only one: it is held against the damping
   !> that is critical at the highest frequencies, sqrt(||K|| ||M||), too.
   pure function damping_penalties(damping, stiffness, mass) result(penalties)
      type(csr_matrix_type), intent(in) :: damping, stiffness, mass
      logical :: penalties(damping%rows)

      penalties = stand_out(damping, sqrt(norm_without(stiffness, stiffness_penalties(stiffness, mass)))* &
         sqrt(mass%infinity_norm()))
      if (any(penalties)) penalties = penalties .and. .not. has_unit_of_its_own(mass)
   end function damping_penalties

   pure function has_unit_of_its_own(mass) result(stands_out)
      type(csr_matrix_type), intent(in) :: mass
      logical :: stands_out(mass%rows)

      stands_out = stand_out(mass, 0.0_wp) .or. .not. abs(mass%diagonal()) > 0
   end function has_unit_of_its_own

   ! Which rows of a square matrix have little beside a diagonal entry that is far above all rows without one; none where that
   ! is most rows, or there is nothing to compare with.
   pure function stand_out(matrix, level) result(penalties)
      type(csr_matrix_type), intent(in) :: matrix
      !> The rest is taken for as large as this at least.
      real(wp), intent(in) :: level
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
      rest = max(rest, level)
      if (.not. rest > 0) penalties = .false.
      ! The first gap above the rest, by powers of two.
      allocate (taken(minexponent(rest) - digits(rest):maxexponent(rest)), source=.false.)
      do i = 1, size(penalties)
         if (penalties(i)) taken(exponent(diagonal(i))) = .true.
      end do
      do i = exponent(rest), maxexponent(rest)
         if (scale(1.0_wp, i - exponent(rest)) > 2*penalty) exit
         if (taken(i)) rest = scale(1.0_wp, i)
      end do
      penalties = penalties .and. diagonal > penalty*rest
      if (2*count(penalties) > size(penalties)) penalties = .false.
   end function stand_out

   !> The infinity norm of the rows that are not left out.
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
