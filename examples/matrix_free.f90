!> Eigenvalues of an operator without a matrix: the inverse of the Laplacian on
!> the unit square, 60 x 60 points and zero on the edge, applied by sine transforms in one
!> direction and tridiagonal systems in the other.
!>
!> Closed form: the eigenvalues of the Laplacian are
!> 4 (sin^2(i pi/122) + sin^2(j pi/122)) 61^2, next to (i^2 + j^2) pi^2.
module membrane
   use kschur, only: error_type, real_operator_type, wp
   implicit none
   private
   public :: membrane_type, new_membrane

   integer, parameter :: points = 60
   real(wp), parameter :: pi = acos(-1.0_wp)

   type, extends(real_operator_type) :: membrane_type
      private
      ! The sine transform, which is its own inverse.
      real(wp) :: sines(points, points)
   contains
      procedure :: order
      procedure :: apply
   end type membrane_type

contains

   subroutine new_membrane(self)
      type(membrane_type), intent(out) :: self
      integer :: i, j

      do concurrent(i=1:points, j=1:points)
         self%sines(i, j) = sqrt(2.0_wp/(points + 1))*sin(i*j*pi/(points + 1))
      end do
   end subroutine new_membrane

   integer function order(self)
      class(membrane_type), intent(in) :: self

      order = size(self%sines)
   end function order

   ! y := C x, C the inverse of the Laplacian.
   subroutine apply(self, x, y, error)
      class(membrane_type), intent(inout) :: self
      real(wp), contiguous, intent(in) :: x(:, :)
      real(wp), contiguous, intent(out) :: y(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: field(points, points)
      integer :: i, column

      do column = 1, size(x, 2)
         field = matmul(self%sines, reshape(x(:, column), [points, points]))
         do i = 1, points
            call solve_tridiagonal(2 + 4*sin(i*pi/(2*(points + 1)))**2, field(i, :))
         end do
         y(:, column) = reshape(matmul(self%sines, field), [points**2])/(points + 1)**2
      end do
   end subroutine apply

   ! Solves with the matrix that has d on its diagonal and -1 beside it.
   pure subroutine solve_tridiagonal(d, x)
      real(wp), intent(in) :: d
      real(wp), intent(inout) :: x(:)
      real(wp) :: pivot(size(x))
      integer :: i

      pivot(1) = d
      do i = 2, size(x)
         pivot(i) = d - 1/pivot(i - 1)
         x(i) = x(i) + x(i - 1)/pivot(i - 1)
      end do
      x(size(x)) = x(size(x))/pivot(size(x))
      do i = size(x) - 1, 1, -1
         x(i) = (x(i) + x(i + 1))/pivot(i)
      end do
   end subroutine solve_tridiagonal
end module membrane

program matrix_free
   use kschur, only: error_type, krylov_options_type, krylov_schur, krylov_statistics_type, largest_magnitude, &
      named_selection_type, reason_converged, wp
   use membrane, only: membrane_type, new_membrane
   implicit none
   type(membrane_type) :: operator
   type(krylov_statistics_type) :: statistics
   type(error_type), allocatable :: error
   complex(wp), allocatable :: values(:), vectors(:, :)

   call new_membrane(operator)
   ! The largest eigenvalues of the inverse are the smallest ones of the Laplacian.
   call krylov_schur(operator, named_selection_type(4, largest_magnitude), krylov_options_type(), values, vectors, &
      statistics, error)
   if (allocated(error)) then
      print "(a)", error%message
      error stop
   end if
   if (statistics%reason /= reason_converged) error stop "not converged"
   print "(a, 4f12.6)", "eigenvalues", 1/real(values(:4), wp)
end program matrix_free
