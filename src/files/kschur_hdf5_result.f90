!> Results in HDF5 files: a dataset for each array, /history for the looks at convergence,
!> and the rest as attributes of the root. Complex numbers are the compound
!> {r, i} of h5py.
module kschur_hdf5_result
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use hdf5, only: hid_t
   use kschur_effort, only: phase_names
   use kschur_error, only: error_type, new_error, add_context, error_input, error_memory, error_usage
   use kschur_files, only: staging_type
   use kschur_hdf5_attributes, only: has_attribute, read_attribute, write_attribute
   use kschur_hdf5_basics, only: printing_type, silence_hdf5, restore_printing, forbid_external_links, &
      open_hdf5_file, create_hdf5_file, close_hdf5_file, finish_hdf5_file, create_group, exists
   use kschur_hdf5_datasets, only: read_dataset, write_dataset, word_length
   use kschur_hdf5_mesh, only: bytes_of_mesh, read_mesh, write_mesh
   use kschur_hdf5_properties, only: read_properties, write_properties
   use kschur_kinds, only: wp, long
   use kschur_options, only: arpack_names, formulation_names, index_of_name, inner_names, method_names, &
      normalisation_names, scaling_names
   use kschur_problem, only: damping_names
   use kschur_result, only: modal_result_type, certified_names, history_type, kind_names, reason_names
   use kschur_release, only: kschur_version
   use kschur_trial, only: try_in_child
   implicit none
   private
   public :: is_hdf5_result, read_hdf5_result, write_hdf5_result

   character(len=*), parameter :: root = "/", line_end = achar(10)

