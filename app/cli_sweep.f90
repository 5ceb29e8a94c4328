!> kschur sweep: modes as functions of a parameter, of a scene or of problem files.
module cli_sweep
   use cli_arguments, only: arguments_type
   use cli_colour, only: coloured, red
   use cli_columns, only: print_columns
   use cli_input, only: input_type, is_part_of, read_problem, take_symmetric
   use cli_interrupt, only: catch_interrupts, is_interrupted
   use cli_numbers, only: plain, read_list, read_range, rounded
   use cli_options, only: take_iteration, take_wanted
   use cli_output, only: format_csv, format_json, format_table, take_format
   use cli_progress, only: new_progress, progress_type
   use cli_sweep_page, only: keep_shapes, make_page, page_type, prepare, take_page
   use cli_system, only: check_new_file, check_output, complain, print_line
   use kschur, only: error_type, error_usage, event_names, event_unsure, kept_result_type, modal_options_type, &
      modal_problem_type, modal_result_type, new_error, new_sweep, problem_family_type, reason_converged, sweep_type, text, wp, &
      write_hdf5_sweep
   use kschur_scenes, only: build_scene
   implicit none
   private
   public :: sweep_command

   !> Source of the problems: an option of a scene, or a sequence of problems.
   type :: source_type
      character(len=:), allocatable :: scene, parameter
      !> Unit of the parameter; empty if unknown.
      character(len=:), allocatable :: unit
      !> The other options of the scene, with room for two more words.
      character(len=:), allocatable :: words(:)
      type(input_type), allocatable :: inputs(:)
      real(wp), allocatable :: values(:)
   end type source_type

   !> A scene at any value of its option.
   type, extends(problem_family_type) :: scenes_type
      type(source_type), pointer :: source => null()
   contains
      procedure :: at => scene_at
   end type scenes_type

   integer, parameter :: longest_number = 32, most_points = 10000

