!> Polishing of modes whose eigenvalues lie nearer to each other than inverse iteration can tell them apart: all of them at
!> once, by iteration of the space that they span.
module kschur_clusters
   use kschur_backward_error, only: backward_errors
   use kschur_eigenpairs, only: append_pairs, chosen_pairs, eigenpairs_type, move_pairs, normalize
   use kschur_error, only: error_type
   use kschur_gram_schmidt_complex, only: orthonormalize
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: complex_linear_solver_type
   use kschur_memory, only: require_memory
   use kschur_problem, only: modal_problem_type
   use kschur_projected, only: independent_eigenvectors, schur_form
   use kschur_random, only: random_vector, state_of_seed
   use kschur_tolerances, only: same_value
   implicit none
   private
   public :: cluster_of, cluster_type, new_cluster, polish_cluster

   !> Where a mode is factored, from its eigenvalue, relative to that: near, but not singular.
   real(wp), parameter, public :: offset = 1.0e-6_wp
   !> Steps of inverse iteration.
   integer, parameter, public :: steps = 5
   ! Copies differ by less, relative to their size.
   real(wp), parameter :: copies = 1.0e-12_wp

   !> Pairs with neighbouring eigenvalues, and where they are factored.
   type :: cluster_type
      integer, allocatable :: members(:)
      complex(wp) :: centre = (0.0_wp, 0.0_wp), shift = (0.0_wp, 0.0_wp)
      !> All eigenvalues are this near to the centre.
      real(wp) :: radius = 0
      !> Whether the conjugates of all belong to it, as it lies on the real axis: its space has a real basis.
      logical :: closed = .false.
   end type cluster_type

   !> States [phi; lambda phi/unit], and what is found in their span.
   type :: states_type
      !> 2 n x p
      complex(wp), allocatable :: columns(:, :)
      real(wp) :: unit = 1
   end type states_type

