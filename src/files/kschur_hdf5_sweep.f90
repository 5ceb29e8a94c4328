!> A sweep in an HDF5 file: parameter values, branches, events. Datasets in h5py: points x branches. Where the modes of points are
!> kept, the group /points/K is the result of point K, from 1, as in a file of `kschur_hdf5_result`: with shapes and mesh.
module kschur_hdf5_sweep
   use hdf5, only: hid_t
   use kschur_error, only: add_context, error_input, error_type, new_error, error_usage
   use kschur_hdf5_attributes, only: has_attribute, read_attribute, write_attribute
   use kschur_hdf5_basics, only: output_type, printing_type, close_group, close_hdf5_file, create_group, create_hdf5_file, exists, &
      finish_hdf5_file, forbid_external_links, open_group, open_hdf5_file, restore_printing, silence_hdf5
   use kschur_hdf5_datasets, only: read_dataset, write_dataset, kind_length
   use kschur_hdf5_facts, only: position_of
   use kschur_hdf5_result, only: bytes_of, is_whole, read_result, write_result
   use kschur_kept_result, only: kept_result_type
   use kschur_kinds, only: long, wp
   use kschur_release, only: kschur_version
   use kschur_result, only: modal_result_type
   use kschur_sweep, only: sweep_type, event_names
   use kschur_text, only: text
   use kschur_trial, only: try_in_child
   implicit none
   private
   public :: is_hdf5_sweep, read_hdf5_sweep, read_hdf5_sweep_point, write_hdf5_sweep

   character(len=*), parameter :: root = "/", points = "/points"

