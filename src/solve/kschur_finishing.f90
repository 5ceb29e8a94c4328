!> What an iteration left inaccurate or in doubt is polished, cluster by cluster.
module kschur_finishing
   use kschur_context, only: solve_context_type
   use kschur_eigenpairs, only: append_pairs, chosen_pairs, eigenpairs_type, keep_pairs, normalize
   use kschur_error, only: error_cancelled, error_convergence, error_singular, error_type
   use kschur_kinds, only: wp
   use kschur_mode_selection, only: distances, insert_pairs, wanted_type
   use kschur_modes, only: modes_type
   use kschur_outcome, only: inaccurate_above
   use kschur_polish, only: polished_type, polisher_type
   use kschur_problem, only: modal_problem_type
   use kschur_residual_parts, only: residual_parts
   use kschur_scaling, only: constraint_factors
   use kschur_settling, only: settle_pairs
   use kschur_shapes, only: rest_beside, rest_of_state
   use kschur_split, only: cluster_type, split
   use kschur_spectral_map, only: spectral_map_type
   use kschur_tolerances, only: above_all_rounding, cancelled, dependent_state, may_be_anything, root_epsilon, same_shape, &
      same_value, spurious, uneven
   implicit none
   private
   public :: finish_modes

   ! What may be anything is looked for as far as this part of its eigenvalue.
   real(wp), parameter :: half = 0.5_wp

   !> What is asked of each mode, in the units that balance has found: in those as given, errors may hide behind a few large
   !> entries.
   type :: judgement_type
      !> Backward errors, and how far eigenvalues may be off (1/s).
      real(wp), allocatable :: errors(:), uncertainty(:)
      !> Which are worth polishing; which may be no eigenvalues by their error bounds.
      logical, allocatable :: poor(:), doubtful(:)
   end type judgement_type

