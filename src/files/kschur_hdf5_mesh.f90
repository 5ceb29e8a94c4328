!> Meshes in HDF5 files of problems and results: /coordinates, nodes x 3; /unknown_node and /unknown_component; /cells with
!> offsets, connectivity and types; /transformation, a matrix. Nodes count from 0 there, and -1 is none.
module kschur_hdf5_mesh
   use hdf5, only: hid_t
   use kschur_error, only: error_type, add_context, error_input, new_error
   use kschur_hdf5_basics, only: create_group, exists
   use kschur_hdf5_datasets, only: read_dataset, write_dataset
   use kschur_hdf5_matrix, only: bytes_of_matrix, read_matrix, whole, write_matrix
   use kschur_kinds, only: long
   use kschur_mesh, only: mesh_type, settle_mesh
   use kschur_text, only: text
   implicit none
   private
   public :: bytes_of_mesh, read_mesh, write_mesh

contains

   !> Reads the mesh of n unknowns; leaves it unallocated if there is none.
   subroutine read_mesh(mesh, file, n, error)
      type(mesh_type), allocatable, intent(out) :: mesh
      integer(hid_t), intent(in) :: file
      integer, intent(in) :: n
      type(error_type), allocatable, intent(inout) :: error
      integer :: moving

      if (allocated(error)) return
      if (.not. exists(file, "/coordinates", error)) return
      allocate (mesh)
      call read_dataset(mesh%coordinates, file, "/coordinates", error)
      if (allocated(error)) return
      if (size(mesh%coordinates, 1) /= 3) then
         call new_error(error, error_input, "/coordinates is "//text(mesh%nodes())//" x "// &
            text(size(mesh%coordinates, 1))//" but must have 3 columns")
         return
      end if
      moving = n
      if (exists(file, "/transformation", error)) then
         allocate (mesh%transformation)
         call read_matrix(mesh%transformation, moving, file, "/transformation", "transformation", whole, error)
      end if
      if (exists(file, "/unknown_node", error)) then
         call read_dataset(mesh%unknown_node, file, "/unknown_node", -1, mesh%nodes() - 1, error, moving)
         if (.not. allocated(error)) mesh%unknown_node = mesh%unknown_node + 1
      end if
      if (exists(file, "/unknown_component", error)) &
         call read_dataset(mesh%unknown_component, file, "/unknown_component", -1, 5, error, moving)
      if (exists(file, "/cells", error)) call read_cells(mesh, file, error)
      call settle_mesh(mesh, n, error)
      call add_context(error, "the mesh")
   end subroutine read_mesh

   subroutine read_cells(mesh, file, error)
      type(mesh_type), intent(inout) :: mesh
      integer(hid_t), intent(in) :: file
      type(error_type), allocatable, intent(inout) :: error

      call read_dataset(mesh%offsets, file, "/cells/offsets", 0, huge(1), error)
      call read_dataset(mesh%connectivity, file, "/cells/connectivity", 0, mesh%nodes() - 1, error)
      call read_dataset(mesh%types, file, "/cells/types", 1, 255, error)
      if (.not. allocated(error)) mesh%connectivity = mesh%connectivity + 1
   end subroutine read_cells

   !> Writes the mesh, if allocated.
   subroutine write_mesh(file, mesh, error)
      integer(hid_t), intent(in) :: file
      type(mesh_type), allocatable, intent(in) :: mesh
      type(error_type), allocatable, intent(inout) :: error

      if (.not. allocated(mesh)) return
      call write_dataset(file, "/coordinates", mesh%coordinates, error)
      call write_dataset(file, "/unknown_node", mesh%unknown_node - 1, error)
      call write_dataset(file, "/unknown_component", mesh%unknown_component, error)
      if (allocated(mesh%transformation)) call write_matrix(file, "/transformation", mesh%transformation, error)
      if (.not. allocated(mesh%types)) return
      call create_group(file, "/cells", error)
      call write_dataset(file, "/cells/offsets", mesh%offsets, error)
      call write_dataset(file, "/cells/connectivity", mesh%connectivity - 1, error)
      call write_dataset(file, "/cells/types", mesh%types, error)
   end subroutine write_mesh

   !> Size of its arrays in bytes.
   pure integer(long) function bytes_of_mesh(mesh)
      type(mesh_type), allocatable, intent(in) :: mesh
      integer(long), parameter :: bytes_of_an_integer = storage_size(1)/8

      bytes_of_mesh = 0
      if (.not. allocated(mesh)) return
      bytes_of_mesh = 3*mesh%nodes() + size(mesh%unknown_node)
      if (allocated(mesh%types)) bytes_of_mesh = bytes_of_mesh + size(mesh%types) + size(mesh%connectivity)/2
      bytes_of_mesh = 2*bytes_of_an_integer*bytes_of_mesh
      if (allocated(mesh%transformation)) bytes_of_mesh = bytes_of_mesh + bytes_of_matrix(mesh%transformation)
   end function bytes_of_mesh
end module kschur_hdf5_mesh
