!> ARPACK's reverse communication as steps of an object: dnaupd for real operators, znaupd for complex ones, dsaupd for those
!> self-adjoint in the inner product of their metric.
!>
!> All use shift-invert mode with sigma = 0: ARPACK takes the operator C as the inverse and returns 1/mu for each eigenvalue mu
!> of C, with vectors purified of the null space of C.
module kschur_arpack_process
   use kschur_arpack_messages, only: arpack_error, info_nothing
   use kschur_error, only: error_type, new_error, error_memory
   use kschur_kinds, only: wp
   use kschur_text, only: text
   implicit none
   private
   public :: arpack_process_type, check_extraction, keep_vectors

   !> WHICH: eigenvalues of largest magnitude.
   character(len=*), parameter, public :: largest_magnitude = "LM"
   !> IDO at the end of the iteration.
   integer, parameter, public :: ido_done = 99
   !> IDO: apply C to the start vector; apply C; apply the metric.
   integer, parameter, public :: ido_start = -1, ido_apply = 1, ido_metric = 2
   integer, parameter :: mode_shift_invert = 3

   !> One iteration.
   type, abstract :: arpack_process_type
      !> Name of the iterating routine, for messages.
      character(len=6) :: routine = ""
      !> NEV, the number of wanted eigenvalues; NCV, the dimension of the Krylov space.
      integer :: wanted = 0, columns = 0
      !> N of ARPACK: order of the operator, padded with zero rows if needed.
      integer :: length = 0
      real(wp) :: tolerance = 0
      !> Next request of ARPACK; `ido_done` at the end.
      integer :: ido = 0
      integer :: info = 0
      integer :: applications = 0
      integer :: iparam(11) = 0
      integer :: ipntr(14) = 0
   contains
      !> Order of the operator.
      procedure(order_interface), deferred :: order
      !> Allocates work arrays and sets a real random start vector.
      procedure(reserve_interface), deferred :: reserve
      !> Replaces the start vector by its image, of unit norm.
      procedure(filter_interface), deferred :: filter
      !> Calls ARPACK once and serves its request.
      procedure(filter_interface), deferred :: step
      !> Magnitudes and error bounds of the current Ritz values, in ARPACK's order.
      procedure(ritz_interface), deferred :: ritz
      !> The eigenvalues mu that converged, and unit eigenvectors.
      procedure(extract_interface), deferred :: extract
      !> Prepares the iteration.
      procedure :: begin
      !> Number of converged eigenvalues.
      procedure :: converged
      !> Columns of WORKD that the request reads and writes.
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
         !> Length: order of the operator.
         real(wp), intent(in) :: start(:)
         !> Not 0 if memory is short.
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

   !> Starts the iteration; `wanted`, `columns`, `length` and `tolerance` are set before.
   subroutine begin(self, start, filter, restarts, error)
      class(arpack_process_type), intent(inout) :: self
      !> As long as the operator's vectors.
      real(wp), intent(in) :: start(:)
      !> Number of filter applications to it.
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

   !> Fails if extraction failed, unless nothing had converged.
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

   !> Keeps the first `found` pairs and normalises them; drops vectors in the padded rows only.
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
