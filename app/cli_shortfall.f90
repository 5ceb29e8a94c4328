!> Explains why a result has fewer modes than requested.
module cli_shortfall
   use cli_interrupt, only: is_interrupted
   use kschur, only: inaccurate_above, modal_result_type, reason_cancelled, reason_fewer_modes, reason_inaccurate, &
      reason_interrupted, reason_max_restarts, reason_names, text
   implicit none
   private
   public :: shortfall, take_interrupt

contains

   !> Sets the reason of a cancelled solve to interrupted if a signal cancelled it.
   subroutine take_interrupt(result)
      type(modal_result_type), intent(inout) :: result

      if (result%reason == reason_cancelled .and. is_interrupted()) result%reason = reason_interrupted
   end subroutine take_interrupt

   !> Sentence that explains why a result is incomplete.
   function shortfall(result) result(sentence)
      type(modal_result_type), intent(in) :: result
      character(len=:), allocatable :: sentence
      logical :: accurate(size(result%eigenvalues))

      sentence = text(size(result%eigenvalues))//" of "//text(result%modes_asked)//" modes: "
      select case (result%reason)
      case (reason_max_restarts)
         if (size(result%eigenvalues) < result%modes_asked) then
            sentence = sentence//"the others had not converged when the restarts ran out; "
         else
            sentence = sentence//"the restarts ran out before it was certain that they are the nearest; "
         end if
         sentence = sentence//"more --max-restarts or a larger --subspace may help"
      case (reason_fewer_modes)
         sentence = sentence//"the problem has no more"
      case (reason_inaccurate)
         accurate = result%backward_error <= inaccurate_above
         if (allocated(result%condition)) accurate = accurate .and. result%condition >= 0
         sentence = text(count(accurate))//" of "//text(result%modes_asked)// &
            " modes: the others are inaccurate; another --shift or none may help"
         if (count(accurate) >= result%modes_asked) sentence = text(count(accurate))// &
            " modes, of which not all are known: see the notes"
      case (reason_interrupted)
         sentence = sentence//"the computation was interrupted"
         if (size(result%eigenvalues) >= result%modes_asked) sentence = sentence//" before it was certain that they are the "// &
            "nearest, or all that was asked for was known of them"
      case default
         sentence = sentence//spaced(reason_names(result%reason))
      end select
   end function shortfall

   ! Replaces underscores and hyphens of a name by blanks.
   pure function spaced(name)
      character(len=*), intent(in) :: name
      character(len=len_trim(name)) :: spaced
      integer :: i

      do i = 1, len(spaced)
         spaced(i:i) = merge(" ", name(i:i), scan(name(i:i), "_-") == 1)
      end do
   end function spaced
end module cli_shortfall
