!> ARPACK's reverse communication as steps of one object: dnaupd for real operators, znaupd for
!> complex ones, dsaupd for those that are self-adjoint in the inner product of their metric.
!>
!> All are run in shift-invert mode with sigma = 0, where ARPACK takes the operator C for the
!> inverse and so gives 1/mu of each eigenvalue mu of C, with vectors that it has purified of
!> what belongs to mu = 0.
module kschur_arpack_process
   use kschur_arpack_messages, only: arpack_error, info_nothing
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_kinds, only: wp
   use kschur_text, only: text
   implicit none
   private
   public :: arpack_process_type, check_extraction, keep_vectors

   !> What is wanted, in ARPACK's words: the eigenvalues of largest magnitude.
   character(len=*), parameter, public :: largest_magnitude = "LM"
   !> The value of `ido` when the iteration has ended.
   integer, parameter, public :: ido_done = 99
   !> Apply C to bring the start vector into its range; apply C; apply the metric.
   integer, parameter, public :: ido_start = -1, ido_apply = 1, ido_metric = 2
   integer, parameter :: mode_shift_invert = 3

   !> One iteration.
   type, abstract :: arpack_process_type
      !> The routine that iterates, for messages.
      character(len=6) :: routine = ""
      !> NEV, how many eigenvalues of largest magnitude are wanted; NCV, the dimension of the Krylov space.
      integer :: wanted = 0, columns = 0
      !> Length of ARPACK's vectors: the operator's, and more where it must be: C is zero there.
      integer :: length = 0
      real(wp) :: tolerance = 0
      !> What ARPACK wants next; `ido_done` at the end.
      integer :: ido = 0
      integer :: info = 0
      integer :: applications = 0
      integer :: iparam(11) = 0
      integer :: ipntr(14) = 0
   contains
      !> Order of the operator.
      procedure(order_interface), deferred :: order
      !> Allocates what an iteration needs, with a start vector, real random numbers.
      procedure(reserve_interface), deferred :: reserve
      !> Replaces the start vector by its image, of unit norm.
      procedure(filter_interface), deferred :: filter
      !> Calls ARPACK, and does what it wants.
      procedure(filter_interface), deferred :: step
      !> The magnitudes of the current Ritz values and their error bounds, as ARPACK has sorted them.
      procedure(ritz_interface), deferred :: ritz
      !> The eigenvalues mu that converged, and unit eigenvectors.
      procedure(extract_interface), deferred :: extract
      !> Prepares the iteration.
      procedure :: begin
      !> How many eigenvalues have converged.
      procedure :: converged
      !> The columns of the workspace that ARPACK wants to have read and written.
      procedure :: from
      procedure :: to
   end type arpack_process_type

   abstract interface
      integer function order_interface(self)
         import :: arpack_process_type
         class(arpack_process_type), intent(in) :: self
      end function order_interface

      subroutine reserve_interface(self, start, status)
         import :: arpack_process_type, wp
         class(arpack_process_type), intent(inout) :: self
         !> As long as the operator's vectors.
         real(wp), intent(in) :: start(:)
         !> Not 0 where there is no memory.
         integer, intent(out) :: status
      end subroutine reserve_interface

      subroutine filter_interface(self, error)
         import :: arpack_process_type, error_type
         class(arpack_process_type), intent(inout) :: self
         type(error_type), allocatable, intent(out) :: error
      end subroutine filter_interface

      pure subroutine ritz_interface(self, magnitudes, bounds)
         import :: arpack_process_type, wp
         class(arpack_process_type), intent(in) :: self
         real(wp), intent(out) :: magnitudes(:), bounds(:)
      end subroutine ritz_interface

      subroutine extract_interface(self, mu, vectors, error)
         import :: arpack_process_type, wp, error_type
         class(arpack_process_type), intent(inout) :: self
         complex(wp), allocatable, intent(out) :: mu(:), vectors(:, :)
         type(error_type), allocatable, intent(out) :: error
      end subroutine extract_interface
   end interface

contains

   !> `wanted`, `columns`, `length` and `tolerance` are set.
   subroutine begin(self, start, filter, restarts, error)
      class(arpack_process_type), intent(inout) :: self
      !> As long as the operator's vectors.
      real(wp), intent(in) :: start(:)
      !> How often the operator is applied to it first.
      integer, intent(in) :: filter
      !> The largest number of restarts.
      integer, intent(in) :: restarts
      type(error_type), allocatable, intent(out) :: error
      integer :: i, status

      call self%reserve(start, status)
      if (status /= 0) then
         call new_error(error, error_memory, "there is no memory for "//text(self%columns)// &
            " vectors of length "//text(self%length)//" for ARPACK")
         return
      end if
      do i = 1, filter
         call self%filter(error)
         if (allocated(error)) return
      end do
      self%applications = filter
      self%iparam = 0
      ! Exact shifts.
      self%iparam(1) = 1
      self%iparam(3) = restarts
      self%iparam(4) = 1
      self%iparam(7) = mode_shift_invert
      self%ipntr = 0
      self%ido = 0
      ! The start vector is given.
      self%info = 1
   end subroutine begin

   pure integer function converged(self)
      class(arpack_process_type), intent(in) :: self

      converged = self%iparam(5)
   end function converged

   pure integer function from(self)
      class(arpack_process_type), intent(in) :: self

      from = 1 + (self%ipntr(1) - 1)/self%length
   end function from

   pure integer function to(self)
      class(arpack_process_type), intent(in) :: self

      to = 1 + (self%ipntr(2) - 1)/self%length
   end function to

   !> Fails where a routine did; nothing converged is no failure.
   subroutine check_extraction(routine, info, converged, error)
      character(len=*), intent(in) :: routine
      integer, intent(in) :: info
      integer, intent(inout) :: converged
      type(error_type), allocatable, intent(out) :: error

      if (info == info_nothing) then
         converged = 0
      else if (info /= 0) then
         call arpack_error(routine, info, error)
      end if
   end subroutine check_extraction

   !> Keeps the first ones, with unit vectors; what lies in the added rows alone is no vector.
   subroutine keep_vectors(mu, vectors, found)
      complex(wp), allocatable, intent(inout) :: mu(:), vectors(:, :)
      integer, intent(in) :: found
      integer, allocatable :: kept(:)
      real(wp) :: length
      integer :: j

      allocate (kept(0))
      do j = 1, found
         length = norm2(abs(vectors(:, j)))
         if (.not. length > 0 .or. .not. abs(mu(j)) <= huge(1.0_wp)) cycle
         vectors(:, j) = vectors(:, j)/length
         kept = [kept, j]
      end do
      mu = mu(kept)
      vectors = vectors(:, kept)
   end subroutine keep_vectors
end module kschur_arpack_process
