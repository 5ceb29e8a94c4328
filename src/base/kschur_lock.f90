!> Serialises calls of libraries that are not thread-safe: sequential MUMPS has module variables, METIS uses C's random number
!> generator, serial HDF5 has tables of open objects. A lock is held for one call of a library; that of ARPACK for a whole
!> iteration including the operator, the only one under which code of the user is called.
module kschur_lock
   use, intrinsic :: iso_c_binding, only: c_int
   implicit none
   private
   public :: acquire_lock, release_lock

   !> The locks: four libraries, and the check of a problem that threads share. kschur_lock.c has the number of mutexes.
   integer(c_int), parameter, public :: lock_mumps = 0, lock_metis = 1, lock_hdf5 = 2, lock_problem = 3, lock_arpack = 4

   interface
      integer(c_int) function c_acquire(lock) bind(c, name="kschur_acquire_lock")
         import :: c_int
         integer(c_int), value :: lock
      end function c_acquire

      subroutine c_release(lock) bind(c, name="kschur_release_lock")
         import :: c_int
         integer(c_int), value :: lock
      end subroutine c_release
   end interface

contains

   !> Waits until no other thread holds the lock, then takes it.
   subroutine acquire_lock(lock, held)
      !> One of `lock_*`.
      integer(c_int), intent(in) :: lock
      !> Whether this thread holds the lock already; then nothing is done.
      logical, intent(out), optional :: held
      integer(c_int) :: status

      status = c_acquire(lock)
      if (present(held)) held = status /= 0
   end subroutine acquire_lock

   !> Releases the lock.
   subroutine release_lock(lock)
      !> One of `lock_*`.
      integer(c_int), intent(in) :: lock

      call c_release(lock)
   end subroutine release_lock
end module kschur_lock
