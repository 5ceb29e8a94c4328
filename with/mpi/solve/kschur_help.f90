!> What all processes but the first one do of a solve: what the first one says.
module kschur_help
   use kschur_mumps_help, only: help_mumps, mumps_instance_type
   use kschur_processes, only: number_of_words, processes_type, word_end, word_mumps
   implicit none
   private
   public :: help

contains

   subroutine help(processes)
      type(processes_type), target, intent(inout) :: processes
      type(mumps_instance_type), allocatable :: instances(:)
      integer :: words(number_of_words)

      allocate (instances(0))
      do
         call processes%hear(words)
         select case (words(1))
         case (word_mumps)
            call help_mumps(instances, processes, words)
         case (word_end)
            exit
         end select
      end do
   end subroutine help
end module kschur_help
