!> Messages for the INFO codes of ARPACK.
module kschur_arpack_messages
   use kschur_error, only: error_type, new_error, error_library
   use kschur_text, only: text
   implicit none
   private
   public :: arpack_error

   !> INFO codes: restart limit reached; no shifts could be applied; zero start vector; no Krylov space of the requested
   !> dimension.
   integer, parameter, public :: info_restarts = 1, info_no_shifts = 3, info_zero_start = -9, info_exhausted = -9999
   !> INFO of dneupd, dseupd and zneupd if nothing converged.
   integer, parameter, public :: info_nothing = -14

   ! Largest length of a message.
   integer, parameter :: longest = 120

contains

   !> Sets the error that belongs to INFO of a routine.
   pure subroutine arpack_error(routine, info, error)
      !> Name, as "dnaupd"; routines that extract eigenvectors have other codes.
      character(len=*), intent(in) :: routine
      integer, intent(in) :: info
      type(error_type), allocatable, intent(out) :: error
      character(len=longest) :: reason

      if (index(routine, "eupd") > 0) then
         reason = reason_of_extraction(info)
      else
         reason = reason_of_iteration(info)
      end if
      call new_error(error, error_library, "ARPACK failed: "//trim(reason)//" ("//routine//" returned info = "//text(info)//")")
   end subroutine arpack_error

   ! What INFO of an iterating routine, *aupd, means.
   pure function reason_of_iteration(info) result(reason)
      integer, intent(in) :: info
      character(len=longest) :: reason

      select case (info)
      case (info_restarts)
         reason = "the restarts ran out"
      case (2)
         reason = "it returned a code that it no longer uses"
      case (info_no_shifts)
         reason = "no shift could be applied in a restart; a larger subspace may help"
      case (-8)
         reason = "LAPACK could not compute the eigenvalues of the projected problem"
      case (info_zero_start)
         reason = "the start vector is zero"
      case (info_exhausted)
         reason = "the operator has no Krylov space of the dimension that was asked for"
      case default
         reason = reason_of_arguments(info)
      end select
   end function reason_of_iteration

   ! What INFO of an extracting routine, *eupd, means.
   pure function reason_of_extraction(info) result(reason)
      integer, intent(in) :: info
      character(len=longest) :: reason

      select case (info)
      case (1)
         reason = "the Schur form could not be reordered"
      case (-8)
         reason = "LAPACK could not compute the Schur form of the projected problem"
      case (-9)
         reason = "LAPACK could not compute the eigenvectors of the projected problem"
      case (info_nothing)
         reason = "no eigenvalue was found to the tolerance"
      case (-15, -17)
         reason = "iteration and extraction count different numbers of converged eigenvalues"
      case default
         reason = reason_of_arguments(info)
      end select
   end function reason_of_extraction

   ! What INFO about arguments means, in either kind of routine.
   pure function reason_of_arguments(info) result(reason)
      integer, intent(in) :: info
      character(len=longest) :: reason

      select case (info)
      case (-1)
         reason = "the order of the operator is not positive"
      case (-2)
         reason = "the number of eigenvalues is not positive"
      case (-3)
         reason = "the dimension of the Krylov space does not lie between the number of eigenvalues and the order"
      case (-4)
         reason = "the number of restarts is not positive"
      case (-5)
         reason = "it does not know which eigenvalues are wanted"
      case (-6)
         reason = "it does not know the inner product"
      case (-7)
         reason = "its workspace is too small"
      case (-10, -11, -12, -13, -16)
         reason = "its parameters contradict each other"
      case default
         reason = "it returned a code that its documentation does not explain"
      end select
   end function reason_of_arguments
end module kschur_arpack_messages
