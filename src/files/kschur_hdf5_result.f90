!> Results in HDF5 files: a dataset for each array, /history for convergence tests, everything else as root attributes. Complex
!> numbers are the compound {r, i} of h5py.
module kschur_hdf5_result
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use hdf5, only: hid_t
   use kschur_error, only: error_type, new_error, add_context, error_input, error_memory, error_usage
   use kschur_hdf5_attributes, only: has_attribute
   use kschur_hdf5_basics, only: output_type, printing_type, silence_hdf5, restore_printing, forbid_external_links, &
      open_hdf5_file, create_hdf5_file, close_hdf5_file, finish_hdf5_file, create_group, exists
   use kschur_hdf5_datasets, only: read_dataset, write_dataset, kind_length
   use kschur_hdf5_facts, only: position_of, read_facts, read_options, write_facts, write_options
   use kschur_hdf5_mesh, only: bytes_of_mesh, read_mesh, write_mesh
   use kschur_hdf5_properties, only: read_properties, write_properties
   use kschur_kinds, only: wp, long
   use kschur_result, only: modal_result_type, history_type, kind_names
   use kschur_trial, only: try_in_child
   implicit none
   private
   public :: is_hdf5_result, read_hdf5_result, write_hdf5_result
   public :: bytes_of, is_whole, read_result, write_result

