!> Certifies modes by a count of eigenvalues, as `options%certify` requests.
module kschur_certify
   use kschur_context, only: solve_context_type, whole_iterated
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_modes, only: modes_type
   use kschur_outcome, only: certified_no, certified_yes, inaccurate_above, reason_cancelled, reason_converged, &
      reason_fewer_modes, reason_inaccurate
   use kschur_text, only: text
   use kschur_tolerances, only: blurred_value, nearly_zero
   use kschur_winding_certificate, only: certify_by_winding, winding_certificate_type
   implicit none
   private
   public :: certify_modes

contains

   !> Counts the eigenvalues around the target by the winding number of the determinant, unless the modes are certified already or
   !> the solve was cancelled. Sets `certified` and `missing`; if the count fails, a note says why. The reduced and balanced problem
   !> is used: with entries of one size, rounding does not destroy the phase of the determinant.
   subroutine certify_modes(s, modes)
      type(solve_context_type), intent(inout) :: s
      type(modes_type), intent(inout) :: modes
      type(winding_certificate_type) :: certificate
      type(error_type), allocatable :: error
      complex(wp) :: nothing_beyond(0)

      if (modes%certified == certified_yes) modes%missing = 0
      if (modes%certified == certified_yes .or. modes%reason == reason_cancelled) return
      call s%announce_phase("count of eigenvalues", whole_iterated, error)
      if (allocated(error)) then
         call s%add_note("the eigenvalues could not be counted: "//error%message)
         return
      end if
      do
         call certify_by_winding(s%work, s%inner%complex, modes%lambda, nothing_beyond, s%known%deflation%zeros(), &
            s%options%target, nearly_zero*s%reference(), certificate, monitor=s%monitor)
         call s%effort%add_effort(certificate)
         if (certificate%surplus == 0) exit
         if (any(modes%reason == [reason_converged, reason_fewer_modes])) modes%reason = reason_inaccurate
         ! Inaccurate modes beside accurate ones are these once more.
         if (.not. any(modes%backward_error > inaccurate_above)) exit
         call modes%leave_out(modes%backward_error > inaccurate_above)
      end do
      select case (certificate%verdict)
      case (certified_yes)
         modes%missing = 0
         ! Only a converged list is certified, even if no nearer mode is missing. As many accurate modes as are wanted are one then.
         if (modes%reason == reason_inaccurate) then
            if (size(modes%lambda) == s%options%modes .and. size(modes%unlisted) == 0 .and. &
               all(modes%backward_error <= inaccurate_above .and. (modes%uncertainty <= blurred_value*abs(modes%lambda) .or. &
               modes%motion > 0))) modes%reason = reason_converged
         end if
         if (modes%reason == reason_converged) modes%certified = certified_yes
      case (certified_no)
         modes%missing = certificate%missing
         modes%certified = certified_no
         call s%add_note("eigenvalues that are nearer to the target than the furthest mode, but not among the modes: "// &
            text(modes%missing)//", both of a conjugate pair counted")
      case default
         call s%add_note("the eigenvalues could not be counted: "//trim(certificate%reason))
      end select
   end subroutine certify_modes
end module kschur_certify
