!> Mass matrices that are the same in each direction, as those of solids.
module kschur_mass_components
   use kschur_sparse, only: csr_matrix_type
   implicit none
   private
   public :: one_component

contains

   !> Of a matrix A (x) I, with two or three unknowns a node, A, which has the same spectrum; any other matrix itself.
   pure function one_component(matrix) result(component)
      !> Square.
      type(csr_matrix_type), intent(in) :: matrix
      type(csr_matrix_type) :: component
      integer :: directions, i

      do directions = 3, 2, -1
         if (repeats(matrix, directions)) exit
      end do
      if (directions == 1) then
         component = matrix
         return
      end if
      component%rows = matrix%rows/directions
      component%columns = component%rows
      allocate (component%row_start(component%rows + 1), component%column(matrix%nonzeros()/directions), &
         component%value(matrix%nonzeros()/directions))
      component%row_start(1) = 1
      do i = 1, component%rows
         associate (first => matrix%row_start(directions*(i - 1) + 1), last => matrix%row_start(directions*(i - 1) + 2) - 1)
            component%row_start(i + 1) = component%row_start(i) + last - first + 1
            component%column(component%row_start(i):component%row_start(i + 1) - 1) = &
               (matrix%column(first:last) - 1)/directions + 1
            component%value(component%row_start(i):component%row_start(i + 1) - 1) = matrix%value(first:last)
         end associate
      end do
   end function one_component

   ! Whether the rows of each node are those of its first direction, moved by one column a direction.
   pure logical function repeats(matrix, directions)
      type(csr_matrix_type), intent(in) :: matrix
      integer, intent(in) :: directions
      integer :: first, i, j, entries

      repeats = .false.
      if (mod(matrix%rows, directions) > 0) return
      do i = 1, matrix%rows, directions
         first = matrix%row_start(i)
         entries = matrix%row_start(i + 1) - first
         if (any(mod(matrix%column(first:first + entries - 1) - 1, directions) /= 0)) return
         do j = 1, directions - 1
            if (matrix%row_start(i + j + 1) - matrix%row_start(i + j) /= entries) return
            associate (start => matrix%row_start(i + j))
               if (any(matrix%column(start:start + entries - 1) - j /= matrix%column(first:first + entries - 1))) return
               if (any(abs(matrix%value(start:start + entries - 1) - matrix%value(first:first + entries - 1)) > 0)) return
            end associate
         end do
      end do
      repeats = .true.
   end function repeats
end module kschur_mass_components
