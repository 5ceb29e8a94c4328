!> A result as JSON (one object) and as comma-separated values.
module cli_json
   use cli_numbers, only: plain
   use cli_system, only: print_line
   use kschur, only: certified_names, certified_unknown, damping_names, formulation_names, kind_names, &
      kschur_version, long, loss_factor_of, modal_properties_type, modal_result_type, &
      phase_names, purpose_names, reason_names, text, timings_type, wp
   implicit none
   private
   public :: print_csv, print_json
   public :: boolean, certified, counts, number, pair, problem_facts, seconds, string

contains

   !> Prints one JSON object on standard output.
   subroutine print_json(result)
      type(modal_result_type), intent(in) :: result
      integer :: i

      call print_line('{"kschur": '//string(kschur_version)//',')
      call print_line(' "problem": '//problem_facts(result)//',')
      call print_line(' "method": '//string(result%method)//', "formulation": '// &
         string(formulation_names(result%formulation))//',')
      call print_line(' "target": '//pair(result%target)//', "shift": '//pair(result%shift)//',')
      if (allocated(result%band)) call print_line(' "band": '//pair(cmplx(result%band(1), result%band(2), wp))//',')
      call print_line(' "reason": '//string(reason_names(result%reason))//', "certified": '// &
         certified(result%certified)//',')
      if (result%missing >= 0) call print_line(' "missing": '//text(result%missing)//',')
      call print_line(' "modes": [')
      do i = 1, size(result%eigenvalues)
         call print_line("  "//mode(result, i)//trim(merge(",", " ", i < size(result%eigenvalues))))
      end do
      call print_line(' ],')
      if (allocated(result%properties)) call print_line(' "directions": '//directions(result%properties)//', "total_mass": '// &
         list(result%properties%total_mass)//',')
      call print_line(' "counts": '//counts(result)//',')
      call print_line(' "seconds": '//seconds(result%seconds)//',')
      call print_line(' "factor_memory_bytes": '//memory(result%factor_bytes)//',')
      call print_line(' "peak_memory_bytes": '//memory(result%peak_memory_bytes)//'}')
   end subroutine print_json

   !> Prints a line of names and one line per mode on standard output. A field is empty for an undefined damping ratio, an infinite
   !> condition number or an unknown error. Condition numbers and loss factors are columns only if the result has them.
   subroutine print_csv(result)
      type(modal_result_type), intent(in) :: result
      integer :: i

      call print_line("mode,eigenvalue_re,eigenvalue_im,frequency_hz,damped_frequency_hz,damping_ratio,kind,"// &
         "backward_error,error"//trim(merge(",condition_number", repeat(" ", 17), allocated(result%condition)))// &
         trim(merge(",loss_factor", repeat(" ", 12), allocated(result%loss_factor))))
      do i = 1, size(result%eigenvalues)
         call print_line(text(i)//","//plain(real(result%eigenvalues(i), wp), "")//","// &
            plain(aimag(result%eigenvalues(i)), "")//","//plain(result%frequency_hz(i), "")//","// &
            plain(result%damped_frequency_hz(i), "")//","//plain(result%damping_ratio(i), "")//","// &
            trim(kind_names(result%kind(i)))//","//plain(result%backward_error(i), "")//","// &
            plain(result%error_bound(i), "")//condition(result, i, ",", "")//loss_factor(result, i))
      end do
   end subroutine print_csv

   ! CSV field of a loss factor, after a comma; empty without losses.
   pure function loss_factor(result, i)
      type(modal_result_type), intent(in) :: result
      integer, intent(in) :: i
      character(len=:), allocatable :: loss_factor

      loss_factor = ""
      if (allocated(result%loss_factor)) loss_factor = ","//plain(result%loss_factor(i), "")
   end function loss_factor

   pure function mode(result, i) result(object)
      type(modal_result_type), intent(in) :: result
      integer, intent(in) :: i
      character(len=:), allocatable :: object

      object = '{"eigenvalue": '//pair(result%eigenvalues(i))//', "frequency_hz": '//number(result%frequency_hz(i))// &
         ', "damped_frequency_hz": '//number(result%damped_frequency_hz(i))// &
         ', "damping_ratio": '//number(result%damping_ratio(i))// &
         ', "loss_factor": '//number(loss_factor_of(result%eigenvalues(i)))// &
         ', "kind": '//string(kind_names(result%kind(i)))//', "backward_error": '//number(result%backward_error(i))// &
         ', "error": '//number(result%error_bound(i))// &
         condition(result, i, ', "condition_number": ', "null")//properties(result, i)//'}'
   end function mode

   ! Members of the modal properties of a mode, after a comma; empty if they were not requested.
   pure function properties(result, i)
      type(modal_result_type), intent(in) :: result
      integer, intent(in) :: i
      character(len=:), allocatable :: properties, factors
      integer :: j

      properties = ""
      if (.not. allocated(result%properties)) return
      associate (p => result%properties)
         factors = ""
         do j = 1, size(p%total_mass)
            factors = factors//", "//pair(p%participation(i, j))
         end do
         properties = ', "generalised_mass": '//number(p%mass(i))//', "generalised_damping": '//number(p%damping(i))// &
            ', "generalised_stiffness": '//number(p%stiffness(i))//', "modal_a": '//pair(p%a(i))//', "modal_b": '// &
            pair(p%b(i))//', "participation": ['//factors(min(3, len(factors) + 1):)//'], "effective_mass": '// &
            list(p%effective_mass(i, :))
      end associate
   end function properties

   ! Names of the directions of the modal properties, as a JSON array.
   pure function directions(properties) result(names)
      type(modal_properties_type), intent(in) :: properties
      character(len=:), allocatable :: names
      integer :: j

      names = "["
      do j = 1, size(properties%direction)
         if (j > 1) names = names//", "
         names = names//string(properties%direction(j))
      end do
      names = names//"]"
   end function directions

   pure function list(values)
      real(wp), intent(in) :: values(:)
      character(len=:), allocatable :: list
      integer :: j

      list = "["
      do j = 1, size(values)
         if (j > 1) list = list//", "
         list = list//number(values(j))
      end do
      list = list//"]"
   end function list

   ! The condition number of a mode after `label`; empty if condition numbers were not requested.
   pure function condition(result, i, label, undefined)
      type(modal_result_type), intent(in) :: result
      integer, intent(in) :: i
      character(len=*), intent(in) :: label, undefined
      character(len=:), allocatable :: condition

      condition = ""
      if (allocated(result%condition)) condition = label//plain(result%condition(i), undefined)
   end function condition

   !> JSON object of the member `problem`: sizes, symmetry and damping.
   pure function problem_facts(result) result(object)
      type(modal_result_type), intent(in) :: result
      character(len=:), allocatable :: object

      object = '{"n": '//text(result%unknowns)//', "m": '//text(result%constraints)//', "symmetric": '// &
         boolean(result%symmetric)//', "damping": '//string(damping_names(result%damping_kind))//'}'
   end function problem_facts

   !> JSON object of the member `counts`: operator applications, restarts and factorizations.
   pure function counts(result) result(object)
      type(modal_result_type), intent(in) :: result
      character(len=:), allocatable :: object
      integer :: i

      object = '{"operator_applications": '//text(result%operator_applications)//', "restarts": '// &
         text(result%restarts)//', "factorizations": '//text(result%factorizations)//', "wanted_after": '// &
         wanted_after(result)//', "factorizations_for": {'
      do i = 1, size(purpose_names)
         if (i > 1) object = object//', '
         object = object//'"'//trim(purpose_names(i))//'": '//text(result%factorizations_for(i))
      end do
      object = object//'}}'
   end function counts

   ! Operator applications until all wanted modes had converged; null if not all did.
   pure function wanted_after(result)
      type(modal_result_type), intent(in) :: result
      character(len=:), allocatable :: wanted_after

      wanted_after = text(result%history%wanted_after(result%options%tolerance))
      if (wanted_after == "0") wanted_after = "null"
   end function wanted_after

   !> JSON object of the member `seconds`: the time of each phase.
   pure function seconds(timings) result(object)
      type(timings_type), intent(in) :: timings
      character(len=:), allocatable :: object
      real(wp) :: spent(size(phase_names))
      integer :: i

      spent = timings%of_phases()
      object = '{"total": '//number(timings%total)
      do i = 1, size(spent)
         object = object//', "'//trim(phase_names(i))//'": '//number(spent(i))
      end do
      object = object//', "other": '//number(timings%other)//'}'
   end function seconds

   !> A complex number as [re, im].
   pure function pair(z)
      complex(wp), intent(in) :: z
      character(len=:), allocatable :: pair

      pair = "["//number(real(z, wp))//", "//number(aimag(z))//"]"
   end function pair

   !> A number; null where it is not finite.
   pure function number(x)
      real(wp), intent(in) :: x
      character(len=:), allocatable :: number

      number = plain(x, "null")
   end function number

   ! Number of bytes; null if unknown.
   pure function memory(bytes)
      integer(long), intent(in) :: bytes
      character(len=:), allocatable :: memory
      character(len=20) :: buffer

      write (buffer, "(i0)") bytes
      memory = trim(buffer)
      if (bytes < 0) memory = "null"
   end function memory

   !> true, false, or null if unknown.
   pure function certified(verdict)
      integer, intent(in) :: verdict
      character(len=:), allocatable :: certified

      certified = trim(certified_names(verdict))
      if (verdict == certified_unknown) certified = "null"
   end function certified

   !> true or false.
   pure function boolean(value)
      logical, intent(in) :: value
      character(len=:), allocatable :: boolean

      boolean = trim(merge("true ", "false", value))
   end function boolean

   !> A string in its quotes.
   pure function string(value)
      character(len=*), intent(in) :: value
      character(len=:), allocatable :: string
      character(len=6) :: escape
      integer :: i

      string = '"'
      do i = 1, len_trim(value)
         if (iachar(value(i:i)) < 32) then
            write (escape, "(a, z4.4)") "\u", iachar(value(i:i))
            string = string//escape
         else
            if (scan(value(i:i), '"\') == 1) string = string//"\"
            string = string//value(i:i)
         end if
      end do
      string = string//'"'
   end function string
end module cli_json
