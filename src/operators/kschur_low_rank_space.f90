!> Krylov space of the low-rank form: undamped Lanczos started with the states of the eigenvalue zero, random vectors and the
!> responses to the local forces.
module kschur_low_rank_space
   use kschur_archive, only: archive_type
   use kschur_block_decomposition, only: block_decomposition_type, make_room
   use kschur_block_lanczos, only: add_directions, add_random_directions, expand_block
   use kschur_error, only: error_type
   use kschur_kinds, only: wp
   use kschur_krylov_options, only: krylov_options_type, krylov_statistics_type
   use kschur_local_forces, only: local_forces_type
   use kschur_low_rank_shapes, only: responses_type
   use kschur_staircase, only: root_space_type
   use kschur_symmetric_operator, only: symmetric_shift_invert_type
   use kschur_tolerances, only: dependent
   implicit none
   private
   public :: begin_or_continue, filter, low_rank_space_type

   !> Applications that remove infinite eigenvalues from a random vector: their Jordan blocks have size 2 at most.
   integer, parameter :: filter = 2

   !> Lanczos decomposition that is continued from call to call; responses and zero states are combinations of its first
   !> vectors.
   type, extends(block_decomposition_type) :: low_rank_space_type
      !> Current limit of the dimension.
      integer :: limit = 0
      !> Number of start vectors: states, random vectors, responses.
      integer :: begun = 0
      !> Responses and zero states in terms of the basis.
      real(wp), allocatable :: responses(:, :), zeros(:, :)
      type(responses_type) :: unit_responses
   contains
      !> Whether the limit is reached.
      procedure :: at_end
      !> Whether it spans all motions.
      procedure :: whole
      !> The responses, in terms of the expanded vectors.
      procedure :: expanded_responses
      !> The zero states in terms of the Ritz vectors.
      procedure :: states
      procedure :: carry
   end type low_rank_space_type

contains

   !> Allocates room for an iteration; sets the start vectors of a new space.
   subroutine begin_or_continue(space, operator, forces, motions, options, statistics, error)
      type(low_rank_space_type), allocatable, intent(inout) :: space
      class(symmetric_shift_invert_type), intent(inout) :: operator
      type(local_forces_type), intent(in) :: forces
      !> Upper bound of the dimension of the space of motions.
      integer, intent(in) :: motions
      class(krylov_options_type), intent(in) :: options
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: levels = 8
      integer :: n, r, z, randoms, room
      logical :: is_new

      n = operator%order()
      r = forces%rank()
      z = operator%deflation%zero%states()
      ! With the responses they fill a block.
      randoms = max(1, options%block - r)
      is_new = .not. allocated(space)
      if (is_new) then
         allocate (space)
         space%cautious = .true.
         space%most = motions - size(operator%deflation%decay)
         if (size(operator%deflation%decay) > 0) allocate (space%excluded, source=operator%deflation%shapes)
      end if
      ! Each block of responses, which are solved for together, adds r vectors.
      space%limit = z + options%subspace + merge(0, levels*r, options%observes)
      room = 2*(r + z + randoms) + space%limit
      call make_room(space, n, room, options%processes, error)
      if (allocated(error) .or. .not. is_new) return
      allocate (space%zeros(room, z), space%responses(room, r))
      if (z > 0) call add_zeros(space, operator, statistics, error)
      if (.not. allocated(error)) call add_random_directions(operator, space, randoms, filter, options%seed, statistics, error)
      if (.not. allocated(error)) call add_responses(space, operator, forces, statistics, error)
      space%begun = space%vectors
   end subroutine begin_or_continue

   ! Starts the space with the states of the eigenvalue zero, and expands them.
   subroutine add_zeros(space, operator, statistics, error)
      type(low_rank_space_type), intent(inout) :: space
      class(symmetric_shift_invert_type), intent(inout) :: operator
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: x(:, :)

      allocate (x, source=operator%deflation%zero%x)
      call add_directions(operator, space, x, space%zeros, statistics, error)
      if (.not. allocated(error)) call expand_block(operator, space, statistics, error, dependent)
   end subroutine add_zeros

   ! Solves for the responses to unit local forces, and adds them to the start vectors.
   subroutine add_responses(space, operator, forces, statistics, error)
      type(low_rank_space_type), intent(inout) :: space
      class(symmetric_shift_invert_type), intent(inout) :: operator
      type(local_forces_type), intent(in) :: forces
      type(krylov_statistics_type), intent(inout) :: statistics
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: x(:, :), xi(:, :)
      integer :: n, r

      n = operator%order()
      r = forces%rank()
      allocate (x(n, r), source=forces%columns_of_b(n))
      allocate (xi(size(operator%factors), r), source=0.0_wp)
      if (r > 0) call operator%respond(x, xi, error)
      if (allocated(error)) return
      allocate (space%unit_responses%shapes, source=x)
      call move_alloc(xi, space%unit_responses%multipliers)
      if (r > 0) call add_directions(operator, space, x, space%responses, statistics, error)
      statistics%operator_applications = statistics%operator_applications + r
   end subroutine add_responses

   subroutine carry(self, archive)
      class(low_rank_space_type), intent(inout) :: self
      type(archive_type), intent(inout) :: archive

      call self%block_decomposition_type%carry(archive)
      call archive%carry(self%begun)
      call archive%carry(self%responses)
      call archive%carry(self%zeros)
   end subroutine carry

   pure logical function at_end(self)
      class(low_rank_space_type), intent(in) :: self

      at_end = self%full() .or. self%expanded >= self%limit
   end function at_end

   pure logical function whole(self)
      class(low_rank_space_type), intent(in) :: self

      whole = self%closed() .and. self%vectors >= self%most
   end function whole

   pure function expanded_responses(self) result(responses)
      class(low_rank_space_type), intent(in) :: self
      real(wp) :: responses(self%expanded, size(self%responses, 2))

      responses = padded(self%responses, self%expanded)
   end function expanded_responses

   function states(self, zero, vectors)
      class(low_rank_space_type), intent(in) :: self
      type(root_space_type), intent(in) :: zero
      !> Ritz vectors in terms of the basis.
      real(wp), intent(in) :: vectors(:, :)
      type(root_space_type) :: states

      if (zero%states() == 0) return
      allocate (states%x, source=matmul(transpose(vectors), padded(self%zeros, size(vectors, 1))))
      allocate (states%links, source=zero%links)
      allocate (states%v, source=matmul(states%x, zero%links))
   end function states

   ! The first rows of a matrix, padded with zeros if it has fewer.
   pure function padded(matrix, rows)
      real(wp), intent(in) :: matrix(:, :)
      integer, intent(in) :: rows
      real(wp) :: padded(rows, size(matrix, 2))
      integer :: k

      k = min(rows, size(matrix, 1))
      padded = 0
      padded(:k, :) = matrix(:k, :)
   end function padded
end module kschur_low_rank_space
