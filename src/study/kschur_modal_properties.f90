!> Modal properties: generalised mass, stiffness and damping, modal a and b, participation factors and effective masses.
module kschur_modal_properties
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use kschur_description, only: quadratic_form
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_kinds, only: wp
   use kschur_lapack, only: zgesvd
   use kschur_memory, only: complex_bytes, require_memory
   use kschur_mesh, only: rigid_motion_names
   use kschur_mode_groups, only: bytes_of_groups, check_modes_of, form_between, group_of, mode_group_type, solve_small
   use kschur_problem, only: modal_problem_type
   use kschur_properties, only: direction_length, modal_properties_type
   use kschur_result, only: modal_result_type, note_length
   use kschur_text, only: text
   use kschur_threads, only: enter_solve, leave_solve, one_thread
   use kschur_tolerances, only: dependent
   implicit none
   private
   public :: find_modal_properties

contains

   !> Sets the properties of all modes of a result, those of `modal_properties_type`. Fails if the result does not belong to the
   !> problem, if left vectors of an unsymmetric problem are missing, or if directions differ in length from shapes.
   subroutine find_modal_properties(problem, result, error, directions)
      type(modal_problem_type), intent(in) :: problem
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      !> Unit motions of all unknowns, n x directions, as 1 along x and 0 else. Absent: the nonzero rigid motions of the
      !> problem's mesh; none without a mesh. A note says where a transformation leaves unknowns out.
      real(wp), intent(in), optional :: directions(:, :)
      complex(wp), allocatable :: momenta(:, :)
      real(wp), allocatable :: motions(:, :)
      logical, allocatable :: pending(:)
      type(modal_properties_type), allocatable :: properties
      type(mode_group_type) :: group
      complex(wp) :: value
      real(wp) :: terms
      integer :: k, j, d, threads_before

      if (allocated(result%properties)) deallocate (result%properties)
      call check_modes_of(problem, result, error)
      if (allocated(error)) return
      d = 6
      if (present(directions)) d = size(directions, 2)
      k = size(result%eigenvalues)
      call require_memory(bytes_of_groups(problem, result) + 4*complex_bytes*d*(real(problem%unknowns(), wp) + k), &
         "the modal properties", error)
      if (allocated(error)) return
      allocate (properties)
      if (present(directions)) then
         properties%direction = numbers(size(directions, 2))
         call find_momenta(problem, directions, momenta, properties%total_mass, error)
      else
         call find_motions(problem, motions, properties%direction)
         call find_momenta(problem, motions, momenta, properties%total_mass, error)
      end if
      if (allocated(error)) return
      d = size(momenta, 2)
      allocate (properties%mass(k), properties%damping(k), properties%stiffness(k), properties%a(k), properties%b(k))
      allocate (properties%participation(k, d), properties%effective_mass(k, d))
      allocate (pending(k), source=.true.)
      call enter_solve(one_thread, problem%unknowns(), threads_before, error)
      do j = 1, k
         if (allocated(error)) exit
         call quadratic_form(problem%mass, result%eigenvectors(:, j), value, terms)
         properties%mass(j) = real(value, wp)
         call quadratic_form(problem%damping, result%eigenvectors(:, j), value, terms)
         properties%damping(j) = real(value, wp)
         call quadratic_form(problem%stiffness, result%eigenvectors(:, j), value, terms)
         properties%stiffness(j) = real(value, wp)
         if (.not. pending(j)) cycle
         group = group_of(problem, result, j)
         pending(group%member) = .false.
         call add_group(problem, group, momenta, properties)
      end do
      call leave_solve(threads_before)
      if (allocated(error)) return
      call move_alloc(properties, result%properties)
      if (.not. present(directions)) call note_unplaced(problem, result)
   end subroutine find_modal_properties

   ! Notes, once, that the directions of a mesh leave unknowns out.
   subroutine note_unplaced(problem, result)
      type(modal_problem_type), intent(in) :: problem
      type(modal_result_type), intent(inout) :: result
      character(len=note_length) :: note
      integer :: unplaced

      if (.not. allocated(problem%mesh)) return
      unplaced = problem%mesh%unplaced()
      if (unplaced == 0) return
      note = "the rigid motions of the mesh leave out "//text(unplaced)//" unknowns that have no row 0..1..0 in the "// &
         "transformation, and so do effective masses: give directions"
      if (allocated(result%notes)) then
         if (any(result%notes == note)) return
      end if
      call result%add_note(trim(note))
   end subroutine note_unplaced

   ! Names 1, 2, ... of given directions.
   pure function numbers(count) result(names)
      integer, intent(in) :: count
      character(len=direction_length) :: names(count)
      integer :: i

      do i = 1, count
         names(i) = text(i)
      end do
   end function numbers

   ! The nonzero rigid motions of the problem's mesh, and their names; none without a mesh.
   subroutine find_motions(problem, motions, names)
      type(modal_problem_type), intent(in) :: problem
      real(wp), allocatable, intent(out) :: motions(:, :)
      character(len=direction_length), allocatable, intent(out) :: names(:)
      real(wp), allocatable :: all_six(:, :)
      logical :: moves(6)
      integer :: i

      if (.not. allocated(problem%mesh)) then
         allocate (motions(problem%unknowns(), 0), names(0))
         return
      end if
      call problem%mesh%rigid_motions(all_six)
      moves = [(any(abs(all_six(:, i)) > 0), i=1, 6)]
      names = pack(rigid_motion_names, moves)
      allocate (motions(size(all_six, 1), count(moves)), source=all_six(:, pack([(i, i=1, 6)], moves)))
   end subroutine find_motions

   ! Computes M d for each direction d, and the total mass d^T M d.
   subroutine find_momenta(problem, directions, momenta, total, error)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: directions(:, :)
      complex(wp), allocatable, intent(out) :: momenta(:, :)
      real(wp), allocatable, intent(out) :: total(:)
      type(error_type), allocatable, intent(out) :: error
      complex(wp), allocatable :: columns(:, :)
      integer :: i

      if (size(directions, 1) /= problem%unknowns()) then
         call new_error(error, error_usage, "the directions have "//text(size(directions, 1))// &
            " entries, but the problem has "//text(problem%unknowns())//" unknowns")
         return
      end if
      allocate (columns(size(directions, 1), size(directions, 2)), source=cmplx(directions, kind=wp))
      allocate (momenta(size(directions, 1), size(directions, 2)), source=(0.0_wp, 0.0_wp))
      call problem%mass%add_product((1.0_wp, 0.0_wp), columns, momenta)
      allocate (total(size(directions, 2)), source=[(sum(directions(:, i)*real(momenta(:, i), wp)), &
         i=1, size(directions, 2))])
   end subroutine find_momenta

   ! Sets modal a and b, participation factors and effective masses of the modes of one eigenvalue.
   subroutine add_group(problem, group, momenta, properties)
      type(modal_problem_type), intent(in) :: problem
      type(mode_group_type), intent(in) :: group
      complex(wp), intent(in) :: momenta(:, :)
      type(modal_properties_type), intent(inout) :: properties
      complex(wp), allocatable :: factor(:, :), a(:, :)
      integer :: i, k

      k = size(group%member)
      allocate (a(k, k), source=group%derivative(problem))
      do i = 1, k
         properties%a(group%member(i)) = a(i, i)
         properties%b(group%member(i)) = -group%lambda*a(i, i)
      end do
      if (size(momenta, 2) == 0) return
      allocate (factor(k, size(momenta, 2)), source=matmul(transpose(group%chi), momenta))
      if (abs(group%lambda) > 0) then
         call divide_by_modal_a(a, factor)
         factor = group%lambda*factor
         ! The conjugate mode contributes as much.
         if (abs(aimag(group%lambda)) > 0) factor = 2*factor
      else
         call divide_for_rigid(problem, group, a, factor)
      end if
      do i = 1, k
         properties%participation(group%member(i), :) = factor(i, :)
         properties%effective_mass(group%member(i), :) = real(factor(i, :)*matmul(group%phi(:, i), momenta), wp)
      end do
   end subroutine add_group

   ! factor := A^{-1} factor, A the modal a matrix; NaN for a defective eigenvalue.
   subroutine divide_by_modal_a(a, factor)
      complex(wp), intent(in) :: a(:, :)
      complex(wp), intent(inout) :: factor(:, :)
      logical :: singular

      call solve_small(a, factor, singular)
      if (singular) factor = cmplx(ieee_value(1.0_wp, ieee_quiet_nan), ieee_value(1.0_wp, ieee_quiet_nan), wp)
   end subroutine divide_by_modal_a

   ! Participation factors of modes with eigenvalue zero. Undamped rigid motions are double zeros and have all of their mass; that
   ! of damped ones belongs to their decay modes.
   subroutine divide_for_rigid(problem, group, damping, factor)
      type(modal_problem_type), intent(in) :: problem
      type(mode_group_type), intent(in) :: group
      !> chi^T R phi.
      complex(wp), intent(in) :: damping(:, :)
      complex(wp), allocatable, intent(inout) :: factor(:, :)
      complex(wp), dimension(size(damping, 1), size(damping, 1)) :: copy, u, vt
      complex(wp) :: work(5*size(damping, 1))
      complex(wp), allocatable :: left(:, :), right(:, :), free(:, :)
      real(wp) :: s(size(damping, 1)), rwork(5*size(damping, 1)), terms, largest
      complex(wp) :: value
      integer :: k, i, damped, info

      k = size(damping, 1)
      largest = 0
      do i = 1, k
         call quadratic_form(problem%damping, group%phi(:, i), value, terms)
         largest = max(largest, terms)
      end do
      copy = damping
      call zgesvd("A", "A", k, k, copy, k, s, u, k, vt, k, work, size(work), rwork, info)
      damped = count(s > dependent*largest)
      allocate (left(k, k - damped), source=conjg(u(:, damped + 1:)))
      allocate (right(k, k - damped), source=conjg(transpose(vt(damped + 1:, :))))
      allocate (free(k - damped, size(factor, 2)), source=matmul(transpose(left), factor))
      call divide_by_modal_a(matmul(transpose(left), matmul(form_between(group%chi, problem%mass, group%phi), right)), free)
      factor = matmul(right, free)
   end subroutine divide_for_rigid
end module kschur_modal_properties
