!> What all processes but the first one do of a solve: what the first one says.
module kschur_help
   use kschur_band_groups, only: lead_group
   use kschur_basis_help, only: basis_instance_type, help_basis
   use kschur_error, only: error_type
   use kschur_mumps_help, only: help_mumps, mumps_instance_type
   use kschur_processes, only: number_of_words, processes_type, word_basis, word_end, word_matrix, word_mumps, &
      word_operator, word_parts, word_problem, word_quadratic, word_together, word_two_level
   use kschur_quadratic_rows, only: help_share_quadratic, quadratic_parts_type
   use kschur_row_matrix, only: help_multiply, row_matrix_part_type
   use kschur_shared_problem, only: shared_problem_type
   use kschur_symmetric_operator, only: symmetric_shift_invert_type
   use kschur_symmetric_rows, only: help_share
   use kschur_together_help, only: help_together
   use kschur_two_level_help, only: help_two_level
   use mpi_f08, only: MPI_Comm
   implicit none
   private
   public :: help

contains

   recursive subroutine help(processes, shared)
      type(processes_type), target, intent(inout) :: processes
      !> The problem, where its rows are shared.
      type(shared_problem_type), intent(inout), optional :: shared
      type(mumps_instance_type), allocatable :: instances(:)
      type(basis_instance_type), allocatable :: bases(:)
      type(row_matrix_part_type), allocatable :: parts(:)
      type(symmetric_shift_invert_type), pointer :: operator
      type(quadratic_parts_type) :: quadratic
      type(processes_type), pointer :: all
      ! The first process has it as well.
      type(error_type), allocatable :: none
      integer :: words(number_of_words)

      all => processes
      allocate (instances(0), bases(0), parts(0))
      do
         call processes%hear(words)
         select case (words(1))
         case (word_problem)
            call shared%give(processes, none)
         case (word_matrix)
            call help_multiply(parts, processes, words)
         case (word_mumps)
            call help_mumps(instances, all, words)
         case (word_operator)
            call help_share(operator, parts, instances, all, words)
         case (word_quadratic)
            call help_share_quadratic(quadratic, parts, instances, all, words)
         case (word_together)
            call help_together(bases, operator, operator%deflation%shapes, words)
         case (word_two_level)
            call help_two_level(bases, quadratic, words)
         case (word_basis)
            call help_basis(bases, processes, words)
         case (word_parts)
            call work_in_group(processes, words(2))
         case (word_end)
            exit
         end select
      end do
   end subroutine help

   ! One of so many groups does what they all did before.
   recursive subroutine work_in_group(processes, groups)
      type(processes_type), intent(in) :: processes
      integer, intent(in) :: groups
      type(processes_type), target :: group
      type(MPI_Comm) :: leaders
      type(error_type), allocatable :: none

      call processes%split(groups, group, leaders)
      if (group%rank == 0) then
         call lead_group(group, leaders)
      else
         call help(group)
      end if
      call group%leave(none)
   end subroutine work_in_group
end module kschur_help
