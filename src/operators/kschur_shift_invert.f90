!> The shift-invert operator of a pencil.
module kschur_shift_invert
   use kschur_deflation, only: deflation_type
   use kschur_error, only: error_type, new_error, error_singular
   use kschur_kinds, only: wp, long
   use kschur_linear_solver, only: complex_linear_solver_type
   use kschur_memory, only: require_memory
   use kschur_operator, only: complex_operator_type
   use kschur_pencil, only: pencil_type
   use kschur_random, only: random_vector
   use kschur_sparse, only: csr_matrix_type, complex_csr_matrix_type, complex_combination
   use kschur_tolerances, only: known_well, rounding_of_sums, singular_shift
   implicit none
   private
   public :: shift_invert_type, new_shift_invert

   !> C = (A - sigma B)^{-1} B, eqs. (41), (46a), (46b), Algorithm 3 of the paper.
   !>
   !> Vectors do not include multipliers, whose units differ from those of motions. Spurious zero eigenvalues would give mu =
   !> -1/sigma, in Jordan blocks of size 2 and 3, and be the most wanted of all; they belong to multipliers and to motions that
   !> violate the constraints. Without multipliers all of them become mu = 0, as infinite eigenvalues do, since C maps any phi
   !> to one with Cq phi = 0; the modes, rigid ones too, are unchanged.
   type, extends(complex_operator_type) :: shift_invert_type
      type(pencil_type) :: pencil
      !> sigma, a value of theta.
      complex(wp) :: shift = (0.0_wp, 0.0_wp)
      class(complex_linear_solver_type), allocatable :: solver
      type(deflation_type), pointer :: deflation => null()
      !> Whether vectors include multipliers, as in the paper.
      logical :: with_multipliers = .false.
   contains
      procedure :: order => shift_invert_order
      procedure :: apply => shift_invert_apply
      !> y := C x with the multipliers that `apply` omits: of an eigenvector xi/sigma instead of xi/theta, which is undefined
      !> for a rigid mode.
      procedure :: apply_with_multipliers
      !> theta of an eigenvalue mu of C, eq. (42).
      procedure :: theta => theta_of_ritz_value
   end type shift_invert_type

