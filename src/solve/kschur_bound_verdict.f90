!> What error bounds say of a list of modes (docs/theory.md, section 11).
module kschur_bound_verdict
   use kschur_context, only: solve_context_type
   use kschur_finishing, only: is_small
   use kschur_hidden, only: are_known
   use kschur_kinds, only: wp
   use kschur_mode_selection, only: distances
   use kschur_modes, only: modes_type
   use kschur_options, only: formulation_quadratic
   use kschur_outcome, only: certified_unknown, certified_yes, reason_converged, reason_fewer_modes, reason_inaccurate
   use kschur_text, only: text
   use kschur_tolerances, only: same_value
   implicit none
   private
   public :: judge_bounds

contains

   !> Leaves out modes whose residual lets the eigenvalue be off by as much as its size, or that are not accurate enough and have no
   !> smaller bound where others have bounds, as no digit is known then, and makes the result inaccurate. (`tell_hidden` judges
   !> large symmetric problems, whose bounds are by norms.) Where only rounding of the entries of the matrices does, the matrices as
   !> they are have this eigenvalue: that is noted. Neither list is certified, nor one of a dense solve in which the disc of an
   !> eigenvalue reaches as far from the target as one that is not listed: which is nearer is not known.
   subroutine judge_bounds(s, modes)
      type(solve_context_type), intent(inout) :: s
      !> Of the problem as given.
      type(modes_type), intent(inout) :: modes
      logical, dimension(size(modes%lambda)) :: judged, blurred, unknown

      if (size(modes%lambda) == 0 .or. (s%problem%symmetric .and. .not. (s%dense .or. is_small(s)))) return
      judged = abs(modes%lambda) > 0 .and. .not. are_known(s, modes%lambda)
      blurred = judged .and. modes%error_bound >= abs(modes%lambda)
      unknown = judged .and. .not. modes%error_bound < abs(modes%lambda) .and. (modes%uncertainty >= abs(modes%lambda) .or. &
         (any(judged .and. modes%error_bound >= 0) .and. modes%backward_error > s%options%good_enough()))
      if (any(unknown)) then
         call modes%leave_out(unknown)
         if (modes%missing == 0) modes%missing = -1
         if (any(modes%reason == [reason_converged, reason_fewer_modes])) modes%reason = reason_inaccurate
      else if (any(blurred)) then
         call s%add_note("modes that rounding of the entries of the matrices may change by more than they are: "// &
            text(count(blurred)))
         ! A pair may be two real modes, and two real ones a pair: the number of modes is not known then.
         if (modes%reason == reason_fewer_modes .and. s%formulation == formulation_quadratic .and. .not. s%is_lossy()) &
            modes%reason = reason_inaccurate
      else if (.not. reaches_unlisted(s, modes)) then
         return
      end if
      if (modes%certified /= certified_yes) return
      modes%certified = certified_unknown
      modes%missing = -1
   end subroutine judge_bounds

   ! Whether a disc reaches as far as an eigenvalue of a dense solve that is not listed.
   logical function reaches_unlisted(s, modes)
      type(solve_context_type), intent(in) :: s
      type(modes_type), intent(in) :: modes
      real(wp) :: away(size(modes%lambda)), beyond

      reaches_unlisted = .false.
      if (.not. allocated(s%transform)) return
      if (.not. allocated(s%transform%certificate%distances)) return
      away = distances(modes%lambda, s%options%target)
      associate (all_distances => s%transform%certificate%distances)
         ! Copies of the furthest mode may be listed or not.
         beyond = minval(all_distances, all_distances > maxval(away) + same_value*maxval(abs(modes%lambda)))
      end associate
      reaches_unlisted = any(modes%error_bound >= 0 .and. away + modes%error_bound > beyond)
   end function reaches_unlisted
end module kschur_bound_verdict