contains

   !> Runs the command; `complete` is false if a point has fewer modes than asked for.
   subroutine sweep_command(arguments, complete, error)
      type(arguments_type), intent(inout) :: arguments
      logical, intent(out) :: complete
      type(error_type), allocatable, intent(out) :: error
      type(modal_options_type) :: options
      type(source_type) :: source
      type(progress_type) :: progress
      type(sweep_type) :: sweep
      type(page_type) :: page
      character(len=:), allocatable :: output, unit
      type(modal_result_type), allocatable, target :: results(:)
      logical :: quiet, shapes
      integer :: format

      complete = .false.
      call take_wanted(arguments, options, error)
      call take_iteration(arguments, options, error)
      call arguments%take_flag("--left", options%left, error)
      call arguments%take_text("--output", output, error)
      call arguments%take_flag("--shapes", shapes, error)
      call take_format(arguments, format, error)
      call arguments%take_integer("--threads", 1, options%threads, error)
      call arguments%take_flag("--quiet", quiet, error)
      call arguments%take_text("--unit", unit, error)
      call take_page(arguments, page, error)
      call take_source(arguments, source, error)
      if (allocated(unit)) source%unit = unit
      if (shapes .and. .not. (allocated(error) .or. allocated(output))) &
         call new_error(error, error_usage, "--shapes is for the file of --output, which is not given")
      if (.not. allocated(error) .and. allocated(output)) call check_place(source, output, error)
      if (.not. allocated(error) .and. allocated(page%path)) call check_place(source, page%path, error)
      if (.not. allocated(error)) call prepare(page, source%unit, error)
      if (allocated(error)) return
      progress = new_progress(quiet)
      call new_sweep(sweep, options)
      call catch_interrupts()
      allocate (results(merge(size(source%values), 0, shapes)))
      call solve_points(source, sweep, progress, page, results, complete, error)
      call progress%finish()
      if (.not. allocated(error)) call sweep%finish()
      if (.not. allocated(error)) then
         if (allocated(output)) call write_sweep(sweep, source, results, output, error)
         call print_sweep(sweep, source, format)
         call check_output(error)
         if (is_interrupted()) call complain("the sweep was interrupted after "//text(size(sweep%values))//" of "// &
            text(size(source%values))//" points")
      end if
      ! Last: all else is there where it fails.
      call make_page(page, sweep, source%parameter, source%unit, error)
   end subroutine sweep_command

   ! Writes the sweep to a file, with the results of its points if there are any.
   subroutine write_sweep(sweep, source, results, output, error)
      type(sweep_type), intent(in) :: sweep
      type(source_type), intent(in) :: source
      !> None, or one for each value; the sweep may have fewer points.
      type(modal_result_type), target, intent(in) :: results(:)
      character(len=*), intent(in) :: output
      type(error_type), allocatable, intent(out) :: error
      type(kept_result_type) :: kept(min(size(results), size(sweep%values)))
      integer :: k

      do k = 1, size(kept)
         kept(k)%result => results(k)
      end do
      if (size(results) > 0) then
         call write_hdf5_sweep(sweep, source%parameter, output, error, source%unit, kept)
      else
         call write_hdf5_sweep(sweep, source%parameter, output, error, source%unit)
      end if
   end subroutine write_sweep

   ! Fails if the output cannot be created, or would replace a file of a problem.
   subroutine check_place(source, output, error)
      type(source_type), intent(in) :: source
      character(len=*), intent(in) :: output
      type(error_type), allocatable, intent(out) :: error
      integer :: i

      call check_new_file(output, error)
      if (.not. allocated(source%inputs)) return
      do i = 1, size(source%inputs)
         if (allocated(error)) return
         if (is_part_of(source%inputs(i), output)) &
            call new_error(error, error_usage, output//" would replace a problem")
      end do
   end subroutine check_place

   ! Takes a scene and --vary, problem files with or without --values, or one file and --loss-factor.
   subroutine take_source(arguments, source, error)
      type(arguments_type), intent(inout) :: arguments
      type(source_type), intent(out) :: source
      type(error_type), allocatable, intent(inout) :: error
      character(len=:), allocatable :: range, values, factors, word
      type(input_type) :: input
      integer :: i

      source%unit = ""
      call arguments%take_text("--vary", range, error, "OPTION=FIRST:LAST:POINTS")
      call arguments%take_text("--values", values, error, "numbers, V1,V2,...")
      if (allocated(error)) return
      if (allocated(range)) then
         call take_range(range, source%parameter, source%values, error)
         call arguments%take_word(source%scene)
         if (.not. (allocated(error) .or. allocated(source%scene))) &
            call new_error(error, error_usage, "--vary is for a scene, and none is named")
         if (.not. allocated(error) .and. allocated(values)) &
            call new_error(error, error_usage, "--values is for problem files, --vary for a scene")
         if (.not. allocated(error)) source%words = with_room(arguments%rest(), len(source%parameter) + 2)
         return
      end if
      source%parameter = "point"
      call take_symmetric(arguments, input, error)
      call arguments%take_text("--loss-factor", factors, error, "FIRST:LAST:POINTS")
      allocate (source%inputs(0))
      do
         call arguments%take_word(word)
         if (.not. allocated(word)) exit
         input%path = word
         source%inputs = [source%inputs, input]
      end do
      call arguments%check_all_taken(error)
      if (allocated(error)) return
      if (allocated(factors)) then
         if (allocated(values)) call new_error(error, error_usage, "--values is for problem files, --loss-factor for one of them")
         if (.not. allocated(error)) call take_loss_factors(factors, source, error)
         return
      end if
      if (size(source%inputs) < 2) &
         call new_error(error, error_usage, "kschur sweep wants two problems or more, or a scene and --vary")
      if (allocated(error)) return
      allocate (source%values, source=[(real(i, wp), i=1, size(source%inputs))])
      if (allocated(values)) call take_values(values, source%values, error)
   end subroutine take_source

   ! Makes from FIRST:LAST:POINTS one input for each loss factor g, with H = g K, of one problem.
   subroutine take_loss_factors(range, source, error)
      character(len=*), intent(in) :: range
      type(source_type), intent(inout) :: source
      type(error_type), allocatable, intent(out) :: error
      type(input_type) :: input
      logical :: ok
      integer :: i

      call read_range(range, most_points, source%values, ok)
      if (ok) ok = size(source%inputs) == 1
      if (.not. ok) then
         call new_error(error, error_usage, "--loss-factor wants one problem and FIRST:LAST:POINTS with two to "// &
            text(most_points)//" points")
         return
      end if
      source%parameter = "loss_factor"
      input = source%inputs(1)
      deallocate (source%inputs)
      allocate (source%inputs(0))
      do i = 1, size(source%values)
         input%loss_factor = source%values(i)
         source%inputs = [source%inputs, input]
      end do
   end subroutine take_loss_factors

   ! Splits OPTION=FIRST:LAST:POINTS into the option and its values.
   subroutine take_range(range, option, values, error)
      character(len=*), intent(in) :: range
      character(len=:), allocatable, intent(out) :: option
      real(wp), allocatable, intent(out) :: values(:)
      type(error_type), allocatable, intent(out) :: error
      integer :: equal
      logical :: ok

      equal = index(range, "=")
      call read_range(range(equal + 1:), most_points, values, ok)
      if (.not. ok .or. equal < 2) then
         call new_error(error, error_usage, "--vary wants OPTION=FIRST:LAST:POINTS with two to "// &
            text(most_points)//" points, not '"//range//"'")
         return
      end if
      option = range(:equal - 1)
   end subroutine take_range

   ! Replaces the values by those of a list V1,V2,..., as many, rising or falling.
   subroutine take_values(list, values, error)
      character(len=*), intent(in) :: list
      real(wp), intent(inout) :: values(:)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: given(:)
      logical :: ok

      call read_list(list, given, ok)
      if (ok) ok = size(given) == size(values)
      if (ok) ok = all(given(2:) > given(:size(given) - 1)) .or. all(given(2:) < given(:size(given) - 1))
      if (.not. ok) then
         call new_error(error, error_usage, "--values wants a number for each problem, "//text(size(values))// &
            " of them, rising or falling, not '"//list//"'")
         return
      end if
      values = given
   end subroutine take_values

   ! The words, padded to a length, and two blank ones behind, for the option that varies and its value.
   function with_room(words, length) result(more)
      character(len=*), intent(in) :: words(:)
      integer, intent(in) :: length
      character(len=max(len(words), length, longest_number)), allocatable :: more(:)

      allocate (more(size(words) + 2))
      more = ""
      more(:size(words)) = words
   end function with_room

   ! Solves the points one by one. An interrupt ends the sweep with the points before it.
   subroutine solve_points(source, sweep, progress, page, results, complete, error)
      type(source_type), target, intent(inout) :: source
      type(sweep_type), intent(inout) :: sweep
      type(progress_type), intent(inout) :: progress
      type(page_type), intent(in) :: page
      !> Of the points, where they are kept; of size 0 else.
      type(modal_result_type), intent(inout) :: results(:)
      logical, intent(out) :: complete
      type(error_type), allocatable, intent(out) :: error
      type(scenes_type) :: scenes
      type(modal_problem_type) :: problem
      type(modal_result_type) :: result
      integer :: i

      complete = .true.
      scenes%source => source
      do i = 1, size(source%values)
         call progress%name_solve("point "//text(i)//" of "//text(size(source%values)))
         if (allocated(source%scene)) then
            call scenes%at(source%values(i), problem, error)
            if (.not. allocated(error)) call sweep%add(source%values(i), problem, error, result, progress, scenes)
         else
            call read_problem(source%inputs(i), problem, error)
            if (.not. allocated(error)) call sweep%add(source%values(i), problem, error, result, progress)
         end if
         if (.not. allocated(error)) call keep_shapes(page, i, size(source%values), result, error)
         if (allocated(error)) return
         if (size(results) > 0) results(i) = result
         complete = complete .and. result%reason == reason_converged
         if (is_interrupted()) complete = .false.
         if (is_interrupted()) return
      end do
   end subroutine solve_points

   ! Builds the scene with its option at this value.
   subroutine scene_at(self, value, problem, error)
      class(scenes_type), intent(inout) :: self
      real(wp), intent(in) :: value
      type(modal_problem_type), intent(out) :: problem
      type(error_type), allocatable, intent(out) :: error

      associate (source => self%source, last => size(self%source%words))
         source%words(last - 1) = "--"//source%parameter
         source%words(last) = plain(value, "")
         call build_scene(source%scene, source%words, problem, error)
      end associate
   end subroutine scene_at

   ! Prints the branches, damped frequencies in the table, eigenvalues as well in JSON and CSV, and, but for CSV, the events.
   subroutine print_sweep(sweep, source, format)
      type(sweep_type), intent(in) :: sweep
      type(source_type), intent(in) :: source
      integer, intent(in) :: format
      real(wp), parameter :: two_pi = 8*atan(1.0_wp)
      character(len=24), allocatable :: names(:), units(:)
      real(wp), allocatable :: values(:, :)
      integer :: b, each

      each = merge(1, 4, format == format_table)
      allocate (names(1 + each*size(sweep%eigenvalues, 1)))
      allocate (units(size(names)), values(size(sweep%values), size(names)))
      names(1) = source%parameter
      units = "Hz"
      units(1) = source%unit
      values(:, 1) = sweep%values
      do b = 1, size(sweep%eigenvalues, 1)
         associate (first => 2 + each*(b - 1), lambda => sweep%eigenvalues(b, :))
            names(first) = "damped_frequency_"//text(b)
            if (format == format_table) names(first) = "branch_"//text(b)
            values(:, first) = abs(aimag(lambda))/two_pi
            if (format == format_table) cycle
            names(first + 1:first + 3) = [character(len=24) :: "damping_ratio_"//text(b), "eigenvalue_re_"//text(b), &
               "eigenvalue_im_"//text(b)]
            values(:, first + 1) = sweep%damping_ratio(b, :)
            values(:, first + 2) = real(lambda, wp)
            values(:, first + 3) = aimag(lambda)
         end associate
      end do
      if (format == format_json) call print_line('{"points":')
      call print_columns("point", names, units, values, format)
      if (format /= format_csv) call print_events(sweep, source%parameter, unit_after(source), format)
   end subroutine print_sweep

   ! Unit with a leading blank, if there is one.
   pure function unit_after(source) result(unit)
      type(source_type), intent(in) :: source
      character(len=merge(0, 1 + len(source%unit), source%unit == "")) :: unit

      unit = " "//source%unit
   end function unit_after

   ! Prints events of branches, and where branches become stable or unstable.
   subroutine print_events(sweep, parameter, unit, format)
      type(sweep_type), intent(in) :: sweep
      character(len=*), intent(in) :: parameter
      character(len=*), intent(in) :: unit
      integer, intent(in) :: format
      integer :: i

      if (format == format_json) then
         call print_line(', "events": [')
         do i = 1, size(sweep%events)
            associate (e => sweep%events(i))
               call print_line('  {"kind": "'//trim(event_names(e%kind))//'", "first": '//text(e%first)//', "second": '// &
                  text(e%second)//', "value": '//plain(e%value, "null")//'}'//trim(merge(",", " ", i < size(sweep%events))))
            end associate
         end do
         call print_line('], "onsets": [')
         do i = 1, size(sweep%onsets)
            associate (o => sweep%onsets(i))
               call print_line('  {"branch": '//text(o%branch)//', "unstable": '//trim(merge("true ", "false", o%unstable))// &
                  ', "value": '//plain(o%value, "null")//', "within": '//plain(o%within, "null")//'}'// &
                  trim(merge(",", " ", i < size(sweep%onsets))))
            end associate
         end do
         call print_line("]}")
         return
      end if
      call print_line("")
      do i = 1, size(sweep%events)
         associate (e => sweep%events(i))
            if (e%kind == event_unsure) then
               call print_line("unsure     which mode is which from "//parameter//" "//rounded(e%value)//unit//" on")
            else
               call print_line(event_names(e%kind)//"   branches "//text(e%first)//" and "//text(e%second)//" near "// &
                  parameter//" "//rounded(e%value)//unit)
            end if
         end associate
      end do
      do i = 1, size(sweep%eigenvalues, 1)
         call print_stability(sweep, i, parameter, unit)
      end do
   end subroutine print_events

   ! Prints whether a branch is unstable at its first point, and where that changes.
   subroutine print_stability(sweep, branch, parameter, unit)
      type(sweep_type), intent(in) :: sweep
      integer, intent(in) :: branch
      character(len=*), intent(in) :: parameter, unit
      ! Resolution of an onset, unless the mode was lost between points.
      real(wp), parameter :: accuracy = 1.0e-3_wp
      character(len=:), allocatable :: line
      integer :: first, i

      first = findloc(sweep%mode(branch, :) > 0, .true., 1)
      if (sweep%is_unstable(branch, first)) call print_line(coloured("unstable", red)// &
         "   branch "//text(branch)//" from its first point, "//parameter//" "//rounded(sweep%values(first))//unit)
      do i = 1, size(sweep%onsets)
         associate (o => sweep%onsets(i))
            if (o%branch /= branch) cycle
            line = "stable  "
            if (o%unstable) line = coloured("unstable", red)
            line = line//"   branch "//text(branch)//" from "//parameter//" "//rounded(significant(o%value))//unit
            if (o%within > accuracy*abs(o%value)) line = line//", known to "//rounded(significant(o%within))
            call print_line(line)
         end associate
      end do
   end subroutine print_stability

   ! Rounds to significant digits.
   pure real(wp) function significant(x)
      real(wp), intent(in) :: x
      integer, parameter :: digits = 5
      real(wp) :: unit

      significant = x
      if (.not. abs(x) > 0) return
      unit = 10.0_wp**(digits - 1 - floor(log10(abs(x))))
      significant = anint(x*unit)/unit
   end function significant
end module cli_sweep
