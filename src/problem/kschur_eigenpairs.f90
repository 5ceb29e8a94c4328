!> Eigenpairs on their way from the iteration to the modes.
module kschur_eigenpairs
   use kschur_kinds, only: wp
   use kschur_lapack, only: dznrm2
   implicit none
   private
   public :: append_pairs, chosen_pairs, eigenpairs_type, near, normalize

   !> Eigenpairs of a modal problem.
   type :: eigenpairs_type
      !> Eigenvalues (1/s).
      complex(wp), allocatable :: lambda(:)
      !> Shapes, n x k.
      complex(wp), allocatable :: phi(:, :)
      !> Multipliers, m x k.
      complex(wp), allocatable :: xi(:, :)
      !> Whether it is known that the conjugate of a pair is another one. Not allocated: of none.
      logical, allocatable :: paired(:)
      !> Whether a pair was looked for where it may be known already. Not allocated: none.
      logical, allocatable :: again(:)
      !> Of each unknown, where shapes are compared: in units far apart all would look alike. Not allocated: one.
      real(wp), allocatable :: weights(:)
   end type eigenpairs_type

contains

   !> Puts more pairs of the same problem behind those there are.
   subroutine append_pairs(pairs, more)
      type(eigenpairs_type), intent(inout) :: pairs
      type(eigenpairs_type), intent(in) :: more

      if (size(more%lambda) == 0) return
      pairs%phi = reshape([pairs%phi, more%phi], [size(more%phi, 1), size(pairs%lambda) + size(more%lambda)])
      pairs%xi = reshape([pairs%xi, more%xi], [size(more%xi, 1), size(pairs%lambda) + size(more%lambda)])
      if (allocated(pairs%paired)) pairs%paired = [pairs%paired, spread(.false., 1, size(more%lambda))]
      if (allocated(pairs%again) .or. allocated(more%again)) &
         pairs%again = [marks(size(pairs%lambda), pairs%again), marks(size(more%lambda), more%again)]
      pairs%lambda = [pairs%lambda, more%lambda]
   end subroutine append_pairs

   !> Some of a list, without what is not known of them.
   function chosen_pairs(pairs, chosen) result(kept)
      class(eigenpairs_type), intent(in) :: pairs
      logical, intent(in) :: chosen(:)
      type(eigenpairs_type) :: kept
      integer :: i

      associate (order => pack([(i, i=1, size(chosen))], chosen))
         allocate (kept%lambda, source=pairs%lambda(order))
         allocate (kept%phi, source=pairs%phi(:, order))
         allocate (kept%xi, source=pairs%xi(:, order))
      end associate
   end function chosen_pairs

   !> A shape of unit norm, its largest entry real and positive; a shape of nothing stays.
   subroutine normalize(phi, xi)
      complex(wp), contiguous, intent(inout) :: phi(:), xi(:)
      complex(wp) :: factor
      integer :: largest

      largest = maxloc(real(phi, wp)**2 + aimag(phi)**2, 1)
      if (.not. abs(phi(largest)) > 0) return
      factor = conjg(phi(largest))/abs(phi(largest))/dznrm2(size(phi), phi, 1)
      phi = factor*phi
      xi = factor*xi
   end subroutine normalize

   !> Which of some eigenvalues lie within a distance of one of them, relative to it.
   pure function near(lambda, j, distance)
      complex(wp), intent(in) :: lambda(:)
      integer, intent(in) :: j
      real(wp), intent(in) :: distance
      logical :: near(size(lambda))

      near = abs(lambda - lambda(j)) <= distance*abs(lambda(j))
   end function near

   ! The marks of n pairs; not allocated: of none.
   pure function marks(n, given)
      integer, intent(in) :: n
      logical, optional, intent(in) :: given(:)
      logical :: marks(n)

      marks = .false.
      if (present(given)) marks = given
   end function marks
end module kschur_eigenpairs
