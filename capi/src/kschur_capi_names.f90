!> Contents of a result by name: names of result files, and of modal properties.
module kschur_capi_names
   use kschur, only: modal_result_type, phase_names, purpose_names, wp
   implicit none
   private
   public :: find_columns, gather_numbers

contains

   !> Returns the numbers of a name; not allocated if the result lacks them.
   subroutine gather_numbers(result, name, numbers, known)
      type(modal_result_type), intent(in) :: result
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(out) :: numbers(:)
      !> Whether there is such a name.
      logical, intent(out) :: known

      call gather_modes(result, name, numbers, known)
      if (.not. known) call gather_facts(result, name, numbers, known)
      if (.not. known) call gather_properties(result, name, numbers, known)
      if (.not. known) call gather_mesh(result, name, numbers, known)
   end subroutine gather_numbers

   !> Returns the vectors of a name, one column for each mode; null if the result lacks them.
   subroutine find_columns(result, name, columns, known)
      type(modal_result_type), target, intent(in) :: result
      character(len=*), intent(in) :: name
      complex(wp), pointer, intent(out) :: columns(:, :)
      logical, intent(out) :: known

      nullify (columns)
      known = .true.
      select case (name)
      case ("eigenvectors")
         if (allocated(result%eigenvectors)) columns => result%eigenvectors
      case ("multipliers")
         if (allocated(result%multipliers)) columns => result%multipliers
      case ("left_eigenvectors")
         if (allocated(result%left_eigenvectors)) columns => result%left_eigenvectors
      case ("left_multipliers")
         if (allocated(result%left_multipliers)) columns => result%left_multipliers
      case default
         known = .false.
      end select
   end subroutine find_columns

   ! Returns numbers of modes, one or one pair for each.
   subroutine gather_modes(result, name, numbers, known)
      type(modal_result_type), intent(in) :: result
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(inout) :: numbers(:)
      logical, intent(out) :: known

      known = .true.
      select case (name)
      case ("eigenvalues")
         numbers = pairs(result%eigenvalues)
      case ("frequency_hz")
         if (allocated(result%frequency_hz)) numbers = result%frequency_hz
      case ("damped_frequency_hz")
         if (allocated(result%damped_frequency_hz)) numbers = result%damped_frequency_hz
      case ("damping_ratio")
         if (allocated(result%damping_ratio)) numbers = result%damping_ratio
      case ("loss_factor")
         allocate (numbers(0))
         if (allocated(result%loss_factor)) numbers = result%loss_factor
      case ("backward_error")
         if (allocated(result%backward_error)) numbers = result%backward_error
      case ("error")
         if (allocated(result%error_bound)) numbers = result%error_bound
      case ("kind")
         if (allocated(result%kind)) numbers = real(result%kind, wp)
      case ("condition_number")
         if (allocated(result%condition)) numbers = result%condition
      case default
         known = .false.
      end select
   end subroutine gather_modes

   ! Returns numbers of the solve as a whole: sizes, outcome and effort.
   subroutine gather_facts(result, name, numbers, known)
      type(modal_result_type), intent(in) :: result
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(inout) :: numbers(:)
      logical, intent(out) :: known
      real(wp) :: phases(size(phase_names))

      known = .true.
      select case (name)
      case ("n")
         numbers = [real(result%unknowns, wp)]
      case ("m")
         numbers = [real(result%constraints, wp)]
      case ("modes")
         numbers = [real(size(result%eigenvalues), wp)]
      case ("modes_asked")
         numbers = [real(result%modes_asked, wp)]
      case ("reason")
         numbers = [real(result%reason, wp)]
      case ("certified")
         numbers = [real(result%certified, wp)]
      case ("missing")
         numbers = [real(result%missing, wp)]
      case ("redundant_constraints")
         numbers = [real(result%redundant_constraints, wp)]
      case ("target")
         numbers = pairs([result%target])
      case ("shift")
         numbers = pairs([result%shift])
      case ("operator_applications")
         numbers = [real(result%operator_applications, wp)]
      case ("restarts")
         numbers = [real(result%restarts, wp)]
      case ("factorizations")
         numbers = [real(result%factorizations, wp)]
      case ("wanted_after")
         numbers = [real(result%history%wanted_after(result%options%tolerance), wp)]
      case ("factored_order")
         numbers = [real(result%factored_order, wp)]
      case ("factor_entries")
         numbers = [real(result%factor_entries, wp)]
      case ("seconds_total")
         numbers = [result%seconds%total]
      case default
         phases = result%seconds%of_phases()
         known = any("seconds_"//phase_names == name)
         if (known) numbers = pack(phases, "seconds_"//phase_names == name)
         if (known) return
         known = any("factorizations_for_"//purpose_names == name)
         if (known) numbers = pack(real(result%factorizations_for, wp), "factorizations_for_"//purpose_names == name)
      end select
   end subroutine gather_facts

   ! Returns modal properties; not allocated if they were not computed.
   subroutine gather_properties(result, name, numbers, known)
      type(modal_result_type), intent(in) :: result
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(inout) :: numbers(:)
      logical, intent(out) :: known
      character(len=*), parameter :: names(8) = [character(len=22) :: "generalised_mass", "generalised_damping", &
         "generalised_stiffness", "modal_a", "modal_b", "participation_factors", "effective_mass", "total_mass"]

      known = any(names == name)
      if (.not. (known .and. allocated(result%properties))) return
      associate (properties => result%properties)
         select case (name)
         case ("generalised_mass")
            numbers = properties%mass
         case ("generalised_damping")
            numbers = properties%damping
         case ("generalised_stiffness")
            numbers = properties%stiffness
         case ("modal_a")
            numbers = pairs(properties%a)
         case ("modal_b")
            numbers = pairs(properties%b)
         case ("participation_factors")
            numbers = pairs(reshape(properties%participation, [size(properties%participation)]))
         case ("effective_mass")
            numbers = reshape(properties%effective_mass, [size(properties%effective_mass)])
         case ("total_mass")
            numbers = properties%total_mass
         end select
      end associate
   end subroutine gather_properties

   ! Returns numbers of the mesh and its transformation, with indices from 0; not allocated without a mesh.
   subroutine gather_mesh(result, name, numbers, known)
      type(modal_result_type), intent(in) :: result
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(inout) :: numbers(:)
      logical, intent(out) :: known
      character(len=*), parameter :: names(9) = [character(len=22) :: "coordinates", "unknown_node", "unknown_component", &
         "cells_offsets", "cells_connectivity", "cells_types", "transformation_indptr", "transformation_indices", &
         "transformation_data"]

      known = any(names == name)
      if (.not. (known .and. allocated(result%mesh))) return
      associate (mesh => result%mesh)
         select case (name)
         case ("coordinates")
            numbers = reshape(mesh%coordinates, [size(mesh%coordinates)])
         case ("unknown_node")
            numbers = real(mesh%unknown_node - 1, wp)
         case ("unknown_component")
            numbers = real(mesh%unknown_component, wp)
         case ("cells_offsets")
            numbers = real(mesh%offsets, wp)
         case ("cells_connectivity")
            numbers = real(mesh%connectivity - 1, wp)
         case ("cells_types")
            numbers = real(mesh%types, wp)
         end select
         if (.not. allocated(mesh%transformation)) return
         select case (name)
         case ("transformation_indptr")
            numbers = real(mesh%transformation%row_start - 1, wp)
         case ("transformation_indices")
            numbers = real(mesh%transformation%column - 1, wp)
         case ("transformation_data")
            numbers = mesh%transformation%value
         end select
      end associate
   end subroutine gather_mesh

   ! Interleaved real and imaginary parts.
   pure function pairs(values)
      complex(wp), intent(in) :: values(:)
      real(wp) :: pairs(2*size(values))

      pairs(1::2) = real(values, wp)
      pairs(2::2) = aimag(values)
   end function pairs
end module kschur_capi_names
