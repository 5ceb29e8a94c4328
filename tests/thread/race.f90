!> Two threads that add to one number without keeping each other out: what the thread sanitizer has to find. With the word
!> `apart` they do keep out, and it has to be silent.
program race
   use omp_lib, only: omp_set_num_threads
   implicit none
   integer :: i, total
   character(len=5) :: word

   call get_command_argument(1, word)
   call omp_set_num_threads(2)
   total = 0
   !$omp parallel do schedule(static)
   do i = 1, 1000
      if (word == "apart") then
         !$omp critical
         total = total + i
         !$omp end critical
      else
         total = total + i
      end if
   end do
   !$omp end parallel do
   print "(i0)", total
end program race