contains

   !> Factors A - sigma B. Fails if it is singular, that is if sigma is an eigenvalue, including spurious zeros; redundant
   !> constraints are allowed.
   subroutine new_shift_invert(operator, pencil, shift, solver, error, deflation)
      type(shift_invert_type), intent(out) :: operator
      type(pencil_type), intent(in) :: pencil
      !> sigma, a value of theta.
      complex(wp), intent(in) :: shift
      class(complex_linear_solver_type), allocatable, intent(inout) :: solver
      type(error_type), allocatable, intent(out) :: error
      !> Motions to be deflated.
      type(deflation_type), target, optional, intent(in) :: deflation
      type(csr_matrix_type), allocatable :: parts(:)
      type(complex_csr_matrix_type) :: shifted

      operator%pencil = pencil
      if (present(deflation)) operator%deflation => deflation
      operator%shift = shift
      call move_alloc(solver, operator%solver)
      if (pencil%has_spurious_zeros() .and. pencil%multipliers > 0 .and. .not. abs(shift) > 0) &
         call new_error(error, error_singular, "the shift must not be 0 in a formulation with spurious zeros: take another one")
      call require_memory(4*(pencil%a%bytes() + pencil%b%bytes()), "the shifted pencil", error)
      if (allocated(error)) return
      allocate (parts(merge(3, 2, allocated(pencil%loss))))
      parts(1) = pencil%a
      parts(2) = pencil%b
      if (allocated(pencil%loss)) parts(3) = pencil%loss
      shifted = complex_combination([(1.0_wp, 0.0_wp), -shift, (0.0_wp, 1.0_wp)], parts)
      deallocate (parts)
      call operator%solver%factorize(shifted, pencil%structure, error)
      if (.not. allocated(error)) call check_regular(operator, shifted, error)
   end subroutine new_shift_invert

   ! Fails if the shift is an eigenvalue: if a system with consistent right-hand side has no solution (null pivots alone may come
   ! from redundant constraints), or an eigenvalue of C is so large that rounding errors along its vector would swamp all others.
   subroutine check_regular(operator, shifted, error)
      type(shift_invert_type), intent(inout) :: operator
      type(complex_csr_matrix_type), intent(in) :: shifted
      type(error_type), allocatable, intent(out) :: error
      complex(wp), allocatable :: x(:, :), y(:, :), b(:)
      real(wp), allocatable :: random(:)
      real(wp) :: size_of_b, level
      logical :: singular
      integer(long) :: state
      integer :: n, i, k

      n = operator%order()
      allocate (random(n), x(n, 1), y(n, 1), b(n))
      state = 1
      call random_vector(state, random)
      x(:, 1) = random
      call right_hand_side(operator, x, y)
      b = y(:, 1)
      size_of_b = maxval(abs(b))
      call operator%solver%solve(y, error)
      if (allocated(error)) return
      do i = 1, n
         do k = shifted%row_start(i), shifted%row_start(i + 1) - 1
            b(i) = b(i) - shifted%value(k)*y(shifted%column(k), 1)
         end do
      end do
      singular = operator%solver%null_pivots > 0 .and. .not. maxval(abs(b)) <= known_well*size_of_b
      ! Scale of theta if sigma is 0.
      level = operator%pencil%unit
      if (.not. operator%pencil%is_damped()) level = level**2
      ! A zero pivot may give NaN.
      singular = singular .or. .not. norm2(abs(y)) <= huge(1.0_wp)
      if (.not. singular .and. norm2(abs(y)) > 0) then
         x = y/norm2(abs(y))
         call operator%apply(x, y, error)
         if (allocated(error)) return
         singular = .not. max(singular_shift*abs(operator%shift), rounding_of_sums*level)*norm2(abs(y)) <= 1
      end if
      if (singular) call new_error(error, error_singular, &
         "the shifted problem is singular: the shift is an eigenvalue; move it a little")
   end subroutine check_regular

   integer function shift_invert_order(self) result(order)
      class(shift_invert_type), intent(in) :: self

      order = self%pencil%a%rows
   end function shift_invert_order

   subroutine shift_invert_apply(self, x, y, error)
      class(shift_invert_type), intent(inout) :: self
      complex(wp), contiguous, intent(in) :: x(:, :)
      complex(wp), contiguous, intent(out) :: y(:, :)
      type(error_type), allocatable, intent(out) :: error

      call self%apply_with_multipliers(x, y, error)
      if (.not. (allocated(error) .or. self%with_multipliers)) y(size(y, 1) - self%pencil%multipliers + 1:, :) = 0
   end subroutine shift_invert_apply

   subroutine apply_with_multipliers(self, x, y, error)
      class(shift_invert_type), intent(inout) :: self
      complex(wp), contiguous, intent(in) :: x(:, :)
      complex(wp), contiguous, intent(out) :: y(:, :)
      type(error_type), allocatable, intent(out) :: error

      call right_hand_side(self, x, y)
      call self%solver%solve(y, error)
      if (allocated(error)) return
      if (self%pencil%has_spurious_zeros()) y = y + explicit_part(self%pencil, x)
      if (.not. associated(self%deflation)) return
      associate (n => self%pencil%unknowns)
         call self%deflation%project(y(:n, :))
         if (self%pencil%is_damped()) call self%deflation%project(y(n + 1:2*n, :))
      end associate
   end subroutine apply_with_multipliers

   ! Right-hand side of the system for C x, without its explicit part.
   subroutine right_hand_side(self, x, y)
      class(shift_invert_type), intent(in) :: self
      complex(wp), contiguous, intent(in) :: x(:, :)
      complex(wp), contiguous, intent(out) :: y(:, :)
      complex(wp), allocatable :: explicit(:, :)

      y = 0
      call self%pencil%b%add_product((1.0_wp, 0.0_wp), x, y)
      if (.not. self%pencil%has_spurious_zeros()) return
      allocate (explicit, source=explicit_part(self%pencil, x))
      ! Losses act on the first part of a state, where `explicit` is zero.
      call self%pencil%a%add_product((-1.0_wp, 0.0_wp), explicit, y)
      call self%pencil%b%add_product(self%shift, explicit, y)
      y(size(y, 1) - self%pencil%multipliers + 1:, :) = 0
   end subroutine right_hand_side

   ! The part of C x that is known without a solve. If the second part of x is lambda/unit phi, that of C x is (phi + sigma
   ! phi+)/unit; its first term, which may dominate, is added explicitly, so that Cq sigma phi+ = 0 holds without cancellation.
   pure function explicit_part(pencil, x) result(explicit)
      type(pencil_type), intent(in) :: pencil
      complex(wp), intent(in) :: x(:, :)
      complex(wp) :: explicit(size(x, 1), size(x, 2))

      explicit = 0
      if (.not. pencil%is_damped()) return
      associate (n => pencil%unknowns)
         explicit(n + 1:2*n, :) = x(:n, :)/pencil%unit
      end associate
   end function explicit_part

   pure complex(wp) function theta_of_ritz_value(self, mu) result(theta)
      class(shift_invert_type), intent(in) :: self
      complex(wp), intent(in) :: mu

      theta = huge(1.0_wp)
      if (abs(mu) > tiny(1.0_wp)) theta = self%shift + 1/mu
   end function theta_of_ritz_value
end module kschur_shift_invert
