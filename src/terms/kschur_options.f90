!> Options of the solver, with defaults.
module kschur_options
   use kschur_kinds, only: wp, long
   use kschur_tolerances, only: above_all_rounding
   implicit none
   private
   public :: modal_options_type, index_of_name

   !> Selects the smallest exact formulation available.
   integer, parameter, public :: formulation_auto = 0
   !> K phi = theta M phi, theta = -lambda^2 (Table 1, row 1).
   integer, parameter, public :: formulation_undamped = 1
   !> -K phi = theta M phi, theta = lambda^2 (Table 1, row 2).
   integer, parameter, public :: formulation_undamped_negative = 2
   !> Eq. (20), theta = lambda^2; the 2m spurious eigenvalues are infinite.
   integer, parameter, public :: formulation_undamped_constrained = 3
   !> Eq. (22), theta = lambda^2; the 2m spurious eigenvalues are zeros.
   integer, parameter, public :: formulation_undamped_constrained_zero = 4
   !> Eq. (30), theta = lambda.
   integer, parameter, public :: formulation_damped = 5
   !> Eq. (33), theta = lambda; the 3m spurious eigenvalues are infinite.
   integer, parameter, public :: formulation_damped_constrained = 6
   !> Eq. (34) with [0 Cq 0] as third block row of B, theta = lambda; the 3m
   !> spurious eigenvalues are zeros. (The paper's [Cq 0 0] is a combination of
   !> the first block row, so that B is singular.)
   integer, parameter, public :: formulation_damped_constrained_zero = 7
   !> The structured form of (33), of order n + m; theta = lambda.
   integer, parameter, public :: formulation_quadratic = 8
   !> Symmetric, undamped: Lanczos on order n + m; theta = omega^2.
   integer, parameter, public :: formulation_symmetric = 9
   !> Symmetric with R = alpha M + beta K: the undamped modes, mapped.
   integer, parameter, public :: formulation_proportional = 10
   !> All eigenvalues by LAPACK, from the dense matrix of the operator of one of the last three on the null space of the
   !> constraints.
   integer, parameter, public :: formulation_dense = 11
   !> Symmetric, proportionally damped plus local forces: undamped Lanczos started with their responses, and the damped problem
   !> projected on its space; theta = lambda.
   integer, parameter, public :: formulation_low_rank = 12
   !> Names of the formulations, from `formulation_auto` on.
   character(len=*), parameter, public :: formulation_names(0:12) = [character(len=25) :: "auto", &
      "undamped", "undamped-negative", "undamped-constrained", "undamped-constrained-zero", "damped", &
      "damped-constrained", "damped-constrained-zero", "quadratic", "symmetric", "proportional", "dense", &
      "low-rank"]

   !> Unscaled Cq.
   integer, parameter, public :: scaling_none = 0
   !> One factor for all of Cq, as in the paper's section 5.
   integer, parameter, public :: scaling_scalar = 1
   !> One factor for each row of Cq, which scales it to the stiffness of the unknowns it constrains.
   integer, parameter, public :: scaling_row = 2
   !> Names of the constraint scalings, from `scaling_none` on.
   character(len=*), parameter, public :: scaling_names(0:2) = [character(len=6) :: "none", "scalar", "row"]

   !> `ldl` if the matrix is symmetric and definite, or indefinite with factors that grow little, or complex with a numerical range
   !> in a half plane; else `mumps`.
   integer, parameter, public :: inner_auto = 0
   !> MUMPS with METIS: any matrix.
   integer, parameter, public :: inner_mumps = 1
   !> LDL^T without pivoting: symmetric matrices, definite except for multipliers or with factors that grow little, or complex ones
   !> with a numerical range in a half plane.
   integer, parameter, public :: inner_ldl = 2
   !> Flexible GMRES, preconditioned by factors in single precision, LDL^T where that fits, else MUMPS: if double-precision
   !> factors exceed memory.
   integer, parameter, public :: inner_iterative = 3
   !> Names of the inner solvers, from `inner_auto` on.
   character(len=*), parameter, public :: inner_names(0:3) = [character(len=9) :: "auto", "mumps", "ldl", "iterative"]

   !> Shapes of unit Euclidean norm.
   integer, parameter, public :: normalisation_length = 0
   !> Shapes of unit mass, phi^* M phi = 1.
   integer, parameter, public :: normalisation_mass = 1
   !> Shapes whose largest entry is 1.
   integer, parameter, public :: normalisation_displacement = 2
   !> Names of the normalisations, from `normalisation_length` on.
   character(len=*), parameter, public :: normalisation_names(0:2) = [character(len=12) :: "length", "mass", "displacement"]

   !> Krylov-Schur, and Lanczos for the symmetric formulations.
   integer, parameter, public :: method_krylov_schur = 0
   !> ARPACK on the same operators, as a baseline; one thread of a process at a time.
   integer, parameter, public :: method_arpack = 1
   !> Names of the methods, from `method_krylov_schur` on.
   character(len=*), parameter, public :: method_names(0:1) = [character(len=12) :: "krylov-schur", "arpack"]

   !> ARPACK as used in the paper: pencil (33) with multipliers in the vectors, shift at target + 1e-3 1/s or as given, unscaled
   !> constraints; no deflation, elimination, filter or refinement.
   integer, parameter, public :: arpack_plain = 0
   !> ARPACK instead of Krylov-Schur, all else unchanged.
   integer, parameter, public :: arpack_fair = 1
   !> Names of ARPACK's settings, from `arpack_plain` on.
   character(len=*), parameter, public :: arpack_names(0:1) = [character(len=5) :: "plain", "fair"]

   !> What to compute and how.
   type :: modal_options_type
      !> Number of modes; a complex-conjugate pair is one, multiplicities count.
      integer :: modes = 10
      !> The modes nearest to this lambda are wanted (1/s).
      complex(wp) :: target = (0.0_wp, 0.0_wp)
      !> Shift (1/s); not allocated: chosen at the scale of the wanted modes.
      complex(wp), allocatable :: shift
      !> One of `method_*`.
      integer :: method = method_krylov_schur
      !> One of `arpack_*`, for `method_arpack`.
      integer :: arpack = arpack_fair
      !> One of `formulation_*`.
      integer :: formulation = formulation_auto
      !> One of `scaling_*`.
      integer :: constraint_scaling = scaling_row
      !> One of `inner_*`: what factors the matrix and solves with it.
      integer :: inner = inner_auto
      !> Largest dimension of the Krylov space, without columns that verifications add; 0: chosen from `modes`.
      integer :: subspace = 0
      !> Block size; 0: chosen by cost.
      integer :: block = 0
      !> A Ritz pair has converged when its residual is below this, relative to its Ritz value.
      real(wp) :: tolerance = 1.0e-12_wp
      !> The iteration ends instead of making this restart.
      integer :: max_restarts = 200
      !> Whether structured formulations eliminate clamped and tied unknowns before the iteration.
      logical :: presolve = .true.
      !> One of `normalisation_*`: the length of the shapes.
      integer :: normalisation = normalisation_length
      !> Whether to compute left eigenvectors and condition numbers as well.
      logical :: left = .false.
      !> Whether to prove by a count of eigenvalues that no mode is missing, if nothing else does: for any damping, with some 20
      !> to 120 complex factorisations.
      logical :: certify = .false.
      !> Whether `symmetric` and `proportional` omit the factorisation for their count: then nothing proves completeness.
      !> `low-rank` needs its count to terminate.
      logical :: uncounted = .false.
      !> Seed of the start vector; the same seed gives the same digits.
      integer :: seed = 1
      !> Number of threads; 0: the available cores, shared among concurrent solves.
      integer :: threads = 0
      !> Memory limit (bytes): a solve with a larger estimate takes `inner_iterative` for `inner_auto` if that stays below, else it
      !> is refused before any factorisation; 0: no limit.
      integer(long) :: memory = 0
      !> MPI communicator (`mpi_val` of an `MPI_Comm`) of the processes that call collectively, for a kschur built with MPI.
      !> Problem, options, monitor and result are those of its first process; errors reach all. Not allocated: one process.
      integer, allocatable :: communicator
      !> Smallest number of rows of matrices that all processes factor jointly.
      integer :: distribute = 20000
      !> Number of groups of processes that share the parts of a band, or of 500 or more modes near zero, each with its own
      !> factors; 0: as many as there are processes, or for distributed matrices as half of the memory of the machines holds.
      integer :: groups = 0
      !> File for checkpoints of the iteration; not allocated: none.
      character(len=:), allocatable :: checkpoint
      !> Checkpoint of the same problem and options to continue from; not allocated: none.
      character(len=:), allocatable :: resume
   contains
      !> Whether the unprocessed result of ARPACK is wanted.
      procedure :: is_plain
      !> Backward error up to which modes are not polished.
      procedure :: good_enough
   end type modal_options_type

contains

   pure logical function is_plain(self)
      class(modal_options_type), intent(in) :: self

      is_plain = self%method == method_arpack .and. self%arpack == arpack_plain
   end function is_plain

   ! A tenth of the tolerance, but above rounding.
   pure real(wp) function good_enough(self)
      class(modal_options_type), intent(in) :: self

      good_enough = max(above_all_rounding, self%tolerance/10)
   end function good_enough

   !> Position of `name` in a list of names counted from 0; -1 if it is not there.
   pure integer function index_of_name(name, names)
      character(len=*), intent(in) :: name
      character(len=*), intent(in) :: names(0:)

      do index_of_name = ubound(names, 1), 0, -1
         if (names(index_of_name) == name) return
      end do
   end function index_of_name
end module kschur_options
