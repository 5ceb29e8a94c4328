!> Root attributes of an HDF5 result: everything except arrays, as counts, times, options and notes.
module kschur_hdf5_facts
   use hdf5, only: hid_t
   use kschur_effort, only: phase_names, purpose_names
   use kschur_error, only: error_type, new_error, error_input
   use kschur_hdf5_attributes, only: has_attribute, read_attribute, write_attribute
   use kschur_kinds, only: wp
   use kschur_options, only: arpack_names, formulation_names, index_of_name, inner_names, method_names, &
      normalisation_names, scaling_names
   use kschur_problem, only: damping_names
   use kschur_release, only: kschur_version
   use kschur_result, only: modal_result_type, certified_names, reason_names
   implicit none
   private
   public :: position_of, read_facts, read_options, write_facts, write_options

   character(len=*), parameter :: root = "/", line_end = achar(10)

contains

   !> Writes problem data, method and effort.
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
      do i = 1, size(purpose_names)
         call write_attribute(file, root, "factorizations_for_"//trim(purpose_names(i)), result%factorizations_for(i), error)
      end do
      call write_attribute(file, root, "factored_order", result%factored_order, error)
      call write_attribute(file, root, "factor_entries", result%factor_entries, error)
      call write_attribute(file, root, "locking_error", result%locking_error, error)
      call write_attribute(file, root, "seconds_total", result%seconds%total, error)
      seconds = result%seconds%of_phases()
      do i = 1, size(seconds)
         call write_attribute(file, root, "seconds_"//trim(phase_names(i)), seconds(i), error)
      end do
   end subroutine write_facts

   !> Writes options, notes and memory.
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
         call write_attribute(file, root, "uncounted", merge(1, 0, options%uncounted), error)
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

   ! Joins notes to one text, one line each.
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

   ! Appends the lines of a text to the notes.
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

   !> Reads what `write_facts` wrote.
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
      do i = 1, size(purpose_names)
         ! Not in older files.
         if (has_attribute(file, root, "factorizations_for_"//trim(purpose_names(i)), error)) &
            call read_attribute(result%factorizations_for(i), file, root, "factorizations_for_"//trim(purpose_names(i)), error)
      end do
      call read_attribute(result%factored_order, file, root, "factored_order", error)
      call read_attribute(result%factor_entries, file, root, "factor_entries", error)
      call read_attribute(result%locking_error, file, root, "locking_error", error)
      call read_attribute(result%seconds%total, file, root, "seconds_total", error)
      seconds = 0
      do i = 1, size(seconds)
         ! Fewer in older files.
         if (has_attribute(file, root, "seconds_"//trim(phase_names(i)), error)) &
            call read_attribute(seconds(i), file, root, "seconds_"//trim(phase_names(i)), error)
      end do
      call result%seconds%set_phases(seconds)
      call result%set_total(result%seconds%total)
   end subroutine read_facts

   !> Reads what `write_options` wrote. Attributes missing in the oldest files keep defaults.
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

      ! Whether the file has this root attribute.
      logical function has(name)
         character(len=*), intent(in) :: name

         has = has_attribute(file, root, name, error)
      end function has
   end subroutine read_options

   ! Reads an attribute that is one of a list of names, as its position in the list.
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

   !> Position of a name in a list, counted from 0; fails if it is none of them. `label` says in the message what it is.
   integer function position_of(name, names, label, error)
      character(len=*), intent(in) :: name, names(0:), label
      type(error_type), allocatable, intent(inout) :: error

      position_of = max(0, index_of_name(name, names))
      if (index_of_name(name, names) < 0 .and. .not. allocated(error)) &
         call new_error(error, error_input, label//" is """//name//""", which is unknown")
   end function position_of
end module kschur_hdf5_facts
