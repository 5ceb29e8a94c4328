!> Meshes, for C.
module kschur_capi_mesh
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int, c_int64_t, c_ptr
   use kschur, only: error_type, mesh_type, new_error, text
   use kschur_capi_problem, only: problem_handle_type, problem_of, take_indices
   use kschur_capi_status, only: outcome, require, status_input, status_null, status_order, status_usage
   implicit none
   private

   integer(c_int64_t), parameter :: most = huge(1) - 1

contains

   integer(c_int) function kschur_problem_set_nodes(address, nodes, coordinates, unknowns, base, node, component) bind(c) &
      result(status)
      type(c_ptr), value :: address, coordinates, node, component
      integer(c_int64_t), value :: nodes, unknowns
      integer(c_int), value :: base
      type(problem_handle_type), pointer :: handle
      type(mesh_type) :: mesh
      type(error_type), allocatable :: error
      real(c_double), pointer :: places(:, :)

      status = status_null
      handle => problem_of(address)
      if (.not. associated(handle)) return
      call check_base(base, error)
      if (.not. allocated(error) .and. (nodes < 1 .or. nodes > most .or. unknowns < 0 .or. unknowns > most)) call new_error( &
         error, status_input, "there cannot be "//text(nodes)//" nodes and "//text(unknowns)//" unknowns")
      if (.not. allocated(error)) call require(coordinates, "coordinates", error)
      if (.not. allocated(error) .and. (c_associated(node) .or. c_associated(component))) then
         ! base - 1 means no node.
         call take_indices(node, "node", .false., unknowns, int(base) - 1, nodes, mesh%unknown_node, error)
         call take_indices(component, "component", .false., unknowns, -1, 6_c_int64_t, mesh%unknown_component, error)
      end if
      if (.not. allocated(error)) then
         if (allocated(mesh%unknown_node)) mesh%unknown_node = mesh%unknown_node - 1
         if (allocated(mesh%unknown_component)) mesh%unknown_component = mesh%unknown_component - 2
         call c_f_pointer(coordinates, places, [3, int(nodes)])
         allocate (mesh%coordinates(3, nodes), source=places)
         if (allocated(handle%problem%mesh)) deallocate (handle%problem%mesh)
         allocate (handle%problem%mesh, source=mesh)
         handle%checked = .false.
      end if
      status = outcome(handle, error)
   end function kschur_problem_set_nodes

   integer(c_int) function kschur_problem_set_cells(address, cells, base, offset, node, kind) bind(c) result(status)
      type(c_ptr), value :: address, offset, node, kind
      integer(c_int64_t), value :: cells
      integer(c_int), value :: base
      type(problem_handle_type), pointer :: handle
      type(error_type), allocatable :: error
      integer, allocatable :: offsets(:), connectivity(:), types(:)
      integer(c_int64_t) :: entries

      status = status_null
      handle => problem_of(address)
      if (.not. associated(handle)) return
      call check_base(base, error)
      if (.not. allocated(error) .and. .not. allocated(handle%problem%mesh)) &
         call new_error(error, status_order, "cells join nodes: call kschur_problem_set_nodes first")
      if (.not. allocated(error) .and. (cells < 0 .or. cells > most)) &
         call new_error(error, status_input, "there cannot be "//text(cells)//" cells")
      call take_indices(offset, "offset", .false., cells + 1, 0, most, offsets, error)
      if (.not. allocated(error)) then
         entries = offsets(cells + 1) - 1
         associate (nodes => handle%problem%mesh%nodes())
            call take_indices(node, "node", .false., entries, int(base), int(nodes - 1, c_int64_t), connectivity, error)
         end associate
      end if
      call take_indices(kind, "type", .false., cells, 0, 255_c_int64_t, types, error)
      if (.not. allocated(error)) then
         handle%problem%mesh%offsets = offsets - 1
         handle%problem%mesh%connectivity = connectivity
         handle%problem%mesh%types = types - 1
         handle%checked = .false.
      end if
      status = outcome(handle, error)
   end function kschur_problem_set_cells

   subroutine check_base(base, error)
      integer(c_int), intent(in) :: base
      type(error_type), allocatable, intent(out) :: error

      if (base /= 0 .and. base /= 1) &
         call new_error(error, status_usage, "the index base is "//text(int(base))//" but must be 0 or 1")
   end subroutine check_base
end module kschur_capi_mesh
