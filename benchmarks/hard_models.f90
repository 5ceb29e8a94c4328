!> Small models of the hard cases, and what can be done to any model.
module hard_models
   use, intrinsic :: iso_fortran_env, only: real128
   use hard_judge, only: stop_on
   use kschur, only: csr_matrix_type, error_type, modal_problem_type, wp
   use kschur_scenes, only: build_scene
   use scene_assembly, only: assembly_type, new_assembly, triplets_type
   implicit none
   private
   public :: add_mass, add_spring, append, copies, damped, finished, half_sine_squares, in_millimetres, &
      in_units_of_their_own, scene, with_uneven_constraints

   real(real128), parameter :: pi = acos(-1.0_real128)

contains

   !> A scene, from its name and options.
   function scene(name, arguments) result(problem)
      character(len=*), intent(in) :: name, arguments(:)
      type(modal_problem_type) :: problem
      type(error_type), allocatable :: error

      call build_scene(name, arguments, problem, error)
      call stop_on(error)
   end function scene

   !> The problem of an assembly.
   function finished(assembly) result(problem)
      type(assembly_type), intent(in) :: assembly
      type(modal_problem_type) :: problem
      type(error_type), allocatable :: error

      call assembly%finish(problem, error)
      call stop_on(error)
   end function finished

   !> Adds a problem to an assembly.
   subroutine append(assembly, problem, before, columns, rows, energy, rayleigh)
      type(assembly_type), intent(inout) :: assembly
      type(modal_problem_type), intent(in) :: problem
      !> Unknowns before those of the problem.
      integer, intent(in) :: before
      !> Factors of the unknowns, of the constraints, and of M, K and R: x = columns*x_new.
      real(wp), intent(in), optional :: columns(:), rows(:), energy
      !> alpha (1/s) and beta (s) of a damping in the place of the one there is.
      real(wp), intent(in), optional :: rayleigh(2)
      real(wp) :: column_factors(problem%unknowns()), row_factors(problem%multipliers()), factor

      column_factors = 1
      if (present(columns)) column_factors = columns
      row_factors = 1
      if (present(rows)) row_factors = rows
      factor = 1
      if (present(energy)) factor = energy
      call add(assembly%mass, problem%mass, factor*column_factors, column_factors, before, before)
      call add(assembly%stiffness, problem%stiffness, factor*column_factors, column_factors, before, before)
      if (present(rayleigh)) then
         call add(assembly%damping, problem%mass, rayleigh(1)*factor*column_factors, column_factors, before, before)
         call add(assembly%damping, problem%stiffness, rayleigh(2)*factor*column_factors, column_factors, before, before)
      else
         call add(assembly%damping, problem%damping, factor*column_factors, column_factors, before, before)
      end if
      call add(assembly%constraints, problem%constraints, row_factors, column_factors, assembly%multipliers, before)
      assembly%multipliers = assembly%multipliers + problem%multipliers()
   end subroutine append

   subroutine add(triplets, matrix, row_factors, column_factors, rows_before, columns_before)
      type(triplets_type), intent(inout) :: triplets
      type(csr_matrix_type), intent(in) :: matrix
      real(wp), intent(in) :: row_factors(:), column_factors(:)
      integer, intent(in) :: rows_before, columns_before
      integer :: i, k

      do i = 1, matrix%rows
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            associate (j => matrix%column(k))
               call triplets%add_entry(rows_before + i, columns_before + j, &
                  row_factors(i)*column_factors(j)*matrix%value(k))
            end associate
         end do
      end do
   end subroutine add

   !> The same problem several times, apart from each other.
   function copies(problem, count, rayleigh) result(several)
      type(modal_problem_type), intent(in) :: problem
      integer, intent(in) :: count
      real(wp), intent(in), optional :: rayleigh(2)
      type(modal_problem_type) :: several
      type(assembly_type) :: assembly
      integer :: i

      assembly = new_assembly(count*problem%unknowns())
      do i = 0, count - 1
         call append(assembly, problem, i*problem%unknowns(), rayleigh=rayleigh)
      end do
      several = finished(assembly)
   end function copies

   !> The same in millimetres, tonnes and seconds: energy in N mm, rotations in rad. Every
   !> node has six unknowns, every joint six rows.
   function in_millimetres(problem) result(changed)
      type(modal_problem_type), intent(in) :: problem
      type(modal_problem_type) :: changed
      real(wp), parameter :: mm = 1.0e-3_wp
      type(assembly_type) :: assembly
      integer :: k

      assembly = new_assembly(problem%unknowns())
      call append(assembly, problem, 0, columns=[(merge(mm, 1.0_wp, mod(k - 1, 6) < 3), k=1, problem%unknowns())], &
         rows=[(merge(1/mm, 1.0_wp, mod(k - 1, 6) < 3), k=1, problem%multipliers())], energy=1/mm)
      changed = finished(assembly)
   end function in_millimetres

   !> The same with unknowns in units of their own, powers of two between 2^-16 and 2^16 in no order:
   !> the matrices are scaled without rounding.
   function in_units_of_their_own(problem) result(changed)
      type(modal_problem_type), intent(in) :: problem
      type(modal_problem_type) :: changed
      type(assembly_type) :: assembly
      integer :: k

      assembly = new_assembly(problem%unknowns())
      call append(assembly, problem, 0, columns=[(scale(1.0_wp, mod(k*(7*k + 3)/2 + k/5, 33) - 16), k=1, problem%unknowns())])
      changed = finished(assembly)
   end function in_units_of_their_own

   !> The same with every constraint multiplied by 1e8 or by 1e-8, in no order.
   function with_uneven_constraints(problem) result(changed)
      type(modal_problem_type), intent(in) :: problem
      type(modal_problem_type) :: changed
      type(assembly_type) :: assembly
      integer :: k

      assembly = new_assembly(problem%unknowns())
      call append(assembly, problem, 0, &
         rows=[(merge(1.0e8_wp, 1.0e-8_wp, mod(k*(k + 3)/2 + k/5, 2) == 0), k=1, problem%multipliers())])
      changed = finished(assembly)
   end function with_uneven_constraints

   subroutine add_mass(assembly, unknown, mass)
      type(assembly_type), intent(inout) :: assembly
      integer, intent(in) :: unknown
      real(wp), intent(in) :: mass

      call assembly%mass%add_entry(unknown, unknown, mass)
   end subroutine add_mass

   !> A spring between two unknowns; 0 is the ground.
   subroutine add_spring(assembly, first, second, stiffness)
      type(assembly_type), intent(inout) :: assembly
      integer, intent(in) :: first, second
      real(wp), intent(in) :: stiffness

      call assembly%stiffness%add_block([first, second], [first, second], &
         stiffness*reshape([1.0_wp, -1.0_wp, -1.0_wp, 1.0_wp], [2, 2]))
   end subroutine add_spring

   !> 4 sin^2(j pi/p), j = first ... last.
   pure function half_sine_squares(first, last, p) result(values)
      integer, intent(in) :: first, last, p
      real(real128) :: values(last - first + 1)
      integer :: j

      values = [(4*sin(j*pi/p)**2, j=first, last)]
   end function half_sine_squares

   !> The roots of lambda^2 + (alpha + beta omega^2) lambda + omega^2 = 0, Im >= 0. What is
   !> rounding of a zero is one: without damping a double root, counted once.
   function damped(squared, rayleigh) result(lambda)
      !> omega^2 (1/s^2).
      real(real128), intent(in) :: squared(:)
      !> alpha (1/s) and beta (s).
      real(wp), intent(in), optional :: rayleigh(2)
      complex(wp), allocatable :: lambda(:)
      real(real128), parameter :: vanishing = 1.0e-24_real128
      real(real128) :: half, product, root
      integer :: i

      allocate (lambda(0))
      do i = 1, size(squared)
         product = merge(squared(i), 0.0_real128, abs(squared(i)) > vanishing*maxval(abs(squared)))
         half = 0
         if (present(rayleigh)) half = (rayleigh(1) + rayleigh(2)*product)/2
         root = sqrt(abs(half**2 - product))
         if (half**2 < product) then
            lambda = [lambda, cmplx(-half, root, wp)]
         else if (half > 0) then
            lambda = [lambda, cmplx(-half - root, 0, wp), cmplx(-product/(half + root), 0, wp)]
         else
            lambda = [lambda, (0.0_wp, 0.0_wp)]
         end if
      end do
   end function damped
end module hard_models
