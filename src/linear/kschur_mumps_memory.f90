!> Estimate of the memory that MUMPS needs for solves, besides its factors.
module kschur_mumps_memory
   use kschur_kinds, only: wp
   use kschur_memory, only: complex_bytes, integer_bytes
   implicit none
   private
   public :: solution_bytes

   !> Block size of right-hand sides in MUMPS.
   integer, parameter, public :: block_of_right_hand_sides = 32

contains

   !> Bytes that a solve with distributed factors needs in one process: right-hand sides, solutions and copies to send; in MUMPS
   !> a block of right-hand sides, some of the largest fronts, indices and message buffers.
   pure real(wp) function solution_bytes(order, front, rows, vectors)
      !> Order of the matrix, and of the largest front.
      integer, intent(in) :: order, front
      !> Number of rows of a vector in this process, and number of vectors.
      integer, intent(in) :: rows, vectors
      integer, parameter :: fronts = 8, places = 4, copies = 5
      real(wp), parameter :: messages = 3.0e7_wp

      solution_bytes = messages + places*integer_bytes*order + copies*complex_bytes*real(rows, wp)*vectors &
         + complex_bytes*min(vectors, block_of_right_hand_sides)*(real(order, wp) + fronts*front)
   end function solution_bytes
end module kschur_mumps_memory
