!> Symmetric matrices with one triangle stored, as finite-element programs and direct solvers do: completes them on request, and
!> detects those that look like one.
module kschur_symmetric_storage
   use kschur_csr, only: csr_matrix_type
   use kschur_csr_assembly, only: transpose_csr
   use kschur_error, only: error_type, new_error, error_input, error_usage
   use kschur_kinds, only: wp
   use kschur_memory, only: require_memory
   use kschur_text, only: text
   use kschur_tolerances, only: five_digits, rounding_of_sums
   implicit none
   private
   public :: settle_storage

   !> Matrices are not changed; one that looks like half of a symmetric one is an error.
   integer, parameter, public :: symmetric_check = 0
   !> The lower triangle of a symmetric matrix is stored.
   integer, parameter, public :: symmetric_lower = 1
   !> The upper triangle is stored.
   integer, parameter, public :: symmetric_upper = 2
   !> Matrices are not changed.
   integer, parameter, public :: symmetric_no = 3
   !> Names of these, from `symmetric_check` on.
   character(len=*), parameter, public :: symmetric_names(0:3) = [character(len=5) :: "check", "lower", "upper", "no"]

contains

   !> Completes a square matrix of which one triangle is stored. Fails if an entry of the other triangle contradicts it; for
   !> `symmetric_check` if entries off the diagonal are in one triangle only and may be half of a semidefinite matrix.
   subroutine settle_storage(matrix, symmetric, base, name, error)
      type(csr_matrix_type), intent(inout) :: matrix
      !> One of `symmetric_check`, `symmetric_lower`, `symmetric_upper`, `symmetric_no`.
      integer, intent(in) :: symmetric
      !> First index in messages.
      integer, intent(in) :: base
      !> Name of the matrix in messages.
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(inout) :: error
      character(len=:), allocatable :: half

      if (allocated(error)) return
      select case (symmetric)
      case (symmetric_no)
      case (symmetric_check)
         half = trim(symmetric_names(half_of(matrix)))
         if (half /= symmetric_names(symmetric_no)) call new_error(error, error_input, "the "//name//" has entries in its "// &
            half//" triangle only: --symmetric "//half//" takes it as half of a symmetric matrix, --symmetric no as it is")
      case (symmetric_lower, symmetric_upper)
         call mirror(matrix, symmetric, base, name, error)
      case default
         call new_error(error, error_usage, "there is no storage of symmetric matrices number "//text(symmetric))
      end select
   end subroutine settle_storage

   ! Guesses whether a matrix is half of a symmetric one: returns its only triangle with entries if a_ij^2 <= a_ii a_jj for each, as
   ! in a semidefinite matrix (Cauchy-Schwarz); `symmetric_no` if a one-way coupling is stronger.
   integer function half_of(matrix) result(half)
      type(csr_matrix_type), intent(in) :: matrix
      real(wp) :: here, there
      logical :: lower, upper
      integer :: i, k

      half = symmetric_no
      lower = .false.
      upper = .false.
      associate (column => matrix%column, value => matrix%value)
         do i = 1, matrix%rows
            do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
               if (.not. abs(value(k)) > 0) cycle
               lower = lower .or. column(k) < i
               upper = upper .or. column(k) > i
            end do
            if (lower .and. upper) return
         end do
         if (.not. (lower .or. upper)) return
         do i = 1, matrix%rows
            here = diagonal_entry(i)
            do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
               if (column(k) == i .or. .not. abs(value(k)) > 0) cycle
               there = diagonal_entry(column(k))
               if (abs(value(k)) > (1 + five_digits)*sqrt(abs(here))*sqrt(abs(there))) return
               if (here > 0 .neqv. there > 0) return
            end do
         end do
      end associate
      half = merge(symmetric_lower, symmetric_upper, lower)

   contains

      ! a_jj, 0 if it is not stored.
      pure real(wp) function diagonal_entry(j)
         integer, intent(in) :: j
         integer :: place

         diagonal_entry = 0
         place = matrix%place_of(j, j)
         if (place > 0) diagonal_entry = matrix%value(place)
      end function diagonal_entry
   end function half_of

   ! Replaces one triangle by the transpose of the other.
   subroutine mirror(matrix, half, base, name, error)
      type(csr_matrix_type), intent(inout) :: matrix
      integer, intent(in) :: half, base
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(inout) :: error
      type(csr_matrix_type) :: transposed, whole

      if (matrix%nonzeros() > huge(1) - matrix%nonzeros()) call new_error(error, error_input, "the "// &
         name//" has too many entries to be mirrored")
      call require_memory(4*matrix%bytes(), "the other half of the "//name, error)
      if (allocated(error)) return
      transposed = transpose_csr(matrix)
      call check_other_half(matrix, transposed, half, base, name, error)
      if (allocated(error)) return
      if (half == symmetric_lower) then
         call join(matrix, transposed, whole)
      else
         call join(transposed, matrix, whole)
      end if
      call move_alloc(whole%row_start, matrix%row_start)
      call move_alloc(whole%column, matrix%column)
      call move_alloc(whole%value, matrix%value)
   end subroutine mirror

   ! Fails if an entry of the other triangle does not mirror one of the stored triangle.
   subroutine check_other_half(matrix, transposed, half, base, name, error)
      type(csr_matrix_type), intent(in) :: matrix, transposed
      integer, intent(in) :: half, base
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(inout) :: error
      real(wp), allocatable :: maxima(:)
      real(wp) :: difference
      integer :: i, k, place

      allocate (maxima, source=max(matrix%row_maxima(), transposed%row_maxima()))
      do i = 1, matrix%rows
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            associate (j => matrix%column(k))
               if (j == i .or. (j < i .eqv. half == symmetric_lower) .or. .not. abs(matrix%value(k)) > 0) cycle
               place = transposed%place_of(i, j)
               difference = matrix%value(k)
               if (place > 0) difference = difference - transposed%value(place)
               if (abs(difference) <= rounding_of_sums*min(maxima(i), maxima(j))) cycle
               call new_error(error, error_input, "with --symmetric "//trim(symmetric_names(half))//" the entry ("// &
                  text(i + base - 1)//", "//text(j + base - 1)//") of the "//name//" must mirror that at ("// &
                  text(j + base - 1)//", "//text(i + base - 1)//"), or not be there")
               return
            end associate
         end do
      end do
   end subroutine check_other_half

   ! Joins the entries of `lower` up to the diagonal with those of `upper`, row by row.
   subroutine join(lower, upper, whole)
      type(csr_matrix_type), intent(in) :: lower, upper
      type(csr_matrix_type), intent(out) :: whole
      integer :: i, k, entries

      allocate (whole%row_start(lower%rows + 1))
      entries = 0
      do i = 1, lower%rows
         whole%row_start(i) = entries + 1
         entries = entries + count(lower%column(lower%row_start(i):lower%row_start(i + 1) - 1) <= i) &
            + count(upper%column(upper%row_start(i):upper%row_start(i + 1) - 1) > i)
      end do
      whole%row_start(lower%rows + 1) = entries + 1
      allocate (whole%column(entries), whole%value(entries))
      entries = 0
      do i = 1, lower%rows
         do k = lower%row_start(i), lower%row_start(i + 1) - 1
            if (lower%column(k) <= i) call append(lower, k)
         end do
         do k = upper%row_start(i), upper%row_start(i + 1) - 1
            if (upper%column(k) > i) call append(upper, k)
         end do
      end do

   contains

      subroutine append(from, k)
         type(csr_matrix_type), intent(in) :: from
         integer, intent(in) :: k

         entries = entries + 1
         whole%column(entries) = from%column(k)
         whole%value(entries) = from%value(k)
      end subroutine append
   end subroutine join
end module kschur_symmetric_storage
