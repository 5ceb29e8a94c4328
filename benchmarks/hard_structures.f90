!> Hard cases: cantilevers under ever heavier bodies, free bodies, grids.
module hard_structures
   use, intrinsic :: iso_fortran_env, only: real128
   use cantilever_reference, only: eigenvalues, elements, frequencies, tip_masses
   use dense_reference, only: dense_shapes
   use hard_judge, only: case_type, judge_type, stop_on
   use hard_models, only: copies, damped, in_millimetres, in_units_of_their_own, scene, with_uneven_constraints
   use kschur, only: error_type, formulation_undamped_constrained, modal_options_type, modal_problem_type, &
      modal_result_type, presolve, presolve_type, solve_modes, text, wp
   use quad_reference, only: quad_rayleigh_quotients, quad_squared_frequencies
   use scene_beam, only: table_2_rayleigh
   implicit none
   private
   public :: examine_cantilevers, examine_free_bodies, examine_grids

   complex(wp), parameter :: i = (0.0_wp, 1.0_wp)

contains

   !> Tip masses of 4e3 to 1e9 kg, meshes of 10 to 1000 elements.
   subroutine examine_cantilevers(judge)
      type(judge_type), intent(inout) :: judge
      type(case_type) :: case
      integer :: k, l

      case%options = modal_options_type(modes=8)
      do l = 1, size(elements)
         ! The condition of the matrices grows as the fourth power of the number of elements.
         case%accuracy = 1.0e-9_wp*max(1.0_wp, elements(l)/30.0_wp)**4
         do k = 1, size(tip_masses)
            case%name = "cantilever, "//text(elements(l))//" elements, "//tip_masses(k)//" kg"
            case%expected = eigenvalues(:, l, k)
            call judge%examine(case, cantilever("rayleigh"))
            case%name = case%name//", undamped"
            case%expected = i*frequencies(:, l, k)
            call judge%examine(case, cantilever("none"))
         end do
      end do

   contains

      function cantilever(damping) result(problem)
         character(len=*), intent(in) :: damping
         type(modal_problem_type) :: problem

         problem = scene("cantilever", [character(len=10) :: "--elements", text(elements(l)), "--tip-mass", tip_masses(k), &
            "--damping", damping])
      end function cantilever
   end subroutine examine_cantilevers

   !> Bodies that nothing holds: six zeros each, and flexible modes as one alone.
   subroutine examine_free_bodies(judge)
      type(judge_type), intent(inout) :: judge
      integer, parameter :: bodies(3) = [1, 2, 7], flexible = 6, rigid = 6
      type(modal_problem_type) :: body
      type(case_type) :: case
      real(real128), allocatable :: squared(:)
      integer :: k, j

      body = scene("free-free", [character(len=9) :: "--bodies", "1", "--damping", "none"])
      call quad_squared_frequencies(body, squared)
      ! The rounding of K is their only stiffness.
      squared(:rigid) = 0
      do k = 1, size(bodies)
         case%expected = damped([(squared, j=1, bodies(k))])
         case%options%modes = bodies(k)*(rigid + flexible)
         case%name = text(bodies(k))//" free bodies"
         call judge%examine(case, copies(body, bodies(k)))
         ! Damped by its mass as well, a rigid motion has the roots 0 and -alpha.
         case%expected = damped([(squared, j=1, bodies(k))], table_2_rayleigh)
         case%options%modes = bodies(k)*(2*rigid + flexible)
         case%name = text(bodies(k))//" free bodies, Rayleigh damping"
         call judge%examine(case, copies(body, bodies(k), table_2_rayleigh))
      end do
   end subroutine examine_free_bodies

   !> The paper's grids. The undamped shapes come by another way, dense LAPACK or the paper's
   !> undamped pencil; their Rayleigh quotients in quadruple precision map to lambda.
   subroutine examine_grids(judge, full)
      type(judge_type), intent(inout) :: judge
      !> Whether to take the large one as well.
      logical, intent(in) :: full
      character(len=*), parameter :: cells(3) = [character(len=5) :: "6x4", "20x14", "60x42"]
      integer, parameter :: modes(3) = [32, 56, 56]
      type(modal_problem_type) :: grid
      type(case_type) :: case
      integer :: k

      case%backward = 1.0e-14_wp
      case%accuracy_quadratic = 1.0e-8_wp
      case%ratios = .true.
      do k = 1, merge(3, 2, full)
         case%name = "grid "//trim(cells(k))//", damping ratios"
         case%options%modes = modes(k)
         case%expected = damped(grid_squares(cells(k), modes(k), k == 1), table_2_rayleigh)
         grid = scene("grid", [character(len=8) :: "--cells", cells(k)])
         call judge%examine(case, grid)
         if (k > 1) cycle
         case%name = "grid "//trim(cells(k))//", uneven constraints"
         call judge%examine(case, with_uneven_constraints(grid))
         case%name = "grid "//trim(cells(k))//", any units"
         call judge%examine(case, in_units_of_their_own(grid))
         ! Converted, the matrices are others, by rounding.
         case%name = "grid "//trim(cells(k))//", in mm, t, s"
         case%accuracy = 1.0e-9_wp
         call judge%examine(case, in_millimetres(grid))
         case%accuracy = 1.0e-10_wp
      end do
   end subroutine examine_grids

   ! omega^2 of the modes of a grid.
   function grid_squares(cells, modes, small) result(squared)
      character(len=*), intent(in) :: cells
      integer, intent(in) :: modes
      !> Whether to use dense matrices.
      logical, intent(in) :: small
      real(real128), allocatable :: squared(:)
      ! Of the size of the lowest omega^2 (1/s^2).
      real(wp), parameter :: level = 1
      type(modal_problem_type) :: problem, reduced
      type(presolve_type) :: plan
      type(modal_result_type) :: result
      type(error_type), allocatable :: error
      complex(wp), allocatable :: shapes(:, :)

      problem = scene("grid", [character(len=9) :: "--cells", cells, "--damping", "none"])
      if (small) then
         call presolve(problem, reduced, plan, error)
         call stop_on(error)
         call dense_shapes(reduced, level, shapes)
         call quad_rayleigh_quotients(reduced, shapes(:, :modes), squared)
      else
         call solve_modes(problem, modal_options_type(modes=modes, formulation=formulation_undamped_constrained), result, error)
         call stop_on(error)
         call quad_rayleigh_quotients(problem, result%eigenvectors, squared)
      end if
      ! One free body.
      squared(:6) = 0
   end function grid_squares
end module hard_structures
