!> The file from which a solve goes on that was killed: the state of its iteration, written now and then where convergence is
!> looked at. All before an iteration is computed again, which gives the same digits, and the iteration goes on from its state.
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

   character(len=*), parameter :: format = "kschur checkpoint "//kschur_version
   ! Writing takes this part of the time at most.
   real(wp), parameter :: part = 0.1_wp

   !> What was finished before the iteration that goes on, and is kept with it.
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
      ! Where to write; where to go on from, until that is done.
      character(len=:), allocatable :: target, source
      ! Checksums of the problem and of the options.
      integer(long) :: digests(2) = 0
      ! Iterations that were begun, looks at this one, and the iteration that was kept.
      integer :: iteration = 0, looks = 0, kept_iteration = 0
      ! When it was written last, and how long that took.
      integer(long) :: written = 0
      real(wp) :: seconds = 0
      type(staging_type) :: staging
      class(finished_type), pointer :: finished => null()
      !> Why it could not be written; not allocated: it could.
      character(len=:), allocatable, public :: complaint
   contains
      procedure :: begin
      !> To be called before each iteration.
      procedure :: next_iteration
      !> To be called before parts that have iterations of their own, and when one of them is finished.
      procedure :: begin_parts
      procedure :: next_part
      !> Whether the state of the iteration is to be carried to or from the archive now, which is open then.
      procedure :: opens
      procedure :: close => close_checkpoint
      procedure, private :: carry_head
   end type checkpoint_type

contains

   !> Fails where the file to go on from is no checkpoint of this problem with these options.
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
      self%looks = 0
   end subroutine next_iteration

   subroutine begin_parts(self, finished, error)
      class(checkpoint_type), intent(inout) :: self
      !> Kept from now on; of a solve that goes on, what it was. It must live as long as iterations go on.
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

      self%looks = self%looks + 1
      iteration = self%iteration
      if (allocated(self%source)) then
         opens = iteration == self%kept_iteration
         if (.not. opens) return
         call archive%open(self%source, .false., error)
      else
         opens = allocated(self%target) .and. self%looks > 1
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

   !> Ends what `opens` began. What cannot be written is no error, but a complaint: the computation is worth more.
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
