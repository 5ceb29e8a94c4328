!> Messages for the error codes of MUMPS.
module kschur_mumps_messages
   use kschur_error, only: error_type, new_error, error_library, error_memory, error_singular
   use kschur_text, only: text
   implicit none
   private
   public :: mumps_error, is_short_of_workspace

contains

   !> Whether the factorisation may succeed with more workspace (ICNTL(14)).
   pure logical function is_short_of_workspace(code)
      !> INFOG(1).
      integer, intent(in) :: code

      is_short_of_workspace = any(code == [-8, -9, -11, -12, -14, -15, -17, -20])
   end function is_short_of_workspace

   !> Raises the error that INFOG(1) < 0 and INFOG(2) stand for.
   pure subroutine mumps_error(code, detail, error)
      integer, intent(in) :: code, detail
      type(error_type), allocatable, intent(out) :: error
      integer :: kind

      select case (code)
      case (-10, -6, -40)
         kind = error_singular
      case (-5, -7, -8, -9, -11, -12, -13, -14, -15, -17, -18, -19, -20, -22)
         kind = error_memory
      case default
         kind = error_library
      end select
      call new_error(error, kind, "MUMPS failed: "//trim(sentence(code, detail))// &
         " (INFOG(1) = "//text(code)//", INFOG(2) = "//text(detail)//")")
   end subroutine mumps_error

   ! Description of an error code of MUMPS.
   pure function sentence(code, detail)
      integer, intent(in) :: code, detail
      character(len=100) :: sentence

      select case (code)
      case (-1)
         sentence = "process "//text(detail)//" reported an error"
      case (-2)
         sentence = "the number of matrix entries is out of range"
      case (-3)
         sentence = "its phases were called in the wrong order"
      case (-4)
         sentence = "the elimination order is not a permutation at place "//text(detail)
      case (-5)
         sentence = "no memory for the real workspace of the analysis"
      case (-6)
         sentence = "the pattern of the matrix is singular, of rank "//text(detail)
      case (-7)
         sentence = "no memory for the integer workspace of the analysis"
      case (-8)
         sentence = "the integer workspace of the factorisation is too small"
      case (-9)
         sentence = "the real workspace of the factorisation is too small"
      case (-10)
         sentence = "the matrix is singular"
      case (-11)
         sentence = "the real workspace of the solution is too small"
      case (-12)
         sentence = "the real workspace of the refinement is too small"
      case (-13)
         sentence = "no memory for the factors"
      case (-14)
         sentence = "the integer workspace of the solution is too small"
      case (-15)
         sentence = "the integer workspace of the refinement is too small"
      case (-16)
         sentence = "the order of the matrix, "//text(detail)//", is out of range"
      case (-17)
         sentence = "the send buffer is too small"
      case (-18)
         sentence = "the blocks of right-hand sides need more memory than there is"
      case (-19)
         sentence = "the allowed memory is too small for the factors"
      case (-20)
         sentence = "the receive buffer is too small"
      case (-21)
         sentence = "this number of processes is not possible here"
      case (-22)
         sentence = "an array that it needs is missing or too short"
      case (-23)
         sentence = "MPI was not initialised"
      case (-24)
         sentence = "the number of matrix entries does not fit the integers it was built with"
      case (-25)
         sentence = "the tree of processes is wrong"
      case (-26, -27)
         sentence = "a sparse right-hand side has a wrong column pointer"
      case (-28)
         sentence = "the column pointers of a sparse right-hand side do not start at 1"
      case (-29, -31, -32, -33, -34, -35)
         sentence = "its controls for right-hand sides or the Schur complement contradict each other"
      case (-30)
         sentence = "a buffer for a distributed solution is too small"
      case (-36, -37, -38, -39)
         sentence = "its controls contradict each other"
      case (-40)
         sentence = "the matrix was said to be positive definite and is not"
      case (-41, -42, -43, -44, -45, -46, -47, -48, -49)
         sentence = "a control of the solution phase has a wrong value"
      case (-50)
         sentence = "a fill-reducing ordering package failed"
      case (-51, -52)
         sentence = "the graph is too large for the integers of the ordering package"
      case (-53)
         sentence = "the ordering package met an inconsistent graph"
      case (-54, -55, -56, -57, -58)
         sentence = "a control of the parallel analysis has a wrong value"
      case (-69)
         sentence = "the integers of the ordering package and of MUMPS differ in size"
      case (-70, -71, -72, -73, -74, -75, -76, -77, -78, -79)
         sentence = "its state could not be saved or restored"
      case (-90)
         sentence = "the out-of-core files could not be handled"
      case (-800)
         sentence = "it met an internal inconsistency"
      case default
         sentence = "it returned a code that its documentation does not explain"
      end select
   end function sentence
end module kschur_mumps_messages
