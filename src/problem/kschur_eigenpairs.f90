!> Eigenpairs on their way from the iteration to the modes.
module kschur_eigenpairs
   use kschur_kinds, only: wp
   implicit none
   private
   public :: append_pairs, eigenpairs_type

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

   ! The marks of n pairs; not allocated: of none.
   pure function marks(n, given)
      integer, intent(in) :: n
      logical, optional, intent(in) :: given(:)
      logical :: marks(n)

      marks = .false.
      if (present(given)) marks = given
   end function marks
end module kschur_eigenpairs
