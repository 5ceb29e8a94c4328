!> Row operations on constraints that confine unknowns, and the way back.
!>
!> With row operations W and a substitution of unknowns phi = Q v, W Cq Q has rows with a single entry, those which confine, and
!> empty rows: presolve clamps the former and drops the latter.
module kschur_confinement
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_sparse, only: csr_matrix_type, new_csr_from_triplets
   implicit none
   private
   public :: condense, confinement_type, convert_multipliers, resolve, restore_multipliers

   !> Row operations, and the unknowns they confine.
   type :: confinement_type
      !> Operations in order: row target(k) less multiple(k) times row source(k).
      integer, allocatable :: target(:), source(:)
      real(wp), allocatable :: multiple(:)
      !> States of self-stress, multipliers of rows of one block without any force: the number of operations before the block, the
      !> rows of state k, entries first_entry(k) to first_entry(k+1)-1, the multipliers, and what they are weighed with, so that the
      !> share of the state in other multipliers is the sum of their products with `weight`.
      integer, allocatable :: before(:), first_entry(:), stressed_row(:)
      real(wp), allocatable :: stress(:), weight(:)
      !> Confined unknowns in order: phi(unknown(k)) is the sum of share(l) phi(master(l)), start(k) <= l < start(k+1), where
      !> masters may be confined after it.
      integer, allocatable :: unknown(:), start(:), master(:)
      real(wp), allocatable :: share(:)
      !> W Cq Q.
      type(csr_matrix_type) :: constraints
   end type confinement_type

   ! A sparse row.
   type :: row_type
      integer, allocatable :: column(:)
      real(wp), allocatable :: value(:)
   end type row_type

contains

   !> Computes multipliers of rows as given, W^T xi, less states of self-stress.
   pure subroutine restore_multipliers(self, xi)
      type(confinement_type), intent(in) :: self
      complex(wp), intent(inout) :: xi(:)
      integer :: k, s

      s = size(self%before)
      do k = size(self%target), 0, -1
         do while (s > 0)
            if (self%before(s) < k) exit
            associate (first => self%first_entry(s), last => self%first_entry(s + 1) - 1)
               associate (row => self%stressed_row(first:last))
                  xi(row) = xi(row) - self%stress(first:last)*sum(self%weight(first:last)*xi(row))
               end associate
            end associate
            s = s - 1
         end do
         if (k > 0) xi(self%source(k)) = xi(self%source(k)) - self%multiple(k)*xi(self%target(k))
      end do
   end subroutine restore_multipliers

   !> The inverse of `restore_multipliers`.
   pure subroutine convert_multipliers(self, xi)
      type(confinement_type), intent(in) :: self
      complex(wp), intent(inout) :: xi(:)
      integer :: k

      do k = 1, size(self%target)
         xi(self%source(k)) = xi(self%source(k)) + self%multiple(k)*xi(self%target(k))
      end do
   end subroutine convert_multipliers

   !> Computes Q^T f, forces on v.
   pure subroutine condense(self, force)
      type(confinement_type), intent(in) :: self
      complex(wp), intent(inout) :: force(:)
      integer :: k, l

      do k = 1, size(self%unknown)
         do l = self%start(k), self%start(k + 1) - 1
            force(self%master(l)) = force(self%master(l)) + self%share(l)*force(self%unknown(k))
         end do
      end do
   end subroutine condense

   !> Expresses each unknown in those that are not confined: phi = Q phi, Q with entries of unknowns that are not confined only.
   subroutine resolve(self, unknowns, shares, error)
      type(confinement_type), intent(in) :: self
      integer, intent(in) :: unknowns
      !> Q, n x n.
      type(csr_matrix_type), intent(out) :: shares
      type(error_type), allocatable, intent(out) :: error
      ! Of confined unknowns; others stand for themselves.
      type(row_type) :: resolved(unknowns)
      integer, allocatable :: row(:), column(:)
      real(wp), allocatable :: value(:)
      integer :: i, k, l, entries, last

      entries = unknowns
      do k = size(self%unknown), 1, -1
         associate (of_unknown => resolved(self%unknown(k)), masters => self%master(self%start(k):self%start(k + 1) - 1))
            last = sum([(size_of(resolved(masters(l))), l=1, size(masters))])
            allocate (of_unknown%column(last), of_unknown%value(last))
            entries = entries + last
            last = 0
            do l = 1, size(masters)
               associate (first => last + 1, share => self%share(self%start(k) + l - 1))
                  last = last + size_of(resolved(masters(l)))
                  if (allocated(resolved(masters(l))%column)) then
                     of_unknown%column(first:last) = resolved(masters(l))%column
                     of_unknown%value(first:last) = share*resolved(masters(l))%value
                  else
                     of_unknown%column(last) = masters(l)
                     of_unknown%value(last) = share
                  end if
               end associate
            end do
         end associate
      end do
      allocate (row(entries), column(entries), value(entries))
      entries = 0
      do i = 1, unknowns
         if (.not. allocated(resolved(i)%column)) then
            entries = entries + 1
            row(entries) = i
            column(entries) = i
            value(entries) = 1
            cycle
         end if
         do k = 1, size(resolved(i)%column)
            entries = entries + 1
            row(entries) = i
            column(entries) = resolved(i)%column(k)
            value(entries) = resolved(i)%value(k)
         end do
      end do
      call new_csr_from_triplets(shares, unknowns, unknowns, row(:entries), column(:entries), value(:entries), error)
   end subroutine resolve

   ! Number of entries of an unknown.
   pure integer function size_of(of_unknown)
      type(row_type), intent(in) :: of_unknown

      size_of = 1
      if (allocated(of_unknown%column)) size_of = size(of_unknown%column)
   end function size_of
end module kschur_confinement
