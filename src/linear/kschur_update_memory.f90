!> Memory for update matrices of a multifrontal elimination. New memory takes page faults, which cost as much as the arithmetic;
!> so it is used again. Inside a leaf part of the tree updates of a supernode and of its parent lie on two stacks in turn, as then
!> those of the children of a supernode are the last on theirs. Others are allocated, and the largest free ones kept.
module kschur_update_memory
   use kschur_kinds, only: wp, long
   use kschur_subtrees, only: subtrees_type
   use kschur_symbolic, only: symbolic_type
   implicit none
   private
   public :: matrix_type, stack_type, update_plan_type

   !> A square matrix, column by column, in a stack or allocated.
   type :: matrix_type
      real(wp), pointer, contiguous :: entries(:) => null()
      integer :: rows = 0
   contains
      !> Where an entry of it is.
      procedure :: place
   end type matrix_type

   !> Of a thread.
   type :: stack_type
      real(wp), pointer, contiguous :: values(:) => null()
      integer(long) :: top = 0
   end type stack_type

   !> Where the update matrix of each supernode lies.
   type :: update_plan_type
      !> The child whose matrix a supernode takes for its own, as it has all rows of the front: the piece before it of a wide
      !> supernode. 0: none.
      integer, allocatable :: taken(:)
      !> 1 or 2; 0: allocated.
      integer, allocatable :: stack(:)
      !> Entries that each stack has at most.
      integer(long) :: entries(2) = 0
      !> Free matrices.
      type(matrix_type), private :: spare(8)
   contains
      procedure :: make => make_plan
      procedure :: give
      procedure :: take_back
      procedure :: drop_spare
   end type update_plan_type

   ! Smaller ones are malloc's: those of 128 KiB and more it may return to the system (M_MMAP_THRESHOLD).
   integer, parameter :: least_spare = 128

contains

   !> Chooses a place for the update matrix of each supernode.
   subroutine make_plan(self, symbolic, subtrees, last, status)
      class(update_plan_type), intent(inout) :: self
      type(symbolic_type), intent(in) :: symbolic
      type(subtrees_type), intent(in) :: subtrees
      !> Supernodes after this one take no matrix of a child.
      integer, intent(in) :: last
      integer, intent(out) :: status
      integer :: nodes, s, t

      nodes = size(symbolic%first) - 1
      allocate (self%taken(nodes), self%stack(nodes), source=0, stat=status)
      if (status /= 0) return
      do s = 1, nodes
         associate (parent => symbolic%parent(s))
            if (parent == 0 .or. parent > last) cycle
            if (rows_below(symbolic, s) == rows_below(symbolic, parent) + symbolic%first(parent + 1) - symbolic%first(parent)) &
               self%taken(parent) = s
         end associate
      end do
      do t = 1, size(subtrees%root)
         if (.not. subtrees%is_leaf(t)) cycle
         do s = subtrees%root(t), subtrees%first(t), -1
            associate (parent => symbolic%parent(s))
               if (parent == 0 .or. parent > subtrees%root(t)) cycle
               if (self%taken(parent) == s) then
                  self%stack(s) = self%stack(parent)
               else
                  self%stack(s) = merge(2, 1, self%stack(parent) == 1)
               end if
            end associate
         end do
      end do
      call measure_stacks(self, symbolic)
   end subroutine make_plan

   ! By the pushes and pops of the elimination.
   subroutine measure_stacks(self, symbolic)
      class(update_plan_type), intent(inout) :: self
      type(symbolic_type), intent(in) :: symbolic
      ! Of each supernode, what its children have on each stack.
      integer(long), allocatable :: of_children(:, :)
      integer(long) :: top(2)
      integer :: s, p

      allocate (of_children(2, size(self%stack)), source=0_long)
      top = 0
      do s = 1, size(self%stack)
         p = self%stack(s)
         if (p > 0) then
            if (self%taken(s) > 0) then
               of_children(p, symbolic%parent(s)) = of_children(p, symbolic%parent(s)) + of_children(p, s)
               of_children(p, s) = 0
            else
               associate (entries => int(rows_below(symbolic, s), long)**2)
                  top(p) = top(p) + entries
                  of_children(p, symbolic%parent(s)) = of_children(p, symbolic%parent(s)) + entries
               end associate
            end if
         end if
         self%entries = max(self%entries, top)
         top = top - of_children(:, s)
      end do
   end subroutine measure_stacks

   !> Sets `matrix` to one of n or more rows and columns, undefined, for the update of supernode s.
   subroutine give(self, s, n, stacks, matrix, status)
      class(update_plan_type), intent(inout) :: self
      integer, intent(in) :: s, n
      !> Of the thread.
      type(stack_type), intent(inout) :: stacks(2)
      type(matrix_type), intent(inout) :: matrix
      integer, intent(out) :: status
      integer(long) :: entries
      integer :: i

      status = 0
      entries = int(n, long)**2
      matrix%rows = n
      if (self%stack(s) > 0) then
         associate (top => stacks(self%stack(s))%top)
            matrix%entries => stacks(self%stack(s))%values(top + 1:top + entries)
            top = top + entries
         end associate
         return
      end if
      !$omp critical
      i = minloc(self%spare%rows, 1, self%spare%rows >= n .and. self%spare%rows <= 2*n)
      if (i > 0) then
         matrix = self%spare(i)
         self%spare(i) = matrix_type()
      end if
      !$omp end critical
      if (.not. associated(matrix%entries)) allocate (matrix%entries(entries), stat=status)
   end subroutine give

   !> Frees the matrix of supernode s.
   subroutine take_back(self, s, stacks, matrix)
      class(update_plan_type), intent(inout) :: self
      integer, intent(in) :: s
      type(stack_type), intent(inout) :: stacks(2)
      type(matrix_type), intent(inout) :: matrix
      integer :: i

      if (self%stack(s) > 0) then
         associate (top => stacks(self%stack(s))%top)
            top = top - size(matrix%entries, kind=long)
         end associate
         matrix = matrix_type()
         return
      end if
      if (matrix%rows >= least_spare) then
         !$omp critical
         i = minloc(self%spare%rows, 1)
         if (matrix%rows > self%spare(i)%rows) then
            if (associated(self%spare(i)%entries)) deallocate (self%spare(i)%entries)
            self%spare(i) = matrix
            matrix = matrix_type()
         end if
         !$omp end critical
      end if
      if (associated(matrix%entries)) deallocate (matrix%entries)
   end subroutine take_back

   !> Frees all spare matrices.
   subroutine drop_spare(self)
      class(update_plan_type), intent(inout) :: self
      integer :: i

      do i = 1, size(self%spare)
         if (associated(self%spare(i)%entries)) deallocate (self%spare(i)%entries)
      end do
   end subroutine drop_spare

   pure integer(long) function place(self, row, column)
      class(matrix_type), intent(in) :: self
      integer, intent(in) :: row, column

      place = int(column - 1, long)*self%rows + row
   end function place

   pure integer function rows_below(symbolic, s)
      type(symbolic_type), intent(in) :: symbolic
      integer, intent(in) :: s

      rows_below = int(symbolic%start(s + 1) - symbolic%start(s))
   end function rows_below
end module kschur_update_memory
