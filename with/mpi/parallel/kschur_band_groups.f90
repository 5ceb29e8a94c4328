!> Groups of processes that count and compute parts of a band in parallel, each group with the problem and its own factors. The
!> first process of each counts in turn, then takes parts from a queue; that of the first group gathers the results.
module kschur_band_groups
   use kschur_band_damping, only: left_damping_type
   use kschur_band_messages, only: add_counts, receive_part, send_part, share_parts, share_problem, share_thetas
   use kschur_band_part, only: part_modes_type, solve_part
   use kschur_band_parts, only: count_at, most_from_zero, part_type
   use kschur_context, only: begin_solve => begin, solve_context_type
   use kschur_effort, only: for_count
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_memory_estimate, only: estimate_memory, memory_estimate_type
   use kschur_options, only: modal_options_type
   use kschur_part_queue, only: part_queue_type
   use kschur_preparation, only: examine, reduce
   use kschur_problem, only: modal_problem_type
   use kschur_processes, only: processes_type, request_parts
   use kschur_sorting, only: ascending_order
   use mpi_f08, only: MPI_Comm, MPI_Comm_free, MPI_Comm_rank
   implicit none
   private
   public :: band_groups_type, lead_group

   ! Instead of a count, from a group that failed.
   integer, parameter :: not_counted = -2

   !> The groups, seen from the first process.
   type :: band_groups_type
      private
      integer :: number = 1
      !> All processes, and communicator of the first ones of groups.
      type(processes_type) :: all
      type(MPI_Comm) :: leaders
      type(part_queue_type) :: queue
      logical :: announced = .false.
      !> Parts in the order of the queue.
      integer, allocatable :: order(:)
      !> Results of this group that were not yet asked for.
      type(part_modes_type), allocatable :: mine(:)
      logical, allocatable :: solved(:), gathered(:)
   contains
      !> Splits the processes into groups, and distributes the problem to them.
      procedure :: begin
      !> Number of groups.
      procedure :: number_of_groups
      !> Counts eigenvalues, each group some of them.
      procedure :: count => count_together
      !> Distributes the list of parts; no count follows.
      procedure :: announce
      !> Returns the modes of part i; called for all parts in order. Computes parts from the queue until this one is done, or
      !> receives it from the group that took it.
      procedure :: obtain
      !> Ends the work on parts, and receives those not asked for.
      procedure :: finish
      !> Joins the groups again; call after all factors are freed.
      procedure :: disband
   end type band_groups_type