contains

   !> Writes a result, which must have all arrays except the history. The file appears under its name when it is complete.
   subroutine write_hdf5_result(result, path, error)
      type(modal_result_type), intent(in) :: result
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      type(output_type) :: output

      if (.not. is_whole(result)) then
         call new_error(error, error_usage, path//": the result is incomplete and cannot be written: a solve fills one")
         return
      end if
      call create_hdf5_file(output, path, bytes_of(result), error)
      call write_result(output%file, result, error)
      call finish_hdf5_file(output, error)
   end subroutine write_hdf5_result

   !> Writes a result that is whole into a file, or into a group of one.
   subroutine write_result(file, result, error)
      integer(hid_t), intent(in) :: file
      type(modal_result_type), intent(in) :: result
      type(error_type), allocatable, intent(inout) :: error

      call write_modes(file, result, error)
      call write_mesh(file, result%mesh, error)
      call write_properties(file, result%properties, error)
      call write_history(file, result%history, error)
      call write_facts(file, result, error)
      call write_options(file, result, error)
   end subroutine write_result

   !> Whether a result has all arrays that a file needs.
   pure logical function is_whole(result)
      type(modal_result_type), intent(in) :: result

      is_whole = allocated(result%eigenvalues) .and. allocated(result%eigenvectors) .and. &
         allocated(result%multipliers) .and. allocated(result%frequency_hz) .and. &
         allocated(result%damped_frequency_hz) .and. allocated(result%damping_ratio) .and. &
         allocated(result%backward_error) .and. allocated(result%error_bound) .and. &
         allocated(result%kind) .and. allocated(result%method)
      if (allocated(result%left_eigenvectors)) &
         is_whole = is_whole .and. allocated(result%left_multipliers) .and. allocated(result%condition)
   end function is_whole

   !> Size of the arrays that may be large, in bytes.
   pure integer(long) function bytes_of(result)
      type(modal_result_type), intent(in) :: result
      integer(long), parameter :: bytes_of_a_complex = 2*storage_size(1.0_wp)/8

      bytes_of = size(result%eigenvectors, kind=long) + size(result%multipliers, kind=long)
      if (allocated(result%left_eigenvectors)) bytes_of = 2*bytes_of
      bytes_of = bytes_of_a_complex*bytes_of + bytes_of_mesh(result%mesh)
   end function bytes_of

   subroutine write_modes(file, result, error)
      integer(hid_t), intent(in) :: file
      type(modal_result_type), intent(in) :: result
      type(error_type), allocatable, intent(inout) :: error
      character(len=kind_length) :: words(size(result%kind))

      words = kind_names(result%kind)
      call write_dataset(file, "/eigenvalues", result%eigenvalues, error)
      call write_dataset(file, "/eigenvectors", result%eigenvectors, error)
      call write_dataset(file, "/multipliers", result%multipliers, error)
      call write_dataset(file, "/frequency_hz", result%frequency_hz, error)
      call write_dataset(file, "/damped_frequency_hz", result%damped_frequency_hz, error)
      call write_dataset(file, "/damping_ratio", result%damping_ratio, error)
      if (allocated(result%loss_factor)) call write_dataset(file, "/loss_factor", result%loss_factor, error)
      call write_dataset(file, "/backward_error", result%backward_error, error)
      call write_dataset(file, "/error", result%error_bound, error)
      call write_dataset(file, "/kind", words, error)
      if (.not. allocated(result%left_eigenvectors)) return
      call write_dataset(file, "/left_eigenvectors", result%left_eigenvectors, error)
      call write_dataset(file, "/left_multipliers", result%left_multipliers, error)
      call write_dataset(file, "/condition_number", result%condition, error)
   end subroutine write_modes

   subroutine write_history(file, history, error)
      integer(hid_t), intent(in) :: file
      type(history_type), intent(in) :: history
      type(error_type), allocatable, intent(inout) :: error

      if (.not. allocated(history%residual)) return
      call create_group(file, "/history", error)
      call write_dataset(file, "/history/converged", history%converged, error)
      call write_dataset(file, "/history/operator_applications", history%operator_applications, error)
      call write_dataset(file, "/history/residual", history%residual, error)
   end subroutine write_history

   !> Reads a result that `write_hdf5_result` wrote. Fails with the file and the reason.
   subroutine read_hdf5_result(result, path, error, trial)
      type(modal_result_type), intent(out) :: result
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      !> As that of `read_hdf5_problem`.
      logical, intent(in), optional :: trial
      type(printing_type) :: printing

      call silence_hdf5(printing, error)
      call try_in_child(read_and_discard, path, "result", error, trial)
      call read_all(result, path, error)
      call restore_printing(printing)
      call add_context(error, path)
   end subroutine read_hdf5_result

   !> Whether a file is a result, even a damaged one; false if it cannot be read.
   logical function is_hdf5_result(path, trial)
      character(len=*), intent(in) :: path
      !> As that of `read_hdf5_problem`.
      logical, intent(in), optional :: trial
      type(error_type), allocatable :: error
      type(printing_type) :: printing

      call silence_hdf5(printing, error)
      call try_in_child(check_for_result, path, "result", error, trial)
      call check_for_result(path, [0, 1], error)
      call restore_printing(printing)
      is_hdf5_result = .not. allocated(error)
   end function is_hdf5_result

   ! Opens a file and fails if it is not a result, as `try_in_child` wants it.
   subroutine check_for_result(path, part, error)
      character(len=*), intent(in) :: path
      integer, intent(in) :: part(2)
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: file

      associate (always_whole => part)
      end associate
      call open_hdf5_file(file, path, error)
      call check_is_result(file, error)
      call close_hdf5_file(file)
   end subroutine check_for_result

   ! Fails if an open file has neither the mark of kschur nor eigenvalues.
   subroutine check_is_result(file, error)
      integer(hid_t), intent(in) :: file
      type(error_type), allocatable, intent(inout) :: error
      logical :: marked

      marked = has_attribute(file, "/", "kschur", error)
      if (.not. marked) marked = exists(file, "/eigenvalues", error)
      if (.not. marked .and. .not. allocated(error)) call new_error(error, error_input, "not a result of kschur")
   end subroutine check_is_result

   ! Trial for `try_in_child`: reads a result.
   subroutine read_and_discard(path, part, error)
      character(len=*), intent(in) :: path
      integer, intent(in) :: part(2)
      type(error_type), allocatable, intent(inout) :: error
      type(modal_result_type) :: result

      associate (always_whole => part)
      end associate
      call forbid_external_links()
      call read_all(result, path, error)
   end subroutine read_and_discard

   ! Reads all parts of a result; errors of a file that is one begin with "a damaged result".
   subroutine read_all(result, path, error)
      type(modal_result_type), intent(inout) :: result
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: file
      logical :: marked

      call open_hdf5_file(file, path, error)
      if (has_attribute(file, "/", "kschur_sweep", error)) call new_error(error, error_input, &
         "a sweep, not a result: kschur view --point takes the modes of one of its points")
      call check_is_result(file, error)
      marked = .not. allocated(error)
      call read_result(result, file, error)
      call close_hdf5_file(file)
      if (marked) call add_context(error, "a damaged result")
   end subroutine read_all

   !> Reads a result from a file, or from a group of one, that is marked as one: what fails is damaged.
   subroutine read_result(result, file, error)
      type(modal_result_type), intent(inout) :: result
      integer(hid_t), intent(in) :: file
      type(error_type), allocatable, intent(inout) :: error

      if (allocated(error)) return
      call read_facts(result, file, error)
      call read_options(result, file, error)
      call read_modes(result, file, error)
      call read_mesh(result%mesh, file, result%unknowns, error)
      if (.not. allocated(error)) call read_properties(result%properties, file, size(result%eigenvalues), error)
      call read_history(result%history, file, error)
      if (.not. allocated(error)) call check_shapes(result, error)
      if (allocated(error)) error%code = merge(error_memory, error_input, error%code == error_memory)
   end subroutine read_result

   subroutine read_modes(result, file, error)
      type(modal_result_type), intent(inout) :: result
      integer(hid_t), intent(in) :: file
      type(error_type), allocatable, intent(inout) :: error
      character(len=kind_length), allocatable :: words(:)
      integer :: k

      call read_dataset(result%eigenvalues, file, "/eigenvalues", error)
      call read_dataset(result%eigenvectors, file, "/eigenvectors", error)
      call read_dataset(result%multipliers, file, "/multipliers", error)
      call read_dataset(result%frequency_hz, file, "/frequency_hz", error)
      call read_dataset(result%damped_frequency_hz, file, "/damped_frequency_hz", error)
      call read_dataset(result%damping_ratio, file, "/damping_ratio", error)
      if (exists(file, "/loss_factor", error)) call read_dataset(result%loss_factor, file, "/loss_factor", error)
      call read_dataset(result%backward_error, file, "/backward_error", error)
      if (exists(file, "/error", error)) then
         call read_dataset(result%error_bound, file, "/error", error)
      else if (allocated(result%backward_error)) then
         ! Not in files of 0.1.0.
         allocate (result%error_bound, source=0*result%backward_error + ieee_value(1.0_wp, ieee_quiet_nan))
      end if
      call read_dataset(words, file, "/kind", error)
      if (allocated(error)) return
      result%options%left = exists(file, "/left_eigenvectors", error)
      if (result%options%left) then
         call read_dataset(result%left_eigenvectors, file, "/left_eigenvectors", error)
         call read_dataset(result%left_multipliers, file, "/left_multipliers", error)
         call read_dataset(result%condition, file, "/condition_number", error)
      end if
      if (allocated(error)) return
      allocate (result%kind(size(words)))
      do k = 1, size(words)
         result%kind(k) = position_of(trim(words(k)), kind_names, "/kind", error)
      end do
   end subroutine read_modes

   subroutine read_history(history, file, error)
      type(history_type), intent(inout) :: history
      integer(hid_t), intent(in) :: file
      type(error_type), allocatable, intent(inout) :: error

      if (.not. exists(file, "/history", error)) return
      call read_dataset(history%converged, file, "/history/converged", 0, huge(1), error)
      call read_dataset(history%operator_applications, file, "/history/operator_applications", 0, huge(1), error)
      call read_dataset(history%residual, file, "/history/residual", error)
   end subroutine read_history

   ! Fails if the arrays of a result do not fit together.
   subroutine check_shapes(result, error)
      type(modal_result_type), intent(in) :: result
      type(error_type), allocatable, intent(inout) :: error
      integer :: modes, losses

      modes = size(result%eigenvalues)
      losses = modes
      if (allocated(result%loss_factor)) losses = size(result%loss_factor)
      if (any([size(result%eigenvectors, 2), size(result%multipliers, 2), size(result%frequency_hz), &
         size(result%damped_frequency_hz), size(result%damping_ratio), size(result%backward_error), size(result%error_bound), &
         size(result%kind), losses] /= modes)) then
         call new_error(error, error_input, "the datasets of modes differ in their number of modes")
      else if (any([size(result%eigenvectors, 1), size(result%multipliers, 1)] /= &
         [result%unknowns, result%constraints])) then
         call new_error(error, error_input, "the mode shapes do not have n unknowns and m multipliers")
      else if (result%options%left) then
         if (any([shape(result%left_eigenvectors), shape(result%left_multipliers), size(result%condition)] /= &
            [result%unknowns, modes, result%constraints, modes, modes])) call new_error(error, error_input, &
            "the left vectors and condition numbers do not fit the modes")
      end if
   end subroutine check_shapes
end module kschur_hdf5_result
