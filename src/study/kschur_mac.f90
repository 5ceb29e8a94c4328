!> Modal assurance criterion (MAC) of the shapes of two results.
module kschur_mac
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_kinds, only: wp
   use kschur_lapack, only: dznrm2
   use kschur_memory, only: real_bytes, require_memory
   use kschur_result, only: modal_result_type
   use kschur_text, only: text
   implicit none
   private
   public :: modal_assurance, shape_assurance

contains

   !> MAC(i, j) = |phi_i^* phi_j|^2/(|phi_i|^2 |phi_j|^2), phi_i of the first and phi_j of the second result: 1 for parallel
   !> shapes, 0 for orthogonal ones. Fails if shapes differ in length.
   subroutine modal_assurance(first, second, mac, error)
      type(modal_result_type), intent(in) :: first, second
      real(wp), allocatable, intent(out) :: mac(:, :)
      type(error_type), allocatable, intent(out) :: error

      if (.not. allocated(first%eigenvectors)) then
         call new_error(error, error_usage, "the first result holds no modes")
      else if (.not. allocated(second%eigenvectors)) then
         call new_error(error, error_usage, "the second result holds no modes")
      else if (size(first%eigenvectors, 1) /= size(second%eigenvectors, 1)) then
         call new_error(error, error_usage, "the shapes of the results have "//text(size(first%eigenvectors, 1))// &
            " and "//text(size(second%eigenvectors, 1))//" unknowns but must have as many")
      end if
      if (allocated(error)) return
      call require_memory(3*real_bytes*size(first%eigenvectors, 2)*(size(second%eigenvectors, 2) + 1), "the criterion", error)
      if (allocated(error)) return
      allocate (mac(size(first%eigenvectors, 2), size(second%eigenvectors, 2)))
      mac = shape_assurance(first%eigenvectors, second%eigenvectors)
   end subroutine modal_assurance

   !> MAC of the columns of two arrays with the same number of rows.
   function shape_assurance(first, second) result(mac)
      complex(wp), contiguous, intent(in) :: first(:, :), second(:, :)
      real(wp) :: mac(size(first, 2), size(second, 2))
      real(wp) :: length(size(second, 2))
      integer :: i, j

      length = [(dznrm2(size(second, 1), second(:, j), 1), j=1, size(second, 2))]
      do i = 1, size(first, 2)
         associate (of_first => dznrm2(size(first, 1), first(:, i), 1))
            do j = 1, size(second, 2)
               mac(i, j) = (abs(dot_product(first(:, i), second(:, j)))/max(of_first*length(j), tiny(1.0_wp)))**2
            end do
         end associate
      end do
   end function shape_assurance
end module kschur_mac