contains

   !> Writes a finished sweep. The file appears under its name when it is complete.
   subroutine write_hdf5_sweep(sweep, parameter, path, error, unit, kept)
      type(sweep_type), intent(in) :: sweep
      !> The name of the parameter.
      character(len=*), intent(in) :: parameter
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      !> Unit of the parameter. Absent or empty: unknown.
      character(len=*), intent(in), optional :: unit
      !> Results of the points, whose shapes and meshes the file keeps; not associated: not those of this point.
      type(kept_result_type), intent(in), optional :: kept(:)
      integer(long), parameter :: bytes_of_a_mode = 40
      character(len=kind_length), allocatable :: kinds(:)
      type(output_type) :: output
      integer(long) :: bytes

      if (.not. allocated(sweep%eigenvalues)) then
         call new_error(error, error_usage, path//": the sweep is not finished and cannot be written: call finish first")
         return
      end if
      bytes = bytes_of_a_mode*size(sweep%eigenvalues, kind=long)
      if (present(kept)) then
         call check_kept(kept, size(sweep%values), bytes, error)
         call add_context(error, path)
         if (allocated(error)) return
      end if
      call create_hdf5_file(output, path, bytes, error)
      call write_attribute(output%file, root, "kschur_sweep", kschur_version, error)
      call write_attribute(output%file, root, "parameter", parameter, error)
      if (present(unit)) then
         if (unit /= "") call write_attribute(output%file, root, "unit", unit, error)
      end if
      call write_dataset(output%file, "/values", sweep%values, error)
      call write_dataset(output%file, "/eigenvalues", sweep%eigenvalues, error)
      call write_dataset(output%file, "/frequency_hz", sweep%frequency_hz, error)
      call write_dataset(output%file, "/damping_ratio", sweep%damping_ratio, error)
      call write_dataset(output%file, "/share", sweep%share, error)
      call create_group(output%file, "/events", error)
      allocate (kinds(size(sweep%events)))
      kinds = event_names(sweep%events%kind)
      call write_dataset(output%file, "/events/kind", kinds, error)
      call write_dataset(output%file, "/events/first", [sweep%events%first], error)
      call write_dataset(output%file, "/events/second", [sweep%events%second], error)
      call write_dataset(output%file, "/events/value", [sweep%events%value], error)
      call create_group(output%file, "/onsets", error)
      call write_dataset(output%file, "/onsets/branch", [sweep%onsets%branch], error)
      call write_dataset(output%file, "/onsets/unstable", [merge(1, 0, sweep%onsets%unstable)], error)
      call write_dataset(output%file, "/onsets/value", [sweep%onsets%value], error)
      call write_dataset(output%file, "/onsets/within", [sweep%onsets%within], error)
      if (present(kept)) call write_points(output%file, kept, error)
      call finish_hdf5_file(output, error)
   end subroutine write_hdf5_sweep

   ! Adds the bytes of kept results; fails if one is incomplete, or there are more than points.
   subroutine check_kept(kept, points, bytes, error)
      type(kept_result_type), intent(in) :: kept(:)
      integer, intent(in) :: points
      integer(long), intent(inout) :: bytes
      type(error_type), allocatable, intent(inout) :: error
      integer :: k

      if (size(kept) > points) call new_error(error, error_usage, "there are results of "//text(size(kept))//" points, but "// &
         text(points)//" points")
      do k = 1, size(kept)
         if (allocated(error)) return
         if (.not. associated(kept(k)%result)) cycle
         if (is_whole(kept(k)%result)) then
            bytes = bytes + bytes_of(kept(k)%result)
         else
            call new_error(error, error_usage, "the result of point "//text(k)//" is incomplete and cannot be written")
         end if
      end do
   end subroutine check_kept

   subroutine write_points(file, kept, error)
      integer(hid_t), intent(in) :: file
      type(kept_result_type), intent(in) :: kept(:)
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: group
      integer :: k

      call create_group(file, points, error)
      do k = 1, size(kept)
         if (.not. associated(kept(k)%result)) cycle
         call create_group(file, trim(point_name(k)), error)
         call open_group(group, file, trim(point_name(k)), error)
         call write_result(group, kept(k)%result, error)
         call close_group(group)
      end do
   end subroutine write_points

   ! Name of the group of a point. Of fixed length: for a deferred one gfortran keeps the length in static memory.
   pure function point_name(point) result(name)
      integer, intent(in) :: point
      character(len=32) :: name

      name = points//"/"//text(point)
   end function point_name

   !> Whether a file is a sweep; false if it cannot be read.
   logical function is_hdf5_sweep(path)
      character(len=*), intent(in) :: path
      type(error_type), allocatable :: error
      type(printing_type) :: printing
      integer(hid_t) :: file

      call silence_hdf5(printing, error)
      call open_hdf5_file(file, path, error)
      is_hdf5_sweep = has_attribute(file, root, "kschur_sweep", error)
      call close_hdf5_file(file)
      call restore_printing(printing)
      is_hdf5_sweep = is_hdf5_sweep .and. .not. allocated(error)
   end function is_hdf5_sweep

   !> Reads a sweep that `write_hdf5_sweep` wrote: results of a finished sweep, without positions of modes. No point can be
   !> added. Fails with the file and the reason.
   subroutine read_hdf5_sweep(sweep, parameter, unit, path, error, kept)
      type(sweep_type), intent(out) :: sweep
      !> Name and unit of the parameter; the unit is empty if unknown.
      character(len=:), allocatable, intent(out) :: parameter, unit
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      !> Of which points the file keeps the results, for `read_hdf5_sweep_point`.
      logical, allocatable, intent(out), optional :: kept(:)
      type(printing_type) :: printing
      integer(hid_t) :: file

      unit = ""
      call silence_hdf5(printing, error)
      call open_hdf5_file(file, path, error)
      call check_is_sweep(file, error)
      call read_attribute(parameter, file, root, "parameter", error)
      if (has_attribute(file, root, "unit", error)) call read_attribute(unit, file, root, "unit", error)
      call read_dataset(sweep%values, file, "/values", error)
      call read_dataset(sweep%eigenvalues, file, "/eigenvalues", error)
      call read_dataset(sweep%frequency_hz, file, "/frequency_hz", error)
      call read_dataset(sweep%damping_ratio, file, "/damping_ratio", error)
      call read_dataset(sweep%share, file, "/share", error)
      call read_events(sweep, file, error)
      call read_onsets(sweep, file, error)
      if (present(kept) .and. .not. allocated(error)) call find_kept(kept, size(sweep%values), file, error)
      call close_hdf5_file(file)
      if (.not. allocated(error)) call check_shapes(sweep, error)
      call restore_printing(printing)
      call add_context(error, path)
   end subroutine read_hdf5_sweep

   !> Reads the modes of a point, if the sweep was written with them. Fails with the file and the reason.
   subroutine read_hdf5_sweep_point(result, path, point, error, trial)
      type(modal_result_type), intent(out) :: result
      character(len=*), intent(in) :: path
      !> From 1.
      integer, intent(in) :: point
      type(error_type), allocatable, intent(out) :: error
      !> As that of `read_hdf5_problem`.
      logical, intent(in), optional :: trial
      type(printing_type) :: printing

      call silence_hdf5(printing, error)
      call try_in_child(read_and_discard_point, path, "sweep", error, trial, [point, 0])
      call read_point(result, path, point, error)
      call restore_printing(printing)
      call add_context(error, path)
   end subroutine read_hdf5_sweep_point

   subroutine read_and_discard_point(path, part, error)
      character(len=*), intent(in) :: path
      !> The first is the point.
      integer, intent(in) :: part(2)
      type(error_type), allocatable, intent(inout) :: error
      type(modal_result_type) :: result

      call forbid_external_links()
      call read_point(result, path, part(1), error)
   end subroutine read_and_discard_point

   subroutine read_point(result, path, point, error)
      type(modal_result_type), intent(inout) :: result
      character(len=*), intent(in) :: path
      integer, intent(in) :: point
      type(error_type), allocatable, intent(inout) :: error
      real(wp), allocatable :: values(:)
      logical, allocatable :: kept(:)
      integer(hid_t) :: file, group

      call open_hdf5_file(file, path, error)
      call check_is_sweep(file, error)
      call read_dataset(values, file, "/values", error)
      if (.not. allocated(error)) call find_kept(kept, size(values), file, error)
      if (.not. allocated(error)) then
         if (point < 1 .or. point > size(kept)) then
            call new_error(error, error_input, "there is no point "//text(point)//": the sweep has points 1 to "//text(size(kept)))
         else if (.not. kept(point)) then
            call new_error(error, error_input, "the modes of point "//text(point)// &
               " are not in it: kschur sweep --shapes keeps them")
         else
            call open_group(group, file, trim(point_name(point)), error)
            call read_result(result, group, error)
            call close_group(group)
            call add_context(error, "point "//text(point))
         end if
      end if
      call close_hdf5_file(file)
   end subroutine read_point

   subroutine check_is_sweep(file, error)
      integer(hid_t), intent(in) :: file
      type(error_type), allocatable, intent(inout) :: error

      if (has_attribute(file, root, "kschur_sweep", error)) return
      if (.not. allocated(error)) call new_error(error, error_input, "not a sweep of kschur")
   end subroutine check_is_sweep

   subroutine find_kept(kept, number, file, error)
      logical, allocatable, intent(out) :: kept(:)
      !> Of points.
      integer, intent(in) :: number
      integer(hid_t), intent(in) :: file
      type(error_type), allocatable, intent(inout) :: error
      integer :: k

      allocate (kept(number), source=.false.)
      if (.not. exists(file, points, error)) return
      do k = 1, number
         kept(k) = exists(file, trim(point_name(k)), error)
      end do
   end subroutine find_kept

   subroutine read_events(sweep, file, error)
      type(sweep_type), intent(inout) :: sweep
      integer(hid_t), intent(in) :: file
      type(error_type), allocatable, intent(inout) :: error
      character(len=kind_length), allocatable :: kinds(:)
      integer, allocatable :: first(:), second(:)
      real(wp), allocatable :: value(:)
      integer :: i

      call read_dataset(kinds, file, "/events/kind", error)
      if (allocated(error)) return
      call read_dataset(first, file, "/events/first", 0, huge(1), error, size(kinds))
      call read_dataset(second, file, "/events/second", 0, huge(1), error, size(kinds))
      call read_dataset(value, file, "/events/value", error, size(kinds))
      if (allocated(error)) return
      allocate (sweep%events(size(kinds)))
      do i = 1, size(kinds)
         sweep%events(i)%kind = position_of(trim(kinds(i)), event_names, "/events/kind", error)
      end do
      sweep%events%first = first
      sweep%events%second = second
      sweep%events%value = value
   end subroutine read_events

   subroutine read_onsets(sweep, file, error)
      type(sweep_type), intent(inout) :: sweep
      integer(hid_t), intent(in) :: file
      type(error_type), allocatable, intent(inout) :: error
      integer, allocatable :: branch(:), unstable(:)
      real(wp), allocatable :: value(:), within(:)

      call read_dataset(branch, file, "/onsets/branch", 1, huge(1), error)
      if (allocated(error)) return
      call read_dataset(unstable, file, "/onsets/unstable", 0, 1, error, size(branch))
      call read_dataset(value, file, "/onsets/value", error, size(branch))
      call read_dataset(within, file, "/onsets/within", error, size(branch))
      if (allocated(error)) return
      allocate (sweep%onsets(size(branch)))
      sweep%onsets%branch = branch
      sweep%onsets%unstable = unstable == 1
      sweep%onsets%value = value
      sweep%onsets%within = within
   end subroutine read_onsets

   subroutine check_shapes(sweep, error)
      type(sweep_type), intent(in) :: sweep
      type(error_type), allocatable, intent(inout) :: error
      integer :: extents(2)

      extents = [size(sweep%eigenvalues, 1), size(sweep%values)]
      if (any([shape(sweep%eigenvalues), shape(sweep%frequency_hz), shape(sweep%damping_ratio), shape(sweep%share)] /= &
         [extents, extents, extents, extents])) then
         call new_error(error, error_input, "the datasets differ in their numbers of points and branches")
      else if (any([sweep%events%first, sweep%events%second, sweep%onsets%branch] > extents(1))) then
         call new_error(error, error_input, "an event or an onset names a branch that is not there")
      end if
   end subroutine check_shapes
end module kschur_hdf5_sweep