contains

   subroutine begin(self, problem, options, processes, error)
      class(band_groups_type), intent(inout) :: self
      type(modal_problem_type), intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      !> On return the group of this process.
      type(processes_type), intent(inout) :: processes
      type(error_type), allocatable, intent(out) :: error
      type(modal_problem_type) :: shared
      type(modal_options_type) :: settings

      self%number = min(options%groups, processes%number)
      if (options%groups == 0) self%number = fitting_number(problem, options, processes)
      if (self%number == 1) return
      self%all = processes
      call self%all%send_request([request_parts, self%number])
      call self%all%split(self%number, processes, self%leaders)
      call self%queue%begin(self%leaders)
      shared%mass = problem%mass
      shared%damping = problem%damping
      shared%stiffness = problem%stiffness
      shared%constraints = problem%constraints
      shared%damping_kind = problem%damping_kind
      shared%alpha = problem%alpha
      shared%beta = problem%beta
      settings = options
      call share_problem(shared, settings, self%leaders, error)
   end subroutine begin

   ! As many groups as there are processes, or as half of the memory of their machines holds, as each holds the whole problem and
   ! its factors: parts need no messages then.
   integer function fitting_number(problem, options, processes) result(number)
      type(modal_problem_type), intent(in) :: problem
      type(modal_options_type), intent(in) :: options
      type(processes_type), intent(in) :: processes
      type(modal_options_type) :: of_part
      type(memory_estimate_type) :: estimate
      type(error_type), allocatable :: error

      number = processes%number
      if (number == 1 .or. problem%unknowns() < processes%distribute()) return
      of_part = options
      of_part%modes = most_from_zero
      call estimate_memory(problem, of_part, estimate, error)
      number = 1
      if (allocated(error)) return
      number = max(1, int(min(real(processes%number, wp), processes%memory()/(2*estimate%total()))))
   end function fitting_number

   pure integer function number_of_groups(self)
      class(band_groups_type), intent(in) :: self

      number_of_groups = self%number
   end function number_of_groups

   ! Counts the eigenvalues omega^2 below each theta ((rad/s)^2). What another group cannot count is counted here.
   subroutine count_together(self, s, theta, below)
      class(band_groups_type), intent(inout) :: self
      type(solve_context_type), intent(inout) :: s
      real(wp), intent(in) :: theta(:)
      integer, allocatable, intent(out) :: below(:)
      real(wp), allocatable :: shared(:)
      integer :: i

      allocate (below(size(theta)))
      allocate (shared, source=theta)
      if (self%number > 1) call share_thetas(shared, self%leaders)
      call count_in_turn(s, theta, 0, self%number, below)
      if (self%number == 1) return
      call add_counts(below, self%leaders)
      do i = 1, size(theta)
         if (below(i) == not_counted) then
            call count_at(s, theta(i), below(i))
         else if (mod(i - 1, self%number) > 0) then
            s%effort%factorizations = s%effort%factorizations + 1
            s%effort%factorizations_for(for_count) = s%effort%factorizations_for(for_count) + 1
         end if
      end do
   end subroutine count_together

   ! Counts the eigenvalues below each theta that falls to this group, as they take turns; zero for the others.
   subroutine count_in_turn(s, theta, group, groups, below)
      type(solve_context_type), intent(inout) :: s
      real(wp), intent(in) :: theta(:)
      !> Number of this group, from 0, and of all.
      integer, intent(in) :: group, groups
      integer, intent(out) :: below(:)
      integer :: i

      below = 0
      do i = group + 1, size(theta), groups
         call count_at(s, theta(i), below(i))
      end do
   end subroutine count_in_turn

   subroutine announce(self, parts)
      class(band_groups_type), intent(inout) :: self
      type(part_type), intent(in) :: parts(:)
      type(part_type), allocatable :: shared(:)
      real(wp), allocatable :: no_thetas(:)

      if (self%number == 1) return
      allocate (self%mine(size(parts)), self%solved(size(parts)), self%gathered(size(parts)))
      self%solved = .false.
      self%gathered = .false.
      self%announced = .true.
      no_thetas = [real(wp) ::]
      call share_thetas(no_thetas, self%leaders)
      allocate (shared, source=parts)
      call share_parts(shared, self%leaders)
      self%order = largest_first(parts)
   end subroutine announce

   ! The order in which parts are taken: the lowest first, as it has the most modes, then the more modes the earlier, so that groups
   ! end at about the same time.
   function largest_first(parts) result(order)
      type(part_type), intent(in) :: parts(:)
      integer, allocatable :: order(:)

      order = ascending_order(merge(-huge(1.0_wp), real(parts%below_from - parts%below_to, wp), parts%is_lowest()))
   end function largest_first

   subroutine obtain(self, i, s, parts, found, error)
      class(band_groups_type), intent(inout) :: self
      integer, intent(in) :: i
      !> Its damping is left out.
      type(solve_context_type), target, intent(inout) :: s
      type(part_type), intent(in) :: parts(:)
      type(part_modes_type), intent(out) :: found
      type(error_type), allocatable, intent(out) :: error
      integer :: next

      if (self%number == 1) then
         call solve_part(s, parts(i), found, error)
         return
      end if
      do while (.not. self%solved(i))
         next = self%queue%take()
         if (next > size(parts)) exit
         next = self%order(next)
         self%gathered(next) = .true.
         call solve_part(s, parts(next), self%mine(next), error)
         if (allocated(error)) return
         self%solved(next) = .true.
      end do
      if (self%solved(i)) then
         found = self%mine(i)
         self%mine(i) = part_modes_type()
      else
         self%gathered(i) = .true.
         call receive_part(i, found, error, self%leaders)
         associate (sum => s%effort)
            sum%operator_applications = sum%operator_applications + found%effort%operator_applications
            sum%restarts = sum%restarts + found%effort%restarts
            sum%factorizations = sum%factorizations + found%effort%factorizations
            sum%factorizations_for = sum%factorizations_for + found%effort%factorizations_for
         end associate
      end if
   end subroutine obtain

   subroutine finish(self)
      class(band_groups_type), intent(inout) :: self
      type(part_modes_type) :: unused
      type(error_type), allocatable :: ignored
      ! Larger than any number of parts.
      integer, parameter :: most = 1000000
      integer :: last, i

      if (self%number == 1) return
      if (.not. self%announced) call self%announce([part_type ::])
      last = min(self%queue%take(past=most) - 1, size(self%gathered))
      ! In the order in which groups send them.
      do i = 1, size(self%gathered)
         if (any(self%order(:last) == i) .and. .not. self%gathered(i)) call receive_part(i, unused, ignored, self%leaders)
      end do
      call self%queue%finish()
      call MPI_Comm_free(self%leaders)
   end subroutine finish

   subroutine disband(self, processes)
      class(band_groups_type), intent(inout) :: self
      type(processes_type), intent(inout) :: processes
      type(error_type), allocatable :: none

      if (self%number == 1) return
      call processes%leave(none)
      processes = self%all
   end subroutine disband

   !> Work loop of the first process of another group: computes parts from the queue, then sends their modes.
   subroutine lead_group(processes, groups, leaders)
      !> The group of this process, and the number of all.
      type(processes_type), target, intent(inout) :: processes
      integer, intent(in) :: groups
      type(MPI_Comm), intent(inout) :: leaders
      type(modal_problem_type), target :: problem
      type(modal_options_type) :: options
      type(solve_context_type), target :: s
      type(part_queue_type) :: queue
      type(part_type), allocatable :: parts(:)
      type(part_modes_type), allocatable :: found(:)
      type(left_damping_type), target :: damping
      type(error_type), allocatable :: error
      logical, allocatable :: here(:)
      integer, allocatable :: order(:)
      integer :: i

      call queue%begin(leaders)
      call share_problem(problem, options, leaders, error)
      if (.not. allocated(error)) call begin_solve(s, problem, options, error, processes=processes)
      s%may_be_dense = .false.
      if (.not. allocated(error)) call reduce(s, error)
      if (.not. allocated(error)) call examine(s, error)
      call serve_counts(s, allocated(error), groups, leaders)
      call share_parts(parts, leaders)
      order = largest_first(parts)
      if (.not. allocated(error) .and. size(parts) > 0) call damping%leave_out(s)
      allocate (found(size(parts)), here(size(parts)))
      here = .false.
      do
         i = queue%take()
         if (i > size(parts)) exit
         i = order(i)
         here(i) = .true.
         if (.not. allocated(error)) call solve_part(s, parts(i), found(i), error)
         ! The error is sent instead of this part; later parts are not requested.
         if (allocated(error)) exit
      end do
      do i = 1, size(parts)
         if (here(i)) call send_part(i, found(i), error, leaders)
      end do
      call queue%finish()
      call MPI_Comm_free(leaders)
   end subroutine lead_group

   ! Counts the eigenvalues that fall to this group, as long as the first process asks for some.
   subroutine serve_counts(s, has_failed, groups, leaders)
      type(solve_context_type), intent(inout) :: s
      !> Whether this group cannot count.
      logical, intent(in) :: has_failed
      integer, intent(in) :: groups
      type(MPI_Comm), intent(in) :: leaders
      real(wp), allocatable :: theta(:)
      integer, allocatable :: below(:)
      integer :: group

      call MPI_Comm_rank(leaders, group)
      do
         call share_thetas(theta, leaders)
         if (size(theta) == 0) exit
         allocate (below(size(theta)), source=0)
         if (has_failed) then
            below(group + 1::groups) = not_counted
         else
            call count_in_turn(s, theta, group, groups, below)
            ! It may be for lack of memory here.
            where (below < 0) below = not_counted
         end if
         call add_counts(below, leaders)
         deallocate (theta, below)
      end do
   end subroutine serve_counts
end module kschur_band_groups
