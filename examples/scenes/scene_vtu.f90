!> Mode shapes as a VTK file (.vtu, XML), which ParaView and meshio read.
module scene_vtu
   use kschur, only: error_file, error_type, modal_result_type, new_error, text, wp
   use scene_geometry, only: geometry_type
   implicit none
   private
   public :: write_vtu

   !> VTK's numbers of a vertex, a line and a tetrahedron, by their number of points.
   integer, parameter :: cell_types(4) = [1, 3, 0, 10]

contains

   !> Writes the geometry and on it each mode as two vectors, real and imaginary part, `mode_3_real` say: the
   !> largest displacement is 1. Fails where the file cannot be written.
   subroutine write_vtu(geometry, result, path, error)
      type(geometry_type), intent(in) :: geometry
      type(modal_result_type), intent(in) :: result
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      complex(wp) :: shape(3, geometry%points)
      integer :: corners(geometry%cells), unit, status, last, i

      open (newunit=unit, file=path, status="replace", action="write", iostat=status)
      if (status /= 0) then
         call new_error(error, error_file, "the file "//path//" cannot be written")
         return
      end if
      associate (cell => geometry%cell(:, :geometry%cells))
         corners = count(cell > 0, 1)
         write (unit, "(a)") '<?xml version="1.0"?>', &
            '<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">', '<UnstructuredGrid>', &
            '<Piece NumberOfPoints="'//text(geometry%points)//'" NumberOfCells="'//text(geometry%cells)//'">', &
            '<Points>', '<DataArray type="Float64" NumberOfComponents="3" format="ascii">'
         write (unit, "(3es24.15e3)") geometry%position(:, :geometry%points)
         write (unit, "(a)") '</DataArray>', '</Points>', '<Cells>', &
            '<DataArray type="Int32" Name="connectivity" format="ascii">'
         do i = 1, geometry%cells
            write (unit, "(4(i0, 1x))") cell(:corners(i), i) - 1
         end do
         write (unit, "(a)") '</DataArray>', '<DataArray type="Int32" Name="offsets" format="ascii">'
         last = 0
         do i = 1, geometry%cells
            last = last + corners(i)
            write (unit, "(i0)") last
         end do
         write (unit, "(a)") '</DataArray>', '<DataArray type="UInt8" Name="types" format="ascii">'
         write (unit, "(i0)") cell_types(corners)
         write (unit, "(a)") '</DataArray>', '</Cells>', '<PointData>'
      end associate
      do i = 1, size(result%eigenvalues)
         shape = displacements(geometry, result%eigenvectors(:, i))
         call write_vectors(unit, "mode_"//text(i)//"_real", real(shape, wp))
         call write_vectors(unit, "mode_"//text(i)//"_imaginary", aimag(shape))
      end do
      write (unit, "(a)", iostat=status) '</PointData>', '</Piece>', '</UnstructuredGrid>', '</VTKFile>'
      if (status == 0) close (unit, iostat=status)
      if (status /= 0) call new_error(error, error_file, "the file "//path//" cannot be written to its end")
   end subroutine write_vtu

   subroutine write_vectors(unit, name, vectors)
      integer, intent(in) :: unit
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: vectors(:, :)

      write (unit, "(a)") '<DataArray type="Float64" Name="'//name//'" NumberOfComponents="3" format="ascii">'
      write (unit, "(3es24.15e3)") vectors
      write (unit, "(a)") '</DataArray>'
   end subroutine write_vectors

   ! Of the points, scaled so that the largest is 1.
   pure function displacements(geometry, x) result(shape)
      type(geometry_type), intent(in) :: geometry
      complex(wp), intent(in) :: x(:)
      complex(wp) :: shape(3, geometry%points)
      real(wp) :: largest
      integer :: i, j

      shape = 0
      do i = 1, geometry%points
         do j = 1, 3
            if (geometry%places(j, i) > 0) shape(j, i) = x(geometry%places(j, i))
         end do
      end do
      largest = sqrt(maxval(sum(real(shape, wp)**2 + aimag(shape)**2, 1)))
      if (largest > 0) shape = shape/largest
   end function displacements
end module scene_vtu
