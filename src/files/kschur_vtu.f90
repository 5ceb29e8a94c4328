!> Mode shapes as files of VTK (.vtu and .pvd, XML), which ParaView and meshio read.
module kschur_vtu
   use kschur_error, only: error_type, new_error, error_file, error_usage
   use kschur_files, only: check_length
   use kschur_kinds, only: wp, long
   use kschur_memory, only: complex_bytes, require_memory
   use kschur_mesh, only: mesh_type
   use kschur_text, only: text
   implicit none
   private
   public :: largest_displacement, write_pvd, write_vtu, write_vtu_frame

   ! An output file; after a failure nothing more is written, and `close` reports it.
   type :: output_type
      integer :: unit = 0, status = 0
      logical :: opened = .false.
      character(len=128) :: reason = ""
      !> Type attribute of VTKFile.
      character(len=16) :: kind = ""
   contains
      procedure :: open => open_output
      procedure :: put
      procedure :: put_rows
      procedure :: put_integers
      procedure :: put_vectors
      procedure :: close => close_output
   end type output_type

contains

   !> Writes a mesh with cells, and each shape as two vectors, real and imaginary part (as `mode_3_real`), scaled to a largest
   !> displacement of 1. Fails if the file cannot be written.
   subroutine write_vtu(mesh, shapes, names, path, error)
      type(mesh_type), intent(in) :: mesh
      !> n x shapes.
      complex(wp), intent(in) :: shapes(:, :)
      character(len=*), intent(in) :: names(:), path
      type(error_type), allocatable, intent(inout) :: error
      type(output_type) :: output
      complex(wp), allocatable :: moved(:, :)
      integer :: k

      call check_has_cells(mesh, path, error)
      call require_memory(4*complex_bytes*3*mesh%nodes(), "the displacements", error)
      if (allocated(error)) return
      call put_grid(output, mesh, mesh%coordinates, path)
      do k = 1, size(names)
         call mesh%displacements(shapes(:, k), moved)
         if (largest_displacement(moved) > 0) moved = moved/largest_displacement(moved)
         call output%put_vectors(trim(names(k))//"_real", real(moved, wp))
         call output%put_vectors(trim(names(k))//"_imaginary", aimag(moved))
      end do
      call output%put('</PointData>')
      call output%put('</Piece>')
      call output%close(path, error)
   end subroutine write_vtu

   !> Writes a displaced mesh, with the vector `displacement` from its position at rest.
   subroutine write_vtu_frame(mesh, displacement, path, error)
      type(mesh_type), intent(in) :: mesh
      !> 3 x nodes (m).
      real(wp), intent(in) :: displacement(:, :)
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(inout) :: error
      type(output_type) :: output

      call check_has_cells(mesh, path, error)
      if (allocated(error)) return
      call put_grid(output, mesh, mesh%coordinates + displacement, path)
      call output%put_vectors("displacement", displacement)
      call output%put('</PointData>')
      call output%put('</Piece>')
      call output%close(path, error)
   end subroutine write_vtu_frame

   !> Writes a time series of files.
   subroutine write_pvd(files, times, path, error)
      !> Names relative to the folder of `path`.
      character(len=*), intent(in) :: files(:)
      real(wp), intent(in) :: times(:)
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(inout) :: error
      type(output_type) :: output
      character(len=15) :: time
      integer :: k

      if (allocated(error)) return
      call output%open(path, "Collection")
      do k = 1, size(files)
         write (time, "(es15.8)") times(k)
         call output%put('<DataSet timestep="'//trim(adjustl(time))//'" file="'//trim(files(k))//'"/>')
      end do
      call output%close(path, error)
   end subroutine write_pvd

   !> Largest norm of a nodal displacement.
   pure real(wp) function largest_displacement(moved)
      !> 3 x nodes.
      complex(wp), intent(in) :: moved(:, :)

      largest_displacement = sqrt(maxval(sum(real(moved, wp)**2 + aimag(moved)**2, 1)))
   end function largest_displacement

   subroutine check_has_cells(mesh, path, error)
      type(mesh_type), intent(in) :: mesh
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(inout) :: error

      if (.not. (allocated(mesh%types) .or. allocated(error))) &
         call new_error(error, error_usage, path//": the mesh has no cells to draw: give it some, lines between nodes for instance")
   end subroutine check_has_cells

   ! Writes the file up to the point data.
   subroutine put_grid(output, mesh, points, path)
      type(output_type), intent(inout) :: output
      type(mesh_type), intent(in) :: mesh
      real(wp), intent(in) :: points(:, :)
      character(len=*), intent(in) :: path
      integer :: c

      call output%open(path, "UnstructuredGrid")
      call output%put('<Piece NumberOfPoints="'//text(mesh%nodes())//'" NumberOfCells="'//text(mesh%cells())//'">')
      call output%put('<Points>')
      call output%put('<DataArray type="Float64" NumberOfComponents="3" format="ascii">')
      call output%put_rows(points)
      call output%put('</DataArray>')
      call output%put('</Points>')
      call output%put('<Cells>')
      call output%put('<DataArray type="Int32" Name="connectivity" format="ascii">')
      do c = 1, mesh%cells()
         call output%put_integers(mesh%connectivity(mesh%offsets(c) + 1:mesh%offsets(c + 1)) - 1, "(*(i0, 1x))")
      end do
      call output%put('</DataArray>')
      call output%put('<DataArray type="Int32" Name="offsets" format="ascii">')
      call output%put_integers(mesh%offsets(2:), "(i0)")
      call output%put('</DataArray>')
      call output%put('<DataArray type="UInt8" Name="types" format="ascii">')
      call output%put_integers(mesh%types, "(i0)")
      call output%put('</DataArray>')
      call output%put('</Cells>')
      call output%put('<PointData>')
   end subroutine put_grid

   subroutine open_output(self, path, kind)
      class(output_type), intent(out) :: self
      character(len=*), intent(in) :: path, kind

      self%kind = kind
      open (newunit=self%unit, file=path, status="replace", action="write", access="stream", form="formatted", &
         iostat=self%status, iomsg=self%reason)
      self%opened = self%status == 0
      call self%put('<?xml version="1.0"?>')
      call self%put('<VTKFile type="'//kind//'" version="0.1" byte_order="LittleEndian">')
      call self%put('<'//kind//'>')
   end subroutine open_output

   ! Writes a line.
   subroutine put(self, line)
      class(output_type), intent(inout) :: self
      character(len=*), intent(in) :: line

      if (self%status == 0) write (self%unit, "(a)", iostat=self%status, iomsg=self%reason) line
   end subroutine put

   ! Writes one vector in each line.
   subroutine put_rows(self, vectors)
      class(output_type), intent(inout) :: self
      real(wp), intent(in) :: vectors(:, :)

      if (self%status == 0) write (self%unit, "(3es24.15e3)", iostat=self%status, iomsg=self%reason) vectors
   end subroutine put_rows

   subroutine put_integers(self, numbers, notation)
      class(output_type), intent(inout) :: self
      integer, intent(in) :: numbers(:)
      character(len=*), intent(in) :: notation

      if (self%status == 0) write (self%unit, notation, iostat=self%status, iomsg=self%reason) numbers
   end subroutine put_integers

   subroutine put_vectors(self, name, vectors)
      class(output_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: vectors(:, :)

      call self%put('<DataArray type="Float64" Name="'//name//'" NumberOfComponents="3" format="ascii">')
      call self%put_rows(vectors)
      call self%put('</DataArray>')
   end subroutine put_vectors

   ! Closes the file and checks its length.
   subroutine close_output(self, path, error)
      class(output_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(inout) :: error
      integer(long) :: position
      integer :: ignored

      call self%put('</'//trim(self%kind)//'>')
      call self%put('</VTKFile>')
      if (self%opened) then
         inquire (unit=self%unit, pos=position)
         close (self%unit, iostat=ignored)
         call check_length(path, position - 1, self%status, self%reason)
      end if
      if (self%status /= 0) call new_error(error, error_file, path//": cannot be written: "//trim(self%reason))
   end subroutine close_output
end module kschur_vtu
