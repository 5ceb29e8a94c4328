!> Penalties: diagonal entries that constrain an unknown, so large that they dominate the norm of their matrix.
module kschur_penalties
   use kschur_kinds, only: wp
   use kschur_sparse, only: csr_matrix_type
   use kschur_tolerances, only: penalty
   implicit none
   private
   public :: damping_penalties, norm_without, row_sizes, row_sizes_type, stiffness_penalties

   !> Magnitudes of the diagonal entries of a matrix, and sums of magnitudes over its rows.
   type :: row_sizes_type
      real(wp), allocatable :: diagonal(:), total(:)
   end type row_sizes_type

contains

   !> The rows of a square matrix.
   pure function row_sizes(matrix) result(sizes)
      type(csr_matrix_type), intent(in) :: matrix
      type(row_sizes_type) :: sizes
      integer :: i, k

      allocate (sizes%diagonal(matrix%rows), source=0.0_wp)
      allocate (sizes%total(matrix%rows))
      do i = 1, matrix%rows
         sizes%total(i) = sum(abs(matrix%value(matrix%row_start(i):matrix%row_start(i + 1) - 1)))
         k = matrix%place_of(i, i)
         if (k > 0) sizes%diagonal(i) = abs(matrix%value(k))
      end do
   end function row_sizes

   !> Marks rows of the stiffness with a penalty. Not if the mass of the row is as extraordinary: then the unknown only has other
   !> units.
   pure function stiffness_penalties(stiffness, mass) result(penalties)
      type(row_sizes_type), intent(in) :: stiffness, mass
      logical :: penalties(size(stiffness%total))

      penalties = find_penalties(stiffness, 0.0_wp)
      if (any(penalties)) penalties = penalties .and. .not. has_unit_of_its_own(mass)
   end function stiffness_penalties

   !> Marks rows of the damping with a penalty. A single dashpot is none: entries must also exceed the critical damping of the
   !> highest frequencies, sqrt(||K|| ||M||).
   pure function damping_penalties(damping, stiffness, mass) result(penalties)
      type(row_sizes_type), intent(in) :: damping, stiffness, mass
      logical :: penalties(size(damping%total))

      penalties = find_penalties(damping, sqrt(norm_without(stiffness, stiffness_penalties(stiffness, mass)))* &
         sqrt(maxval([0.0_wp, mass%total])))
      if (any(penalties)) penalties = penalties .and. .not. has_unit_of_its_own(mass)
   end function damping_penalties

   ! Marks unknowns whose mass is as far above the others as a penalty, or zero.
   pure function has_unit_of_its_own(mass) result(stands_out)
      type(row_sizes_type), intent(in) :: mass
      logical :: stands_out(size(mass%total))

      stands_out = find_penalties(mass, 0.0_wp) .or. .not. mass%diagonal > 0
   end function has_unit_of_its_own

   ! Marks rows of a square matrix with a diagonal entry far above all unmarked rows and its off-diagonal entries; none if that
   ! is most rows, or nothing can be compared.
   pure function find_penalties(sizes, level) result(penalties)
      type(row_sizes_type), intent(in) :: sizes
      !> Lower bound of the magnitude of other rows.
      real(wp), intent(in) :: level
      logical :: penalties(size(sizes%total))
      real(wp) :: off_diagonal(size(sizes%total)), rest
      logical, allocatable :: occupied(:)
      integer :: i

      associate (diagonal => sizes%diagonal)
         off_diagonal = max(sizes%total - diagonal, 0.0_wp)
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
      end associate
      if (2*count(penalties) > size(penalties)) penalties = .false.
   end function find_penalties

   !> Infinity norm of the rows that are not left out.
   pure real(wp) function norm_without(sizes, left_out) result(norm)
      type(row_sizes_type), intent(in) :: sizes
      logical, intent(in) :: left_out(:)

      norm = max(0.0_wp, maxval(sizes%total, .not. left_out))
   end function norm_without
end module kschur_penalties
