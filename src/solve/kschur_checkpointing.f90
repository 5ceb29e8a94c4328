!> Starts the checkpoints of a solve, and identifies the solve by checksums of its problem and options.
module kschur_checkpointing
   use kschur_archive, only: checksum
   use kschur_checkpoint, only: checkpoint_type
   use kschur_context, only: solve_context_type
   use kschur_error, only: error_type, new_error, error_usage
   use kschur_kinds, only: wp, long
   use kschur_options, only: modal_options_type, method_krylov_schur
   use kschur_problem, only: modal_problem_type
   use kschur_sparse, only: csr_matrix_type
   implicit none
   private
   public :: begin_checkpoint

contains

   !> Opens the checkpoint that the options name, if any, and attaches it to the context. Fails if this kind of solve keeps no
   !> checkpoints, or if `options%resume` is the checkpoint of another problem or of other options.
   subroutine begin_checkpoint(s, edges, checkpoint, error)
      type(solve_context_type), intent(inout) :: s
      !> Edges of a band (Hz); empty: modes nearest to a target.
      real(wp), intent(in) :: edges(:)
      !> Must live as long as the context.
      type(checkpoint_type), target, intent(inout) :: checkpoint
      type(error_type), allocatable, intent(out) :: error

      associate (options => s%options)
         if (.not. (allocated(options%checkpoint) .or. allocated(options%resume))) return
         if (options%method /= method_krylov_schur) then
            call new_error(error, error_usage, "the iteration of ARPACK has no checkpoint: leave out the method")
         else if (s%processes%number > 1 .and. size(edges) > 0) then
            call new_error(error, error_usage, &
               "several processes keep no checkpoint of a band, as each has parts of it: take one process")
         else if (s%dense) then
            call new_error(error, error_usage, "the formulation dense iterates nothing: leave out the checkpoint")
         else
            call checkpoint%begin(digest_of_problem(s%problem), digest_of_options(options, edges), error, &
               options%checkpoint, options%resume)
         end if
      end associate
      if (.not. allocated(error)) s%checkpoint => checkpoint
   end subroutine begin_checkpoint

   ! Checksum of all matrices.
   integer(long) function digest_of_problem(problem) result(digest)
      type(modal_problem_type), intent(in) :: problem

      digest = 1
      call add_matrix(problem%mass)
      call add_matrix(problem%stiffness)
      call add_matrix(problem%damping)
      call add_matrix(problem%constraints)
      if (allocated(problem%loss)) call add_matrix(problem%loss)

   contains

      ! Adds sizes, pattern and values of a matrix to the checksum.
      subroutine add_matrix(matrix)
         type(csr_matrix_type), intent(in) :: matrix

         digest = checksum(digest, [matrix%rows, matrix%columns])
         digest = checksum(digest, matrix%row_start)
         digest = checksum(digest, matrix%column)
         digest = checksum(digest, matrix%value)
      end subroutine add_matrix
   end function digest_of_problem

   ! Checksum of the options that change the computation. Threads are left out: they change digits only where MUMPS factors.
   integer(long) function digest_of_options(options, edges) result(digest)
      type(modal_options_type), intent(in) :: options
      real(wp), intent(in) :: edges(:)

      digest = checksum(1_long, [options%modes, options%formulation, options%constraint_scaling, options%inner, &
         options%subspace, options%block, options%max_restarts, merge(1, 0, options%presolve), options%normalisation, &
         merge(1, 0, options%left), merge(1, 0, options%certify), &
         merge(1, 0, options%uncounted), options%seed])
      digest = checksum(digest, [real(options%target, wp), aimag(options%target), options%tolerance, edges])
      if (allocated(options%shift)) digest = checksum(digest, [real(options%shift, wp), aimag(options%shift)])
   end function digest_of_options
end module kschur_checkpointing
