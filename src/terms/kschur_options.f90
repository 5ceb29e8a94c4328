!> What a user may ask of the solver; every option has a default.
module kschur_options
   use kschur_kinds, only: wp, long
   implicit none
   private
   public :: modal_options_type, index_of_name

   !> `auto` takes the smallest exact formulation that is available.
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
   !> All eigenvalues by LAPACK, from the matrix of the operator of one of the last three on the motions that the
   !> constraints allow.
   integer, parameter, public :: formulation_dense = 11
   !> Symmetric and proportionally damped but for local forces: undamped Lanczos with the responses to these, and the whole
   !> problem projected on that space; theta = lambda.
   integer, parameter, public :: formulation_low_rank = 12
   !> The names of the formulations, in this order from `formulation_auto` on.
   character(len=*), parameter, public :: formulation_names(0:12) = [character(len=25) :: "auto", &
      "undamped", "undamped-negative", "undamped-constrained", "undamped-constrained-zero", "damped", &
      "damped-constrained", "damped-constrained-zero", "quadratic", "symmetric", "proportional", "dense", &
      "low-rank"]

   !> Cq as it is given.
   integer, parameter, public :: scaling_none = 0
   !> One factor for all of Cq, as in the paper's section 5.
   integer, parameter, public :: scaling_scalar = 1
   !> A factor for each row of Cq, which takes it to the stiffness level of the unknowns it ties.
   integer, parameter, public :: scaling_row = 2
   !> The names of the constraint scalings, in this order from `scaling_none` on.
   character(len=*), parameter, public :: scaling_names(0:2) = [character(len=6) :: "none", "scalar", "row"]

   !> `ldl` where the matrix to be factored is real, symmetric and definite, `mumps` for all others.
   integer, parameter, public :: inner_auto = 0
   !> MUMPS, with METIS: every matrix.
   integer, parameter, public :: inner_mumps = 1
   !> LDL^T without pivoting: real symmetric matrices, definite but for multipliers.
   integer, parameter, public :: inner_ldl = 2
   !> Flexible GMRES, preconditioned by MUMPS in single precision: where the factors do not fit into memory.
   integer, parameter, public :: inner_iterative = 3
   !> The names of the inner solvers, in this order from `inner_auto` on.
   character(len=*), parameter, public :: inner_names(0:3) = [character(len=9) :: "auto", "mumps", "ldl", "iterative"]

   !> Shapes of unit Euclidean norm.
   integer, parameter, public :: normalisation_length = 0
   !> Shapes of unit mass, phi^* M phi = 1.
   integer, parameter, public :: normalisation_mass = 1
   !> Shapes whose largest entry is 1.
   integer, parameter, public :: normalisation_displacement = 2
   !> The names of the normalisations, in this order from `normalisation_length` on.
   character(len=*), parameter, public :: normalisation_names(0:2) = [character(len=12) :: "length", "mass", "displacement"]

   !> Krylov-Schur, and Lanczos for the symmetric formulations.
   integer, parameter, public :: method_krylov_schur = 0
   !> ARPACK on the same operators, as a baseline; one thread of a process at a time.
   integer, parameter, public :: method_arpack = 1
   !> The names of the methods, in this order from `method_krylov_schur` on.
   character(len=*), parameter, public :: method_names(0:1) = [character(len=12) :: "krylov-schur", "arpack"]

   !> ARPACK as the paper compares with it: the pencil (33) with multipliers in the vectors, factored at the
   !> target + 1e-3 1/s or the shift that is given, constraints as they are, nothing deflated,
   !> eliminated, filtered or refined.
   integer, parameter, public :: arpack_plain = 0
   !> ARPACK in the place of Krylov-Schur, everything else being the same.
   integer, parameter, public :: arpack_fair = 1
   !> The names of ARPACK's settings, in this order from `arpack_plain` on.
   character(len=*), parameter, public :: arpack_names(0:1) = [character(len=5) :: "plain", "fair"]

   !> What to compute and how.
   type :: modal_options_type
      !> How many modes; a complex-conjugate pair is one, multiplicities count.
      integer :: modes = 10
      !> The modes nearest to this lambda are wanted (1/s).
      complex(wp) :: target = (0.0_wp, 0.0_wp)
      !> Where to factor (1/s); chosen at the scale of the wanted modes where not allocated.
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
      !> Largest dimension of the Krylov space, but for what a verification needs beside what is locked; 0: chosen from `modes`.
      integer :: subspace = 0
      !> Vectors that the Krylov space grows by at a time; 0: chosen by what costs least.
      integer :: block = 0
      !> A Ritz pair has converged when its residual is below this, relative to its Ritz value.
      real(wp) :: tolerance = 1.0e-12_wp
      !> The iteration gives up instead of making this restart.
      integer :: max_restarts = 200
      !> Whether the structured formulations eliminate clamped and tied unknowns first.
      logical :: presolve = .true.
      !> One of `normalisation_*`: the length of the shapes.
      integer :: normalisation = normalisation_length
      !> Whether to compute left eigenvectors and condition numbers as well.
      logical :: left = .false.
      !> Whether to count the eigenvalues about the target where nothing else proves that no mode is missing: for
      !> any damping, with some 20 to 120 complex factorisations.
      logical :: certify = .false.
      !> Whether `symmetric` and `proportional` leave out the factorisation by which they count: then nothing proves that no
      !> mode is missing. `low-rank` needs its count to come to an end.
      logical :: uncounted = .false.
      !> Seed of the start vector; the same seed gives the same digits.
      integer :: seed = 1
      !> Threads that compute; 0: as many cores as the process may use, shared among the solves that run at the same time.
      integer :: threads = 0
      !> A solve that is estimated to take more memory than this (bytes) is refused before anything is factored; 0: none is.
      integer(long) :: memory = 0
      !> The communicator of several processes, each of which calls: a handle of MPI (`mpi_val` of an `MPI_Comm`), for the
      !> kschur that was built with it. Problem, options, monitor and result are those of its first process; an error
      !> reaches all. Not allocated: this process works alone.
      integer, allocatable :: communicator
      !> Matrices of so many rows and more are factored by all processes together.
      integer :: distribute = 20000
      !> How many groups of processes share the parts of a band, or of 500 modes and more near zero, each with factors of its
      !> own; 0: as many as there are processes where a matrix is too small to be distributed, else one.
      integer :: groups = 0
      !> The file that the state of the iteration is written to now and then; not allocated: none.
      character(len=:), allocatable :: checkpoint
      !> The file that such a solve of the same problem with the same options left, to go on from; not allocated: none.
      character(len=:), allocatable :: resume
   contains
      !> Whether ARPACK's raw answer is wanted.
      procedure :: is_plain
   end type modal_options_type

contains

   pure logical function is_plain(self)
      class(modal_options_type), intent(in) :: self

      is_plain = self%method == method_arpack .and. self%arpack == arpack_plain
   end function is_plain

   !> Position of `name` in a list of names counted from 0; -1 if it is not there.
   pure integer function index_of_name(name, names)
      character(len=*), intent(in) :: name
      character(len=*), intent(in) :: names(0:)

      do index_of_name = ubound(names, 1), 0, -1
         if (names(index_of_name) == name) return
      end do
   end function index_of_name
end module kschur_options
