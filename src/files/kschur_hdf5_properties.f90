!> Modal properties in the group /properties of a result.
module kschur_hdf5_properties
   use hdf5, only: hid_t
   use kschur_error, only: error_type, new_error, error_input
   use kschur_hdf5_basics, only: create_group, exists
   use kschur_hdf5_datasets, only: read_dataset, write_dataset
   use kschur_properties, only: modal_properties_type
   implicit none
   private
   public :: read_properties, write_properties

   character(len=*), parameter :: group = "/properties"

contains

   !> Writes the properties, if allocated.
   subroutine write_properties(file, properties, error)
      integer(hid_t), intent(in) :: file
      type(modal_properties_type), allocatable, intent(in) :: properties
      type(error_type), allocatable, intent(inout) :: error

      if (.not. allocated(properties)) return
      call create_group(file, group, error)
      call write_dataset(file, group//"/generalised_mass", properties%mass, error)
      call write_dataset(file, group//"/generalised_damping", properties%damping, error)
      call write_dataset(file, group//"/generalised_stiffness", properties%stiffness, error)
      call write_dataset(file, group//"/modal_a", properties%a, error)
      call write_dataset(file, group//"/modal_b", properties%b, error)
      call write_dataset(file, group//"/participation", properties%participation, error)
      call write_dataset(file, group//"/effective_mass", properties%effective_mass, error)
      call write_dataset(file, group//"/total_mass", properties%total_mass, error)
      call write_dataset(file, group//"/direction", properties%direction, error)
   end subroutine write_properties

   !> Reads the properties, if present; fails if they do not belong to `modes` modes.
   subroutine read_properties(properties, file, modes, error)
      type(modal_properties_type), allocatable, intent(out) :: properties
      integer(hid_t), intent(in) :: file
      integer, intent(in) :: modes
      type(error_type), allocatable, intent(inout) :: error
      integer :: directions

      if (.not. exists(file, group, error)) return
      allocate (properties)
      call read_dataset(properties%mass, file, group//"/generalised_mass", error, modes)
      call read_dataset(properties%damping, file, group//"/generalised_damping", error, modes)
      call read_dataset(properties%stiffness, file, group//"/generalised_stiffness", error, modes)
      call read_dataset(properties%a, file, group//"/modal_a", error)
      call read_dataset(properties%b, file, group//"/modal_b", error)
      call read_dataset(properties%participation, file, group//"/participation", error)
      call read_dataset(properties%effective_mass, file, group//"/effective_mass", error)
      call read_dataset(properties%total_mass, file, group//"/total_mass", error)
      call read_dataset(properties%direction, file, group//"/direction", error)
      if (allocated(error)) return
      directions = size(properties%total_mass)
      if (any([size(properties%a), size(properties%b), shape(properties%participation), shape(properties%effective_mass)] /= &
         [modes, modes, modes, directions, modes, directions]) .or. size(properties%direction) /= directions) &
         call new_error(error, error_input, "the modal properties do not fit the modes")
   end subroutine read_properties
end module kschur_hdf5_properties
