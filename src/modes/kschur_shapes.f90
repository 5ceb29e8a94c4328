!> Shapes compared: which eigenpairs are the same.
module kschur_shapes
   use kschur_description, only: form
   use kschur_eigenpairs, only: append_pairs, chosen_pairs, eigenpairs_type, normalize
   use kschur_kinds, only: wp
   use kschur_lapack, only: dznrm2
   use kschur_problem, only: modal_problem_type
   use kschur_tolerances, only: nearly_zero, rounding_of_row, rounding_of_sums, same_shape
   implicit none
   private
   public :: orthonormalize_zeros, repeats_zero, rest_beside, rest_of_state

contains

   !> Makes the shapes of the pairs with eigenvalue zero orthonormal, and normalises all.
   subroutine orthonormalize_zeros(pairs)
      !> With real shapes, as rigid motions have.
      type(eigenpairs_type), intent(inout) :: pairs
      real(wp) :: factor
      integer :: i, j, pass

      associate (phi => pairs%real_phi, xi => pairs%xi)
         do j = 1, size(pairs%lambda)
            if (abs(pairs%lambda(j)) > 0) cycle
            do pass = 1, 2
               do i = 1, j - 1
                  if (abs(pairs%lambda(i)) > 0) cycle
                  factor = dot_product(phi(:, i), phi(:, j))
                  phi(:, j) = phi(:, j) - factor*phi(:, i)
                  xi(:, j) = xi(:, j) - factor*xi(:, i)
               end do
               factor = 1/norm2(phi(:, j))
               phi(:, j) = factor*phi(:, j)
               xi(:, j) = factor*xi(:, j)
            end do
         end do
      end associate
      do j = 1, size(pairs%lambda)
         call normalize(pairs, j)
      end do
   end subroutine orthonormalize_zeros

   !> Which of the first k pairs are a zero that the rigid motions, the others, stand for already. Such a motion has the
   !> roots 0 and -r/m of lambda^2 m + lambda r = 0: it is the nearer one that an iteration blurred.
   function repeats_zero(problem, pairs, k, rigid, reference) result(repeats)
      type(modal_problem_type), intent(in) :: problem
      type(eigenpairs_type), intent(in) :: pairs
      !> The rigid motions are the next `rigid` pairs.
      integer, intent(in) :: k, rigid
      !> A size of lambda (1/s), as the shift, against which zeros are seen.
      real(wp), intent(in) :: reference
      logical :: repeats(k)
      complex(wp), allocatable :: zeros(:, :), shape(:)
      complex(wp) :: m, r, s
      real(wp) :: m_terms, r_terms, k_terms, smallest, largest
      logical :: pending(k)
      integer :: i, j, l

      repeats = .false.
      if (min(rigid, k) == 0) return
      ! Seen against any of them.
      if (minval(abs(pairs%lambda(:k))) > nearly_zero*max(reference, maxval(abs(pairs%lambda(:k))))) return
      allocate (zeros(pairs%rows(), rigid), shape(pairs%rows()))
      l = 0
      do i = k + 1, k + rigid
         if (abs(pairs%lambda(i)) > 0) cycle
         call take_rest(pairs, i, zeros(:, :l), shape)
         if (.not. length(shape) > epsilon(1.0_wp)/same_shape) cycle
         l = l + 1
         zeros(:, l) = shape/length(shape)
      end do
      ! From the smallest one on, as far as a zero may lie: shapes cost more than places.
      pending = .true.
      smallest = huge(1.0_wp)
      do i = 1, k
         j = minloc(abs(pairs%lambda(:k)), 1, pending)
         pending(j) = .false.
         if (smallest < huge(1.0_wp) .and. abs(pairs%lambda(j)) > nearly_zero*max(reference, smallest)) exit
         call take_rest(pairs, j, zeros(:, :l), shape)
         repeats(j) = length(shape) <= same_shape
         if (.not. repeats(j)) smallest = min(smallest, abs(pairs%lambda(j)))
      end do
      largest = reference
      if (smallest < huge(1.0_wp)) largest = max(reference, smallest)
      do j = 1, size(repeats)
         if (.not. repeats(j)) cycle
         shape = pairs%column(j)
         call form(problem%mass, shape, m, m_terms)
         call form(problem%damping, shape, r, r_terms)
         call form(problem%stiffness, shape, s, k_terms)
         repeats(j) = abs(pairs%lambda(j)) <= nearly_zero*largest .and. (abs(r) <= rounding_of_row*r_terms .or. &
            abs(pairs%lambda(j)**2)*m_terms <= rounding_of_sums*k_terms .or. &
            abs(pairs%lambda(j)*m) < abs(pairs%lambda(j)*m + r))
         if (repeats(j)) repeats(j) = .not. is_decay(j)
      end do

   contains

      ! Whether damping and inertia balance each other. Of an unsymmetric problem shape^* R shape does not tell.
      logical function is_decay(j)
         integer, intent(in) :: j
         real(wp), parameter :: most = 0.5_wp
         complex(wp), dimension(pairs%rows(), 1) :: phi, inertia, total
         real(wp) :: units(pairs%rows())

         phi(:, 1) = pairs%column(j)
         inertia = 0
         call problem%mass%add_product(pairs%lambda(j), phi, inertia)
         total = inertia
         call problem%damping%add_product((1.0_wp, 0.0_wp), phi, total)
         units = 1
         if (allocated(pairs%weights)) then
            where (pairs%weights > 0) units = 1/pairs%weights
         end if
         is_decay = norm2(units*abs(total(:, 1))) < most*norm2(units*abs(inertia(:, 1)))
      end function is_decay
   end function repeats_zero

   !> What the state of a pair of one list has outside the span of those of another list that are near to its eigenvalue.
   real(wp) function rest_beside(pairs, others, j, distance) result(rest)
      class(eigenpairs_type), intent(in) :: pairs, others
      !> Of the others.
      integer, intent(in) :: j
      !> How near, relative to it.
      real(wp), intent(in) :: distance
      type(eigenpairs_type) :: near
      integer :: i

      near = chosen_pairs(pairs, abs(pairs%lambda - others%lambda(j)) <= distance*abs(others%lambda(j)))
      if (allocated(others%weights)) near%weights = others%weights
      call append_pairs(near, chosen_pairs(others, [(i == j, i=1, size(others%lambda))]))
      rest = rest_of_state(near, [(i, i=1, size(near%lambda) - 1)], size(near%lambda))
   end function rest_beside

   !> What the state [phi; lambda phi/|lambda|] of pair j, of unit norm in the units in which shapes are compared, has outside
   !> the span of those of other pairs.
   real(wp) function rest_of_state(pairs, others, j) result(rest)
      class(eigenpairs_type), intent(in) :: pairs
      !> Their positions.
      integer, intent(in) :: others(:), j
      complex(wp) :: states(2*pairs%rows(), size(others)), state(2*pairs%rows())
      integer :: i, kept

      kept = 0
      do i = 1, size(others)
         state = state_of(others(i))
         call take_out(states(:, :kept), state)
         if (.not. length(state) > epsilon(1.0_wp)/same_shape) cycle
         kept = kept + 1
         states(:, kept) = state/length(state)
      end do
      state = state_of(j)
      call take_out(states(:, :kept), state)
      rest = length(state)

   contains

      function state_of(i) result(state)
         integer, intent(in) :: i
         complex(wp) :: state(2*pairs%rows())

         associate (n => pairs%rows(), lambda => pairs%lambda(i))
            state(:n) = pairs%column(i)
            if (allocated(pairs%weights)) state(:n) = pairs%weights*state(:n)
            state(n + 1:) = lambda/max(abs(lambda), tiny(1.0_wp))*state(:n)
         end associate
         state = state/max(length(state), tiny(1.0_wp))
      end function state_of
   end function rest_of_state

   ! What the shape of pair i, of unit norm in the units in which shapes are compared, has outside a span.
   subroutine take_rest(pairs, i, span, rest)
      type(eigenpairs_type), intent(in) :: pairs
      integer, intent(in) :: i
      !> Orthonormal columns.
      complex(wp), intent(in) :: span(:, :)
      complex(wp), contiguous, intent(out) :: rest(:)

      rest = pairs%column(i)
      if (allocated(pairs%weights)) rest = pairs%weights*rest
      rest = rest/max(length(rest), tiny(1.0_wp))
      call take_out(span, rest)
   end subroutine take_rest

   ! Takes out of a vector what lies in a span.
   subroutine take_out(span, x)
      !> Orthonormal columns.
      complex(wp), intent(in) :: span(:, :)
      complex(wp), contiguous, intent(inout) :: x(:)
      integer :: l, pass

      do pass = 1, 2
         do l = 1, size(span, 2)
            x = x - dot_product(span(:, l), x)*span(:, l)
         end do
      end do
   end subroutine take_out

   real(wp) function length(x)
      complex(wp), contiguous, intent(in) :: x(:)

      length = dznrm2(size(x), x, 1)
   end function length
end module kschur_shapes