contains

   !> Writes a result, which must hold all its arrays but the history. The file
   !> appears under its name when it is whole.
   subroutine write_hdf5_result(result, path, error)
      type(modal_result_type), intent(in) :: result
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      type(staging_type) :: staging
      type(printing_type) :: printing
      integer(hid_t) :: file

      if (.not. is_whole(result)) then
         call new_error(error, error_usage, path//": a result without all its arrays cannot be written")
         return
      end if
      call silence_hdf5(printing, error)
      call create_hdf5_file(file, staging, path, bytes_of(result), error)
      call write_modes(file, result, error)
      call write_mesh(file, result%mesh, error)
      call write_properties(file, result%properties, error)
      call write_history(file, result%history, error)
      call write_facts(file, result, error)
      call write_options(file, result, error)
      call finish_hdf5_file(file, staging, path, error)
      call restore_printing(printing)
   end subroutine write_hdf5_result

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

   ! Of the arrays that may be large.
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
      character(len=word_length) :: words(size(result%kind))

      words = kind_names(result%kind)
      call write_dataset(file, "/eigenvalues", result%eigenvalues, error)
      call write_dataset(file, "/eigenvectors", result%eigenvectors, error)
      call write_dataset(file, "/multipliers", result%multipliers, error)
      call write_dataset(file, "/frequency_hz", result%frequency_hz, error)
      call write_dataset(file, "/damped_frequency_hz", result%damped_frequency_hz, error)
      call write_dataset(file, "/damping_ratio", result%damping_ratio, error)
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

   subroutine write_facts(file, result, error)
      integer(hid_t), intent(in) :: file
      type(modal_result_type), intent(in) :: result
      type(error_type), allocatable, intent(inout) :: error
      real(wp) :: seconds(size(phase_names))
      integer :: i

      call write_attribute(file, root, "kschur", kschur_version, error)
      call write_attribute(file, root, "n", result%unknowns, error)
      call write_attribute(file, root, "m", result%constraints, error)
      call write_attribute(file, root, "symmetric", merge(1, 0, result%symmetric), error)
      call write_attribute(file, root, "damping", trim(damping_names(result%damping_kind)), error)
      call write_attribute(file, root, "method", result%method, error)
      call write_attribute(file, root, "formulation", trim(formulation_names(result%formulation)), error)
      if (allocated(result%decision)) call write_attribute(file, root, "decision", result%decision, error)
      call write_attribute(file, root, "target", result%target, error)
      call write_attribute(file, root, "shift", result%shift, error)
      call write_attribute(file, root, "reason", trim(reason_names(result%reason)), error)
      call write_attribute(file, root, "certified", trim(certified_names(result%certified)), error)
      if (result%missing >= 0) call write_attribute(file, root, "missing", result%missing, error)
      call write_attribute(file, root, "modes_asked", result%modes_asked, error)
      if (allocated(result%band)) then
         call write_attribute(file, root, "band_first_hz", result%band(1), error)
         call write_attribute(file, root, "band_last_hz", result%band(2), error)
      end if
      call write_attribute(file, root, "operator_applications", result%operator_applications, error)
      call write_attribute(file, root, "restarts", result%restarts, error)
      call write_attribute(file, root, "factorizations", result%factorizations, error)
      call write_attribute(file, root, "factored_order", result%factored_order, error)
      call write_attribute(file, root, "factor_entries", result%factor_entries, error)
      call write_attribute(file, root, "locking_error", result%locking_error, error)
      call write_attribute(file, root, "seconds_total", result%seconds%total, error)
      seconds = result%seconds%of_phases()
      do i = 1, size(seconds)
         call write_attribute(file, root, "seconds_"//trim(phase_names(i)), seconds(i), error)
      end do
   end subroutine write_facts

   subroutine write_options(file, result, error)
      integer(hid_t), intent(in) :: file
      type(modal_result_type), intent(in) :: result
      type(error_type), allocatable, intent(inout) :: error

      associate (options => result%options)
         call write_attribute(file, root, "tolerance", options%tolerance, error)
         call write_attribute(file, root, "subspace", options%subspace, error)
         call write_attribute(file, root, "max_restarts", options%max_restarts, error)
         call write_attribute(file, root, "constraint_scaling", trim(scaling_names(options%constraint_scaling)), error)
         call write_attribute(file, root, "inner_asked", trim(inner_names(options%inner)), error)
         call write_attribute(file, root, "presolve", merge(1, 0, options%presolve), error)
         call write_attribute(file, root, "normalisation", trim(normalisation_names(options%normalisation)), error)
         call write_attribute(file, root, "certify", merge(1, 0, options%certify), error)
         call write_attribute(file, root, "method_asked", trim(method_names(options%method)), error)
         call write_attribute(file, root, "arpack", trim(arpack_names(options%arpack)), error)
         call write_attribute(file, root, "seed", options%seed, error)
      end associate
      if (allocated(result%inner)) call write_attribute(file, root, "inner", result%inner, error)
      if (allocated(result%notes)) then
         if (size(result%notes) > 0) call write_attribute(file, root, "notes", lines_of(result%notes), error)
      end if
      call write_attribute(file, root, "redundant_constraints", result%redundant_constraints, error)
      call write_attribute(file, root, "peak_memory_bytes", result%peak_memory_bytes, error)
   end subroutine write_options

   ! One text, a note a line.
   pure function lines_of(notes) result(lines)
      character(len=*), intent(in) :: notes(:)
      character(len=sum(len_trim(notes)) + size(notes) - 1) :: lines
      integer :: i, first

      first = 1
      do i = 1, size(notes)
         lines(first:) = trim(notes(i))//line_end
         first = first + len_trim(notes(i)) + 1
      end do
   end function lines_of

   ! Adds the lines of a text to the notes.
   pure subroutine add_lines(lines, result)
      character(len=*), intent(in) :: lines
      type(modal_result_type), intent(inout) :: result
      integer :: first, length

      first = 1
      do while (first <= len(lines))
         length = index(lines(first:)//line_end, line_end) - 1
         call result%add_note(lines(first:first + length - 1))
         first = first + length + 1
      end do
   end subroutine add_lines

   !> Reads a result that `write_hdf5_result` wrote. Fails with the file and what is wrong.
   subroutine read_hdf5_result(result, path, error, trial)
      type(modal_result_type), intent(out) :: result
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      !> As that of `read_hdf5_problem`.
      logical, intent(in), optional :: trial
      type(printing_type) :: printing

      call silence_hdf5(printing, error)
      if (present(trial)) then
         if (trial) call try_in_child(forget_result, path, "result", error)
      end if
      call read_all(result, path, error)
      call restore_printing(printing)
      call add_context(error, path)
   end subroutine read_hdf5_result

   !> Whether a file holds a result, be it a damaged one; false also where the file cannot be read.
   logical function is_hdf5_result(path, trial)
      character(len=*), intent(in) :: path
      !> As that of `read_hdf5_problem`.
      logical, intent(in), optional :: trial
      type(error_type), allocatable :: error
      type(printing_type) :: printing

      call silence_hdf5(printing, error)
      if (present(trial)) then
         if (trial) call try_in_child(look_for_result, path, "result", error)
      end if
      call look_for_result(path, error)
      call restore_printing(printing)
      is_hdf5_result = .not. allocated(error)
   end function is_hdf5_result

   subroutine look_for_result(path, error)
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: file

      call open_hdf5_file(file, path, error)
      call check_is_result(file, error)
      call close_hdf5_file(file)
   end subroutine look_for_result

   subroutine check_is_result(file, error)
      integer(hid_t), intent(in) :: file
      type(error_type), allocatable, intent(inout) :: error
      logical :: marked

      marked = has_attribute(file, root, "kschur", error)
      if (.not. marked) marked = exists(file, "/eigenvalues", error)
      if (.not. marked .and. .not. allocated(error)) call new_error(error, error_input, "not a result of kschur")
   end subroutine check_is_result

   subroutine forget_result(path, error)
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(inout) :: error
      type(modal_result_type) :: result

      call forbid_external_links()
      call read_all(result, path, error)
   end subroutine forget_result

   subroutine read_all(result, path, error)
      type(modal_result_type), intent(inout) :: result
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: file
      logical :: marked

      call open_hdf5_file(file, path, error)
      call check_is_result(file, error)
      marked = .not. allocated(error)
      call read_facts(result, file, error)
      call read_options(result, file, error)
      call read_modes(result, file, error)
      call read_mesh(result%mesh, file, result%unknowns, error)
      if (.not. allocated(error)) call read_properties(result%properties, file, size(result%eigenvalues), error)
      call read_history(result%history, file, error)
      call close_hdf5_file(file)
      if (.not. allocated(error)) call check_shapes(result, error)
      if (.not. (marked .and. allocated(error))) return
      error%code = merge(error_memory, error_input, error%code == error_memory)
      call add_context(error, "a damaged result")
   end subroutine read_all

   subroutine read_modes(result, file, error)
      type(modal_result_type), intent(inout) :: result
      integer(hid_t), intent(in) :: file
      type(error_type), allocatable, intent(inout) :: error
      character(len=word_length), allocatable :: words(:)
      integer :: k

      call read_dataset(result%eigenvalues, file, "/eigenvalues", error)
      call read_dataset(result%eigenvectors, file, "/eigenvectors", error)
      call read_dataset(result%multipliers, file, "/multipliers", error)
      call read_dataset(result%frequency_hz, file, "/frequency_hz", error)
      call read_dataset(result%damped_frequency_hz, file, "/damped_frequency_hz", error)
      call read_dataset(result%damping_ratio, file, "/damping_ratio", error)
      call read_dataset(result%backward_error, file, "/backward_error", error)
      if (exists(file, "/error", error)) then
         call read_dataset(result%error_bound, file, "/error", error)
      else if (allocated(result%backward_error)) then
         ! Files of 0.1.0 do not tell.
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

   ! Position in a list of names counted from 0.
   integer function position_of(name, names, label, error)
      character(len=*), intent(in) :: name, names(0:), label
      type(error_type), allocatable, intent(inout) :: error

      position_of = max(0, index_of_name(name, names))
      if (index_of_name(name, names) < 0 .and. .not. allocated(error)) &
         call new_error(error, error_input, label//" is """//name//""", which is unknown")
   end function position_of

   subroutine read_history(history, file, error)
      type(history_type), intent(inout) :: history
      integer(hid_t), intent(in) :: file
      type(error_type), allocatable, intent(inout) :: error

      if (.not. exists(file, "/history", error)) return
      call read_dataset(history%converged, file, "/history/converged", 0, huge(1), error)
      call read_dataset(history%operator_applications, file, "/history/operator_applications", 0, huge(1), error)
      call read_dataset(history%residual, file, "/history/residual", error)
   end subroutine read_history

   subroutine read_facts(result, file, error)
      type(modal_result_type), intent(inout) :: result
      integer(hid_t), intent(in) :: file
      type(error_type), allocatable, intent(inout) :: error
      real(wp) :: seconds(size(phase_names))
      integer :: symmetric, i

      call read_attribute(result%unknowns, file, root, "n", error)
      call read_attribute(result%constraints, file, root, "m", error)
      call read_attribute(symmetric, file, root, "symmetric", error)
      result%symmetric = symmetric /= 0
      call read_name(result%damping_kind, file, "damping", damping_names, error)
      call read_attribute(result%method, file, root, "method", error)
      call read_name(result%formulation, file, "formulation", formulation_names, error)
      result%decision = ""
      if (has_attribute(file, root, "decision", error)) call read_attribute(result%decision, file, root, "decision", error)
      call read_attribute(result%target, file, root, "target", error)
      call read_attribute(result%shift, file, root, "shift", error)
      call read_name(result%reason, file, "reason", reason_names, error)
      call read_attribute(result%modes_asked, file, root, "modes_asked", error)
      call read_attribute(result%operator_applications, file, root, "operator_applications", error)
      call read_attribute(result%restarts, file, root, "restarts", error)
      call read_attribute(result%factorizations, file, root, "factorizations", error)
      call read_attribute(result%factored_order, file, root, "factored_order", error)
      call read_attribute(result%factor_entries, file, root, "factor_entries", error)
      call read_attribute(result%locking_error, file, root, "locking_error", error)
      call read_attribute(result%seconds%total, file, root, "seconds_total", error)
      seconds = 0
      do i = 1, size(seconds)
         ! Earlier files have fewer.
         if (has_attribute(file, root, "seconds_"//trim(phase_names(i)), error)) &
            call read_attribute(seconds(i), file, root, "seconds_"//trim(phase_names(i)), error)
      end do
      call result%seconds%set_phases(seconds)
      call result%set_total(result%seconds%total)
   end subroutine read_facts

   ! Files of the first days do not have these: what is not there keeps its default.
   subroutine read_options(result, file, error)
      type(modal_result_type), intent(inout) :: result
      integer(hid_t), intent(in) :: file
      type(error_type), allocatable, intent(inout) :: error
      character(len=:), allocatable :: notes
      integer :: presolve

      if (allocated(error)) return
      associate (options => result%options)
         options%modes = result%modes_asked
         options%target = result%target
         if (has("tolerance")) call read_attribute(options%tolerance, file, root, "tolerance", error)
         if (has("subspace")) call read_attribute(options%subspace, file, root, "subspace", error)
         if (has("max_restarts")) call read_attribute(options%max_restarts, file, root, "max_restarts", error)
         if (has("constraint_scaling")) &
            call read_name(options%constraint_scaling, file, "constraint_scaling", scaling_names, error)
         if (has("inner_asked")) call read_name(options%inner, file, "inner_asked", inner_names, error)
         if (has("presolve")) then
            call read_attribute(presolve, file, root, "presolve", error)
            options%presolve = presolve /= 0
         end if
         if (has("normalisation")) call read_name(options%normalisation, file, "normalisation", normalisation_names, error)
         if (has("method_asked")) call read_name(options%method, file, "method_asked", method_names, error)
         if (has("arpack")) call read_name(options%arpack, file, "arpack", arpack_names, error)
         if (has("seed")) call read_attribute(options%seed, file, root, "seed", error)
      end associate
      if (has("inner")) call read_attribute(result%inner, file, root, "inner", error)
      allocate (result%notes(0))
      if (has("notes")) then
         call read_attribute(notes, file, root, "notes", error)
         if (.not. allocated(error)) call add_lines(notes, result)
      end if
      if (has("redundant_constraints")) &
         call read_attribute(result%redundant_constraints, file, root, "redundant_constraints", error)
      if (has("certified")) call read_name(result%certified, file, "certified", certified_names, error)
      if (has("missing")) call read_attribute(result%missing, file, root, "missing", error)
      if (has("band_first_hz")) then
         allocate (result%band(2), source=0.0_wp)
         call read_attribute(result%band(1), file, root, "band_first_hz", error)
         call read_attribute(result%band(2), file, root, "band_last_hz", error)
      end if
      if (has("peak_memory_bytes")) &
         call read_attribute(result%peak_memory_bytes, file, root, "peak_memory_bytes", error)

   contains

      logical function has(name)
         character(len=*), intent(in) :: name

         has = has_attribute(file, root, name, error)
      end function has
   end subroutine read_options

   subroutine read_name(position, file, name, names, error)
      integer, intent(out) :: position
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: name, names(0:)
      type(error_type), allocatable, intent(inout) :: error
      character(len=:), allocatable :: found

      position = 0
      call read_attribute(found, file, root, name, error)
      if (.not. allocated(error)) position = position_of(found, names, "attribute "//name, error)
   end subroutine read_name

   subroutine check_shapes(result, error)
      type(modal_result_type), intent(in) :: result
      type(error_type), allocatable, intent(inout) :: error
      integer :: modes

      modes = size(result%eigenvalues)
      if (any([size(result%eigenvectors, 2), size(result%multipliers, 2), size(result%frequency_hz), &
         size(result%damped_frequency_hz), size(result%damping_ratio), size(result%backward_error), size(result%error_bound), &
         size(result%kind)] /= modes)) then
         call new_error(error, error_input, "the datasets do not all have the same number of modes")
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
