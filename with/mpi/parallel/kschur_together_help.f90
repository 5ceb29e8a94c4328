!> What the other processes do of a block Lanczos iteration: the same as the first one, with their rows.
module kschur_together_help
   use kschur_basis_help, only: basis_instance_type
   use kschur_block_decomposition, only: block_decomposition_type
   use kschur_block_lanczos, only: add_random_here, expand_here
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_krylov_options, only: krylov_statistics_type
   use kschur_operator, only: symmetric_operator_type
   use kschur_processes, only: number_of_words
   use kschur_row_team, only: to_give, to_take
   use kschur_together, only: end_together, join_together, to_add_random, to_expand
   implicit none
   private
   public :: help_together

contains

   !> Does what the first process has called.
   subroutine help_together(instances, operator, excluded, words)
      !> The bases that there are.
      type(basis_instance_type), intent(in) :: instances(:)
      !> On rows of vectors.
      class(symmetric_operator_type), intent(inout) :: operator
      !> Rows of what is kept out.
      real(wp), intent(in) :: excluded(:, :)
      !> Number of the basis, what is done, and its arguments, after the first word.
      integer, intent(in) :: words(number_of_words)
      type(block_decomposition_type), pointer :: d
      ! The first process has them as well.
      type(krylov_statistics_type) :: statistics
      type(error_type), allocatable :: error
      real(wp) :: none(0, 0), limit

      d => instances(findloc(instances%number, words(2), dim=1))%decomposition
      d%team = d%basis%team()
      if (.not. allocated(d%excluded) .and. size(excluded, 2) > 0) allocate (d%excluded, source=excluded)
      select case (words(3))
      case (to_expand)
         call join_together(d, words(4), words(5), limit)
         call expand_here(operator, d, limit, statistics, error)
         call end_together(d)
      case (to_add_random)
         call join_together(d, words(4), words(5), limit)
         call add_random_here(operator, d, words(6), words(7), statistics, error)
         call end_together(d)
      case (to_give)
         call d%team%give(d%images, words(4), none)
      case (to_take)
         call d%team%take(none, words(4), d%images)
      end select
   end subroutine help_together
end module kschur_together_help
