!> Computes the modes of one part of a band, and compares their number with the count.
module kschur_band_part
   use kschur_archive, only: archive_type
   use kschur_band_parts, only: part_type
   use kschur_checkpoint, only: finished_type
   use kschur_context, only: solve_context_type
   use kschur_effort, only: effort_type
   use kschur_error, only: error_type, error_singular
   use kschur_kinds, only: wp
   use kschur_modes, only: modes_type
   use kschur_oscillators, only: damp_modes
   use kschur_outcome, only: certified_no, certified_unknown, certified_yes, reason_converged
   use kschur_result, only: note_length
   use kschur_search, only: find_modes
   use kschur_shift, only: place_shift
   use kschur_symmetric_transform, only: symmetric_transform_type
   use kschur_tolerances, only: same_value, spurious, twelve_digits
   implicit none
   private
   public :: finished_parts_type, part_modes_type, solve_part

   !> The damped modes of a part, with their errors in the problem as given, and what is told of them; certified if as many undamped
   !> modes were found as were counted.
   type, extends(modes_type) :: part_modes_type
      !> Number of undamped modes.
      integer :: oscillators = 0
      !> False if an eigenvalue omega^2 is negative, so that the count does not apply.
      logical :: counted = .true.
      !> Effort of the part: applications, restarts and factorisations, no times.
      type(effort_type) :: effort
   end type part_modes_type

   !> The modes of the parts solved so far, as a checkpoint saves them.
   type, extends(finished_type) :: finished_parts_type
      !> Number of parts solved.
      integer :: parts = 0
      type(part_modes_type), allocatable :: found(:)
   contains
      procedure :: carry
   end type finished_parts_type

contains

   ! Writes the solved parts to a checkpoint, or reads them.
   subroutine carry(self, archive)
      class(finished_parts_type), intent(inout) :: self
      type(archive_type), intent(inout) :: archive
      integer :: i

      call archive%carry(self%parts)
      self%parts = min(self%parts, size(self%found))
      do i = 1, self%parts
         call carry_part(self%found(i), archive)
      end do
   end subroutine carry

   ! Writes or reads what the band uses of a part.
   subroutine carry_part(found, archive)
      type(part_modes_type), intent(inout) :: found
      type(archive_type), intent(inout) :: archive
      logical :: is_real
      integer :: i

      is_real = found%is_real()
      call archive%carry(is_real)
      if (is_real) then
         call archive%carry(found%real_phi)
      else
         call archive%carry(found%phi)
      end if
      call archive%carry(found%lambda)
      call archive%carry(found%xi)
      call archive%carry(found%backward_error)
      call archive%carry(found%error_bound)
      call archive%carry(found%oscillators)
      call archive%carry(found%reason)
      call archive%carry(found%certified)
      call archive%carry(found%locking_error)
      call archive%carry(found%history%converged)
      call archive%carry(found%history%operator_applications)
      call archive%carry(found%history%residual)
      call archive%carry(found%effort%operator_applications)
      call archive%carry(found%effort%restarts)
      do i = 1, size(found%effort%factorizations_for)
         call archive%carry(found%effort%factorizations_for(i))
      end do
      found%effort%factorizations = sum(found%effort%factorizations_for)
   end subroutine carry_part

   !> Computes the modes of a part, from those of the undamped problem. The lowest part is solved from near zero, with all modes
   !> below it; any other from a shift in its middle, moved a little if that is an eigenvalue.
   subroutine solve_part(s, part, found, error)
      !> Its damping is left out.
      type(solve_context_type), target, intent(inout) :: s
      type(part_type), intent(in) :: part
      type(part_modes_type), intent(out) :: found
      type(error_type), allocatable, intent(out) :: error
      ! Relative displacements of the shift from the middle, tried in turn.
      real(wp), parameter :: offsets(3) = [0.0_wp, 1.0e-3_wp, -2.0e-3_wp]
      type(effort_type) :: effort_before
      character(len=note_length), allocatable :: notes(:)
      integer, allocatable :: in_part(:)
      integer :: expected, attempt, i

      expected = part%below_to - part%below_from
      call s%drop_transform()
      effort_before = s%effort
      ! Notes on the shift of a part are internal: they are discarded.
      allocate (notes, source=s%notes)
      if (allocated(s%options%shift)) deallocate (s%options%shift)
      if (part%is_lowest()) then
         s%options%modes = part%below_to
         s%options%target = 0
         call place_shift(s, error)
      else
         s%options%modes = expected
         s%options%target = cmplx(0, (part%from + part%to)/2, wp)
         do attempt = 1, size(offsets)
            s%options%shift = (1 + offsets(attempt))*s%options%target
            call place_shift(s, error)
            if (.not. allocated(error)) exit
            if (error%code /= error_singular) return
         end do
      end if
      if (allocated(error)) return
      call move_alloc(notes, s%notes)
      ! The count of the part certifies its modes. None lies below the lowest part.
      select type (form => s%transform)
      type is (symmetric_transform_type)
         if (part%is_lowest()) then
            call form%take_count(s%options%target, -part%to**2, part%to**2, 0, part%below_to)
         else
            call form%take_count(s%options%target, part%from**2, part%to**2, part%below_from, part%below_to)
         end if
      end select
      call find_modes(s, found%modes_type, error)
      if (allocated(error)) return
      found%effort%operator_applications = s%effort%operator_applications - effort_before%operator_applications
      found%history%operator_applications = found%history%operator_applications - effort_before%operator_applications
      found%effort%restarts = s%effort%restarts - effort_before%restarts
      ! Factorisations for the certificate are added to those of the context only when the transform is dropped.
      found%effort%factorizations_for = s%effort%factorizations_for - effort_before%factorizations_for + &
         s%transform%certificate%factorizations_for
      found%effort%factorizations = sum(found%effort%factorizations_for)
      found%counted = all(abs(real(found%lambda, wp)) <= twelve_digits*abs(found%lambda))
      if (.not. found%counted) return
      in_part = pack([(i, i=1, size(found%lambda))], aimag(found%lambda) > (1 - same_value)*part%from .and. &
         aimag(found%lambda) < (1 + same_value)*part%to .and. abs(found%lambda) > 0)
      if (size(in_part) > expected) in_part = in_part(:expected)
      found%oscillators = size(in_part)
      found%certified = merge(certified_yes, certified_no, found%oscillators == expected)
      if (found%reason /= reason_converged) found%certified = certified_unknown
      call found%take(in_part)
      call damp_modes(s%damped, found)
      if (any(found%backward_error > spurious) .and. found%certified == certified_yes) found%certified = certified_no
   end subroutine solve_part
end module kschur_band_part