contains

   !> Polishes each cluster in which a mode is inaccurate, in doubt, or no other than its neighbours: once contracted,
   !> factored beside and iterated, what lies where it is takes its place, whatever that is. A mode in doubt that is not
   !> found there is no eigenvalue.
   subroutine finish_modes(s, modes, aside, error)
      type(solve_context_type), intent(inout) :: s
      type(modes_type), intent(inout) :: modes
      !> Those in doubt that were not found again although they have small backward errors; where there are none it stays.
      type(eigenpairs_type), intent(inout) :: aside
      type(error_type), allocatable, intent(out) :: error
      type(judgement_type) :: judgement
      type(polisher_type) :: polisher
      type(cluster_type), allocatable :: clusters(:)
      type(eigenpairs_type) :: found
      logical, dimension(size(modes%lambda)) :: gone, nowhere
      complex(wp), allocatable :: badly(:)
      logical, allocatable :: others(:)
      real(wp) :: reach
      integer :: i

      judgement = judge(s, modes)
      gone = .false.
      nowhere = .false.
      call find_suspects(modes, judgement, clusters)
      if (size(clusters) == 0) return
      call polisher%begin(constraint_factors(s%work, s%options%constraint_scaling, s%shift), good_enough_of(s), s%inner%complex)
      do i = 1, size(clusters)
         if (s%is_stopped()) exit
         call polish_cluster(s, modes, clusters(i), judgement, polisher, found, gone, nowhere, error)
         if (allocated(error)) return
      end do
      call s%effort%add_solves(polisher%solver)
      if (.not. any(gone .or. nowhere)) return
      nowhere = nowhere .and. .not. gone
      if (any(nowhere .and. modes%backward_error <= inaccurate_above)) &
         aside = chosen_pairs(modes, nowhere .and. modes%backward_error <= inaccurate_above)
      allocate (badly, source=pack(modes%lambda, nowhere .and. judgement%errors > spurious))
      call modes%drop(gone .or. nowhere)
      if (allocated(found%lambda)) then
         call s%expand(found, error)
         if (allocated(error)) return
         ! A wide cluster may have held neighbours that stay.
         allocate (others(size(found%lambda)))
         do i = 1, size(others)
            others(i) = rest_beside(modes, found, i, same_value) > dependent_state
         end do
         call keep_pairs(found, others)
         call insert_pairs(s%problem, wanted_type(s%options%modes, s%options%target, reference=abs(s%shift)), found, modes)
      end if
      ! Infinite eigenvalues that rounding blurred, or modes. Beyond the furthest of all that are wanted they do not matter.
      reach = huge(1.0_wp)
      if (size(modes%lambda) == s%options%modes) reach = maxval(distances(modes%lambda, s%options%target))
      modes%inaccurate = modes%inaccurate + count(distances(badly, s%options%target) <= reach)
   end subroutine finish_modes

   function judge(s, modes) result(judgement)
      type(solve_context_type), intent(in) :: s
      type(modes_type), intent(in) :: modes
      type(judgement_type) :: judgement
      type(eigenpairs_type) :: pairs
      real(wp), allocatable :: bounds(:), uncertainty(:), errors(:)
      logical, allocatable :: open(:)
      logical :: evenly
      integer :: j

      allocate (judgement%errors, source=modes%backward_error)
      allocate (uncertainty, source=modes%uncertainty)
      ! Where all eigenvalues there are were found, each is one, and is to be known well in any units.
      evenly = s%plan%spread_of_units() > uneven .or. (s%known%total%exact .and. modes%found == s%known%total%number)
      if (evenly) then
         pairs = s%contract(modes)
         do j = 1, size(pairs%lambda)
            call normalize(pairs, j)
         end do
         call settle_pairs(s%work, pairs, 0, errors, bounds, uncertainty)
         judgement%errors = max(judgement%errors, errors)
         ! These suit eigenvalues of one size only: terms of a residual tell what is poor.
         judgement%errors = max(judgement%errors, residual_parts(s%work, pairs, errors <= good_enough_of(s)))
      end if
      ! Rigid motions and their decays are known.
      allocate (open, source=abs(modes%lambda) > 0 .and. .not. are_known(s, modes%lambda))
      ! What has a larger backward error is not near to an eigenpair, unless units hide that it is, or all there are were found.
      if (.not. evenly) open = open .and. judgement%errors <= may_be_anything
      allocate (judgement%poor, source=open .and. judgement%errors > good_enough_of(s))
      allocate (judgement%uncertainty, source=uncertainty)
      allocate (judgement%doubtful, source=open .and. (uncertainty > may_be_anything*abs(modes%lambda) .or. &
         modes%error_bound > may_be_anything*abs(modes%lambda)))
      if (any(judgement%doubtful)) judgement%doubtful = unpack(may_be_infinite(s%work, &
         s%contract(chosen_pairs(modes, judgement%doubtful))), judgement%doubtful, .false.)
   end function judge

   ! Whether inertia and damping are a part of the forces on a shape that rounding of the stiffness does not hide. Where they are
   ! not, as of the lowest modes of a fine mesh, an eigenvalue has a wide bound, but is none that is infinite.
   function may_be_infinite(problem, pairs) result(may_be)
      type(modal_problem_type), intent(in) :: problem
      type(eigenpairs_type), intent(in) :: pairs
      logical :: may_be(size(pairs%lambda))
      complex(wp) :: force(pairs%rows(), 1)
      integer :: j

      do j = 1, size(may_be)
         force = 0
         call problem%mass%add_product(pairs%lambda(j)**2, pairs%phi(:, j:j), force)
         call problem%damping%add_product(pairs%lambda(j), pairs%phi(:, j:j), force)
         may_be(j) = norm2(abs(force)) > root_epsilon*problem%stiffness%infinity_norm()*norm2(abs(pairs%phi(:, j)))
      end do
   end function may_be_infinite

   ! The backward error that is good enough.
   pure real(wp) function good_enough_of(s)
      type(solve_context_type), intent(in) :: s

      good_enough_of = max(above_all_rounding, s%options%tolerance/10)
   end function good_enough_of

   ! Which eigenvalues are those of rigid motions.
   function are_known(s, lambda)
      type(solve_context_type), intent(in) :: s
      complex(wp), intent(in) :: lambda(:)
      logical :: are_known(size(lambda))
      complex(wp), allocatable :: known(:)
      integer :: i

      allocate (known, source=s%known%deflation%eigenvalues())
      are_known = .false.
      do i = 1, size(known)
         are_known = are_known .or. abs(lambda - known(i)) <= same_value*abs(known(i))
      end do
   end function are_known

   ! The clusters that are to be polished. Shapes that are held as real ones are orthogonal, as Lanczos has them.
   subroutine find_suspects(modes, judgement, suspects)
      type(modes_type), intent(in) :: modes
      type(judgement_type), intent(in) :: judgement
      type(cluster_type), allocatable, intent(out) :: suspects(:)
      type(cluster_type), allocatable :: clusters(:)
      real(wp), allocatable :: discs(:)
      logical, allocatable :: suspect(:)
      integer :: i, j

      allocate (discs, source=same_value*abs(modes%lambda))
      where (judgement%poor) discs = max(discs, min(judgement%uncertainty, may_be_anything*abs(modes%lambda)))
      call split(modes%lambda, discs, clusters)
      allocate (suspect, source=[(is_suspect(clusters(i)), i=1, size(clusters))])
      allocate (suspects(count(suspect)))
      j = 0
      do i = 1, size(clusters)
         if (.not. suspect(i)) cycle
         j = j + 1
         suspects(j) = clusters(i)
         associate (members => clusters(i)%members)
            if (any(judgement%poor(members))) call suspects(j)%widen(may_be_anything)
            if (any(judgement%doubtful(members))) call suspects(j)%widen(half)
         end associate
      end do

   contains

      logical function is_suspect(cluster)
         type(cluster_type), intent(in) :: cluster
         integer :: l

         associate (members => cluster%members)
            is_suspect = any(judgement%poor(members) .or. judgement%doubtful(members))
            if (.not. (is_suspect .or. modes%is_real()) .and. abs(cluster%centre) > 0) is_suspect = &
               any([(rest_of_state(modes, members(:l - 1), members(l)) <= dependent_state, l=2, size(members))])
         end associate
      end function is_suspect
   end subroutine find_suspects

   ! One cluster: contracted, factored, iterated, and accepted or left as it was.
   subroutine polish_cluster(s, modes, cluster, judgement, polisher, found, gone, nowhere, error)
      type(solve_context_type), intent(inout) :: s
      type(modes_type), intent(in) :: modes
      type(cluster_type), intent(in) :: cluster
      type(judgement_type), intent(in) :: judgement
      type(polisher_type), intent(inout) :: polisher
      !> Of what is iterated; what takes the place of the members is put behind. Not allocated: nothing yet.
      type(eigenpairs_type), intent(inout) :: found
      !> Members whose place is taken, and those that are no eigenvalues.
      logical, intent(inout) :: gone(:), nowhere(:)
      type(error_type), allocatable, intent(out) :: error
      ! Copies that may not be known, beside one or several members.
      integer, parameter :: guards(2) = [2, 4]
      type(polished_type) :: polished
      type(eigenpairs_type) :: members
      complex(wp) :: shift
      logical :: chosen(size(modes%lambda))
      logical, allocatable :: others(:)
      integer :: few, j

      chosen = .false.
      chosen(cluster%members) = .true.
      members = s%contract(chosen_pairs(modes, chosen))
      call polisher%factor_beside(s%work, cluster, shift, error)
      if (.not. allocated(error)) then
         call s%effort%add_factors(polisher%solver)
         few = guards(min(size(cluster%members), 2))
         ! Copies of oscillators are what Lanczos counts.
         if (modes%is_real() .and. size(cluster%members) == 1) few = 0
         call polisher%polish(s%work, cluster, shift, members, maxval(judgement%errors(cluster%members)), few, polished, error)
      end if
      if (allocated(error)) then
         if (all(error%code /= [error_singular, error_convergence, error_cancelled])) return
         deallocate (error)
         return
      end if
      if (is_accepted()) then
         gone(cluster%members) = .true.
         if (modes%is_real()) call make_real(s%transform%map, polished%pairs)
         if (allocated(found%lambda)) then
            ! Eigenvalues known so badly that they were not near to each other may be found beside both.
            allocate (others(size(polished%errors)))
            do j = 1, size(others)
               others(j) = rest_beside(found, polished%pairs, j, same_value) > dependent_state
            end do
            call keep_pairs(polished%pairs, others)
            call append_pairs(found, polished%pairs)
         else
            found = polished%pairs
         end if
      else if (polished%eigenvalues == 0) then
         nowhere(cluster%members) = judgement%doubtful(cluster%members) .or. judgement%errors(cluster%members) > spurious
      end if

   contains

      ! All that there are, or as many as there were, and known better.
      logical function is_accepted()
         integer :: before

         before = size(members%lambda)
         if (cluster%on_axis) before = before + count(abs(aimag(members%lambda)) > 0)
         is_accepted = polished%complete .or. (polished%eigenvalues >= before .and. (polished%worst() <= polisher%above .or. &
            polished%worst() < maxval(judgement%errors(cluster%members))))
      end function is_accepted
   end subroutine polish_cluster

   ! Shapes of oscillators are real but for their phase; those of copies are combinations, and become orthogonal.
   subroutine make_real(map, pairs)
      type(spectral_map_type), intent(in) :: map
      type(eigenpairs_type), intent(inout) :: pairs
      complex(wp) :: xi(size(pairs%xi, 1), 2)
      real(wp) :: shape(pairs%rows(), 2), left(2)
      integer :: i, j, l

      allocate (pairs%real_phi(pairs%rows(), size(pairs%lambda)))
      do j = 1, size(pairs%lambda)
         ! Normalised, their largest entries are real. Multipliers of a real shape are real but for the factor of damping.
         associate (reaction => map%reaction(pairs%lambda(j)))
            shape = reshape([real(pairs%phi(:, j), wp), aimag(pairs%phi(:, j))], shape=[size(shape, 1), 2])
            xi(:, 1) = reaction*real(pairs%xi(:, j)/reaction, wp)
            xi(:, 2) = reaction*aimag(pairs%xi(:, j)/reaction)
         end associate
         do l = 1, 2
            do i = 1, j - 1
               if (abs(pairs%lambda(i) - pairs%lambda(j)) > cancelled*abs(pairs%lambda(j))) cycle
               associate (part => dot_product(pairs%real_phi(:, i), shape(:, l)))
                  shape(:, l) = shape(:, l) - part*pairs%real_phi(:, i)
                  xi(:, l) = xi(:, l) - part*pairs%xi(:, i)
               end associate
            end do
            left(l) = norm2(shape(:, l))
         end do
         l = merge(1, 2, left(1) > same_shape)
         if (left(2) > same_shape .or. l == 1) then
            pairs%real_phi(:, j) = shape(:, l)/left(l)
            pairs%xi(:, j) = xi(:, l)/left(l)
         else
            ! The shape of a double root.
            pairs%real_phi(:, j) = real(pairs%phi(:, j), wp)
         end if
      end do
      deallocate (pairs%phi)
   end subroutine make_real
end module kschur_finishing
