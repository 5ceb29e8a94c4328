!> Checkpoints: the state of an iteration is written from time to time when convergence is tested. A restarted solve repeats all
!> steps before the iteration, with the same digits, and continues from the saved state.
module kschur_checkpoint
   use kschur_archive, only: archive_type
   use kschur_clock, only: clock, seconds_since
   use kschur_error, only: error_type, new_error, error_input
   use kschur_files, only: kind_of_file, no_file, regular_file, staging_type
   use kschur_kinds, only: wp, long
   use kschur_release, only: kschur_version
   implicit none
   private
   public :: checkpoint_type, finished_type

   ! With a number of the format, which changes with what iterations carry.
   character(len=*), parameter :: format = "kschur checkpoint 7, "//kschur_version
   ! Largest fraction of the time spent on writing.
   real(wp), parameter :: part = 0.1_wp

   !> Results of earlier iterations of the same solve, saved with the current one.
   type, abstract :: finished_type
   contains
      procedure(carry_interface), deferred :: carry
   end type finished_type

   abstract interface
      subroutine carry_interface(self, archive)
         import :: archive_type, finished_type
         class(finished_type), intent(inout) :: self
         type(archive_type), intent(inout) :: archive
      end subroutine carry_interface
   end interface

   !> Made by `begin`.
   type :: checkpoint_type
      private
      ! File to write; file to continue from, until it has been read.
      character(len=:), allocatable :: target, source
      ! Checksums of the problem and of the options.
      integer(long) :: digests(2) = 0
      ! Iterations begun, convergence tests in this one, and number of the saved iteration.
      integer :: iteration = 0, checks = 0, kept_iteration = 0
      ! Time of the last write, and how long it took.
      integer(long) :: written = 0
      real(wp) :: seconds = 0
      type(staging_type) :: staging
      class(finished_type), pointer :: finished => null()
      !> Reason of a failed write; not allocated if there was none.
      character(len=:), allocatable, public :: complaint
   contains
      procedure :: begin
      !> Counts an iteration; to be called before each.
      procedure :: next_iteration
      !> Begins a solve in parts, whose results are saved too. `next_part`, to be called after each part, counts its iterations from
      !> one again.
      procedure :: begin_parts
      procedure :: next_part
      !> To be called at each convergence test: opens the archive and returns true if the state must be written or read now.
      procedure :: opens
      procedure :: close => close_checkpoint
      procedure, private :: carry_head
   end type checkpoint_type

contains

   !> Fails if the file to continue from is no checkpoint of this problem with these options.
   subroutine begin(self, problem, options, error, target, source)
      class(checkpoint_type), intent(out) :: self
      !> Checksums.
      integer(long), intent(in) :: problem, options
      type(error_type), allocatable, intent(out) :: error
      !> The file to write, and the one to go on from; not allocated: none.
      character(len=:), allocatable, intent(in) :: target, source
      type(archive_type) :: archive

      self%digests = [problem, options]
      if (allocated(target)) self%target = target
      self%written = clock()
      if (.not. allocated(source)) return
      self%source = source
      if (kind_of_file(source) == no_file) then
         call new_error(error, error_input, source//": there is no such file")
      else if (kind_of_file(source) /= regular_file) then
         call new_error(error, error_input, source//": not a file")
      end if
      call archive%open(source, .false., error)
      if (.not. allocated(error)) call self%carry_head(archive, self%kept_iteration, error)
      call archive%close(error)
   end subroutine begin

   pure subroutine next_iteration(self)
      class(checkpoint_type), intent(inout) :: self

      self%iteration = self%iteration + 1
      self%checks = 0
   end subroutine next_iteration

   subroutine begin_parts(self, finished, error)
      class(checkpoint_type), intent(inout) :: self
      !> Saved from now on; read if the solve continues from a checkpoint. Must outlive the iterations.
      class(finished_type), target, intent(inout) :: finished
      type(error_type), allocatable, intent(out) :: error
      type(archive_type) :: archive
      integer :: iteration

      self%finished => finished
      if (.not. allocated(self%source)) return
      call archive%open(self%source, .false., error)
      if (.not. allocated(error)) call self%carry_head(archive, iteration, error)
      call archive%close(error)
   end subroutine begin_parts

   pure subroutine next_part(self)
      class(checkpoint_type), intent(inout) :: self

      self%iteration = 0
   end subroutine next_part

   logical function opens(self, archive, error)
      class(checkpoint_type), intent(inout) :: self
      type(archive_type), intent(inout) :: archive
      type(error_type), allocatable, intent(out) :: error
      integer :: iteration

      self%checks = self%checks + 1
      iteration = self%iteration
      if (allocated(self%source)) then
         opens = iteration == self%kept_iteration
         if (.not. opens) return
         call archive%open(self%source, .false., error)
      else
         opens = allocated(self%target) .and. self%checks > 1
         if (opens) opens = part*seconds_since(self%written) >= self%seconds
         if (.not. opens) return
         self%written = clock()
         call self%staging%open(self%target, error)
         if (.not. allocated(error)) call archive%open(self%staging%path, .true., error)
      end if
      if (.not. allocated(error)) call self%carry_head(archive, iteration, error)
      if (.not. allocated(error)) return
      opens = .false.
      call self%close(archive, error)
   end function opens

   !> Closes the archive. A failed write is recorded, not raised: the computation goes on.
   subroutine close_checkpoint(self, archive, error)
      class(checkpoint_type), intent(inout) :: self
      type(archive_type), intent(inout) :: archive
      type(error_type), allocatable, intent(inout) :: error

      call archive%close(error)
      if (allocated(self%source)) then
         deallocate (self%source)
         return
      end if
      call self%staging%finish(error)
      self%seconds = seconds_since(self%written)
      self%written = clock()
      if (allocated(self%complaint)) deallocate (self%complaint)
      if (.not. allocated(error)) return
      self%complaint = error%message
      deallocate (error)
   end subroutine close_checkpoint

   ! Writes version, checksums, number of the iteration and earlier results; or reads them, and fails if they are of another version
   ! or solve.
   subroutine carry_head(self, archive, iteration, error)
      class(checkpoint_type), intent(in) :: self
      type(archive_type), intent(inout) :: archive
      integer, intent(inout) :: iteration
      type(error_type), allocatable, intent(inout) :: error
      character(len=len(format)) :: found
      integer(long) :: digests(2)

      found = format
      digests = self%digests
      call archive%carry(found)
      call archive%carry(digests(1))
      call archive%carry(digests(2))
      call archive%carry(iteration)
      if (associated(self%finished)) call self%finished%carry(archive)
      if (found /= format) then
         call new_error(error, error_input, self%source//": not a checkpoint of this version of kschur")
      else if (digests(1) /= self%digests(1)) then
         call new_error(error, error_input, self%source//": the checkpoint of another problem")
      else if (digests(2) /= self%digests(2)) then
         call new_error(error, error_input, self%source//": the checkpoint of a solve with other options")
      end if
   end subroutine carry_head
end module kschur_checkpoint
