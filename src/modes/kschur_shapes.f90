!> Shapes compared: which eigenpairs are the same.
module kschur_shapes
   use kschur_description, only: form
   use kschur_eigenpairs, only: append_pairs, chosen_pairs, eigenpairs_type, normalize
   use kschur_kinds, only: wp
   use kschur_problem, only: modal_problem_type
   use kschur_tolerances, only: above_all_rounding, nearly_zero, rounding_of_row, rounding_of_sums, same_shape
   implicit none
   private
   public :: orthonormalize_zeros, repeats_zero, rest_beside, rests_of_states

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
   function repeats_zero(problem, pairs, k, rigid, reference, zero_noise) result(repeats)
      type(modal_problem_type), intent(in) :: problem
      type(eigenpairs_type), intent(in) :: pairs
      !> The rigid motions are the next `rigid` pairs.
      integer, intent(in) :: k, rigid
      !> A size of lambda (1/s), as the shift, against which zeros are seen.
      real(wp), intent(in) :: reference
      !> Below this (1/s) no eigenvalue of such a motion is told from zero, whatever its shape tells.
      real(wp), intent(in) :: zero_noise
      logical :: repeats(k)
      integer :: zeros(count(.not. abs(pairs%lambda(k + 1:k + rigid)) > 0))
      complex(wp) :: shape(pairs%rows())
      complex(wp) :: m, r, s, gram(size(zeros) + 1, size(zeros) + 1)
      real(wp) :: m_terms, r_terms, k_terms, smallest, largest
      logical :: pending(k)
      integer :: i, j

      repeats = .false.
      if (min(rigid, k) == 0) return
      ! Seen against any of them.
      if (minval(abs(pairs%lambda(:k))) > nearly_zero*max(reference, maxval(abs(pairs%lambda(:k))))) return
      zeros = pack([(i, i=k + 1, k + rigid)], .not. abs(pairs%lambda(k + 1:k + rigid)) > 0)
      do j = 1, size(zeros)
         do i = 1, j
            gram(i, j) = product_of_shapes(pairs, zeros(i), zeros(j))
         end do
      end do
      ! From the smallest one on, as far as a zero may lie: shapes cost more than places.
      pending = .true.
      smallest = huge(1.0_wp)
      do i = 1, k
         j = minloc(abs(pairs%lambda(:k)), 1, pending)
         pending(j) = .false.
         if (smallest < huge(1.0_wp) .and. abs(pairs%lambda(j)) > nearly_zero*max(reference, smallest)) exit
         repeats(j) = rest_beside_zeros(j) <= same_shape
         if (.not. repeats(j)) smallest = min(smallest, abs(pairs%lambda(j)))
      end do
      largest = reference
      if (smallest < huge(1.0_wp)) largest = max(reference, smallest)
      do j = 1, size(repeats)
         if (.not. repeats(j) .or. abs(pairs%lambda(j)) < zero_noise) cycle
         shape = pairs%column(j)
         call form(problem%mass, shape, m, m_terms)
         call form(problem%damping, shape, r, r_terms)
         call form(problem%stiffness, shape, s, k_terms)
         repeats(j) = abs(pairs%lambda(j)) <= nearly_zero*largest .and. (abs(r) <= rounding_of_row*r_terms .or. &
            abs(pairs%lambda(j)**2)*m_terms <= rounding_of_sums*k_terms .or. &
            abs(pairs%lambda(j)*m) < abs(pairs%lambda(j)*m + r))
         if (repeats(j)) repeats(j) = .not. is_decay(j)
         if (repeats(j)) repeats(j) = .not. is_eigenpair(j)
      end do

   contains

      ! What the shape of pair j has outside the span of rigid motions.
      real(wp) function rest_beside_zeros(j) result(rest)
         integer, intent(in) :: j
         integer :: last(size(zeros) + 1), i
         real(wp) :: rests(size(zeros) + 1)

         last = [zeros, j]
         do i = 1, size(last)
            gram(i, size(last)) = product_of_shapes(pairs, last(i), j)
         end do
         rests = distances_from_span(gram)
         rest = rests(size(rests))
      end function rest_beside_zeros

      ! Whether damping and inertia balance each other. Of an unsymmetric problem shape^* R shape does not tell.
      logical function is_decay(j)
         integer, intent(in) :: j
         real(wp), parameter :: most = 0.5_wp
         complex(wp), dimension(pairs%rows(), 1) :: phi, inertia, total

         phi(:, 1) = pairs%column(j)
         inertia = 0
         call problem%mass%add_product(pairs%lambda(j), phi, inertia)
         total = inertia
         call problem%damping%add_product((1.0_wp, 0.0_wp), phi, total)
         is_decay = norm2(abs(total(:, 1))) < most*norm2(abs(inertia(:, 1)))
      end function is_decay

      ! Whether inertia or damping is a force that the residual tells from none. A motion that is free gets such a small
      ! eigenvalue by a force as large.
      logical function is_eigenpair(j)
         integer, intent(in) :: j
         complex(wp), dimension(pairs%rows(), 1) :: phi, inertia, damping, rest

         phi(:, 1) = pairs%column(j)
         inertia = 0
         call problem%mass%add_product(pairs%lambda(j)**2, phi, inertia)
         damping = 0
         call problem%damping%add_product(pairs%lambda(j), phi, damping)
         rest = inertia + damping
         call problem%stiffness%add_product((1.0_wp, 0.0_wp), phi, rest)
         if (allocated(problem%loss)) call problem%loss%add_product((0.0_wp, 1.0_wp), phi, rest)
         call problem%constraints%add_transposed_product((1.0_wp, 0.0_wp), pairs%xi(:, j:j), rest)
         is_eigenpair = norm2(abs(rest)) < same_shape*max(norm2(abs(inertia)), norm2(abs(damping)))
      end function is_eigenpair
   end function repeats_zero

   !> What the state of a pair of one list has outside the span of those of another list that are near to its eigenvalue.
   real(wp) function rest_beside(pairs, others, j, distance) result(rest)
      class(eigenpairs_type), intent(in) :: pairs, others
      !> Of the others.
      integer, intent(in) :: j
      !> How near, relative to it.
      real(wp), intent(in) :: distance
      type(eigenpairs_type) :: near
      real(wp), allocatable :: rests(:)
      integer :: i

      near = chosen_pairs(pairs, abs(pairs%lambda - others%lambda(j)) <= distance*abs(others%lambda(j)))
      call append_pairs(near, chosen_pairs(others, [(i == j, i=1, size(others%lambda))]))
      allocate (rests, source=rests_of_states(near, [(i, i=1, size(near%lambda))]))
      rest = rests(size(rests))
   end function rest_beside

   !> What the states [phi; lambda phi/|lambda|] of some pairs, of unit norm, have outside the span of those before them.
   function rests_of_states(pairs, chosen) result(rests)
      class(eigenpairs_type), intent(in) :: pairs
      !> Their positions.
      integer, intent(in) :: chosen(:)
      real(wp) :: rests(size(chosen))
      complex(wp) :: gram(size(chosen), size(chosen)), direction(size(chosen))
      integer :: i, j

      direction = pairs%lambda(chosen)/max(abs(pairs%lambda(chosen)), tiny(1.0_wp))
      do j = 1, size(chosen)
         do i = 1, j
            gram(i, j) = product_of_shapes(pairs, chosen(i), chosen(j))*(1 + conjg(direction(i))*direction(j))
         end do
      end do
      rests = distances_from_span(gram)
   end function rests_of_states

   ! x_i^* x_j.
   complex(wp) function product_of_shapes(pairs, i, j) result(product)
      class(eigenpairs_type), intent(in) :: pairs
      integer, intent(in) :: i, j

      if (pairs%is_real()) then
         product = dot_product(pairs%real_phi(:, i), pairs%real_phi(:, j))
      else
         product = dot_product(pairs%phi(:, i), pairs%phi(:, j))
      end if
   end function product_of_shapes

   ! How far each of some vectors, of unit norm, is from the span of those before it: the roots of the pivots of their Gram
   ! matrix, which are known to the root of rounding. One that is not told from rounding takes no further part.
   pure function distances_from_span(gram) result(distances)
      !> The upper triangle.
      complex(wp), intent(in) :: gram(:, :)
      real(wp) :: distances(size(gram, 1)), pivot
      complex(wp) :: left(size(gram, 1), size(gram, 1))
      integer :: i, j, k

      left = gram
      do k = 1, size(gram, 1)
         pivot = real(left(k, k), wp)
         distances(k) = sqrt(max(pivot, 0.0_wp)/max(real(gram(k, k), wp), tiny(1.0_wp)))
         if (.not. distances(k)**2 > above_all_rounding) cycle
         do j = k + 1, size(gram, 1)
            do i = k + 1, j
               left(i, j) = left(i, j) - conjg(left(k, i))*left(k, j)/pivot
            end do
         end do
      end do
   end function distances_from_span
end module kschur_shapes