contains

   !> The chain of eigenvalues, each near to another one, that one belongs to.
   pure function cluster_of(lambda, j, chosen) result(members)
      complex(wp), intent(in) :: lambda(:)
      integer, intent(in) :: j
      !> Those that may be in it.
      logical, intent(in) :: chosen(:)
      !> Ascending, j among them.
      integer, allocatable :: members(:)
      ! No more than are solved for at once.
      integer, parameter :: most = 100
      logical :: inside(size(lambda)), reached(size(lambda))
      integer :: i, l

      inside = .false.
      reached = .false.
      inside(j) = .true.
      do
         l = findloc(inside .and. .not. reached, .true., 1)
         if (l == 0) exit
         reached(l) = .true.
         do i = 1, size(lambda)
            if (count(inside) == most) exit
            inside(i) = inside(i) .or. (chosen(i) .and. abs(lambda(i) - lambda(l)) <= same_value*abs(lambda(l)))
         end do
      end do
      members = pack([(i, i=1, size(lambda))], inside)
   end function cluster_of

   !> Where pairs are polished together.
   pure function new_cluster(pairs, members) result(cluster)
      type(eigenpairs_type), intent(in) :: pairs
      integer, intent(in) :: members(:)
      type(cluster_type) :: cluster
      ! A member may lie at the rim.
      real(wp), parameter :: beyond = 1.5_wp
      logical :: complex_ones(size(members))

      allocate (cluster%members, source=members)
      associate (lambda => pairs%lambda(members))
         complex_ones = abs(aimag(lambda)) > 0
         cluster%closed = any(abs(aimag(lambda)) <= same_value*abs(lambda)) .and. &
            (allocated(pairs%paired) .or. .not. any(complex_ones))
         if (cluster%closed .and. any(complex_ones)) cluster%closed = all(pairs%paired(members) .or. .not. complex_ones)
         cluster%centre = sum(lambda)/size(members)
         if (cluster%closed) cluster%centre = real(cluster%centre, wp)
         cluster%radius = maxval(abs(lambda - cluster%centre))
         cluster%shift = cluster%centre + max(offset*abs(cluster%centre), beyond*cluster%radius)
      end associate
   end function new_cluster

   !> Iterates the space of a cluster, and random vectors for what it lacks, by
   !>
   !>     [P(s) Cq^T; Cq 0] [x'; xi] = -[M v + (R + s M) x; 0],  v' = x + s x',
   !>
   !> and takes the Ritz pairs next to the members, as long as their largest backward error falls. Two real eigenvalues may
   !> become a conjugate pair. Where they do not become good enough, all stay as they were.
   subroutine polish_cluster(problem, factors, cluster, above, solver, pairs, errors, merged, more, error)
      type(modal_problem_type), intent(in) :: problem
      !> Factor of each constraint.
      real(wp), intent(in) :: factors(:)
      type(cluster_type), intent(in) :: cluster
      !> The backward error that is good enough.
      real(wp), intent(in) :: above
      !> Has the factors at the shift.
      class(complex_linear_solver_type), intent(inout) :: solver
      !> With complex shapes.
      type(eigenpairs_type), intent(inout) :: pairs
      !> The backward error of each.
      real(wp), intent(inout) :: errors(:)
      !> Those that are now one of a conjugate pair, whose other one is listed.
      logical, intent(inout) :: merged(:)
      !> What is found beside the members is put behind these.
      type(eigenpairs_type), intent(inout) :: more
      type(error_type), allocatable, intent(out) :: error
      type(states_type) :: states
      type(eigenpairs_type) :: found, best
      complex(wp), allocatable :: images(:, :), solutions(:, :)
      real(wp), dimension(size(cluster%members)) :: errors_of_best, errors_of_taken
      integer :: taken(size(cluster%members)), of_best(size(cluster%members)), step
      real(wp), allocatable :: errors_of_found(:)
      ! Of the best, those that are not members.
      logical, allocatable :: others(:)
      real(wp) :: least
      logical :: settled

      call begin_states(problem, pairs, cluster, states, error)
      if (allocated(error)) return
      least = maxval(errors(cluster%members))
      of_best = 0
      do step = 1, steps
         call apply(problem, factors, cluster%shift, solver, states, images, solutions, error)
         if (.not. allocated(error)) call find_pairs(cluster, states, images, solutions, found, error)
         if (allocated(error)) return
         errors_of_found = backward_errors(problem, found)
         taken = next_to(cluster, pairs%lambda, found%lambda, errors_of_found <= maxval(errors(cluster%members)))
         errors_of_taken = 0
         where (taken > 0) errors_of_taken = errors_of_found(max(taken, 1))
         if (any(taken > 0) .and. maxval(errors_of_taken) < least) then
            least = maxval(errors_of_taken)
            settled = least <= above .and. all_near(found%lambda(pack(taken, taken > 0)), best, copies*abs(cluster%centre))
            others = errors_of_found <= above .and. is_inside(cluster, found%lambda)
            others(pack(taken, taken > 0)) = .false.
            call move_pairs(found, best)
            of_best = taken
            errors_of_best = errors_of_taken
            if (settled) exit
         else if (least <= above) then
            exit
         end if
         call move_alloc(images, states%columns)
         call make_orthonormal(states%columns)
      end do
      if (.not. any(of_best > 0) .or. least > above) return
      call add(cluster, pairs, chosen_pairs(best, others), more)
      call put(best, errors_of_best, of_best, cluster%members, pairs, errors, merged)
   end subroutine polish_cluster

   ! Whether each eigenvalue was one of some others before.
   pure logical function all_near(lambda, before, distance)
      complex(wp), intent(in) :: lambda(:)
      type(eigenpairs_type), intent(in) :: before
      real(wp), intent(in) :: distance
      integer :: i

      all_near = allocated(before%lambda)
      if (all_near) all_near = all([(any(abs(before%lambda - lambda(i)) <= distance), i=1, size(lambda))])
   end function all_near

   ! Of a closed cluster the real and, of complex ones, the imaginary parts.
   subroutine begin_states(problem, pairs, cluster, states, error)
      type(modal_problem_type), intent(in) :: problem
      type(eigenpairs_type), intent(in) :: pairs
      type(cluster_type), intent(in) :: cluster
      type(states_type), intent(out) :: states
      type(error_type), allocatable, intent(out) :: error
      ! Copies that may not be known.
      integer, parameter :: few = 4
      real(wp) :: random(2*size(pairs%phi, 1))
      integer(long) :: state
      integer :: i, k, l, n, p

      n = problem%unknowns()
      p = size(cluster%members)
      if (cluster%closed) p = p + count(abs(aimag(pairs%lambda(cluster%members))) > 0)
      l = p + few
      call require_memory(16.0_wp*l*(9*n + 2*problem%multipliers()), "mode shapes", error)
      if (allocated(error)) return
      state = state_of_seed(0)
      states%unit = abs(cluster%shift)
      allocate (states%columns(2*n, p + l))
      associate (columns => states%columns)
         k = 0
         do i = 1, size(cluster%members)
            associate (j => cluster%members(i))
               k = k + 1
               columns(:n, k) = pairs%phi(:, j)
               columns(n + 1:, k) = pairs%lambda(j)/states%unit*pairs%phi(:, j)
               if (.not. cluster%closed) cycle
               if (abs(aimag(pairs%lambda(j))) > 0) columns(:, k + 1) = aimag(columns(:, k))
               columns(:, k) = real(columns(:, k), wp)
               if (abs(aimag(pairs%lambda(j))) > 0) k = k + 1
            end associate
         end do
         do k = p + 1, p + l
            call random_vector(state, random)
            columns(:, k) = random
         end do
      end associate
      call make_orthonormal(states%columns)
      if (size(states%columns, 2) > l) states%columns = states%columns(:, :l)
   end subroutine begin_states

   ! As many as are independent.
   subroutine make_orthonormal(columns)
      complex(wp), allocatable, intent(inout) :: columns(:, :)
      complex(wp) :: coefficients(size(columns, 2), size(columns, 2))
      integer :: kept

      call orthonormalize(columns, 1, coefficients, kept)
      if (kept < size(columns, 2)) columns = columns(:, :kept)
   end subroutine make_orthonormal

   ! The operator on orthonormal states.
   subroutine apply(problem, factors, shift, solver, states, images, solutions, error)
      type(modal_problem_type), intent(in) :: problem
      real(wp), intent(in) :: factors(:)
      complex(wp), intent(in) :: shift
      class(complex_linear_solver_type), intent(inout) :: solver
      type(states_type), intent(in) :: states
      !> 2 n x p, and [x'; xi], (n + m) x p.
      complex(wp), allocatable, intent(out) :: images(:, :), solutions(:, :)
      type(error_type), allocatable, intent(out) :: error
      complex(wp), allocatable :: x(:, :), force(:, :)
      integer :: n, p, j

      n = problem%unknowns()
      p = size(states%columns, 2)
      allocate (images(2*n, p))
      allocate (x, source=states%columns(:n, :))
      allocate (solutions(n + size(factors), p), force(n, p), source=(0.0_wp, 0.0_wp))
      call problem%damping%add_product((-1.0_wp, 0.0_wp), x, force)
      x = states%unit*states%columns(n + 1:, :) + shift*x
      call problem%mass%add_product((-1.0_wp, 0.0_wp), x, force)
      solutions(:n, :) = force
      call solver%solve(solutions, error)
      if (allocated(error)) return
      images(:n, :) = solutions(:n, :)
      images(n + 1:, :) = (states%columns(:n, :) + shift*solutions(:n, :))/states%unit
      do j = 1, p
         solutions(n + 1:, j) = factors*solutions(n + 1:, j)
      end do
   end subroutine apply

   ! The Ritz pairs; of a closed cluster one of each conjugate pair.
   subroutine find_pairs(cluster, states, images, solutions, found, error)
      type(cluster_type), intent(in) :: cluster
      type(states_type), intent(in) :: states
      complex(wp), intent(in) :: images(:, :), solutions(:, :)
      type(eigenpairs_type), intent(out) :: found
      type(error_type), allocatable, intent(out) :: error
      complex(wp), dimension(size(images, 2), size(images, 2)) :: t, u
      complex(wp), allocatable :: y(:, :), taken(:, :)
      real(wp), dimension(size(images, 2), size(images, 2)) :: real_t, real_u
      complex(wp) :: mu(size(images, 2))
      integer, allocatable :: chosen(:)
      real(wp) :: noise
      integer :: n, p, j

      noise = copies*abs(cluster%shift)/abs(cluster%shift - cluster%centre)
      n = size(images, 1)/2
      p = size(images, 2)
      t = matmul(conjg(transpose(states%columns)), images)
      if (cluster%closed) then
         real_t = real(t, wp)
         call schur_form(real_t, real_u, mu, error)
         if (allocated(error)) return
         ! That of mu with a negative imaginary part has a positive one.
         chosen = pack([(j, j=1, p)], aimag(mu) <= 0)
         call independent_eigenvectors(real_t, noise, chosen, y)
         y = matmul(real_u, y)
      else
         call schur_form(t, u, mu, error)
         if (allocated(error)) return
         chosen = [(j, j=1, p)]
         call independent_eigenvectors(t, noise, chosen, y)
         y = matmul(u, y)
      end if
      taken = matmul(solutions, y)
      allocate (found%lambda, source=cluster%shift + 1/mu(chosen))
      allocate (found%phi, source=taken(:n, :))
      allocate (found%xi, source=taken(n + 1:, :))
      do j = 1, size(chosen)
         call normalize(found, j)
      end do
   end subroutine find_pairs

   ! For each member the pair that is next to it; 0 where it is one of a conjugate pair that another one is next to. All are 0
   ! where there are not as many eigenvalues.
   function next_to(cluster, members, found, good) result(taken)
      type(cluster_type), intent(in) :: cluster
      !> Eigenvalues of all pairs, and those that were found.
      complex(wp), intent(in) :: members(:), found(:)
      !> Which of these are eigenvalues.
      logical, intent(in) :: good(:)
      integer :: taken(size(cluster%members))
      logical :: left(size(found)), waiting(size(cluster%members)), real_one(size(cluster%members))
      integer :: i, k

      left = good .and. is_inside(cluster, found)
      real_one = .not. abs(aimag(members(cluster%members))) > 0
      waiting = .true.
      taken = 0
      do i = 1, size(taken)
         if (.not. waiting(i)) cycle
         waiting(i) = .false.
         k = minloc(abs(found - members(cluster%members(i))), 1, left)
         if (k == 0) exit
         left(k) = .false.
         taken(i) = k
         if (.not. cluster%closed .or. (real_one(i) .neqv. abs(aimag(found(k))) > 0)) cycle
         ! Of the two that became a pair, or of a pair that would become two.
         k = 0
         if (real_one(i)) k = minloc(abs(members(cluster%members) - found(taken(i))), 1, waiting .and. real_one)
         if (k == 0) exit
         waiting(k) = .false.
      end do
      if (i <= size(taken)) taken = 0
   end function next_to

   elemental logical function is_inside(cluster, lambda)
      type(cluster_type), intent(in) :: cluster
      complex(wp), intent(in) :: lambda

      is_inside = abs(lambda - cluster%centre) <= cluster%radius + same_value*abs(cluster%centre)
   end function is_inside

   ! Puts pairs behind others. What is known of their conjugates is what is known of those of the members.
   subroutine add(cluster, pairs, found, more)
      type(cluster_type), intent(in) :: cluster
      type(eigenpairs_type), intent(in) :: pairs
      type(eigenpairs_type), intent(in) :: found
      type(eigenpairs_type), intent(inout) :: more
      logical, allocatable :: paired(:)

      allocate (paired, source=more%paired)
      call append_pairs(more, found)
      more%paired = [paired, abs(aimag(found%lambda)) > 0]
      if (cluster%closed .or. size(found%lambda) == 0) return
      if (allocated(pairs%paired)) more%paired(size(paired) + 1:) = all(pairs%paired(cluster%members))
      if (.not. allocated(pairs%paired)) more%paired(size(paired) + 1:) = .false.
   end subroutine add

   ! Each in the place of its member.
   subroutine put(found, errors_of_found, taken, members, pairs, errors, merged)
      type(eigenpairs_type), intent(in) :: found
      !> Of those that are taken.
      real(wp), intent(in) :: errors_of_found(:)
      integer, intent(in) :: taken(:), members(:)
      type(eigenpairs_type), intent(inout) :: pairs
      real(wp), intent(inout) :: errors(:)
      logical, intent(inout) :: merged(:)
      integer :: i

      do i = 1, size(members)
         associate (j => members(i), k => taken(i))
            merged(j) = k == 0
            errors(j) = errors_of_found(i)
            if (k == 0) cycle
            if (allocated(pairs%paired)) pairs%paired(j) = pairs%paired(j) .or. &
               (abs(aimag(found%lambda(k))) > 0 .and. .not. abs(aimag(pairs%lambda(j))) > 0)
            pairs%lambda(j) = found%lambda(k)
            pairs%phi(:, j) = found%phi(:, k)
            pairs%xi(:, j) = found%xi(:, k)
         end associate
      end do
   end subroutine put
end module kschur_clusters
